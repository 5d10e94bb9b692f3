"""Made-up residuals: noise of known colour, a linear fit of it, and a decay that is fitted."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import final

import numpy as np

from identification.residuals.evaluation import Channel, Evaluation
from identification.solving.descent import descend
from identification.solving.task import Point, Task, task
from identification.unknowns.spec import Unknown
from identification.unknowns.unknowns import unknowns_of
from identification.verdict.minimum import Minimum
from symfric.foundation.numeric import Array

STEP = 0.02


def ar1(n: int, rho: float, seed: int) -> Array:
    """Stationary AR(1) noise with unit innovations."""
    w = np.random.default_rng(seed).standard_normal(n)
    w[0] /= np.sqrt(1 - rho**2)
    e = w.copy()
    for k in range(1, n):
        e[k] += rho * e[k - 1]
    return e


def motion(n: int) -> dict[str, Array]:
    """A force and the motion that goes with it."""
    t = STEP * np.arange(n)
    v = np.sin(2 * np.pi * 0.31 * t) * np.sin(2 * np.pi * 0.023 * t + 1)
    return {"v": v, "x": STEP * np.cumsum(v), "force": np.sin(4.4 * t) + np.sin(12 * t + 1) / 2}


def coulomb(n: int) -> Array:
    """Sensitivities of a mass, a Coulomb and a viscous force and an offset, (n, 4)."""
    v = motion(n)["v"]
    return np.column_stack([np.gradient(v, STEP), np.tanh(v / 0.02), v, np.ones(n)])


def fitted(
    J: Array,
    measured: Array,
    unknowns: tuple[Unknown, ...] | None = None,
    regressors: Mapping[str, Array] | None = None,
    noise: Mapping[str, float] | None = None,
    change: Callable[[Array], float] | None = None,
) -> Minimum:
    """The minimum of a linear fit J p = measured."""
    n, k = J.shape
    p, *_ = np.linalg.lstsq(J, measured, rcond=None)
    channel = Channel(
        0, "force", "N", slice(0, n), STEP * np.arange(n), measured, regressors or motion(n)
    )
    unknowns = unknowns or tuple(Unknown(f"p{i}", "1", 1.0) for i in range(k))
    r = J @ p - measured
    names, free = tuple(u.name for u in unknowns), np.zeros(k, dtype=bool)
    return Minimum(
        (channel,), unknowns, names, p, np.eye(k), free, r, J, np.ones(n), r, noise or {},
        change or (lambda _: 0.0),
    )  # fmt: skip


@final
@dataclass(frozen=True, eq=False)
class Decay:
    """Residuals of a exp(-t / tau) + b, with b seen by a second signal if there is one."""

    t: Array
    measured: Array
    second: Array | None = None
    own: tuple[Unknown, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        return ("a", "tau", "b")

    @property
    def channels(self) -> tuple[Channel, ...]:
        n = self.t.size
        first = Channel(0, "x", "m", slice(0, n), self.t, self.measured, {"force": np.sin(self.t)})
        if self.second is None:
            return (first,)
        return first, Channel(0, "y", "m", slice(n, 2 * n), self.t, self.second, {})

    def at(self, values: Array) -> Evaluation | str:
        a, tau, b = values
        if not tau > 0:
            return "tau is not above zero"
        e = np.exp(-self.t / tau)
        r = a * e + b - self.measured
        J = np.column_stack([e, a * e * self.t / tau**2, np.ones_like(e)])
        if self.second is None:
            return Evaluation(r, J)
        own = np.column_stack([0 * e, 0 * e, np.ones_like(e)])
        return Evaluation(np.concatenate([r, b - self.second]), np.vstack([J, own]))


DECAY = (
    Unknown("a", "m", 1.0),
    Unknown("tau", "s", 1.0, lower=1e-3, upper=1e3, logarithmic=True),
    Unknown("b", "m", 0.0),
)


def solved(
    residuals: Decay, noise: object = "estimate", loss: str = "squares"
) -> tuple[Task, Point]:
    """The fit of a decay."""
    fit = task(residuals, unknowns_of(DECAY, {}, residuals.names), noise, loss)
    end = descend(fit, fit.unknowns.start)
    fit = fit.with_noise(end.noise)
    point = fit.at(end.w)
    assert isinstance(point, Point)
    return fit, point
