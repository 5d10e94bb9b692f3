"""A campaign draws the same cases everywhere, counts, and survives interrupts and crashes.

A judge is worth what he finds: wrong runs, built here, must not pass.
"""

import json
import os
import re
import signal as signals
import time
from collections.abc import Callable
from dataclasses import replace
from multiprocessing.context import BaseContext
from pathlib import Path

import numpy as np
import pytest

from symfric.foundation import workers
from symfric.foundation.status import SolveError, Status
from symfric.foundation.workers import Crashed, TimedOut
from symfric.stress import Case, Signal, draw
from symfric.stress.campaign import Report, campaign, rerun
from symfric.stress.cases import Draws
from symfric.stress.judge import CLASSES, FAILING, Judgement, by_methods, judge
from symfric.stress.problem import RIGHT, CaseProblem, of, problem, signal

COSTLY = ("arm", "four_bar", "double_pendulum")
"""Scenes of which the suite takes no case."""


def test_a_few_random_cases_are_right() -> None:
    numbers = [n for n in range(24, 31) if draw(1, n).scene not in COSTLY]
    report = campaign(numbers, work=12_000)
    assert not {n: v.reason for n, v in report.verdicts.items() if v.kind in FAILING}
    assert report.passed
    assert report.classes["right"] > 0.6 * len(numbers)
    assert report.refereed > 0.2 * len(numbers)
    assert len(report.verdicts) == report.asked == len(numbers)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [20261, 20262, 20263, 20264])
def test_of_500_random_cases_none_is_silently_wrong_and_few_are_undecided(seed: int) -> None:
    report = campaign(500, seed)
    assert not {n: v.reason for n, v in report.verdicts.items() if v.kind in FAILING}
    assert report.classes["undecided"] < 5
    assert report.classes["right"] > 350
    assert report.refereed > 200


def test_workers_do_not_change_verdicts_and_an_interrupt_keeps_them() -> None:
    def interrupt(report: Report) -> None:
        if len(report.verdicts) == 2:
            raise KeyboardInterrupt

    report = campaign(50, seed=7, workers=2, progress=interrupt)
    assert len(report.verdicts) == 2 and report.asked == 50
    assert all(verdict == judge(draw(7, n)) for n, verdict in report.verdicts.items())


def test_numbers_of_a_campaign_are_positive() -> None:
    for cases, number, limit in ((0, 1, 1.0), (5, 0, 1.0), (5, 1, -1.0)):
        with pytest.raises(ValueError, match=r"stress: expected [a-z]+ > 0"):
            campaign(cases, workers=number, limit=limit)


def test_a_case_runs_again_in_its_own_process() -> None:
    assert rerun(Case(1, 1, "drive", "dahl", {"mu": 1.0})).kind == "refused"
    assert rerun(draw(3, 1), limit=0.01).kind == "hang"


def test_a_report_counts_classes_and_keeps_failing_cases(tmp_path: Path) -> None:
    verdicts = {
        0: Judgement("right", "", "", 0.5, by="referee"),
        1: Judgement("silent", "1e6 tolerances off", "", 1e6),
        2: Judgement("refused", "no", "input"),
        3: Judgement("loose", "20 tolerances off", "", 20.0),
    }
    report = Report(7, 5, verdicts, 12.04)
    data = json.loads(json.dumps(report.to_dict(), allow_nan=False))
    counts = {"right": 1, "silent": 1, "refused": 1, "loose": 1}
    assert data["classes"] == dict.fromkeys(CLASSES, 0) | counts
    assert data["groups"] == {name: {} for name in CLASSES} | {"refused": {"input": 1}}
    expected = {"seed": 7, "cases": 4, "asked": 5, "seconds": 12.0, "refereed": 1}
    assert {name: data[name] for name in expected} == expected
    errors = data["errors_in_tolerances"]
    assert errors == {"median": 10.25, "99 %": pytest.approx(19.805), "greatest": 20.0}
    assert [n["case"]["number"] for n in data["notable"]] == [1, 3]
    assert not report.passed
    (path,) = report.save(tmp_path / "new")
    assert path.name == "silent_7_1.json"
    assert Case.read(path) == draw(7, 1)


# ---- cases ----


def test_draws_are_the_same_everywhere() -> None:
    rng = Draws(1, 2)
    drawn = rng.unit(), rng.decade(-2, 2), rng.pick("abc"), rng.between(2, 3), rng.signed(0, 1)
    assert drawn == (0.08841827389941048, 19.5, "b", 2.43, -3.3)
    assert draw(1, 85) == draw(1, 85) != draw(2, 85)
    drawn = {"scene": "drive", "law": "elasto_plastic", "method": "rodas3", "rtol": 1e-4}
    assert {name: getattr(draw(1, 3), name) for name in drawn} == drawn


def test_cases_differ_in_everything_that_is_drawn() -> None:
    cases = [draw(1, n) for n in range(150)]
    for name, least in (("scene", 10), ("law", 45), ("method", 6), ("rtol", 7), ("t_end", 100)):
        assert len({getattr(case, name) for case in cases}) >= least, name
    kinds = {s.kind for case in cases for s in case.inputs.values()}
    assert kinds == {"constant", "hold", "linear", "sine", "pulse"}
    for name in ("values", "forms", "free", "x0"):
        assert any(getattr(case, name) for case in cases), name


def test_a_file_restores_its_case(tmp_path: Path) -> None:
    path = tmp_path / "case.json"
    for n in range(40):
        draw(3, n).write(path)
        assert Case.read(path) == draw(3, n)
    path.write_text(json.dumps({"case": draw(3, 4).to_dict(), "verdict": {"kind": "silent"}}))
    assert Case.read(path) == draw(3, 4)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "expected JSON of a case"),
        ("[1]", "expected JSON of a case, got something else"),
        ('{"seed": 1}', "case '.*case.json': .* others: Case: expected number, got none"),
        ('{"case": [1]}', "case '.*case.json': expected what `symfric stress` wrote"),
        ('{"seed": 1, "number": 2, "scene": "a", "law": "b", "x": 1}', "its fields, got x"),
        ('{"seed": 1, "number": 2, "scene": "a", "law": "b", "inputs": {"c": 1}}', "stress` wrote"),
        (
            '{"seed": "1", "number": 2, "scene": "a", "law": "b"}',
            "others: Case.seed: expected .*int.*, got '1'",
        ),
    ],
)
def test_a_file_of_something_else_is_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "case.json").write_text(text)
    with pytest.raises(ValueError, match=message):
        Case.read(tmp_path / "case.json")


def test_parameters_given_at_run_time_are_not_in_the_equations() -> None:
    ready = problem(Case(1, 0, "rabinowicz", "stribeck", {"mu_s": 0.2, "m": 2.0}, free=("mu_s",)))
    assert [v.name for v in ready.model.p] == ["mu_s"]
    assert ready.p == {"mu_s": 0.2}


def test_an_unknown_signal_is_refused() -> None:
    with pytest.raises(ValueError, match="expected a signal constant, hold"):
        signal(Signal("noise", (1.0, 2.0, 3.0)))


# ---- processes of tasks ----


def outcomes(work: Callable[..., object], tasks: list[object], limit: float = 60.0) -> object:
    return dict(workers.outcomes(work, enumerate(tasks), 2, limit))


def test_only_a_fork_server_imports_the_module_of_the_work(monkeypatch: pytest.MonkeyPatch) -> None:
    imported: list[list[str]] = []
    monkeypatch.setattr(
        BaseContext, "set_forkserver_preload", lambda _, names: imported.append(names)
    )
    for start, expected in (("fork", []), ("forkserver", [["__main__", "builtins"]])):
        assert dict(workers.outcomes(abs, [(0, -1)], 1, start=start)) == {0: 1}
        assert imported == expected


def test_results_exceptions_exits_and_signals_are_distinguished() -> None:
    error = Crashed("exit status 1", "TypeError: bad operand type for abs(): 'str'")
    assert outcomes(abs, [-1, "text", -3]) == {0: 1, 1: error, 2: 3}
    assert outcomes(os._exit, [3]) == {0: Crashed("exit status 3", "no output")}
    killed = outcomes(signals.raise_signal, [signals.SIGSEGV])
    assert re.search(r"how='SIGSEGV'", str(killed))


def test_an_endless_loop_in_compiled_code_is_stopped_by_its_processor_time() -> None:
    assert outcomes(sum, [range(10**12), (1, 2)], limit=0.5) == {0: TimedOut(0.5), 1: 3}


def test_only_wall_time_far_above_the_limit_stops_a_waiting_task(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert outcomes(time.sleep, [0.5], limit=0.1) == {0: None}
    monkeypatch.setattr(workers, "WALL", 1)
    assert outcomes(time.sleep, [1000.0, 0.0, 0.0], limit=4.0) == {
        0: TimedOut(4.0),
        1: None,
        2: None,
    }


EASY = Case(1, 1, "rabinowicz", "brown_mcphee", t_end=2.0)
"""A block that the belt takes along and loses."""


def test_a_run_as_good_as_its_reference_is_right() -> None:
    verdict = judge(EASY)
    assert verdict.kind == "right"
    assert verdict.error is not None
    assert verdict.error < 1.0


def test_what_is_refused_is_reported_with_its_reason() -> None:
    bad = judge(replace(EASY, values={"mu_d": 0.5, "mu_s": 0.2}))
    assert (bad.kind, bad.group) == ("refused", "input")
    assert "expected mu_d <= mu_s" in bad.reason
    stuck = judge(Case(1, 1, "four_mass", "lugre", t_end=1.0))
    assert stuck.kind == "refused"
    assert stuck.group.startswith("STEP_TOO_SMALL")


class Wrong:
    """`simulate` as it would be with a defect: `harm` is done to the case's own run."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, harm: str) -> None:
        self.right, self.harm = CaseProblem.run, harm
        monkeypatch.setattr(CaseProblem, "run", lambda *args, **known: self.run(*args, **known))

    def run(self, ready: CaseProblem, rtol: float, method: str, **known: object) -> object:
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
    def foreign(*_: object) -> CaseProblem:
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr("symfric.stress.judge.problem", foreign)
    with pytest.raises(ZeroDivisionError):
        judge(EASY)


def test_distance_counts_tolerances() -> None:
    ready = problem(EASY)
    run = ready.run(1e-6, "rodas5p", max_steps=10_000)
    assert ready.distance(run, of(run)) == 0.0
    shifted = replace(run, states=lambda t: {n: y + 2e-6 for n, y in run.states(t).items()})
    table = np.stack([run["x"], run["v"]])
    assert ready.distance(shifted, of(run)) == pytest.approx(2e-6 / ready.tolerances(table).min())


def test_a_model_with_events_may_be_early_or_late_by_its_tolerance() -> None:
    ready = problem(replace(EASY, law="exact_coulomb"))
    late = EASY.rtol * EASY.t_end

    def truth(times: np.ndarray) -> np.ndarray:
        return np.tile(times, (len(ready.model.x), 1))

    for shift, fits in ((-late, True), (late, True), (-3 * late, False), (3 * late, False)):
        y = truth(ready.times + shift)
        assert (ready.apart(y, truth)[:, 1:-1].max() < 1e-6) == fits


def test_what_a_problem_makes_of_a_tolerance_is_measured() -> None:
    """Near its top a pendulum falls as d phi'' = w^2 d phi, w^2 = m g L / (J + m L^2)."""
    fall = Case(1, 1, "pendulum", "viscous", {"sigma_2": 0.0}, x0={"phi": np.pi - 1e-3}, t_end=1.0)
    ready, w = problem(fall), np.sqrt(9.81 * 0.5 / (1 / 12 + 0.25))
    run = ready.run(1e-9, "radau5", max_steps=ready.attempts)
    angle, rate = ready.tolerances(np.stack([run["phi"], run["phi_rate"]]))[:, 0]
    grown = angle * w * np.sinh(w) + rate * np.cosh(w)
    assert ready.amplification(of(run)(ready.times), ready.attempts) == pytest.approx(
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
    assert problem(case).question() is None
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

    assert ready.distance(replace(run, states=bent), of(run)) > 100
    assert ready.at_steps(replace(run, states=bent), of(run)) == 0.0
    assert ready.at_steps(replace(run, states=lambda t: bent(t - 1e-9)), of(run)) > 100


def test_a_step_that_leaps_is_found_and_steps_that_add_up_are_not_blamed() -> None:
    ready = problem(EASY)
    fine = ready.run(1e-8, "radau5", max_steps=10_000)
    run = ready.run(1e-6, "rodas5p", max_steps=10_000)
    sizes = ready.tolerances(np.stack([fine["x"], fine["v"]]))
    assert ready.worst_step(run, sizes, 10_000) <= RIGHT
    late = run.step_times[run.step_times.size // 2]

    def shifted(t: np.ndarray) -> dict[str, np.ndarray]:
        return {name: y + np.where(t > late, 1e-4, 0.0) for name, y in run.states(t).items()}

    found = ready.worst_step(replace(run, states=shifted), sizes, 10_000)
    assert found == pytest.approx(1e-4 / sizes.min(), rel=0.1)
