"""Contenders solve the same problem; ratios compare them at equal error."""

import sys

import numpy as np
import pytest
from backends import needs_compiler
from fake_cupy import FakeCupy

from symfric import BrownMcPhee, Model, simulate
from symfric.bench import calls, ensemble, integrator, multibody
from symfric.bench.contenders import MECHANISMS, by_hand, casadi, scipy
from symfric.bench.integrator import ERRORS, RUNS
from symfric.bench.multibody import CASES
from symfric.bench.report import RATIOS, Report, Row, ratios, time_at
from symfric.scenes import Rabinowicz

WHAT = CASES["slider_crank"]


@pytest.fixture(scope="module")
def model() -> Model:
    return WHAT.scene.model()


@pytest.fixture(scope="module")
def exact(model: Model) -> np.ndarray:
    return simulate(model, WHAT.t_end, rtol=1e-10, t_eval=WHAT.times)["slider"]


@needs_compiler
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(n, marks=pytest.mark.slow) if "rosenbrock" in n else n
        for n in MECHANISMS
        if MECHANISMS[n][0] == "joint"
    ],
)
def test_every_solver_finds_the_slider(name: str, model: Model, exact: np.ndarray) -> None:
    contender = MECHANISMS[name][1](model, WHAT.times, ("slider",), 1e-5)
    found, count = contender.solve()
    assert found.shape == (1, 25)
    assert np.abs(found[0] - exact).max() < 1e-4
    assert count() > 50
    assert (contender.compile_s > 0) == ("rosenbrock" in name)


def test_solvers_without_a_compiler_find_the_block() -> None:
    model, times = Rabinowicz(BrownMcPhee()).model(), np.linspace(0.0, 3.0, 7)[1:]
    exact = simulate(model, 3.0, x0={"v": 0.03}, rtol=1e-10, t_eval=times)
    for contender in (
        casadi(model, times, ("v", "x"), 1e-7, "cvodes", as_c=False),
        scipy(model, times, ("v", "x"), 1e-7, "Radau"),
    ):
        found, count = contender.solve(v=0.03)
        assert np.abs(found - [exact["v"], exact["x"]]).max() < 1e-5
        assert count() > 20


@needs_compiler
def test_radau5_by_hand_has_order_five() -> None:
    model, times = Rabinowicz(BrownMcPhee()).model(), np.linspace(0.0, 20.0, 41)[1:]
    exact = simulate(model, 20.0, x0={"v": 0.03}, rtol=1e-11, t_eval=times)["x"]
    errors, steps = [], []
    for rtol in (1e-4, 1e-6, 1e-8):
        (x,), count = by_hand(model, times, ("x",), rtol).solve(v=0.03)
        errors.append(np.abs(x - exact).max() / np.abs(exact).max())
        steps.append(count())
    assert errors[0] < 1e-3
    assert errors[2] < 1e-7
    assert steps[0] < steps[1] < steps[2] < steps[0] * 1e4**0.25


def run(name: str, error: float, time_ms: float) -> Row:
    return {
        "case": "case", "integrator": name, "relative error": error, "time per run [ms]": time_ms
    }  # fmt: skip


def test_time_at_an_error_is_interpolated_in_logarithms() -> None:
    """Order 4: ten thousand times the accuracy for ten times the time."""
    rows = [run("a", 1e-8, 1.0), run("a", 1e-4, 0.1)]
    slower = [*rows, run("a", 1e-6, 5.0), run("a", 0.0, 1e-3)]
    assert time_at(rows, 1e-6) == time_at(slower, 1e-6) == pytest.approx(0.1**0.5)
    assert time_at(rows, 1e-8) == pytest.approx(1.0)
    assert time_at(rows[1:], 1e-6) != time_at(rows[1:], 1e-6)
    assert time_at(rows[1:], 1e-3) == 0.1


def test_ratios_are_over_the_reference() -> None:
    rows = [run("ours", 1e-8, 0.5), run("one", 1e-8, 2.0), run("two", 1e-4, 1.0)]
    found = [row for title, row in ratios(rows, "ours", ERRORS) if title == RATIOS]
    assert len(found) == 3 * 2 + 1
    assert [r["ratio to ours"] for r in found if r["integrator"] == "one"] == [4.0] * 3
    assert not [*ratios(rows, "absent", ERRORS)]


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs of 2 s, at two tolerances."""
    monkeypatch.setattr(integrator, "T_END", 2.0)
    monkeypatch.setattr(integrator, "TIMES", np.linspace(0.0, 2.0, 21)[1:])
    monkeypatch.setattr(integrator, "TOLERANCES", (1e-4, 1e-7))
    monkeypatch.setattr(integrator, "CASES", {"belt": BrownMcPhee()})
    monkeypatch.setattr(integrator, "FREE", ("mu_s", "k"))


@pytest.mark.slow
@needs_compiler
def test_integrators_and_derivatives_are_measured(short: None) -> None:
    made = integrator.bench(quick=True)
    names = dict.fromkeys(row["integrator"] for row in made.tables[RUNS])
    assert {"symfric compiled", "symfric vm", "casadi cvodes", "C by hand"} <= names.keys()
    for name in names:
        coarse, fine = (r for r in made.tables[RUNS] if r["integrator"] == name)
        assert coarse["relative error"] > 10 * fine["relative error"] > 0, name
        assert fine["relative error"] < 1e-4, name
        assert coarse["steps"] < fine["steps"], name
        assert all(0.001 < row["time per run [ms]"] < 1000 for row in (coarse, fine)), name
    (first,) = made.tables[integrator.FIRST]
    assert all(0 <= v < 60 for c, v in first.items() if c != "case")
    slopes = made.tables[integrator.SLOPES]
    assert [row["parameters"] for row in slopes] == [1, 1, 2, 2]
    for row in slopes:
        assert row["relative error"] < 1e-3
        assert 1 < row["ratio, forward"] < 100
        assert 1 < row["ratio, adjoint"] < 100
        assert 0.001 < row["time per run [ms]"] < 100


@needs_compiler
def test_members_in_lanes_are_those_of_single_runs() -> None:
    case = ensemble.CASES[0]._replace(t_end=2.0)
    ((title, row),) = ensemble._lanes(case, 20)
    assert (title, row["members"], row["lanes"] in (4, 8, 16)) == (ensemble.LANES, 20, True)
    alone, together = row["one by one [us]"], row["time per member [us]"]
    assert row["ratio to the ensemble"] == pytest.approx(alone / together)
    assert 1 < together < 1e4
    assert 0.01 < row["repeated call, one member [ms]"] < 100
    assert 10 < row["attempts per member"] < 1000
    assert 0 <= row["members with equal attempts [%]"] <= 100
    assert row["relative difference at the end"] < 1e-5


def test_without_a_graphics_processor_a_note_reports_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cupy", None)
    (note,) = ensemble.cuda()
    assert str(note).startswith("Graphics processor: not run, simulate_many: backend='cuda' needs")


@pytest.mark.slow
def test_members_on_a_device_are_compared_with_those_on_cores(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "cupy", FakeCupy())
    monkeypatch.setattr(ensemble, "ON_DEVICE", 3000)
    monkeypatch.setattr(ensemble, "SAMPLE", 8)
    (double, single) = (row for _, row in ensemble.cuda(quick=True))
    assert (double["type"], single["type"]) == ("double", "float")
    for row in (double, single):
        assert row["members"] == 30
        ratio = row["members per second"] / row["members per second, all cores"]
        assert row["ratio to all cores"] == pytest.approx(ratio)
    off = "relative difference at the end"
    assert double[off] < 1e-5
    assert double[off] < single[off] < 1e-3


@pytest.mark.slow
def test_short_calls_are_measured_and_right() -> None:
    tasks: dict[str, list[Row]] = {}
    for row in calls.bench(quick=True).tables[calls.TITLE]:
        tasks.setdefault(str(row["task"]), []).append(row)
    assert len(tasks) == 6
    for rows in tasks.values():
        assert rows[0]["ratio to the first"] == 1.0
        assert all(0.1 < row["time [us]"] < 1e7 for row in rows)
        assert all(row["relative error"] < 1e-2 for row in rows if row["relative error"] >= 0)


def test_a_solver_that_fails_is_noted() -> None:
    def fails() -> None:
        raise RuntimeError("first\nlast line: too stiff")

    found = multibody._run("slider_crank", "x", 1e-3, fails)  # type: ignore[arg-type]
    assert found == "slider_crank: x at 0.001: not run, too stiff"
    assert isinstance(Report().collect({"a": lambda: [found]}).notes[0], str)
