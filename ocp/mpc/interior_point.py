"""The quadratic program of an iteration, by a primal-dual interior point.

A hard row keeps v >= 0; a soft one may be violated by s >= 0 at the price rho s + sigma s^2 / 2:

    v - t + s = 0,   t z = mu,   s y = mu,   z + y = rho + sigma s

Newton's method with t, s and y eliminated leaves a weight w and a slope e for each row,

    z_new = z + w (o - D d),   w = 1 / (t / z + f),   e = -(z + w o),
    o = mu / z - v - s + f a,   a = rho + sigma s - z - mu / s,   f = 1 / (sigma + y / s)

with f = 0 in a hard row, for the recursion over the intervals. Mehrotra's predictor and corrector
share its matrices. A program whose free minimum keeps all rows needs none of this.

Sources: Mehrotra, On the implementation of a primal-dual interior point method, SIAM J. Optim.
    2(4), 1992; Frison and Diehl, HPIPM, IFAC 2020 (soft rows).
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from ocp.mpc.sweeps import Move, Sweeps

Array = NDArray[np.float64]

BACK = 0.995
"""Share of the way to the boundary."""
CLOSE = 1e-7
"""mu, in units of the curvature, at which a program is solved."""
AWAY = 0.1
"""Least distance from the bounds at which the interior point starts, in units of the signals."""


@final
@dataclass(frozen=True, eq=False)
class Prices:
    """rho and sigma of all rows, zeros in hard ones, and which are soft."""

    rho: Array
    sigma: Array
    soft: NDArray[np.bool_]

    def of(self, v: Array) -> float:
        """What violations of soft rows cost."""
        s = np.maximum(-v, 0.0)
        return total(self.rho * s + 0.5 * (self.sigma * (s * s)))


@final
@dataclass(frozen=True, eq=False)
class Point:
    """An interior point: slacks and multipliers of all rows."""

    t: Array
    z: Array
    s: Array
    y: Array

    def on(self, alpha: float, d: "Point") -> "Point":
        """A step of alpha along `d`."""
        pairs = zip((self.t, self.z, self.s, self.y), (d.t, d.z, d.s, d.y), strict=True)
        return Point(*(a + alpha * da for a, da in pairs))

    def gap(self) -> float:
        """Sum of the products that become zero."""
        return total(self.t * self.z + self.s * self.y)

    def reach(self, d: "Point", back: float) -> float:
        """Largest step in [0, 1] that goes no more than `back` of the way to the boundary."""
        alpha = 1.0 / back
        for a, da in ((self.t, d.t), (self.z, d.z), (self.s, d.s), (self.y, d.y)):
            falls = da < 0.0
            alpha = min(alpha, float((-a[falls] / da[falls]).min(initial=np.inf)))
        return min(1.0, back * alpha)


def total(values: Array) -> float:
    """The sum from left to right, as C has it."""
    return float(np.cumsum(values)[-1]) if values.size else 0.0


def solve_program(
    sweeps: Sweeps, L: Array, end: Array, prices: Prices, *, warm: Array, unit: float, most: int
) -> tuple[Move, Array, int]:
    """Solve the program of L.

    Args:
        warm: multipliers to begin with.
        unit: curvature that mu is measured with.
        most: iterations at most.

    Returns:
        The change, the multipliers, and the iterations of the interior point: 0 where no row is
        active.
    """
    v, none = sweeps.rows_of(L, end), np.zeros(warm.size)
    G = sweeps.matrix(L, end, none)
    move = sweeps.forward(L, end, G, sweeps.vector(L, end, G, none))
    first = v + move.D
    worst = -float(first.min(initial=np.inf))
    if worst <= 0.0:
        return move, none, 0
    soft, point = prices.soft, _inside(prices, v, first, warm, unit * max(1.0, worst))
    pairs = float(v.size + int(soft.sum()))
    made = 0
    while made < most:
        mu = point.gap() / pairs
        if mu <= CLOSE * unit:
            break
        made += 1
        f, w = _weights(prices, point)
        program = L, end, v, sweeps.matrix(L, end, w)
        _, change = _newton(sweeps, program, prices, point, (f, w), (none, none))
        alpha = point.reach(change, 1.0)
        ratio = point.on(alpha, change).gap() / pairs / mu
        centre = ratio * ratio * ratio * mu
        goals = centre - change.t * change.z, np.where(soft, centre - change.s * change.y, 0.0)
        aim, change = _newton(sweeps, program, prices, point, (f, w), goals)
        alpha = point.reach(change, BACK)
        point, move = point.on(alpha, change), move.towards(aim, alpha)
    return move, point.z, made


def _inside(prices: Prices, v: Array, first: Array, warm: Array, product: float) -> Point:
    """Where to begin, with all products about equal.

    A soft row that is violated now (v < 0) is taken to remain so, with z at its price; the others
    are kept off their bounds, `first` being their values at the free minimum, and z is no less than
    what it was in the last program.
    """
    rho, soft = prices.rho, prices.soft
    worst = -float(first.min())
    t = np.maximum(first, max(AWAY, worst))
    z = np.maximum(warm, product / t)
    z = np.where(soft, np.minimum(z, 0.5 * rho), z)
    s = np.where(soft, product / np.where(soft, rho, 1.0), 0.0)
    y = np.where(soft, rho + prices.sigma * s - z, 0.0)
    beyond = soft & (-v * rho > 2.0 * product)
    below = np.where(beyond, -v, 1.0)
    s, y = np.where(beyond, below, s), np.where(beyond, product / below, y)
    z = np.where(beyond, rho + prices.sigma * s - y, z)
    return Point(np.where(beyond, product / z, t), z, s, y)


def _weights(prices: Prices, point: Point) -> tuple[Array, Array]:
    """F and w of all rows."""
    soft = prices.soft
    b = np.where(soft, prices.sigma + point.y / np.where(soft, point.s, 1.0), 1.0)
    f = np.where(soft, 1.0 / b, 0.0)
    return f, 1.0 / (point.t / point.z + f)


def _newton(
    sweeps: Sweeps,
    program: tuple[Array, Array, Array, Array],
    prices: Prices,
    point: Point,
    weights: tuple[Array, Array],
    goals: tuple[Array, Array],
) -> tuple[Move, Point]:
    """Where Newton's method aims at with t z and s y at their goals, and the change to there."""
    L, end, v, G = program
    f, w = weights
    z, s, soft = point.z, point.s, prices.soft
    wanted = prices.rho + prices.sigma * s
    a = np.where(soft, wanted - z - goals[1] / np.where(soft, s, 1.0), 0.0)
    o = goals[0] / z - v - s + f * a
    aim = sweeps.forward(L, end, G, sweeps.vector(L, end, G, -(z + w * o)))
    dz = w * (o - aim.D)
    ds = np.where(soft, f * (dz - a), 0.0)
    dy = np.where(soft, wanted + prices.sigma * ds - (z + dz) - point.y, 0.0)
    return aim, Point(v + aim.D + s + ds - point.t, dz, ds, dy)
