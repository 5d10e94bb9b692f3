"""Choose the spring of a feeder together with its stroke.

    m v' = force - k x - F(v),   m = 2 kg,   F = 2 N sliding, 3 N to break away

The feeder moves periodically from -50 mm to 50 mm and back in 0.5 s. With the right spring the mass
oscillates freely and the motor overcomes friction only. Without friction, the spring with k = m (2
pi / T)^2 requires no force. With friction, which is equal in both directions, the best spring is
nearly the same. The cost of the stroke is 8 F^2 T / pi^2 if the motion is harmonic, and slightly
less otherwise.

    python examples/co_design.py [OUT]
"""

import sys
from dataclasses import replace
from math import pi
from pathlib import Path

import casadi as ca
from rich.console import Console
from rich.table import Table

from ocp import Phase, Problem, integral, solve
from symfric import BrownMcPhee, Contact, Model, Variable

M, T, STROKE = 2.0, 0.5, 0.05
RESONANCE = M * (2 * pi / T) ** 2
PRICE = 8 * 2.0**2 * T / pi**2
LAW = BrownMcPhee(mu_s=0.15, mu_d=0.1, v_t=1e-5)


def feeder() -> Model:
    """A mass on a spring with friction; the stiffness is a parameter."""
    x, v = Variable("x", "m", nominal=0.05), Variable("v", "m/s", nominal=0.5)
    force = Variable("force", "N", nominal=10.0)
    k = Variable("k", "N/m", start=100.0, nominal=300.0, lower=0.0)
    rail = Contact("rail", slip=v, N=20.0, law=LAW)
    pushed = force - k * x - rail.force
    return Model(
        "feeder",
        x=(x, v),
        u=(force,),
        p=(k,),
        ode=ca.vertcat(v, pushed / M),
        contacts=(rail,),
    )


def problem() -> Problem:
    """One period of least effort, and the spring for it."""
    left, right = {"x": -STROKE, "v": 0.0}, {"x": STROKE, "v": 0.0}
    stroke = Phase(feeder(), T, start=left, via={0.5: right})
    return Problem(
        stroke,
        integral(lambda s: s.force**2),
        choose={"k": (10.0, 1e4)},
        periodic=["x", "v"],
        bounds={"force": (-200.0, 200.0)},
    )


def main(out: Path) -> None:
    """Compare the best spring with three others."""
    chosen = problem()
    best = solve(chosen)
    table = Table("spring [N/m]", "J [N^2 s]", "verified")
    table.add_row(f"{best.chosen['k']:.2f}, chosen", f"{best.cost:.4f}", str(best.verified))
    for k in (100.0, 250.0, 400.0):
        other = solve(replace(chosen, choose={}, p={"k": k}))
        table.add_row(f"{k:.2f}", f"{other.cost:.4f}", str(other.verified))
    Console().print(table)
    print(f"in resonance: {RESONANCE:.2f} N/m, {PRICE:.4f} N^2 s")
    best.plot("x", "v", "force", path=out / "co_design.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
