"""`symfric laws`."""

import json
from pathlib import Path
from typing import Any

import pytest

from symfric import law_from_text, parameters
from symfric.cli import main
from symfric.cli.laws import parts
from symfric.figures import pictures
from symfric.figures.pictures import plot_catalogue
from symfric.laws import ALL_LAWS, POPULATIONS

EVERY = ALL_LAWS | POPULATIONS
PNG = b"\x89PNG\r\n\x1a\n"


def described(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    assert main(["laws", *arguments, "--json", "-"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    return json.loads(out)


def test_the_list_has_a_line_for_every_law(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["laws"]) == 0
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= 80
    first = [line.split()[0] for line in out.splitlines() if line.strip()]
    assert [name for name in first if name in EVERY] == list(EVERY)


@pytest.mark.parametrize("name", EVERY)
def test_one_law_shows_equation_source_and_parameters(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["laws", name]) == 0
    out = capsys.readouterr().out
    assert "F " in out
    assert "Limits:" in out
    assert "Source:" in out
    said = " ".join(out.split())  # as wrapped
    assert f"Formula: {EVERY[name].facts.formula}." in said
    table = out[out.index("parameter ") :].splitlines()
    for parameter in parameters(EVERY[name]()).values():
        row = next(line for line in table if line.startswith(f"{parameter.name} "))
        assert parameter.unit in row
        assert parameter.doc.split()[0] in row


def test_the_json_of_the_list_holds_every_law(capsys: pytest.CaptureFixture[str]) -> None:
    laws = {law["name"]: law for law in described(capsys)["laws"]}
    assert list(laws) == list(EVERY)
    assert laws["lugre"]["states"] == {"z": "m"}
    assert list(laws["lugre"]["phenomena"]) == ["D", "S", "St", "V", "P", "L", "B"]


def test_the_json_of_one_law_has_units_and_bounds(capsys: pytest.CaptureFixture[str]) -> None:
    law = described(capsys, "lugre", "--set", "mu_s=0.3")
    mu_s = law["parameters"]["mu_s"]
    assert mu_s["value"] == 0.3
    assert mu_s["unit"] == "1"
    assert (mu_s["lower"], mu_s["upper"]) == (0.0, None)


def test_a_composed_law_shows_what_its_parts_show(capsys: pytest.CaptureFixture[str]) -> None:
    law = described(capsys, "asymmetric(coulomb+viscous)")
    assert list(law["phenomena"]) == ["D", "V"]
    assert "F = sigma_2 v" in law["doc"]


def test_parts_are_listed_once_from_the_outside_in() -> None:
    kinds = [kind.__name__ for kind in parts(law_from_text("asymmetric(coulomb+viscous)"))]
    assert kinds == ["Asymmetric", "Sum", "Coulomb", "Viscous"]


def test_an_option_is_set_like_a_parameter(capsys: pytest.CaptureFixture[str]) -> None:
    law = described(capsys, "coulomb", "--set", "shape=atan", "--set", "mu_d=0.3")
    assert law["options"]["shape"]["value"] == "atan"
    assert law["parameters"]["mu_d"]["value"] == 0.3


def test_an_unknown_choice_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["laws", "karnopp", "--set", "form=sharp"]) != 0
    assert "form: expected one of smooth, original, event, got 'sharp'" in capsys.readouterr().err


def test_further_inputs_and_options_are_shown(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["laws", "karnopp"]) == 0
    out = capsys.readouterr().out
    assert "F_e" in out[out.index("input ") :]
    assert "smooth, original, event" in out[out.index("option ") :]


def test_cost_is_shown_as_instructions_of_value_and_gradient(
    capsys: pytest.CaptureFixture[str],
) -> None:
    cost = described(capsys, "viscous")["instructions"]
    # value: v, sigma_2, product, and its output; gradient: sigma_2 alone, and its output
    assert cost["value"] > cost["gradient"] > 0


@pytest.mark.parametrize(
    "arguments",
    [["lugre"], pytest.param([], marks=pytest.mark.slow), ["asymmetric(stribeck)"]],
)
def test_the_picture_is_a_png(arguments: list[str], tmp_path: Path) -> None:
    path = tmp_path / "laws.png"
    assert main(["laws", *arguments, "--plot", str(path)]) == 0
    assert path.read_bytes().startswith(PNG)


def test_the_picture_of_the_list_has_a_panel_for_each_law(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    few = {name: ALL_LAWS[name] for name in ("coulomb", "lugre")}
    drawn = list[str]()

    def draw(laws: dict[str, Any], load: float, path: Path) -> None:
        drawn.extend(laws)
        plot_catalogue({name: laws[name] for name in few}, load, path)

    monkeypatch.setattr(pictures, "plot_catalogue", draw)
    path = tmp_path / "laws.png"
    assert main(["laws", "--plot", str(path)]) == 0
    assert path.read_bytes().startswith(PNG)
    assert drawn == list(EVERY)


LISTED = {
    "name", "states", "phenomena", "smoothness", "confidence", "checked", "source",
    "parameters", "instructions",
}  # fmt: skip


def test_the_json_of_the_list_is_a_list_of_laws_with_all_they_say(
    capsys: pytest.CaptureFixture[str],
) -> None:
    for law in described(capsys)["laws"]:
        assert set(law) >= LISTED
        assert min(law["instructions"].values()) > 0


def test_a_figure_is_drawn_summarised_and_given_as_data(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    picture, file = tmp_path / "h.png", tmp_path / "h.json"
    arguments = ["laws", "maxwell_slip", "--figure", "hysteresis"]
    assert main([*arguments, "--plot", str(picture), "--json", str(file)]) == 0
    out, err = capsys.readouterr()
    rows = [line.split() for line in out.splitlines()]
    last = next(row for row in rows if row[:3] == ["maxwell_slip,", "20x", "F"])
    assert last[3] == "N"
    least, greatest = map(float, last[4:])
    assert (least, greatest) == pytest.approx((-0.7, 0.75), abs=0.1)
    assert err == f"wrote {picture}, {file}\n"
    assert picture.read_bytes().startswith(PNG)
    data = json.loads(file.read_text())
    assert data["name"] == "hysteresis"
    assert [curve["case"] for curve in data["curves"]] == ["1x", "5x", "20x"]
    assert data["units"]["x"] == "m"


def test_settings_hold_for_all_compared_laws_or_for_the_named_one(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """They changed the first one only, without a word."""
    settings = ("--set", "mu_s=0.3", "--set", "gms.mu_s=0.2")
    data = described(capsys, "lugre", *settings, "--compare", "elasto_plastic", "--compare", "gms")
    assert [curve["law"] for curve in data["curves"]] == ["lugre", "elasto_plastic", "gms"]
    tops = [max(curve["columns"]["F"]) for curve in data["curves"]]
    assert tops == pytest.approx([0.3 * 7.848, 0.3 * 7.848, 0.2 * 7.848], rel=1e-3)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["lugre", "--figure", "histeresis"], "did you mean hysteresis?"),
        (["coulomb", "--figure", "lag"], "lag of coulomb: expected a law that shows"),
        (["--figure", "lag"], "expected the name of a law before it"),
        (["lugre", "--compare", "lugrr"], "did you mean lugre?"),
        (
            ["lugre", "--compare", "coulomb", "--set", "v_s=1"],
            "got v_s, which coulomb does not have; --set lugre.NAME=VALUE is for one law",
        ),
        (["lugre", "--compare", "coulomb", "--set", "gms.C=1"], "--set gms.C: expected one of"),
        (
            ["lugre", "--figure", "lag", "--normal-force", "0"],
            "--normal-force: expected a number > 0 [N], got 0.0",
        ),
    ],
)
def test_a_figure_that_cannot_be_is_refused_in_one_sentence(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["laws", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert said in err
    assert len(err.splitlines()) == 1


def test_what_the_numbers_give_away_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    assert "sigma_2 = 0 is below" in described(capsys, "lugre")["warnings"][0]
    assert described(capsys, "lugre", "--set", "sigma_2=100")["warnings"] == []
    assert main(["laws", "lugre"]) == 0
    assert "Warning: not passive from v to F" in capsys.readouterr().out


def test_the_list_is_one_line_a_law_in_eighty_columns(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["laws"]) == 0
    lines = capsys.readouterr().out.splitlines()
    table = lines[2 : lines.index("")]
    assert [line.split()[0] for line in table] == [*ALL_LAWS, *POPULATIONS]
    assert max(map(len, lines)) <= 80
