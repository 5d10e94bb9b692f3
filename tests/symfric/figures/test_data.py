"""Figures are named columns with units."""

import json
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from matplotlib.image import imread
from refusing import not_refused

import symfric as sf
from symfric import BrownMcPhee, Law, LuGre, Model, law_from_text, simulate, symbolise
from symfric.figures import Curve, FigureData, scales
from symfric.figures.motion import fine, prescribed, pushed, shoved, slid, slides, through
from symfric.figures.regularisation import machine_of, regularisation
from symfric.integrator import Linear
from symfric.laws import GenericAsperity, RandomBristles

V = np.array([0.0, 1.0])
CURVES = Curve("lugre", "2 Hz", {"v": V, "F": 2 * V}), Curve("lugre", "", {"v": V, "F": V})
DATA = FigureData("lag", "lag", {"v": "m/s", "F": "N"}, (("v", "F"),), CURVES)


def broken(law: Law) -> Model:
    raise ValueError(f"no model for {type(law).__name__}")


def test_calls_that_cannot_be_are_refused() -> None:
    law = BrownMcPhee()
    names = {"LAW": law, "symbolic": symbolise(law, "v_t")[0], "DATA": DATA, "broken": broken}
    functions = (prescribed, through, regularisation, machine_of)
    names |= {function.__name__: function for function in functions}
    packages = sf, sf.laws, sf.figures, sf.scenes
    assert not_refused(Path(__file__).with_name("refusals.toml"), *packages, **names) == []


def test_a_curve_comes_by_case_or_label() -> None:
    assert [DATA[name]["F"][1] for name in ("2 Hz", "lugre, 2 Hz", "lugre")] == [2.0, 2.0, 1.0]


def test_plain_data_survives_json() -> None:
    plain = json.loads(json.dumps(DATA.to_dict()))
    assert plain["units"] == {"v": "m/s", "F": "N"}
    assert plain["panels"] == [["v", "F"]]
    assert plain["curves"][0] == {
        "law": "lugre", "case": "2 Hz", "columns": {"v": [0.0, 1.0], "F": [0.0, 2.0]}
    }  # fmt: skip


def test_a_picture_has_units_and_a_legend(tmp_path: Path) -> None:
    figure = DATA.plot(tmp_path / "lag.png")
    (axis,) = figure.axes
    assert (axis.get_xlabel(), axis.get_ylabel()) == ("v [m/s]", "F [N]")
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["2 Hz", "as it is"]
    assert imread(tmp_path / "lag.png").shape[2] == 4


def test_magnitudes_of_lugre_are_its_levels_stiffness_and_stribeck_velocity() -> None:
    found = scales(LuGre(), 2.0)
    assert (found.static, found.kinetic) == pytest.approx((0.3, 0.2), rel=1e-3)
    assert found.stretch == pytest.approx(0.3 / 1e5)
    assert (found.velocity, found.mass) == (1e-3, 0.8)


def test_without_v_s_the_velocity_is_where_the_force_has_fallen_half_the_way() -> None:
    law = law_from_text("bengisu_akay")
    V = scales(law, 1.0).velocity
    assert law.force(V, 1.0) == pytest.approx(0.125, rel=5e-3)


def test_stretch_is_the_static_level_over_the_stiffness_at_rest() -> None:
    for name in ("maxwell_slip", "gms", "dahl"):
        found = scales(law_from_text(name))
        assert found.stretch == pytest.approx(found.static / 1e5)


def test_a_strong_contact_gets_a_heavier_block() -> None:
    assert scales(law_from_text("quarter_car_simple")).mass > 50.0


@pytest.mark.parametrize("pace", [1.0, 5.0])
def test_the_contact_passes_every_turning_point(pace: float) -> None:
    points = (0.0, 2e-5, -1e-5, 3e-5)
    curve = slides(LuGre(), 1.0, through(points, 0.5))("", np.linspace(0.0, 1.5 / pace, 4), pace)
    assert curve["x"] == pytest.approx(points, abs=1e-10)
    assert curve["v"] == pytest.approx(np.zeros(4), abs=1e-10)


def test_it_starts_in_steady_sliding_at_its_first_velocity() -> None:
    model = prescribed(LuGre(), 1.0, lambda t, pace: 1e-2 + 0 * t * pace)
    F = simulate(model, 0.1, samples=11)["friction"]
    assert pytest.approx(np.full(11, 0.1), rel=1e-9) == F


def test_a_pushed_block_stops_where_it_has_broken_away() -> None:
    run = pushed(LuGre(), 1.0, 1.0, 2.0, 10.0, until=0.5)
    assert run.final["v"] == pytest.approx(0.5, rel=1e-6)
    assert run.step_times[-1] < 0.4  # 2 N - 0.1 N on 1 kg need about 0.26 s


def test_times_between_the_steps_hold_the_ends_of_the_steps() -> None:
    run = pushed(LuGre(), 1.0, 1.0, 0.05, 0.1)
    times = fine(run, 4)
    assert times[::4] == pytest.approx(run.step_times)
    assert (np.diff(times) > 0).all()


N = 10.0
SPRING = RandomBristles(delta_s=1.0)


def test_way_and_velocity_are_those_of_the_given_motion() -> None:
    t = np.linspace(0.0, 0.2, 101)
    found = slid(GenericAsperity(count=20), N, lambda s, p: 1e-3 * p * ca.sin(20 * p * s), t, 2.0)
    assert found["v"] == pytest.approx(2e-3 * np.sin(40 * t))
    assert found["x"] == pytest.approx(5e-5 * (1 - np.cos(40 * t)), abs=1e-10)


def test_bristles_that_hold_are_a_spring_along_the_way() -> None:
    t = np.linspace(0.0, 1.0, 11)
    found = slid(SPRING, N, lambda s, p: 1e-6 + 0 * s, t, 1.0)
    assert found["F"] - found["F"][0] == pytest.approx(0.1 * t, rel=1e-6)


def test_a_pushed_block_on_a_spring_swings_with_its_frequency() -> None:
    start = float(SPRING.begin().z.mean()) * 1e5
    run = shoved(SPRING, N, 0.8, start + 1.0, 0.05, None)
    w = np.sqrt(1e5 / 0.8)
    expected = 1e-5 * (1 - np.cos(w * run.step_times))
    assert run.columns["x"] == pytest.approx(expected, abs=3e-6)


def test_the_run_ends_where_the_velocity_is_reached() -> None:
    law = GenericAsperity(count=50, mu_0=0.0, mu_inf=0.0)
    run = shoved(law, N, 2.0, Linear([0.0, 1.0], [0.0, 400.0]), 1.0, 0.25)
    assert run.step_times[-1] == pytest.approx(0.05, abs=5e-4)  # v = (10 t)^2 without friction
    assert run.at(0.025)["force"] == pytest.approx(10.0)
    assert run.at([0.025])["v"] == pytest.approx(0.0625, abs=2e-3)
