"""Result of an optimal control problem: named signals, with plots, tables and files."""

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import numpy as np

from ocp.formulation.phase import Array, Free
from ocp.formulation.problem import Posed, Problem, posed
from ocp.solving.active import ActiveConditions, active_conditions, in_words
from ocp.solving.motion import ScenarioMotion, Stretch, at_times
from ocp.solving.optimum import Optimum
from ocp.solving.verification import Penalty, Verification, penalties_of
from ocp.transcription.program import Iterate, SolverStatistics
from ocp.transcription.schemes import Scheme
from ocp.transcription.unknowns import Values
from symfric.foundation import packed
from symfric.foundation.files import json_data, write_table, write_text
from symfric.foundation.parameters import check_names
from symfric.foundation.shown import Shown
from symfric.foundation.status import Status
from symfric.results.stored import Format, module
from symfric.results.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ocp.solving.active import Condition, Sensitivity
    from ocp.solving.linearised import Linearised


AT_BOUND = 1e-5
"""Relative distance from a bound within which a duration counts as equal to it."""


@final
@dataclass(frozen=True)
class Mode:
    """Time interval with a constant contact mode.

    Attributes:
        kind: "slip+", "slip-" or "stick".
        begin, end: limits of the interval [s].
    """

    kind: str
    begin: float
    end: float


@final
@dataclass(frozen=True, eq=False, repr=False)
class Solution(packed.Portable):
    """Optimal motion, and the verification of its control.

    `solution["v"]` is a signal at the times `solution.t`, which are the nodes of the mesh and the
    collocation points of all phases. With scenarios it belongs to the first one;
    `solution.scenarios["oiled"]["v"]` belongs to the scenario "oiled".

    Attributes:
        problem: the solved problem; its resolved form, `Posed`, if the solution was loaded.
        status: status of the solution, which `message` describes.
        cost: J.
        motions: motion of each scenario.
        chosen: values of the chosen parameters.
        statistics: size, and iterations and times of all solves.
        scheme, meshes, points, iterate: data for a warm start.
        modes: contact -> its modes in order; empty if friction was not solved by modes.
        verification: result of the re-simulation; None without verification.
        cause: exception in `progress` that stopped the solver, if any.
        optimum: the program with its multipliers; that of the arcs for a motion by modes. None
            in files of older versions.
    """

    problem: Problem = field(metadata={"packed": Posed})
    status: Status
    message: str
    cost: float
    motions: tuple[ScenarioMotion, ...]
    chosen: Mapping[str, float]
    statistics: SolverStatistics
    scheme: Scheme
    meshes: tuple[Array, ...]
    points: Values
    iterate: Iterate
    modes: Mapping[str, tuple[Mode, ...]] = field(default_factory=dict[str, tuple[Mode, ...]])
    verification: Verification | None = None
    cause: BaseException | None = None
    optimum: Optimum | None = None

    def __repr__(self) -> str:
        known = f", {'not ' * (not self.verified)}verified"
        checked = "" if self.verification is None else known
        return (
            f"<Solution of '{self.problem.name}': {self.status.name}, J = {self.cost:.6g}, "
            f"T = {self.T:.6g} s{checked}>"
        )

    def _repr_html_(self) -> str:  # pyright: ignore[reportUnusedFunction]
        """Return text and figure as HTML for a notebook."""
        title = f"Solution of '{self.problem.name}': {self.status.name}"
        return Shown(title, tuple(str(self).splitlines())).html(self.plot())

    def __str__(self) -> str:
        """Return a summary of a few lines."""
        phases = ", ".join(f"{phase.name} {phase.T:.4g} s" for phase in self.phases)
        several = f" ({phases})" if len(self.phases) > 1 else ""
        lines = [self.message, f"J = {self.cost:.6g}, T = {self.T:.6g} s{several}"]
        for phase, span in zip(self.phases, self.problem.chain, strict=True):
            least = span.T.lower if isinstance(span.T, Free) else 0.0
            if phase.T - least <= AT_BOUND * least:
                lines.append(f"{phase.name}: T is at its lower bound, {least:g} s")
        lines += [f"{name}: {penalty}" for name, penalty in self.soft.items()]
        if self.chosen:
            lines.append("chosen: " + ", ".join(f"{n} = {v:.6g}" for n, v in self.chosen.items()))
        if self.optimum is not None and self.ok:
            lines += in_words(self.optimum, self.signals)
        for contact, modes in self.modes.items():
            listed = ", ".join(f"{m.kind} {m.begin:.4g} ... {m.end:.4g} s" for m in modes)
            lines.append(f"{contact}: {listed}")
        if self.verification is not None:
            lines.append(str(self.verification).splitlines()[0])
        counts = self.statistics
        total = counts.build_time + counts.solve_time + counts.verify_time
        lines.append(f"solves: {counts.solves}, iterations: {counts.iterations}, {total:.2g} s")
        return "\n".join(lines)

    def __getitem__(self, name: str) -> Array:
        if name != "t":
            check_names(f"solution of '{self.problem.name}'", [name], self.signals)
        return self.motions[0][name]

    @property
    def ok(self) -> bool:
        """True if the status is that of a usable solution."""
        return self.status.ok

    @property
    def verified(self) -> bool:
        """True if solved, and the re-simulated motion satisfies all conditions within tolerance."""
        return self.ok and self.verification is not None and self.verification.ok

    @property
    def miss(self) -> float:
        """Largest relative miss of the verification; NaN without verification."""
        return float("nan") if self.verification is None else self.verification.largest

    @property
    def trajectories(self) -> tuple[Trajectory, ...]:
        """Re-simulated motion of each phase, in order; empty without verification."""
        return () if self.verification is None else tuple(self.verification.trajectories)

    @property
    def scenarios(self) -> dict[str, ScenarioMotion]:
        """Scenario -> motion; empty for a problem without scenarios."""
        return {motion.name: motion for motion in self.motions if motion.name}

    @property
    def T(self) -> float:
        """Total duration of all phases [s]."""
        return self.motions[0].T

    @property
    def t(self) -> Array:
        """Times of the signals [s], shape (n,); see `ScenarioMotion`."""
        return self.motions[0].t

    @property
    def signals(self) -> dict[str, Array]:
        """Name -> values, shape (n,); see `ScenarioMotion`."""
        return self.motions[0].signals

    @property
    def units(self) -> dict[str, str]:
        """SI unit of each signal by name."""
        return self.motions[0].units

    @property
    def t_control(self) -> Array:
        """Start of each interval [s], shape (N,)."""
        return self.motions[0].t_control

    @property
    def controls(self) -> dict[str, Array]:
        """Input -> value on each interval, shape (N,)."""
        return self.motions[0].controls

    @property
    def phases(self) -> tuple[Stretch, ...]:
        """Name, start time and duration of each phase."""
        return self.motions[0].phases

    @property
    def soft(self) -> dict[str, Penalty]:
        """Soft condition -> its cost and its largest violation."""
        return penalties_of(self.problem, self.scheme, self.meshes, self.points)

    @property
    def iterations(self) -> int:
        """Total number of iterations of all solves."""
        return self.statistics.iterations

    @property
    def states(self) -> dict[str, Array]:
        """State -> values, shape (n,)."""
        names = [v.name for i in self.motions[0].spans for v in self.problem.spans[i].model.x]
        return {name: self.signals[name] for name in dict.fromkeys(names)}

    @property
    def inputs(self) -> dict[str, Array]:
        """Input -> values, shape (n,)."""
        return {name: self.signals[name] for name in self.controls}

    @property
    def costates(self) -> dict[str, Array]:
        """State -> costate [cost/unit of the state] at the times `t`, shape (n,).

        The costate is the derivative of the optimal cost by the state at that time: at the start,
        by the start value. Where it jumps, it is the limit after the time. A motion by modes has no
        states of laws. Costates of coordinates in loops depend on each other.

        Raises:
            ValueError: the solution is not optimal, or was saved by an older version.
        """
        found = self._linearised("costates").central
        series = found.over_time(found.costates)
        series = at_times(self.motions[0], series.pop("t"), series)
        return {name: row for name, row in series.items() if name in self.signals}

    @property
    def hamiltonian(self) -> Array:
        """H = L + costate' x' + dE/dt [cost/s] at the times `t`, shape (n,), with end costs E.

        It is constant if no function contains the time, and zero if the duration is free. It jumps
        at via points, and slightly because inputs are constant on intervals.

        Raises:
            ValueError: as for `costates`, or shooting with a mechanism or algebraic variables.
        """
        found = self._linearised("hamiltonian").central
        series = found.over_time(found.hamiltonians, "H")
        return at_times(self.motions[0], series.pop("t"), series)["H"]

    def active(self) -> ActiveConditions:
        """Return the conditions that hold with equality, with their times and multipliers.

        A multiplier is the derivative of the optimal cost by the value. In a motion by modes,
        phases are the arcs between changes of mode.

        Raises:
            ValueError: as for `costates`.
        """
        found = self._linearised("active")
        return active_conditions(found.central, found.status)

    def sensitivity(self, name: str) -> "Sensitivity":
        """Return derivatives of cost, motion, durations and chosen parameters by one number.

        The active conditions and the modes of contacts remain the same.

        Args:
            name: a parameter of the model that is not chosen; "T", a given duration ("T of out" if
                there are several phases); a prescribed value, such as "x at the end"; or a bound,
                such as "upper bound on force".

        Raises:
            ValueError: an unknown name, derivatives that are not finite, or as for `costates`.
        """
        return self._linearised("sensitivity").sensitivity(name, self.motions[0])

    @property
    def condition(self) -> "Condition":
        """Degrees of freedom, second-order conditions and condition number of the optimum.

        Raises:
            ValueError: as for `costates`.
        """
        return self._linearised("condition").condition

    def _linearised(self, what: str) -> "Linearised":
        """Return the optimality conditions for the property `what`."""
        from ocp.solving.linearised import polished  # noqa: PLC0415  (loads scipy.sparse)

        if self.optimum is None or self.status.stopped:
            old = "one from a file of an older version"
            got = old if self.optimum is None else self.status.name
            raise ValueError(
                f"solution of '{self.problem.name}': {what}: expected an optimal solution with its "
                f"multipliers, got {got}; solve the problem with this solution as guess"
            )
        return polished(self.optimum)

    def save(self, path: str | Path) -> None:
        """Write the solution to a file, which `ocp.load` reads without loss.

        A loaded solution has signals, modes, re-simulated motions, costates and sensitivities. It
        can be plotted, written, verified again, and used as `guess` on any mesh or model. Functions
        such as costs are stored as the expressions that they returned.

        Raises:
            ValueError: the file cannot be written.
        """
        SOLUTION.save(path, self)

    def to_pack(self) -> dict[str, Any]:
        """Return the fields for a file, with the problem in its resolved form."""
        return packed.state_of(self) | {"cause": None, "problem": posed(self.problem)}

    def plot(self, *names: str, path: str | Path | None = None) -> "Figure":
        """Plot signals over time, one panel each: optimised points and the re-simulated motion.

        Args:
            names: signals to show, by default all; "costate x" is the costate of x.
            path: image file; its extension selects the format.
        """
        picture = import_module("ocp.solving.picture")  # matplotlib is slow
        return picture.plot_solutions({self.problem.name: self}, names, path)

    def to_csv(self, path: str | Path) -> None:
        """Write all signals as columns with units in the header, such as `v [m/s]`.

        Inputs are constant from each row to the next, so `Hold(t, force)` restores the control.
        With scenarios the first column is the name of the scenario.
        """
        several = len(self.motions) > 1
        header = ["t [s]", *(f"{name} [{self.units[name]}]" for name in self.signals)]
        rows = (
            [*([motion.name] * several), *row]
            for motion in self.motions
            for row in np.column_stack([motion.t, *motion.signals.values()]).tolist()
        )
        write_table(path, [*(["scenario"] * several), *header], rows)

    def to_dataframe(self) -> Any:
        """Return the signals as a pandas table with index t, or scenario and t with scenarios.

        Its `attrs` contain the units. Inputs are constant from each row to the next.

        Raises:
            ImportError: pandas is not installed.
        """
        pandas = module("to_dataframe", "pandas")
        parts = {m.name: pandas.DataFrame({"t": m.t, **m.signals}) for m in self.motions}
        frame = pandas.concat(parts, names=["scenario"]).droplevel(1).set_index("t", append=True)
        frame = frame if len(parts) > 1 else frame.droplevel("scenario")
        about = {"scene": self.problem.name, "status": self.status.name, "cost": self.cost}
        frame.attrs.update(about | {"units": {"t": "s", **self.units}})
        return frame

    def to_dict(self) -> dict[str, Any]:
        """Return the solution as plain data, with None for numbers that are not finite."""
        return json_data({
            "scene": self.problem.name,
            "status": self.status.name,
            "message": self.message,
            "T": self.T,
            "cost": self.cost,
            "chosen": dict(self.chosen),
            "soft": {name: asdict(penalty) for name, penalty in self.soft.items()},
            "phases": [asdict(phase) for phase in self.phases],
            "modes": {name: [asdict(m) for m in modes] for name, modes in self.modes.items()},
            "verified": self.verified,
            "verification": None if self.verification is None else self.verification.to_dict(),
            "statistics": asdict(self.statistics),
            "units": {"t": "s", **self.units},
            "motions": [motion.to_dict() for motion in self.motions],
        })  # fmt: skip

    def to_json(self, path: str | Path) -> None:
        """Write the data of `to_dict` as JSON."""
        write_text(path, json.dumps(self.to_dict(), allow_nan=False))


def with_sentence(solution: Solution, sentence: str) -> Solution:
    """Return `solution` with `sentence` appended to its message."""
    return replace(solution, message=f"{solution.message} {sentence}".rstrip())


SOLUTION = Format("symfric ocp solution", 4, "ocp.load", "a saved solution", Solution)


def load(path: str | Path, own: Iterable[type | Callable[..., Any]] = ()) -> Solution:
    """Read a solution written by `solution.save(path)`, as in `solve(problem, guess=load(path))`.

    Args:
        path: the file.
        own: user-defined classes in the file, such as a law.

    Raises:
        ValueError: the file does not exist, is foreign, damaged or of a newer format, or contains
            unknown classes.
    """
    return SOLUTION.load(path, own)
