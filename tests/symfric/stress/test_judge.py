"""A judge is worth what he finds: wrong runs, built here, must not pass."""

from dataclasses import replace

import numpy as np
import pytest

from symfric.foundation.status import SolveError, Status
from symfric.stress.cases import Case, Signal
from symfric.stress.judge import by_methods, judge
from symfric.stress.problem import (
    RIGHT,
    Problem,
    amplification,
    apart,
    at_steps,
    distance,
    of,
    problem,
    question,
    tolerances,
    worst_step,
)

EASY = Case(1, 1, "rabinowicz", "brown_mcphee", t_end=2.0)
"""A block that the belt takes along and loses."""


def test_a_run_as_good_as_its_reference_is_right() -> None:
    verdict = judge(EASY)
    assert verdict.kind == "right"
    assert verdict.error is not None
    assert verdict.error < 1.0


def test_what_is_refused_is_reported_with_its_reason() -> None:
    bad = replace(EASY, values={"mu_d": 0.5, "mu_s": 0.2})
    assert (judge(bad).kind, judge(bad).group) == ("refused", "input")
    assert "expected mu_d <= mu_s" in judge(bad).reason
    stuck = Case(1, 1, "four_mass", "lugre", t_end=1.0)
    assert judge(stuck).kind == "refused"
    assert judge(stuck).group.startswith("STEP_TOO_SMALL")


class Wrong:
    """`simulate` as it would be with a defect: `harm` is done to the case's own run."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, harm: str) -> None:
        self.right, self.harm = Problem.run, harm
        monkeypatch.setattr(Problem, "run", lambda *args, **known: self.run(*args, **known))

    def run(self, ready: Problem, rtol: float, method: str, **known: object) -> object:
        if rtol != EASY.rtol:
            return self.right(ready, rtol, method, **known)
        if self.harm == "fails":
            raise SolveError("casadi::Assertion failed", Status.SINGULAR)
        coarse = self.right(ready, 1e-2, "rodas3", **known)
        if self.harm == "nan":
            evaluate = coarse.evaluate
            coarse = replace(
                coarse, evaluate=lambda t: evaluate(t) | {"friction": np.full(np.shape(t), np.nan)}
            )
        return coarse


@pytest.mark.parametrize(
    ("harm", "kind"), [("coarse", "silent"), ("nan", "nan"), ("fails", "crash")]
)
def test_a_defect_is_found(monkeypatch: pytest.MonkeyPatch, harm: str, kind: str) -> None:
    Wrong(monkeypatch, harm)
    assert judge(EASY).kind == kind


def test_a_foreign_exception_comes_through(monkeypatch: pytest.MonkeyPatch) -> None:
    def foreign(*_: object) -> Problem:
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr("symfric.stress.judge.problem", foreign)
    with pytest.raises(ZeroDivisionError):
        judge(EASY)


def test_distance_counts_tolerances() -> None:
    ready = problem(EASY)
    run = ready.run(1e-6, "rodas5p", max_steps=10_000)
    assert distance(ready, run, of(run)) == 0.0
    shifted = replace(run, states=lambda t: {n: y + 2e-6 for n, y in run.states(t).items()})
    table = np.stack([run["x"], run["v"]])
    assert distance(ready, shifted, of(run)) == pytest.approx(2e-6 / tolerances(ready, table).min())


def test_a_model_with_events_may_be_early_or_late_by_its_tolerance() -> None:
    ready = problem(replace(EASY, law="exact_coulomb"))
    late = EASY.rtol * EASY.t_end

    def truth(times: np.ndarray) -> np.ndarray:
        return np.tile(times, (len(ready.model.x), 1))

    for shift, fits in ((-late, True), (late, True), (-3 * late, False), (3 * late, False)):
        y = truth(ready.times + shift)
        assert (apart(ready, y, truth)[:, 1:-1].max() < 1e-6) == fits


def test_what_a_problem_makes_of_a_tolerance_is_measured() -> None:
    """Near its top a pendulum falls as d phi'' = w^2 d phi, w^2 = m g L / (J + m L^2)."""
    fall = Case(1, 1, "pendulum", "viscous", {"sigma_2": 0.0}, x0={"phi": np.pi - 1e-3}, t_end=1.0)
    ready, w = problem(fall), np.sqrt(9.81 * 0.5 / (1 / 12 + 0.25))
    run = ready.run(1e-9, "radau5", max_steps=ready.attempts)
    angle, rate = tolerances(ready, np.stack([run["phi"], run["phi_rate"]]))[:, 0]
    grown = angle * w * np.sinh(w) + rate * np.cosh(w)
    assert amplification(ready, of(run)(ready.times), ready.attempts) == pytest.approx(
        grown / rate, rel=0.01
    )


def test_the_referee_sees_what_all_methods_share(monkeypatch: pytest.MonkeyPatch) -> None:
    """A spring of another stiffness in symfric's model, as a term written wrongly would be."""
    long = replace(EASY, t_end=9.0)
    stiffer = problem(replace(long, values={"k": 2.11})).model
    wrong = replace(problem(long), model=stiffer)
    monkeypatch.setattr("symfric.stress.judge.problem", lambda *_: wrong)
    verdict = judge(long)
    assert (verdict.kind, verdict.by) == ("silent", "referee")
    run = wrong.run(long.rtol, long.method, max_steps=wrong.attempts)
    assert by_methods(wrong, run).kind == "right"


def test_what_the_referee_does_not_know_is_judged_by_methods() -> None:
    case = Case(1, 1, "rabinowicz", "viscous", t_end=2.0)
    assert question(problem(case), problem(case).times) is None
    assert (judge(case).kind, judge(case).by) == ("right", "methods")
    assert judge(EASY).by == "referee"


def test_a_run_whose_steps_are_used_up_is_refused_and_its_beginning_compared() -> None:
    short = judge(EASY, work=80)
    assert (short.kind, short.group) == ("refused", "too many steps, right so far")
    assert "is right" in short.reason


def test_a_loose_run_has_a_measured_reason() -> None:
    """An undamped bristle keeps what each step adds to its swing."""
    force = {"force": Signal("constant", (0.0997,))}
    case = Case(
        1, 23, "drive", "dahl", {"v_eps": 0.0}, inputs=force, t_end=0.872, rtol=1e-3,
        method="dopri5",
    )  # fmt: skip
    verdict = judge(case)
    assert verdict.kind == "loose"
    assert verdict.group == "the problem amplifies tolerances"
    assert "the problem amplifies one to" in verdict.reason


def test_errors_between_correct_ends_of_steps_are_reported_separately() -> None:
    """As where an implicit step goes over a fast transient, and its polynomial another way."""
    ready = problem(EASY)
    run = ready.run(1e-6, "rodas5p", max_steps=10_000)

    def bent(t: np.ndarray) -> dict[str, np.ndarray]:
        ends = np.isin(t, run.step_times)
        return {name: y + np.where(ends, 0.0, 1e-3) for name, y in run.states(t).items()}

    assert distance(ready, replace(run, states=bent), of(run)) > 100
    assert at_steps(ready, replace(run, states=bent), of(run)) == 0.0
    assert at_steps(ready, replace(run, states=lambda t: bent(t - 1e-9)), of(run)) > 100


def test_a_step_that_leaps_is_found_and_steps_that_add_up_are_not_blamed() -> None:
    ready = problem(EASY)
    fine = ready.run(1e-8, "radau5", max_steps=10_000)
    run = ready.run(1e-6, "rodas5p", max_steps=10_000)
    sizes = tolerances(ready, np.stack([fine["x"], fine["v"]]))
    assert worst_step(ready, run, sizes, 10_000) <= RIGHT
    late = run.step_times[run.step_times.size // 2]

    def shifted(t: np.ndarray) -> dict[str, np.ndarray]:
        return {name: y + np.where(t > late, 1e-4, 0.0) for name, y in run.states(t).items()}

    found = worst_step(ready, replace(run, states=shifted), sizes, 10_000)
    assert found == pytest.approx(1e-4 / sizes.min(), rel=0.1)
