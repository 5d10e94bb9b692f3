"""Position a load with dry friction that a motor moves through a spring.

    m_1 x_1'' = force - K,   m x'' = K - F(x'),   K = k (x_1 - x) + d (x_1' - x')

    m_1 = 0.5 kg,  m = 1 kg,  k = 200 N/m,  d = 2 N s/m,  |force| <= 40 N
    F: 6 N to break away, 4 N while sliding, 0.5 N s/m

The load moves 0.3 m out in 1 s, and back in another second. It breaks away when the motor has wound
up the spring to 6 N: the control acts on the friction only through the spring. The solver finds the
modes and their durations; the result holds for exact Coulomb friction.

    python examples/through_a_spring.py [OUT]
"""

import sys
from pathlib import Path

import casadi as ca
from rich.console import Console
from rich.table import Table

from ocp import Phase, Problem, integral, solve
from symfric import BrownMcPhee, Contact, Model, Output, Variable

LAW = BrownMcPhee(mu_s=6.0, mu_d=4.0, v_t=1e-5, mu_v=0.5)


def motor_and_load() -> Model:
    """Return two masses with a spring between them, and a contact under the load."""
    motor, load = (Variable(name, "m", nominal=0.1) for name in ("motor", "load"))
    v_motor, v_load = (Variable(name, "m/s", nominal=0.1) for name in ("v_motor", "v_load"))
    force = Variable("force", "N", nominal=10.0)
    wound = motor - load
    spring = 200.0 * wound + 2.0 * (v_motor - v_load)
    guide = Contact("guide", slip=v_load, N=1.0, law=LAW)
    return Model(
        "load behind a spring",
        x=(motor, load, v_motor, v_load),
        u=(force,),
        ode=ca.vertcat(
            v_motor,
            v_load,
            (force - spring) / 0.5,
            (spring - guide.force) / 1.0,
        ),
        contacts=(guide,),
        outputs={"spring": Output(spring, "N", "force of the spring")},
    )


def problem() -> Problem:
    """Return the problem: out to 0.3 m, and back to rest with a relaxed spring."""
    model = motor_and_load()
    out = Phase(model, T=1.0, end={"load": 0.3}, name="out")
    rest = {"motor": 0.0, "load": 0.0, "v_motor": 0.0, "v_load": 0.0}
    back = Phase(model, T=1.0, end=rest, name="back")
    return Problem(out >> back, integral(lambda s: s.force**2), bounds={"force": (-40.0, 40.0)})


def main(out: Path) -> None:
    """Solve, print the modes with the force of the spring at their ends, and draw."""
    best = solve(problem())
    table = Table("mode", "from [s]", "to [s]")
    for mode in best.modes.get("guide", ()):
        table.add_row(mode.kind, f"{mode.begin:.4f}", f"{mode.end:.4f}")
    print(best.message)
    Console().print(table)
    print(f"J = {best.cost:.4f} N^2 s, verified: {best.verified}")
    best.plot("load", "v_load", "spring", "force", path=out / "through_a_spring.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
