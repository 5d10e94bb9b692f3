"""Start up a slider-crank from rest to two turns a second in half a second, with least effort.

A crank of 80 mm drives a slider of 5 kg through a massless rod of 300 mm; a motor turns the crank.
The friction of the bearing of the crank depends on its reaction, which is an unknown of the
equations, and the rod closes a loop. The end condition is the speed of the crank.

The load of the bearing comes near zero, where its magnitude has a kink, which is smoothed over
`eps` = 0.5 N. The same problem is solved without friction.

    python examples/crank_start_up.py [OUT]
"""

import sys
from math import pi, sqrt
from pathlib import Path

from rich.console import Console
from rich.table import Table

from ocp import Phase, Problem, integral, solve
from symfric import BrownMcPhee, Model
from symfric.multibody import (
    Distance,
    JointFriction,
    JointSpringDamper,
    Mechanism,
    Prismatic,
    Revolute,
)

SPEED = 4 * pi  # rad/s
CRANK, ROD = 0.08, 0.3  # m


def machine(mu: float) -> Model:
    """Return the machine in the plane of x and z, with a vertical crank at the start."""
    law = BrownMcPhee(mu_s=1.3 * mu, mu_d=mu, v_t=1e-4)
    bearing = JointFriction(law, radius=0.05, length=0.1, eps=0.5) if mu else None
    m = Mechanism("slider_crank", gravity=(0.0, 0.0, -9.81))
    m.body("wheel", 0.5, (0.02, 0.02, 0.02))
    m.body("block", 5.0, (0.02, 0.02, 0.02))
    m.frame("ground.bearing", z=(0.0, 1.0, 0.0), x=(0.0, 0.0, 1.0))
    m.frame("wheel.bearing", z=(0.0, 1.0, 0.0), x=(0.0, 0.0, 1.0))
    m.frame("wheel.pin", at=(0.0, 0.0, CRANK))
    m.frame("ground.guide", z=(1.0, 0.0, 0.0))
    m.frame("block.guide", z=(1.0, 0.0, 0.0))
    m.joint(Revolute("crank", "ground.bearing", "wheel.bearing", friction=bearing))
    m.joint(Prismatic("slider", "ground.guide", "block.guide", sqrt(ROD**2 - CRANK**2)))
    m.joint(Distance("rod", "wheel.pin", "block", length=ROD))
    torque = m.input("torque", "N m", nominal=10.0)
    m.force(JointSpringDamper("motor", "crank", actuator=torque))
    return m.build()


def start_up(model: Model) -> Problem:
    """Return the problem of starting with least effort."""
    return Problem(
        Phase(model, T=0.5, end={"crank_rate": SPEED}),
        integral(lambda s: s.torque**2),
        bounds={"torque": (-60.0, 60.0)},
    )


def main(out: Path) -> None:
    """Solve with and without friction, print the costs, and draw."""
    table = Table("bearing", "J [(N m)^2 s]", "turned [rad]", "friction took [J]", "verified")
    for name, mu in (("smooth", 0.0), ("rough", 0.15)):
        best = solve(start_up(machine(mu)))
        runs = [] if best.verification is None else best.verification.trajectories
        lost = sum(float(run.integral("crank_power")[-1]) for run in runs) if mu else 0.0
        row = (f"{best.cost:.4f}", f"{best['crank'][-1]:.3f}", f"{lost:.4f}", str(best.verified))
        table.add_row(name, *row)
        shown = ("crank_rate", "slider", "torque", "crank_N")
        best.plot(*(n for n in shown if n in best.signals), path=out / f"crank_{name}.png")
    Console().print(table)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
