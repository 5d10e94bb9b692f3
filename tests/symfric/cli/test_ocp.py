"""`symfric ocp`: ready problems and those of a user's file."""

import csv
import json
from pathlib import Path

import pytest

from ocp import Legendre, Radau, Shooting, load
from ocp.problems import READY
from symfric.cli import ocp as command
from symfric.cli.ocp import scheme_of


def test_a_problem_of_a_file_is_solved_and_written(symfric, mine) -> None:
    """A mass of 1 kg over 1 m from rest to rest in T: J = 12 / T^3."""
    line = "ocp mine.py --set T=2 --intervals 5"
    printed = symfric(f"{line} --csv a.csv --save a.npz --plot a.png --json a.json")
    assert printed.err == "wrote a.csv, a.npz, a.png, a.json\n"
    assert "verified" in printed.out
    assert "yes" in printed.out
    assert "difference" not in printed.out
    found = json.loads(Path("a.json").read_text())
    assert found["cost"] == pytest.approx(12 / 8, rel=1e-3)
    assert found["verification"]["ok"]
    rows = list(csv.reader(Path("a.csv").read_text().splitlines()))
    assert rows[0][:3] == ["t [s]", "x [m]", "v [m/s]"]
    assert load("a.npz").cost == found["cost"]
    assert Path("a.png").stat().st_size > 1000
    by = symfric("ocp mine.py --intervals 5 --sensitivity 'x at the end,T' --json -").json
    assert by["sensitivities"]["x at the end"]["dJ"] == pytest.approx(2 * by["cost"])
    assert by["sensitivities"]["T"]["dJ"] == pytest.approx(-3 * by["cost"])
    again = symfric("ocp mine.py:problem --set T=2 --guess a.npz --scheme legendre2 --json -").json
    assert again["cost"] == pytest.approx(12 / 8, rel=1e-3)


def test_a_soft_end_of_a_file_is_shown(symfric, tmp_path, monkeypatch) -> None:
    """J = 12 x^2 + 3 (1 - x) has its least value at x = 1/8."""
    monkeypatch.chdir(tmp_path)
    Path("wall.py").write_text(
        "from ocp import Phase, Problem, integral, soft\n"
        "import casadi as ca\nfrom symfric import Model, Variable\n"
        "wall = soft(lambda s: s.x == 1.0, linear=3.0)\n"
        "x, v, force = (Variable(name, '') for name in ('x', 'v', 'force'))\n"
        "model = Model('mass', x=(x, v), u=(force,), ode=ca.vertcat(v, force))\n"
        "phase = Phase(model, 1.0, end={'v': 0.0}, at={1: [wall]})\n"
        "problem = Problem(phase, integral(lambda s: s.force**2))\n"
    )
    shown = symfric("ocp wall.py --intervals 10").out
    assert "condition 1 at the end" in shown
    assert "2.625" in shown
    assert "0.875" in shown
    found = symfric("ocp wall.py --intervals 10 --json -").json
    assert found["soft"]["condition 1 at the end"]["violation"] == pytest.approx(0.875, rel=1e-3)


def test_options_are_the_arguments_of_solve(symfric, monkeypatch: pytest.MonkeyPatch) -> None:
    def solve(problem: object, **given: object) -> None:
        seen.update(given)
        raise ValueError("enough")

    seen: dict[str, object] = {}
    monkeypatch.setattr(command, "solve", solve)
    options = "--intervals 7 --tolerance 0.1 --resting-margin 0.002 --max-time 3 --solver sqp"
    options += " --starts 4 --no-refine --no-verify"
    symfric(f"ocp out_and_back --scheme radau5 --friction smooth {options}", 2)
    del seen["progress"]
    assert str(seen.pop("solver")).startswith("Sqp")
    assert seen == {
        "scheme": Radau(5), "friction": "smooth", "tolerance": 0.1, "resting_margin": 0.002,
        "intervals": 7, "max_time": 3.0, "guess": None, "throw": False,
        "starts": 4, "executor": None, "refine": False, "verify": False,
    }  # fmt: skip


def test_a_ready_problem_is_compared_with_its_best_known_cost(symfric) -> None:
    assert "difference" in symfric("ocp bryson_denham --intervals 8").out
    out = symfric("ocp").out
    assert all(name in out for name in READY)


def test_names_of_schemes() -> None:
    assert scheme_of("radau") == Radau(3)
    assert scheme_of("radau5") == Radau(5)
    assert scheme_of("legendre2") == Legendre(2)
    assert scheme_of("shooting") == Shooting("rodas5p")
    assert scheme_of("shooting:exponential:4") == Shooting("exponential", 4)
