"""Optimal control, other tools, identification and generated code: judges know known answers."""

from collections import Counter
from dataclasses import replace
from itertools import islice
from math import isnan, nan
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from cortex import on_target

from identification import Dataset, synthetic_drive_data
from ocp import solve
from ocp.problems import READY, out_and_back
from symfric import Coulomb, Sum, Viscous, drive, law_from_text, with_values
from symfric.bench import codegen, embedded, identification, identification_verdicts, starts
from symfric.bench import identification_measured as measured
from symfric.bench.codegen import PROVEN, plants, trials
from symfric.bench.identification import files, outcome
from symfric.bench.identification_files import campaign
from symfric.bench.identification_online import Axis, judged
from symfric.bench.identification_records import ar
from symfric.bench.identification_simulated import far, ranked
from symfric.bench.interop import GOAL, ROUTES, STEPS, N, T, missed, move
from symfric.bench.ocp import controllers
from symfric.bench.report import GOALS, Row
from symfric.codegen import law_block
from symfric.embedded import Absent
from symfric.integrator import Hold, flow, simulate
from symfric.laws import BrownMcPhee, Dahl

# ---- optimal control ----


def test_random_starts_are_the_default_and_others() -> None:
    first, second = list(starts.starts_of(out_and_back(), 2, starts.NEAR))
    assert first.keys() == {"x", "v", "force"}
    assert first["x"][[0, 100, -1]] == pytest.approx([0.0, 1.0, 0.0], abs=0.02)
    assert np.abs(second["x"] - first["x"]).max() > 0.01


def test_shares_count_verified_motions_only() -> None:
    """A motion of half the cost that the referee finds to miss is not the best."""
    found = solve(out_and_back(v_t=0.1), friction="smooth", intervals=10, throw=False)
    assert found.verified
    ready = replace(READY["out_and_back"], make=READY["pendulum"].make, optimum=found.cost)
    runs = [(1.0, found), (3.0, replace(found, cost=0.5 * found.cost)), (9.0, found)]
    _, row = starts.row_of(ready, "near", runs)
    assert (row["case"], row["starts"], row["processor time [s]"]) == ("pendulum", "3 near", 3.0)
    assert row["reported as solved [%]"] == pytest.approx(100.0)
    assert row["verified [%]"] == row["best cost reached [%]"] == 0.0
    assert row["relative miss"] > 0.1
    free = replace(READY["brachistochrone"], optimum=found.cost)
    _, row = starts.row_of(free, "near", runs)
    assert row["verified [%]"] == row["best cost reached [%]"] == pytest.approx(100.0)
    assert row["cost above the best [%]"] == 0.0


@pytest.mark.slow
def test_the_controller_reaches_its_goal_on_every_plant() -> None:
    for _, row in controllers(cycles=100):
        assert row["cycles"] == 100
        assert row["unreported failures"] == 0
        assert row["distance from the goal [mm]"] < 1.0, row


# ---- other tools ----

FREE = drive(Viscous(sigma_2=0.0), m=1.0, N=10.0)
"""A mass of 1 kg without friction."""


def test_the_miss_is_the_remaining_distance_and_speed() -> None:
    there_and_back = np.repeat([4 * GOAL, -4 * GOAL], N // 2)
    assert missed(FREE, there_and_back) < 1e-9
    assert missed(FREE, np.zeros(N)) == pytest.approx(GOAL)
    assert missed(FREE, np.full(N, 2 * GOAL)) == pytest.approx(2 * GOAL)  # there, at 0.2 m/s
    h, knock = T / N, np.eye(N)[0]  # a force in the first interval only: x = h (T - h/2) F
    force = knock * GOAL / (h * (T - h / 2))
    assert missed(FREE, force) == pytest.approx(GOAL / (T - h / 2))
    away = replace(FREE, x=tuple(replace(v, start=0.5) for v in FREE.x))
    assert missed(away, np.zeros(N)) == pytest.approx(GOAL)  # a move starts at rest at 0


def test_the_route_of_flow_ends_at_the_end_of_flow() -> None:
    """Collocation ends near it."""
    model = drive(BrownMcPhee(v_t=0.05), m=1.0, N=10.0)
    advance = flow(model, steps=STEPS)
    left = dict[str, float]()
    for route in ("flow", "collocation"):
        controls, status, _ = ROUTES["opti", route](model, np.array([GOAL / 2, GOAL]))
        assert status == "Solve_Succeeded"
        x = ca.DM.zeros(2)
        for u in controls.tolist():
            x = advance(x, u, [], T / N)
        left[route] = float(np.abs(x.full().ravel() - [GOAL, 0.0]).max())
    assert left["flow"] < 1e-8 < left["collocation"] < 1e-2


def test_a_tool_that_fails_has_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise RuntimeError("no  such\nthing")

    monkeypatch.setitem(ROUTES, ("opti", "flow"), fails)
    row = move("opti", "flow", "brown_mcphee")
    assert isnan(row["cost J [N^2 s]"]) and isnan(row["miss [m]"])
    assert (row["status"], row["iterations"]) == ("no such thing", 0)


# ---- identification ----


def goals(rows: object) -> dict[str, Row]:
    return {row["quantity"]: row for title, row in rows if title == GOALS}  # type: ignore[union-attr]


def test_without_data_the_rows_report_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("EMPS", "FRANKA"):
        monkeypatch.setattr(measured, name, tmp_path)
    chosen = {name: identification.CASES[name] for name in ("emps", "franka")}
    monkeypatch.setattr(identification, "CASES", chosen)
    made = identification.bench(quick=True)
    rows = made.tables[GOALS]
    assert Counter(row["case"] for row in rows) == {"emps": 3, "franka": 2}
    for row in rows:
        assert isnan(row["measured"]) and row["met"] == "no" and "absent" in row["note"]


def test_a_free_run_of_the_true_drive_leaves_the_noise() -> None:
    model = drive(Sum((Coulomb(20.0), Viscous(200.0))), m=95.0, N=1.0)
    t = np.arange(800) * 1e-3
    force = 60 * np.sin(8 * t)
    x = simulate(model, t[-1], u={"force": Hold(t, force)}, t_eval=t, rtol=1e-8)["x"]
    x = x + 1e-6 * np.random.default_rng(0).standard_normal(t.size)
    (record,) = Dataset.of(t=t, x=x, force=force, units={"x": "m", "force": "N"}, name="true")
    assert measured.free_run(model, record) < 5e-6
    wrong = drive(Sum((Coulomb(20.0), Viscous(250.0))), m=95.0, N=1.0)
    assert measured.free_run(wrong, record) > 1e-5


def test_coloured_noise_and_distant_starts() -> None:
    noise = ar(np.random.default_rng(1), 20_000, 0.9, 2.0)
    assert np.var(noise) == pytest.approx(4.0, rel=0.15)
    assert np.corrcoef(noise[1:], noise[:-1])[0, 1] == pytest.approx(0.9, abs=0.02)
    start = far({"m": 2.0, "k": 5.0}, 4.0, 0)
    assert all(0.25 < start[n] / x < 4 for n, x in (("m", 2.0), ("k", 5.0)))


def test_verdicts_and_coverage_are_counted_and_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    chosen = [s for s in identification_verdicts.SCENES if s.name.startswith("curve, c")]
    monkeypatch.setattr(identification_verdicts, "SCENES", chosen)
    monkeypatch.setattr(identification_verdicts, "SEEDS", 1)
    found = list(identification_verdicts.verdicts(quick=False))
    rows = [row for title, row in found if title == identification_verdicts.TITLE]
    assert [row["fits"] for row in rows] == [1.0]
    assert [row["met"] for title, row in found if title == GOALS] == ["yes"] * 3
    assert len(identification_verdicts.draw(rows).axes) == 2


def test_some_files_end_as_they_should() -> None:
    expected = {"MATLAB struct": "right", "MATLAB, cut off": "refused", "empty cell": "refused"}
    chosen = {f.name: f for f in islice(campaign(), 32) if f.name in expected}
    assert {name: outcome(file) for name, file in chosen.items()} == expected


@pytest.mark.slow
def test_no_damaged_file_is_fitted_without_a_warning() -> None:
    assert all(row["met"] == "yes" for row in goals(files()).values())


@pytest.mark.slow
def test_lugre_is_flagged_on_data_of_gms_and_ranked_below_it() -> None:
    found = ranked()
    assert [row.law for row in found.rows] == ["gms", "lugre"]
    assert found["lugre"].status == "DOUBTFUL"
    assert 3 * found["gms"].validation < found["lugre"].validation


@pytest.mark.slow
def test_a_law_with_two_directions_is_chosen_for_data_with_two() -> None:
    two = measured.DIRECTIONS[1]
    sides = {"mu_d_pos": 20.0, "mu_d_neg": 24.0, "sigma_2_pos": 160.0, "sigma_2_neg": 240.0}
    law = with_values(law_from_text(two), sides | {"v_eps_pos": 1e-3, "v_eps_neg": 1e-3})
    data = synthetic_drive_data(law, speeds=(0.01, 0.05, 0.1), dwell=0.3)
    assert measured.closed_loop(data).law == two


@pytest.mark.slow
@pytest.mark.skipif(not measured.EMPS.is_dir(), reason="needs EMPS in ../shared/data/EMPS")
def test_the_measured_drive_reaches_the_goals_of_the_closed_loop() -> None:
    rows = goals(measured.emps(quick=True))
    assert rows["closed loop x [%]"]["met"] == "yes"
    assert rows["closed loop force [%]"]["met"] == "yes"


# ---- generated code ----


@on_target
@pytest.mark.heavy
@pytest.mark.slow
def test_cores_are_measured_and_compared_with_the_c_of_casadi(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for module in (codegen, embedded):
        monkeypatch.setattr(module, "CASES", embedded.CASES[:1])
    (_, row), goal = codegen.cores(quick=False)
    own, guarded, casadi, best = (row[c] for c in row if "average" in c)
    assert own < best < casadi
    assert own < guarded
    assert goal[1]["met"] == "yes"
    monkeypatch.setattr(embedded, "CYCLES", 200)
    tables = embedded.bench(quick=True).tables  # all cores: tests/symfric/embedded
    rows = tables[embedded.TITLE]
    assert len(rows) == 1
    one, many = (row["most instructions"] for row in tables[embedded.CONTROLLERS][:2])
    assert 0 < one < many
    assert {(r["unit test"], r["status"]) for r in rows} == {("ok", "measured")}
    assert max(r["relative error"] for r in rows) < 1e-6


def test_an_axis_states_the_noise_of_its_encoder_and_estimates_are_judged() -> None:
    axis, random = Axis(4), np.random.default_rng(0)
    count, x = axis.drawn["count"], random.uniform(0.0, 1e-3, 20_000)
    jitter = axis.drawn["noise"] * random.standard_normal(x.size)
    read = count * np.round(x / count + jitter)
    assert np.std(read - x) == pytest.approx(axis.position_noise, rel=0.02)
    t = np.linspace(0.0, 1.0, 101)
    for deviation, share in ((0.04, 0.0), (0.06, 100.0)):
        found = judged(3.0 * (t - 0.03), np.full(t.size, deviation), 3.0 * t, 0.01)
        assert list(found.values()) == pytest.approx([0.03, -0.09, 0.09, share])


def test_absent_tools_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (codegen, embedded):
        monkeypatch.setattr(module, "find_tools", lambda: Absent(("qemu-system-arm",)))
        monkeypatch.setattr("symfric.foundation.programs.find_compiler", lambda: None)
    monkeypatch.setattr(codegen, "find_compiler", lambda: None)
    chosen = {name: codegen.SECTIONS[name] for name in ("cores", "fuzz", "fmu")}
    monkeypatch.setattr(codegen, "SECTIONS", chosen)
    made = codegen.bench(quick=True)
    assert not made.tables
    assert ["apt-get" in made.notes[0], *("no C compiler" in n for n in made.notes[1:])] == [
        True
    ] * 3
    assert "apt-get" in embedded.bench().notes[0]
    assert isnan(embedded.whole(nan)) and embedded.whole(2.7) == 3


@pytest.mark.slow
def test_fuzzing_has_a_row_for_every_type(
    monkeypatch: pytest.MonkeyPatch, compiler: object
) -> None:
    monkeypatch.setattr(codegen, "_blocks", lambda _: [(law_block(Dahl()), 2000)])
    monkeypatch.setattr(codegen, "SECTIONS", {"fuzz": codegen.fuzzing})
    made = codegen.bench(quick=True)
    rows = made.tables[codegen.FUZZ]
    assert [row["type"] for row in rows] == ["f64", "f32"]
    assert all(row["valid steps"] + row["repaired steps"] == 2000 for row in rows)
    assert [row["met"] for row in made.tables[GOALS]] == ["yes"]


@pytest.mark.slow
def test_compensators_meet_their_goals(monkeypatch: pytest.MonkeyPatch) -> None:
    (bristles, law), *_ = plants(quick=True).items()
    first = trials()[0]
    cases = {case: first.cases[case] for case in (PROVEN, "levels x 0.5")}
    monkeypatch.setattr(codegen, "plants", lambda quick: {bristles: law})
    monkeypatch.setattr(codegen, "trials", lambda: [replace(first, cases=cases)])
    monkeypatch.setattr(codegen, "_cost", lambda: "")
    monkeypatch.setattr(codegen, "SECTIONS", {"compensation": codegen.compensation})
    made = codegen.bench(quick=True)
    rows = made.tables[codegen.LOOPS]
    assert [row["case"] for row in rows] == ["without", PROVEN, "levels x 0.5"]
    assert rows[0][bristles].startswith("1 / 1")
    assert [row["met"] for row in made.tables[GOALS]] == ["yes", "yes"]
