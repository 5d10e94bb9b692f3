"""Units of multipliers and constraints: their product is an energy."""

from symfric.laws import BrownMcPhee
from symfric.multibody.results import constraint_units
from symfric.scenes import FourBar, SliderCrank


def test_multipliers_have_the_unit_of_what_they_do() -> None:
    rod = SliderCrank(BrownMcPhee()).model().signals
    assert rod["rod_lambda"] == "N/m"
    assert rod["constraint_position"] == "m^2"
    assert rod["constraint_acceleration"] == "m^2/s^2"
    pin = FourBar(BrownMcPhee()).model().signals
    assert pin["pin_lambda_1"] == pin["pin_lambda_2"] == "N"
    assert pin["constraint_velocity"] == "m/s"
    every = FourBar(BrownMcPhee()).mechanism().build(formulation="absolute").signals
    hinge = [every[f"theta_crank_lambda_{i}"] for i in range(1, 6)]
    assert hinge == ["N", "N", "N", "N m", "N m"]
    assert every["crank_rod_norm"] == "J"


def test_constraints_of_several_kinds_have_a_norm_without_unit() -> None:
    assert constraint_units(["N m", "N m"]) == ("rad", "rad/s", "rad/s^2")
    assert constraint_units(["N", "N m"]) == ("", "", "")
    assert constraint_units([""]) == constraint_units([]) == ("", "", "")
