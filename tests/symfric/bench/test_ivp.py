"""Problems of others end where they were published to end; the bench says what it measured."""

import json
from math import isfinite
from pathlib import Path

import pytest

from symfric import Model, Variable
from symfric.bench import bench_ivp
from symfric.bench.ivp import IvpBenchmark, IvpRow, correct_digits, measure
from symfric.bench.ivp_mechanisms import ANDREWS, JOINT, PROBLEMS
from symfric.bench.ivp_problems import Problem, hires
from symfric.cli import main
from symfric.integrator.simulate import simulate

CHEAP = tuple(p for p in PROBLEMS if p is not JOINT and p.name != "ring modulator")
"""The squeezer of joints is measured among mechanisms, in `multibody/test_iftomm.py`."""
LATE = {("ring modulator", "rodas5p"): 4}
"""What reaches fewer digits than wanted at rtol 1e-6: fast oscillations add up their phases."""
MOST_STEPS = {
    "HIRES": 250, "Robertson": 350, "van der Pol": 800, "Oregonator": 1100,
    "Chemical Akzo Nobel": 130, "transistor amplifier": 4500, "Pleiades": 330,
    "Andrews' squeezer": 400, "car axis": 1100,
}  # fmt: skip


def reached(problem: Problem, method: str, rtol: float, backend: str | None = None) -> IvpRow:
    """A measurement that meets what is wanted of it."""
    row = measure(problem, problem.model(), method, rtol, backend)
    assert row.message == ""
    wanted = row.wanted if rtol < 1e-6 else LATE.get((row.problem, method), row.wanted)
    assert row.scd >= wanted > 0, row
    return row


def test_published_digits_are_reached_at_the_default_tolerance() -> None:
    """Andrews' squeezer was called singular, the amplifier discontinuous."""
    for problem in CHEAP:
        row = reached(problem, "rodas5p", 1e-6, "vm")
        assert row.steps <= MOST_STEPS[problem.name], row


def test_published_digits_are_reached_at_a_tight_tolerance_where_that_is_cheap() -> None:
    """Robertson's reactions to 1e11 stopped at rtol <= 1e-8."""
    for name in ("HIRES", "Robertson", "Chemical Akzo Nobel", "Andrews' squeezer"):
        row = reached(next(p for p in PROBLEMS if p.name == name), "rodas5p", 1e-10, "vm")
        assert row.drift < 1e-11


@pytest.mark.slow
def test_published_digits_are_reached_by_all_methods_at_all_tolerances() -> None:
    for problem in PROBLEMS:
        for method in ("rodas5p", "radau5"):
            for rtol in (1e-6,) if method in problem.laborious else (1e-6, 1e-10):
                reached(problem, method, rtol)


def test_drift_of_constraints_shrinks_with_the_tolerance() -> None:
    model = ANDREWS.model()
    loose, tight = (measure(ANDREWS, model, "rodas5p", r, "vm") for r in (1e-6, 1e-8))
    assert 0.0 < tight.drift < 1e-2 * loose.drift < 1e-7


def test_digits_are_those_of_the_worst_signal() -> None:
    run = simulate(hires(), 1.0, backend="vm", samples=2)
    end = run.final
    other = Problem("off", hires, 1.0, {"y1": end["y1"], "y2": end["y2"] * (1 + 1e-4)})
    digits, worst = correct_digits(other, run)
    assert (round(digits, 3), worst) == (4.0, "y2")
    assert correct_digits(Problem("same", hires, 1.0, {"y1": end["y1"]}), run)[0] < 16


def test_failure_is_a_row_that_says_why() -> None:
    y = Variable("y1", "1", start=1.0)
    model = Model("grow", x=(y,), ode=y.symbol**2)
    problem = Problem("late", lambda: model, 1e3, {"y1": 1.0})
    row = measure(problem, model, "rodas5p", 1e-6, "vm")
    assert "grows without bound" in row.message
    assert not isfinite(row.scd)
    assert IvpBenchmark((row,)).to_dict()["rows"][0]["scd"] is None


def test_every_problem_names_its_source_and_wants_digits() -> None:
    assert len({p.name for p in PROBLEMS}) == len(PROBLEMS) == 11
    for problem in PROBLEMS:
        assert "Test Set" in problem.source
        assert set(problem.digits) == {1e-6, 1e-10}
        assert set(problem.reference) <= set(problem.model().signals)


def test_command_prints_and_writes_what_it_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("symfric.bench.bench_ivp", lambda **options: bench_ivp(
        problems=PROBLEMS[:1], **options))  # fmt: skip
    report, picture = tmp_path / "ivp.json", tmp_path / "ivp.svg"
    arguments = ["bench", "ivp", "--quick", "--json", str(report), "--plot", str(picture)]
    assert main(arguments) == 0
    assert picture.stat().st_size > 0
    rows = json.loads(report.read_text(encoding="utf-8"))["rows"]
    assert [(r["problem"], r["method"], r["rtol"]) for r in rows] == [
        ("HIRES", "rodas5p", 1e-6), ("HIRES", "radau5", 1e-6),
    ]  # fmt: skip
    assert all(r["scd"] >= r["wanted"] == 5 for r in rows)
    said = capsys.readouterr().out
    assert "HIRES" in said
    assert "digits" in said
