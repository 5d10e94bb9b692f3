"""Every figure of the gallery at reduced size: what it says, how far it is, what is refuted."""

import re
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure

from symfric.gallery.plate import SCRIPT, VERDICTS, Plate, about, plate_of, plates, script, scripts

PLATES = plates()
ROOT = Path(__file__).parents[3]


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
    assert plate.distance <= plate.within
    assert plate.checked, "what is said is checked on the numbers"
    assert plate.quick
    assert not plate.verdicts, "verdicts rest on the full size"
    assert not plt.get_fignums(), "figures are made outside pyplot"
    assert plate.to_dict()["figure"] == plate.figure


def test_every_script_says_what_it_must() -> None:
    for name, module in scripts().items():
        said = about(name)
        assert all(said.get(part) for part in ("paper", "title", "Compared", "Distance")), name
        assert said.keys() & VERDICTS.keys(), name
        assert "eleven" not in said["title"], "a title holds at reduced size, too"
        assert not re.search(r"over [\d.]+ s\b", said["Distance"]), "and so does the distance"
        assert len(said["title"]) <= 90, name
        source = Path(*module.split(".")).with_suffix(".py")
        assert "pyplot" not in (ROOT / source).read_text(encoding="utf-8"), name


def test_every_figure_of_a_paper_is_found() -> None:
    sources = [p.read_text("utf-8") for p in (ROOT / "symfric" / "gallery").glob("*/*.py")]
    assert sum(text.count("\n@plate(") for text in sources) == len(scripts())
    assert all(SCRIPT.fullmatch(name.rpartition("/")[2]) for name in scripts())


def test_a_figure_whose_text_is_untrue_is_not_drawn() -> None:
    figure = script("self_tuning/fig_07_shape_factor")
    with pytest.raises(ValueError, match=r"bear out its text, got others for 'two is three';"):
        made(figure, claims={"it is": True, "two is three": False})


def test_a_figure_beyond_its_bound_is_not_drawn() -> None:
    figure = script("self_tuning/fig_07_shape_factor")
    with pytest.raises(ValueError, match=r"got others for a distance within 0.1 m, 0.2;"):
        made(figure, distance=0.2)
    assert made(figure, distance=0.1).how_far == "0.1 m (at most 0.1 m)"


def test_verdicts_are_of_three_kinds_and_of_the_full_size() -> None:
    figure = script("selection/fig_07_box_displacement")
    assert [*made(figure).verdicts] == [*VERDICTS.values()]
    assert made(figure).text
    small = made(figure, quick=True)
    assert not small.verdicts
    assert not small.text
    assert small.checked == ("it is",)
    with pytest.raises(ValueError, match="a docstring with Compared, Distance, Reproduced or"):
        made(sum)


def made(
    function: Callable[..., object], *, distance: float = 0.0, quick: bool = False,
    claims: Mapping[str, bool] | None = None,
) -> Plate:  # fmt: skip
    """A plate of given numbers."""
    numbers, claims = {"a [1]": 1.0}, {"it is": True} if claims is None else claims
    return plate_of(function, Figure(), distance, numbers, claims, "m", within=0.1, quick=quick)


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
    """Of twelve noises, the curve is always the same and sigma_2 anything."""
    from symfric.gallery.laminator_nips import studies  # noqa: PLC0415

    shares = studies.shares(studies.refitted("main", stable=True, count=12), "main")
    assert min(shares["sigma_2"]) < 0.01
    assert max(shares["sigma_2"]) > 10
