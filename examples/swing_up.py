"""Swing up a pendulum on a cart in free time, with a slow motor and walls on both sides.

    cart 1 kg on a rail with friction (1.5 N sliding, 2.2 N to break away, 0.1 N s/m),
    bob 0.3 kg on a massless rod of 0.5 m;  |force| <= 20 N,  |d force / dt| <= 400 N/s

The cost is the effort plus 5 per second. The rate of the force is bounded, so the force is
continuous. The bob must not hit the walls at 0.4 m to the left and right; this condition refers to
a point of the mechanism, which is not one of its coordinates.

    python examples/swing_up.py [OUT]
"""

import sys
from math import pi
from pathlib import Path

from rich.console import Console
from rich.table import Table

from ocp import TIME, Free, Phase, Problem, integral, solve
from symfric import BrownMcPhee, Model
from symfric.multibody import JointFriction, JointSpringDamper, Mechanism, Prismatic, Revolute

POINT = (1e-6, 1e-6, 1e-6)  # inertia, nearly that of a point [kg m^2]
RAIL = BrownMcPhee(mu_s=2.2, mu_d=1.5, v_t=1e-5, mu_v=0.1)
WALL = 0.4
HANGING = {"x": 0.0, "theta": 0.0, "x_rate": 0.0, "theta_rate": 0.0}
UPRIGHT = HANGING | {"theta": pi}


def cart_pole() -> Model:
    """Return a slide along x with a hinge about -y; the bob hangs at theta = 0."""
    m = Mechanism("cart_pole", gravity=(0.0, 0.0, -9.81))
    m.body("cart", 1.0, POINT)
    m.body("bob", 0.3, POINT)
    m.frame("ground.rail", z=(1.0, 0.0, 0.0), x=(0.0, 0.0, 1.0))
    m.frame("cart.rail", z=(1.0, 0.0, 0.0), x=(0.0, 0.0, 1.0))
    m.frame("cart.pivot", z=(0.0, -1.0, 0.0), x=(0.0, 0.0, -1.0))
    m.frame("bob.pivot", at=(0.0, 0.0, 0.5), z=(0.0, -1.0, 0.0), x=(0.0, 0.0, -1.0))
    # with a normal force of 1 N the coefficients of the law are newtons
    rail = JointFriction(RAIL, normal=1.0)
    m.joint(Prismatic("x", "ground.rail", "cart.rail", friction=rail))
    m.joint(Revolute("theta", "cart.pivot", "bob.pivot"))
    motor = m.input("force", "N", nominal=10.0)
    m.force(JointSpringDamper("motor", "x", "slide", actuator=motor))
    return m.build()


def problem() -> Problem:
    """Return the problem from hanging to upright, with a cost of time."""
    return Problem(
        Phase(cart_pole(), T=Free(1.0, 4.0), start=HANGING, end=UPRIGHT),
        integral(lambda s: s.force**2) + 5.0 * TIME,
        bounds={"force": (-20.0, 20.0), "x": (-2.0, 2.0)},
        rates={"force": (-400.0, 400.0)},
        path=[lambda s: abs(s.bob_x) <= WALL],
    )


def main(out: Path) -> None:
    """Solve, print when the rail slips and sticks, and draw."""
    best = solve(problem())
    table = Table("mode", "from [s]", "to [s]")
    for mode in best.modes.get("x", ()):
        table.add_row(mode.kind, f"{mode.begin:.4f}", f"{mode.end:.4f}")
    Console().print(table)
    reach = max(abs(best["bob_x"]))
    print(f"J = {best.cost:.2f} in {best.T:.3f} s, bob within {reach:.3f} m")
    print(f"verified: {best.verified}")
    best.plot("x", "theta", "bob_x", "force", path=out / "swing_up.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
