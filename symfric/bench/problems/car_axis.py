"""Car axis: an axle on two springs over a bumpy road.

The test set gives it with index 3. Here accelerations and multipliers are unknowns and the
constraints stand as accelerations (index 1): K p'' = f(p, t) + c_p' lam, d^2 c / dt^2 = 0.
"""

import casadi as ca

from symfric.bench.problems.problem import Problem
from symfric.foundation.parameters import Variable
from symfric.model import Model, Output

NAMES = ("xl", "yl", "xr", "yr")
L, L0, EPSILON, M, BUMP, OMEGA = 1.0, 0.5, 1e-2, 10.0, 0.1, 10.0
K = EPSILON**2 * M / 2


def road(t: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Where the right wheel touches; the left one stands at the origin."""
    y = BUMP * ca.sin(OMEGA * t)
    return ca.sqrt(L**2 - y**2), y


def constraints(p: ca.SX, t: ca.SX) -> ca.SX:
    """The left spring stays normal to the chassis' base, the axle keeps its length."""
    (xl, yl, xr, yr), (xb, yb) = ca.vertsplit(p), road(t)
    return ca.vertcat(xl * xb + yl * yb, (xl - xr) ** 2 + (yl - yr) ** 2 - L**2)


def springs(p: ca.SX, t: ca.SX) -> ca.SX:
    """Springs and weight."""
    (xl, yl, xr, yr), (xb, yb) = ca.vertsplit(p), road(t)
    left, right = ca.sqrt(xl**2 + yl**2), ca.sqrt((xr - xb) ** 2 + (yr - yb) ** 2)
    return ca.vertcat(
        (L0 - left) * xl / left,
        (L0 - left) * yl / left - K,
        (L0 - right) * (xr - xb) / right,
        (L0 - right) * (yr - yb) / right - K,
    )


def model() -> Model:
    """Positions of both ends of the axle, their rates, accelerations and two multipliers.

    One end moves by 3 mm only: that is what is small.
    """
    starts = {"xl": 0.0, "yl": 0.5, "xr": 1.0, "yr": 0.5}
    rates = {"xl": -0.5, "yl": 0.0, "xr": -0.5, "yr": 0.0}
    positions = tuple(Variable(n, "m", start=starts[n], nominal=1e-3) for n in NAMES)
    velocities = tuple(Variable(f"{n}_dot", "m/s", start=rates[n], nominal=1e-3) for n in NAMES)
    accelerations = tuple(Variable(f"{n}_ddot", "m/s^2", nominal=1e-2) for n in NAMES)
    multipliers = tuple(Variable(f"lam_{i}", "N", nominal=1e-5) for i in (1, 2))
    p, v, a, lam = (
        ca.vertcat(*(w.symbol for w in group))
        for group in (positions, velocities, accelerations, multipliers)
    )
    t = ca.SX.sym("t")
    c = constraints(p, t)

    def rate(of: ca.SX) -> ca.SX:
        """Total derivative by time, accelerations included."""
        return ca.jacobian(of, p) @ v + ca.jacobian(of, v) @ a + ca.jacobian(of, t)

    return Model(
        "car_axis",
        x=(*positions, *velocities),
        z=(*accelerations, *multipliers),
        ode=ca.vertcat(v, a),
        alg=ca.vertcat(K * a - springs(p, t) - ca.jacobian(c, p).T @ lam, rate(rate(c))),
        outputs={"c_1": Output(c[0], "m^2"), "c_2": Output(c[1], "m^2")},
        t=t,
    )


PROBLEM = Problem(
    "car axis",
    model,
    3.0,
    {
        "xl": 0.493455784275402809122e-1,
        "yl": 0.496989460230171153861,
        "xr": 0.104174252488542151681e1,
        "yr": 0.373911027265361256927,
        "xl_dot": -0.770583684040972357970e-1,
        "yl_dot": 0.744686658723778553466e-2,
        "xr_dot": 0.175568157537232222276e-1,
        "yr_dot": 0.770341043779251976443,
        "lam_1": -0.473688659084893324729e-2,
        "lam_2": -0.110468033125734368808e-2,
    },
    drift=("c_1", "c_2"),
)
