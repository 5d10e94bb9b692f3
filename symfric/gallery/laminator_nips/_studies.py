"""Points like those of the two studies, and their parameters found again."""

from collections.abc import Callable, Mapping

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


def measured(study: str, seed: int = 0) -> tuple[Array, Array]:
    """Speeds [m/s] and mean forces [N], the printed curve with noise."""
    v = np.arange(SLOWEST[study], 501, 10) / 60e3
    scatter = np.where(v <= UNSTABLE, ROUGH, SMOOTH)
    noise = np.random.default_rng(seed).standard_normal(v.size)
    return v, curve(PRINTED[study], v) * (1 + scatter * noise)


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


def scatter(study: str, count: int) -> dict[str, float]:
    """Spread of each parameter over `count` noises, by both ways: half the middle 68 % [%]."""
    ways: dict[str, Callable[[Array, Array], SteadyStateLuGre | None]] = {
        "all at once": lambda v, force: at_once(v, force)[0],
        "six steps": in_steps,
    }
    spread: dict[str, float] = {}
    for way, identified in ways.items():
        laws = [identified(*measured(study, seed)) for seed in range(count)]
        found = [law for law in laws if law is not None]
        spread[f"of {count} noises without a curve, {way} [1]"] = count - len(found)
        for name in NAMES:
            low, high = np.percentile([float(getattr(law, name)) for law in found], [16, 84])
            printed = float(getattr(PRINTED[study], name))
            spread[f"{name}, spread, {way} [%]"] = 50 * float(high - low) / printed
    return spread


def without_unstable(study: str, count: int) -> dict[str, float]:
    """Lowest and highest F_s over `count` noises, found from the stable speeds alone [N]."""
    found: list[float] = []
    for seed in range(count):
        v, force = measured(study, seed)
        stable = v > UNSTABLE
        found.append(float(at_once(v[stable], force[stable])[0].F_S))
    said = f"of {count} noises, without the unstable speeds [N]"
    return {f"F_S, lowest {said}": min(found), f"F_S, highest {said}": max(found)}
