"""The force of figure 8: it breaks the block away, lets it stop, and vibrates."""

from collections.abc import Callable

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.gallery.generalized_maxwell_slip._laws import F_C

Array = NDArray[np.float64]

PEAK, RISE, FALL = 1.1, 0.5, 0.05  # N, s, s
BASE, SWING, FREQUENCY, SINCE = 0.1, 0.05, 2.0, 4.0  # N, N, Hz, s
MASS = 1.0  # kg; not in the paper


def force(t: ca.SX) -> ca.SX:
    """Force on the block [N] at time t [s]."""
    back = PEAK - (PEAK - BASE) * (t - RISE) / FALL
    push = ca.if_else(t < RISE, PEAK * t / RISE, ca.fmax(BASE, back))
    swing = SWING * ca.sin(2 * ca.pi * FREQUENCY * (t - SINCE))
    return push + ca.if_else(t < SINCE, 0.0, swing)


def stop_of(level: float) -> float:
    """When a block that a constant force `level` [N] brakes comes to rest [s].

    It moves from where the push reaches the level; its momentum is the area between push and level.
    """
    begin = level / PEAK * RISE
    crossing = RISE + FALL * (PEAK - level) / (PEAK - BASE)
    momentum = (PEAK - level) * (crossing - begin) / 2
    slow = (level - BASE) * (RISE + FALL - crossing) / 2
    return RISE + FALL + (momentum - slow) / (level - BASE)


def drift_of(stiffness: float, level: Callable[[Array], Array]) -> float:
    """Way in a period of vibration of a bristle of which `level` [N] is the force in sliding [m].

    v (1 - F sign(v) / level(v)) = (dF/dt) / stiffness with F the applied force: no inertia.
    """
    turn = 2 * np.pi * FREQUENCY
    t = (np.arange(20_000) + 0.5) / 20_000 / FREQUENCY
    F, rate = BASE + SWING * np.sin(turn * t), SWING * turn * np.cos(turn * t)
    v = rate / stiffness
    for _ in range(50):
        v = rate / stiffness / (1 - F * np.sign(rate) / level(v))
    return float(np.mean(v) / FREQUENCY)


def in_periods(t: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Mean position in each period of the vibration [m]."""
    steps = round(1 / (FREQUENCY * (t[1] - t[0])))
    late = x[np.argmax(t >= SINCE) : -1]
    return late[: late.size // steps * steps].reshape(-1, steps).mean(axis=1)


def said(numbers: dict[str, float], names: list[str], quick: bool) -> dict[str, bool]:
    """The claims on the ways and the break-aways."""
    first, last, rate, least = (
        {name: numbers[f"{key}, {name}{end}"] for name in names}
        for key, end in (
            ("way in the first periods", " [m]"), ("way in the last periods", " [m]"),
            ("break-away at 1 N/s over that at 10 N/s", " [1]"), ("least break-away", " [N]"),
        )
    )  # fmt: skip
    claims = {
        "LuGre and Dahl drift": min(last["LuGre"], last["Dahl"]) > 1e-7,
        "ringing LuGre drifts more than three times as fast": first["LuGre"] > 3 * last["LuGre"],
        "break-away falls with the rate, but for Maxwell slip and Dahl": all(
            (r > 1.02) == (name not in ("Maxwell slip", "Dahl")) for name, r in rate.items()
        ),
        "it stays at F_c or above": min(least.values()) > 0.999 * F_C,
    }
    if not quick:
        stay = ("GMS", "Leuven", "Maxwell slip", "generic model")
        claims["GMS, Leuven, Maxwell slip and the generic model stay"] = all(
            abs(last[name]) < 2e-10 for name in stay
        )
        claims["the elasto-plastic law nearly stops"] = (
            last["elasto-plastic"] < 0.03 * first["elasto-plastic"]
        )
    return claims
