"""Andrews' squeezing mechanism: seven bodies in a plane, driven by a motor.

The test set gives it with index 3. Here accelerations a and multipliers lam are unknowns and the
constraints stand as accelerations (index 1):

    M(q) a + G(q)' lam = f(q, q'),   G(q) a + g_qq(q) (q', q') = 0
"""

import casadi as ca

from symfric.bench.problems.problem import Problem
from symfric.foundation.parameters import Variable
from symfric.model import Model, Output

ANGLES = ("beta", "theta", "gamma", "phi", "delta", "omega", "epsilon")
START = (
    -0.0617138900142764496, 0.0, 0.455279819163070380, 0.222668390165885884,
    0.487364979543842550, -0.222668390165885884, 1.23054744454982119,
)  # fmt: skip
M1, M2, M3, M4, M5, M6, M7 = 0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498
I1, I2, I3, I4 = 2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7
I5, I6, I7 = 1.169e-5, 5.667e-7, 1.912e-5
XA, YA, XB, YB, XC, YC = -0.06934, -0.00227, -0.03635, 0.03273, 0.014, 0.072
C0, L0, TORQUE = 4530.0, 0.07785, 0.033
D, DA, E, EA, RR, RA, SS, SA, SB = (
    28e-3,
    115e-4,
    2e-2,
    1421e-5,
    7e-3,
    92e-5,
    35e-3,
    1874e-5,
    1043e-5,
)
SC, SD, TA, TB, U, UA, UB, ZF, ZT, FA = (
    18e-3, 2e-2, 2308e-5, 916e-5, 4e-2, 1228e-5, 449e-5, 2e-2, 4e-2, 1421e-5,
)  # fmt: skip


def mass(q: ca.SX) -> ca.SX:
    """Mass matrix M(q)."""
    theta, phi, omega = q[1], q[3], q[5]
    M = ca.SX(7, 7)
    M[0, 0] = M1 * RA**2 + M2 * (RR**2 - 2 * DA * RR * ca.cos(theta) + DA**2) + I1 + I2
    M[0, 1] = M[1, 0] = M2 * (DA**2 - DA * RR * ca.cos(theta)) + I2
    M[1, 1] = M2 * DA**2 + I2
    M[2, 2] = M3 * (SA**2 + SB**2) + I3
    M[3, 3] = M4 * (E - EA) ** 2 + I4
    M[3, 4] = M[4, 3] = M4 * ((E - EA) ** 2 + ZT * (E - EA) * ca.sin(phi)) + I4
    M[4, 4] = (
        M4 * (ZT**2 + 2 * ZT * (E - EA) * ca.sin(phi) + (E - EA) ** 2)
        + M5 * (TA**2 + TB**2) + I4 + I5
    )  # fmt: skip
    M[5, 5] = M6 * (ZF - FA) ** 2 + I6
    M[5, 6] = M[6, 5] = M6 * ((ZF - FA) ** 2 - U * (ZF - FA) * ca.sin(omega)) + I6
    M[6, 6] = (
        M6 * ((ZF - FA) ** 2 - 2 * U * (ZF - FA) * ca.sin(omega) + U**2)
        + M7 * (UA**2 + UB**2) + I6 + I7
    )  # fmt: skip
    return M


def forces(q: ca.SX, v: ca.SX) -> ca.SX:
    """Motor, spring, and what the motion itself exerts, f(q, q')."""
    _, theta, gamma, phi, _, omega, _ = ca.vertsplit(q)
    beta_p, theta_p, _, phi_p, delta_p, omega_p, epsilon_p = ca.vertsplit(v)
    xd = SD * ca.cos(gamma) + SC * ca.sin(gamma) + XB
    yd = SD * ca.sin(gamma) - SC * ca.cos(gamma) + YB
    length = ca.sqrt((xd - XC) ** 2 + (yd - YC) ** 2)
    spring = -C0 * (length - L0) / length
    fx, fy = spring * (xd - XC), spring * (yd - YC)
    return ca.vertcat(
        TORQUE - M2 * DA * RR * theta_p * (theta_p + 2 * beta_p) * ca.sin(theta),
        M2 * DA * RR * beta_p**2 * ca.sin(theta),
        fx * (SC * ca.cos(gamma) - SD * ca.sin(gamma))
        + fy * (SD * ca.cos(gamma) + SC * ca.sin(gamma)),
        M4 * ZT * (E - EA) * delta_p**2 * ca.cos(phi),
        -M4 * ZT * (E - EA) * phi_p * (phi_p + 2 * delta_p) * ca.cos(phi),
        -M6 * U * (ZF - FA) * epsilon_p**2 * ca.cos(omega),
        M6 * U * (ZF - FA) * omega_p * (omega_p + 2 * epsilon_p) * ca.cos(omega),
    )


def constraints(q: ca.SX) -> ca.SX:
    """Three loops that close, g(q) = 0 [m]."""
    beta, theta, gamma, phi, delta, omega, epsilon = ca.vertsplit(q)
    x = RR * ca.cos(beta) - D * ca.cos(beta + theta)
    y = RR * ca.sin(beta) - D * ca.sin(beta + theta)
    return ca.vertcat(
        x - SS * ca.sin(gamma) - XB,
        y + SS * ca.cos(gamma) - YB,
        x - E * ca.sin(phi + delta) - ZT * ca.cos(delta) - XA,
        y + E * ca.cos(phi + delta) - ZT * ca.sin(delta) - YA,
        x - ZF * ca.cos(omega + epsilon) - U * ca.sin(epsilon) - XA,
        y - ZF * ca.sin(omega + epsilon) + U * ca.cos(epsilon) - YA,
    )


def model() -> Model:
    """Seven angles, their rates, accelerations and six multipliers."""
    angles = tuple(Variable(n, "rad", start=s) for n, s in zip(ANGLES, START, strict=True))
    rates = tuple(Variable(f"{n}_rate", "rad/s", nominal=1e3) for n in ANGLES)
    accelerations = tuple(Variable(f"{n}_acceleration", "rad/s^2", nominal=1e4) for n in ANGLES)
    multipliers = tuple(Variable(f"lam_{i}", "N", nominal=100.0) for i in range(1, 7))
    q, v, a, lam = (
        ca.vertcat(*(w.symbol for w in group))
        for group in (angles, rates, accelerations, multipliers)
    )
    g = constraints(q)
    G, turning = ca.jacobian(g, q), ca.jtimes(ca.jtimes(g, q, v), q, v)
    return Model(
        "andrews",
        x=(*angles, *rates),
        z=(*accelerations, *multipliers),
        ode=ca.vertcat(v, a),
        alg=ca.vertcat(mass(q) @ a + G.T @ lam - forces(q, v), G @ a + turning),
        outputs={f"g_{i + 1}": Output(g[i], "m") for i in range(6)},
    )


PROBLEM = Problem(
    "Andrews' squeezer",
    model,
    0.03,
    dict(
        zip(
            ANGLES,
            [
                0.1581077119629904e2,
                -0.1575637105984298e2,
                0.4082224013073101e-1,
                -0.5347301163226948,
                0.5244099658805304,
                0.5347301163226948,
                0.1048080741042263e1,
            ],
            strict=True,
        )
    ),
    drift=tuple(f"g_{i}" for i in range(1, 7)),
)
