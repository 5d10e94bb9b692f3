"""Move a mass with friction 1 m out and back in 2 s with least effort.

    m v' = force - F(v),   m = 1 kg,   |force| <= 20 N,   J = integral of force^2

F is dry friction, 6 N to break away, 4 N while sliding, and 0.5 N s/m. There are two phases of 1 s
each. The solver finds when the mass sticks, and verifies it by simulation. With exact Coulomb
friction the mass turns without a rest, and the optimum is known in closed form:

    J = 40 + 0.5 / (1 - 4 tanh(1/4)) N^2 s

    python examples/out_and_back.py [OUT]
"""

import sys
from math import tanh
from pathlib import Path

from rich.console import Console
from rich.table import Table

from ocp import Phase, Problem, Solution, integral, solve
from symfric import BrownMcPhee, drive

EXACT = 40 + 0.5 / (1 - 4 * tanh(0.25))
FRICTION = BrownMcPhee(mu_s=6.0, mu_d=4.0, v_t=1e-5, mu_v=0.5)  # with N = 1 N these are newtons


def problem() -> Problem:
    """Return the problem of two phases."""
    stage = drive(FRICTION, m=1.0, N=1.0)
    out = Phase(stage, T=1.0, start={"x": 0.0, "v": 0.0}, end={"x": 1.0}, name="out")
    back = Phase(stage, T=1.0, end={"x": 0.0, "v": 0.0}, name="back")
    return Problem(out >> back, integral(lambda s: s.force**2), bounds={"force": (-20.0, 20.0)})


def modes(best: Solution) -> Table:
    """Return the contact modes over time."""
    table = Table("contact", "mode", "from [s]", "to [s]")
    for contact, parts in best.modes.items():
        for mode in parts:
            table.add_row(contact, mode.kind, f"{mode.begin:.4f}", f"{mode.end:.4f}")
    return table


def main(out: Path) -> None:
    """Solve, print and draw."""
    best = solve(problem())
    print(best.message)
    Console().print(modes(best))
    print(f"J = {best.cost:.4f} N^2 s, exact {EXACT:.4f}; verified: {best.verified}")
    best.plot("x", "v", "force", path=out / "out_and_back.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
