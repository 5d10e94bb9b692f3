"""Simulation with exact Coulomb friction and stiction, to verify smoothed solutions.

    slip    F = law.sliding(v, N, side)     until v = 0
    stick   F with dv/dt = 0                until it reaches the static level of a side

`simulate` runs the model with set-valued friction (`exact_models`) and decides when contacts stick
and slip. The method has no smoothing width; it simulates the limit of smooth laws.

Limits: `SolveError` if a contact lifts off or friction jams, and for reactions without a solution,
as of a loop with several degrees of freedom. Contacts in ball joints keep their laws.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from ocp.checking.resimulate import Arc, SimulatedArc, arcs_of, resimulated
from ocp.checking.verify import cost_of, misses_of
from ocp.formulation.phase import Array
from ocp.friction import sequence
from ocp.friction.exact_models import LIFTS, exact_model, start_modes
from ocp.friction.smooth_models import law_states, sticking
from ocp.solving.solution import Mode, Solution
from ocp.solving.verification import Miss, Verification
from symfric import Hold, Trajectory, simulate
from symfric.foundation import checks
from symfric.foundation.status import SolveError, Status
from symfric.foundation.variable import stacked
from symfric.integrator.equations.initial import JammedError
from symfric.integrator.equations.inputs import Input
from symfric.model import Model
from symfric.model.model import check_model


@final
@dataclass(frozen=True, eq=False)
class SetValued:
    """Motion with exact Coulomb friction, up to its end or a failure; see `trajectory`.

    `motion["v"]` is a signal at the times `motion.t`. Signals are those of the model except law
    states, and the friction forces "<contact>_F".

    Attributes:
        model: the user's model.
        t: times of the result [s].
        run: simulation of the model with set-valued friction.
        status, message: status of the simulation and its description.
        contacts: names of the contacts.
    """

    model: Model
    t: Array
    run: Trajectory
    status: Status = Status.SUCCESS
    message: str = Status.SUCCESS.value
    contacts: tuple[str, ...] = ()

    @property
    def span(self) -> tuple[float, float]:
        """First time and last time reached [s]."""
        return self.run.span

    @cached_property
    def modes(self) -> dict[str, tuple[Mode, ...]]:
        """Contact -> its modes in the order of time."""
        begin, end = self.span
        changes = {min(max(t, begin), end) for t, _ in self.run.happened}
        edges = np.array(sorted({begin, end} | changes))
        middles = self.run.at((edges[:-1] + edges[1:]) / 2)
        found: dict[str, tuple[Mode, ...]] = {}
        for name in self.contacts:
            pairs = zip(middles[f"{name}_mode"], pairwise(edges.tolist()), strict=True)
            found[name] = sequence.modes_of(
                [sequence.ModeInterval(round(m), *ends) for m, ends in pairs]
            )
        return found

    @property
    def last(self) -> dict[str, int]:
        """Modes at the end, with which a simulation can continue."""
        final = self.run.states(np.array([self.span[1]]))
        return {name: round(float(final[f"{name}_mode"][0])) for name in self.contacts}

    @cached_property
    def trajectory(self) -> Trajectory:
        """Trajectory of the user's model, with "<contact>_F" as additional signals.

        Expressions that contain law states or algebraic unknowns of other laws are NaN.
        """
        of_laws = {v.name for c in self.model.contacts for v in c.states}
        forces = [f"{name}_F" for name in self.contacts]
        kept = [n for n in self.model.signals if n in self.run.units and n not in of_laws]
        units = {name: self.run.units[name] for name in (*kept, *forces)}
        exact = self.run.model
        known = {v.symbol.__hash__() for group in "xzup" for v in getattr(exact, group)}
        every = [v.symbol for group in "xz" for v in getattr(self.model, group)]
        gone = stacked(s for s in every if s.__hash__() not in known)

        def evaluated(at: Array) -> dict[str, Array]:
            found = self.run.at(at)
            return {name: found[name] for name in units}

        def expressed(column: ca.SX, at: Array) -> Array:
            there = ca.substitute(column, gone, ca.SX(ca.DM(gone.numel(), 1) + np.nan))
            return self.run.express(ca.densify(there), at)

        return Trajectory(
            scene=self.model.name, t=self.t, units=units, status=self.status, message=self.message,
            count=lambda: self.run.statistics, span=self.span, states=self._states,
            evaluate=evaluated, express=expressed, model=self.model,
            ends=lambda: self.run.step_times, happened=self.run.happened,
        )  # fmt: skip

    def _states(self, at: Array) -> dict[str, Array]:
        found = self.run.states(at)
        return {v.name: found[v.name] for v in self.model.open.x}

    def __getitem__(self, name: str) -> Array:
        return self.t if name == "t" else self.trajectory[name]

    def at(self, times: ArrayLike) -> dict[str, Array]:
        """Return all signals at `times` [s]; at a change of mode, the values after it."""
        return self.trajectory.at(times)

    def final(self) -> dict[str, float]:
        """Return the states at the end by name, without law states."""
        return {n: float(row[-1]) for n, row in self._states(np.array([self.span[1]])).items()}


def set_valued(
    model: Model,
    t_end: float,
    *,
    t_start: float = 0.0,
    x0: Mapping[str, float] | None = None,
    u: Mapping[str, Input] | None = None,
    p: Mapping[str, float] | None = None,
    modes: Mapping[str, int] | None = None,
    rtol: float = 1e-9,
    t_eval: ArrayLike | None = None,
    samples: int = 2001,
    throw: bool = True,
) -> SetValued:
    """Simulate `model` with the sliding forces and static levels of its laws, without smoothing.

    Args:
        model: model with contacts whose laws define `sliding` and `static_level`.
        t_end, t_start: end and start time [s].
        x0: start values of states by name, except law states.
        u: inputs as for `simulate`.
        p: values of the parameters.
        modes: contact -> 1, 0 or -1 before the start, for contacts without velocity; 0 by default.
        rtol: relative tolerance.
        t_eval: times of the result [s]; `samples` equally spaced times by default.
        samples: number of times of the result without `t_eval`.
        throw: raise `SolveError` on failure; False returns the motion up to the failure.

    Raises:
        ValueError: bad input, or a law without these functions.
        SolveError: a contact lifts off, friction jams, or the integrator fails; `partial` is the
            motion up to the failure.
    """
    check_model("set_valued", model)
    begin = checks.number("set_valued: t_start", t_start)
    end = checks.number("set_valued: t_end", t_end, above=begin)
    wanted = (
        np.linspace(begin, end, checks.count("set_valued: samples", samples, least=2))
        if t_eval is None
        else checks.times("set_valued: t_eval", t_eval, begin, end)
    )
    exact, names = exact_model(model), tuple(c.name for c in sticking(model))
    start = dict(zip((v.name for v in model.x), model.initial_state(x0, p), strict=True))
    own = {v.name: float(start[v.name]) for v in model.open.x if v.name in (x0 or {})}
    checks.check_names("set_valued: modes", modes or {}, names)
    own |= start_modes(exact, begin, start, model.values("p", p), modes or {})
    try:
        run = simulate(
            exact, end, t_start=begin, x0=own, u=u, p=p, rtol=rtol, samples=2, throw=False
        )
    except JammedError as error:
        raise SolveError(str(error), Status.JAMMED) from None
    status, message = run.status, run.message
    if status is Status.TERMINATED and (lifted := run.happened[-1])[1].endswith(LIFTS):
        status, where = Status.SOLVER_FAILED, f"model '{model.name}' at t = {lifted[0]:.9g} s"
        message = f"{where}: contact {lifted[1].removesuffix(LIFTS)} lifts off"
    made = SetValued(model, wanted[wanted <= run.span[1]], run, status, message, names)
    if throw and not status.ok:
        raise SolveError(message, status, made)
    return made


def verify_exactly(solution: Solution, tolerance: float = 1e-4, rtol: float = 1e-9) -> Verification:
    """Verify `solution` with exact friction in place of its laws.

    All conditions and the cost are checked. An expression that contains a law, such as an output
    "friction", is evaluated with this law. `Verification.trajectories` are the exact motions.

    Args:
        solution: solution of a problem whose models have contacts.
        tolerance: largest relative deviation.
        rtol: relative tolerance of the simulation.

    Raises:
        ValueError: not a solution, or a law without a sliding force and a static level.
    """
    checks.kind("verify_exactly", solution, Solution, "a solution, such as solve(...)")
    tolerance = checks.number("verify_exactly: tolerance", tolerance, above=0.0)
    problem = solution.problem
    failures: list[str] = []

    def follow(arc: Arc, start: Mapping[str, float]) -> SimulatedArc | None:
        rows = zip(arc.span.model.u, arc.u, strict=True)
        try:
            motion = set_valued(
                arc.span.model, float(arc.times[-1]), t_start=float(arc.times[0]),
                x0={name: x for name, x in start.items() if np.isfinite(x)},
                u={v.name: Hold(arc.times[:-1], row) for v, row in rows}, p=arc.parameters(),
                t_eval=arc.times, rtol=rtol,
            )  # fmt: skip
        except SolveError as error:
            failures.append(str(error))
            return None
        return SimulatedArc(arc, motion.trajectory, float(arc.times[-1]))

    runs = resimulated(arcs_of(problem, solution.meshes, solution.points), follow=follow)
    checked, value = list(misses_of(problem, runs, optimised=False)), float("nan")
    if not failures:
        value = cost_of(problem, runs)
        size = max(abs(value), abs(solution.cost)) or 1.0
        checked.append(Miss("cost", "the cost", runs[-1].end, value, solution.cost, size))
    failed = (failures[0], Status.SOLVER_FAILED) if failures else ("", Status.SUCCESS)
    worst_first = tuple(sorted(checked, key=lambda miss: -miss.relative))
    trajectories = tuple(run.trajectory for run in runs)
    return Verification(tolerance, rtol, worst_first, (), trajectories, value, *failed)


def without_law_states(solution: Solution, found: Verification) -> Verification:
    """Return `found` without checks of law states and local errors."""
    if not (hidden := law_states(solution.problem)):
        return found
    kept = [m for m in found.checked if m.name not in hidden and m.what != "local error"]
    return replace(found, checked=tuple(kept), restarted=None)
