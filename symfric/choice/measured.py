"""One law in the user's machine: smoothed as far as the accuracy allows, timed at equal error."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from math import ceil, floor, inf, log10, nan
from time import process_time
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.choice import nature
from symfric.choice.continuation import (
    EFFORT,
    FINEST,
    LEAST,
    RUN,
    Asked,
    AtEqualError,
    Budget,
    at_equal_error,
    continued,
    counted,
    nearest,
    short,
)
from symfric.choice.friction import Friction
from symfric.choice.machine import FAILURES, OWN, Candidate, Reference, candidate, quiet_run
from symfric.choice.nature import lacking
from symfric.choice.ranking import FAILED, INACCURATE, LACKING, RANKED, REFUSED, Row, best_of, place
from symfric.choice.smoothing import MARGIN, OF_BRISTLES, SmoothingStudy
from symfric.codegen.blocks.block import Block
from symfric.codegen.blocks.from_model import plant_block
from symfric.figures.data import phenomena
from symfric.figures.motion import sampled
from symfric.figures.regularisation import Machine, positions
from symfric.foundation.parameters import parameters
from symfric.foundation.status import SolveError, Status
from symfric.integrator.equations.inputs import Input
from symfric.laws import Law
from symfric.model import Model

Array = NDArray[np.float64]
WORK = 100_000_000
"""CasADi instructions that one step size may take: what a small step is worth."""
FEWEST = 100
"""Whole powers are tried that make so many steps at least."""
CHUNK = 1000
"""Steps between looks whether the motion still is one."""


@final
@dataclass(frozen=True, eq=False)
class Motion:
    """Motion that fixed steps must follow: names of positions, values over times, sizes."""

    names: tuple[str, ...]
    t: Array
    values: Array
    size: Array


def largest(
    machine: Machine, model: Model, method: str, motion: Motion, share: float
) -> tuple[float | None, str]:
    """Return the largest step [s] in which the plant, as its C block steps, follows the motion.

    The plant block of `symfric.codegen` steps from the start to the end of the motion, inputs held
    at their value in the middle of each step. A step size holds if the positions are finite and
    within `share` of the size of the motion of the adaptive run of the same law, at every step.
    The largest of 1, 2, 5 times a power of ten that holds, with the power below it holding, too, is
    what is found: whole powers first, from large to small, then 2 and 5 times the one that holds.
    Limits: steps across the fold of a falling law hold or do not by the eighth digit of a
    parameter.

    Returns:
        The step, None where none was found, and why.
    """
    try:
        block = plant_block(model, method=method)
    except ValueError as problem:
        return None, str(problem).partition("; ")[0]
    step = _step(block)
    least = machine.t_end * step.n_instructions() / WORK
    first = floor(log10(machine.t_end / FEWEST))
    for power in range(first, floor(log10(least)) - 1, -1):
        tried = 10.0**power
        if tried < least:
            break
        if _follows(step, tried, block, machine, motion, share):
            return _refined(step, tried, block, machine, motion, share), ""
    return None, f"below {max(least, 1e-12):.0e} s, if any: smaller steps were not tried"


def _refined(
    step: ca.Function, h: float, block: Block, machine: Machine, motion: Motion,
    share: float,
) -> float:  # fmt: skip
    """Return the larger ones between h, which holds, and ten times that."""
    for factor in (5.0, 2.0):
        if _follows(step, factor * h, block, machine, motion, share):
            return factor * h
    return h


def _step(block: Block) -> ca.Function:
    """Return (states, [inputs; h]) -> states after a step."""
    x = ca.SX.sym("x", len(block.states))
    u = ca.SX.sym("u", len(block.inputs))
    h = ca.SX.sym("h")
    p = [h if v.name == "h" else ca.SX(float(v.start)) for v in block.parameters]  # pyright: ignore[reportArgumentType]
    after = block.step(x, ca.vertcat(ca.SX(0, 1), *p), u)[0]
    return ca.Function("step", [x, ca.vertcat(u, h)], [after])


def _follows(
    step: ca.Function, h: float, block: Block, machine: Machine, motion: Motion,
    share: float,
) -> bool:  # fmt: skip
    """Test for a motion in steps of `h` that is finite and follows."""
    count = ceil(machine.t_end / h - 1e-9)
    names = [v.name for v in block.states]
    rows = [names.index(name) for name in motion.names]
    x = np.array([float(v.start) for v in block.states])  # pyright: ignore[reportArgumentType]
    many = step.mapaccum("many", min(CHUNK, count))
    for begin in range(0, count, CHUNK):
        k = np.arange(begin, begin + min(CHUNK, count))
        middle: Array = np.multiply(k + 0.5, h, dtype=np.float64)
        u = _inputs(block, machine.u or {}, middle)
        found = many(x, np.vstack([u, np.full(k.size, h)])).full()
        t = (k + 1) * h
        seen = t <= machine.t_end * (1 + 1e-9)
        wanted = np.array([np.interp(t, motion.t, row) for row in motion.values])
        off = np.abs(found[rows] - wanted)[:, seen] / motion.size[:, None]
        if not (off <= share).all():  # NaN is not, either
            return False
        x = found[:, -1]
    return True


def _inputs(block: Block, given: Mapping[str, Input], t: Array) -> Array:
    """Return the inputs at the times `t`, shape (inputs, times); start values where none are
    given.
    """
    rows = [sampled(given.get(v.name, float(v.start)), t) for v in block.inputs]  # pyright: ignore[reportArgumentType]
    return np.array(rows).reshape(len(rows), t.size)


TIGHTER = 1e-2
"""Share of its tolerance at which a law has to keep the accuracy, too."""
AS_GOOD = 1.1
"""Errors from data within this ratio of the smallest are the same."""
ROUNDS, PATIENCE = 5, 0.2
"""Calls, the fastest of which is the time, as long as they take less than so many seconds."""


@final
@dataclass(frozen=True, eq=False)
class Task:
    """Requirements on every law.

    Attributes:
        frictions: place -> friction that they are to describe, "" for any.
        load: normal force [N] where it is one number.
        accuracy: largest error relative to the motion, of law and integrator together.
        control: largest error of fixed steps.
        own: laws come with their numbers: they were fitted.
        fixed: whether what a controller needs is measured: fixed steps, instructions on a core.
        work: CasADi instructions that a run may take.
        misfits: law -> error from data, measured elsewhere; None without data.
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
    work: int = RUN
    misfits: dict[str, float] | None = None

    @property
    def asked(self) -> Asked:
        """Errors that laws are run for."""
        return Asked(self.accuracy, self.control if self.fixed else 0.0)


def best_form(task: Task, name: str, laws: Sequence[Law]) -> Row:
    """Return the row of the first of several forms of a law that is ranked; without one of the
    best.

    A law that does not show what is needed does not show it in another form, either.
    """
    rows: list[Row] = []
    for law in laws:
        rows.append(measured(task, name, law))
        if rows[-1].standing in (RANKED, LACKING) or rows[-1].spent:
            break
    return best_of(rows)


def measured(task: Task, name: str, law: Law) -> Row:
    """Return the row of `law`; never raises for what a law or a machine may do."""
    shown = tuple(phenomena(law))
    hard = nature.physical(law)
    row = Row(
        name, REFUSED, phenomena=shown, states=len(law.states), parameters=len(hard[0]),
        hard=hard[1], form=nature.form(law), smoothness=nature.smoothness(law),
    )  # fmt: skip
    operations, why = nature.c_operations(law)
    row = replace(row, c_operations=operations, c_why=why)
    tried = list[tuple[Row, Candidate, SmoothingStudy]]()
    for bristles in OF_BRISTLES if law.states else OF_BRISTLES[:1]:
        try:
            held = candidate(task.machine, law, task.frictions, task.load, task.own, bristles)
            instructions, _ = counted(task.machine, held.first, task.asked.coarse)
        except FAILURES as problem:
            return replace(row, reason=_refusal(task.machine, problem))
        runs, found = Budget(held, instructions, task.work), SmoothingStudy((), "")
        try:
            task = _from_own(task, held, runs)
            found = continued(runs, task.reference, task.asked)
            placed = _placed(task, held, found, runs, row)
            tried.append((replace(placed, spent=not runs.left()), held, found))
        except FAILURES as problem:
            failed = replace(row, standing=FAILED, reason=short(problem))
            tried.append((failed, held, found))
        open_ended = not found.decided and EFFORT not in found.stopped
        if tried[-1][0].standing not in (INACCURATE, FAILED) or not open_ended:
            break
    row, held, found = min(tried, key=lambda each: place(each[0]))
    if row.standing == FAILED:
        return row
    if task.fixed:
        core, why = nature.on_core(law) if operations is not None else (nan, row.c_why)
        row = replace(_stepped(task, held, found, row), core=core, core_why=why)
    return _by_data(task.misfits, row)


def _refusal(machine: Machine, problem: Exception) -> str:
    """Return the reason why a machine cannot use a law, with the inputs that it lacks."""
    text = short(problem)
    _, lacks, what = text.partition("got one that needs ")
    return f"needs {what}, which {machine.name} does not give" if lacks else text


def _from_own(task: Task, held: Candidate, runs: Budget) -> Task:
    """Return the task with the law's own motion as reference, where only the integrator is
    judged.
    """
    if task.reference is not OWN:
        return task
    run = held.run(held.first, 0.1 * task.asked.fine, 10 * runs.most)
    return replace(task, reference=replace(OWN, motion=run.motion, size=run.size))


def _by_data(misfits: dict[str, float] | None, row: Row) -> Row:
    """Return the row with its error from data; ranked where that is about as small as the
    smallest.
    """
    if misfits is None or not row.attempts:
        return row
    misfit, best = misfits[row.law], min(misfits.values())
    row = replace(row, error=misfit, curve=())
    if row.ranked and misfit > AS_GOOD * best:
        why = f"{100 * misfit:.3g} % off the data, the best {100 * best:.3g} %"
        return replace(row, standing=INACCURATE, reason=why)
    return row


def _placed(task: Task, held: Candidate, levels: SmoothingStudy, runs: Budget, row: Row) -> Row:
    """Return the row with what was measured, and where it stands.

    Raises:
        SolveError: no run ends.
    """
    at = _judged(task, levels, runs)
    curve = tuple(
        (level.error, float(level.attempts * runs.instructions)) for level in levels.levels
    )
    counts, method = counted(task.machine, at.model, at.rtol)
    law = held.law_at(at.s)
    row = replace(
        row, curve=curve, error=at.error, own_error=at.own, smoothing=at.s, rtol=at.rtol,
        method=method, attempts=at.run.attempts, instructions=counts,
        time_s=_timed(task, law, at, runs), values=_own_numbers(law),
        steepness=nature.steepness(law, 1.0),
    )  # fmt: skip
    if missing := lacking(task.needs, row.phenomena):
        return replace(row, standing=LACKING, reason=f"shows no {', no '.join(missing)}")
    if row.error <= task.accuracy:
        return replace(row, standing=RANKED)
    driest = held.law_at(levels.levels[-1].s)
    known = "" if task.own else nature.otherwise(driest, task.frictions[""], task.load)
    mark = "" if levels.decided or not levels.stopped else "not decided: "
    said = [
        mark + (short(levels.stopped) or "no run keeps it, or not at tighter tolerances"),
        known,
    ]
    why = "; ".join(text for text in said if text)
    return replace(row, standing=INACCURATE, reason=f"{row.error:.1e} off: {why}")


def _judged(task: Task, levels: SmoothingStudy, runs: Budget) -> AtEqualError:
    """Return the run at equal error: from the reference where the law keeps it, else its own.

    Raises:
        SolveError: no run ends.
    """
    s = levels.softest(MARGIN * task.accuracy)
    last = levels.levels[-1]
    if s is not None:
        for smoothing in (s, last.s):  # between two levels the error is an estimate
            with suppress(SolveError):
                at = at_equal_error(runs, smoothing, task.reference, task.asked, last, whole=True)
                if at.error <= task.accuracy and _holds(task, at, runs):
                    return at
        off = tuple(level for level in levels.levels if level.error > task.accuracy)
        levels = replace(levels, levels=off or levels.levels[:1])
    near = nearest(levels)
    return at_equal_error(runs, near.s, task.reference, task.asked, near, whole=False)


def _holds(task: Task, at: AtEqualError, runs: Budget) -> bool:
    """Test for a far tighter run that keeps the accuracy: stiff bristles may fail in rounding."""
    tighter = max(TIGHTER * at.rtol, FINEST)
    if not runs.held.law.states or tighter >= at.rtol:
        return True
    try:
        return task.reference.off(runs.run(at.s, tighter).motion) <= task.accuracy
    except SolveError as problem:
        return problem.status is Status.MAX_STEPS


def _own_numbers(law: Law) -> dict[str, float]:
    """Return the parameters that are not those that the law comes with: what to give it."""
    known = {n: (float(p.value), p.default) for n, p in parameters(law).items()}  # pyright: ignore[reportArgumentType]
    with suppress(TypeError):  # a wrapper, which comes with no law in it
        whole = parameters(type(law)())  # of elements that a law comes with it says the numbers
        known = {
            n: (x, float(whole[n].value) if n in whole else inf) for n, (x, _) in known.items()
        }  # pyright: ignore[reportArgumentType]
    return {name: value for name, (value, start) in known.items() if value != start}


def _timed(task: Task, law: Law, at: AtEqualError, runs: Budget) -> float:
    """Shortest processor time [s] of a few calls; the integrator is built already."""
    best, began = inf, process_time()
    for _ in range(ROUNDS):
        found = quiet_run(task.machine, at.model, law, at.rtol, runs.most)
        best = min(best, found.time_s)
        if process_time() - began > PATIENCE:
            break
    return best


def _stepped(task: Task, held: Candidate, levels: SmoothingStudy, row: Row) -> Row:
    """Return the row with the largest fixed steps, of the law as soft as these may be off.

    A law that never comes so near to the reference is followed as it was judged.
    """
    s = levels.softest(task.control)
    try:
        model, law = held.model(s or row.smoothing), held.law_at(s or row.smoothing)
        machine = replace(task.machine, of=None, times=None)
        most = max(LEAST, task.work // row.instructions)
        run = quiet_run(machine, model, law, row.rtol if s is None else task.asked.fine, most)
    except FAILURES as problem:
        return replace(row, fixed_why=short(problem), explicit_why=short(problem))
    names = positions(model, law)
    t = np.linspace(0.0, machine.t_end, run.motion.shape[1])
    motion = Motion(names, t, run.motion, run.size)
    implicit = largest(machine, model, "backward_euler", motion, task.control)
    explicit = largest(machine, model, "dopri5", motion, task.control)
    return replace(
        row, fixed_step=implicit[0], fixed_why=short(implicit[1]),
        explicit_step=explicit[0], explicit_why=short(explicit[1]),
    )  # fmt: skip
