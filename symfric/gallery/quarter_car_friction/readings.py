"""Numbers that the paper prints, and what holds in all readings of those that it leaves open."""

import numpy as np

from symfric import Trajectory
from symfric.gallery.quarter_car_friction import rig

RESIDUAL = {"x_rel": (0.006362, 0.006366), "X_b": (0.096267, 0.096386)}
"""Table 1: residuals with Coulomb friction and without [m]."""
RANGE = 0.135
"""Of the body, section 7.4 [m]."""


def residuals(run: Trajectory) -> dict[str, float]:
    """Table 1, and how large the signals themselves are."""
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
    """Numbers of figure 7 and sections 5 and 7.2 on the first ramp."""
    x = np.interp([0.5, 1.5], run.t, run["x_rel"])
    return {
        "the body starts, 0.5 s in figure 7 [s]": float(run.t[np.argmax(run["X_b"] > 1e-4)]),
        "X_w - X_b at 0.5 s, at most 0.0069 m in the paper [m]": float(x[0]),
        "X_w - X_b at 1.5 s, zero or near zero in the paper [m]": float(x[1]),
    }


PLAY = rig.BREAK_AWAY * (1 / rig.K_S + 1 / rig.K_T)
"""Largest distance of the body at rest from its place in the paper [m]."""


def overshoot(run: Trajectory) -> float:
    """Depth to which the body falls below its last place [m]."""
    return 0.035 - float(run["X_b"][run.t > rig.STAGES["C"][0]].min())


def bodies(numbers: dict[str, float]) -> dict[str, bool]:
    """Claims on the body in all readings of the friction; adds the ranges to `numbers`."""
    runs = [rig.read(k) for k in range(len(rig.READINGS))]
    rests = [
        abs(float(np.interp(end, run.t, run["X_b"])) - height)
        for run in runs
        for end, height in rig.STAGES.values()
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
            for run, reading in zip(runs, rig.READINGS, strict=True)
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
    """Area of the loop [N m/s] and largest speed [m/s] of each ramp."""
    areas = [abs(run.area("friction", "v_b", between)) for between in rig.RAMPS.values()]
    speeds = [
        float(np.abs(run["v_b"][(run.t >= a) & (run.t <= b)]).max()) for a, b in rig.RAMPS.values()
    ]
    return areas, speeds


def loops(numbers: dict[str, float]) -> dict[str, bool]:
    """Claims on the loops in all readings of the friction; adds the ranges to `numbers`."""
    both = np.array([areas_and_speeds(rig.read(k)) for k in range(len(rig.READINGS))])
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
    """Coulomb friction with the sign of the strut's force [N]."""
    x = run["x_rel"]
    strut = rig.K_S * x + rig.B_D * (run["v_w"] - run["v_b"])
    lean = np.arcsin(x * np.sin(rig.THETA) / (rig.L_D - x * np.sin(rig.THETA)))
    return mu * strut / np.tan(rig.THETA - lean)


def driven(run: Trajectory, mu: float) -> tuple[float, float]:
    """Least power of Coulomb friction as printed [W], and the share of the motion it drives."""
    moves = np.abs(run["v_b"]) > 1e-3
    power = (as_printed(run, mu) * run["v_b"])[moves]
    return float(power.min()), float(np.mean(power < 0))
