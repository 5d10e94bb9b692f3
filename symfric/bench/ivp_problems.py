"""Initial-value problems with published solutions; see also `ivp`."""

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, final

import casadi as ca
import numpy as np

from symfric import Model, Variable

TEST_SET = (
    "Mazzia and Magherini, Test Set for Initial Value Problem Solvers, release 2.4, "
    "University of Bari and INdAM, 2008"
)


@final
@dataclass(frozen=True, eq=False)
class InitialValueProblem:
    """Initial-value problem with its published solution at the end.

    Attributes:
        name: name in the literature.
        model: function that builds the equations.
        t_end: end time; the problem starts at 0.
        reference: signal -> published value at the end.
        digits: rtol -> required number of correct digits.
        drift: outputs that are zero on the exact solution: the constraints of a problem of higher
            index, which is solved in an index-reduced form.
        laborious: methods that need millions of steps below rtol 1e-6.
    """

    name: str
    model: Callable[[], Model]
    t_end: float
    reference: Mapping[str, float]
    digits: Mapping[float, int] = field(default_factory=lambda: {1e-6: 5, 1e-10: 9})
    drift: tuple[str, ...] = ()
    laborious: tuple[str, ...] = ()


PUBLISHED = tomllib.loads(Path(__file__).with_name("ivp_problems.toml").read_text("utf-8"))


def published(name: str, model: Callable[[], Model], **more: Any) -> InitialValueProblem:
    """Return a problem of the test set with its stored solution."""
    found = dict(PUBLISHED[name])
    return InitialValueProblem(name, model, found.pop("t_end"), found, **more)


def unknowns(
    starts: Sequence[float], nominal: Sequence[float], unit: str = "1"
) -> tuple[Variable, ...]:
    """Return variables y1, y2, ..., named as in the test set."""
    every = zip(starts, nominal, strict=True)
    return tuple(
        Variable(f"y{i}", unit, start=float(start), nominal=size)
        for i, (start, size) in enumerate(every, start=1)
    )


def hires() -> Model:
    """HIRES: high irradiance responses of photomorphogenesis, eight reactions of phytochrome.

    The problem is stiff and has eight concentrations.
    """
    x = unknowns([1, 0, 0, 0, 0, 0, 0, 0.0057], [1, 0.1, 0.1, 0.1, 0.1, 0.5, 0.005, 0.005])
    y1, y2, y3, y4, y5, y6, y7, y8 = (v.symbol for v in x)
    ode = ca.vertcat(
        -1.71 * y1 + 0.43 * y2 + 8.32 * y3 + 0.0007,
        1.71 * y1 - 8.75 * y2,
        -10.03 * y3 + 0.43 * y4 + 0.035 * y5,
        8.32 * y2 + 1.71 * y3 - 1.12 * y4,
        -1.745 * y5 + 0.43 * y6 + 0.43 * y7,
        -280 * y6 * y8 + 0.69 * y4 + 1.71 * y5 - 0.43 * y6 + 0.69 * y7,
        280 * y6 * y8 - 1.81 * y7,
        -280 * y6 * y8 + 1.81 * y7,
    )
    return Model("hires", x=x, ode=ode)


def robertson() -> Model:
    """Robertson's autocatalytic reactions, over eleven decades of time.

    Two of the three concentrations end at 2e-8 and 8e-14; their nominal values are as small.
    """
    x = unknowns([1, 0, 0], [1e-8, 1e-13, 1])
    y1, y2, y3 = (v.symbol for v in x)
    slow, fast = -0.04 * y1 + 1e4 * y2 * y3, 3e7 * y2**2
    return Model("robertson", x=x, ode=ca.vertcat(slow, -slow - fast, fast))


def van_der_pol() -> Model:
    """Van der Pol oscillator, with relaxations a million times faster than its period.

    Time is scaled to a period of order 1.
    """
    EPSILON = 1e-6
    x = unknowns([2, 0], [2, 2])
    y1, y2 = (v.symbol for v in x)
    return Model("van_der_pol", x=x, ode=ca.vertcat(y2, ((1 - y1**2) * y2 - y1) / EPSILON))


def oregonator() -> Model:
    """Oregonator: Field and Noyes' model of the Belousov-Zhabotinskii reaction.

    Concentrations vary over five decades within a period.
    """
    x = unknowns([1, 2, 3], [1, 1, 1])
    y1, y2, y3 = (v.symbol for v in x)
    ode = ca.vertcat(
        77.27 * (y2 + y1 * (1 - 8.375e-6 * y1 - y2)),
        (y3 - (1 + y1) * y2) / 77.27,
        0.161 * (y1 - y3),
    )
    return Model("oregonator", x=x, ode=ode)


def akzo_nobel() -> Model:
    """Chemical Akzo Nobel: two species are mixed while carbon dioxide is added; index 1.

    The sixth concentration follows from an equilibrium.
    """
    START = (0.444, 0.00123, 0.0, 0.007, 0.0)
    k1, k2, k3, k4, K = 18.7, 0.58, 0.09, 0.42, 34.4
    klA, pCO2, H, Ks = 3.3, 0.9, 737.0, 115.83
    x = unknowns(START, [0.1, 1e-3, 0.1, 1e-3, 1e-2], "mol/L")
    z = Variable("y6", "mol/L", start=Ks * START[0] * START[3], nominal=0.1)
    (y1, y2, y3, y4, y5), y6 = (v.symbol for v in x), z.symbol
    r1, r2, r3 = k1 * y1**4 * ca.sqrt(y2), k2 * y3 * y4, k2 / K * y1 * y5
    r4, r5 = k3 * y1 * y4**2, k4 * y6**2 * ca.sqrt(y2)
    inflow = klA * (pCO2 / H - y2)
    ode = ca.vertcat(
        -2 * r1 + r2 - r3 - r4,
        -0.5 * r1 - r4 - 0.5 * r5 + inflow,
        r1 - r2 + r3,
        -r2 + r3 - 2 * r4,
        r2 - r3 + r5,
    )
    return Model("akzo_nobel", x=x, z=(z,), ode=ode, alg=Ks * y1 * y4 - y6)


def transistor_amplifier() -> Model:
    """Transistor amplifier: M y' = f(y, t) with a singular M, capacitors between nodes; index 1.

    The unknowns are node voltages; the currents at each node sum to zero. The equations remain
    implicit in y'.
    """
    SUPPLY, THERMAL, ALPHA, BETA, R0, R = 6.0, 0.026, 0.99, 1e-6, 1e3, 9e3
    x = unknowns([0, 3, 3, 6, 3, 3, 6, 0], [1] * 8, "V")
    y1, y2, y3, y4, y5, y6, y7, y8 = (v.symbol for v in x)
    t, rates = ca.SX.sym("t"), ca.SX.sym("rates", 8)
    signal = 0.1 * ca.sin(200 * np.pi * t)
    first, second = (BETA * (ca.exp(u / THERMAL) - 1) for u in (y2 - y3, y5 - y6))
    currents = ca.vertcat(
        (y1 - signal) / R0,
        (2 * y2 - SUPPLY) / R + (1 - ALPHA) * first,
        y3 / R - first,
        (y4 - SUPPLY) / R + ALPHA * first,
        (2 * y5 - SUPPLY) / R + (1 - ALPHA) * second,
        y6 / R - second,
        (y7 - SUPPLY) / R + ALPHA * second,
        y8 / R,
    )
    C1, C2, C3, C4, C5 = (k * 1e-6 for k in range(1, 6))  # C2 and C4 to ground
    M = np.diag([-C1, -C1, -C2, -C3, -C3, -C4, -C5, -C5])
    for i, C in ((0, C1), (3, C3), (6, C5)):
        M[i, i + 1] = M[i + 1, i] = C
    residual = ca.DM(M) @ rates - currents
    return Model("transistor_amplifier", x=x, xdot=rates, residual=residual, t=t)


def pleiades() -> Model:
    """Pleiades: seven stars in a plane, with near collisions; not stiff.

    The states are positions x, y and velocities of stars with masses 1 ... 7.
    """
    START = (
        *(3, 3, -1, -3, 2, -2, 2), *(3, -3, 2, 0, 0, -4, 4),
        *(0, 0, 0, 0, 0, 1.75, -1.5), *(0, 0, 0, -1.25, 1, 0, 0),
    )  # fmt: skip
    states = unknowns(START, [1] * 28)
    every = [v.symbol for v in states]
    x, y, velocities = every[:7], every[7:14], every[14:]

    def pull(along: list[ca.SX], i: int) -> ca.SX:
        """Return the acceleration of star i."""
        others = (j for j in range(7) if j != i)
        return sum(
            (
                (j + 1) * (along[j] - along[i]) / ((x[j] - x[i]) ** 2 + (y[j] - y[i]) ** 2) ** 1.5
                for j in others
            ),
            start=ca.SX(0),
        )

    accelerations = [pull(along, i) for along in (x, y) for i in range(7)]
    return Model("pleiades", x=states, ode=ca.vertcat(*velocities, *accelerations))


def ring_modulator() -> Model:
    """Ring modulator: mixer of a low and a high frequency, with parasitic capacitances of 2 pF.

    Seven voltages and eight currents are highly oscillatory, and stiff because CS is small.
    """
    C, CS, CP, R, RP = 1.6e-8, 2e-12, 1e-8, 25e3, 50.0
    LH, LS1, LS2, LS3 = 4.45, 2e-3, 5e-4, 5e-4
    RG1, RG2, RG3, RI, RC = 36.3, 17.3, 17.3, 50.0, 600.0
    GAMMA, DELTA = 40.67286402e-9, 17.7493332
    x = unknowns([0] * 15, [0.1] * 7 + [1e-7] * 2 + [1e-4] * 6)
    y1, y2, y3, y4, y5, y6, y7, y8, y9, y10, y11, y12, y13, y14, y15 = (v.symbol for v in x)
    t = ca.SX.sym("t")
    low, high = 0.5 * ca.sin(2e3 * np.pi * t), 2 * ca.sin(2e4 * np.pi * t)
    q1, q2, q3, q4 = (
        GAMMA * (ca.exp(DELTA * u) - 1)
        for u in (
            y3 - y5 - y7 - high, -y4 + y6 - y7 - high, y4 + y5 + y7 + high, -y3 - y6 + y7 + high
        )
    )  # fmt: skip
    ode = ca.vertcat(
        (y8 - 0.5 * y10 + 0.5 * y11 + y14 - y1 / R) / C,
        (y9 - 0.5 * y12 + 0.5 * y13 + y15 - y2 / R) / C,
        (y10 - q1 + q4) / CS,
        (-y11 + q2 - q3) / CS,
        (y12 + q1 - q3) / CS,
        (-y13 - q2 + q4) / CS,
        (-y7 / RP + q1 + q2 - q3 - q4) / CP,
        -y1 / LH,
        -y2 / LH,
        (0.5 * y1 - y3 - RG2 * y10) / LS2,
        (-0.5 * y1 + y4 - RG3 * y11) / LS3,
        (0.5 * y2 - y5 - RG2 * y12) / LS2,
        (-0.5 * y2 + y6 - RG3 * y13) / LS3,
        (-y1 + low - (RI + RG1) * y14) / LS1,
        (-y2 - (RC + RG1) * y15) / LS1,
    )
    return Model("ring_modulator", x=x, ode=ode, t=t)


PROBLEMS = (
    published("HIRES", hires),
    published("Robertson", robertson),
    published("van der Pol", van_der_pol),
    published("Oregonator", oregonator),
    published("Chemical Akzo Nobel", akzo_nobel),
    published("transistor amplifier", transistor_amplifier),
    published("Pleiades", pleiades, digits={1e-6: 3, 1e-10: 7}),
    published("ring modulator", ring_modulator, laborious=("radau5",)),
)
"""Problems without constraints."""
