"""Ensembles keep what was varied and how far members went, save themselves and become tables."""

import csv
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from matplotlib.collections import PolyCollection

from symfric import BrownMcPhee, Ensemble, ExactCoulomb, Hold, LuGre, Model, Status, Variable
from symfric.integrator.running import run as running
from symfric.results.pictures import plot_many

from symfric import Event, drive, load_ensemble, load_run, rabinowicz, simulate, simulate_many  # isort: skip

MU = np.linspace(0.12, 0.4, 7)
END = 24.0
T = np.linspace(0.0, END, 9)


@cache
def study() -> Ensemble:
    return varied(backend="vm")


def varied(**how: Any) -> Ensemble:
    model = rabinowicz(LuGre(), free=["mu_s"])
    return simulate_many(model, END, p={"mu_s": MU}, x0={"v": 0.01}, t_eval=T, **how)


def test_what_was_varied_is_kept_with_its_unit() -> None:
    made = study()
    np.testing.assert_array_equal(made.varied["mu_s"], MU)
    assert made.varied["mu_s"] is not MU
    assert made.fixed == {"x0.v": 0.01}
    assert (made.unit("mu_s"), made.unit("x0.v"), made.unit("x")) == ("1", "m/s", "m")
    assert "varied: mu_s from 0.12 to 0.4" in repr(made)
    assert "fixed: x0.v = 0.01 m/s" in repr(made)
    model = drive(BrownMcPhee())
    pushes = Hold([0.0, 0.5], [[1.0, 2.0], [3.0, 4.0]])
    other = simulate_many(model, [0.5, 1.0], u={"force": [2.0, 3.0]}, backend="vm")
    assert {n: v.tolist() for n, v in other.varied.items()} == {
        "u.force": [2.0, 3.0],
        "t_end": [0.5, 1.0],
    }
    assert (other.unit("u.force"), other.unit("t_end")) == ("N", "s")
    assert simulate_many(model, 1.0, u={"force": pushes}, backend="vm").varied == {}


@pytest.mark.parametrize("backend", [pytest.param("vm", marks=pytest.mark.slow), "compiled"])
def test_extremes_of_states_are_those_of_all_steps(backend: str) -> None:
    """Samples three seconds apart miss each slip back, which lasts a fifth of one."""
    made, model = varied(backend=backend), rabinowicz(LuGre(), free=["mu_s"])
    missed = 0
    for m, mu in enumerate(MU.tolist()):
        run = simulate(model, END, p={"mu_s": mu}, x0={"v": 0.01})
        for name in ("x", "v"):
            low, high = (ends[m] for ends in made.extremes[name])
            least, greatest = run.extremes[name]
            width = greatest - least
            assert low == pytest.approx(least, abs=0.02 * width)
            assert high == pytest.approx(greatest, abs=0.02 * width)
            missed += made[name][m].min() > least + 0.2 * width
    assert missed > 3  # without the steps it would have been wrong


@pytest.mark.parametrize("watched", [False, True])  # members with events run one by one
@pytest.mark.parametrize("backend", ["vm", "compiled"])
def test_a_member_that_is_greatest_at_its_start_is_that_in_a_long_run(
    backend: str, watched: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where there is one look at the end, and steps are left out since there are too many."""
    x, v, k = Variable("x", "m"), Variable("v", "m/s"), Variable("k", "1/s^2")
    events = (Event("far", x - 100.0),) if watched else ()
    rates = ca.vertcat(v, -k * x - 0.05 * v)
    swings = Model("swings", x=(x, v), p=(k,), ode=rates, events=events)
    monkeypatch.setattr(running, "MOST_BYTES", 10_000)
    starts = {"x0": {"x": np.array([1.0, 2.0])}, "p": {"k": [1.0, 4.0]}}
    made = simulate_many(swings, 60.0, backend=backend, **starts)
    assert made.attempts.min() > 100
    assert made.extremes["x"][1].tolist() == [1.0, 2.0]


def test_extremes_of_members_with_events_and_of_those_that_failed() -> None:
    model = rabinowicz(ExactCoulomb(), free=["mu_s"])
    made = simulate_many(model, 8.0, p={"mu_s": MU[:3]}, backend="vm")
    for m, mu in enumerate(MU[:3].tolist()):
        least, greatest = simulate(model, 8.0, p={"mu_s": mu}).extremes["v"]
        assert made.extremes["v"][0][m] == pytest.approx(least, abs=0.02 * (greatest - least))
    short = varied(backend="vm", max_steps=40)
    assert short.failed
    assert not short.finished.any()
    assert np.isfinite(short.extremes["v"][1]).all()  # as far as they got


def test_an_ensemble_comes_back_from_its_file_to_the_bit(tmp_path: Path) -> None:
    for made in (varied(backend="vm", max_steps=60), varied(backend="vm", out=tmp_path / "folder")):
        made.save(tmp_path / "study.npz")
        again = load_ensemble(tmp_path / "study.npz")
        assert repr(again) == repr(made)
        assert again.failed == made.failed
        for name in made.signals:
            np.testing.assert_array_equal(again[name], made[name])
            np.testing.assert_array_equal(again.extremes[name], made.extremes[name])
        np.testing.assert_array_equal(again.reached, made.reached)
        np.testing.assert_array_equal(again["mu_s"], MU)
    with pytest.raises(ValueError, match="kind 'symfric run', got a 'symfric ensemble'"):
        load_run(tmp_path / "study.npz")


def test_an_interrupted_ensemble_keeps_and_saves_what_it_has(tmp_path: Path) -> None:
    def stop(done: float) -> None:
        if done > 0.4:
            raise KeyboardInterrupt

    made = varied(backend="vm", chunk=2, executor="serial", progress=stop)
    assert made.status is Status.INTERRUPTED
    assert made.finished.tolist() == [True] * 4 + [False] * 3
    assert "3 members not started" in repr(made)
    made.save(tmp_path / "study.npz")
    again = load_ensemble(tmp_path / "study.npz")
    assert again.status is Status.INTERRUPTED
    assert np.isnan(again.extremes["v"][0][4:]).all()
    np.testing.assert_array_equal(again["x"][:4], made["x"][:4])
    assert made.plot("v", over="mu_s").axes[0].get_title(loc="left").count("3 without a value")


def test_pictures_over_what_was_varied() -> None:
    made = study()
    figure = made.plot("x", "v", over="mu_s")
    line = figure.axes[0].lines[0]
    np.testing.assert_array_equal(line.get_xdata(), MU)
    np.testing.assert_array_equal(line.get_ydata(), made["x"][:, -1])
    assert line.get_markersize() == 3.0  # few points: each is seen on its line
    assert figure.axes[1].get_xlabel() == "mu_s"
    model = rabinowicz(LuGre(), free=["mu_s"])
    mixed = simulate_many(model, 0.1, p={"mu_s": [0.3, 0.1, 0.2]}, backend="vm")
    line = mixed.plot("x", over="mu_s").axes[0].lines[0]
    np.testing.assert_array_equal(line.get_xdata(), [0.1, 0.2, 0.3])
    np.testing.assert_allclose(line.get_ydata(), 1e3 * mixed["x"][[1, 2, 0], -1])  # mm
    top = made.plot("v", over="mu_s", at="greatest").axes[0].lines[0]
    np.testing.assert_array_equal(top.get_ydata(), made.extremes["v"][1])
    middle = made.plot("x", over="mu_s", at=12.4).axes[0]
    np.testing.assert_array_equal(middle.lines[0].get_ydata(), made["x"][:, 4])
    assert "at t = 12 s" in middle.get_title(loc="left")
    for how, message in (
        ({"over": "mu"}, r"plot: over.*did you mean mu_s"),
        ({"over": "mu_s", "at": "most"}, "at: expected one of end, least, greatest, got most"),
    ):
        with pytest.raises(ValueError, match=message):
            made.plot("x", **how)


def test_a_second_parameter_of_few_values_gives_a_line_each() -> None:
    model = rabinowicz(BrownMcPhee(), free=["mu_s", "k"])
    grid = {"mu_s": np.tile(MU, 2), "k": np.repeat([1.0, 500.0], 7)}
    made = simulate_many(model, 0.2, p=grid, backend="vm")
    lines = made.plot("x", over="mu_s").axes[0].lines
    assert [line.get_label() for line in lines] == ["k = 1 N/m", "k = 500 N/m"]
    shown = [line.get_ydata() for line in lines]
    np.testing.assert_allclose(shown, 1e3 * made["x"].reshape(2, 7))  # mm
    axis = made.plot("x", over="k").axes[0]  # seven of mu_s: points alone
    assert len(axis.lines) == 1
    assert axis.get_xscale() == "log"


def test_csv_has_a_row_for_each_member_and_time(tmp_path: Path) -> None:
    made = study()
    made.to_csv(tmp_path / "study.csv", "x")
    with (tmp_path / "study.csv").open() as file:
        header, *rows = csv.reader(file)
    assert header == ["member", "t [s]", "mu_s [1]", "x [m]"]
    found = np.array(rows, float)
    assert found.shape == (7 * 9, 4)
    np.testing.assert_array_equal(found[:, 3].reshape(7, 9), made["x"])
    np.testing.assert_array_equal(found[::9, 2], MU)


def test_tables_of_pandas_and_sets_of_xarray() -> None:
    pytest.importorskip("pandas", reason="pandas is not installed")
    pytest.importorskip("xarray", reason="xarray is not installed")
    made = study()
    frame, data = made.to_dataframe("x", "v"), made.to_xarray("x")
    assert list(frame.columns) == ["mu_s", "x", "v"]
    assert frame.index.names == ["member", "t"]
    np.testing.assert_array_equal(frame.loc[3, "x"], made["x"][3])
    assert (frame.attrs["units"]["mu_s"], frame.attrs["x0.v"]) == ("1", 0.01)
    np.testing.assert_array_equal(data["x"].swap_dims(member="mu_s").sel(mu_s=MU[2]), made["x"][2])
    assert (data["x"].attrs["units"], data["mu_s"].attrs["units"]) == ("m", "1")
    ends = simulate_many(rabinowicz(LuGre(), free=["mu_s"]), 1.0, p={"mu_s": MU}, backend="vm")
    assert ends.to_dataframe("x").shape == (7, 2)


TIMES = np.linspace(0.0, 1.0, 11)


def test_bands_hold_the_percentiles_and_leave_out_who_has_ended() -> None:
    values = np.arange(101.0)[:, None] + np.zeros(11)
    values[:, 8:] = np.nan
    values[50:, 5:] = np.nan
    axis = plot_many("a", TIMES, {"x": values}, {"x": "N"}).axes[0]
    outer, inner = (c for c in axis.collections if isinstance(c, PolyCollection))
    for band, low, high in ((outer, 5.0, 95.0), (inner, 25.0, 75.0)):
        y = band.get_paths()[0].vertices[:, 1]
        assert (y.min(), y.max()) == pytest.approx((min(low, 49 * low / 100), high))
    (median,) = axis.lines
    assert median.get_ydata() == pytest.approx([50.0] * 5 + [24.5] * 3)
    assert axis.get_title(loc="left") == "a, 101 members"


def test_few_members_are_drawn_one_by_one() -> None:
    axis = plot_many("a", TIMES, {"x": np.array([TIMES, 2 * TIMES])}, {"x": "m"}).axes[0]
    assert [line.get_label() for line in axis.lines] == ["member 0", "member 1"]
    assert axis.lines[1].get_ydata() == pytest.approx(2 * TIMES)


def test_an_ensemble_shows_its_ends_where_it_has_no_more() -> None:
    model = rabinowicz(BrownMcPhee(), free=["mu_s"])
    runs = simulate_many(model, 0.05, p={"mu_s": np.linspace(0.1, 0.2, 12)}, backend="vm")
    figure = runs.plot("x", "v")
    assert [axis.get_ylabel() for axis in figure.axes] == ["members", "members"]
    assert figure.axes[0].get_xlabel() == "x [mm] at the end"
    assert sum(patch.get_height() for patch in figure.axes[0].patches) == 12
    with pytest.raises(ValueError, match="did you mean friction"):
        runs.plot("frictoin")
