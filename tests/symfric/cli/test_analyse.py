"""`symfric analyse`: branches over a parameter on the command line."""

import json
from pathlib import Path

import pytest

from symfric.dynamics import load_branch

MACHINE = """
import casadi as ca
from symfric import Model, Variable

x, y, p = Variable("x", "m", start=1.0), Variable("y", "m"), Variable("p", "1", start=1.0)


def ring(law):
    radial = p - x**2 - y**2
    rates = ca.vertcat(x * radial - 2 * y, y * radial + 2 * x)
    return Model("ring", x=(x, y), p=(p,), ode=rates)
"""


def test_a_run_leads_to_the_grazing(symfric) -> None:
    line = "analyse rabinowicz --law exact_coulomb --set sigma_2=0.1 --over v_belt=0.3:0.45"
    out = symfric(f"{line} --longest 0.1 --plot p.png --html p.html --save b.npz --json b.json").out
    assert "grazing" in out and "0.39024" in out
    branch = load_branch("b.npz")
    assert branch.special[0].kind == "grazing" and Path("p.png").stat().st_size > 1000
    page = Path("p.html").read_text(encoding="utf-8")
    assert "0.3902" in page and "data:image/png" in page and "<h2>branch of" in page
    (found,) = json.loads(Path("b.json").read_text(encoding="utf-8"))["branches"]
    assert found["special"][0]["value"] == pytest.approx(branch.special[0].value, rel=1e-12)
    assert found["values"] == branch.values.tolist() and found["kind"] == "orbits"


def test_an_equilibrium_of_a_file_leads_to_its_orbits(symfric) -> None:
    Path("ring.py").write_text(MACHINE, encoding="utf-8")
    line = "analyse ring.py:ring --law viscous --over p=-1:1 --from equilibrium --x0 x=0"
    rest, orbits = json.loads(symfric(f"{line} --points 30 --json -").out)["branches"]
    assert [s["kind"] for s in rest["special"]] == ["Hopf"] and orbits["kind"] == "orbits"
    assert orbits["high"][-1][0] == pytest.approx(orbits["values"][-1] ** 0.5, rel=1e-4)
