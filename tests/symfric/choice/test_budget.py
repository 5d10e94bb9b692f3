"""The budget of a law and the run it is judged by, tested with tables of runs."""

from dataclasses import dataclass, field
from math import log, log10, pi
from types import SimpleNamespace
from typing import Any, cast

import casadi as ca
import numpy as np
import pytest

from symfric import Model, SolveError, Status, Variable, rabinowicz, simulate
from symfric.choice import continuation
from symfric.choice.continuation import (
    EVENTS,
    LEAST,
    LEAST_WHOLE,
    ON_THE_WAY,
    Budget,
    Wanted,
    at_equal_error,
    continued,
    counted,
    nearest,
)
from symfric.choice.machine import Candidate, Reference
from symfric.choice.measured import (
    ReferenceMotion,
    _holds,  # pyright: ignore[reportPrivateUsage]
    largest,
)
from symfric.choice.smoothing import Smoothed, SmoothingStudy
from symfric.figures.regularisation import Machine, Sample
from symfric.foundation.numeric import Array
from symfric.integrator import Input, Linear
from symfric.laws import LuGre, Stribeck, Viscous
from symfric.model import Event
from symfric.scenes import Drive

TRUTH = Reference("one", np.ones((1, 1)), np.ones(1), 0.0)


@dataclass
class Written:
    """A law in a machine: (s, rtol) -> error and attempts; more than are allowed is a failure."""

    error: Any
    attempts: Any
    fails: Status = Status.MAX_STEPS
    requested: list[tuple[float, float]] = field(default_factory=list[tuple[float, float]])
    law: Any = None
    power: float = 1.0

    def model(self, s: float) -> float:
        return s

    def run(self, s: float, rtol: float, most: int) -> Sample:
        self.requested.append((s, rtol))
        if (made := self.attempts(s, rtol)) > most:
            raise SolveError("too many", self.fails, PARTIAL)
        return Sample(s, {}, rtol, made, made, 0.0, np.array([[1 + self.error(s, rtol)]]), ONE)


ONE = np.ones(1)
PARTIAL = simulate(rabinowicz(LuGre()), 0.01, samples=2, backend="vm")
TRIED = PARTIAL.statistics.steps + PARTIAL.statistics.rejections


def budget(held: Written, instructions: int = 1000, work: int = 20_000_000) -> Budget:
    return Budget(cast(Candidate, held), instructions, work)


def test_no_run_is_made_twice_and_those_that_fail_count() -> None:
    held = Written(lambda s, _: s, lambda s, _: 100 if s > 0.5 else 10**9)
    runs = budget(held)
    assert runs.run(1.0, 1e-6) is runs.run(1.0, 1e-6)
    assert (runs.attempts, len(held.requested)) == ([100], 1)
    with pytest.raises(SolveError):
        runs.run(0.25, 1e-6)
    assert runs.attempts == [100, TRIED]


def test_a_run_of_a_large_machine_may_take_a_few_attempts_all_the_same() -> None:
    runs = budget(Written(None, None))
    assert (runs.most, runs.whole) == (20_000, 100_000)
    large = budget(Written(None, None), instructions=10**9)
    assert (large.most, large.whole) == (LEAST, LEAST_WHOLE)
    runs.attempts.append(int(0.55 * runs.whole))
    assert runs.left() and runs.left(0.6) and not runs.left(0.5)


def test_the_search_for_events_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    x = Variable("x", "m")
    models = [Model("m", x=(x,), ode=-x.symbol, events=e) for e in ((), (Event("zero", x - 1),))]
    machine = Machine("m", lambda _: models[0], 1.0)
    monkeypatch.setattr(continuation, "built", lambda *_: (SimpleNamespace(instructions=70), None))
    assert [counted(machine, model, 1e-6)[0] for model in models] == [70, 70 + EVENTS]


GOAL = Wanted(1e-3, 0.0)


def test_the_way_to_dry_friction_leaves_a_part_of_the_budget() -> None:
    held = Written(lambda s, _: 0.9 / (1 - log(s, 4)), lambda s, _: round(4_000 / s**0.15))
    runs = budget(held)
    found = continued(runs, TRUTH, GOAL)
    assert found.stopped.startswith("drier runs take more than")
    spent = sum(runs.attempts)
    assert 0 <= spent - ON_THE_WAY * runs.whole < runs.most


@pytest.mark.parametrize("status", [Status.MAX_STEPS, Status.JAMMED])
def test_only_a_run_of_too_many_attempts_is_made_at_a_looser_tolerance(status: Status) -> None:
    held = Written(lambda *_: 1e-2, lambda s, rtol: 10**9 if rtol < 5e-6 else 100, status)
    if status is Status.JAMMED:
        with pytest.raises(SolveError):
            continued(budget(held), TRUTH, GOAL)
        assert held.requested == [(1.0, 1e-6)]
        return
    held.power = 0.0
    found = continued(budget(held), TRUTH, GOAL)
    assert [level.rtol for level in found.levels] == [pytest.approx(1e-5)]


def test_the_nearest_rung_is_the_softest_of_about_the_smallest_error() -> None:
    levels = tuple(Smoothed(4.0**-k, e, 1) for k, e in enumerate((0.9, 0.15, 0.1, 0.12)))
    assert nearest(SmoothingStudy(levels, "")).s == 0.25


def test_the_own_error_is_that_of_the_tolerance_that_is_taken() -> None:
    """Of a law that is 0.3 off however fine it runs, and whose integrator errs by rtol."""
    held = Written(lambda _, rtol: 0.3 + 2 * rtol, lambda *_: 100)
    level = Smoothed(1.0, 0.3, 100, GOAL.fine)
    found = at_equal_error(budget(held), 1.0, TRUTH, GOAL, level, whole=False)
    assert found.rtol == pytest.approx(10**-3.5)
    assert found.own == pytest.approx(2 * found.rtol, rel=1e-3)
    assert found.error == pytest.approx(0.3, abs=1e-3)


def test_a_tolerance_that_keeps_the_accuracy_by_chance_is_not_taken() -> None:
    """Errors change their sign with the tolerance: at 1e-3 it is small, at half a decade not."""
    errors = {-6: 1e-4, -7: 5e-3, -8: 6e-4, -9: 2e-4}
    held = Written(lambda _, rtol: errors.get(round(2 * log10(rtol)), 0.0), lambda *_: 100)
    level = Smoothed(1.0, 0.0, 100, GOAL.fine)
    found = at_equal_error(budget(held), 1.0, TRUTH, GOAL, level, whole=True)
    assert (found.rtol, found.error) == (pytest.approx(1e-4), pytest.approx(6e-4))


def test_where_only_the_finest_run_keeps_the_accuracy_its_own_error_is_that_of_the_next() -> None:
    held = Written(lambda _, rtol: 1e6 * rtol, lambda *_: 100)
    level = Smoothed(1.0, 0.0, 100, GOAL.fine)
    found = at_equal_error(budget(held), 1.0, TRUTH, GOAL, level, whole=False)
    assert found.rtol == GOAL.fine
    assert found.own > 1e-3  # not zero, the difference from itself


@pytest.mark.parametrize(
    ("tight", "status", "kept"),
    [(1e-4, Status.SOLVER_FAILED, True), (0.5, Status.SOLVER_FAILED, False),
     (None, Status.SOLVER_FAILED, False), (None, Status.MAX_STEPS, True)],
)  # fmt: skip
def test_bristles_keep_the_accuracy_in_a_far_tighter_run_or_are_not_ranked(
    tight: float | None, status: Status, kept: bool
) -> None:
    """Errors there, and failures for reasons other than the cost, are rounding."""
    held: Any = Written(
        lambda _, rtol: tight if rtol < 1e-5 else 1e-4,
        lambda _, rtol: 10**9 if tight is None and rtol < 1e-5 else 100,
        status,
    )
    held.law = LuGre()
    task: Any = SimpleNamespace(reference=TRUTH, accuracy=1e-3)
    at: Any = SimpleNamespace(s=0.1, rtol=1e-4)
    assert _holds(task, at, budget(held)) is kept
    held.law = Stribeck()
    assert _holds(task, at, budget(held))


C, W, END = 20.0, 4 * pi, 2.0


def exact(t: Array) -> Array:
    """x of v' = sin(W t) - C v from rest."""
    swing = (1 - np.cos(W * t)) * C / W - np.sin(W * t)
    return (swing + (1 - np.exp(-C * t)) * W / C) / (C * C + W * W)


def off(h: float) -> float:
    """Largest error of backward Euler, the force that of the middle of each step."""
    x, v, worst = 0.0, 0.0, 0.0
    for k in range(round(END / h)):
        v = (v + h * np.sin(W * h * (k + 0.5))) / (1 + h * C)
        x += h * v
        worst = max(worst, abs(x - float(exact(np.array(h * (k + 1))))))
    return worst


FINE = np.linspace(0.0, END, 20001)


@pytest.mark.parametrize(("step", "sampled"), [(2e-3, False), (5e-3, True), (2e-2, False)])
def test_it_is_the_largest_round_step_that_stays_near(step: float, sampled: bool) -> None:
    """An error that this step has by a hair, and none that is larger."""
    size = float(np.ptp(exact(FINE)))
    share = 1.02 * off(step) / size
    assert all(off(h) / size > share for h in (2e-3, 5e-3, 1e-2, 2e-2, 5e-2) if h > step)
    push: Input = Linear(FINE, np.sin(W * FINE)) if sampled else lambda t: ca.sin(W * t)  # pyright: ignore
    machine = Machine("drive", Drive, END, u={"force": push})
    motion = ReferenceMotion(("x",), FINE, exact(FINE)[None, :], np.array([size]))
    model = Drive(Viscous(sigma_2=C), m=1.0, N=1.0).model()
    found, why = largest(machine, model, "backward_euler", motion, share)
    assert why == ""
    assert found == pytest.approx(step)
