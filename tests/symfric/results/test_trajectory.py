"""Signals, details, modes, tables and display of runs."""

import csv
from dataclasses import replace
from pathlib import Path

import casadi as ca
import matplotlib.pyplot as plt
import numpy as np
import pytest
from pages import on_a_screen, shown

import symfric as sf
from symfric.foundation.numeric import Array
from symfric.integrator import simulate_by_peer
from symfric.model.kinds import MODE
from symfric.multibody import Mechanism
from symfric.results import stored
from symfric.scenes import MECHANISMS, Arm, FourMass, Pendulum


@pytest.fixture(scope="module")
def run() -> sf.Trajectory:
    return sf.simulate(
        Pendulum(sf.BrownMcPhee()).model(["m"]), 1.0, samples=21, p={"m": 2.0}, rtol=1e-8
    )


def test_a_detail_is_a_signal_by_name(run: sf.Trajectory) -> None:
    """Half a metre, and the mass that was given to the run."""
    assert "rod_x" not in run.units
    assert run.unit("rod_x") == "m"
    assert run["rod_x"] == pytest.approx(0.5 * np.sin(run["phi"]))
    angle, rate = run["phi"], run["phi_rate"]
    assert {"phi_Fx": "N", "phi_Mx": "N m", "friction_work_rate": "W"}.items() <= (
        run.details.items()
    )
    assert not run.details.keys() & run.units.keys()
    assert "\nfurther: " in repr(run)
    assert run["phi_Fx"] == pytest.approx(-2.0 * (9.81 * np.cos(angle) + 0.5 * rate**2))


def test_any_expression_of_the_model_at_any_time(run: sf.Trajectory) -> None:
    model = run.model
    phi, w = (v.symbol for v in model.x)
    column = run.of(ca.vertcat(model.p[0].symbol * w, model.t), [0.25, 0.5])
    assert column.shape == (2, 2)
    assert column[0] == pytest.approx(2.0 * run.at([0.25, 0.5])["phi_rate"])
    assert column[1] == pytest.approx([0.25, 0.5])
    assert run.of(ca.sin(phi)) == pytest.approx(np.sin(run["phi"]))


def test_foreign_symbols_times_and_names_are_refused(run: sf.Trajectory) -> None:
    times, name = r"expected times in \[0, 1\] s", "got phi_Fq; did you mean phi_F"
    for call, message in (
        (lambda: run.of(ca.SX.sym("alien")), r"symbols of its model, got alien"),
        (lambda: run.of(run.model.t, [2.0]), f"{times}, got 2"),
        (lambda: run.integral("phi", [-1.0]), times),
        (lambda: run["phi_Fq"], name),
        (lambda: run.integral("phi_Fq"), name),
        (lambda: run.plot("phi_Fq"), name),
    ):
        with pytest.raises(ValueError, match=message):
            call()


def test_columns_of_choice_are_written(run: sf.Trajectory, tmp_path: Path) -> None:
    run.to_csv(tmp_path / "x.csv", "phi", "phi_Fx")
    with (tmp_path / "x.csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    assert header == ["t [s]", "phi [rad]", "phi_Fx [N]"]
    assert [float(row[2]) for row in rows] == pytest.approx(run["phi_Fx"])


def test_a_model_without_details_has_accelerations_alone() -> None:
    run = sf.simulate(sf.rabinowicz(sf.LuGre()), 0.1, samples=3)
    assert run.details == {"x_acc": "m/s^2"}
    with pytest.raises(ValueError, match="got wok_rate"):
        run["wok_rate"]


def test_details_of_a_peer_show_its_drift() -> None:
    """Nothing is refined behind CasADi's integrators, neither signals nor expressions."""
    model = MECHANISMS["four_mass"](sf.BrownMcPhee(v_t=0.1)).model()
    run = simulate_by_peer(model, 0.5, "rosenbrock", samples=5)
    assert run["constraint_position"].max() > 1e-10
    assert run.of(model.expression("constraint_position")) == pytest.approx(
        run["constraint_position"], abs=1e-15
    )


def test_tables_of_pandas_and_xarray(run: sf.Trajectory) -> None:
    pytest.importorskip("pandas", reason="needs the package pandas")
    pytest.importorskip("xarray", reason="needs the package xarray")
    frame, data, some = run.to_dataframe(), run.to_xarray(), run.to_dataframe("phi", "phi_Fx")
    assert list(frame.columns) == list(run.units)
    assert frame.index.name == "t"
    np.testing.assert_array_equal(frame.index.to_numpy(), run.t)
    np.testing.assert_array_equal(frame["phi"].to_numpy(), run["phi"])
    assert list(some.columns) == ["phi", "phi_Fx"]
    assert some.attrs["units"] == {"t": "s", "phi": "rad", "phi_Fx": "N"}
    assert {name: array.attrs["units"] for name, array in data.items()} == run.units
    assert (data["t"].attrs["units"], data.attrs["scene"]) == ("s", "pendulum")
    np.testing.assert_array_equal(data["phi"].values, run["phi"])


def test_without_their_packages_there_is_a_sentence(
    run: sf.Trajectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(name: str) -> None:
        raise ImportError(name)

    monkeypatch.setattr(stored, "import_module", none)
    for call, package in ((run.to_dataframe, "pandas"), (run.to_xarray, "xarray")):
        message = f"expected the package {package}, got none; .*pip install {package}"
        with pytest.raises(ImportError, match=message):
            call()


MODEL: dict[str, sf.Model] = {
    "exact": sf.rabinowicz(sf.ExactCoulomb()),
    "loops": FourMass(sf.ExactCoulomb()).model(),
}


def modes(model: sf.Model) -> list[str]:
    return [v.name for v in model.x if v.kind == MODE]


def whole(values: object) -> bool:
    return set(np.unique(np.asarray(values, dtype=float))) <= {-1.0, 0.0, 1.0}


@pytest.mark.parametrize("name", MODEL)
def test_modes_of_a_run_are_whole_numbers_everywhere(name: str, tmp_path: Path) -> None:
    model = MODEL[name]
    run = sf.simulate(model, 1.5 if name == "loops" else 8.0, rtol=1e-6)
    direction = name == "loops" and "x1_loop_direction" not in modes(model)
    assert modes(model) and not direction, "the law has modes"
    between = run.at(np.linspace(*run.span, 3001))
    looked = [run.at_looks(mode) for mode in modes(model)]
    assert any(np.unique(values).size > 1 for values in looked), "one of them jumps"
    for mode, seen in zip(modes(model), looked, strict=True):
        for values in (run[mode], run.signals[mode], between[mode], run.extremes[mode], seen):
            assert whole(values), mode
        assert whole(run.final[mode])
    table = str(run).splitlines()
    for mode in modes(model):
        (row,) = [line for line in table if line.split()[:1] == [mode]]
        assert {float(x) for x in row.split()[2:]} <= {-1.0, 0.0, 1.0}
        assert "-0 " not in row
    file = tmp_path / "run.csv"
    run.to_csv(file)
    head, *rows = file.read_text().splitlines()
    columns = [i for i, title in enumerate(head.split(",")) if title.split(" ")[0] in modes(model)]
    assert len(columns) == len(modes(model))
    assert whole([[row.split(",")[i] for i in columns] for row in rows])


@pytest.mark.parametrize("times", [None, np.linspace(0.0, 8.0, 41)])
def test_modes_of_an_ensemble_are_whole_numbers(times: np.ndarray | None) -> None:
    study = sf.simulate_many(
        MODEL["exact"], 8.0, t_eval=times, x0={"x": np.linspace(0.0, 0.3, 3)}, method="dopri5",
        backend="vm",
    )  # fmt: skip
    assert whole(study.signals["mode"])
    assert whole(study.extremes["mode"])


@pytest.fixture(scope="module")
def sticking() -> sf.Trajectory:
    return sf.simulate(sf.rabinowicz(sf.ExactCoulomb()), 6.0, samples=301)


def test_a_run_prints_how_it_ended_and_the_ranges_of_its_signals(sticking: sf.Trajectory) -> None:
    run, text = sticking, repr(sticking)
    assert on_a_screen(text)
    assert text.startswith(
        "run of 'rabinowicz' from 0 to 6 s\nfriction: belt by ExactCoulomb\nSUCC"
    )
    assert f"), {len(run.happened)} event" in text
    assert "further" not in text, "details are not evaluated for it"
    assert f"{run.statistics.steps} steps of Rodas5P ({run.statistics.backend}), " in text
    row = next(line.split() for line in text.splitlines() if line.startswith("  friction"))
    low, high = run.extremes["friction"]
    numbers = (run["friction"][0], run["friction"][-1], low, high)
    assert row == ["friction", "N", *(f"{x:.6g}" for x in numbers)]


def test_a_run_as_html_has_a_picture_and_leaves_no_figure_open(sticking: sf.Trajectory) -> None:
    before = plt.get_fignums()
    page = shown(sticking)
    assert len(page.pictures) == 1
    assert "ExactCoulomb" in page.words
    assert plt.get_fignums() == before


def test_showing_a_long_run_looks_at_its_times_only() -> None:
    looked = list[int]()
    short = sf.simulate(sf.rabinowicz(sf.LuGre()), 1.0, samples=51)
    counts = replace(short.statistics, steps=10**6)

    def evaluate(at: Array) -> dict[str, Array]:
        looked.append(at.size)
        return short.evaluate(at)

    long = replace(short, count=lambda: counts, evaluate=evaluate)
    assert "see extremes" in repr(long)
    row = next(line.split() for line in repr(long).splitlines() if line.startswith("  x "))
    assert row[-2:] == [f"{short['x'].min():.6g}", f"{short['x'].max():.6g}"]
    assert looked == [51]


def test_an_ensemble_names_the_failed_members() -> None:
    model = sf.rabinowicz(sf.BrownMcPhee(), free=["m"])
    runs = sf.simulate_many(model, 1.0, p={"m": [0.5, 1.0]}, t_eval=[0.5, 1.0], max_steps=5)
    assert "ensemble of 'rabinowicz': 2 members at 2 times from 0.5 to 1 s" in repr(runs)
    assert "member 0 failed: " in repr(runs)
    fine = sf.simulate_many(model, 1.0, p={"m": [0.5, 1.0]}, t_eval=np.linspace(0.1, 1, 9))
    x = fine["x"][:, -1]
    row = next(line.split() for line in repr(fine).splitlines() if line.startswith("  x"))
    assert row == ["x", "m", f"{x.min():.6g}", f"{np.median(x):.6g}", f"{x.max():.6g}"]
    assert len(shown(fine).pictures) == 1
    nowhere = sf.simulate(model, 6.0, max_steps=3, throw=False)
    assert "MAX_STEPS" in repr(nowhere) and on_a_screen(repr(nowhere))


def test_mechanisms_show_bodies_joints_and_what_rubs() -> None:
    for scene in MECHANISMS.values():
        machine = scene(sf.BrownMcPhee()).mechanism()
        assert on_a_screen(repr(machine))
        assert "BrownMcPhee" in repr(machine)
    arm = Arm(sf.BrownMcPhee()).mechanism()
    assert "6 bodies, 6 joints, no closed loops" in repr(arm)
    assert len(shown(arm).pictures) == 1
    assert not shown(Mechanism("empty")).pictures


def test_completion_offers_what_users_ask_for() -> None:
    run = sf.simulate(sf.rabinowicz(sf.BrownMcPhee()), 0.1, samples=11)
    offered = {name for name in dir(run) if not name.startswith("_")}
    assert {"at", "plot", "save", "extremes", "t", "final", "sensitivities"} <= offered
    assert offered.isdisjoint({"evaluate", "express", "keep", "packed_as", "shown", "hidden"})
