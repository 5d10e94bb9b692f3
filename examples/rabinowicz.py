"""Stick-slip of a block on a belt with two friction laws.

    m x'' = -k x - F(x' - v_belt),   m = 0.8 kg, k = 2.1 N/m, belt 0.1 m/s

The belt carries the block until the spring overcomes static friction; then the block slips back.
With coefficients of dry friction of 0.15 (static) and 0.1 (dynamic) the period is 6.069995 s, and
the largest elongation is 0.570501 m. The smooth law creeps instead of sticking and breaks away
late. The Stribeck curve of LuGre falls from rest on, so it breaks away early.

    python examples/rabinowicz.py [OUT]
"""

import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from symfric import BrownMcPhee, LuGre, Trajectory, rabinowicz, simulate
from symfric.results.pictures import plot_trajectories


def period(motion: Trajectory) -> float:
    """Return the mean time between the passages of x through 0.4 m on the way back [s]."""
    x, t = motion["x"], motion.t
    k = np.flatnonzero((x[:-1] > 0.4) & (x[1:] <= 0.4))
    passages = t[k] + (t[k + 1] - t[k]) * (x[k] - 0.4) / (x[k] - x[k + 1])
    return float(np.diff(passages).mean())


def main(out: Path) -> None:
    """Simulate, print, and write a picture and a table of signals into `out`."""
    laws = {"Brown-McPhee": BrownMcPhee(), "LuGre": LuGre()}
    motions = {name: simulate(rabinowicz(law), t_end=40.0) for name, law in laws.items()}
    result = Table("law", "period [s]", "greatest x [m]", "steps")
    for name, motion in motions.items():
        greatest = f"{motion['x'].max():.6f}"
        result.add_row(name, f"{period(motion):.4f}", greatest, str(motion.statistics.steps))
    Console().print(result)
    plot_trajectories(motions, ["x", "v", "friction"], out / "stick_slip.png")
    motions["LuGre"].to_csv(out / "stick_slip.csv")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
