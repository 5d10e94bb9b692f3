"""Generalised Maxwell-slip friction with ten elements from hysteresis and sliding."""

from collections.abc import Iterator
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.residuals.points import Points
from identification.result.fitted import Fitted
from identification.select import Ranking, select
from identification.starts.maxwell_slip import fit_elements
from identification.starts.measured import Measured
from symfric import GMS, Element, MaxwellSlip, Slider
from symfric.bench.identification import Row
from symfric.laws import Law

Array = NDArray[np.float64]

NOISE = 0.01
"""Standard deviation of the measured force [N], of 1 N."""
MICRO = 1e-6
TURNS = {
    "hysteresis": ((5.0, 0.05), (2.0, 0.13), (1.0, 0.31)),
    "other": ((4.0, 0.07), (3.0, 0.11), (0.7, 0.43)),
}
"""Amplitudes [um] and frequencies [Hz] of slow paths."""


def measure(quick: bool) -> Iterator[Row]:
    """A law fitted to a slow path and a fast one, and what it says of another path."""
    count, thin = (4, 2) if quick else (10, 1)
    law, rng = _true(count), np.random.default_rng(1)
    paths = [_slow("hysteresis", 0.02 * thin), _fast(2e-3 * thin)]
    begun = process_time()
    elements = _elements(law, paths[0], rng)
    yield Row(
        "gms", f"Maxwell-slip, {count} elements: error of the true force over the noise",
        elements, 0.3, "<=", process_time() - begun, "convex, then radii; no start values",
    )  # fmt: skip
    begun = process_time()
    fit = _fitted(law, count, paths, rng)
    seconds = process_time() - begun
    left = max(e.rms for e in fit.errors.values()) / NOISE
    yield Row("gms", f"GMS, {count} elements: residual over the noise", left, 1.1, "<=", seconds)
    if fit.law is not None:
        t, x = _slow("other", 0.02)
        wrong = forces(fit.law, t, x) - forces(law, t, x)
        value = float(np.sqrt(np.mean(wrong**2))) / NOISE
        yield Row("gms", "the same on another path: error over the noise", value, 1.0, "<=", 0.0)
    for name, true in (("mu_s", 1.05), ("v_s", 98 * MICRO), ("C", 24.0)):
        off = 100 * abs(fit.parameters[name].value / true - 1)
        yield Row("gms", f"error of {name} [%]", off, 10.0, "<=", 0.0)
    begun = process_time()
    ranking = ranked()
    gms, lugre = (ranking[name].validation for name in ("gms", "lugre"))
    yield Row(
        "gms", "GMS data: error of LuGre on another path over that of GMS", lugre / gms, 1.0, ">=",
        process_time() - begun, f"LuGre is called {ranking['lugre'].status}",
    )  # fmt: skip


def ranked() -> Ranking:
    """GMS with equal shares and LuGre on data of four unequal elements, judged on another path."""
    law, rng = _true(4), np.random.default_rng(0)
    slow, fast, other = (
        _record(law, path, name, rng)
        for path, name in (
            (_slow("hysteresis", 0.04), "hysteresis"),
            (_fast(4e-3), "sliding"),
            (_slow("other", 0.04), "other path"),
        )
    )
    laws = {"lugre": "lugre", "gms": GMS(form="event")}
    return select(laws, slow + fast, Points(), validate=other, starts=2, evaluations=60)


def _true(count: int) -> GMS:
    """Levels, lag and Stribeck curve of the paper (Lampaert et al. 2003), elements at random."""
    rng = np.random.default_rng(3)
    radii = np.sort(np.geomspace(8e-8, 9e-6, count) * np.exp(0.25 * rng.standard_normal(count)))
    shares = rng.uniform(0.5, 1.5, count)
    shares /= shares.sum()
    return _gms(1.05 * shares / radii, shares)


def _gms(k: Array, shares: Array) -> GMS:
    elements = tuple(Element(float(a), float(b)) for a, b in zip(k, shares, strict=True))
    known = {"mu_s": 1.05, "mu_d": 0.2, "v_s": 98 * MICRO, "delta": 0.78, "C": 24.0}
    return GMS(elements=elements, form="event", **known)


def _slow(name: str, step: float) -> tuple[Array, Array]:
    """A path of some micrometres with turns inside turns, for a minute."""
    t = np.arange(0.0, 60.0, step)
    return t, MICRO * np.sum([a * np.sin(2 * np.pi * f * t) for a, f in TURNS[name]], axis=0)


def _fast(step: float) -> tuple[Array, Array]:
    """Sliding up to five times the Stribeck velocity, both ways."""
    t = np.arange(0.0, 4.0, step)
    return t, 80 * MICRO * np.sin(2 * np.pi * t) * np.sin(0.25 * np.pi * t + 0.5)


def forces(law: Law, t: Array, x: Array) -> Array:
    """Force along a path after sliding in its first direction, exact for straight pieces [N]."""
    v = np.diff(x) / np.diff(t)
    z: Any = law.steady_state(float(v[0]), 1.0)
    found = [float(np.asarray(law.force(float(v[0]), 1.0, z)))]
    for speed, h in zip(v.tolist(), np.diff(t).tolist(), strict=True):
        step = law.held_step(speed, 1.0, z, h)
        if step is None:
            raise ValueError(f"forces: expected a law that steps exactly, got {type(law).__name__}")
        z = np.asarray(step[0], float).ravel()
        found.append(float(np.asarray(law.force(speed, 1.0, z))))
    return np.array(found)


def _record(law: Law, path: tuple[Array, Array], name: str, rng: np.random.Generator) -> Dataset:
    """Velocity and noisy force along a path."""
    t, x = path
    F = forces(law, t, x) + NOISE * rng.standard_normal(t.size)
    return Dataset.of(t=t, v=np.gradient(x, t), F=F, units={"v": "m/s", "F": "N"}, name=name)


def _elements(law: GMS, path: tuple[Array, Array], rng: np.random.Generator) -> float:
    """Error over the noise of elements found from a record of the same elements without fall."""
    t, x = path
    sliders = tuple(Slider(float(e.k), float(e.alpha)) for e in law.elements)
    true = forces(MaxwellSlip(elements=sliders, form="event"), t, x)
    v = np.gradient(x, t)
    noisy = Measured(v, true + NOISE * rng.standard_normal(t.size), x, t)
    found = fit_elements(noisy, len(sliders))
    return float(np.sqrt(np.mean((found.force(noisy) - true) ** 2))) / NOISE


def _fitted(
    law: GMS, count: int, paths: list[tuple[Array, Array]], rng: np.random.Generator
) -> Fitted:
    """Everything from the data's own start; the share of the strongest element is held."""
    records = [
        _record(law, path, name, rng)
        for path, name in zip(paths, ("hysteresis", "sliding"), strict=True)
    ]
    data = records[0] + records[1]
    t, x = paths[0]
    slow = Measured(np.gradient(x, t), records[0][0]["F"], x, t)
    strongest = int(np.argmax(fit_elements(slow, count).levels)) + 1
    shares = [f"alpha_{i + 1}" for i in range(count) if i + 1 != strongest]
    free = ["delta", "C", *(f"k_{i + 1}" for i in range(count)), *shares]
    start = _gms(np.full(count, 1e5), np.full(count, 1 / count))
    fit = Fit(Points(), start, data, free=free, fixed={"sigma_2": 0.0}, starts=4, evaluations=150)
    return fit.solve(throw=False)
