"""Every figure of the gallery at reduced size: what it says, how far it is, what is refuted."""

import re
from functools import cache
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure

from symfric.gallery.plate import SECTIONS, Plate, about, plate_of, plates, scripts

PLATES = plates()
FARTHEST = {
    "generalized_maxwell_slip/fig_02_lag_of_the_generic_model": 0.08,
    "generalized_maxwell_slip/fig_04_position": 1e-10,
    "generalized_maxwell_slip/fig_05_presliding": 5e-3,
    "generalized_maxwell_slip/fig_06_frictional_lag": 1.5e-4,
    "generalized_maxwell_slip/fig_07_transition": 6e-3,
    "generalized_maxwell_slip/fig_08_applied_force": 5e-3,
    "generalized_maxwell_slip/fig_09_drift": 6e-3,
    "laminator_nips/fig_3_2_stribeck_and_viscous_part": 1e-8,
    "laminator_nips/fig_3_3_viscous_friction": 0.01,
    "laminator_nips/fig_5_3_pilot_study": 0.05,
    "laminator_nips/fig_5_5_main_study": 0.015,
    "laminator_nips/fig_5_8_stable_region": 0.015,
    "quarter_car_friction/fig_04_without_friction": 1e-8,
    "quarter_car_friction/fig_11_body": 5e-3,
    "quarter_car_friction/fig_12_friction_loops": 0.03,
    "quarter_car_friction/fig_13_simple_form": 2e-3,
    "quarter_car_friction/fig_14_two_parts": 1e-4,
    "selection/fig_02_belt_displacement": 0.25,
    "selection/fig_03_belt_velocity": 0.18,
    "selection/fig_04_belt_acceleration": 0.05,
    "selection/fig_05_belt_friction": 0.02,
    "selection/fig_06_pendulum_box": 1e-9,
    "selection/fig_07_box_displacement": 0.1,
    "selection/fig_08_box_velocity": 1e-6,
    "selection/fig_09_box_acceleration": 1e-5,
    "selection/fig_10_pendulum_angle": 1e-6,
    "selection/fig_11_pendulum_velocity": 1e-6,
    "selection/fig_12_pendulum_acceleration": 1e-5,
    "self_tuning/fig_01_force_profiles": 0.1,
    "self_tuning/fig_03_stick_slip_motion": 0.03,
    "self_tuning/fig_04_stick_slip_force": 0.07,
    "self_tuning/fig_07_shape_factor": 0.5,
    "self_tuning/fig_08_stiffness_factor": 0.5,
    "self_tuning/fig_09_curvature_factor": 1.5,
    "self_tuning/fig_10_sensitivity": 1e-9,
    "self_tuning/fig_12_stiffness_function": 0.5,
    "self_tuning/fig_13_jitter": 0.07,
    "self_tuning/fig_14_four_mass_positions": 1e-8,
    "self_tuning/fig_15_four_mass_velocities": 1e-7,
    "self_tuning/fig_16_four_mass_accelerations": 1e-6,
    "self_tuning/fig_17_crank_acceleration": 1e-5,
    "self_tuning/fig_18_slider_acceleration": 1e-5,
    "self_tuning/fig_19_slider_velocity": 1e-6,
    "self_tuning/fig_20_crank_velocity": 1e-6,
    "self_tuning/fig_21_slider_position": 1e-9,
}
"""Name -> largest distance at reduced size, in its own unit, see the script."""


@cache
def quick(name: str) -> Plate:
    """A plate at reduced size, computed once."""
    return PLATES[name](quick=True)


@pytest.mark.parametrize("name", [*PLATES])
def test_a_plate_is_drawn_and_says_how_far_we_are(name: str) -> None:
    plate = quick(name)
    assert isinstance(plate.picture, Figure)
    assert plate.picture.axes
    assert all(axis.has_data() for axis in plate.picture.axes if axis.axison)
    values = np.array([plate.distance, *plate.numbers.values()], dtype=float)
    assert np.isfinite(values).all()
    assert plate.numbers
    assert all(re.search(r" \[[^\]]+\]$", name) for name in plate.numbers), "a number has a unit"
    assert plate.how_far
    assert plate.distance < FARTHEST[name]
    assert plate.checked, "what the evidence says is checked on the numbers"
    assert not plt.get_fignums(), "figures are made outside pyplot"
    assert plate.to_dict()["figure"] == plate.figure


def test_every_script_says_what_it_must() -> None:
    for name, module in scripts().items():
        said = about(name)
        assert all(said.get(part) for part in ("paper", "title", *SECTIONS)), name
        assert len(said["title"]) <= 90, name
        source = Path(*module.split(".")).with_suffix(".py")
        text = (Path(__file__).parents[3] / source).read_text(encoding="utf-8")
        assert len(text.splitlines()) < 100, f"{name} has {len(text.splitlines())} lines"
        assert "pyplot" not in text, name


def test_every_script_of_a_paper_is_found() -> None:
    folder = Path(__file__).parents[3] / "symfric" / "gallery"
    files = {f"{p.parent.name}/{p.stem}" for p in folder.glob("*/*.py") if p.stem[0] != "_"}
    assert files == {*scripts()}, "scripts are named fig_07_what_it_shows, helpers _name"


def test_every_figure_is_held_to_its_distance() -> None:
    assert [*FARTHEST] == [*scripts()]


def test_a_figure_whose_text_is_untrue_is_not_drawn() -> None:
    script = scripts()["self_tuning/fig_07_shape_factor"]
    with pytest.raises(ValueError, match=r"bear out its text, got others for 'two is three';"):
        plate_of(script, Figure(), 0.0, "1", {"a [1]": 1.0}, {"it is": True, "two is three": False})


def test_gms_peaks_in_speeding_up_and_lugre_in_slowing_down() -> None:
    numbers = quick("generalized_maxwell_slip/fig_07_transition").numbers
    ratio = {
        name: numbers[f"peak in speeding up over that in slowing down, {name}, 2 Hz [1]"]
        for name in ("generic model", "GMS", "LuGre", "Leuven")
    }
    assert min(ratio["generic model"], ratio["GMS"]) > 1.05
    assert max(ratio["LuGre"], ratio["Leuven"]) < 0.75


def test_the_law_of_the_quarter_car_as_printed_holds_the_body_for_ever_and_drives_it() -> None:
    body = quick("quarter_car_friction/fig_11_body").numbers
    assert body["way of the body by equation 12 as printed [m]"] == 0.0
    assert body["residual of x_rel in table 1 [m]"] > body["rms of x_rel itself [m]"]
    assert (
        body["overshoot after the last ramp, weakly viscous friction [m]"]
        > (body["overshoot after the last ramp, without friction [m]"])
    )
    parts = quick("quarter_car_friction/fig_14_two_parts").numbers
    assert parts["least power of Coulomb friction as printed [W]"] < -0.1


def test_the_main_study_does_not_tell_the_viscous_part() -> None:
    found = quick("laminator_nips/fig_5_8_stable_region")
    assert found.distance < 0.02
    assert (
        found.numbers["sigma_2 all at once [N s/m]"] > 10 * found.numbers["sigma_2 printed [N s/m]"]
    )
