"""A controller on a plant with equations of its own, and what became of it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ocp.mpc.design import Design
from ocp.mpc.gauss_newton import CycleStatus
from ocp.mpc.optimality import Optimality
from ocp.mpc.session import Session
from symfric.foundation import checks
from symfric.foundation.brief import brief
from symfric.foundation.files import write_table
from symfric.foundation.panels import panels, save
from symfric.foundation.style import line
from symfric.integrator.plant import Plant
from symfric.integrator.stepper import stepper
from symfric.model import Model, check_model

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
Reference = float | Callable[[Array], ArrayLike]
"""A number, or a function of times [s]."""

SLACK = 1e-3
"""By what share a residual may differ from the second opinion on it: rounding."""


@final
@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """A plant under a controller; arrays have an entry for each of the n cycles.

    Attributes:
        plant, controller: names.
        t: times of the cycles [s]; the last signals are at `t_end`.
        t_end: [s].
        signals: of the plant at the cycles and at the end, shape (n + 1,).
        units: of signals and controls.
        controls: input -> value held over the interval after each cycle.
        references: name -> value at each cycle.
        residual: of each cycle, as the controller reports it.
        checked: the same by a second opinion (`optimality`); NaN where it was not asked.
        seconds, cpu: that each cycle took on the clock, and of the processor [s]; the first counts
            other programs on a busy machine, too.
        iterations, program_iterations: quadratic programs, and of the interior point.
        violation: largest of a soft bound in the plan, in units of its signal.
        status: of each cycle, numbers of `CycleStatus`.
        tolerance: of the residual.
    """

    plant: str
    controller: str
    t: Array
    t_end: float
    signals: Mapping[str, Array]
    units: Mapping[str, str]
    controls: Mapping[str, Array]
    references: Mapping[str, Array]
    residual: Array
    checked: Array
    seconds: Array
    cpu: Array
    iterations: NDArray[np.int64]
    program_iterations: NDArray[np.int64]
    violation: Array
    status: NDArray[np.int64]
    tolerance: float

    __repr__ = brief

    def __getitem__(self, name: str) -> Array:
        checks.check_names(f"loop of '{self.plant}'", [name], [*self.signals, *self.controls])
        return self.signals[name] if name in self.signals else self.controls[name]

    @property
    def median(self) -> float:
        """Median of the cycle times [s]."""
        return float(np.median(self.seconds))

    @property
    def worst(self) -> float:
        """Longest of the cycle times [s]."""
        return float(self.seconds.max())

    @property
    def worst_cpu(self) -> float:
        """Longest cycle of the processor [s]."""
        return float(self.cpu.max())

    @property
    def unconverged(self) -> int:
        """Cycles that say themselves that they did not converge."""
        return int(np.count_nonzero(self.status != CycleStatus.CONVERGED))

    @property
    def unreported(self) -> int:
        """Cycles that say they converged, and by their own residual or the second opinion did not.

        There should be none.
        """
        said = self.status == CycleStatus.CONVERGED
        allowed = self.tolerance * (1.0 + SLACK)
        wrong = ~(self.residual <= self.tolerance) | (self.checked > allowed)
        return int(np.count_nonzero(said & wrong))

    def table(self) -> str:
        """A few lines of text."""
        said = self.residual[np.isfinite(self.residual)]
        cycles = self.seconds.size
        return "\n".join(
            (
                f"{self.controller} on plant '{self.plant}', {cycles} cycles to {self.t_end:g} s",
                f"  cycle time      median {1e3 * self.median:.3f} ms, worst "
                f"{1e3 * self.worst:.3f} ms (processor {1e3 * self.worst_cpu:.3f} ms)",
                f"  iterations      median {np.median(self.iterations):g}, most "
                f"{self.iterations.max(initial=0)}",
                f"  residual        median {np.median(self.residual):.1e}, worst "
                f"{said.max(initial=0.0):.1e}, tolerance {self.tolerance:.0e}",
                f"  not converged   {self.unconverged} of {cycles}, said so",
                f"  unreported      {self.unreported}",
            )
        )

    def to_dict(self) -> dict[str, Any]:
        """The table as plain data."""
        said = self.residual[np.isfinite(self.residual)]
        return {
            "controller": self.controller,
            "plant": self.plant,
            "cycles": int(self.seconds.size),
            "median_s": self.median,
            "worst_s": self.worst,
            "worst_cpu_s": self.worst_cpu,
            "most_iterations": int(self.iterations.max(initial=0)),
            "worst_residual": float(said.max(initial=0.0)),
            "not_converged": self.unconverged,
            "unreported": self.unreported,
        }

    def to_csv(self, path: str | Path) -> None:
        """Write a row a cycle: time, signals, controls, references, and how the cycle went."""
        columns: dict[str, Array] = {"t [s]": self.t}
        signals = {name: values[:-1] for name, values in self.signals.items()}
        for name, values in (signals | dict(self.controls)).items():
            columns[f"{name} [{self.units[name]}]"] = values
        columns |= {f"{name} (reference)": values for name, values in self.references.items()}
        columns |= {"residual": self.residual, "iterations": self.iterations.astype(float)}
        columns |= {"status": self.status.astype(float), "time [s]": self.seconds}
        write_table(path, columns, np.column_stack(list(columns.values())).tolist())

    def plot(self, *names: str, path: str | Path | None = None) -> "Figure":
        """Signals, controls and cycle times over time, a panel each; shaded: not converged.

        Args:
            names: signals and controls to show, by default all.
            path: image file.
        """
        return plot_loops({f"{self.controller} on plant '{self.plant}'": self}, names, path)


def plot_loops(
    loops: Mapping[str, ClosedLoop], names: Sequence[str] = (), path: str | Path | None = None
) -> "Figure":
    """Signals and controls of closed loops over time, a panel each, and the time of their cycles.

    Shaded is where a controller says that it did not converge.

    Args:
        loops: legend entry -> loop.
        names: signals and controls to show; all those that the loops share if none is given.
        path: image file.
    """
    first = next(iter(loops.values()))
    known = [*first.signals, *first.controls]
    shared = [n for n in known if all(n in {*one.signals, *one.controls} for one in loops.values())]
    checks.check_names(f"loop of '{first.plant}'", names, shared)
    shown = list(names) or shared
    figure, axes = panels(len(shown) + 1)
    for number, (label, one) in enumerate(loops.items()):
        look, edges = line(number), np.append(one.t, one.t_end)
        for axis, name in zip(axes, shown, strict=False):
            if name in one.controls:
                axis.stairs(one.controls[name], edges, baseline=None, label=label, **look)
            else:
                axis.plot(edges, one.signals[name], linewidth=1.2, label=label, **look)
            axis.set_ylabel(f"{name} [{one.units[name]}]")
        axes[-1].semilogy(one.t, 1e3 * one.cpu, ".", ms=3, color=look["color"])
        for k in np.flatnonzero(one.status != CycleStatus.CONVERGED).tolist():
            for axis in axes:
                axis.axvspan(edges[k], edges[k + 1], color=look["color"], alpha=0.15, linewidth=0)
    axes[-1].set_ylabel("cycle [ms]")
    axes[-1].set_xlabel("t [s]")
    if len(loops) > 1:
        entries = axes[0].get_legend_handles_labels()
        figure.legend(
            *entries, loc="outside lower center", fontsize="small", ncols=4, frameon=False
        )
    else:
        axes[0].set_title(next(iter(loops)))
    figure.align_ylabels(axes)
    return save(figure, path)


def run_closed_loop(
    design: Design,
    session: Session,
    plant: Model,
    t_end: float,
    references: Mapping[str, Reference],
    *,
    x0: Mapping[str, float] | None,
    p: Mapping[str, float] | None,
    plant_p: Mapping[str, float] | None,
    noise: Mapping[str, float] | None,
    seed: int,
    check: bool,
) -> ClosedLoop:
    """See `Controller.simulate`."""
    where = "simulate"
    check_model(where, plant)
    h = design.horizon
    t_end = checks.number(f"{where}: t_end", t_end, unit="s", above=0.0)
    cycles = max(1, round(t_end / h.step))
    driven, inputs = [c.name for c in design.controls], [v.name for v in plant.u]
    checks.check_names(f"{where}: inputs of plant '{plant.name}'", driven, inputs)
    checks.check_names(
        f"{where}: signals of plant '{plant.name}'", design.measured_names, plant.signals
    )
    spread = checks.named(f"{where}: noise", noise, design.measured_names)
    checks.named(f"{where}: references", references, h.references)
    going = stepper(plant, h.step, x0=x0, p=plant_p)
    look = Optimality(design) if check else None
    random = np.random.default_rng(seed)
    rows = _Rows([*plant.signals], [c.name for c in design.controls])
    rows.look(going)
    for k in range(cycles):
        t = k * h.step
        times = t + h.step * np.arange(h.count + 1.0)
        wanted = {name: _values(value, times) for name, value in references.items()}
        measured = {
            name: going[name] + spread.get(name, 0.0) * random.standard_normal()
            for name in design.measured_names
        }
        action = session.step(measured, wanted, t=t, p=p)
        opinion = np.nan
        if look is not None and action.status is not CycleStatus.BAD_INPUT:
            opinion = look.residual(session.plan, session.given(wanted, t, p, None))
        rows.add(action.controls, action, opinion, wanted)
        going.step(action.controls)
        rows.look(going)
        if going.terminated:
            cycles = k + 1
            break
    return rows.loop(design, plant, h.step, cycles)


def _values(reference: Reference, times: Array) -> Array:
    value = reference(times) if callable(reference) else reference
    return np.broadcast_to(np.asarray(value, dtype=float), times.shape)


@final
class _Rows:
    """What a closed loop gathers on its way."""

    def __init__(self, signals: list[str], controls: list[str]) -> None:
        self._signals: dict[str, list[float]] = {name: [] for name in signals}
        self._controls: dict[str, list[float]] = {name: [] for name in controls}
        self._references: dict[str, list[float]] = {}
        self._actions: list[Any] = []
        self._opinions: list[float] = []

    def look(self, plant: Plant) -> None:
        """Take the signals of the plant now."""
        for name, value in plant.signals.items():
            self._signals[name].append(value)

    def add(
        self, u: Mapping[str, float], action: Any, opinion: float, wanted: Mapping[str, Array]
    ) -> None:
        """Take what was decided in a cycle, and the references it saw."""
        for name, value in u.items():
            self._controls[name].append(value)
        for name, values in wanted.items():
            self._references.setdefault(name, []).append(float(values[0]))
        self._actions.append(action)
        self._opinions.append(opinion)

    def loop(self, design: Design, plant: Model, step: float, cycles: int) -> ClosedLoop:
        """All that was gathered, as arrays."""
        actions = self._actions
        controls = {name: np.array(values) for name, values in self._controls.items()}
        signals = {n: np.array(v) for n, v in self._signals.items() if n not in controls}
        return ClosedLoop(
            plant=plant.name,
            controller=design.name,
            t=step * np.arange(float(cycles)),
            t_end=step * cycles,
            signals=signals,
            units=dict(plant.signals) | {c.name: c.unit for c in design.controls},
            controls=controls,
            references={name: np.array(values) for name, values in self._references.items()},
            residual=np.array([a.residual for a in actions]),
            checked=np.array(self._opinions),
            seconds=np.array([a.seconds for a in actions]),
            cpu=np.array([a.cpu for a in actions]),
            iterations=np.array([a.iterations for a in actions]),
            program_iterations=np.array([a.program_iterations for a in actions]),
            violation=np.array([a.violation for a in actions]),
            status=np.array([int(a.status) for a in actions]),
            tolerance=design.settings.tolerance,
        )
