"""How far the figures are from their papers, and what they say is refuted, at reduced size."""

import pytest

from symfric.gallery.plate import plates

FARTHEST = {
    "generalized_maxwell_slip/fig_04_position": 1e-10,
    "generalized_maxwell_slip/fig_08_applied_force": 5e-3,
    "generalized_maxwell_slip/fig_09_drift": 6e-3,
    "quarter_car_friction/fig_04_without_friction": 1e-8,
    "quarter_car_friction/fig_11_body": 5e-3,
    "quarter_car_friction/fig_13_simple_form": 2e-3,
    "quarter_car_friction/fig_14_two_parts": 1e-4,
    "laminator_nips/fig_3_3_viscous_friction": 0.01,
}
"""Name -> largest distance, in its own unit, see the script."""


@pytest.mark.parametrize("name", [*FARTHEST])
def test_the_distance_is_what_the_figure_is_known_for(name: str) -> None:
    assert plates()[name](quick=True).distance < FARTHEST[name]


def test_gms_peaks_in_speeding_up_and_lugre_in_slowing_down() -> None:
    numbers = plates()["generalized_maxwell_slip/fig_07_transition"](quick=True).numbers
    ratio = {
        name: numbers[f"peak in speeding up over that in slowing down, {name}, 2 Hz [1]"]
        for name in ("generic model", "GMS", "LuGre", "Leuven")
    }
    assert min(ratio["generic model"], ratio["GMS"]) > 1.05
    assert max(ratio["LuGre"], ratio["Leuven"]) < 0.75


def test_the_law_of_the_quarter_car_as_printed_holds_the_body_for_ever_and_drives_it() -> None:
    body = plates()["quarter_car_friction/fig_11_body"](quick=True).numbers
    assert body["way of the body by equation 12 as printed [m]"] == 0.0
    assert body["residual of x_rel in table 1 [m]"] > body["rms of x_rel itself [m]"]
    assert (
        body["overshoot after the last ramp, weakly viscous friction [m]"]
        > (body["overshoot after the last ramp, without friction [m]"])
    )
    parts = plates()["quarter_car_friction/fig_14_two_parts"](quick=True).numbers
    assert parts["least power of Coulomb friction as printed [W]"] < -0.1


def test_the_main_study_does_not_tell_the_viscous_part() -> None:
    found = plates()["laminator_nips/fig_5_8_stable_region"](quick=True)
    assert found.distance < 0.02
    assert (
        found.numbers["sigma_2 all at once [N s/m]"] > 10 * found.numbers["sigma_2 printed [N s/m]"]
    )
