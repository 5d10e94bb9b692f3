"""Computations of one interval of the horizon, as SX Functions of columns.

The quadratic program of an iteration, with the change d of the states and c = F(x, u) - after, is

    min  sum_k g_k'(d_k, du_k) + 1/2 (d_k, du_k)'H_k(d_k, du_k) + the same of d_(k+1)
    s.t. d_(k+1) = A_k d_k + B_k du_k + c_k,   d_0 = 0,   v + D (d_k, du_k, d_(k+1)) >= 0

It is solved by a Riccati recursion, in which an interior-point method adds weights w and slopes e
of the rows, H + D'w D and g + D'e. The loops over the intervals in C (`ocp.mpc.source`) call these
functions. Constants in A, B, H and D are part of the code.

Source: Rao, Wright and Rawlings, Application of interior-point methods to model predictive control,
    JOTA 99(3), 1998.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, final

import casadi as ca

from ocp.mpc.horizon import Horizon
from symfric.foundation.variable import stacked


@final
class Packed:
    """Matrices stored as one column of their varying entries."""

    def __init__(self) -> None:
        self.entries: list[ca.SX] = []
        self._parts: dict[str, tuple[ca.SX, list[int]]] = {}

    def add(self, name: str, matrix: ca.SX, *, all_of_it: bool = False) -> None:
        """Append the varying entries of a matrix, or all entries if `all_of_it`."""
        matrix = ca.densify(ca.SX(matrix)) if all_of_it else ca.sparsify(ca.SX(matrix))
        places: list[int] = []
        entries: list[Any] = matrix.nonzeros()
        for entry in map(ca.SX, entries):
            varies = all_of_it or not entry.is_constant()
            places.append(len(self.entries) if varies else -1)
            self.entries += [entry] * varies
        self._parts[name] = matrix, places

    def part(self, name: str, column: ca.SX) -> ca.SX:
        """Return the matrix `name` with its varying entries from `column`."""
        matrix, places = self._parts[name]
        pairs = zip(matrix.nonzeros(), places, strict=True)
        values = [entry if place < 0 else column[place] for entry, place in pairs]
        return ca.SX(matrix.sparsity(), stacked(values))


@final
@dataclass(frozen=True, eq=False)
class Kernels:
    """Functions of an interval and of the end of the horizon.

    The functions of the end are None if there is no cost and no condition at the end.

    Attributes:
        advance: (x, u, r, p) -> x after a substep.
        tangent: (x, S, u, r, p) -> (x, S) after a substep; S is the column of structural entries of
            the derivative with respect to (x, u) at the beginning of the interval.
        bend: (lam, E, x, S, u, r, p) -> (lam, E) before a substep: lam changes from multipliers of
            its end to those of its beginning, and the curvature of lam' x after it is added to E.
        linear: (x, u, after, r, r_after, p, t, b, to, S) -> L = (c, v, all varying entries of the
            program), where to = F(x, u).
        value: (x, u, after, r, r_after, p, t, b, to) -> (c, v, cost).
        matrix: (P, L, w) -> (P, G): one step of the Riccati recursion; `vector` and `forward`
            use G.
        vector: (q, L, G, e) -> (q, k): linear part of the cost-to-go, and constant part of the
            control.
        forward: (d, L, G, k) -> (d, M = (du, change of v, slope and curvature of the cost)).
        adjoint: (lam, L, m) -> (lam, S = (gradient in u, multipliers of the equations)), with
            multipliers m of the rows.
        end_linear, end_value: (x, r, p, t, b) -> L = (v, ...), (v, cost).
        end_matrix, end_vector, end_adjoint: (L, w | e | m) -> P | q | lam.
        end_forward: (d, L) -> M = (change of v, slope and curvature of the cost).
        identity: S at the beginning of an interval.
    """

    advance: ca.Function
    tangent: ca.Function
    bend: ca.Function
    linear: ca.Function
    value: ca.Function
    matrix: ca.Function
    vector: ca.Function
    forward: ca.Function
    adjoint: ca.Function
    identity: tuple[float, ...]
    end_linear: ca.Function | None = None
    end_value: ca.Function | None = None
    end_matrix: ca.Function | None = None
    end_vector: ca.Function | None = None
    end_forward: ca.Function | None = None
    end_adjoint: ca.Function | None = None

    @property
    def all(self) -> list[ca.Function]:
        """All Functions that are not None."""
        return [f for f in vars(self).values() if isinstance(f, ca.Function)]


def upper(matrix: ca.SX) -> ca.SX:
    """Return the upper triangle of a symmetric matrix as a dense column."""
    n = matrix.shape[0]
    return stacked(matrix[i, j] for j in range(n) for i in range(j + 1))


def symmetric(column: ca.SX, n: int) -> ca.SX:
    """Return the symmetric (n, n) matrix of an upper triangle stored by `upper`."""
    found = ca.SX(ca.Sparsity.dense(n, n))
    for j in range(n):
        for i in range(j + 1):
            found[i, j] = found[j, i] = column[j * (j + 1) // 2 + i]
    return found


def factored(matrix: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return L and 1/D of a positive definite matrix L D L', without pivoting."""
    n = matrix.shape[0]
    lower, inverse = ca.SX.eye(n), ca.SX(n, 1)
    for j in range(n):
        d = matrix[j, j] - sum((lower[j, k] ** 2 / inverse[k] for k in range(j)), ca.SX(0))
        inverse[j] = 1 / d
        for i in range(j + 1, n):
            inner = sum((lower[i, k] * lower[j, k] / inverse[k] for k in range(j)), ca.SX(0))
            lower[i, j] = (matrix[i, j] - inner) * inverse[j]
    return lower, inverse


def solved(lower: ca.SX, inverse: ca.SX, right: ca.SX) -> ca.SX:
    """Return (L D L')^-1 right."""
    n = lower.shape[0]
    rows = [right[i, :] for i in range(n)]
    for i in range(n):
        for k in range(i):
            rows[i] = rows[i] - lower[i, k] * rows[k]
    rows = [row * inverse[i] for i, row in enumerate(rows)]
    for i in reversed(range(n)):
        for k in range(i + 1, n):
            rows[i] = rows[i] - lower[k, i] * rows[k]
    return ca.vertcat(*rows)


def kernels(horizon: Horizon) -> Kernels:
    """Return the Functions of a horizon."""
    h = horizon
    nx, nu = h.x.numel(), h.u.numel()
    arguments = [h.x, h.u, h.after, h.r, h.r_after, h.p, h.t, h.b]
    moved = h.advance(h.x, h.u, h.r, h.p)
    slopes, after = _slopes(moved, h.x, h.u)
    S, to = ca.vertcat(ca.SX(0, 1), slopes.nz[:]), ca.SX.sym("to", nx)
    c = to - h.after
    pack = Packed()
    pack.add("c", c, all_of_it=True)
    pack.add("v", h.v, all_of_it=True)
    pack.add("F", slopes)
    for name, costs in (("early", h.early), ("late", h.late)):
        pack.add(f"g {name}", costs.gradient)
        pack.add(f"H {name}", costs.hessian)
    pack.add("D early", ca.jacobian(h.v, ca.vertcat(h.x, h.u)))
    pack.add("D late", ca.jacobian(h.v, h.after))
    lam, E = ca.SX.sym("lam", nx), ca.SX.sym("E", (nx + nu) * (nx + nu + 1) // 2)
    pack.add("E", ca.SX(*E.shape), all_of_it=True)
    curvature, gradient = ca.hessian(ca.dot(lam, moved), ca.vertcat(h.x, h.u))
    chain = ca.vertcat(slopes, ca.horzcat(ca.SX(nu, nx), ca.SX.eye(nu)))
    bent = E + upper(chain.T @ curvature @ chain)
    value = ca.vertcat(c, h.v, h.early.value + h.late.value)
    functions = [
        _function("tangent", [h.x, S, h.u, h.r, h.p], [moved, after]),
        _function("bend", [lam, E, h.x, S, h.u, h.r, h.p], [gradient[:nx], bent]),
        _function("linear", [*arguments, to, S], [stacked(pack.entries)]),
        _function("value", [*arguments, to], [value]),
        *_recursion(pack, nx, nu, len(h.limits)),
        *_end(h),
    ]
    identity = ca.project(ca.horzcat(ca.DM.eye(nx), ca.DM(nx, nu)), slopes.sparsity())
    start = tuple(map(float, ca.DM(identity).nonzeros()))
    return Kernels(advance=h.advance, identity=start, **{f.name(): f for f in functions})


def _function(name: str, arguments: Sequence[ca.SX], results: Sequence[ca.SX]) -> ca.Function:
    dense = [ca.densify(ca.SX(r)) for r in results]
    return ca.Function(name, list(arguments), dense, {"cse": True})


def _slopes(moved: ca.SX, x: ca.SX, u: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return the derivative of F as a matrix of symbols, and its entries after a substep."""
    nx, nu = x.numel(), u.numel()
    by_x, by_u = ca.jacobian(moved, x), ca.jacobian(moved, u)
    before = ca.Sparsity(nx, nx + nu)
    pattern = ca.horzcat(ca.DM.eye(nx), ca.DM(nx, nu)).sparsity()
    while pattern != before:
        before = pattern
        ones = ca.DM(by_x.sparsity(), 1) @ ca.DM(pattern, 1)
        ones += ca.horzcat(ca.DM(nx, nx), ca.DM(by_u.sparsity(), 1))
        pattern = ones.sparsity() + before
    slopes = ca.SX(pattern, ca.SX.sym("S", pattern.nnz()))
    after = ca.project(by_x @ slopes + ca.horzcat(ca.SX(nx, nx), by_u), pattern)
    return slopes, ca.vertcat(ca.SX(0, 1), *ca.vertsplit(after.nz[:]))


def _recursion(pack: Packed, nx: int, nu: int, rows: int) -> list[ca.Function]:
    """Return `matrix`, `vector`, `forward` and `adjoint` for packed matrices."""
    L = ca.SX.sym("L", len(pack.entries))
    F, g, H, D, g_late, H_late, D_late = (
        pack.part(name, L)
        for name in ("F", "g early", "H early", "D early", "g late", "H late", "D late")
    )
    c, size = L[:nx], nx * (nx + 1) // 2
    P, q, w, e = (ca.SX.sym(n, k) for n, k in (("P", size), ("q", nx), ("w", rows), ("e", rows)))
    # one step of the Riccati recursion, backwards
    whole = symmetric(P, nx) + H_late + D_late.T @ ca.diag(w) @ D_late
    curved = H + symmetric(pack.part("E", L), nx + nu)
    Q = curved + D.T @ ca.diag(w) @ D + F.T @ whole @ F
    lower, inverse = factored(Q[nx:, nx:])
    gain = -solved(lower, inverse, Q[nx:, :nx])
    before = Q[:nx, :nx] + Q[:nx, nx:] @ gain
    kept = Packed()
    for name, part in (("K", gain), ("L", ca.tril(lower, False)), ("1/D", inverse)):
        kept.add(name, part, all_of_it=name != "L")
    kept.add("P", upper(whole), all_of_it=True)
    G = ca.SX.sym("G", len(kept.entries))
    K, P_whole = kept.part("K", G), symmetric(kept.part("P", G), nx)
    slope = q + g_late + D_late.T @ e + P_whole @ c
    both = g + D.T @ e + F.T @ slope
    k = -solved(kept.part("L", G) + ca.SX.eye(nu), kept.part("1/D", G), both[nx:])
    # forward pass
    d, feed = ca.SX.sym("d", nx), ca.SX.sym("k", nu)
    du = K @ d + feed
    now = ca.vertcat(d, du)
    then = F @ now + c
    moved = D @ now + D_late @ then
    tilt = ca.dot(g, now) + ca.dot(g_late, then)
    bend = ca.dot(now, curved @ now) + ca.dot(then, H_late @ then)
    # multipliers
    lam, m = ca.SX.sym("lam", nx), ca.SX.sym("m", rows)
    late = lam + g_late - D_late.T @ m
    gradient = g - D.T @ m + F.T @ late
    return [
        _function("matrix", [P, L, w], [upper(before), stacked(kept.entries)]),
        _function("vector", [q, L, G, e], [both[:nx] + K.T @ both[nx:], k]),
        _function("forward", [d, L, G, feed], [then, ca.vertcat(du, moved, tilt, bend)]),
        _function("adjoint", [lam, L, m], [gradient[:nx], ca.vertcat(gradient[nx:], late)]),
    ]


def _end(h: Horizon) -> list[ca.Function]:
    """Return the Functions of the end of the horizon; [] without cost and conditions there."""
    rows = len(h.end_limits)
    if not rows and not ca.depends_on(h.end.value, h.x):
        return []
    arguments = [h.x, h.r, h.p, h.t, h.b]
    pack = Packed()
    pack.add("v", h.v_end, all_of_it=True)
    pack.add("g", h.end.gradient)
    pack.add("H", h.end.hessian)
    pack.add("D", ca.jacobian(h.v_end, h.x))
    L = ca.SX.sym("L", len(pack.entries))
    g, H, D = (pack.part(name, L) for name in "gHD")
    w, e, d = (ca.SX.sym(n, k) for n, k in (("w", rows), ("e", rows), ("d", h.x.numel())))
    tilt, bend = ca.dot(g, d), ca.dot(d, H @ d)
    return [
        _function("end_linear", arguments, [stacked(pack.entries)]),
        _function("end_value", arguments, [ca.vertcat(h.v_end, h.end.value)]),
        _function("end_matrix", [L, w], [upper(H + D.T @ ca.diag(w) @ D)]),
        _function("end_vector", [L, e], [g + D.T @ e]),
        _function("end_forward", [d, L], [ca.vertcat(D @ d, tilt, bend)]),
        _function("end_adjoint", [L, e], [g - D.T @ e]),
    ]
