"""Events: zero crossings found on the dense output, located, and carried out."""

from collections import deque
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.integrator.running.dense import Dense
from symfric.integrator.running.integrator import Integrator

Array = NDArray[np.float64]
LOOKS = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
"""Where each step is looked at; a double crossing closer than this is not seen."""


@final
@dataclass(frozen=True, eq=False)
class Crossing:
    """Events that happen together.

    Attributes:
        t: time [s].
        step: number of the piece that holds it.
        y: values just before, shape (n,).
        which: numbers of the events.
    """

    t: float
    step: int
    y: Array
    which: tuple[int, ...]

    def before(self, piece: Dense) -> Dense:
        """The pieces up to the crossing; the last one keeps its polynomial, rescaled."""
        k = self.step
        if self.t == piece.t0[k]:
            return Dense(piece.t0[:k], piece.t1[:k], piece.y0[:k], piece.y1[:k], piece.D[:k])
        cut = _shorten(piece, k, self.t)
        return Dense(
            np.append(piece.t0[:k], cut.t0),
            np.append(piece.t1[:k], cut.t1),
            np.vstack([piece.y0[:k], cut.y0]),
            np.vstack([piece.y1[:k], self.y[None]]),
            np.concatenate([piece.D[:k], cut.D]),
        )


def _shorten(piece: Dense, k: int, t: float) -> Dense:
    """Piece `k` on [t0, t], as the same polynomial in the shorter interval."""
    t0, t1 = piece.t0[k], piece.t1[k]
    s = (t - t0) / (t1 - t0)
    y0, y1, D = piece.y0[k], piece.y1[k], piece.D[k]
    rows = D.shape[0]
    # Coefficients in powers of theta, scaled, and brought back to the form of `Dense`.
    powers = np.zeros((rows + 2, y0.size))
    powers[0], powers[1] = y0, y1 - y0
    for r in range(rows):
        powers[r + 1] += D[r]
        powers[r + 2] -= D[r]
    powers *= s ** np.arange(rows + 2)[:, None]
    new = np.zeros_like(D)
    carry = np.zeros_like(y0)
    for r in range(rows - 1, -1, -1):
        new[r] = -(powers[r + 2] - (carry if r < rows - 1 else 0.0))
        carry = new[r]
    end = powers.sum(axis=0)
    return Dense(np.array([t0]), np.array([t]), y0[None], end[None], new[None])


def first_crossing(
    integrator: Integrator, piece: Dense, d: Array, old: Array | None, tolerance: float
) -> Crossing | None:
    """The earliest crossing in `piece`, or None.

    Just after a jump, `old` holds the event values before it, with NaN for events that happened
    there. The signs after it are those two tolerances later; an expression that the jump carried
    through zero, not just to zero, is an event at the very start.
    """
    steps = piece.t0.size
    if not steps:
        return None
    g = _values(integrator, piece, d)
    soon = min(0.1, 2 * tolerance / (piece.t1[0] - piece.t0[0]))
    jumped = np.zeros(g.shape[0], dtype=bool)
    if old is not None:
        y = piece.piece(np.array([0]), np.array([soon]))[0]
        new = values(integrator, piece.t0[0] + soon * (piece.t1[0] - piece.t0[0]), y, d)
        jumped = passed(integrator, old, new) & (new != 0)
        g[:, 0, 0] = new
    hits = passed(integrator, g[:, :, :-1], g[:, :, 1:])
    hits[jumped, 0, 0] = True
    if not hits.any():
        return None
    order = hits.any(axis=0).reshape(-1)
    first = int(np.argmax(order))
    step, look = divmod(first, LOOKS.size - 1)
    candidates = np.flatnonzero(hits[:, step, look])
    h = piece.t1[step] - piece.t0[step]
    low = LOOKS[look] if first or old is None else soon
    roots = [
        0.0
        if first == 0 and jumped[i]
        else _locate(integrator, piece, d, int(i), step, low, LOOKS[look + 1], tolerance / h)
        for i in candidates
    ]
    theta = min(roots)
    together = tuple(
        int(i) for i, root in zip(candidates, roots, strict=True) if (root - theta) * h <= tolerance
    )
    y = piece.piece(np.array([step]), np.array([theta]))[0]
    return Crossing(float(piece.t0[step] + theta * h), step, y, together)


def passed(integrator: Integrator, before: Array, after: Array) -> NDArray[np.bool_]:
    """Where events, numbered along the first axis, go through zero in their direction."""
    directions = np.array([e.direction for e in integrator.model.events])
    directions = directions.reshape(-1, *[1] * (before.ndim - 1))
    rising = (before < 0) & (after >= 0) & (directions >= 0)
    return rising | ((before > 0) & (after <= 0) & (directions <= 0))


def _values(integrator: Integrator, piece: Dense, d: Array) -> Array:
    """Event expressions at the looks, shape (events, steps, looks)."""
    steps, looks = piece.t0.size, LOOKS.size
    k = np.repeat(np.arange(steps), looks)
    theta = np.tile(LOOKS, steps)
    y = piece.piece(k, theta)
    t = piece.t0[k] + theta * (piece.t1[k] - piece.t0[k])
    count = k.size
    values = integrator.events.map(count)(t[None, :], y.T, np.tile(d[:, None], (1, count)))
    return values.full().reshape(-1, steps, looks)


def _locate(
    integrator: Integrator,
    piece: Dense,
    d: Array,
    event: int,
    step: int,
    low: float,
    high: float,
    tolerance: float,
) -> float:
    """Root in theta of one event on one step, by the Illinois method; the side after the root."""
    index = np.array([step])
    h = piece.t1[step] - piece.t0[step]

    def value(theta: float) -> float:
        y = piece.piece(index, np.array([theta]))[0]
        return float(integrator.events(piece.t0[step] + theta * h, y, d)[event])

    a, b, fa, fb = low, high, value(low), value(high)
    if fa == 0.0 or fb == 0.0:
        return b if fb == 0.0 else a
    side = 0
    for _ in range(100):
        if b - a <= max(tolerance, 1e-15):
            break
        c = (fa * b - fb * a) / (fa - fb)
        c = min(max(c, a + 1e-3 * (b - a)), b - 1e-3 * (b - a)) if side else c
        fc = value(c)
        if fc == 0.0:
            return c
        if (fc > 0) == (fb > 0):
            b, fb = c, fc
            fa = fa / 2 if side == 1 else fa
            side = 1
        else:
            a, fa = c, fc
            fb = fb / 2 if side == -1 else fb
            side = -1
    return b


def values(integrator: Integrator, t: float, y: Array, d: Array) -> Array:
    """Event expressions at one point, shape (events,)."""
    return integrator.events(t, y, d).full().ravel()


def resets(integrator: Integrator, t: float, y: Array, d: Array, which: tuple[int, ...]) -> Array:
    """Values after the events `which`; all resets read the values `y` before them."""
    after = y.copy()
    names = [v.name for v in integrator.model.x]
    for i in which:
        for state, function in integrator.resets[i].items():
            after[names.index(state)] = float(function(t, y, d))
    return after


@final
class EventStorm:
    """Notices events that pile up at one time (Zeno) instead of letting the clock stand still.

    A storm is four events of one kind in a row at distances that shrink like a geometric series
    with less than a thousand event tolerances still to come; or a hundred events less than a few
    tolerances, or roundings of the clock, apart. Events that are merely many, of a fast machine or
    within a long run, are none.
    """

    def __init__(self, tolerance: float) -> None:
        self._recent: deque[tuple[float, tuple[int, ...]]] = deque(maxlen=100)
        self._tolerance = tolerance

    def raged_at(self, t: float, which: tuple[int, ...]) -> bool:
        """Whether the events `which` at time `t` complete a storm."""
        self._recent.append((t, which))
        full = len(self._recent) == self._recent.maxlen
        apart = max(self._tolerance, float(np.spacing(abs(t))))
        if full and t - self._recent[0][0] < 10 * apart * len(self._recent):
            return True
        last = list(self._recent)[-4:]
        gaps = np.diff([time for time, _ in last])
        alike = len(last) == 4 and len({events for _, events in last}) == 1
        if not alike or not (gaps[1:] < gaps[:-1]).all():
            return False
        still_to_come = gaps[-1] * gaps[-1] / (gaps[-2] - gaps[-1])
        return bool(still_to_come < 1000 * self._tolerance)
