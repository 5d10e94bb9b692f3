"""Ready problems and files of a user on the command line."""

import csv
import json
from inspect import signature
from pathlib import Path
from typing import Any

import pytest

from ocp import Legendre, Problem, Radau, Shooting, Solution, load, solve
from ocp.problems import READY
from symfric.cli import ocp as command
from symfric.cli.app import main
from symfric.cli.ocp import scheme_of

FILE = """
from ocp import Phase, Problem, integral
from symfric import Model, Variable
import casadi as ca

def problem(T=1.0):
    x, v, f = Variable("x", "m"), Variable("v", "m/s"), Variable("force", "N")
    cart = Model("cart", x=(x, v), u=(f,), ode=ca.vertcat(v.symbol, f.symbol))
    return Problem(Phase(cart, T, end={"x": 1.0, "v": 0.0}), integral(lambda s: s.force**2))

short = problem(0.5)
number = 3
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "cart.py"
    path.write_text(FILE)
    return path


def test_list_of_ready_problems(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["ocp"]) == 0
    said = capsys.readouterr().out
    assert all(name in said for name in READY)


def test_problem_of_a_file(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A mass of 1 kg over 1 m from rest to rest in T: J = 12 / T^3."""
    outputs = [str(file.parent / name) for name in ("a.csv", "a.npz", "a.png")]
    where = ["--csv", outputs[0], "--save", outputs[1], "--plot", outputs[2]]
    assert main(["ocp", str(file), "--set", "T=2", "--json", "-", *where]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["cost"] == pytest.approx(12 / 8, rel=1e-3)
    assert found["verification"]["ok"]
    rows = list(csv.reader(Path(outputs[0]).read_text().splitlines()))
    assert rows[0][:3] == ["t [s]", "x [m]", "v [m/s]"]
    assert load(outputs[1]).cost == found["cost"]
    assert Path(outputs[2]).stat().st_size > 1000
    again = ["--guess", outputs[1], "--json", "-", "--scheme", "legendre2"]
    assert main(["ocp", f"{file}:problem", "--set", "T=2", *again]) == 0
    assert json.loads(capsys.readouterr().out)["cost"] == pytest.approx(12 / 8, rel=1e-3)


def test_resting_margin_is_that_of_solve(
    file: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[float] = []

    def watched(problem: Problem, **arguments: Any) -> Solution:
        seen.append(arguments["resting_margin"])
        return solve(problem, **arguments)

    monkeypatch.setattr(command, "solve", watched)
    assert main(["ocp", f"{file}:short"]) == 0
    assert main(["ocp", f"{file}:short", "--resting-margin", "0.002"]) == 0
    assert seen == [signature(solve).parameters["resting_margin"].default, 0.002]
    assert main(["ocp", f"{file}:short", "--resting-margin", "0.5"]) == 2
    assert "--resting-margin: expected" in capsys.readouterr().err


def test_table_tells_what_was_checked(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["ocp", f"{file}:short"]) == 0
    said = capsys.readouterr().out
    assert "verified" in said
    assert "yes" in said


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["out_and_bakc"], "did you mean out_and_back"),
        (["{file}:number"], "a Problem, or a function that returns one"),
        (["{file}:none"], "it holds problem, short"),
        (["{folder}/gone.py"], "does not exist"),
        (["{file}:short", "--set", "T=2"], "which is no function"),
        (["{file}", "--set", "t=2"], "expected one of T"),
        (["{file}", "--scheme", "gauss3"], "radau3, legendre4 or shooting"),
        (["{file}", "--solver", "snopt"], "expected one of ipopt"),
        (["{file}", "--friction", "none"], "expected one of auto"),
        (["{file}", "--tolerance", "-1"], "tolerance"),
        (["{file}", "--guess", "{file}"], "cart.py"),
    ],
)
def test_bad_lines(
    arguments: list[str], said: str, file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["ocp", *(a.format(file=file, folder=file.parent) for a in arguments)]) == 2
    assert said in capsys.readouterr().err


def test_file_that_fails_is_named_with_its_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "broken.py"
    path.write_text("a = 1\nb = a / 0\n")
    assert main(["ocp", str(path)]) == 2
    assert "ZeroDivisionError in line 2" in capsys.readouterr().err


def test_names_of_schemes() -> None:
    assert scheme_of("radau") == Radau(3)
    assert scheme_of("radau5") == Radau(5)
    assert scheme_of("legendre2") == Legendre(2)
    assert scheme_of("shooting:exponential:4") == Shooting("exponential", 4)
