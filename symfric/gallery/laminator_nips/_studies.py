"""Points like those of the two studies, and their parameters found again."""

from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from identification import Dataset, Fit, Points, six_steps
from symfric import SteadyStateLuGre
from symfric.foundation.style import QUIET, Line
from symfric.gallery.looks import look

Array = NDArray[np.float64]

PRINTED = {"pilot": SteadyStateLuGre.pilot(), "main": SteadyStateLuGre.main()}
"""Tables 5.1 and 5.2."""
SLOWEST = {"pilot": 10, "main": 100}  # mm/min, in steps of 10 up to 500
UNSTABLE = 140 / 60e3
"""Speed up to which the sled moved in stick-slip, says the thesis [m/s]."""
SMOOTH, ROUGH = 0.03, 0.14
"""Scatter of the mean of nine above this speed and below, chosen for the 8 % of the pilot study."""
NOISES = 60
"""Over how many noises a statement is checked."""
UNITS = {"F_S": "N", "F_C": "N", "v_s": "m/s", "sigma_2": "N s/m", "delta": "1"}
NAMES = tuple(UNITS)
LINES: dict[str, tuple[Line, float]] = {
    "printed": ({"color": QUIET, "linestyle": "-"}, 4.0),
    "all at once": (look("lugre"), 1.4),
    "six steps": (look("dahl"), 1.4),
}


def curve(law: SteadyStateLuGre, v: Array) -> Array:
    """Equation 4.1 at speeds `v` > 0 [m/s]: force [N], without `symfric`."""
    F_S, F_C, v_s, sigma_2, delta = (float(getattr(law, name)) for name in NAMES)
    return F_C + (F_S - F_C) * np.exp(-((v / v_s) ** delta)) + sigma_2 * v


def measured(study: str, seed: int = 0, stable: bool = False) -> tuple[Array, Array]:
    """Speeds [m/s] and mean forces [N], the printed curve with noise; stable speeds if wanted."""
    v = np.arange(SLOWEST[study], 501, 10) / 60e3
    scatter = np.where(v <= UNSTABLE, ROUGH, SMOOTH)
    noise = np.random.default_rng(seed).standard_normal(v.size)
    force = curve(PRINTED[study], v) * (1 + scatter * noise)
    kept = v > UNSTABLE if stable else v > 0
    return v[kept], force[kept]


def at_once(v: Array, force: Array) -> tuple[SteadyStateLuGre, Mapping[str, float]]:
    """The law by least squares of all points, and half the 95 % intervals that are known."""
    data = Dataset.of(v=v, F=force, units={"v": "m/s", "F": "N"}, points=True, name="means")
    fit = Fit(Points(), SteadyStateLuGre(), data, free=["delta"]).solve(throw=False)
    found = {name: fit.parameters[name] for name in NAMES}
    told = {
        name: (e.high - e.low) / 2
        for name, e in found.items()
        if e.low is not None and e.high is not None
    }
    return SteadyStateLuGre(**{name: e.value for name, e in found.items()}), told


def in_steps(v: Array, force: Array) -> SteadyStateLuGre | None:
    """The law by the six steps of section 4.2; None where one of them finds no number."""
    found = six_steps(v, force, unstable=UNSTABLE)
    return found.law if np.isfinite([*found.values.values()]).all() else None


def error(law: SteadyStateLuGre, v: Array, force: Array) -> float:
    """Root mean square of equation 4.3, over the mean force."""
    return float(np.sqrt(np.mean((force - curve(law, v)) ** 2)) / force.mean())


def draw_curves(
    axis: Axes, v: Array, force: Array, laws: Mapping[str, SteadyStateLuGre], end: float = 0.0
) -> None:
    """Points, and laws through them: the printed one grey, those found again in front."""
    fine = np.linspace(v[0], end or v[-1], 400)
    axis.plot(v, force, "o", color="k", markersize=3, label="means with noise")
    for name, law in laws.items():
        mark, width = LINES[name]
        axis.plot(fine, curve(law, fine), **mark, linewidth=width, label=name)
    axis.set_ylabel("friction force [N]")
    axis.legend(fontsize="small", ncols=2)


def draw_errors(axes: list[Axes], v: Array, force: Array, law: SteadyStateLuGre) -> None:
    """Absolute error, and in percent of the measured force."""
    left = np.abs(force - curve(law, v))
    for axis, values, label in zip(
        axes, (left, 100 * left / force), ("error [N]", "error [%]"), strict=True
    ):
        axis.bar(v, values, width=1.2e-4, color=look("lugre")["color"])
        axis.set_ylabel(label)
    axes[-1].set_xlabel("velocity [m/s]")


def told(laws: Mapping[str, SteadyStateLuGre], half: Mapping[str, float]) -> dict[str, float]:
    """Parameters of laws side by side, and half the 95 % intervals."""
    numbers = {
        f"{name} {way} [{unit}]": float(getattr(law, name))
        for name, unit in UNITS.items()
        for way, law in laws.items()
    }
    return numbers | {
        f"{name}, half its 95 % interval [{UNITS[name]}]": h for name, h in half.items()
    }


@cache
def found(study: str, stable: bool = False, count: int = NOISES) -> tuple[SteadyStateLuGre, ...]:
    """The law found at once with each of `count` noises; from stable speeds alone if wanted."""
    return tuple(at_once(*measured(study, seed, stable))[0] for seed in range(count))


def shares(laws: Sequence[SteadyStateLuGre], study: str) -> dict[str, Array]:
    """Each parameter over the printed one, for every law."""
    return {
        name: np.array([float(getattr(law, name)) for law in laws])
        / float(getattr(PRINTED[study], name))
        for name in NAMES
    }


def scatter(study: str) -> dict[str, float]:
    """Spread of each parameter over all noises, by both ways: half the middle 68 % [%]."""
    by_steps = [in_steps(*measured(study, seed)) for seed in range(NOISES)]
    ways = {"all at once": found(study), "six steps": [law for law in by_steps if law is not None]}
    numbers: dict[str, float] = {}
    for way, laws in ways.items():
        numbers[f"of {NOISES} noises without a curve, {way} [1]"] = NOISES - len(laws)
        for name, values in shares(laws, study).items():
            low, high = np.percentile(values, [16, 84])
            numbers[f"{name}, spread, {way} [%]"] = 50 * float(high - low)
    points = [measured(study, seed) for seed in range(NOISES)]
    errors = [100 * error(law, *at) for law, at in zip(found(study), points, strict=True)]
    ratios = [
        100 * error(law, *at) / once
        for law, at, once in zip(by_steps, points, errors, strict=True)
        if law is not None
    ]
    return (
        numbers
        | percentiles("error of the curve, all at once", "%", errors)
        | percentiles("error of the six steps over that", "1", ratios)
    )


def percentiles(what: str, unit: str, values: Sequence[float]) -> dict[str, float]:
    """Of all noises: the median, and between what the middle 68 % lie."""
    low, middle, high = np.percentile(values, [16, 50, 84]).tolist()
    return {
        f"{what}, median of {NOISES} noises [{unit}]": middle,
        f"{what}, 16th percentile [{unit}]": low,
        f"{what}, 84th percentile [{unit}]": high,
    }


def without_unstable(study: str) -> dict[str, float]:
    """Lowest and highest F_s over all noises, found from the stable speeds alone [N]."""
    levels = [float(law.F_S) for law in found(study, stable=True)]
    said = f"of {NOISES} noises, without the unstable speeds [N]"
    return {f"F_S, lowest {said}": min(levels), f"F_S, highest {said}": max(levels)}
