"""Rig of the paper on a road of 30, 50 or 70 mm, by `simulate` and by hand.

The computation by hand uses no code of `symfric`; it is exact without friction, and takes small
steps with friction. The body sticks until the force of the strut exceeds the break-away force, and
stops where its velocity crosses zero; in between, its friction is equation 12 with the signs that
the text requires.
"""

from collections.abc import Mapping
from functools import cache
from itertools import pairwise
from math import asin, copysign, cos, exp, pi, sin, tan

import numpy as np
from scipy.linalg import expm

from symfric import Law, QuarterCarGeneral, Trajectory, simulate, with_values
from symfric.foundation.numeric import Array
from symfric.scenes import QuarterCar

START, FIRST, RAMP, HOLD, T_END = 0.3, 2.4, 1.0, 2.0, 12.0  # s
"""Times of the road [s]; START and FIRST follow from the text and are those of the preset (figure
11), the others are our choice."""
STAGES = {"A": (START, 0.0), "B": (4.7, 0.085), "C": (7.7, 0.135), "D": (T_END, 0.035)}
"""End of each rest [s], and position of the body at this time in the paper [m]."""
FRICTION = {"C_e": 180.0, "e_1": 0.01, "mu": 0.05, "sigma_v": 1500.0}
"""Friction of the general law [N, m/s, 1, N s/m]; not in the paper."""
WEAK = {"C_e": 120.0, "e_1": 0.02, "mu": 0.08, "sigma_v": 80.0}
"""Another choice of the numbers that the paper does not state, with weak viscosity."""
READINGS: tuple[Mapping[str, float], ...] = (
    FRICTION,
    WEAK,
    *(
        FRICTION | {name: value}
        for name, values in {
            "C_e": (90.0,),
            "e_1": (0.003, 0.03),
            "mu": (0.025, 0.1),
            "sigma_v": (300.0, 750.0, 3000.0),
        }.items()
        for value in values
    ),
)
"""Choices of the invented numbers; the statements on the paper hold for each of them."""
RAMPS = {
    name: (begin, end)
    for name, (begin, end) in zip(
        ("first", "second", "third"), pairwise(end for end, _ in STAGES.values()), strict=True
    )
}
"""Ramp and the following rest -> first and last time [s]."""


def general(numbers: Mapping[str, float] = FRICTION, form: str = "smooth") -> QuarterCarGeneral:
    """Return the general law with narrow windows [m/s, N], since the paper's law has none."""
    return with_values(QuarterCarGeneral(v_eps=2e-4, F_eps=0.1, form=form), numbers)


@cache
def read(number: int) -> Trajectory:
    """Return the run with one of `READINGS`."""
    return ride(general(READINGS[number]))


def ride(law: Law, millimetres: int = 50, samples: int = 6001) -> Trajectory:
    """Return a run of the rig with `law` in the guide."""
    name = f"al_zughaibi_{millimetres}_mm"
    car = QuarterCar.preset(name, law, t_ramp=RAMP, t_hold=HOLD)
    return simulate(car.model(), T_END, rtol=1e-8, samples=samples)


M_B, M_W, K_S, B_D, K_T, B_T = 240.0, 40.0, 28900.0, 260.0, 920000.0, 3886.0
THETA, L_D, BREAK_AWAY = pi / 4, 0.4, 193.8
CORNERS = np.cumsum([0.0, START, FIRST, HOLD, RAMP, HOLD, RAMP, T_END])
"""Times of the corners of the road [s]."""


def heights(millimetres: int) -> Array:
    """Return the height of the road at its corners [m]."""
    up, down = 0.085 + 1e-3 * millimetres, 0.085 - 1e-3 * millimetres
    return np.array([0.0, 0.0, 0.085, 0.085, up, up, down, down])


def matrix() -> Array:
    """Return the matrix of the linear equations of body, wheel, velocities, road and slope."""
    rows = [
        [0, 0, 1, 0, 0, 0],
        [0, 0, 0, 1, 0, 0],
        [-K_S / M_B, K_S / M_B, -B_D / M_B, B_D / M_B, 0, 0],
        [K_S / M_W, -(K_S + K_T) / M_W, B_D / M_W, -(B_D + B_T) / M_W, K_T / M_W, B_T / M_W],
        [0, 0, 0, 0, 0, 1],
        [0, 0, 0, 0, 0, 0],
    ]
    return np.array(rows, dtype=float)


def without_friction(t: Array) -> Array:
    """Return X_b, X_w, v_b, v_w [m, m/s] at `t` [s] by a matrix exponential, shape (4, n)."""
    A, road = matrix(), heights(50)
    y, found = np.zeros(6), np.zeros((4, t.size))
    for k, (begin, end) in enumerate(pairwise(CORNERS)):
        y[4:] = road[k], (road[k + 1] - road[k]) / (end - begin)
        inside = np.flatnonzero((t >= begin) & (t <= end))
        for i in inside:
            found[:, i] = (expm(A * (t[i] - begin)) @ y)[:4]
        y = expm(A * (end - begin)) @ y
    return found


def with_friction(
    h: float, millimetres: int, C_e: float, e_1: float, mu: float, sigma_v: float
) -> tuple[Array, Array, Array]:
    """Return times [s], body [m] and friction [N] in steps of `h` [s]."""
    t = np.linspace(0.0, T_END, round(T_END / h) + 1)
    road = np.interp(t, CORNERS, heights(millimetres))
    slope = np.gradient(road, h).tolist()
    X_b = X_w = v_b = v_w = 0.0
    body, friction = np.zeros(t.size), np.zeros(t.size)
    for i, X_r in enumerate(road.tolist()):
        x = X_w - X_b
        f = K_S * x + B_D * (v_w - v_b)
        if v_b == 0.0 and abs(f) <= BREAK_AWAY:
            held = f
        else:
            side = copysign(1.0, v_b or f)
            lean = asin(x * cos(THETA) / (L_D - x * sin(THETA)))
            held = side * (C_e * exp(-abs(v_b) / e_1) + mu * abs(f) / tan(THETA - lean))
            held += sigma_v * v_b
            v_b += h / M_B * (f - held)
            v_b = v_b if side * v_b > 0 else 0.0
        body[i], friction[i] = X_b, held
        v_w += h / M_W * (K_T * (X_r - X_w) + B_T * (slope[i] - v_w) - f)
        X_b, X_w = X_b + h * v_b, X_w + h * v_w
    return t, body, friction


RESIDUAL = {"x_rel": (0.006362, 0.006366), "X_b": (0.096267, 0.096386)}
"""Residuals with and without Coulomb friction [m], table 1."""
RANGE = 0.135
"""Range of the body, section 7.4 [m]."""


def residuals(run: Trajectory) -> dict[str, float]:
    """Return the numbers of table 1, and the sizes of the signals themselves."""
    numbers: dict[str, float] = {}
    for name, (residual, without) in RESIDUAL.items():
        better = 100 * (1 - residual / without)
        numbers[f"residual of {name} in table 1 [m]"] = residual
        numbers[f"what Coulomb friction improves of {name} in table 1 [%]"] = better
        numbers[f"rms of {name} itself [m]"] = float(np.sqrt(np.mean(run[name] ** 2)))
        numbers[f"standard deviation of {name} [m]"] = float(np.std(run[name]))
    numbers["a constant leaves of a body between 0 and 0.135 m, at most [m]"] = RANGE / 2
    return numbers


def start(run: Trajectory) -> dict[str, float]:
    """Return the numbers of figure 7 and sections 5 and 7.2 on the first ramp."""
    x = np.interp([0.5, 1.5], run.t, run["x_rel"])
    return {
        "the body starts, 0.5 s in figure 7 [s]": float(run.t[np.argmax(run["X_b"] > 1e-4)]),
        "X_w - X_b at 0.5 s, at most 0.0069 m in the paper [m]": float(x[0]),
        "X_w - X_b at 1.5 s, zero or near zero in the paper [m]": float(x[1]),
    }


PLAY = BREAK_AWAY * (1 / K_S + 1 / K_T)
"""Largest distance of the body at rest from its position in the paper [m]."""


def overshoot(run: Trajectory) -> float:
    """Return the depth [m] to which the body falls below its last position."""
    return 0.035 - float(run["X_b"][run.t > STAGES["C"][0]].min())


def bodies(numbers: dict[str, float]) -> dict[str, bool]:
    """Return claims on the body for all choices of friction; add the ranges to `numbers`."""
    runs = [read(k) for k in range(len(READINGS))]
    rests = [
        abs(float(np.interp(end, run.t, run["X_b"])) - height)
        for run in runs
        for end, height in STAGES.values()
    ]
    starts, early, late = np.array([[*start(run).values()] for run in runs]).T
    free = numbers["overshoot after the last ramp, without friction [m]"]
    numbers |= {
        "farthest from where the paper has it at rest, ten readings [m]": max(rests),
        "X_w - X_b at 1.5 s, least [m]": float(late.min()),
        "X_w - X_b at 1.5 s, greatest [m]": float(late.max()),
    }
    return {
        "viscous friction from 1500 N s/m on halves the overshoot": all(
            overshoot(run) < free / 2
            for run, reading in zip(runs, READINGS, strict=True)
            if reading["sigma_v"] >= 1500
        ),
        "the body rests within break-away over both springs": max(rests) < PLAY,
        "it starts at 0.5 s, with X_w - X_b = 7 mm": (
            np.allclose(starts, 0.52, atol=0.02) and np.allclose(early, 0.007, atol=3e-4)
        ),
        "X_w - X_b at 1.5 s is anything from -4 to 5 mm": (
            -4e-3 < late.min() < -3e-3 < 4e-3 < late.max() < 5e-3
        ),
    }


def areas_and_speeds(run: Trajectory) -> tuple[list[float], list[float]]:
    """Return the area of the loop [N m/s] and the largest speed [m/s] of each ramp."""
    areas = [abs(run.area("friction", "v_b", between)) for between in RAMPS.values()]
    speeds = [
        float(np.abs(run["v_b"][(run.t >= a) & (run.t <= b)]).max()) for a, b in RAMPS.values()
    ]
    return areas, speeds


def loops(numbers: dict[str, float]) -> dict[str, bool]:
    """Return claims on the loops for all choices of friction; add the ranges to `numbers`."""
    both = np.array([areas_and_speeds(read(k)) for k in range(len(READINGS))])
    ratios, speeds = (both[:, :, 2] / both[:, :, 1]).T
    numbers |= {
        "the same, least of ten readings [1]": float(ratios.min()),
        "the same, greatest [1]": float(ratios.max()),
        "speed on the third ramp over that on the second, least [1]": float(speeds.min()),
        "speed on the third ramp over that on the second, greatest [1]": float(speeds.max()),
    }
    return {
        "the third loop is 1.2 ... 2.0 times the second": (
            np.allclose([ratios.min(), ratios.max()], [1.2, 2.0], atol=0.05)
        ),
        "the speed is 1.6 times, in all readings": np.allclose(speeds, 1.62, atol=0.04),
        "the first loop is not always the smallest": any(both[:, 0, 0] > both[:, 0, 1]),
    }


def as_printed(run: Trajectory, mu: float) -> np.ndarray:
    """Return Coulomb friction [N] with the sign of the force of the strut."""
    x = run["x_rel"]
    strut = K_S * x + B_D * (run["v_w"] - run["v_b"])
    lean = np.arcsin(x * np.sin(THETA) / (L_D - x * np.sin(THETA)))
    return mu * strut / np.tan(THETA - lean)


def driven(run: Trajectory, mu: float) -> tuple[float, float]:
    """Return the least power [W] of Coulomb friction as printed, and the share that it drives."""
    moves = np.abs(run["v_b"]) > 1e-3
    power = (as_printed(run, mu) * run["v_b"])[moves]
    return float(power.min()), float(np.mean(power < 0))
