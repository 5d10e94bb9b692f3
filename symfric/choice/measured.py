"""One law in the user's machine: as soft as the accuracy allows, timed at equal error."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from math import inf, isfinite
from time import process_time
from typing import final

import numpy as np

from symfric.choice import nature
from symfric.choice.fixed_step import Motion, largest
from symfric.choice.friction import Friction
from symfric.choice.machine import FAILURES, Candidate, Machine, candidate
from symfric.choice.needs import lacking
from symfric.choice.reference import OWN, Reference
from symfric.choice.row import FAILED, INACCURATE, LACKING, RANKED, REFUSED, Row, ordered
from symfric.choice.softness import MARGIN, Ladder, Rung, ladder
from symfric.figures.regularisation import Sample, positions
from symfric.figures.requirements import phenomena
from symfric.foundation.parameters import parameters
from symfric.foundation.status import SolveError, Status
from symfric.laws import Law
from symfric.model import Model
from symfric.results.trajectory import Trajectory

WORK = 400_000_000
"""CasADi instructions that a run may take, about a second."""
AS_GOOD = 1.1
"""Errors from data within this ratio of the smallest are the same."""
LEAST = 20_000
"""Attempts that any run may take."""
LOOSEST, PER_DECADE = 1e-3, 2
"""Relative tolerances that are tried: half decades from here on."""
ROUNDS, PATIENCE = 5, 1.0
"""Calls, the fastest of which is the time, as long as they take less than so many seconds."""


Points = dict[float, tuple[float, float]]
"""Softness -> error and processor time [s]."""


@final
@dataclass(frozen=True, eq=False)
class Task:
    """What is asked of every law.

    Attributes:
        frictions: place -> friction that they are to describe, "" for any.
        load: normal force [N] where it is one number.
        accuracy: largest error relative to the motion, of law and integrator together.
        control: largest error of fixed steps.
        own: laws come with their numbers: they were fitted.
        fixed: whether fixed steps are measured.
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
    work: int = WORK
    misfits: dict[str, float] | None = None

    @property
    def fine(self) -> float:
        """Relative tolerance at which the integrator's error is negligible."""
        return min(1e-7, max(1e-11, 1e-4 * self.accuracy))


def best_form(task: Task, name: str, laws: Sequence[Law]) -> Row:
    """The row of the first of several forms of a law that is ranked; without one of the best.

    A law that does not show what is needed does not show it in another form, either.
    """
    rows: list[Row] = []
    for law in laws:
        rows.append(measured(task, name, law))
        if rows[-1].standing in (RANKED, LACKING):
            break
    return ordered(rows)[0]


def measured(task: Task, name: str, law: Law) -> Row:
    """The row of `law`; never raises for what a law or a machine may do."""
    shown = tuple(phenomena(law))
    hard = nature.physical(law)
    row = Row(
        name, REFUSED, phenomena=shown, states=len(law.states), parameters=len(hard[0]),
        hard=hard[1], form=nature.form(law),
    )  # fmt: skip
    operations, why = nature.c_operations(law)
    row = replace(row, c_operations=operations, c_why=why, smoothness=nature.smoothness(law))
    try:
        held = candidate(task.machine, law, task.frictions, task.load, task.own)
        most = _most(task, held.first)
    except FAILURES as problem:
        return replace(row, reason=_short(problem))
    try:
        task = _from_own(task, held, most)
        found = _climbed(task, held, most)
    except FAILURES as problem:
        return replace(row, standing=FAILED, reason=_short(problem))
    return _by_data(task.misfits, _placed(task, held, found, most, row))


def _from_own(task: Task, held: Candidate, most: int) -> Task:
    """The task with the law's own motion as reference, where only the integrator is judged."""
    if task.reference is not OWN:
        return task
    run = task.machine.run(held.first, held.law, 0.1 * task.fine, 10 * most)
    return replace(task, reference=replace(OWN, motion=run.motion, size=run.size))


def _by_data(misfits: dict[str, float] | None, row: Row) -> Row:
    """The row with its error from data; ranked where that is about as small as the smallest."""
    if misfits is None or not row.attempts:
        return row
    misfit, best = misfits[row.law], min(misfits.values())
    row = replace(row, error=misfit, curve=())
    if row.ranked and misfit > AS_GOOD * best:
        why = f"{100 * misfit:.3g} % off the data, the best {100 * best:.3g} %"
        return replace(row, standing=INACCURATE, reason=why)
    return row


def _most(task: Task, model: Model) -> int:
    """Attempts that a run of this model may take."""
    instructions, _ = task.machine.instructions(model, task.fine)
    return max(LEAST, task.work // max(1, instructions))


def _climbed(task: Task, held: Candidate, most: int) -> tuple[Ladder, Points]:
    """The ladder of softness, and error and time of each rung where the tolerance fits it."""
    points: dict[float, tuple[float, float]] = {}

    def run(s: float) -> Rung:
        model = held.model(s)
        found = task.machine.run(model, held.law, task.fine, most)
        error = task.reference.off(found.motion)
        if found.time_s < PATIENCE:
            points[s] = _as_careful(task, model, held.law, error, most)
        return Rung(s, error, found.attempts)

    wanted = MARGIN * task.accuracy
    softest = max(task.accuracy, task.control) if task.fixed else task.accuracy
    found = ladder(run, wanted, softest, held.scalable, FAILURES, _short)
    return found, points


def _as_careful(task: Task, model: Model, law: Law, error: float, most: int) -> tuple[float, float]:
    """Error and processor time [s] of a run as careful as its law is; infinite where it fails."""
    rtol = min(LOOSEST, max(task.fine, 0.1 * error))
    try:
        runs = [task.machine.run(model, law, rtol, most) for _ in range(2)]
    except FAILURES:
        return inf, inf
    return task.reference.off(runs[0].motion), min(run.time_s for run in runs)


def _placed(task: Task, held: Candidate, found: tuple[Ladder, Points], most: int, row: Row) -> Row:
    """The row with what was measured, and where it stands."""
    rungs, points = found
    seen = [points[rung.s] for rung in rungs.rungs if rung.s in points]
    curve = tuple(point for point in seen if isfinite(point[0]))
    missing = lacking(task.needs, row.phenomena)
    s = rungs.softest(MARGIN * task.accuracy)
    driest = rungs.rungs[-1]
    row = replace(row, curve=curve, error=driest.error)
    try:
        row = _at_equal_error(task, held, driest.s if s is None else s, most, row)
    except FAILURES as problem:
        row = replace(row, standing=FAILED, reason=_short(problem))
    if row.standing != FAILED and not row.error <= task.accuracy:
        why = f": {rungs.stopped}" if rungs.stopped else ""
        row = replace(
            row, standing=INACCURATE, reason=f"{driest.error:.1e} off, however dry{_short(why)}"
        )
    elif row.standing != FAILED:
        row = replace(row, standing=RANKED, reason="")
    if missing and row.standing != FAILED:
        row = replace(row, standing=LACKING, reason=f"shows no {', no '.join(missing)}")
    return _stepped(task, held, rungs, row) if task.fixed else row


def _at_equal_error(task: Task, held: Candidate, s: float, most: int, row: Row) -> Row:
    """The loosest tolerance at which law and integrator together keep the accuracy, timed.

    A tolerance counts if the next tighter one keeps the accuracy, too; where none does the finest.
    """
    model, law = held.model(s), held.law_at(s)
    goal = max(task.accuracy, 1.0001 * row.error)
    rtol, before = LOOSEST, None
    chosen: tuple[float, Sample, float] | None = None
    while rtol >= 0.9 * task.fine:
        try:
            run = task.machine.run(model, law, rtol, most)
            error = task.reference.off(run.motion)
        except SolveError:
            run, error = None, inf
        good = run is not None and error <= goal
        if good and before is not None:
            chosen = before
            break
        before = (rtol, run, error) if run is not None and good else None
        rtol *= 10 ** (-1 / PER_DECADE)
    if chosen is None and before is not None:
        chosen = before
    if chosen is None:
        rtol = task.fine
        run = task.machine.run(model, law, rtol, most)
        chosen = rtol, run, task.reference.off(run.motion)
    rtol, run, error = chosen
    instructions, method = task.machine.instructions(model, rtol)
    return replace(
        row, error=error, rtol=rtol, method=method, attempts=run.attempts,
        instructions=instructions, time_s=_timed(task, model, law, rtol, most, run),
        values=_own_numbers(law),
        steepness=nature.steepness(law, 1.0),
    )  # fmt: skip


def _own_numbers(law: Law) -> dict[str, float]:
    """The parameters that are not those that the law comes with: what to give it."""
    known = {n: (float(p.value), p.default) for n, p in parameters(law).items()}  # pyright: ignore[reportArgumentType]
    with suppress(TypeError):  # a wrapper, which comes with no law in it
        whole = parameters(type(law)())  # of elements that a law comes with it says the numbers
        known = {
            n: (x, float(whole[n].value) if n in whole else inf) for n, (x, _) in known.items()
        }  # pyright: ignore[reportArgumentType]
    return {name: value for name, (value, start) in known.items() if value != start}


def _timed(task: Task, model: Model, law: Law, rtol: float, most: int, run: Sample) -> float:
    """Shortest processor time [s] of a few calls; the integrator is built already."""
    best, began = run.time_s, process_time()
    for _ in range(ROUNDS):
        best = min(best, task.machine.run(model, law, rtol, most).time_s)
        if process_time() - began > PATIENCE:
            break
    return best


def _stepped(task: Task, held: Candidate, rungs: Ladder, row: Row) -> Row:
    """The row with the largest fixed steps, of the law as soft as these may be off."""
    s = rungs.softest(task.control)
    if s is None:
        why = f"the law is {rungs.rungs[-1].error:.1e} off itself"
        return replace(row, fixed_why=why, explicit_why=why)
    try:
        model, law = held.model(s), held.law_at(s)
        machine = replace(task.machine, of=None, times=None)
        run = machine.run(model, law, task.fine, 10 * LEAST)
    except FAILURES as problem:
        return replace(row, fixed_why=_short(problem), explicit_why=_short(problem))
    names = positions(model, law)
    t = np.linspace(0.0, machine.t_end, run.motion.shape[1])
    motion = Motion(names, t, run.motion, run.size)
    implicit = largest(machine, model, "backward_euler", motion, task.control)
    explicit = largest(machine, model, "dopri5", motion, task.control)
    return replace(
        row, fixed_step=implicit[0], fixed_why=_short(implicit[1]),
        explicit_step=explicit[0], explicit_why=_short(explicit[1]),
    )  # fmt: skip


def _short(problem: object) -> str:
    """The first sentence of an error; of a run that failed what its status says."""
    if isinstance(problem, SolveError) and isinstance(problem.partial, Trajectory):
        run = problem.partial
        said = {
            Status.MAX_STEPS: f"more than {run.statistics.steps + run.statistics.rejections} tries",
            Status.JAMMED: "friction jams",
            Status.STEP_TOO_SMALL: "the step becomes too small",
            Status.EVENT_STORM: "events pile up",
        }
        if problem.status in said:
            return f"{said[problem.status]} by t = {run.t[-1]:.3g} s"
    return " ".join(str(problem).split()).partition("; ")[0]
