"""The weighted least-squares problem that residuals and unknowns make together.

    minimise over w   sum_signals [ n_s ln sigma_s ] + 1/2 sum_rows loss(r_i(p(w)) / sigma_s(i))

sigma_s is the standard deviation of the noise of a signal, given or estimated.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from identification.residuals.evaluation import Channel, Evaluation, Residuals
from identification.solving.loss import THRESHOLD, influence, shaped
from identification.solving.reduce import square, triangle
from identification.unknowns.unknowns import Unknowns
from symfric.foundation import checks

Array = NDArray[np.float64]
Guard = Callable[[Mapping[str, float]], object]

LEAST = 1e-9
"""Least noise level over the spread of a signal: a model cannot be right to more than this."""


@final
@dataclass(frozen=True, eq=False)
class Point:
    """Where the residuals are known.

    Attributes:
        w: coordinates, shape (n,).
        values: by `names` of the residuals, shape (k,).
        evaluation: residuals in SI units with their derivatives by the values.
        sigma: noise level of every row, in SI units, shape (rows,).
        slope: dvalues/dw, shape (k, n).
        loss: what a residual costs.
    """

    w: Array
    values: Array
    evaluation: Evaluation
    sigma: Array
    slope: Array
    loss: str = "squares"

    @cached_property
    def r(self) -> Array:
        """Residuals over their noise level, shape (rows,)."""
        return self.evaluation.r / self.sigma

    @cached_property
    def J(self) -> Array:
        """Derivatives of `r` by w, shape (rows, n)."""
        return np.einsum("ik,kj->ij", self.evaluation.J / self.sigma[:, None], self.slope)

    @cached_property
    def weights(self) -> Array:
        """Weight of each row in the normal equations: 1, less of outliers under a robust loss."""
        return influence(self.r, self.loss)

    @cached_property
    def reduced(self) -> tuple[Array, Array]:
        """Residuals (k + 1,) and derivatives (k + 1, n) with the same cost, gradient and J'J.

        Of the loss-shaped rows e: |f|^2 = |e|^2, J'f = J'e.
        """
        e, de = shaped(self.r, self.loss)
        J = self.evaluation.J * (de / self.sigma)[:, None]
        R = triangle(np.column_stack([J, e]))
        return R[:, -1], np.einsum("ik,kj->ij", R[:, :-1], self.slope)

    @cached_property
    def cost(self) -> float:
        """Sum of the losses; of squares r'r."""
        return square(shaped(self.r, self.loss)[0])


@final
@dataclass(frozen=True, eq=False)
class Task:
    """A weighted least-squares problem.

    Attributes:
        residuals: what the model leaves of the data.
        unknowns: coordinates of what is fitted.
        noise: signal -> standard deviation [SI], as it is taken now.
        estimated: signals whose noise level is estimated.
        loss: "squares", or a robust one: "huber", "soft_l1", "cauchy", "arctan".
        guard: raises ValueError at values (by name) that cannot be.
        easier: problems of the same parameters by whose way starts far off go.
    """

    residuals: Residuals
    unknowns: Unknowns
    noise: dict[str, float]
    estimated: tuple[str, ...] = ()
    loss: str = "squares"
    guard: Guard | None = None
    easier: "tuple[Task, ...]" = ()

    @property
    def channels(self) -> Sequence[Channel]:
        """What the rows are."""
        return self.residuals.channels

    @cached_property
    def sigma(self) -> Array:
        """Noise level of every row [SI], shape (rows,)."""
        rows = sum(c.t.size for c in self.channels)
        found = np.ones(rows)
        for channel in self.channels:
            found[channel.rows] = self.noise[channel.signal]
        return found

    def with_noise(self, noise: Mapping[str, float]) -> "Task":
        """The same problem with other noise levels."""
        return replace(self, noise=dict(noise))

    def at(self, w: Array) -> Point | str:
        """The point at `w`; a sentence that says why there is none."""
        w = np.array(w, float)
        values = self.unknowns.values(w)
        names = self.unknowns.names
        if not np.isfinite(values).all():
            return f"with {_shown(names, values)}: a value is not finite"
        if self.guard is not None:
            try:
                own = {u.name for u in self.residuals.own}
                given = zip(names, values.tolist(), strict=True)
                self.guard({name: value for name, value in given if name not in own})
            except ValueError as error:
                return f"with {_shown(names, values)}: {error}"
        found = self.residuals.at(values)
        if isinstance(found, str):
            return found
        if not (np.isfinite(found.r).all() and np.isfinite(found.J).all()):
            return f"with {_shown(names, values)}: residuals or derivatives are not finite"
        return Point(w, values, found, self.sigma, self.unknowns.slope(w), self.loss)

    def again(self, point: Point) -> Point:
        """The same point under the noise levels of this task."""
        return replace(point, sigma=self.sigma)

    def spread(self, signal: str) -> float:
        """Standard deviation of the measured values of a signal over all records, or their size."""
        values = [c.measured for c in self.channels if c.signal == signal]
        spread = max(float(np.std(v)) for v in values)
        return spread or max(float(np.abs(v).max()) for v in values) or 1.0


def task(
    residuals: Residuals,
    unknowns: Unknowns,
    noise: object = "estimate",
    loss: object = "squares",
    guard: Guard | None = None,
) -> Task:
    """The problem with noise levels `noise`: "estimate", or signal -> standard deviation [SI].

    Signals that `noise` does not name are estimated.

    Raises:
        ValueError: an unknown loss or signal, a noise level that is not above 0.
    """
    chosen = checks.choice("Fit: loss", loss, THRESHOLD)
    signals = list(dict.fromkeys(c.signal for c in residuals.channels))
    given: dict[str, Any] = {}
    if noise != "estimate":
        if isinstance(noise, str):
            raise checks.refused("Fit: noise", "'estimate' or noise levels by signal", noise)
        given = checks.named("Fit: noise", noise, signals)
    levels = {s: checks.number(f"Fit: noise: {s}", x, above=0.0) for s, x in given.items()}
    made = Task(
        residuals, unknowns, {}, tuple(s for s in signals if s not in levels), chosen, guard
    )
    return made.with_noise({s: levels[s] if s in levels else made.spread(s) for s in signals})


def _shown(names: Sequence[str], values: Array) -> str:
    return ", ".join(f"{n} = {x:.5g}" for n, x in zip(names, values.tolist(), strict=True))
