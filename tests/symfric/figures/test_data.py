"""Figures are named columns with units.

Figures by name, of one law, of several laws and of a scene: finite or refused.
"""

import json
from collections.abc import Iterable
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from matplotlib.image import imread
from refusing import not_refused

import symfric as sf
from symfric import BrownMcPhee, Law, LuGre, Model, law_from_text, simulate, symbolise
from symfric.figures import FIGURES, Curve, FigureData, phenomena, scales
from symfric.figures.catalogue import in_scene, scene_figure
from symfric.figures.motion import fine, prescribed, pushed, shoved, slid, slides, through
from symfric.figures.regularisation import machine_of, regularisation
from symfric.integrator import Linear
from symfric.laws import GenericAsperity, RandomBristles
from symfric.scenes import Pendulum

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


pytestmark = pytest.mark.heavy

NEEDS = {
    "profile": set(sf.ALL_LAWS),
    "steady_state": set(sf.ALL_LAWS),
    "sweep_b": {"self_tuning", "rui_wang"},
    "sweep_c": {"self_tuning", "rui_wang"},
    "sweep_e": {"self_tuning", "rui_wang"},
}
SHOWN_WITH = {
    "hysteresis": {"P"},
    "transition": {"P"},
    "lag": {"L"},
    "drift": {"S", "P"},
    "break_away": {"S", "P"},
    "stiction": {"D", "S"},
    "dwell": {"T"},
    "velocity_step": {"L"},
}
OTHER_INPUTS = {"quarter_car_general", "bam"}
"""Laws that need more than a pushed block offers."""


STEADY = ("profile", "steady_state")
LED = {"coulomb", "karnopp", "dahl", *OTHER_INPUTS, "wojewoda"}
"""Laws without and with states and events, and those that are refused: drawn in every suite."""


def shows(law: str, name: str) -> bool:
    if name in NEEDS:
        return law in NEEDS[name]
    if name in ("drift", "break_away", "stiction") and law in OTHER_INPUTS | {"wojewoda"}:
        return False
    return bool(SHOWN_WITH[name] & set(phenomena(sf.law_from_text(law))))


@pytest.mark.parametrize("law", sf.ALL_LAWS)
def test_every_figure_has_finite_columns_of_one_length_or_is_refused(law: str) -> None:
    names = [n for n in FIGURES if law in LED or n in STEADY or not shows(law, n)]
    every_figure_is_finite_or_refused(law, names)


@pytest.mark.slow
@pytest.mark.parametrize("law", [law for law in sf.ALL_LAWS if law not in LED])
def test_motions_of_the_other_laws_are_finite(law: str) -> None:
    every_figure_is_finite_or_refused(law, [n for n in FIGURES if n not in STEADY])


def every_figure_is_finite_or_refused(law: str, names: Iterable[str]) -> None:
    for name in names:
        if not shows(law, name):
            with pytest.raises(ValueError, match=r"expected a law (that|with)"):
                sf.figure(sf.law_from_text(law), name)
            continue
        data = sf.figure(sf.law_from_text(law), name)
        assert data.name == name
        for curve in data.curves:
            assert len({values.shape for values in curve.columns.values()}) == 1
            assert {column for panel in data.panels for column in panel} <= set(curve.columns)
            assert set(curve.columns) <= set(data.units)
            assert all(np.isfinite(values).all() for values in curve.columns.values())


REFERENCES = {
    "generic_asperity": sf.GenericAsperity(count=6),
    "random_bristles": sf.RandomBristles(),
}
SHORT = {("generic_asperity", "hysteresis"), ("random_bristles", "stiction")}


@pytest.mark.parametrize(
    ("law", "name"),
    [
        pytest.param(law, name, marks=() if (law, name) in SHORT else pytest.mark.slow)
        for law in REFERENCES
        for name in FIGURES
        if not name.startswith("sweep")
    ],
)
def test_a_population_has_the_figures_of_its_phenomena(law: str, name: str) -> None:
    reference = REFERENCES[law]
    needed = SHOWN_WITH.get(name)
    if needed and not needed & set(phenomena(reference)):
        with pytest.raises(ValueError, match="expected a law that"):
            sf.figure(reference, name)
        return
    for curve in sf.figure(reference, name).curves:
        assert curve.law == law
        assert all(np.isfinite(values).all() for values in curve.columns.values())


def test_a_composed_law_shows_what_its_parts_show_in_the_order_of_the_list() -> None:
    assert phenomena(sf.law_from_text("maxwell_slip+viscous")) == ["D", "V", "P", "M", "N"]


@pytest.mark.filterwarnings("ignore:invalid value encountered in arcsin")
@pytest.mark.parametrize("name", ["profile", "steady_state"])
def test_a_force_that_is_no_number_anywhere_is_refused(name: str) -> None:
    """A strut of 4 mm does not reach where the figure slides it to."""
    with pytest.raises(ValueError, match=f"{name} of quarter_car_general: .* is none anywhere"):
        sf.figure(sf.QuarterCarGeneral(L_d=0.004, k_s=2.89e6), name, 10.0)


def test_all_laws_get_the_motion_of_the_first() -> None:
    data = sf.compare(["lugre", "maxwell_slip"], "hysteresis")
    assert [curve.label for curve in data.curves] == [
        f"{law}, {speed}x" for law in ("lugre", "maxwell_slip") for speed in (1, 5, 20)
    ]
    one, other = data["lugre, 5x"], data["maxwell_slip, 5x"]
    assert other["x"] == pytest.approx(one["x"], abs=1e-10)
    assert one["x"].max() == pytest.approx(2 * 0.15 * 7.848 / 1e5, rel=1e-6)


def test_laws_of_one_kind_are_numbered_and_a_mapping_names_them() -> None:
    strong = sf.with_values(sf.LuGre(), {"mu_s": 0.2})
    assert [c.law for c in sf.compare([sf.LuGre(), strong]).curves] == ["lugre_1", "lugre_2"]
    assert [c.law for c in sf.compare({"weak": sf.LuGre(), "strong": strong}).curves] == [
        "weak", "strong",
    ]  # fmt: skip


def test_a_scene_shows_the_signals_that_the_laws_share() -> None:
    data = sf.compare([sf.LuGre(), "brown_mcphee"], "rabinowicz")
    assert [curve.law for curve in data.curves] == ["lugre", "brown_mcphee"]
    assert {"t", "x", "v", "friction"} <= set(data.units)
    assert "z" not in data.units  # a state of LuGre alone
    assert data["lugre"]["x"].max() == pytest.approx(0.5705, rel=0.02)
    assert data["brown_mcphee"]["x"].max() == pytest.approx(0.5705, rel=0.02)


def test_a_law_that_cannot_show_it_is_left_out_with_the_reason_in_the_note() -> None:
    data = sf.compare([sf.LuGre(), sf.Coulomb()], "hysteresis")
    assert {curve.law for curve in data.curves} == {"lugre"}
    assert data.note == "without coulomb: expected a law that shows pre-sliding displacement"
    assert data.to_dict()["note"] == data.note


def test_a_population_is_compared_by_name_and_as_an_instance() -> None:
    data = sf.compare(["dahl", sf.RandomBristles(seed=3), "random_bristles"], "hysteresis")
    assert {c.law for c in data.curves} == {"dahl", "random_bristles_2", "random_bristles_3"}


def test_a_population_is_left_out_of_a_scene() -> None:
    data = sf.compare(["coulomb", "generic_asperity"], "rabinowicz")
    assert {curve.law for curve in data.curves} == {"coulomb"}
    assert data.note == "without generic_asperity: expected a law with equations"


def test_the_title_lists_the_inputs_of_all_laws() -> None:
    title = sf.compare(["coulomb", "karnopp", "awrejcewicz", "bam"], "profile").title
    assert title.endswith("N = 7.848 N, F_e = 1 N, tau_m = 1 N m, tau_e = 0.5 N m")
    assert sf.compare(["karnopp", "lugre"], "rabinowicz").title == "rabinowicz"


def test_a_mechanism_is_drawn_by_position_friction_and_energy() -> None:
    data = scene_figure("pendulum", {"LuGre": in_scene(sf.LuGre(), "pendulum")})
    assert data.panels == (("t", "phi"), ("t", "phi_friction"), ("t", "energy"))
    assert data["LuGre"]["t"][-1] == Pendulum.t_end


def test_a_law_of_many_states_does_not_push_its_friction_out() -> None:
    data = scene_figure("rabinowicz", {"gms": sf.simulate(sf.rabinowicz(sf.GMS()), 0.1)})
    assert data.panels == (("t", "x"), ("t", "friction"), ("t", "power"))
    assert {"F_1", "F_4"} <= set(data["gms"].columns)
