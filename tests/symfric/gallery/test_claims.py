"""What docstrings of the gallery refute, at full size: the numbers that the sentences stand on."""

from functools import cache

import pytest

from symfric.gallery.plate import Plate, plates
from symfric.gallery.selection._laws import LAWS, PRINTED, SLIDING

pytestmark = pytest.mark.slow


@cache
def plate(start: str) -> Plate:
    name = next(name for name in plates() if name.startswith(start))
    return plates()[name]()


def numbers(start: str, words: str) -> dict[str, float]:
    found = {name: v for name, v in plate(start).numbers.items() if words in name}
    assert found, f"{start} has no number with '{words}'"
    return found


def test_jitter_is_of_the_step_and_not_of_the_law() -> None:
    assert plate("self_tuning/fig_13").distance < 0.03
    smooth = max(numbers("self_tuning/fig_13", "with error control").values())
    assert min(numbers("self_tuning/fig_13", "in steps of 1 ms").values()) > 5 * smooth
    assert max(numbers("self_tuning/fig_13", "in steps of 0.1 ms").values()) < 1.01 * smooth
    totals = [*numbers("self_tuning/fig_16", "total variation").values()]
    assert max(totals) < 1.06 * min(totals)


def test_machines_are_those_by_hand() -> None:
    limits = {"14": 1e-8, "15": 1e-7, "16": 1e-4, "17": 1e-3, "18": 1e-3, "19": 1e-5, "20": 1e-5}
    for figure, limit in limits.items():
        assert plate(f"self_tuning/fig_{figure}").distance < limit, figure
    for figure, limit in {"08": 1e-6, "09": 1e-4, "10": 1e-6, "11": 1e-5, "12": 1e-3}.items():
        assert plate(f"selection/fig_{figure}").distance < limit, figure


def test_the_transition_velocity_is_not_gone() -> None:
    assert plate("self_tuning/fig_01").numbers[
        "change of F by half of B at twice the speed [1]"
    ] < (1e-12)
    change = numbers("self_tuning/fig_15", "largest change")
    tuned, brown = (next(v for n, v in change.items() if law in n) for law in ("self", "Brown"))
    assert tuned > brown
    assert next(iter(numbers("self_tuning/fig_03", "least difference").values())) > 0.035


def test_the_bracket_of_the_law_is_not_that_of_the_figure() -> None:
    inside, outside = numbers("self_tuning/fig_09", "statements that do not hold").values()
    assert (inside, outside) == (1, 0)


def test_the_paper_s_stability_is_an_amplitude() -> None:
    given = plate("selection/fig_02").numbers
    held = [given[f"S x 100, {law} [m]"] for law in LAWS if law not in SLIDING]
    assert max(held) - min(held) < 0.5
    assert min(held) < given["S x 100, exact dry friction [m]"] < max(held)
    at_steps = [given[f"S x 100 at the steps of the solver, {law} [m]"] for law in LAWS]
    assert max(at_steps) > 2 * min(at_steps)
    assert given["largest change by a tolerance of 1e-9 [m]"] < 1e-6


def test_the_pendulum_is_no_point_mass() -> None:
    given, printed = plate("selection/fig_06").numbers, PRINTED["Smooth"][1]
    assert given["S x 100 with 1.8 kg m^2 about the mass [m]"] == pytest.approx(printed, rel=0.05)
    assert given["S x 100 with a point mass [m]"] < 0.6 * printed


def test_karnopp_stands_apart_by_its_band_in_the_hinge() -> None:
    far = numbers("selection/fig_07", "largest distance from exact")
    wide = far.pop("largest distance from exact dry friction, Karnopp [m]")
    narrow = next(iter(numbers("selection/fig_07", "hundredth").values()))
    assert wide > 0.04
    assert max(far.values()) < 0.011
    assert narrow < 0.002
