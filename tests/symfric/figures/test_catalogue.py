"""Figures by name, of one law, of several laws and of a scene: finite or refused."""

from collections.abc import Iterable

import numpy as np
import pytest
from tables import sampled

import symfric as sf
from symfric.figures import FIGURES, phenomena
from symfric.figures.catalogue import in_scene, scene_figure
from symfric.scenes import Pendulum

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
OTHER_INPUTS = {"quarter_car_general", "bam", "brush_tyre", "lugre_tyre"}
"""Laws that need more than a pushed block offers."""


STEADY = ("profile", "steady_state")
LED = {"coulomb", "karnopp", "dahl", *OTHER_INPUTS, "wojewoda"}
"""Laws without and with states and events, and those that are refused: drawn in every suite."""


def shows(law: str, name: str) -> bool:
    if name in NEEDS:
        return law in NEEDS[name]
    pushed = name in ("drift", "break_away", "stiction")
    if law in OTHER_INPUTS or (law == "wojewoda" and pushed):
        return False
    return bool(SHOWN_WITH[name] & set(phenomena(sf.law_from_text(law))))


@pytest.mark.parametrize("law", sampled(sf.ALL_LAWS, of=4))
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
