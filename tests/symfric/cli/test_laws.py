"""`symfric laws`."""

import json
from pathlib import Path
from typing import Any

import pytest

from symfric import ALL_LAWS, law_from_text, parameters
from symfric.cli import main
from symfric.cli.laws import instructions, parts

PNG = b"\x89PNG\r\n\x1a\n"


def described(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    assert main(["laws", *arguments, "--json", "-"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    return json.loads(out)


def test_the_list_names_every_law_and_parameter(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["laws"]) == 0
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= 80
    for name, kind in ALL_LAWS.items():
        assert name in out
        assert all(f"{p} = " in " ".join(out.split()) for p in parameters(kind()))


@pytest.mark.parametrize("name", ALL_LAWS)
def test_one_law_shows_equation_source_and_parameters(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["laws", name]) == 0
    out = capsys.readouterr().out
    assert "F " in out
    assert "Limits:" in out
    assert "Source:" in out
    table = out[out.index("parameter ") :].splitlines()
    for parameter in parameters(ALL_LAWS[name]()).values():
        row = next(line for line in table if line.startswith(f"{parameter.name} "))
        assert parameter.unit in row
        assert parameter.doc.split()[0] in row


def test_the_json_of_the_list_holds_every_law(capsys: pytest.CaptureFixture[str]) -> None:
    laws = described(capsys)["laws"]
    assert list(laws) == list(ALL_LAWS)
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


def test_viscous_friction_costs_a_constant_and_a_product() -> None:
    # inputs v and N and z, sigma_2, product, output of force; N and z are not read
    assert instructions(law_from_text("viscous")) == 4


@pytest.mark.parametrize("arguments", [["lugre"], [], ["asymmetric(stribeck)"], ["viscous"]])
def test_the_picture_is_a_png(arguments: list[str], tmp_path: Path) -> None:
    path = tmp_path / "laws.png"
    assert main(["laws", *arguments, "--plot", str(path)]) == 0
    assert path.read_bytes().startswith(PNG)
