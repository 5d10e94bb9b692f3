"""A fit through a file and back."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fits import make

from identification.result.fitted import Fitted
from symfric.laws import Stribeck
from symfric.scenes import Rabinowicz


@pytest.fixture(scope="module")
def fit() -> Fitted:
    return make(records=2, starts=2, call="Fit(...)")


@pytest.fixture
def file(fit: Fitted, tmp_path: Path) -> Path:
    fit.to_json(tmp_path / "fit.json")
    return tmp_path / "fit.json"


def test_everything_comes_back(fit: Fitted, file: Path) -> None:
    back = Fitted.from_json(file)
    assert json.dumps(back.to_dict()) == json.dumps(fit.to_dict())
    assert str(back) == str(fit)
    assert back.values == fit.values
    assert back.status is fit.status
    assert repr(back.law) == repr(fit.law)
    v = np.linspace(-0.1, 0.1, 101)
    assert back.law is not None
    assert fit.law is not None
    assert np.array_equal(back.law.force(v, 1.0), fit.law.force(v, 1.0))
    assert back.made["call"] == "Fit(...)"


def test_the_file_is_plain_json_with_names_that_a_program_finds(file: Path) -> None:
    data = json.loads(file.read_text())
    assert (data["file"], data["format"], data["law"]) == ("symfric fit", 1, "stribeck")
    assert data["parameters"]["mu_s"].keys() >= {"value", "unit", "standard_error", "low", "high"}
    assert data["errors"]["run 1"]["force"]["rms"] > 0
    assert data["status"] == "SOLVED"
    assert {t["name"] for t in data["verdict"]["tests"]} >= {"whiteness"}


def test_a_page_is_made_of_a_file_too(fit: Fitted, file: Path, tmp_path: Path) -> None:
    back = Fitted.from_json(file)
    back.to_html(tmp_path / "back.html")
    fit.to_html(tmp_path / "fit.html")
    sizes = [(tmp_path / name).stat().st_size for name in ("back.html", "fit.html")]
    assert abs(sizes[0] - sizes[1]) < 0.01 * sizes[1]


def test_what_needs_data_says_so(file: Path) -> None:
    back = Fitted.from_json(file)
    with pytest.raises(ValueError, match="validate: expected a fit of this process"):
        back.validate(None)  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match="model: expected a fit of this process"):
        _ = back.model


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "no such file"),
        ("not json", "something else"),
        ('{"a": 1}', "something else"),
        ("[1]", "something else"),
        ('{"file": "symfric fit", "format": 99}', "expected format 1, got 99"),
        ('{"file": "symfric fit", "format": 1}', "modified"),
    ],
)
def test_other_files_are_refused_in_a_sentence(
    content: str | None, message: str, tmp_path: Path
) -> None:
    path = tmp_path / "other.json"
    if content is not None:
        path.write_text(content)
    with pytest.raises(ValueError, match=message) as refused:
        Fitted.from_json(path)
    assert str(refused.value).count("\n") == 0


@pytest.mark.parametrize("key", ["law_data", "parameters", "series", "status", "errors"])
def test_a_damaged_part_is_refused(key: str, file: Path) -> None:
    data = json.loads(file.read_text())
    data[key] = {"kind": "stribeck", "mu_d": -1.0} if key == "law_data" else [3]
    file.write_text(json.dumps(data))
    with pytest.raises(ValueError, match="expected the output of fit"):
        Fitted.from_json(file)


def test_a_fit_of_another_machine_is_stored_with_its_law(fit: Fitted, tmp_path: Path) -> None:
    other = replace(fit, machine=Rabinowicz(Stribeck()), live=None)
    other.to_json(tmp_path / "other.json")
    back = Fitted.from_json(tmp_path / "other.json")
    assert back.machine is None
    assert repr(back.law) == repr(fit.law)
    assert [v.name for v in other.model.x] == ["x", "v"]


def test_a_law_of_an_unknown_class_leaves_the_rest(file: Path) -> None:
    data = json.loads(file.read_text())
    data["law_data"]["kind"] = "MyLaw"
    file.write_text(json.dumps(data))
    back = Fitted.from_json(file)
    assert back.law is None
    assert back.values["mu_s"] > 20
