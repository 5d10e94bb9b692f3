"""Move a mass with friction over 1 m from rest to rest: as fast as possible, and with least effort.

    m v' = force - F(v),   m = 1 kg,   |force| <= 20 N

F is Brown-McPhee friction: 6 N to break away, 4 N while sliding. Effort is the integral of force^2;
friction makes waiting expensive, so there is a best time for it. Every control is then simulated:
the last column says by how much the mass really misses, relatively.

    python examples/optimal_move.py [OUT]
"""

import sys
from dataclasses import replace
from pathlib import Path

from rich.console import Console
from rich.table import Table

from ocp import TIME, Free, Phase, Problem, Solution, integral, plot_solutions, solve
from symfric import BrownMcPhee, drive


def problems() -> dict[str, Problem]:
    """The moves by name."""
    friction = BrownMcPhee(mu_s=6.0, mu_d=4.0, v_t=1e-5)  # with N = 1 N these are newtons
    move = Phase(drive(friction, m=1.0, N=1.0), T=1.0, end={"x": 1.0, "v": 0.0})
    free = replace(move, T=Free(0.1, 10.0, guess=1.0))
    gentle = Problem(move, integral(lambda s: s.force**2), bounds={"force": (-20.0, 20.0)})
    return {
        "fastest": replace(gentle, phases=free, cost=TIME),
        "least effort, T given": gentle,
        "least effort, T free": replace(gentle, phases=free),
    }


def table(moves: dict[str, Solution]) -> Table:
    """A row a move."""
    result = Table("move", "status", "iterations", "T [s]", "cost", "miss")
    for name, move in moves.items():
        result.add_row(
            name,
            move.status.name,
            str(move.iterations),
            f"{move.T:.4f}",
            f"{move.cost:.4f}",
            f"{move.miss:.1e}",
        )
    return result


def main(out: Path) -> None:
    """Solve, print, and write pictures and data into `out`."""
    moves = {name: solve(problem) for name, problem in problems().items()}
    Console().print(table(moves))
    plot_solutions(moves, ["x", "v", "force", "friction"], out / "optimal_moves.png")
    moves["fastest"].plot(path=out / "fastest_move.png")
    moves["fastest"].to_csv(out / "fastest_move.csv")
    moves["fastest"].to_json(out / "fastest_move.json")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
