"""Excitation from the parameters of a law."""

import pytest

from symfric import LuGre, law_from_text, symbolise, with_values
from symfric.figures import hysteresis, scales


def test_excitation_follows_the_parameters_of_the_law() -> None:
    stiff = with_values(LuGre(), {"sigma_0": 1e6})
    x, other = (hysteresis(law, speeds=(1.0,))["1x"]["x"] for law in (LuGre(), stiff))
    assert x.max() == pytest.approx(10 * other.max(), rel=1e-6)
    assert x.max() == pytest.approx(2 * 0.15 * 7.848 / 1e5, rel=1e-6)


def test_magnitudes_of_lugre_are_its_levels_stiffness_and_stribeck_velocity() -> None:
    found = scales(LuGre(), 2.0)
    assert (found.static, found.kinetic) == pytest.approx((0.3, 0.2), rel=1e-3)
    assert found.stretch == pytest.approx(0.3 / 1e5)
    assert (found.velocity, found.mass) == (1e-3, 0.8)


def test_without_v_s_the_velocity_is_where_the_force_has_fallen_half_the_way() -> None:
    law = law_from_text("bengisu_akay")
    V = scales(law, 1.0).velocity
    assert law.force(V, 1.0) == pytest.approx(0.125, rel=5e-3)


@pytest.mark.parametrize(
    ("name", "stiffness"), [("maxwell_slip", 1e5), ("gms", 1e5), ("dahl", 1e5)]
)
def test_stretch_is_the_static_level_over_the_stiffness_at_rest(
    name: str, stiffness: float
) -> None:
    found = scales(law_from_text(name))
    assert found.stretch == pytest.approx(found.static / stiffness)


def test_a_strong_contact_gets_a_heavier_block() -> None:
    assert scales(law_from_text("quarter_car_simple")).mass > 50.0


def test_symbols_are_refused() -> None:
    law, _ = symbolise(LuGre(), "mu_s")
    with pytest.raises(ValueError, match="figure: mu_s: expected a finite number"):
        scales(law)
