"""Figures are named columns with units."""

import json
from pathlib import Path

import numpy as np
from matplotlib.image import imread
from refusing import not_refused

import symfric
import symfric.figures
import symfric.laws
import symfric.scenes
from symfric import BrownMcPhee, Law, Model, symbolise
from symfric.figures import Curve, FigureData
from symfric.figures.motion import prescribed, through
from symfric.figures.regularisation import machine_of, regularisation

V = np.array([0.0, 1.0])
CURVES = Curve("lugre", "2 Hz", {"v": V, "F": 2 * V}), Curve("lugre", "", {"v": V, "F": V})
DATA = FigureData("lag", "lag", {"v": "m/s", "F": "N"}, (("v", "F"),), CURVES)


def broken(law: Law) -> Model:
    raise ValueError(f"no model for {type(law).__name__}")


def test_calls_that_cannot_be_are_refused() -> None:
    law = BrownMcPhee()
    names = {"LAW": law, "symbolic": symbolise(law, "v_t")[0], "DATA": DATA, "broken": broken}
    functions = (prescribed, through, regularisation, machine_of)
    names |= {function.__name__: function for function in functions}
    packages = symfric, symfric.laws, symfric.figures, symfric.scenes
    assert not_refused(Path(__file__).with_name("refusals.toml"), *packages, **names) == []


def test_a_curve_comes_by_case_or_label() -> None:
    assert [DATA[name]["F"][1] for name in ("2 Hz", "lugre, 2 Hz", "lugre")] == [2.0, 2.0, 1.0]


def test_plain_data_survives_json() -> None:
    plain = json.loads(json.dumps(DATA.to_dict()))
    assert plain["units"] == {"v": "m/s", "F": "N"}
    assert plain["panels"] == [["v", "F"]]
    assert plain["curves"][0] == {
        "law": "lugre", "case": "2 Hz", "columns": {"v": [0.0, 1.0], "F": [0.0, 2.0]}
    }  # fmt: skip


def test_a_picture_has_units_and_a_legend(tmp_path: Path) -> None:
    figure = DATA.plot(tmp_path / "lag.png")
    (axis,) = figure.axes
    assert (axis.get_xlabel(), axis.get_ylabel()) == ("v [m/s]", "F [N]")
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["2 Hz", "as it is"]
    assert imread(tmp_path / "lag.png").shape[2] == 4
