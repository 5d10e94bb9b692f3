"""Correct digits and run time on published initial-value problems with known solutions.

This file has the problems of mechanisms, Andrews' squeezer and the car axis; `ivp_problems` has all
others.
"""

from collections.abc import Iterator
from functools import partial
from math import nan

import casadi as ca
import numpy as np

from symfric import Model, Output, Trajectory, Variable, simulate
from symfric.bench.ivp_problems import PROBLEMS as OTHERS
from symfric.bench.ivp_problems import TEST_SET, InitialValueProblem, published
from symfric.bench.report import Found, Progress, Report, backend, best_time, curves
from symfric.multibody import JointSpringDamper, Mechanism, PointOnLine, Revolute, SpringDamper

# ---- Andrews' squeezer ----

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
D, DA, E, EA, RR, RA = 28e-3, 115e-4, 2e-2, 1421e-5, 7e-3, 92e-5
SS, SA, SB, SC, SD = 35e-3, 1874e-5, 1043e-5, 18e-3, 2e-2
TA, TB, U, UA, UB, ZF, ZT, FA = 2308e-5, 916e-5, 4e-2, 1228e-5, 449e-5, 2e-2, 4e-2, 1421e-5


def mass(q: ca.SX) -> ca.SX:
    """Return the mass matrix M(q)."""
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
    """Return the generalised forces f(q, q') of motor, spring and velocity terms."""
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
    """Return the residuals g(q) [m] of the three closed loops."""
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


def andrews() -> Model:
    """Andrews' squeezing mechanism: seven bodies in a plane, driven by a motor.

    The test set uses index 3. Here accelerations a and multipliers lam are unknowns, and the
    constraints are imposed on accelerations (index 1):

        M(q) a + G(q)' lam = f(q, q'),   G(q) a + g_qq(q) (q', q') = 0

    The unknowns are seven angles, their rates and accelerations, and six multipliers.
    """
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


ANDREWS = published("Andrews' squeezer", andrews, drift=tuple(f"g_{i}" for i in range(1, 7)))

MASSES = (M1, M2, M3, M4, M5, M6, M7)
INERTIAS = (I1, I2, I3, I4, I5, I6, I7)
CENTRES = (
    (RA, 0.0), (-DA, 0.0), (SB, -SA), (0.0, EA - E), (TA, TB),
    (ZF - FA, 0.0), (UB, -UA),
)  # fmt: skip
PLACES = {
    "ground.O": (0.0, 0.0), "ground.A": (XA, YA), "ground.B": (XB, YB),
    "ground.C": (XC, YC), "K1.P": (RR, 0.0), "K2.E": (-D, 0.0), "K3.E": (0.0, -SS),
    "K3.D": (SD, -SC), "K4.E": (0.0, -E), "K5.F": (ZT, 0.0), "K6.E": (ZF, 0.0),
    "K7.G": (0.0, -U),
}  # fmt: skip
HINGES = {
    "beta": ("ground.O", "K1"), "theta": ("K1.P", "K2"), "gamma": ("ground.B", "K3"),
    "phi": ("K5.F", "K4"), "delta": ("ground.A", "K5"), "omega": ("K7.G", "K6"),
    "epsilon": ("ground.A", "K7"),
}  # fmt: skip


def mechanism() -> Mechanism:
    """Andrews' squeezer as a mechanism of bodies and joints.

    Seven bodies are attached to three pins of the ground; three pins at one point, E, close their
    loops. A motor drives the first hinge; a spring connects C and D.
    """
    m = Mechanism("squeezer", gravity=(0.0, 0.0, 0.0))
    numbers = zip(MASSES, INERTIAS, CENTRES, strict=True)
    for k, (mass, inertia, (x, y)) in enumerate(numbers, start=1):
        m.body(f"K{k}", mass, (inertia, inertia, inertia), com=(x, y, 0.0))
    for place, (x, y) in PLACES.items():
        m.frame(place, at=(x, y, 0.0))
    for (name, ends), start in zip(HINGES.items(), START, strict=True):
        m.joint(Revolute(name, *ends, start=start))
    for body in ("K3", "K4", "K6"):
        m.joint(PointOnLine(f"E_{body}", "K2.E", f"{body}.E"))
    m.force(JointSpringDamper("motor", "beta", actuator=TORQUE))
    m.force(SpringDamper("spring", "ground.C", "K3.D", stiffness=C0, free_length=L0))
    return m


# ---- car axis ----

CORNERS = ("xl", "yl", "xr", "yr")
L, REST, EPSILON, M, BUMP, OMEGA = 1.0, 0.5, 1e-2, 10.0, 0.1, 10.0
MASS = EPSILON**2 * M / 2


def _road(t: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return the position of the right wheel contact; the left wheel contact is at the origin."""
    y = BUMP * ca.sin(OMEGA * t)
    return ca.sqrt(L**2 - y**2), y


def _axle(p: ca.SX, t: ca.SX) -> ca.SX:
    """Return constraints: left spring normal to the base of the chassis; constant axle length."""
    (xl, yl, xr, yr), (xb, yb) = ca.vertsplit(p), _road(t)
    return ca.vertcat(xl * xb + yl * yb, (xl - xr) ** 2 + (yl - yr) ** 2 - L**2)


def _springs(p: ca.SX, t: ca.SX) -> ca.SX:
    """Return the forces of springs and weight."""
    (xl, yl, xr, yr), (xb, yb) = ca.vertsplit(p), _road(t)
    left, right = ca.sqrt(xl**2 + yl**2), ca.sqrt((xr - xb) ** 2 + (yr - yb) ** 2)
    return ca.vertcat(
        (REST - left) * xl / left,
        (REST - left) * yl / left - MASS,
        (REST - right) * (xr - xb) / right,
        (REST - right) * (yr - yb) / right - MASS,
    )


def car_axis() -> Model:
    """Car axis: an axle on two springs over a bumpy road.

    The test set uses index 3. Here accelerations and multipliers are unknowns, and the constraints
    are imposed on accelerations (index 1): K p'' = f(p, t) + c_p' lam, d^2 c / dt^2 = 0. The
    unknowns are the positions of both ends of the axle, their rates and accelerations, and two
    multipliers. Nominal values are small because one end moves by only 3 mm.
    """
    starts = {"xl": 0.0, "yl": 0.5, "xr": 1.0, "yr": 0.5}
    rates = {"xl": -0.5, "yl": 0.0, "xr": -0.5, "yr": 0.0}
    positions = tuple(Variable(n, "m", start=starts[n], nominal=1e-3) for n in CORNERS)
    velocities = tuple(Variable(f"{n}_dot", "m/s", start=rates[n], nominal=1e-3) for n in CORNERS)
    accelerations = tuple(Variable(f"{n}_ddot", "m/s^2", nominal=1e-2) for n in CORNERS)
    multipliers = tuple(Variable(f"lam_{i}", "N", nominal=1e-5) for i in (1, 2))
    p, v, a, lam = (
        ca.vertcat(*(w.symbol for w in group))
        for group in (positions, velocities, accelerations, multipliers)
    )
    t = ca.SX.sym("t")
    c = _axle(p, t)

    def rate(of: ca.SX) -> ca.SX:
        """Return the total time derivative, including accelerations."""
        return ca.jacobian(of, p) @ v + ca.jacobian(of, v) @ a + ca.jacobian(of, t)

    return Model(
        "car_axis",
        x=(*positions, *velocities),
        z=(*accelerations, *multipliers),
        ode=ca.vertcat(v, a),
        alg=ca.vertcat(MASS * a - _springs(p, t) - ca.jacobian(c, p).T @ lam, rate(rate(c))),
        outputs={"c_1": Output(c[0], "m^2"), "c_2": Output(c[1], "m^2")},
        t=t,
    )


JOINT = InitialValueProblem(
    "Andrews' squeezer, joint coordinates",
    lambda: mechanism().build(),
    ANDREWS.t_end,
    ANDREWS.reference,
    drift=("constraint_position",),
)
PROBLEMS = (
    *OTHERS,
    ANDREWS,
    JOINT,
    published("car axis", car_axis, drift=("c_1", "c_2")),
)
"""All problems of the benchmark."""


# ---- measurement ----

METHODS = ("rodas5p", "radau5")
TOLERANCES = (1e-6, 1e-8, 1e-10)
DIGITS = "Correct digits of the worst signal at the end"
DRIFT = "Drift of constraints that are imposed on the accelerations only"


def bench(quick: bool = False, progress: Progress = None) -> Report:
    """Measure all problems; with `quick`, at rtol 1e-6 only."""
    tasks = {problem.name: partial(_rows, problem, quick) for problem in PROBLEMS}
    draw = curves("problem", ("method",), "relative error", "time per run [ms]")
    source = f"Problems and published values: {TEST_SET}."
    return Report((DIGITS, draw), notes=[source]).collect(tasks, progress)


def _rows(problem: InitialValueProblem, quick: bool) -> Iterator[Found]:
    model = problem.model()
    for method in METHODS:
        tolerances = TOLERANCES[:1] if quick or method in problem.laborious else TOLERANCES
        for rtol in tolerances:
            yield from measure(problem, model, method, rtol)


def measure(
    problem: InitialValueProblem, model: Model, method: str, rtol: float, engine: str | None = None
) -> Iterator[Found]:
    """Integrate one problem; yield the row of its correct digits and the row of its drift.

    Args:
        problem, model: problem and its equations.
        method, rtol: as in `simulate`.
        engine: `backend` of `simulate`; by default compiled if there is a compiler.
    """
    solve = partial(
        simulate, model, problem.t_end, rtol=rtol, method=method, backend=engine or backend(),
        samples=2, throw=False,
    )  # fmt: skip
    solve()
    time_s, run = best_time(solve)
    case = {"problem": problem.name, "method": method, "rtol": rtol}
    digits, worst = correct_digits(problem, run) if run.status.ok else (nan, "")
    yield DIGITS, case | {
        "correct digits": digits, "worst signal": worst,
        "required digits": problem.digits.get(rtol, ""), "relative error": 10**-digits,
        "steps": run.statistics.steps, "rejections": run.statistics.rejections,
        "time per run [ms]": 1e3 * time_s,
    }  # fmt: skip
    if not run.status.ok:
        yield f"{problem.name}, {method}: not run, {run.message}"
    if problem.drift and run.step_times.size > 1:
        at = run.at(run.step_times)
        drift = max(float(np.abs(at[name]).max()) for name in problem.drift)
        yield DRIFT, case | {"largest constraint violation": drift}


def correct_digits(problem: InitialValueProblem, run: Trajectory) -> tuple[float, str]:
    """Return the number of correct digits of the worst signal at the end, and its name."""
    end = run.final
    errors = {
        name: abs(end[name] - value) / abs(value) for name, value in problem.reference.items()
    }
    worst = max(errors, key=lambda name: errors[name])
    # rounding limits the number of correct digits
    return -float(np.log10(max(errors[worst], float(np.finfo(float).eps)))), worst
