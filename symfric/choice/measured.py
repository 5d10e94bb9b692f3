"""Measurement of one law in a machine, at equal error and as smooth as the accuracy allows."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from math import ceil, floor, inf, log10, nan
from time import process_time
from typing import final

import casadi as ca
import numpy as np

from symfric.choice import continuation, nature
from symfric.choice.continuation import AtEqualError, Budget, Wanted, at_equal_error, short
from symfric.choice.friction import Friction
from symfric.choice.machine import FAILURES, OWN, Candidate, Reference, candidate, quiet_run
from symfric.choice.nature import lacking
from symfric.choice.ranking import FAILED, INACCURATE, LACKING, RANKED, REFUSED, RankedLaw, place
from symfric.choice.smoothing import MARGIN, OF_BRISTLES, SmoothingStudy
from symfric.codegen.blocks.block import Block
from symfric.codegen.blocks.from_model import plant_block
from symfric.figures.data import phenomena
from symfric.figures.motion import sampled
from symfric.figures.regularisation import Machine, positions
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import parameters
from symfric.foundation.status import SolveError, Status
from symfric.laws import Law
from symfric.model import Model

WORK = 100_000_000
"""Largest number of CasADi instructions for one step size."""
FEWEST = 100
"""Number of steps of the motion with the largest step size that is tried."""
CHUNK = 1000
"""Number of steps between checks of the motion."""


@final
@dataclass(frozen=True, eq=False)
class ReferenceMotion:
    """Motion that fixed steps must follow.

    Attributes:
        names: names of the positions.
        t: times [s].
        values: positions over the times, shape (positions, times).
        size: size of each row, to which errors are relative.
    """

    names: tuple[str, ...]
    t: Array
    values: Array
    size: Array


def largest(
    machine: Machine, model: Model, method: str, motion: ReferenceMotion, share: float
) -> tuple[float | None, str]:
    """Return the largest step [s] with which the plant follows the motion, or None and the reason.

    The plant block of `symfric.codegen` steps from the start to the end of the motion. Inputs are
    constant in each step, with their values at its middle. A step size is valid if at every step
    the positions are finite and differ from the adaptive run of the same law by at most `share` of
    the size of the motion. Powers of ten are tried from large to small. The result is the first
    valid one, or 2 or 5 times this power if that is valid as well.
    Limits: if steps cross the peak of a falling law, the result may be sensitive to the eighth
    digit of a parameter.
    """
    try:
        block = plant_block(model, method=method)
    except ValueError as problem:
        return None, str(problem).partition("; ")[0]
    step = _step(block)
    least = machine.t_end * step.n_instructions() / WORK
    first = floor(log10(machine.t_end / FEWEST))
    for power in range(first, floor(log10(least)) - 1, -1):
        h = 10.0**power
        if h >= least and _follows(step, h, block, machine, motion, share):
            for longer in (5.0 * h, 2.0 * h):
                if _follows(step, longer, block, machine, motion, share):
                    return longer, ""
            return h, ""
    return None, f"below {max(least, 1e-12):.0e} s, if any: smaller steps were not tried"


def _step(block: Block) -> ca.Function:
    """Return the function (states, [inputs; h]) -> states after a step."""
    x = ca.SX.sym("x", len(block.states))
    u = ca.SX.sym("u", len(block.inputs))
    h = ca.SX.sym("h")
    p = [h if v.name == "h" else ca.SX(float(v.start)) for v in block.parameters]  # pyright: ignore[reportArgumentType]
    after = block.step(x, ca.vertcat(ca.SX(0, 1), *p), u)[0]
    return ca.Function("step", [x, ca.vertcat(u, h)], [after])


def _follows(
    step: ca.Function, h: float, block: Block, machine: Machine, motion: ReferenceMotion,
    share: float,
) -> bool:  # fmt: skip
    """Return True if the motion in steps of `h` [s] is finite and within `share` of `motion`."""
    count = ceil(machine.t_end / h - 1e-9)
    names = [v.name for v in block.states]
    rows = [names.index(name) for name in motion.names]
    x = np.array([float(v.start) for v in block.states])  # pyright: ignore[reportArgumentType]
    many = step.mapaccum("many", min(CHUNK, count))
    for begin in range(0, count, CHUNK):
        k = np.arange(begin, begin + min(CHUNK, count))
        middle: Array = np.multiply(k + 0.5, h, dtype=np.float64)
        given = machine.u or {}
        u = [sampled(given.get(v.name, float(v.start)), middle) for v in block.inputs]  # pyright: ignore[reportArgumentType]
        states = many(x, np.vstack([*u, np.full(k.size, h)])).full()
        t = (k + 1) * h
        within = t <= machine.t_end * (1 + 1e-9)
        wanted = np.array([np.interp(t, motion.t, row) for row in motion.values])
        off = np.abs(states[rows] - wanted)[:, within] / motion.size[:, None]
        if not (off <= share).all():  # also for NaN
            return False
        x = states[:, -1]
    return True


TIGHTER = 1e-2
"""Ratio of a tighter tolerance, at which a law must satisfy the accuracy as well."""
AS_GOOD = 1.1
"""Largest ratio to the smallest error from data at which a law is ranked."""
ROUNDS, PATIENCE = 5, 0.2
"""Largest number of timed calls, and the total time [s] after which timing stops."""


@final
@dataclass(frozen=True, eq=False)
class Requirements:
    """Requirements that apply to all laws.

    Attributes:
        machine: the machine.
        reference: motion from which errors are measured.
        needs: required phenomena, words of `NEEDS`.
        frictions: maps contacts to the friction to describe; the key "" is for all others.
        load: normal force [N]; None if it is not one number.
        accuracy: largest allowed error of law and integrator together, relative to the motion.
        control: largest allowed error of fixed steps.
        own: True if laws were fitted and keep their parameters.
        fixed: True if fixed steps and instructions on a core are measured.
        work: largest number of CasADi instructions of a run.
        misfits: maps laws to errors from data of another machine; None without such data.
    """

    machine: Machine
    reference: Reference
    needs: tuple[str, ...]
    frictions: dict[str, Friction]
    load: float | None
    accuracy: float
    control: float
    own: bool
    fixed: bool
    work: int = continuation.RUN
    misfits: dict[str, float] | None = None

    @property
    def goal(self) -> Wanted:
        """Required errors of the runs."""
        return Wanted(self.accuracy, self.control if self.fixed else 0.0)


def best_form(required: Requirements, name: str, laws: Sequence[Law]) -> RankedLaw:
    """Return the row of the first ranked form of a law, or of its best form if none is ranked.

    If a form lacks a required phenomenon, the other forms lack it as well and are not measured.
    """
    rows: list[RankedLaw] = []
    for law in laws:
        rows.append(measured(required, name, law))
        if rows[-1].standing in (RANKED, LACKING) or rows[-1].spent:
            break
    return min(rows, key=place)


def measured(required: Requirements, name: str, law: Law) -> RankedLaw:
    """Return the row of `law`; errors of the law or of the machine become the reason."""
    known, hard = nature.physical(law)
    operations, why = nature.c_operations(law)
    row = RankedLaw(
        name, REFUSED, phenomena=tuple(phenomena(law)), states=len(law.states),
        parameters=len(known), hard=hard, form=nature.form(law), c_operations=operations, c_why=why,
        smoothness=nature.smoothness(law),
    )  # fmt: skip
    tried = list[tuple[RankedLaw, Candidate, SmoothingStudy]]()
    for bristles in OF_BRISTLES if law.states else OF_BRISTLES[:1]:
        try:
            held = candidate(
                required.machine, law, required.frictions, required.load, required.own, bristles
            )
            instructions, _ = continuation.counted(
                required.machine, held.first, required.goal.coarse
            )
        except FAILURES as problem:
            text = short(problem)
            _, lacks, inputs = text.partition("got one that needs ")
            refusal = (
                f"needs {inputs}, which {required.machine.name} does not give" if lacks else text
            )
            return replace(row, reason=refusal)
        runs, found = Budget(held, instructions, required.work), SmoothingStudy((), "")
        try:
            if required.reference is OWN:  # a fine run of the law is its reference
                run = held.run(held.first, 0.1 * required.goal.fine, 10 * runs.most)
                own = replace(OWN, motion=run.motion, size=run.size)
                required = replace(required, reference=own)
            found = continuation.continued(runs, required.reference, required.goal)
            placed = _placed(required, held, found, runs, row)
            tried.append((replace(placed, spent=not runs.left()), held, found))
        except FAILURES as problem:
            failed = replace(row, standing=FAILED, reason=short(problem))
            tried.append((failed, held, found))
        open_ended = not found.decided and continuation.EFFORT not in found.stopped
        if tried[-1][0].standing not in (INACCURATE, FAILED) or not open_ended:
            break
    row, held, found = min(tried, key=lambda each: place(each[0]))
    if row.standing == FAILED:
        return row
    if required.fixed:
        core, why = nature.on_core(law) if operations is not None else (nan, row.c_why)
        row = replace(_stepped(required, held, found, row), core=core, core_why=why)
    return _by_data(required.misfits, row)


def _by_data(misfits: dict[str, float] | None, row: RankedLaw) -> RankedLaw:
    """Return the row with its error from data; it is ranked if this error is near the smallest."""
    if misfits is None or not row.attempts:
        return row
    misfit, best = misfits[row.law], min(misfits.values())
    row = replace(row, error=misfit, curve=())
    if row.ranked and misfit > AS_GOOD * best:
        why = f"{100 * misfit:.3g} % off the data, the best {100 * best:.3g} %"
        return replace(row, standing=INACCURATE, reason=why)
    return row


def _placed(
    required: Requirements, held: Candidate, levels: SmoothingStudy, runs: Budget, row: RankedLaw
) -> RankedLaw:
    """Return the row with the measurements and the standing.

    Raises:
        SolveError: no run reaches the end of the motion.
    """
    at = _judged(required, levels, runs)
    curve = tuple(
        (level.error, float(level.attempts * runs.instructions)) for level in levels.levels
    )
    counts, method = continuation.counted(required.machine, at.model, at.rtol)
    law = held.law_at(at.s)
    row = replace(
        row, curve=curve, error=at.error, own_error=at.own, smoothing=at.s, rtol=at.rtol,
        method=method, attempts=at.run.attempts, instructions=counts,
        time_s=_timed(required, law, at, runs), values=_own_numbers(law),
        steepness=nature.steepness(law, 1.0),
    )  # fmt: skip
    if missing := lacking(required.needs, row.phenomena):
        return replace(row, standing=LACKING, reason=f"shows no {', no '.join(missing)}")
    if row.error <= required.accuracy:
        return replace(row, standing=RANKED)
    driest = held.law_at(levels.levels[-1].s)
    known = "" if required.own else nature.otherwise(driest, required.frictions[""], required.load)
    why = short(levels.stopped) or "no run keeps it, or not at tighter tolerances"
    why = "not decided: " * bool(levels.stopped and not levels.decided) + why
    why += f"; {known}" * bool(known)
    return replace(row, standing=INACCURATE, reason=f"{row.error:.1e} off: {why}")


def _judged(required: Requirements, levels: SmoothingStudy, runs: Budget) -> AtEqualError:
    """Return the run at equal error from the reference, or at equal own error if there is none.

    Raises:
        SolveError: no run reaches the end of the motion.
    """
    s = levels.softest(MARGIN * required.accuracy)
    last = levels.levels[-1]
    if s is not None:
        for smoothing in (s, last.s):  # s lies between two levels, where the error is estimated
            with suppress(SolveError):
                at = at_equal_error(
                    runs, smoothing, required.reference, required.goal, last, whole=True
                )
                if at.error <= required.accuracy and _holds(required, at, runs):
                    return at
        off = tuple(level for level in levels.levels if level.error > required.accuracy)
        levels = replace(levels, levels=off or levels.levels[:1])
    near = continuation.nearest(levels)
    return at_equal_error(runs, near.s, required.reference, required.goal, near, whole=False)


def _holds(required: Requirements, at: AtEqualError, runs: Budget) -> bool:
    """Return True if a run at a much tighter tolerance satisfies the accuracy as well.

    Runs of stiff bristles may fail this test because of rounding errors.
    """
    tighter = max(TIGHTER * at.rtol, continuation.FINEST)
    if not runs.held.law.states or tighter >= at.rtol:
        return True
    try:
        return required.reference.off(runs.run(at.s, tighter).motion) <= required.accuracy
    except SolveError as problem:
        return problem.status is Status.MAX_STEPS


def _own_numbers(law: Law) -> dict[str, float]:
    """Return the parameters that differ from the defaults of the law."""
    starts = {n: p.default for n, p in parameters(law).items()}
    with suppress(TypeError):  # a wrapper has no default law
        starts = {n: float(p.value) for n, p in parameters(type(law)()).items()}  # pyright: ignore[reportArgumentType]
    values = {n: float(p.value) for n, p in parameters(law).items()}  # pyright: ignore[reportArgumentType]
    return {n: value for n, value in values.items() if value != starts.get(n, inf)}


def _timed(required: Requirements, law: Law, at: AtEqualError, runs: Budget) -> float:
    """Return the shortest processor time [s] of several calls, without building the integrator."""
    best, began = inf, process_time()
    for _ in range(ROUNDS):
        found = quiet_run(required.machine, at.model, law, at.rtol, runs.most)
        best = min(best, found.time_s)
        if process_time() - began > PATIENCE:
            break
    return best


def _stepped(
    required: Requirements, held: Candidate, levels: SmoothingStudy, row: RankedLaw
) -> RankedLaw:
    """Return the row with the largest fixed steps, for the law as smooth as `control` allows.

    If the law does not satisfy `control` at any smoothing, the smoothing of `row` is used.
    """
    s = levels.softest(required.control)
    try:
        model, law = held.model(s or row.smoothing), held.law_at(s or row.smoothing)
        machine = replace(required.machine, of=None, times=None)
        most = max(continuation.LEAST, required.work // row.instructions)
        run = quiet_run(machine, model, law, row.rtol if s is None else required.goal.fine, most)
    except FAILURES as problem:
        return replace(row, fixed_why=short(problem), explicit_why=short(problem))
    names = positions(model, law)
    t = np.linspace(0.0, machine.t_end, run.motion.shape[1])
    motion = ReferenceMotion(names, t, run.motion, run.size)
    implicit = largest(machine, model, "backward_euler", motion, required.control)
    explicit = largest(machine, model, "dopri5", motion, required.control)
    return replace(
        row, fixed_step=implicit[0], fixed_why=short(implicit[1]),
        explicit_step=explicit[0], explicit_why=short(explicit[1]),
    )  # fmt: skip
