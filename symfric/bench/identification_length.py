"""Processor time and memory of identification by the number of samples."""

import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

from identification import Dataset, Fit, InverseDynamics
from symfric.bench.report import Found, goal, timed

STEP, MASS, LEVEL, PEAK, VISCOUS, NOISE = 1e-3, 2.0, 5.0, 2.0, 3.0, 0.05
"""Step [s], mass [kg], Coulomb level, Stribeck peak at 0.02 m/s and noise of the force [N], viscous
coefficient [N s/m]."""
SIZES = (10_000, 100_000, 1_000_000)
TITLE = "Processor time and memory by samples"
GOALS = {"check": 0.2, "linear": 1.0, "nonlinear": 10.0}
"""Processor time for 1e6 samples [s]."""


def stage(n: int, peak: float = 0.0) -> Dataset:
    """Return a record of n samples of a drive with position, velocity and noisy force."""
    t = STEP * np.arange(n)
    x, v, a = np.zeros((3, n))
    for w, size in ((np.pi, 0.05), (3.1 * np.pi, 0.02)):
        x += size * np.sin(w * t)
        v += size * w * np.cos(w * t)
        a -= size * w**2 * np.sin(w * t)
    force = MASS * a + (LEVEL + peak * np.exp(-((v / 0.02) ** 2))) * np.sign(v) + VISCOUS * v
    force += NOISE * np.random.default_rng(0).standard_normal(n)
    return Dataset.of(t=t, x=x, v=v, force=force)


def length(quick: bool) -> Iterator[Found]:
    """Measure reading, checks, and fits of laws that are linear in their parameters and not.

    Fits are by inverse dynamics with default settings. A small fit before loads all libraries.
    """
    for n in SIZES[: 1 if quick else 3]:
        found = measured(n)
        yield TITLE, {"samples": float(n), **found}
        for name, limit in GOALS.items() if n == SIZES[-1] else ():
            yield goal(f"{name}, {n} samples, s", found[f"{name} [s]"], limit)


def measured(n: int) -> dict[str, float]:
    """Return processor times [s], and the largest memory of the process until the first fit."""
    import resource  # noqa: PLC0415  (absent on Windows)

    kind, found = InverseDynamics(), dict[str, float]()
    with tempfile.TemporaryDirectory() as folder:
        (path,) = stage(n).to_csv(Path(folder) / "run.csv")
        found["read [s]"], data = timed(partial(Dataset.read, path))
    for law, some, name in (
        ("coulomb+viscous", data, "linear"), ("stribeck", stage(n, PEAK), "nonlinear")
    ):  # fmt: skip
        Fit(kind, law, some.between(0.0, 5.0)).solve(throw=False)
        found[f"{name} [s]"], _ = timed(partial(Fit(kind, law, some).solve, throw=False))
        if name == "linear":
            found["check [s]"], _ = timed(data.check)
            found["memory [MB]"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return found
