"""Event simulation with exact Coulomb friction and stiction, to verify smoothed solutions.

    slip    F = law.sliding(v, N, side)     until v = 0
    stick   F with dv/dt = 0                until it reaches the static level of a side

The motion consists of pieces that end at changes of mode. Each piece is a run of the model in its
modes (`mode_models`). Between pieces `decided` (`contact_modes`) determines which contacts stick.
The method has no smoothing width; it simulates the limit of smooth laws.

`simulate` with `ExactCoulomb` supports the same explicit models and mechanisms. This module covers
further cases: any law, by its sliding force and static level; normal forces that are algebraic
unknowns of the friction, for which `symfric.model.forces` refuses the applied force; release of the
most overloaded contact first; and an error if no motion or more than one is consistent.

Limits: `SolveError` for several consistent motions, for none (jamming), and for reactions without a
solution, as of a loop with several degrees of freedom. Contacts in ball joints keep their laws.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from ocp.checking.resimulate import Arc, Run, arcs_of, resimulated
from ocp.checking.verify import cost_of, misses_of
from ocp.formulation.phase import Array
from ocp.friction import sequence
from ocp.friction.contact_modes import Instant, Machine, Modes
from ocp.solving.solution import Mode, Solution
from ocp.solving.verification import Miss, Verification
from symfric import Hold, Statistics, Trajectory, simulate
from symfric.foundation import checks
from symfric.foundation.status import SolveError, Status
from symfric.foundation.variable import stacked, symbols_of
from symfric.integrator.equations.initial import JammedError
from symfric.integrator.equations.inputs import Input, input_data
from symfric.model import Model
from symfric.model.model import check_model

LATER = 1e-13
"""Relative time difference by which times just after a jump are found."""
MOST, PILED = 10_000, 40
"""Largest number of mode changes in a run, and of consecutive ones without time between them."""
CREEP, APART = 1e4, 1e-6
"""Sliding velocity, in zero thresholds, above which a loop moves although one contact stops, and
relative difference of an unknown above which two solvers have found different solutions."""


class Piece(NamedTuple):
    """Run in which no contact changes its mode."""

    run: Trajectory
    modes: Modes
    begin: float
    end: float


@final
@dataclass(frozen=True, eq=False)
class SetValued:
    """Motion with exact Coulomb friction, up to its end or a failure; see `trajectory`.

    `motion["v"]` is a signal at the times `motion.t`. Signals are those of the model except law
    states, and the friction forces "<contact>_F".

    Attributes:
        model: the user's model.
        t: times of the result [s].
        pieces: runs between changes of mode.
        status, message: status of the simulation and its description.
        contacts: names of the contacts.
    """

    model: Model
    t: Array
    pieces: tuple[Piece, ...]
    status: Status = Status.SUCCESS
    message: str = Status.SUCCESS.value
    contacts: tuple[str, ...] = ()

    @property
    def span(self) -> tuple[float, float]:
        """First time and last time reached [s]."""
        return self.pieces[0].begin, self.pieces[-1].end

    @cached_property
    def modes(self) -> dict[str, tuple[Mode, ...]]:
        """Contact -> its modes in the order of time."""
        return {
            name: sequence.modes_of(
                [sequence.Run(p.modes[name], p.begin, p.end) for p in self.pieces]
            )
            for name in self.contacts
        }

    @property
    def last(self) -> Modes:
        """Modes in the last piece, with which a simulation can continue."""
        return dict(self.pieces[-1].modes)

    @cached_property
    def trajectory(self) -> Trajectory:
        """Trajectory of the user's model, with "<contact>_F" as additional signals.

        Expressions that contain law states or algebraic unknowns of other laws are NaN.
        """
        of_laws = {v.name for c in self.model.contacts for v in c.states}
        known = set.intersection(*(set(p.run.units) for p in self.pieces)) - of_laws
        contacts = {c.name: c for c in self.model.contacts}
        units = {n: u for n, u in self.model.signals.items() if n in known}
        units |= {f"{name}_F": contacts[name].unit("N") for name in self.contacts}
        steps = [p.run.step_times[(p.run.step_times < p.end)] for p in self.pieces]

        def evaluated(at: Array) -> dict[str, Array]:
            def values(piece: Piece, times: Array) -> list[Array]:
                found = piece.run.at(times)
                for name, mode in piece.modes.items():
                    found[f"{name}_F"] = (
                        piece.run.express(contacts[name].sliding(mode), times)[0]
                        if mode
                        else found[f"{name}_reaction"]
                    )
                return [found[name] for name in units]

            return dict(zip(units, self._joined(at, len(units), values), strict=True))

        def expressed(column: ca.SX, at: Array) -> Array:
            def values(piece: Piece, times: Array) -> Array:
                model = piece.run.model
                known = {v.symbol.__hash__() for group in "xzup" for v in getattr(model, group)}
                every = [v.symbol for group in "xz" for v in getattr(self.model, group)]
                gone = stacked(s for s in every if s.__hash__() not in known)
                there = ca.substitute(column, gone, ca.SX(ca.DM(gone.numel(), 1) + np.nan))
                return piece.run.express(ca.densify(there), times)

            return self._joined(at, column.numel(), values)

        return Trajectory(
            scene=self.model.name, t=self.t, units=units, status=self.status, message=self.message,
            count=self._statistics, span=self.span, states=self._states, evaluate=evaluated,
            express=expressed, model=self.model,
            ends=lambda: np.unique(np.concatenate([*steps, [self.span[1]]])),
            happened=tuple((p.end, "change") for p in self.pieces[:-1]),
        )  # fmt: skip

    def _statistics(self) -> Statistics:
        every = [p.run.statistics for p in self.pieces]
        names = ("steps", "rejections", "evaluations", "jacobians", "factorisations", "run_time",
                 "build_time", "compile_time")  # fmt: skip
        total = {name: sum(getattr(s, name) for s in every) for name in names}
        least = min(s.smallest_step for s in every)
        return replace(every[0], **total, events=len(self.pieces) - 1, smallest_step=least)

    def _joined(self, at: Array, rows: int, values: Callable[[Piece, Array], ArrayLike]) -> Array:
        """Return rows over time from `values(piece, times)`; changes belong to the later piece."""
        found = np.zeros((rows, at.size))
        which = np.searchsorted([p.begin for p in self.pieces[1:]], at, side="right")
        for k in np.unique(which):
            piece, here = self.pieces[k], which == k
            found[:, here] = values(piece, np.clip(at[here], piece.begin, piece.end))
        return found

    def _states(self, at: Array) -> dict[str, Array]:
        names = [v.name for v in self.model.open.x]

        def values(piece: Piece, times: Array) -> list[Array]:
            states = piece.run.states(times)
            return [states[name] for name in names]

        return dict(zip(names, self._joined(at, len(names), values), strict=True))

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
        u: inputs as for `simulate`; at each sample of `Hold` and `Linear` a piece ends.
        p: values of the parameters.
        modes: contact -> 1, 0 or -1 before the start, for contacts without velocity; 0 by default.
        rtol: relative tolerance of the pieces.
        t_eval: times of the result [s]; `samples` equally spaced times by default.
        samples: number of times of the result without `t_eval`.
        throw: raise `SolveError` on failure; False returns the motion up to the failure.

    Raises:
        ValueError: bad input, a law without these functions, or events of the model.
        SolveError: no unique consistent modes, or a failure of the integrator; `partial` is the
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
    run = _Run(Machine(model, model.values("p", p)), dict(p or {}), rtol, u, (begin, end))
    run.start(begin, dict(x0 or {}), dict(modes or {}))
    status, message, problem = Status.SUCCESS, Status.SUCCESS.value, False
    try:
        run.go(end)
    except SolveError as error:
        status, message, problem = error.status, str(error), True
    names = tuple(c.name for c in run.machine.contacts)
    reached = run.pieces[-1].end if run.pieces else begin
    made = SetValued(model, wanted[wanted <= reached], tuple(run.pieces), status, message, names)
    if problem and throw:
        raise SolveError(message, status, made if run.pieces else None)
    return made


@final
class _Run:
    """Simulation of a motion piece by piece, with its state after the last piece.

    A piece covers `ahead` inputs unless its modes change, twice as many as the last one.
    """

    def __init__(
        self, machine: Machine, p: dict[str, float], rtol: float,
        u: Mapping[str, Input] | None, span: tuple[float, float],
    ) -> None:  # fmt: skip
        model = machine.model
        self.machine, self.p, self.rtol = machine, p, rtol
        self.given, self.inputs = model.named("u", u), input_data(model, u, *span)
        symbols = [model.t, self.inputs.data]
        self._values = ca.Function("inputs", symbols, [self.inputs.expression])
        self.names = [v.name for v in model.open.x]
        self.pieces, self.ahead = list[Piece](), 1

    def start(self, t: float, x0: dict[str, float], modes: dict[str, int]) -> None:
        """Set the state at the start, in which contacts without velocity stick by default."""
        machine, model = self.machine, self.machine.model
        names = [c.name for c in machine.contacts]
        checks.check_names("set_valued: modes", modes, names)
        start = zip(model.x, model.initial_state(x0, self.p), strict=True)
        values = {v.name: float(value) for v, value in start}
        x = np.array([values[name] for name in self.names])
        found: Modes = {}
        for name, v, still in zip(names, machine.slips(t, x)[0], machine.still, strict=True):
            found[name] = modes.get(name, 0) if abs(v) <= still else int(np.sign(v))
        self.t, self.x, self.modes = t, machine.at_rest(t, x, found), found
        self.guess: dict[str, float] = {}

    def go(self, end: float) -> None:
        """Simulate all pieces up to `end`."""
        piled = 0
        for _ in range(MOST + self.inputs.breaks.size):
            before = self.t
            self.piece()
            if self.t >= end:
                return
            piled = piled + 1 if self.t - before <= 1e-12 * (end - before) else 0
            if piled > PILED:
                where = f"at t = {self.t:.9g} s: {Status.EVENT_STORM.value}"
                raise SolveError(where, Status.EVENT_STORM)
        raise SolveError(f"more than {MOST} changes of mode", Status.EVENT_STORM)

    def piece(self) -> None:
        """Decide the modes, and simulate to their next change, over at most `ahead` inputs."""
        t, machine, inputs = self.t, self.machine, self.inputs
        k = inputs.interval(np.array([t + LATER * max(1.0, abs(t))])).item()
        u = self._values(t, inputs.values[:, k]).full()[:, 0]
        modes, guess = machine.decided(Instant(t, self.x, u, self.guess), self.modes)
        model, _, _, linear = machine.within(modes)
        breaks = inputs.breaks[k + 1 :][: self.ahead if linear else 1]
        run = self._run(model, float(breaks[-1]))
        begin, reached = _unknowns(run, model, t), run.span[1]
        for v in model.z:
            value = begin[v.name]
            if abs(value - guess[v.name]) > APART * max(v.nominal, abs(value)):
                two = f"{v.name} is {guess[v.name]:.6g} or {value:.6g}: two solutions"
                raise machine.undecided(t, two)
        jumps = breaks[breaks < reached]
        states = symbols_of([v for v in model.x if v.name in self.names])
        rows = (run.express(c, jumps) for c in (states, *map(symbols_of, (model.z, model.u))))
        changed = machine.changed(modes, jumps, *rows)
        self.ahead = 2 * self.ahead if changed is None else 1
        reached = reached if changed is None else float(jumps[changed])
        self.pieces.append(Piece(run, modes, t, reached))
        x = run.express(states, np.array([reached]))[:, -1]
        self.guess = guess | _unknowns(run, model, reached)
        self.modes = modes | self._stopped(modes, machine.slips(reached, x)[0])
        self.t, self.x = reached, machine.at_rest(reached, x, self.modes)

    def _stopped(self, modes: Modes, slips: Array) -> Modes:
        """Return the modes of stopped contacts: stick, or reversal at a dead centre of a loop."""
        machine, found = self.machine, Modes()
        pairs = list(zip(machine.contacts, slips, machine.still, strict=True))
        moving = {c.name for c, v, still in pairs if abs(v) > CREEP * still}
        for c, v, _ in pairs:
            if modes[c.name] and modes[c.name] * v <= 0.0:
                members = machine.together[c.name]
                turns = any(name in moving for name in members)
                found |= {c.name: -modes[c.name]} if turns else dict.fromkeys(members, 0)
        return found

    def _run(self, model: Model, end: float) -> Trajectory:
        where, x0 = f"at t = {self.t:.9g} s", dict(zip(self.names, self.x.tolist(), strict=True))
        try:
            run = simulate(
                model, end, t_start=self.t, x0=x0, u=self.given, p=self.p, rtol=self.rtol,
                samples=2, throw=False,
            )  # fmt: skip
        except JammedError as error:
            raise SolveError(f"{where}: {error}", Status.JAMMED) from None
        except ValueError as error:
            if not self.pieces:
                raise
            raise SolveError(f"{where}: {error}", Status.SOLVER_FAILED) from None
        if not run.status.ok:
            raise SolveError(run.message, run.status)
        return run


def _unknowns(run: Trajectory, model: Model, t: float) -> dict[str, float]:
    """Return the algebraic unknowns of a run at a time by name."""
    if not model.z:
        return {}
    values = run.express(symbols_of(model.z), np.array([t]))[:, 0].tolist()
    return dict(zip((v.name for v in model.z), values, strict=True))


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

    def follow(arc: Arc, start: Mapping[str, float]) -> Run | None:
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
        return Run(arc, motion.trajectory, float(arc.times[-1]))

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
