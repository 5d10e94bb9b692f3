"""Command lines, run in an empty folder that is as wide as a small terminal."""

import json
import os
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from symfric.cli import main
from symfric.codegen import runner, verification

MINE = """
import casadi as ca
from ocp import Phase, Problem, integral
from symfric import LuGre, Model, Variable, drive
from symfric.scenes.base import contact

def model(m=0.5):
    return drive(LuGre(), m=m, free=["mu_s"])
stiff = model(2.0)

def problem(T=1.0):
    x, v, f = Variable("x", "m"), Variable("v", "m/s"), Variable("force", "N")
    cart = Model("cart", x=(x, v), u=(f,), ode=ca.vertcat(v.symbol, f.symbol))
    return Problem(Phase(cart, T, end={"x": 1.0, "v": 0.0}), integral(lambda s: s.force**2))
short = problem(0.5)

def machine(law, m=2.0):
    x, v = Variable("x", "m", nominal=0.1), Variable("v", "m/s", start=0.5, nominal=0.1)
    guide = contact("guide", law, v.symbol, 20.0, rest={"v": 0.0}, F_e=-30 * x.symbol)
    rate = (-30 * x.symbol - guide.force) / m
    return Model("press", x=(x, v), ode=ca.vertcat(v.symbol, rate), contacts=(guide,))

def endless(): return endless()
number = 3
"""


class Said(NamedTuple):
    """Output of a command."""

    out: str
    err: str

    @property
    def json(self) -> Any:
        assert self.err == ""
        return json.loads(self.out)


Call = Callable[..., Said]


@pytest.fixture(autouse=True)
def few_steps_verified(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runner, "FLAGS", ("-std=c99", "-O0", "-ffp-contract=off"))
    monkeypatch.setattr(verification, "STEPS", 1000)
    monkeypatch.setattr(verification, "FEWER", 200)


@pytest.fixture
def symfric(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Call:
    """A function of a command line and its expected exit status."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")

    def call(line: str, status: int = 0) -> Said:
        capsys.readouterr()
        found = main(shlex.split(line))
        out, err = capsys.readouterr()
        assert found == status, (line, out[-500:], err)
        if not out.startswith("{"):
            widest = max(map(len, out.splitlines()), default=0)
            assert widest <= int(os.environ["COLUMNS"]), out
        return Said(out, err)

    return call


@pytest.fixture
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A Python file of a user in the current folder."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "mine.py"
    path.write_text(MINE, encoding="utf-8")
    return path
