"""Every figure of the gallery at reduced size, and what its script says."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure

from symfric.gallery.plate import SECTIONS, about, plates, scripts

PLATES = plates()


@pytest.mark.parametrize("name", [*PLATES])
def test_a_plate_is_drawn_and_says_how_far_we_are(name: str) -> None:
    plate = PLATES[name](quick=True)
    assert isinstance(plate.picture, Figure)
    assert plate.picture.axes
    assert all(axis.has_data() for axis in plate.picture.axes if axis.axison)
    values = np.array([plate.distance, *plate.numbers.values()], dtype=float)
    assert np.isfinite(values).all()
    assert plate.numbers
    assert plate.how_far
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
