"""`symfric select` on the command line."""

import json
from pathlib import Path

import pytest

from symfric.cli.app import main

FILE = """
import casadi as ca
from symfric import Model, Variable
from symfric.scenes.base import contact

def machine(law, m=2.0):
    x, v = Variable("x", "m", nominal=0.1), Variable("v", "m/s", start=0.5, nominal=0.1)
    guide = contact("guide", law, v.symbol, 20.0, rest={"v": 0.0}, F_e=-30 * x.symbol)
    rate = (-30 * x.symbol - guide.force) / m
    return Model("press", x=(x, v), ode=ca.vertcat(v.symbol, rate), contacts=(guide,))

number = 3
"""
FAST = ["--no-fixed-steps", "--workers", "1", "--accuracy", "0.02"]


def test_a_scene_with_parameters_gives_table_and_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    json_file, page, sheet = (tmp_path / f"c.{kind}" for kind in ("json", "html", "csv"))
    status = main(
        ["select", "rabinowicz", "--law", "stribeck", "--law", "coulomb", "--set", "mu_s=0.2",
         "--set", "m=1", "--set", "stribeck.delta=1", "--t-end", "8", *FAST,
         "--json", str(json_file), "--html", str(page), "--csv", str(sheet)]
    )  # fmt: skip
    said = capsys.readouterr()
    assert status == 0
    assert max(len(line) for line in said.out.splitlines()) <= 80
    assert "mu_s = 0.2, mu_d = 0.1" in said.out
    assert "Simulation: take stribeck" in said.out
    assert json.loads(json_file.read_text(encoding="utf-8"))["best"] == "stribeck"
    assert page.stat().st_size > 10_000
    assert sheet.read_text(encoding="utf-8").startswith("law,")


def test_what_a_scene_is_made_of_is_set_beside_its_numbers(
    capsys: pytest.CaptureFixture[str],
) -> None:
    asked = ["select", "drive", "--law", "stribeck", "--t-end", "1", "--set", "m=2", *FAST]
    assert main([*asked, "--set", "turning=true"]) == 0
    assert "Simulation: take stribeck" in capsys.readouterr().out
    assert main([*asked, "--set", "turning=yes"]) == 2
    assert "--set turning: expected one of true, false" in capsys.readouterr().err


def test_a_function_in_a_file_is_a_machine(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "press.py"
    file.write_text(FILE, encoding="utf-8")
    asked = ["select", str(file), "--law", "stribeck", "--t-end", "1", *FAST]
    assert main([*asked, "--set", "m=3"]) == 0
    assert "press: laws that show" in capsys.readouterr().out
    assert main([*asked, "--set", "mm=3"]) == 2
    assert "did you mean m?" in capsys.readouterr().err
    assert main(["select", f"{file}:number", *FAST]) == 2
    assert "a function law -> Model" in capsys.readouterr().err
    assert main(["select", f"{file}:nothing", *FAST]) == 2
    assert "it holds" in capsys.readouterr().err


def test_forms_are_set_for_one_law_or_all(capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["select", "rabinowicz", "--law", "karnopp", "--t-end", "5", "--need", "", *FAST]

    def form(*given: str) -> str:
        assert main([*asked, *given, "--json", "-"]) == 0
        rows = json.loads(capsys.readouterr().out)["rows"]
        return next(row["form"] for row in rows if row["law"] == "karnopp")

    assert form() == ""
    assert form("--set", "karnopp.form=event") == "event"
    assert form("--law", "stribeck", "--set", "form=original") == "original"


def test_nothing_that_keeps_the_accuracy_is_a_failure(capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["select", "rabinowicz", "--law", "coulomb", "--need", "", "--t-end", "8", *FAST]
    assert main(asked) == 1
    assert "coulomb comes nearest" in capsys.readouterr().err


def test_what_is_meant_is_asked_before_anything_runs(capsys: pytest.CaptureFixture[str]) -> None:
    for given, said in (
        (["--need", "stictoin"], "expected some of sliding, stiction"),
        (["--law", "lugrr"], "did you mean lugre"),
        (["--set", "lugre.sigma=1", "--law", "lugre"], "got sigma"),
        (["--set", "gms.form=evnt"], "expected one of smooth, event, got 'evnt'"),
        (["--set", "form=evnt"], "did you mean event"),
        (["--set", "lugre.sigma_1=stiff"], "expected a finite number, got 'stiff'"),
        (["--set", "mus=1"], "did you mean mu_s"),
        (["--preset", "nobody"], "jing_mi_table_3"),
        (["--paper", "--law", "lugre"], "--paper: expected no option but --json"),
        (["--plot", "c.doc"], "expected a picture ending in"),
    ):
        assert main(["select", "rabinowicz", *given]) == 2, given
        assert said in capsys.readouterr().err, given
    assert main(["select", "drive", "--paper"]) == 2
    assert "expected one of rabinowicz, pendulum_box" in capsys.readouterr().err
