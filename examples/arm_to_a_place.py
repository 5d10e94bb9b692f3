"""Move the last link of a six-joint arm to a point, with all joints at rest and free angles.

The friction of every joint depends on the reaction of all links beyond it. The optimiser chooses
the six angles at the end. The link stays above a table.

The cost contains the speeds of the joints as well as the torques, because the minimum over the
torques alone is flat. Friction is smooth over 0.05 m/s: the normal forces of the six contacts
depend on each other, so there are too many modes to distinguish. The loads of the bearings of the
wrist pass through zero, where their magnitude has a kink; it is smoothed over 0.5 N.

    python examples/arm_to_a_place.py [OUT]
"""

import sys
from pathlib import Path

from rich.console import Console
from rich.table import Table

from ocp import Phase, Problem, Signals, integral, solve
from ocp.friction.smooth_models import smooth_model
from symfric import BrownMcPhee
from symfric.scenes import Arm

JOINTS = range(1, 7)
AT_REST = {f"q{i}_rate": 0.0 for i in JOINTS}
TORQUES = {f"tau{i}": (-150.0, 150.0) for i in JOINTS}
PLACE = {"link6_x": 0.5, "link6_y": 0.2, "link6_z": 0.3}
TABLE = 0.25  # m


def effort(s: Signals) -> object:
    """Torques [N m] and speeds [rad/s] of all joints."""
    return sum(0.01 * s[f"tau{i}"] ** 2 + 20.0 * s[f"q{i}_rate"] ** 2 for i in JOINTS)


def problem() -> Problem:
    """Move to the point within a second."""
    arm = smooth_model(Arm(BrownMcPhee(mu_s=0.15, mu_d=0.1, v_t=0.05)).model())
    return Problem(
        Phase(arm, T=1.0, end=PLACE | AT_REST),
        integral(effort),
        bounds=TORQUES,
        path=[lambda s: s.link6_z >= TABLE],
        p={f"q{i}_eps": 0.5 for i in JOINTS},
    )


def main(out: Path) -> None:
    """Solve, print the chosen angles, and draw."""
    best = solve(problem(), intervals=20, friction="smooth", tolerance=1e-2)
    table = Table("joint", "from [rad]", "to [rad]", "largest torque [N m]")
    for i in JOINTS:
        q, torque = best[f"q{i}"], best[f"tau{i}"]
        table.add_row(f"q{i}", f"{q[0]:+.3f}", f"{q[-1]:+.3f}", f"{abs(torque).max():.1f}")
    Console().print(table)
    print(f"J = {best.cost:.3f}, verified: {best.verified}")
    best.plot(*(f"q{i}" for i in JOINTS), path=out / "arm_to_a_place.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
