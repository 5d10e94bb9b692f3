"""Tangent-space form of a constrained mechanism: index 0, in a chart made for every step.

At (q0, t0) on the constraints, with U = phi_q(q0)', B = (U'U)^-1 and the columns of V an
orthonormal basis of the tangent space, phi_q(q0) V = 0, positions and velocities near it are
functions of as many numbers w, w' as there are degrees of freedom:

    q  = q0 + V w - U u,    u with phi(q, t) = 0:            u  <- u + B phi
    q' = V w' - U s,        s with phi_q q' + phi_t = 0:     s  <- s + B (phi_q q' + phi_t)

and since V'V = I and V'U = 0, a method integrates

    (w)' = w',    (w')' = V' a,    M a + phi_q' lam = Q,   phi_q a + gamma = 0,   normal forces

with as many differential equations as degrees of freedom; accelerations a, multipliers lam and
normal forces are linearly solved unknowns. B stays frozen over the step. Derivatives at its start
follow from the implicit-function theorem,

    dq = V dw - U B phi_t dt,    dq' = V dw' - U B [r_q dq + r_t dt],    r = phi_q q' + phi_t,

so none goes through a factorisation. The next step gets V and projects it onto its own tangent
space: no basis is ever chosen, and none turns singular.

Source: Haug, Mech. Based Des. Struct. Mach., 2016-2018 (tangent-space index-0 DAE).
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, final

import casadi as ca
import numpy as np

from symfric.integrator.equations.manifold import Manifold
from symfric.integrator.equations.matrices import factorise
from symfric.integrator.equations.system import System
from symfric.integrator.methods.method import Trial

POSITION, VELOCITY = 3, 4
"""Frozen iterations of q and q' from the origin of the chart: each gains an order in |w|, from 2
and from 1, and the stages of a method of order 5 need 5.
"""


@final
@dataclass(frozen=True, eq=False)
class Tangent:
    """Functions between the unknowns y of a mechanism and y_c = (w, w', other unknowns) in a chart.

    Attributes:
        reduced: the system in the chart; its run data are (d, chart).
        open: (y, d) -> (d, chart) for the chart at y.
        enter: (y, data) -> y_c at its origin.
        leave: (y_c, data) -> y, on the constraints to the order of the method.
        polish: (y, d) -> y on the constraints.
        lift: (e_c, data) -> change of y, to first order.
        bend: (y0, y1, h, data) -> correction of the dense output, normal to the chart: two columns,
            of a cubic with the values and rates at both ends.
    """

    reduced: System
    open: ca.Function
    enter: ca.Function
    leave: ca.Function
    polish: ca.Function
    lift: ca.Function
    bend: ca.Function

    def trial(self, found: Trial, y: Any, h: Any, d: Any, data: Any) -> Trial:
        """Convert a step in the chart to the unknowns of the mechanism."""
        free = self.leave(found.end, data)
        end = self.polish(free, d)
        dense = [self.lift(row, data) for row in found.dense]
        for i, column in enumerate(self.bend(y, end, h, data)[: len(dense)]):
            dense[i] = dense[i] + column
        return Trial(
            end,
            None if found.error is None else self.lift(found.error, data),
            tuple(dense),
            corrections=tuple(self.lift(change, data) for change in found.corrections),
            shift=end - free,
        )


@final
@dataclass(frozen=True, eq=False)
class _Rows:
    """Layout of y = (q, q', s, a, lam and normal forces, V, t)."""

    n: int
    nv: int
    m: int
    states: range
    algebraic: range
    basis: range
    time: range

    @classmethod
    def of(cls, system: System, manifold: Manifold) -> "_Rows":
        n, m, nx, basis = manifold.n, manifold.m, manifold.first, manifold.basis
        return cls(
            n, n - m, m, range(2 * n, nx), range(nx, basis.start), basis,
            range(basis.stop, system.n),
        )  # fmt: skip

    @property
    def others(self) -> list[int]:
        """Rows that a chart leaves unchanged, except time."""
        return [*self.states, *self.algebraic]


@final
@dataclass(frozen=True, eq=False)
class _Constraints:
    """Constraints as Functions of positions, velocities, time and run data.

    Attributes:
        phi: (q, t, d) -> constraints.
        rate: (q, q', t, d) -> r = phi_q q' + phi_t.
        slopes: (q, q', t, d) -> phi_q, phi_t, r_q, r_t.
        pattern: of phi_q.
    """

    phi: ca.Function
    rate: ca.Function
    slopes: ca.Function
    pattern: ca.Sparsity

    @classmethod
    def of(cls, system: System, manifold: Manifold, rows: _Rows) -> "_Constraints":
        y, d, n = system.y, system.d, rows.n
        q, qd, t = y[:n], y[n : 2 * n], y[list(rows.time), 0]
        both = manifold.defect(y, d)
        phi, rate = both[: rows.m], both[rows.m :]
        slopes = [ca.jacobian(e, x) for e, x in ((phi, q), (phi, t), (rate, q), (rate, t))]
        return cls(
            ca.Function("phi", [q, t, d], [phi], {"cse": True}),
            ca.Function("rate", [q, qd, t, d], [rate], {"cse": True}),
            ca.Function("slopes", [q, qd, t, d], slopes, {"cse": True}),
            slopes[0].sparsity(),
        )


@final
@dataclass(frozen=True, eq=False)
class _Chart:
    """Symbols of a chart.

    Attributes:
        q0, V: point and basis.
        phi_q: Jacobian of the constraints there.
        lu: factors of phi_q phi_q'.
        factor: phi_q -> lu.
        solve: (lu, r) -> B r.
    """

    q0: ca.SX
    V: ca.SX
    phi_q: ca.SX
    lu: ca.SX
    factor: ca.Function
    solve: ca.Function

    @classmethod
    def of(cls, rows: _Rows, pattern: ca.Sparsity) -> "_Chart":
        phi_q, r = ca.SX.sym("phi_q", pattern), ca.SX.sym("r", rows.m)
        lu = factorise(ca.sparsify(phi_q @ phi_q.T), [range(rows.m)])
        return cls(
            ca.SX.sym("q0", rows.n),
            ca.SX.sym("V", rows.n, rows.nv),
            phi_q,
            lu.symbols,
            ca.Function("factor_chart", [phi_q], [lu.packed], {"cse": True}),
            ca.Function("solve_chart", [lu.symbols, r], [lu.solve(r)]),
        )

    @property
    def symbols(self) -> ca.SX:
        """All symbols as one column."""
        return ca.vertcat(self.q0, ca.vec(self.V), _entries(self.phi_q), self.lu)

    def across(self, r: ca.SX) -> ca.SX:
        """Return U B r, column by column."""
        columns = (self.phi_q.T @ self.solve(self.lu, r[:, i]) for i in range(r.shape[1]))
        return ca.horzcat(ca.SX(self.q0.numel(), 0), *columns)

    def along(self, x: ca.SX) -> ca.SX:
        """Return the part of x in the chart, V V' x."""
        return self.V @ (self.V.T @ x)


@lru_cache(maxsize=2)
def tangent(system: System) -> Tangent | None:
    """Return the tangent-space form of a mechanism that requests it; None for any other system."""
    manifold = system.manifold
    if manifold is None or not manifold.charted:
        return None
    rows = _Rows.of(system, manifold)
    constraints = _Constraints.of(system, manifold, rows)
    chart = _Chart.of(rows, constraints.pattern)
    reduced = _reduced(system, rows, constraints, chart)
    y, d, data, n, nv = system.y, system.d, reduced.d, rows.n, rows.nv
    q, qd, others, t = _embedded(reduced.y, d, rows, constraints, chart)
    at = ca.vertcat(q, qd, others, ca.vec(chart.V), t)
    inside = ca.vertcat(ca.SX(nv, 1), chart.V.T @ y[n : 2 * n], y[rows.others], y[list(rows.time)])
    w, wd, others, t = _parts(reduced.y, rows)
    change = ca.vertcat(chart.V @ w, chart.V @ wd, others, ca.SX.zeros(len(rows.basis)), t)
    return Tangent(
        reduced,
        _open(system, rows, constraints, chart),
        ca.Function("enter", [y, data], [inside], {"cse": True}),
        ca.Function("leave", [reduced.y, data], [at], {"cse": True}),
        manifold.polish,
        ca.Function("lift", [reduced.y, data], [change]),
        _bend(system, data, rows, chart),
    )


def _entries(matrix: ca.SX) -> ca.SX:
    """Return the nonzeros as a column."""
    return ca.vec(ca.SX(matrix.nz[:]))


def _parts(y_c: ca.SX, rows: _Rows) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    """Return w, w', the unknowns that a chart leaves unchanged, and time."""
    end = 2 * rows.nv + len(rows.others)
    return y_c[: rows.nv], y_c[rows.nv : 2 * rows.nv], y_c[2 * rows.nv : end], y_c[end:, 0]


def _embedded(
    y_c: ca.SX, d: ca.SX, rows: _Rows, constraints: _Constraints, chart: _Chart
) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    """Return positions, velocities, other unknowns and time at y_c."""
    w, wd, others, t = _parts(y_c, rows)
    q, qd = chart.q0 + chart.V @ w, chart.V @ wd
    for _ in range(POSITION):
        q = q - chart.across(constraints.phi(q, t, d))
    for _ in range(VELOCITY):
        qd = qd - chart.across(constraints.rate(q, qd, t, d))
    return q, qd, others, t


def _reduced(system: System, rows: _Rows, constraints: _Constraints, chart: _Chart) -> System:
    """Return the equations in the chart, with their Jacobian at its origin."""
    n, nv = rows.n, rows.nv
    q, qd, t = system.y[:n], system.y[n : 2 * n], system.y[list(rows.time)]
    own = system.y[rows.others]
    y_c = ca.vertcat(ca.SX.sym("w", nv), ca.SX.sym("w_dot", nv), own, t)
    f = ca.Function("others", [q, qd, own, t, system.d], [system.f[rows.others]], {"cse": True})
    a = own[len(rows.states) : len(rows.states) + n]
    moved = f(*_embedded(y_c, system.d, rows, constraints, chart), system.d)
    rates = ca.vertcat(y_c[nv : 2 * nv], chart.V.T @ a, moved, ca.SX.ones(t.numel()))
    differential = 2 * nv + len(rows.states)
    first, count = differential, len(rows.algebraic)
    mass = ca.diagcat(ca.SX.eye(differential), ca.SX(count, count), ca.SX.eye(t.numel()))
    own_names = [system.names[i] for i in rows.others]
    return System(
        y_c,
        ca.vertcat(system.d, chart.symbols),
        rates,
        mass,
        differential,
        system.timed,
        (*(f"chart_{i}" for i in range(2 * nv)), *own_names, *(["t"] if system.timed else [])),
        np.ones(differential),
        ca.SX(0, 1),
        ca.SX(0, 1),
        pivots=(
            tuple(range(first, first + n)),
            tuple(range(first + n, first + n + rows.m)),
            tuple(range(first + n + rows.m, first + count)),
            tuple(range(differential)),
        ),
        slope=_slope(system, y_c, rows, constraints, chart),
        branchless=system.branchless,
    )


def _slope(
    system: System, y_c: ca.SX, rows: _Rows, constraints: _Constraints, chart: _Chart
) -> ca.SX:
    """Return the Jacobian of the reduced equations at the origin of the chart."""
    n, nv, d = rows.n, rows.nv, system.d
    _, wd, own, t = _parts(y_c, rows)
    q, qd, time = system.y[:n], system.y[n : 2 * n], system.y[list(rows.time)]
    f = system.f[rows.others]
    to_q, to_qd = ca.SX.sym("to_q", n, nv + t.numel()), ca.SX.sym("to_qd", n, nv + t.numel())
    along = ca.jtimes(f, ca.vertcat(q, qd), ca.vertcat(to_q, to_qd))
    slopes = ca.Function(
        "slopes_f", [q, qd, own, time, d, to_q, to_qd],
        [along, ca.jtimes(f, qd, to_q[:, :nv]), ca.jacobian(f, own), ca.jacobian(f, time)],
        {"cse": True},
    )  # fmt: skip
    still = chart.V @ wd
    _, phi_t, r_q, r_t = constraints.slopes(chart.q0, still, t, d)
    qd_0 = still
    if t.numel():
        qd_0 = still - chart.across(phi_t)
        _, phi_t, r_q, r_t = constraints.slopes(chart.q0, qd_0, t, d)
    q_w, q_t = chart.V, -chart.across(phi_t)
    qd_w, qd_t = -chart.across(r_q @ q_w), -chart.across(r_q @ q_t + r_t)
    moved, f_wd, f_own, f_t = slopes(
        chart.q0, qd_0, own, t, d, ca.horzcat(q_w, q_t), ca.horzcat(qd_w, qd_t)
    )
    moved = ca.horzcat(moved[:, :nv], f_wd, f_own, moved[:, nv:] + f_t)
    rates = ca.SX(2 * nv, y_c.numel())
    rates[:nv, nv : 2 * nv] = ca.SX.eye(nv)
    first = 2 * nv + len(rows.states)
    rates[nv:, first : first + n] = chart.V.T
    return ca.sparsify(ca.vertcat(rates, moved, ca.SX(t.numel(), y_c.numel())))


def _open(system: System, rows: _Rows, constraints: _Constraints, chart: _Chart) -> ca.Function:
    """Return the chart at y: its V projected onto the tangent space there and made orthonormal."""
    y, d, n = system.y, system.d, rows.n
    before = ca.SX.sym("before", n, rows.nv)
    projected = before - chart.across(chart.phi_q @ before)
    columns: list[ca.SX] = []
    for i in range(rows.nv):
        v = projected[:, i]
        for earlier in columns:
            v = v - earlier * ca.dot(earlier, v)
        columns.append(v / ca.sqrt(ca.dot(v, v)))
    turned = ca.Function("turned", [before, chart.phi_q, chart.lu], [ca.horzcat(*columns)])
    phi_q = constraints.slopes(y[:n], y[n : 2 * n], y[list(rows.time)], d)[0]
    lu = chart.factor(phi_q)
    basis = turned(ca.reshape(y[list(rows.basis)], n, rows.nv), phi_q, lu)
    return ca.Function(
        "open", [y, d], [ca.vertcat(d, y[:n], ca.vec(basis), _entries(phi_q), lu)], {"cse": True}
    )


def _bend(system: System, data: ca.SX, rows: _Rows, chart: _Chart) -> ca.Function:
    """Return cubics through positions and velocities at both ends, normal to the chart."""
    n, h = rows.n, ca.SX.sym("h")
    y0, y1 = system.y, ca.SX.sym("y1", system.n)
    first, second = ca.SX.zeros(system.n), ca.SX.zeros(system.n)
    a = rows.algebraic.start
    for at, slope in ((0, n), (n, a)):
        rise = y1[at : at + n] - y0[at : at + n]
        one = h * y0[slope : slope + n] - rise
        two = rise - h * y1[slope : slope + n] - one
        first[at : at + n] = one - chart.along(one)
        second[at : at + n] = two - chart.along(two)
    return ca.Function("bend", [y0, y1, h, data], [first, second], {"cse": True})
