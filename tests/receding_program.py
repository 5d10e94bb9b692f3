"""A reference in NumPy for the C of controllers: the quadratic program of an iteration.

The loops of `ocp/mpc/cycle.c`, operation by operation, so that both give the same bits.
"""

from dataclasses import dataclass
from typing import Any, cast, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.mpc.design import CycleData, Prices
from ocp.mpc.horizon import Horizon
from ocp.mpc.kernels import Kernels
from ocp.mpc.source import AWAY, BACK, CLOSE
from symfric.foundation.numeric import evaluate_all

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Move:
    """A change of the whole horizon.

    Attributes:
        X, U: of states (N+1, nx) and inputs (N, nu).
        D: of all rows.
        costs: slope and curvature of the cost of intervals and end along it, shape (n, 2).
    """

    X: Array
    U: Array
    D: Array
    costs: Array

    def towards(self, aim: "Move", alpha: float) -> "Move":
        """A share alpha of the way to `aim`, whose costs it takes."""
        parts = ((self.X, aim.X), (self.U, aim.U), (self.D, aim.D))
        X, U, D = (a + alpha * (b - a) for a, b in parts)
        return Move(X, U, D, aim.costs)


def called(function: ca.Function, *arguments: Array) -> list[Array]:
    """All results, a row for each column of CasADi's."""
    return [np.ascontiguousarray(r.T) for r in evaluate_all(function, *arguments)]


def _over_substeps(horizon: Horizon, kernels: Kernels) -> tuple[ca.Function, ca.Function]:
    """`linear` and `value` of all intervals, with the substeps of each before them."""
    steps, n = horizon.substeps, horizon.count
    symbols = [ca.MX.sym(f"a{i}", kernels.value.size1_in(i)) for i in range(8)]
    x, u, _, r, _, p, _, _ = symbols
    same = [ca.repmat(argument, 1, steps) for argument in (u, r, p)]
    advance, tangent = cast(Any, kernels.advance), cast(Any, kernels.tangent)
    to = advance.mapaccum("advance", steps)(x, *same)[:, -1]
    there, slopes = tangent.mapaccum("tangent", steps, 2)(x, ca.DM(kernels.identity), *same)
    results = {
        "linear": kernels.linear(*symbols, there[:, -1], slopes[:, -1]),
        "value": kernels.value(*symbols, to),
    }
    common = [argument in (5, 7) for argument in range(8)]  # p and b
    made = [cast(Any, ca.Function(name, symbols, [r])) for name, r in results.items()]
    linear, value = (function.map(n, common, [False]) for function in made)
    return linear, value


def _curvatures(horizon: Horizon, kernels: Kernels) -> ca.Function:
    """E of all intervals."""
    steps, n = horizon.substeps, horizon.count
    sizes = [kernels.bend.size1_in(i) for i in (0, 1, 2, 4, 5, 6)]
    lam, E, x, u, r, p = (ca.MX.sym(f"a{i}", size) for i, size in enumerate(sizes))
    tangent = cast(Any, kernels.tangent)
    same = [ca.repmat(argument, 1, steps) for argument in (u, r, p)]
    there, slopes = tangent.mapaccum("tangent", steps, 2)(x, ca.DM(kernels.identity), *same)
    begins = ca.horzcat(x, there[:, :-1])
    ways = ca.horzcat(ca.DM(kernels.identity), slopes[:, :-1])
    back = list(reversed(range(steps)))
    bend = cast(Any, kernels.bend).mapaccum("bend", steps, 2)
    _, found = bend(lam, ca.DM.zeros(E.numel()), begins[:, back], ways[:, back], *same)
    whole = cast(Any, ca.Function("curvature", [lam, x, u, r, p], [found[:, -1]]))
    return whole.map(n, [False] * 4 + [True], [False])


def backwards(array: Array) -> Array:
    """Rows in the opposite order."""
    return np.ascontiguousarray(array[::-1])


@final
class Sweeps:
    """Sweeps of a horizon; see `Kernels` for letters and shapes."""

    def __init__(self, horizon: Horizon, kernels: Kernels) -> None:
        n = horizon.count
        self.horizon, self.kernels = horizon, kernels
        self.nx, self.nu = horizon.x.numel(), horizon.u.numel()
        self.rows, self.end_rows = len(horizon.limits), len(horizon.end_limits)
        self._linear, self._value = _over_substeps(horizon, kernels)
        self._curvature = _curvatures(horizon, kernels)
        self._matrix = kernels.matrix.mapaccum("matrix", n)
        self._vector = kernels.vector.mapaccum("vector", n)
        self._forward = kernels.forward.mapaccum("forward", n)
        self._adjoint = kernels.adjoint.mapaccum("adjoint", n)

    def linear(self, X: Array, U: Array, given: CycleData) -> tuple[Array, Array]:
        """L of all intervals, and of the end, at states X (N+1, nx) and inputs U (N, nu)."""
        (L,) = called(self._linear, *self._arguments(X, U, given))
        if self.kernels.end_linear is None:
            return L, np.zeros(0)
        return L, called(self.kernels.end_linear, *self._at_end(X, given))[0][0]

    def value(self, X: Array, U: Array, given: CycleData) -> tuple[Array, Array, Array]:
        """Defects (N, nx), all rows v, and the costs of intervals and end."""
        (E,) = called(self._value, *self._arguments(X, U, given))
        c, v, cost = E[:, : self.nx], E[:, self.nx : -1].ravel(), E[:, -1]
        if self.kernels.end_value is None:
            return c, v, cost
        end = called(self.kernels.end_value, *self._at_end(X, given))[0][0]
        return c, np.append(v, end[:-1]), np.append(cost, end[-1])

    def _arguments(self, X: Array, U: Array, given: CycleData) -> tuple[Array, ...]:
        R = given.R
        return X[:-1], U, X[1:], R[:-1], R[1:], given.p, given.t[:-1], given.b

    def _at_end(self, X: Array, given: CycleData) -> tuple[Array, ...]:
        return X[-1], given.R[-1], given.p, given.t[-1:], given.b

    def defects_of(self, L: Array) -> Array:
        """C of all intervals, shape (N, nx)."""
        return L[:, : self.nx]

    def rows_of(self, L: Array, end: Array) -> Array:
        """V of all rows."""
        v = L[:, self.nx : self.nx + self.rows]
        return np.append(v.ravel(), end[: self.end_rows])

    def matrix(self, L: Array, end: Array, w: Array) -> Array:
        """G of all intervals, for weights w of all rows."""
        last_P, kernels = np.zeros(self.kernels.matrix.size1_in(0)), self.kernels
        inner, last = self.split(w)
        if kernels.end_matrix is not None:
            last_P = called(kernels.end_matrix, end, last)[0][0]
        return backwards(called(self._matrix, last_P, backwards(L), backwards(inner))[1])

    def pivots(self, G: Array) -> Array:
        """1/D of the factors in G, shape (N, nu)."""
        first = self.nu * self.nx + self.nu * (self.nu - 1) // 2
        return G[:, first : first + self.nu]

    def vector(self, L: Array, end: Array, G: Array, e: Array) -> Array:
        """Feed-forward k of all intervals, for slopes e of all rows."""
        q, kernels = np.zeros(self.nx), self.kernels
        inner, last = self.split(e)
        if kernels.end_vector is not None:
            q = called(kernels.end_vector, end, last)[0][0]
        arguments = (backwards(L), backwards(G), backwards(inner))
        return backwards(called(self._vector, q, *arguments)[1])

    def forward(self, L: Array, end: Array, G: Array, k: Array) -> Move:
        """The change that gains and feed-forward make."""
        d, M = called(self._forward, np.zeros(self.nx), L, G, k)
        rows, costs = M[:, self.nu : self.nu + self.rows].ravel(), M[:, -2:]
        if self.kernels.end_forward is not None:
            last = called(self.kernels.end_forward, d[-1], end)[0][0]
            rows, costs = np.append(rows, last[:-2]), np.vstack([costs, last[-2:]])
        return Move(np.vstack([np.zeros((1, self.nx)), d]), M[:, : self.nu], rows, costs)

    def curvature(self, X: Array, U: Array, multipliers: Array, given: CycleData) -> Array:
        """E of all intervals: upper triangles of the curvature of multipliers' F, columns."""
        (E,) = called(self._curvature, multipliers, X[:-1], U, given.R[:-1], given.p)
        return E

    def adjoint(self, L: Array, end: Array, m: Array) -> tuple[Array, Array]:
        """Gradients in the inputs (N, nu) and multipliers of the equations (N, nx)."""
        lam, kernels = np.zeros(self.nx), self.kernels
        inner, last = self.split(m)
        if kernels.end_adjoint is not None:
            lam = called(kernels.end_adjoint, end, last)[0][0]
        S = backwards(called(self._adjoint, lam, backwards(L), backwards(inner))[1])
        return S[:, : self.nu], np.ascontiguousarray(S[:, self.nu :])

    def split(self, rows: Array) -> tuple[Array, Array]:
        """Those of the intervals, shape (N, rows), and those of the end."""
        count = self.horizon.count * self.rows
        return rows[:count].reshape(self.horizon.count, self.rows), rows[count:]


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


def price_of(prices: Prices, v: Array) -> float:
    """Cost of the violations of soft rows."""
    s = np.maximum(-v, 0.0)
    return total(prices.rho * s + 0.5 * (prices.sigma * (s * s)))


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
    """A point to begin with, whose products are about equal.

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
    """Newton's aim with t z and s y at their goals, and the change to there."""
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
