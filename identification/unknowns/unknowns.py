"""Coordinates of the fit: scaled, logarithmic or an excess, so that only box bounds remain.

    p = scale w                      linear
    p = exp(w)                       logarithmic: positive scales
    p = low + s (exp(w) - 1), w >= 0 at least another value: linear near it, logarithmic beyond s,
                                     twice its scale; low + exp(w) if it is logarithmic
    p = low + (upper - low) w        at least another value, at most a bound, 0 <= w <= 1
    p = low (upper / low)^w          the same if it is logarithmic and strictly above
    p = lower + (high - lower) w     at most another value, 0 <= w <= 1
    p = high - scale (1 - w)         the same without a lower bound, w <= 1
    p = rule(p)                      tied: no coordinate of its own

A solver only has to respect a box in w; orders and ties hold at every trial.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.unknowns.spec import Tied, Unknown
from symfric.foundation.numeric import evaluate_all

Array = NDArray[np.float64]

DECADES = 6.0
"""Decades from the start beyond which the solver ignores a bound of a logarithmic value: its
steps depend on distant bounds, too. The law itself still checks the bound.
"""
VANISHED = 12.0
"""Decades from the start at which a value that tends to zero or infinity is at its bound."""
WITHIN = 1e-6
"""Relative distance to a bound within which a value counts as at it, so rounding cannot pass it."""
NEAR = 2.0
"""Excess over a lower value, over the scale, up to which it is fitted by its value: in their
logarithms, the excess of static friction and the Stribeck velocity are strongly correlated.
"""
MARGIN = 1e-3
"""Distance of a start to its bounds, over their width or one."""
STRICTLY = 1e-4
"""Least share of the range between a lower value and the bound for a value strictly above it."""
AT_BOUND = 1e-5
"""Distance to a bound, over the width of the box or one, below which a value is at the bound."""


@final
@dataclass(frozen=True, eq=False)
class Unknowns:
    """Arguments of the residuals as functions of the fitted coordinates w.

    Attributes:
        unknowns: one for each coordinate, in the order of w, shape (n,).
        names: of the values, shape (k,), tied ones included.
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
        """Names of the values with a coordinate."""
        return tuple(u.name for u in self.unknowns)

    @property
    def nuisance(self) -> tuple[str, ...]:
        """Names of fitted values that were not requested."""
        return tuple(u.name for u in self.unknowns if u.nuisance)

    def values(self, w: Array) -> Array:
        """Return the values at w, shape (k,)."""
        return self._both(w)[0]

    def slope(self, w: Array) -> Array:
        """Return dvalues/dw at w, shape (k, n)."""
        return self._both(w)[1]

    def _both(self, w: Array) -> tuple[Array, Array]:
        found, slope = evaluate_all(self.function, np.asarray(w, float))
        return found.ravel(), slope.reshape(len(self.names), len(self.unknowns))

    def named(self, w: Array) -> dict[str, float]:
        """Return the values at w by name."""
        return dict(zip(self.names, self.values(w).tolist(), strict=True))

    @property
    def start(self) -> Array:
        """Coordinates of the start values, shape (n,)."""
        return self.of({})

    def of(self, values: Mapping[str, float]) -> Array:
        """Return the coordinates of `values`, moved inside the box; others are at their start."""
        known = {u.name: u.start for u in self.unknowns} | dict(values)
        if any(u.partner and u.partner not in known for u in self.unknowns):
            known = self._with_ties(known) | known
        w = [_coordinate(u, known[u.name], known.get(u.partner, 0.0)) for u in self.unknowns]
        return self.inside(np.array(w))

    def _with_ties(self, known: Mapping[str, float]) -> dict[str, float]:
        """Return the values that others are ordered with, tied ones included."""
        free = [replace(u, above="", below="") for u in self.unknowns]
        w = np.array([_coordinate(u, known[u.name], 0.0) for u in free])
        for _ in range(2):  # a tied value may follow from one with an order of its own
            found = self.named(self.inside(w))
            w = np.array([_coordinate(u, known[u.name], found[u.partner]) if u.partner else w[i]
                          for i, u in enumerate(self.unknowns)])  # fmt: skip
        return self.named(self.inside(w))

    def inside(self, w: Array) -> Array:
        """Return `w` moved inside the box by a thousandth of its width or of one."""
        margin = MARGIN * np.minimum(1.0, self.upper - self.lower)
        return np.clip(w, self.lower + margin, self.upper - margin)

    def at_bound(self, w: Array) -> NDArray[np.bool_]:
        """Return a mask of the unknowns at a bound, shape (n,)."""
        near = AT_BOUND * np.minimum(1.0, self.upper - self.lower)
        low, high = np.maximum(self.lower, self.floor), np.minimum(self.upper, self.ceiling)
        return (w - low < near) | (high - w < near)

    @property
    def floor(self) -> Array:
        """Coordinates below which a logarithmic value counts as zero, shape (n,).

        The search does not use them, since its steps depend on distant bounds, too.
        """
        open_ = self._scales & np.isinf(self.lower)
        least = np.array([0.0 if u.above else u.lower for u in self.unknowns])
        first = np.log(self._sizes) - VANISHED * np.log(10.0)
        known = np.log(np.where(least > 0, least, 1.0)) + WITHIN
        first = np.where(least > 0, np.maximum(first, known), first)
        return np.where(open_, first, -np.inf)

    @property
    def ceiling(self) -> Array:
        """Coordinates above which a value counts as infinite, shape (n,); see `floor`."""
        reach = VANISHED * np.log(10.0)
        most = np.array([np.inf if u.above else u.upper for u in self.unknowns])
        known = np.log(np.where((most > 0) & (most < np.inf), most, 1.0)) - WITHIN
        first = np.log(self._sizes) + reach
        first = np.where((most > 0) & (most < np.inf), np.minimum(first, known), first)
        excess = np.array([bool(u.above) and not u.logarithmic for u in self.unknowns], dtype=bool)
        found = np.where(excess, reach, np.where(self._scales, first, np.inf))
        return np.where(np.isinf(self.upper), found, np.inf)

    @property
    def _scales(self) -> NDArray[np.bool_]:
        """Mask of the coordinates that are logarithms of a value or an excess, shape (n,)."""
        return np.array([u.logarithmic and not u.below for u in self.unknowns], dtype=bool)

    @property
    def _sizes(self) -> Array:
        """Start values of logarithmic coordinates; one for others, shape (n,)."""
        sizes = np.array([u.scale if u.above else u.start for u in self.unknowns])
        return np.where(self._scales, sizes, 1.0)


def unknowns_of(
    unknowns: Sequence[Unknown],
    ties: Mapping[str, Tied],
    names: Sequence[str],
    held: Mapping[str, float] | None = None,
) -> Unknowns:
    """Return the coordinates of `unknowns` and the tied values, in the order of `names`.

    Values of `held` parameters are constants, available to ties and residuals.

    Raises:
        ValueError: a tie or an order to an absent name or in a cycle; a name that is neither an
            unknown nor tied.
    """
    w = ca.SX.sym("w", len(unknowns))
    by_name = {u.name: (u, w[i]) for i, u in enumerate(unknowns)}
    values: dict[str, Any] = {n: ca.SX(x) for n, x in (held or {}).items()}
    waiting = [*by_name, *ties]
    while waiting:
        done = [n for n in waiting if _write(n, by_name, ties, values)]
        if not done:
            raise ValueError(_circle(waiting, by_name, ties, values))
        waiting = [n for n in waiting if n not in done]
    absent = [n for n in names if n not in values]
    if absent:
        raise ValueError(f"Fit: expected an unknown for each value, got none for {absent[0]}")
    column = ca.densify(ca.vertcat(*(values[n] for n in names))) if names else ca.SX(0, 1)
    function = ca.Function("values", [w], [column, ca.densify(ca.jacobian(column, w))])
    box = np.array([_box(u) for u in unknowns]).reshape(-1, 2)
    return Unknowns(tuple(unknowns), tuple(names), box[:, 0], box[:, 1], function)


def _write(
    name: str,
    unknowns: Mapping[str, tuple[Unknown, ca.SX]],
    ties: Mapping[str, Tied],
    values: dict[str, Any],
) -> bool:
    """Add the expression of `name` to `values`; return False if it needs absent values."""
    if name in ties:
        try:
            values[name] = ca.SX(ties[name].rule(values))
        except (KeyError, ValueError):
            return False
        return True
    unknown, w = unknowns[name]
    if unknown.partner and unknown.partner not in values:
        return False
    if unknown.below:
        values[name] = _under(unknown, values[unknown.below], w)
        return True
    low = values[unknown.above] if unknown.above else ca.SX(0)
    if unknown.above and unknown.upper < inf:
        high = unknown.upper
        values[name] = low * (high / low) ** w if unknown.logarithmic else low + (high - low) * w
    elif unknown.above and not unknown.logarithmic:
        values[name] = low + NEAR * unknown.scale * (ca.exp(w) - 1)
    else:
        values[name] = low + (ca.exp(w) if unknown.logarithmic else unknown.scale * w)
    return True


def _under(unknown: Unknown, high: Any, w: Any) -> Any:
    """Return an expression that does not exceed `high`."""
    if unknown.lower > -inf:
        return unknown.lower + (high - unknown.lower) * w
    return high - unknown.scale * (1 - w)


def _circle(
    waiting: Iterable[str],
    unknowns: Mapping[str, tuple[Unknown, ca.SX]],
    ties: Mapping[str, Tied],
    values: Mapping[str, Any],
) -> str:
    """Return the message on the names `waiting` that cannot be expressed."""
    messages: list[str] = []
    for name in waiting:
        if name in ties:
            try:
                ties[name].rule(values)
            except (KeyError, ValueError) as error:
                messages.append(f"{name} is tied to an absent name or in a cycle ({error})")
        else:
            messages.append(f"{name} is ordered with {unknowns[name][0].partner}, which is absent")
    return "Fit: free: expected ties and orders without cycles, got " + "; ".join(messages)


def _coordinate(unknown: Unknown, value: float, low: float) -> float:
    """Return the coordinate of a value; `low` is the value of its partner in an order, if any."""
    if unknown.below:
        if unknown.lower > -inf:
            return (value - unknown.lower) / max(low - unknown.lower, 1e-300)
        return 1 - (low - value) / unknown.scale
    if unknown.above:
        excess = max(value - low, 1e-3 * max(abs(low), 1e-12))
        if unknown.upper < inf and unknown.logarithmic:
            return float(np.log(1 + excess / low) / np.log(max(unknown.upper / low, 1 + 1e-12)))
        if unknown.upper < inf:
            return excess / max(unknown.upper - low, 1e-300)
        if unknown.logarithmic:
            return float(np.log(excess))
        return float(np.log1p(excess / (NEAR * unknown.scale)))
    if unknown.logarithmic:
        return float(np.log(max(value, 1e-300)))
    return value / unknown.scale


def _box(unknown: Unknown) -> tuple[float, float]:
    """Return the bounds of the coordinate."""
    if unknown.below:
        return (0.0 if unknown.lower > -inf else -inf), 1.0
    if unknown.above:
        if unknown.upper < inf:
            return (STRICTLY if unknown.logarithmic else 0.0), 1.0
        if not unknown.logarithmic:
            return 0.0, inf
    if unknown.logarithmic:
        if unknown.above:
            return -inf, inf
        reach, first = float(np.log(10.0)) * DECADES, float(np.log(max(unknown.start, 1e-300)))
        low = float(np.log(unknown.lower)) if unknown.lower > 0 else -inf
        high = float(np.log(unknown.upper)) if unknown.upper < inf else inf
        return (low if low > first - reach else -inf), (high if high < first + reach else inf)
    return unknown.lower / unknown.scale, unknown.upper / unknown.scale
