"""Generalised Maxwell-slip friction with ten elements from hysteresis and sliding.

A slide moves for half a minute by a few micrometres with nested reversals, and for four seconds at
up to five times the Stribeck velocity; the force has 1 % noise. Initial values of the elements
solve a convex problem (springs and sliders that explain the force along the path); those of levels
and Stribeck velocity follow from bins of the fast record. Then both records are fitted together
under the measured velocity with all stiffnesses and shares free. Only ratios of shares matter, so
one of them is fixed. Elements begin to slip between samples, so the residuals have kinks, at which
a descent may stop before the minimum; the fit uses eight starts, and its status reports such a
stop. The last line compares the fitted with the true law on another path, in units of the noise.

    python examples/identify_gms.py [OUT]

Source of levels, lag and Stribeck velocity: Lampaert, Al-Bender, Swevers, Phys. Conf. 2003.
"""

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.residuals.points import Points
from symfric import GMS, Element, Hold, simulate
from symfric.laws import Law
from symfric.scenes import Prescribed

Array = NDArray[np.float64]

COUNT, NOISE, UM = 10, 0.01, 1e-6
KNOWN = {"mu_s": 1.05, "mu_d": 0.2, "v_s": 98 * UM, "delta": 0.78, "C": 24.0}


def true_law() -> GMS:
    """Return ten elements that slip between 0.1 and 10 um."""
    rng = np.random.default_rng(3)
    radii = np.sort(np.geomspace(8e-8, 9e-6, COUNT) * np.exp(0.25 * rng.standard_normal(COUNT)))
    shares = rng.uniform(0.5, 1.5, COUNT) / COUNT
    elements = (Element(1.05 * a / r, a) for a, r in zip(shares.tolist(), radii, strict=True))
    return GMS(elements=tuple(elements), form="event", **KNOWN)


def forces(law: Law, t: Array, x: Array) -> Array:
    """Return the force along a path of straight pieces between samples, after sliding."""
    v = np.diff(x) / np.diff(t)
    model = Prescribed(law, N=1.0).model()
    sliding = np.ravel(law.steady_state(float(v[0]), 1.0))
    start = dict(zip((state.name for state in model.x[1:]), sliding, strict=True))
    run = simulate(model, float(t[-1]), x0=start, u={"v": Hold(t[:-1], v)}, t_eval=t)
    return run["friction"]


def slow(*turns: tuple[float, float]) -> tuple[Array, Array]:
    """Half a minute of sines of the given amplitudes [um] and frequencies [Hz]."""
    t = np.arange(0.0, 30.0, 0.02)
    return t, UM * np.sum([a * np.sin(2 * np.pi * f * t) for a, f in turns], axis=0)


def record(law: Law, path: tuple[Array, Array], name: str, seed: int) -> Dataset:
    """Velocity and noisy force along a path."""
    t, x = path
    F = forces(law, t, x) + NOISE * np.random.default_rng(seed).standard_normal(t.size)
    return Dataset.of(t=t, v=np.gradient(x, t), F=F, units={"v": "m/s", "F": "N"}, name=name)


def main(out: Path) -> None:
    """Simulate the records, fit, print, and write a picture into `out`."""
    law, t = true_law(), np.arange(0.0, 4.0, 4e-3)
    fast = t, 80 * UM * np.sin(2 * np.pi * t) * np.sin(0.25 * np.pi * t + 0.5)
    data = record(law, slow((5, 0.05), (2, 0.13), (1, 0.31)), "slow", 0)
    data += record(law, fast, "fast", 1)

    ten = GMS(elements=tuple(Element(1e5, 1 / COUNT) for _ in range(COUNT)), form="event")
    shares = [f"alpha_{i}" for i in range(1, COUNT)]
    free = ["delta", "C", *(f"k_{i}" for i in range(1, COUNT + 1)), *shares]
    fixed = {"sigma_2": 0.0, f"alpha_{COUNT}": 1 / COUNT}
    fit = Fit(Points(), ten, data, free=free, fixed=fixed, starts=8, evaluations=120).solve(
        throw=False
    )
    fit.plot(out / "gms.png")

    if fit.law is None:
        raise SystemExit("the fit has no law")
    path = slow((4, 0.07), (3, 0.11), (0.7, 0.43))
    wrong = forces(fit.law, *path) - forces(law, *path)
    print(fit)
    print(f"another path: {np.sqrt(np.mean(wrong**2)) / NOISE:.3f} of the noise")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
