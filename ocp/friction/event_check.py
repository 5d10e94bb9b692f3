"""Event simulation with exact Coulomb friction and stiction, to verify smoothed solutions.

    slip    F = law.sliding(v, N, side)     until v = 0
    stick   F with dv/dt = 0                until it reaches the static level of a side

The motion consists of pieces that end at changes of mode and at jumps of inputs. Each piece is a
smooth run of the model in its modes (`mode_models`). Between pieces `decided` (`contact_modes`)
determines which contacts stick. The method has no smoothing width and no penalty; it simulates the
limit of smooth laws.

`simulate` with `ExactCoulomb` supports the same explicit models and mechanisms (tests compare
both). This module covers cases that `ExactCoulomb` does not: any law, by its sliding force and
static level, without rebuilding the model; normal forces that are algebraic unknowns of the
friction, for which `symfric.model.forces` refuses the applied force; release of the most overloaded
contact first, after which all modes are decided again; and an error if no motion or more than one
is consistent.

Limits: the simulation raises `SolveError` for several consistent motions, for none (jamming), and
for reactions without a solution, which includes contacts of a loop with several degrees of freedom.
Contacts in ball joints keep their laws.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ocp.checking.resimulate import Arc, Run, arcs_of, resimulated
from ocp.checking.verify import cost_of, misses_of
from ocp.friction.contact_modes import Instant, Machine, Modes
from ocp.friction.exact_motion import Given, Inputs, Piece, SetValued
from ocp.solving.solution import Solution
from ocp.solving.verification import Miss, Verification
from symfric import Hold, Trajectory, simulate
from symfric.foundation import checks
from symfric.foundation.status import SolveError, Status
from symfric.foundation.variable import symbols_of
from symfric.integrator.equations.initial import JammedError
from symfric.model import Model
from symfric.model.model import check_model

Array = NDArray[np.float64]
MOST = 10_000
"""Largest number of mode changes in a run."""
PILED = 40
"""Largest number of consecutive mode changes without time between them."""
CREEP = 1e4
"""Sliding velocity, in zero thresholds, above which a loop moves although one contact stops."""
APART = 1e-6
"""Relative difference of an unknown above which two solvers have found different solutions."""
TOLERANCE = 1e-4
RTOL = 1e-9


def set_valued(
    model: Model,
    t_end: float,
    *,
    t_start: float = 0.0,
    x0: Mapping[str, float] | None = None,
    u: Mapping[str, Given] | None = None,
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
    machine = Machine(model, model.values("p", p or {}))
    run = _Run(machine, Inputs(model, dict(u or {}), end), dict(p or {}), rtol)
    state = run.start(begin, dict(x0 or {}), dict(modes or {}))
    status, message, problem = Status.SUCCESS, Status.SUCCESS.value, False
    try:
        run.go(state, end)
    except SolveError as error:
        status, message, problem = error.status, str(error), True
    names = tuple(c.name for c in machine.contacts)
    reached = run.pieces[-1].end if run.pieces else begin
    made = SetValued(model, wanted[wanted <= reached], tuple(run.pieces), status, message, names)
    if problem and throw:
        raise SolveError(message, status, made if run.pieces else None)
    return made


class _State(NamedTuple):
    t: float
    x: Array
    modes: Modes
    guess: Mapping[str, float]


@final
class _Run:
    """Simulation of a motion piece by piece."""

    def __init__(self, machine: Machine, inputs: Inputs, p: dict[str, float], rtol: float) -> None:
        self.machine, self.inputs, self.p, self.rtol = machine, inputs, p, rtol
        self.names = [v.name for v in machine.model.open.x]
        self.pieces: list[Piece] = []

    def start(self, t: float, x0: dict[str, float], modes: dict[str, int]) -> _State:
        """Return the state at the start, in which contacts without velocity stick by default."""
        machine, model = self.machine, self.machine.model
        names = [c.name for c in machine.contacts]
        checks.check_names("set_valued: modes", modes, names)
        start = model.initial_state(x0, self.p)
        values = {v.name: float(value) for v, value in zip(model.x, start, strict=True)}
        x = np.array([values[name] for name in self.names])
        found: Modes = {}
        for name, v, still in zip(names, machine.slips(t, x)[0], machine.still, strict=True):
            found[name] = modes.get(name, 0) if abs(v) <= still else int(np.sign(v))
        return _State(t, machine.at_rest(t, x, found), found, {})

    def go(self, state: _State, end: float) -> None:
        """Simulate all pieces up to `end`."""
        piled = 0
        for _ in range(MOST + self.inputs.knots.size):
            before = state.t
            state = self.piece(state, end)
            if state.t >= end:
                return
            piled = piled + 1 if state.t - before <= 1e-12 * (end - before) else 0
            if piled > PILED:
                raise SolveError(
                    f"at t = {state.t:.9g} s: {Status.EVENT_STORM.value}", Status.EVENT_STORM
                )
        raise SolveError(f"more than {MOST} changes of mode", Status.EVENT_STORM)

    def piece(self, state: _State, end: float) -> _State:
        """Decide the modes, simulate to the next change, and return the state after it."""
        t, machine = state.t, self.machine
        at = Instant(t, state.x, self.inputs.at(t), state.guess)
        modes, guess = machine.decided(at, state.modes)
        model = machine.within(modes).model
        run = self._run(model, t, self.inputs.next(t, end), state.x)
        begin, reached = self._unknowns(run, model, t), run.span[1]
        for v in model.z:
            value = begin[v.name]
            if abs(value - guess[v.name]) > APART * max(v.nominal, abs(value)):
                raise machine.undecided(
                    t, f"{v.name} is {guess[v.name]:.6g} or {value:.6g}: two solutions"
                )
        self.pieces.append(Piece(run, modes, t, reached))
        x = self._states(run, reached)
        guess |= self._unknowns(run, model, reached)
        modes = modes | self._stopped(modes, machine.slips(reached, x)[0])
        return _State(reached, machine.at_rest(reached, x, modes), modes, guess)

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

    def _run(self, model: Model, begin: float, end: float, x: Array) -> Trajectory:
        try:
            run = simulate(
                model, end, t_start=begin, x0=dict(zip(self.names, x.tolist(), strict=True)),
                u=self.inputs.within(begin), p=self.p, rtol=self.rtol, samples=2, throw=False,
            )  # fmt: skip
        except JammedError as error:
            raise SolveError(f"at t = {begin:.9g} s: {error}", Status.JAMMED) from None
        except ValueError as error:
            if not self.pieces:
                raise
            raise SolveError(f"at t = {begin:.9g} s: {error}", Status.SOLVER_FAILED) from None
        if not run.status.ok:
            raise SolveError(run.message, run.status)
        return run

    def _states(self, run: Trajectory, t: float) -> Array:
        states = run.states(np.array([t]))
        return np.array([float(states[name][-1]) for name in self.names])

    def _unknowns(self, run: Trajectory, model: Model, t: float) -> dict[str, float]:
        """Return the algebraic unknowns of a run at a time by name."""
        if not model.z:
            return {}
        values = run.express(symbols_of(model.z), np.array([t]))[:, 0].tolist()
        return dict(zip((v.name for v in model.z), values, strict=True))


def verify_exactly(
    solution: Solution, tolerance: float = TOLERANCE, rtol: float = RTOL
) -> Verification:
    """Verify `solution` with exact friction in place of its laws.

    The function checks start, via points, end, joints, periodicity, bounds, path conditions and
    cost. An expression that contains a law, such as an output "friction", is evaluated with this
    law. `Verification.trajectories` are the exact motions; `motions` returns their modes.

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
    arcs = arcs_of(problem, solution.meshes, solution.points)
    runs, _, failed = _followed(arcs, rtol)
    checked, value = list(misses_of(problem, runs, optimised=False)), float("nan")
    if not failed:
        value = cost_of(problem, runs)
        size = max(abs(value), abs(solution.cost)) or 1.0
        checked.append(Miss("cost", "the cost", runs[-1].end, value, solution.cost, size))
    worst_first = tuple(sorted(checked, key=lambda miss: -miss.relative))
    trajectories = tuple(run.trajectory for run in runs)
    failure = Status.SOLVER_FAILED if failed else Status.SUCCESS
    return Verification(tolerance, rtol, worst_first, (), trajectories, value, failed, failure)


def motions(solution: Solution, rtol: float = RTOL) -> tuple[SetValued, ...]:
    """Return the exact motion of each phase with its contact modes, up to a failure.

    Raises:
        ValueError: see `verify_exactly`.
    """
    arcs = arcs_of(solution.problem, solution.meshes, solution.points)
    return tuple(_followed(arcs, rtol)[1])


def _followed(arcs: Sequence[Arc], rtol: float) -> tuple[tuple[Run, ...], list[SetValued], str]:
    """Return runs of the arcs with exact friction, their motions, and the failure message or ""."""
    found, failures = list[SetValued](), list[str]()

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
        found.append(motion)
        return Run(arc, motion.trajectory, float(arc.times[-1]))

    runs = resimulated(arcs, follow=follow)
    return runs, found, next(iter(failures), "")
