"""The rig of the paper on a road of 30, 50 or 70 mm, by `simulate`, and once more by hand.

By hand it uses nothing of `symfric`: exactly without friction, else in small steps. The body sticks
until the strut's force exceeds break-away, and stops where its velocity crosses zero; in between
its friction is equation 12 with the signs that the text asks for.
"""

from collections.abc import Mapping
from functools import cache
from itertools import pairwise
from math import asin, copysign, cos, exp, pi, sin, tan

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from symfric import QuarterCarGeneral, Trajectory, simulate, with_values
from symfric.laws import Law
from symfric.scenes import QuarterCar

START, FIRST, RAMP, HOLD, T_END = 0.3, 2.4, 1.0, 2.0, 12.0  # s
"""Times of the road; START and FIRST follow from the text and are those of the preset (figure 11),
the others are ours."""
STAGES = {"A": (START, 0.0), "B": (4.7, 0.085), "C": (7.7, 0.135), "D": (T_END, 0.035)}
"""End of each rest [s], and where the paper says that the body is then [m]."""
FRICTION = {"C_e": 180.0, "e_1": 0.01, "mu": 0.05, "sigma_v": 1500.0}
"""Friction of the general law [N, m/s, 1, N s/m]; not in the paper."""
WEAK = {"C_e": 120.0, "e_1": 0.02, "mu": 0.08, "sigma_v": 80.0}
"""Another reading of the numbers that the paper does not give, weakly viscous."""
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
"""Over what the invented numbers may be: what is said of the paper holds for each."""
RAMPS = {
    name: (begin, end)
    for name, (begin, end) in zip(
        ("first", "second", "third"), pairwise(end for end, _ in STAGES.values()), strict=True
    )
}
"""Ramp and the rest behind it: first and last time [s]."""


def general(numbers: Mapping[str, float] = FRICTION, form: str = "smooth") -> QuarterCarGeneral:
    """The general law in narrow windows [m/s, N], since the paper's has none."""
    return with_values(QuarterCarGeneral(v_eps=2e-4, F_eps=0.1, form=form), numbers)


@cache
def read(number: int) -> Trajectory:
    """A run with one of READINGS."""
    return ride(general(READINGS[number]))


def ride(law: Law, millimetres: int = 50, samples: int = 6001) -> Trajectory:
    """A run of the rig with `law` in its guide."""
    name = f"al_zughaibi_{millimetres}_mm"
    car = QuarterCar.preset(name, law, t_ramp=RAMP, t_hold=HOLD)
    return simulate(car.model(), T_END, rtol=1e-8, samples=samples)


Array = NDArray[np.float64]

M_B, M_W, K_S, B_D, K_T, B_T = 240.0, 40.0, 28900.0, 260.0, 920000.0, 3886.0
THETA, L_D, BREAK_AWAY = pi / 4, 0.4, 193.8
CORNERS = np.cumsum([0.0, START, FIRST, HOLD, RAMP, HOLD, RAMP, T_END])
"""Times at which the road bends [s]."""


def heights(millimetres: int) -> Array:
    """Height of the road at its corners [m]."""
    up, down = 0.085 + 1e-3 * millimetres, 0.085 - 1e-3 * millimetres
    return np.array([0.0, 0.0, 0.085, 0.085, up, up, down, down])


def matrix() -> Array:
    """Of the linear equations of body, wheel, their velocities, the road and its slope."""
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
    """X_b, X_w, v_b, v_w [m, m/s] at `t` [s] by the exponential of a matrix, shape (4, n)."""
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
    """Times [s], body [m] and friction [N] in steps of `h` [s]."""
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
