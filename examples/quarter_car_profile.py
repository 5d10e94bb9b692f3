"""Motion of a test rig that lifts the body of a car with the least acceleration.

A quarter car stands on a plate; body 240 kg, wheel 40 kg, suspension 28.9 kN/m and 260 N s/m, tyre
920 kN/m and 3886 N s/m. The strut leans by 45 degrees and presses the body against its guide,
with dry friction of up to 164 N at rest. The body rises by 85 mm in 1 s and is at rest again:

    min integral of a_body^2   over the profile of the plate

For a body alone the minimum is 12 (0.085 m)^2 / (1 s)^3. The plate is limited to 1 m/s and to 20
m/s^2, and the tyre must not lift off. Friction has to be overcome at the start, and acts until the
end.

    python examples/quarter_car_profile.py [OUT]
"""

import sys
from pathlib import Path

import casadi as ca

from ocp import Phase, Problem, integral, solve
from symfric import BrownMcPhee, Contact, Model, Output, Variable

BODY, WHEEL = 240.0, 40.0  # kg
K_S, D_S, K_T, D_T = 28900.0, 260.0, 920e3, 3886.0  # N/m and N s/m
RISE, GENTLEST = 0.085, 12 * 0.085**2
WEIGHT = (BODY + WHEEL) * 9.81
LAW = BrownMcPhee(mu_s=0.15, mu_d=0.1, v_t=1e-5)


def rig() -> Model:
    """Return displacements from rest under the weight; the input is the speed of the plate."""
    body, wheel, plate = (Variable(n, "m", nominal=0.1) for n in ("body", "wheel", "plate"))
    v_body, v_wheel = (Variable(n, "m/s", nominal=0.1) for n in ("v_body", "v_wheel"))
    speed = Variable("speed", "m/s", nominal=0.1, doc="speed of the plate")
    strut = K_S * (wheel - body) + D_S * (v_wheel - v_body)
    tyre = K_T * (plate - wheel) + D_T * (speed - v_wheel)
    side = 1093.0 + ca.sqrt(strut**2 + 1.0) - 1.0  # preload and side force of the strut [N]
    guide = Contact("guide", slip=v_body, N=side, law=LAW)
    a_body = (strut - guide.force) / BODY
    return Model(
        "quarter car on a rig",
        x=(body, wheel, plate, v_body, v_wheel),
        u=(speed,),
        ode=ca.vertcat(v_body, v_wheel, speed, a_body, (tyre - strut) / WHEEL),
        contacts=(guide,),
        outputs={
            "a_body": Output(a_body, "m/s^2", "acceleration of the body"),
            "tyre": Output(tyre, "N", "force of the tyre beyond the weight"),
        },
    )


def problem() -> Problem:
    """Return the problem of the rise."""
    return Problem(
        Phase(rig(), T=1.0, end={"body": RISE, "v_body": 0.0, "v_wheel": 0.0}),
        integral(lambda s: s.a_body**2),
        bounds={"speed": (-1.0, 1.0), "plate": (-0.05, 0.2), "tyre": (-WEIGHT, None)},
        rates={"speed": (-20.0, 20.0)},
    )


def main(out: Path) -> None:
    """Solve, print and draw."""
    best = solve(problem())
    print(best.message)
    print(f"J = {best.cost:.5f} m^2/s^3, a body alone {GENTLEST:.5f}")
    print(f"plate: {1e3 * best['plate'].max():.1f} mm at most; verified: {best.verified}")
    best.plot("body", "plate", "speed", "a_body", path=out / "quarter_car_profile.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
