"""Laws under one excitation."""

import pytest

import symfric
import symfric.laws
from symfric import Coulomb, LuGre, Viscous, with_values
from symfric.figures import FigureData, compare
from symfric.laws import GenericAsperity


def test_all_laws_get_the_motion_of_the_first() -> None:
    data = compare(["lugre", "maxwell_slip"], "hysteresis")
    assert [curve.label for curve in data.curves] == [
        f"{law}, {speed}x" for law in ("lugre", "maxwell_slip") for speed in (1, 5, 20)
    ]
    one, other = data["lugre, 5x"], data["maxwell_slip, 5x"]
    assert other["x"] == pytest.approx(one["x"], abs=1e-10)
    assert one["x"].max() == pytest.approx(2 * 0.15 * 7.848 / 1e5, rel=1e-6)


def test_laws_of_one_kind_are_numbered_and_a_mapping_names_them() -> None:
    strong = with_values(LuGre(), {"mu_s": 0.2})
    assert [c.law for c in compare([LuGre(), strong]).curves] == ["lugre_1", "lugre_2"]
    assert [c.law for c in compare({"weak": LuGre(), "strong": strong}).curves] == [
        "weak", "strong",
    ]  # fmt: skip


@pytest.mark.parametrize("scene", ["rabinowicz", "drive"])
def test_a_scene_shows_the_signals_that_the_laws_share(scene: str) -> None:
    data = compare([LuGre(), "brown_mcphee"], scene)
    assert [curve.law for curve in data.curves] == ["lugre", "brown_mcphee"]
    assert {"t", "x", "v", "friction"} <= set(data.units)
    assert "z" not in data.units  # a state of LuGre alone


def test_stick_slip_of_two_laws_reaches_the_exact_amplitude() -> None:
    data = compare(["lugre", "brown_mcphee"], "rabinowicz")
    assert data["lugre"]["x"].max() == pytest.approx(0.5705, rel=0.02)
    assert data["brown_mcphee"]["x"].max() == pytest.approx(0.5705, rel=0.02)


def test_a_law_that_cannot_show_it_is_left_out_and_the_note_says_why() -> None:
    data = compare([LuGre(), Coulomb()], "hysteresis")
    assert {curve.law for curve in data.curves} == {"lugre"}
    assert data.note == "without coulomb: expected a law that shows pre-sliding displacement"
    assert data.to_dict()["note"] == data.note


def test_where_no_law_can_show_it_the_first_is_named() -> None:
    with pytest.raises(ValueError, match="hysteresis of viscous"):
        compare([Viscous(), Coulomb()], "hysteresis")


def test_unknown_scenario_is_refused_with_a_hint() -> None:
    with pytest.raises(ValueError, match=r"compare: scenario: .* did you mean rabinowicz"):
        compare(["lugre"], "rabinovicz")


def test_no_law_and_no_law_at_all_are_refused() -> None:
    with pytest.raises(ValueError, match="at least one law"):
        compare([])
    with pytest.raises(ValueError, match="compare: expected a law such as"):
        compare([3.0])  # pyright: ignore[reportArgumentType]


def test_it_is_reached_from_the_front() -> None:
    assert symfric.compare is compare
    assert isinstance(symfric.compare(["coulomb"]), FigureData)


def test_a_population_is_compared_by_name_and_as_an_instance() -> None:
    own = GenericAsperity(count=200, seed=3)
    data = compare(["gms", own, "generic_asperity"], "hysteresis")
    assert {c.law for c in data.curves} == {"gms", "generic_asperity_2", "generic_asperity_3"}


def test_a_population_is_left_out_of_a_scene() -> None:
    data = compare(["coulomb", "generic_asperity"], "rabinowicz")
    assert {curve.law for curve in data.curves} == {"coulomb"}
    assert data.note == "without generic_asperity: expected a law with equations"
    with pytest.raises(ValueError, match="expected a law with equations, got a population"):
        compare(["generic_asperity"], "rabinowicz")


def test_the_title_says_the_inputs_of_all_laws() -> None:
    title = compare(["coulomb", "karnopp", "awrejcewicz", "bam"], "profile").title
    assert title.endswith("N = 7.848 N, F_e = 1 N, tau_m = 1 N m, tau_e = 0.5 N m")
    assert compare(["karnopp", "lugre"], "rabinowicz").title == "rabinowicz"
