"""Coordinates of the fit: scaled, logarithmic or an excess, so that only box bounds remain.

    p = scale w                      linear
    p = exp(w)                       logarithmic: positive scales
    p = low + s (exp(w) - 1), w >= 0 at least another value `low`: linear near it, logarithmic
                                     beyond s, twice its scale; low + exp(w) if logarithmic
    p = low + (upper - low) w        at least another value, at most a bound, 0 <= w <= 1
    p = low (upper / low)^w          the same, if logarithmic and strictly above `low`
    p = lower + (high - lower) w     at most another value `high`, 0 <= w <= 1
    p = high - scale (1 - w)         the same without a lower bound, w <= 1
    p = rule(p)                      tied to other values, without a coordinate

The solver only has to respect a box in w; orders and ties hold at every trial.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.unknowns.spec import Tied, Unknown
from symfric.foundation.numeric import evaluate_all

Array = NDArray[np.float64]

DECADES = 6.0
"""Decades from the start beyond which the solver ignores a bound of a logarithmic value, because
its steps also depend on distant bounds. The law still checks the bound.
"""
VANISHED = 12.0 * float(np.log(10.0))
"""Logarithmic distance from the start at which a value that tends to zero or infinity is treated as
being at its bound.
"""
WITHIN = 1e-6
"""Relative distance at which a value counts as being at its bound; covers rounding."""
NEAR = 2.0
"""Excess over a lower value, relative to the scale, up to which it is fitted by its value, because
the logarithms of static friction's excess and of the Stribeck velocity are strongly correlated.
"""
MARGIN = 1e-3
"""Distance of a start from its bounds, relative to their width (at most one)."""
STRICTLY = 1e-4
"""Smallest share of the range between a lower value and the bound for a strictly larger value."""
AT_BOUND = 1e-5
"""Distance below which a value is at a bound, relative to the width of the box (at most one)."""


@final
@dataclass(frozen=True, eq=False)
class Coordinate:
    """Coordinate w of a value p; q is the value of its partner in an order, if any.

    Attributes:
        value: (w, q) -> p, symbolic.
        inverse: (p, q) -> w.
        lower, upper: bounds of w.
        floor, ceiling: coordinates beyond which p counts as zero or infinite. The search does not
            use them, because its steps also depend on distant bounds.
    """

    value: Callable[[Any, Any], Any]
    inverse: Callable[[float, float], float]
    lower: float
    upper: float
    floor: float = -inf
    ceiling: float = inf


def coordinate(unknown: Unknown) -> Coordinate:
    """Return the coordinate of an unknown."""
    low, high, scale = unknown.lower, unknown.upper, unknown.scale
    if unknown.below and low > -inf:
        return Coordinate(
            lambda w, q: low + (q - low) * w,
            lambda p, q: (p - low) / max(q - low, 1e-300), 0.0, 1.0,
        )  # fmt: skip
    if unknown.below:
        return Coordinate(
            lambda w, q: q - scale * (1 - w), lambda p, q: 1 - (q - p) / scale, -inf, 1.0
        )
    if unknown.above:
        return _above(high, scale, unknown.logarithmic)
    if not unknown.logarithmic:
        return Coordinate(lambda w, _: scale * w, lambda p, _: p / scale, low / scale, high / scale)
    first = _log(unknown.start)
    lower = _log(low) if low > 0 else -inf
    upper = _log(high) if high < inf else inf
    reach = float(np.log(10.0)) * DECADES
    return Coordinate(
        lambda w, _: _exp(w),
        lambda p, _: _log(p),
        lower if lower > first - reach else -inf,
        upper if upper < first + reach else inf,
        max(first - VANISHED, lower + WITHIN),
        min(first + VANISHED, upper - WITHIN),
    )


def _above(high: float, scale: float, logarithmic: bool) -> Coordinate:
    """Return the coordinate of a value that is at least another one and at most `high`."""

    def excess(p: float, q: float) -> float:
        return max(p - q, 1e-3 * max(abs(q), 1e-12))

    def power(p: float, q: float) -> float:
        share = np.log(1 + excess(p, q) / q)
        return float(share / np.log(max(high / q, 1 + 1e-12)))

    if logarithmic and high < inf:
        return Coordinate(lambda w, q: q * (high / q) ** w, power, STRICTLY, 1.0)
    if high < inf:
        return Coordinate(
            lambda w, q: q + (high - q) * w,
            lambda p, q: excess(p, q) / max(high - q, 1e-300), 0.0, 1.0,
        )  # fmt: skip
    if logarithmic:
        middle = _log(scale)
        return Coordinate(
            lambda w, q: q + _exp(w), lambda p, q: float(np.log(excess(p, q))), -inf, inf,
            middle - VANISHED, middle + VANISHED,
        )  # fmt: skip
    return Coordinate(
        lambda w, q: q + NEAR * scale * (_exp(w) - 1),
        lambda p, q: float(np.log1p(excess(p, q) / (NEAR * scale))), 0.0, inf, ceiling=VANISHED,
    )  # fmt: skip


def _exp(w: ca.SX) -> ca.SX:
    return ca.exp(w)


def _log(value: float) -> float:
    return float(np.log(max(value, 1e-300)))


@final
@dataclass(frozen=True, eq=False)
class Unknowns:
    """Arguments of the residuals as functions of the fitted coordinates w.

    Attributes:
        unknowns: one for each coordinate, in the order of w, shape (n,).
        names: names of the values, including tied ones, shape (k,).
        lower, upper: box of w, shape (n,).
        function: w -> values (k,), dvalues/dw (k, n).
    """

    unknowns: tuple[Unknown, ...]
    names: tuple[str, ...]
    lower: Array
    upper: Array
    function: ca.Function

    @property
    def fitted(self) -> tuple[str, ...]:
        """Names of the values that have a coordinate."""
        return tuple(u.name for u in self.unknowns)

    @property
    def nuisance(self) -> tuple[str, ...]:
        """Names of fitted values that were not requested."""
        return tuple(u.name for u in self.unknowns if u.nuisance)

    def values(self, w: Array) -> Array:
        """Return the values at w, shape (k,)."""
        return evaluate_all(self.function, np.asarray(w, float))[0].ravel()

    def slope(self, w: Array) -> Array:
        """Return dvalues/dw at w, shape (k, n)."""
        slope = evaluate_all(self.function, np.asarray(w, float))[1]
        return slope.reshape(len(self.names), len(self.unknowns))

    def named(self, w: Array) -> dict[str, float]:
        """Return name -> value at w."""
        return dict(zip(self.names, self.values(w).tolist(), strict=True))

    @property
    def start(self) -> Array:
        """Coordinates of the start values, shape (n,)."""
        return self.of({})

    def of(self, values: Mapping[str, float]) -> Array:
        """Return the coordinates of `values` inside the box; other values are at their start."""
        known = {u.name: u.start for u in self.unknowns} | dict(values)
        if any(u.partner and u.partner not in known for u in self.unknowns):
            free = [replace(u, above="", below="") for u in self.unknowns]
            found = self.named(self._inverse(free, known, {}))
            for _ in range(2):  # a tied value may depend on an ordered one
                found = self.named(self._inverse(self.unknowns, known, found))
            known = found | known
        return self._inverse(self.unknowns, known, known)

    def _inverse(
        self, unknowns: Sequence[Unknown], known: Mapping[str, float], partners: Mapping[str, float]
    ) -> Array:
        w = [coordinate(u).inverse(known[u.name], partners.get(u.partner, 0.0)) for u in unknowns]
        return self.inside(np.array(w))

    def inside(self, w: Array) -> Array:
        """Return `w` moved inside the box by a thousandth of its width, or of one if wider."""
        margin = MARGIN * np.minimum(1.0, self.upper - self.lower)
        return np.clip(w, self.lower + margin, self.upper - margin)

    def at_bound(self, w: Array) -> NDArray[np.bool_]:
        """Return a mask of the unknowns at a bound, shape (n,)."""
        near = AT_BOUND * np.minimum(1.0, self.upper - self.lower)
        floor, ceiling = self.limits
        low, high = np.maximum(self.lower, floor), np.minimum(self.upper, ceiling)
        return (w - low < near) | (high - w < near)

    @cached_property
    def limits(self) -> tuple[Array, Array]:
        """Coordinates beyond which values count as zero or infinite; see `Coordinate`."""
        each = [coordinate(u) for u in self.unknowns]
        floor, ceiling = np.array([(c.floor, c.ceiling) for c in each]).reshape(-1, 2).T
        return (
            np.where(np.isinf(self.lower), floor, -inf),
            np.where(np.isinf(self.upper), ceiling, inf),
        )


def unknowns_of(
    unknowns: Sequence[Unknown],
    ties: Mapping[str, Tied],
    names: Sequence[str],
    held: Mapping[str, float] | None = None,
) -> Unknowns:
    """Return the coordinates of `unknowns` and the tied values, in the order of `names`.

    Values of `held` parameters are constants, which ties and residuals can use.

    Raises:
        ValueError: a tie or an order refers to an absent name or forms a cycle, or a name is
            neither an unknown nor tied.
    """
    w = ca.SX.sym("w", len(unknowns))
    each = [coordinate(u) for u in unknowns]
    values: dict[str, Any] = {n: ca.SX(x) for n, x in (held or {}).items()}
    waiting: dict[str, Callable[[], Any]] = {
        u.name: lambda i=i, u=u: each[i].value(w[i], values[u.partner] if u.partner else 0)
        for i, u in enumerate(unknowns)
    } | {name: lambda tie=tie: tie.rule(values) for name, tie in ties.items()}
    partners = {u.name: u.partner for u in unknowns}
    while waiting:
        missing = dict[str, str]()
        for name, expression in waiting.items():
            try:
                values[name] = ca.SX(expression())
            except (KeyError, ValueError) as error:
                why = f"is tied to an absent name or in a cycle ({error})"
                if name in partners:
                    why = f"is ordered with {partners[name]}, which is absent"
                missing[name] = f"{name} {why}"
        if len(missing) == len(waiting):
            such = "Fit: free: expected ties and orders without cycles"
            raise ValueError(f"{such}, got {'; '.join(missing.values())}")
        waiting = {name: waiting[name] for name in missing}
    absent = [n for n in names if n not in values]
    if absent:
        raise ValueError(f"Fit: expected an unknown for each value, got none for {absent[0]}")
    column = ca.densify(ca.vertcat(*(values[n] for n in names))) if names else ca.SX(0, 1)
    function = ca.Function("values", [w], [column, ca.densify(ca.jacobian(column, w))])
    box = np.array([(c.lower, c.upper) for c in each]).reshape(-1, 2)
    return Unknowns(tuple(unknowns), tuple(names), box[:, 0], box[:, 1], function)


REACH = 5.0
"""Largest factor by which a positive value is changed."""
WIDE = 1e3
"""Ratio of bounds up to which the whole range is searched; wider bounds are natural limits."""


def scattered(at: Unknowns, centre: Array, count: int, seed: int = 0) -> list[Array]:
    """Return `count` starts, the first at `centre`, deterministic for a given `seed`.

    The others are a Latin hypercube around it. Positive values are multiplied by factors up to
    `REACH`, values bounded by the user cover their range, and values of either sign change by up
    to half their magnitude; start values of records are unchanged.
    Source: M. D. McKay, R. J. Beckman, W. J. Conover, Technometrics 21, 1979.

    Args:
        at: unknowns with their box.
        centre: coordinates, shape (n,).
        count: number of starts.
        seed: seed of the random numbers.
    """
    rng = np.random.default_rng(seed)
    n, others = centre.size, max(count - 1, 0)
    cells = np.stack([rng.permutation(others) for _ in range(n)], axis=1).reshape(others, n)
    shares = (cells + rng.random((others, n))) / max(others, 1)
    box = at.unknowns, *(x.tolist() for x in (centre, at.lower, at.upper))
    moved = (np.array([*map(_moved, *box, row)], float) for row in shares.tolist())
    return [at.inside(w) for w in (centre, *moved)]


def _moved(unknown: Unknown, w: float, lower: float, upper: float, share: float) -> float:
    """Return one coordinate moved according to `share` in (0, 1)."""
    side, bounded = 2 * share - 1, np.isfinite(upper) and np.isfinite(lower)
    if unknown.nuisance and not bounded:
        return w
    narrow = upper - lower < np.log(WIDE) or not unknown.logarithmic or unknown.above
    if bounded and narrow:
        return lower + share * (upper - lower)
    if unknown.logarithmic or unknown.above:
        return w + side * np.log(REACH)
    if lower >= 0 and w > 0:
        return w * REACH**side
    return w + 0.5 * side * abs(w)
