"""Figures are named columns with units."""

import json
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from symfric.figures import Curve, FigureData


@pytest.fixture
def data() -> FigureData:
    v = np.array([0.0, 1.0])
    curves = (Curve("lugre", "2 Hz", {"v": v, "F": 2 * v}), Curve("lugre", "", {"v": v, "F": v}))
    return FigureData("lag", "lag", {"v": "m/s", "F": "N"}, (("v", "F"),), curves)


@pytest.mark.parametrize("name", ["2 Hz", "lugre, 2 Hz"])
def test_a_curve_comes_by_case_or_label(data: FigureData, name: str) -> None:
    assert data[name]["F"][1] == 2.0


def test_the_bare_label_is_the_curve_without_a_case(data: FigureData) -> None:
    assert data["lugre"]["F"][1] == 1.0


def test_unknown_curves_and_columns_are_refused_with_a_hint(data: FigureData) -> None:
    with pytest.raises(ValueError, match="did you mean 2 Hz"):
        data["3 Hz"]
    with pytest.raises(ValueError, match=r"curve 'lugre, 2 Hz': expected one of v, F, got x"):
        data["2 Hz"]["x"]


def test_plain_data_survives_json(data: FigureData) -> None:
    plain = json.loads(json.dumps(data.to_dict()))
    assert plain["units"] == {"v": "m/s", "F": "N"}
    assert plain["panels"] == [["v", "F"]]
    assert plain["curves"][0] == {
        "law": "lugre", "case": "2 Hz", "columns": {"v": [0.0, 1.0], "F": [0.0, 2.0]}
    }  # fmt: skip


def test_a_picture_has_units_and_a_legend(data: FigureData, tmp_path: Path) -> None:
    figure = data.plot(tmp_path / "lag.png")
    (axis,) = figure.axes
    assert (axis.get_xlabel(), axis.get_ylabel()) == ("v [m/s]", "F [N]")
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["2 Hz", "as it is"]
    assert imread(tmp_path / "lag.png").shape[2] == 4
