"""`symfric laws`."""

import json
from pathlib import Path
from typing import Any

import pytest
from tables import sampled

from identification import synthetic_drive_data
from symfric import Stribeck, law_from_text, parameters
from symfric.cli import laws as command
from symfric.cli.laws import parts
from symfric.figures import pictures
from symfric.laws import ALL_LAWS, POPULATIONS

EVERY = ALL_LAWS | POPULATIONS
PNG = b"\x89PNG\r\n\x1a\n"
LISTED = {
    "name", "states", "phenomena", "smoothness", "confidence", "checked", "source", "parameters",
    "instructions",
}  # fmt: skip


def test_the_list_has_a_line_and_an_object_for_every_law(symfric, monkeypatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(command, "ALL_LAWS", {name: ALL_LAWS[name] for name in ("lugre", "coulomb")})
        lines = symfric("laws").out.splitlines()
    listed = [line.split()[0] for line in lines[2 : lines.index("")]]
    assert listed == ["lugre", "coulomb", *POPULATIONS]
    laws = {law["name"]: law for law in symfric("laws --json -").json["laws"]}
    assert list(laws) == list(EVERY)
    assert laws["lugre"]["states"] == {"z": "m"}
    assert list(laws["lugre"]["phenomena"]) == ["D", "S", "St", "V", "P", "L", "B"]
    for law in laws.values():
        assert set(law) >= LISTED
        assert min(law["instructions"].values()) > 0
    # value: v, sigma_2, product, and its output; gradient: sigma_2 alone, and its output
    assert laws["viscous"]["instructions"]["value"] > laws["viscous"]["instructions"]["gradient"]


@pytest.mark.parametrize("name", sampled(EVERY, of=5))
def test_one_law_shows_equation_source_and_parameters(
    name: str, symfric, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    out = symfric(f"laws {name}").out
    assert all(part in out for part in ("F ", "Limits:", "Source:"))
    assert f"Formula: {EVERY[name].facts.formula}." in " ".join(out.split())  # as wrapped
    table = out[out.index("parameter ") :].splitlines()
    for parameter in parameters(EVERY[name]()).values():
        row = next(line for line in table if line.startswith(f"{parameter.name} "))
        assert parameter.unit in row
        assert parameter.doc.split()[0] in row


def test_parameters_options_and_warnings_are_those_of_the_numbers(symfric) -> None:
    law = symfric("laws lugre --set mu_s=0.3 --json -").json
    mu_s = law["parameters"]["mu_s"]
    assert (mu_s["value"], mu_s["unit"], mu_s["lower"], mu_s["upper"]) == (0.3, "1", 0.0, None)
    assert "sigma_2 = 0 is below" in law["warnings"][0]
    assert symfric("laws lugre --set sigma_2=100 --json -").json["warnings"] == []
    assert "Warning: not passive from v to F" in symfric("laws lugre").out
    law = symfric("laws coulomb --set shape=atan --set mu_d=0.3 --json -").json
    assert law["options"]["shape"]["value"] == "atan"
    assert law["parameters"]["mu_d"]["value"] == 0.3
    law = symfric("laws 'asymmetric(coulomb+viscous)' --set sigma_2_pos=7 --json -").json
    assert law["parameters"]["sigma_2_pos"]["value"] == 7.0
    assert list(law["phenomena"]) == ["D", "V"]
    assert "F = sigma_2 v" in law["doc"]
    kinds = [kind.__name__ for kind in parts(law_from_text("asymmetric(coulomb+viscous)"))]
    assert kinds == ["Asymmetric", "Sum", "Coulomb", "Viscous"]
    out = symfric("laws karnopp").out
    assert "F_e" in out[out.index("input ") :]
    assert "smooth, original, event" in out[out.index("option ") :]


def test_pictures_are_drawn_with_the_load(symfric, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = list[Any]()

    def draw(laws: dict[str, Any], load: float, path: Path) -> None:
        drawn.append((list(laws), load, path))

    monkeypatch.setattr(pictures, "plot_catalogue", draw)
    monkeypatch.setattr(pictures, "plot_laws", draw)
    for line in ("laws --plot x.png", "laws lugre --normal-force 5 --plot x.png"):
        assert symfric(line).err == "wrote x.png\n"
    assert drawn == [([*EVERY], 1.0, Path("x.png")), (["lugre"], 5.0, Path("x.png"))]


def test_a_figure_is_drawn_summarised_and_given_as_data(symfric) -> None:
    printed = symfric("laws maxwell_slip --figure hysteresis --plot h.png --json h.json")
    rows = [line.split() for line in printed.out.splitlines()]
    last = next(row for row in rows if row[:3] == ["maxwell_slip,", "20x", "F"])
    assert last[3] == "N"
    assert list(map(float, last[4:])) == pytest.approx((-0.7, 0.75), abs=0.1)
    assert printed.err == "wrote h.png, h.json\n"
    assert Path("h.png").read_bytes().startswith(PNG)
    data = json.loads(Path("h.json").read_text())
    assert data["name"] == "hysteresis"
    assert [curve["case"] for curve in data["curves"]] == ["1x", "5x", "20x"]
    assert data["units"]["x"] == "m"


def test_settings_hold_for_all_compared_laws_or_for_the_named_one(symfric) -> None:
    others = "--compare elasto_plastic --compare gms"
    data = symfric(f"laws lugre --set gms.mu_s=0.2 --set mu_s=0.3 {others} --json -").json
    assert [curve["law"] for curve in data["curves"]] == ["lugre", "elasto_plastic", "gms"]
    tops = [max(curve["columns"]["F"]) for curve in data["curves"]]
    assert tops == pytest.approx([0.3 * 7.848, 0.3 * 7.848, 0.2 * 7.848], rel=1e-3)


OWN = """
from symfric import Exact, StaticLaw
from symfric.laws import smooth

class Falling(StaticLaw):
    'Friction that decreases with the speed.'
    def outside(self, speed, N):
        return 0.3 * N / (1 + speed)
    def force(self, v, N, z=()):
        return self.outside(smooth.magnitude(v, 1e-3), N) * smooth.sign(v, 1e-3)

stick = Exact(Falling())
"""
LAW_COMMANDS = {
    "laws LAW": "Friction that decreases with the speed.",
    "run rabinowicz --law LAW --t-end 1": "The end was reached",
    "scenes rabinowicz --law LAW": "v_belt",
    "codegen LAW --real double --out c": "verified",
    "export-fmu rabinowicz --law LAW": "FMI 3.0 co-simulation",
    "identify record.csv --law LAW+viscous --fix m=95": "sigma_2",
    "select rabinowicz --law LAW,stribeck --need stiction --accuracy 0.1 --t-end 2 --workers 1 "
    "--no-fixed-steps": "LAW",
}


@pytest.mark.parametrize("line", LAW_COMMANDS)
def test_every_command_accepts_a_law_of_a_file(line: str, symfric) -> None:
    Path("own.py").write_text(OWN)
    if line.startswith("identify"):
        data = synthetic_drive_data(Stribeck(mu_s=25.0, mu_d=20.0), speeds=(0.06,), dwell=0.1)
        data.to_csv("record.csv")
    found = symfric(line.replace("LAW", "own.py:Falling"))
    assert LAW_COMMANDS[line].replace("LAW", "own.py:Falling") in found.out


def test_laws_of_files_can_be_wrapped_and_added(symfric) -> None:
    Path("own.py").write_text(OWN)
    finals = [
        symfric(f"run rabinowicz --law '{text}' --json -").json["final"]["x"]
        for text in ("own.py:stick", "exact(own.py:Falling)", "exact( own.py:Falling )")
    ]
    assert len(set(finals)) == 1
    both = symfric("run rabinowicz --law own.py:Falling+viscous --set sigma_2=2 --json -").json
    assert both["parameters"]["sigma_2"] == 2.0
