"""`symfric export-fmu` on the command line."""

import json
from zipfile import ZipFile

import pytest
from backends import needs_compiler

from symfric.cli import main

FILE = """
from symfric import LuGre, drive
def model(m=0.5):
    return drive(LuGre(), m=m, free=["mu_s"])
stiff = model(2.0)
number = 3
def endless(): return endless()
"""


@needs_compiler
def test_a_scene_becomes_a_unit(tmp_path, capsys):
    target = tmp_path / "drive.fmu"
    line = ["export-fmu", "drive", "--law", "brown_mcphee", "--set", "m=2", "--free", "m"]
    assert main([*line, "--fmi", "2", "--out", str(target), "--json", "-"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["fmi"] == 2
    assert {n for n, v in told["variables"].items() if v["causality"] == "parameter"} == {
        "m",
        "rtol",
    }
    assert {"modelDescription.xml", "sources/all.c"} <= set(ZipFile(target).namelist())


@needs_compiler
def test_a_file_of_python_becomes_a_unit(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(FILE)
    assert main(["export-fmu", "mine.py", "--set", "m=3"]) == 0
    assert (tmp_path / "drive.fmu").is_file()
    assert "FMI 3.0 co-simulation" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("drive", "--law NAME"),
        ("drivee --law lugre", "did you mean drive"),
        ("drive --law lugre --free zzz", "zzz"),
        ("drive --law lugre --fmi 4", "expected 2 or 3"),
        ("drive --law lugre --out x.zip", "ends in .fmu"),
        ("drive --law lugre --rtol 1", "rtol"),
        ("drive --law lugre --kind other", "co-simulation, model-exchange"),
        ("drive --law lugre --step-size -1", "step"),
        ("drive --law lugre --method exponential", "method"),
        ("drive --law exact_coulomb --step-size 0.001", "without events"),
        ("none.py", "does not exist"),
        ("mine.py:other", "it holds model, stiff"),
        ("mine.py:number", "a Model"),
        ("mine.py:stiff --set m=1", "no function"),
        ("mine.py --law lugre", "--law"),
        ("mine.py:endless", "got RecursionError in line 7 of 'mine.py'"),
        ("drive --law lugre --name a;b", "expected a C identifier, got 'a;b'; write a_b"),
    ],
)
def test_what_cannot_be_a_unit_is_refused(line, expected, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(FILE)
    assert main(["export-fmu", *line.split()]) == 2
    assert expected in capsys.readouterr().err
    assert not list(tmp_path.glob("*.fmu"))
