"""Break-away force from ramps: the largest force before a body that rests moves on."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from identification.starts.measured import Measured
from symfric.foundation import checks

Array = NDArray[np.float64]

REST = 0.02
"""Share of the largest speed below which a body counts as resting."""
SHORTEST = 5
"""Samples of a rest."""
RISE = (0.3, 0.9)
"""Shares of the break-away force between which its rate is read."""
APART = 2.0
"""Ratio of the rates without which nothing is said about their effect."""


@final
@dataclass(frozen=True)
class BreakAway:
    """One break-away.

    Attributes:
        t: when the force is largest [s].
        force: that force in the direction of the motion that follows [N].
        rate: how fast it was loaded before [N/s].
        side: direction of the motion, 1 or -1.
    """

    t: float
    force: float
    rate: float
    side: int


@final
@dataclass(frozen=True, eq=False)
class BreakAways:
    """All break-aways of a data set.

    Attributes:
        events: in order of time.
        level: median force of both directions [N].
        scatter: median absolute deviation of the force over its median.
        per_decade: change of the force when it is loaded ten times as fast [N], of a straight line
            over the logarithm of the rate; None where the rates differ by less than a factor of 2.
        error: standard error of `per_decade` [N].
    """

    events: tuple[BreakAway, ...]
    level: float
    scatter: float
    per_decade: float | None
    error: float

    @property
    def note(self) -> str:
        """What is known about the loading rate, in a sentence."""
        rates = [event.rate for event in self.events]
        span = f"{min(rates):.3g} to {max(rates):.3g} N/s"
        if self.per_decade is None:
            return f"all loaded alike ({span}): how the force depends on the rate is not known"
        if abs(self.per_decade) < 2 * self.error:
            return f"no effect of the loading rate is seen ({span})"
        word = "falls" if self.per_decade < 0 else "rises"
        return (
            f"the force {word} by {abs(self.per_decade):.3g} +- {self.error:.2g} N for each factor "
            f"of ten of the loading rate ({span}): take the slowest ramps for the static level"
        )


def break_away(measured: Measured, *, rest: float = REST, offset: float = 0.0) -> BreakAways:
    """Break-away forces of all ramps in a record.

    A rest is a stretch of at least 5 samples below `rest` times the largest speed that ends in
    motion; the break-away force is the largest one along that motion until it begins. The samples
    must resolve the rise, or the maximum is missed.

    Args:
        measured: with times; the force with what accelerates the mass left out, or of slow ramps.
        rest: share of the largest speed.
        offset: constant force [N] beside friction.

    Raises:
        ValueError: no times; no rest that ends in motion.
    """
    rest = checks.number("break_away: rest", rest, above=0.0, upper=0.9)
    if measured.t is None:
        raise ValueError("break_away: expected a record with times, got points; give t=")
    events = tuple(e for r in measured.records for e in _events(measured, r, rest, offset))
    if not events:
        raise ValueError(
            f"break_away: expected a rest of at least {SHORTEST} samples below {rest:g} of the "
            "largest speed that ends in motion, got none"
        )
    forces = np.array([event.force for event in events])
    level = float(np.median(forces))
    scatter = float(np.median(np.abs(forces - level))) / abs(level)
    return BreakAways(events, level, scatter, *_by_rate(events))


def _events(measured: Measured, record: slice, rest: float, offset: float) -> Iterator[BreakAway]:
    t, v = np.asarray(measured.t)[record], measured.v[record]
    F = measured.F[record] - offset
    still = np.abs(v) < rest * measured.fastest
    edges = np.flatnonzero(np.diff(np.r_[False, still, False].astype(int)))
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        if end - begin < SHORTEST or end >= v.size:
            continue
        side = int(np.sign(v[end]))
        ramp = side * F[begin : end + 1]
        top = int(np.argmax(ramp))
        if top == 0 or ramp[top] <= 0:
            continue
        rising = (ramp[:top] > RISE[0] * ramp[top]) & (ramp[:top] < RISE[1] * ramp[top])
        last = np.flatnonzero(ramp[:top] <= RISE[0] * ramp[top])
        rising[: last[-1] + 1 if last.size else 0] = False  # what came before the last rise
        if rising.sum() >= 2:
            rate = float(np.polyfit(t[begin : begin + top][rising], ramp[:top][rising], 1)[0])
            if rate > 0:
                yield BreakAway(float(t[begin + top]), float(ramp[top]), rate, side)


def _by_rate(events: tuple[BreakAway, ...]) -> tuple[float | None, float]:
    """Slope of the force over the decades of the rate, and its standard error."""
    decades = np.log10([event.rate for event in events])
    if len(events) < 3 or np.ptp(decades) < np.log10(APART):
        return None, 0.0
    X = np.column_stack([np.ones(decades.size), decades])
    forces = np.array([event.force for event in events])
    w, *_ = np.linalg.lstsq(X, forces, rcond=None)
    spread = float(np.sum((forces - X @ w) ** 2)) / (decades.size - 2)
    return float(w[1]), float(np.sqrt(spread * np.linalg.inv(X.T @ X)[1, 1]))
