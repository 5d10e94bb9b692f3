"""Friction losses in the bearings of a crank press at constant speed.

    crank 60 mm, connecting rod 250 mm, slide 40 kg, one stroke a second;
    the blank resists with 60 kN over the last 8 mm of the way down

The friction of every bearing depends on its reaction, which is many times larger while the blank
resists. The usual estimate assumes the mean load of a bearing; the last column shows its result.
Writes torque and losses over the angle of the crank, and an animation of one stroke.

    python examples/press.py [OUT]
"""

import sys
from pathlib import Path

import casadi as ca
import numpy as np
from rich.console import Console
from rich.table import Table

from symfric import BrownMcPhee, Trajectory, simulate
from symfric.foundation.panels import panels, save
from symfric.foundation.style import line
from symfric.multibody import (
    JointFriction,
    Kinematics,
    Mechanism,
    PointOnLine,
    PrescribedMotion,
    Prismatic,
    Revolute,
    UserForce,
)
from symfric.multibody.spatial import Vector

R, L, OMEGA, FORCE, DEPTH = 0.06, 0.25, 2 * np.pi, 60e3, 8e-3
BEARINGS = {"crank": 0.05, "pin": 0.04, "guide": 1.0}  # radius [m]; 1 for what slides
LAW = BrownMcPhee(mu_s=0.08, mu_d=0.06, v_t=1e-3)


def blank(kin: Kinematics) -> tuple[Vector, Vector]:
    """Return the resistance of the blank against the slide over the last millimetres."""
    (p, v) = kin.point("slide")
    near = (1 + ca.tanh((p[0] - (R + L - DEPTH)) / 5e-4)) / 2
    down = (1 + ca.tanh(v[0] / 0.01)) / 2
    return (-FORCE * near * down, 0.0, 0.0), (0.0, 0.0, 0.0)


def press(friction: bool) -> Trajectory:
    """Simulate one stroke from the top."""
    bearing = {
        name: JointFriction(LAW, radius=r) if friction else None for name, r in BEARINGS.items()
    }
    m = Mechanism("press", gravity=(9.81, 0.0, 0.0))  # x points down
    m.body("wheel", 25.0, (0.3, 0.3, 0.5))
    m.body("rod", 8.0, (0.05, 0.05, 0.05), com=(L / 2, 0.0, 0.0))
    m.body("slide", 40.0, (0.5, 0.5, 0.5))
    m.frame("wheel.pin", at=(-R, 0.0, 0.0))
    m.frame("rod.end", at=(L, 0.0, 0.0))
    m.frame("ground.guide", z=(1.0, 0.0, 0.0))
    m.frame("slide.guide", z=(1.0, 0.0, 0.0))
    m.joint(Revolute("crank", "ground", "wheel", 0.0, OMEGA, bearing["crank"]))
    m.joint(Revolute("pin", "wheel.pin", "rod", 0.0, -OMEGA * (1 - R / L), bearing["pin"]))
    m.joint(Prismatic("guide", "ground.guide", "slide.guide", L - R, 0.0, bearing["guide"]))
    m.joint(PointOnLine("wrist", "rod.end", "slide"))
    m.force(UserForce("blank", "slide", blank))
    m.constraint(PrescribedMotion("drive", "crank", lambda t: OMEGA * t))
    return simulate(m.build(), 2 * np.pi / OMEGA, rtol=1e-7)


def main() -> None:
    """Simulate both presses; print the table, write picture and animation."""
    out = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    smooth, real = press(friction=False), press(friction=True)
    table = Table("bearing", "lost a stroke [J]", "with the mean load [J]")
    for name in BEARINGS:
        lost = float(real.integral(f"{name}_power")[-1])
        mean = LAW.mu_d * real[f"{name}_N"].mean() * np.abs(real[f"{name}_slip"]).mean()
        table.add_row(name, f"{lost:.1f}", f"{mean * real.t[-1]:.1f}")
    work = [OMEGA * float(run.integral("drive_moment")[-1]) for run in (smooth, real)]
    Console().print(table)
    print(f"work of the drive: {work[0]:.0f} J without friction, {work[1]:.0f} J with it")
    figure, (upper, lower) = panels(2)
    for k, (run, label) in enumerate(((smooth, "without friction"), (real, "with friction"))):
        upper.plot(np.degrees(run["crank"]), run["drive_moment"], label=label, **line(k))
    for k, name in enumerate(BEARINGS):
        lower.plot(np.degrees(real["crank"]), real[f"{name}_power"], label=name, **line(k))
    upper.set_ylabel("torque of the drive [N m]")
    lower.set(ylabel="lost to friction [W]", xlabel="crank [deg]")
    for axes in (upper, lower):
        axes.legend()
    save(figure, out / "press.png")
    real.animate(out / "press.gif", fps=10, speed=0.5)


if __name__ == "__main__":
    main()
