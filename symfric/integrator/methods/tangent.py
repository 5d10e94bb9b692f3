"""Tangent-space form of a constrained mechanism (index 0), in a new chart for every step.

At (q0, t0) on the constraints, let U = phi_q(q0)' and B = (U'U)^-1, and let the columns of V be an
orthonormal basis of the tangent space, phi_q(q0) V = 0. Positions and velocities nearby are
functions of coordinates w and w', of which there are as many as degrees of freedom:

    q  = q0 + V w - U u,    u with phi(q, t) = 0:            u  <- u + B phi
    q' = V w' - U s,        s with phi_q q' + phi_t = 0:     s  <- s + B (phi_q q' + phi_t)

Since V'V = I and V'U = 0, a method integrates

    (w)' = w',    (w')' = V' a,    M a + phi_q' lam = Q,   phi_q a + gamma = 0,   normal forces

with as many second-order differential equations as degrees of freedom. Accelerations a, multipliers
lam and normal forces are algebraic unknowns. B is constant over the step. The derivatives at the
start of the step follow from the implicit-function theorem,

    dq = V dw - U B phi_t dt,    dq' = V dw' - U B [r_q dq + r_t dt],    r = phi_q q' + phi_t,

so none of them goes through a factorisation. The next step takes over V and projects it onto its
own tangent space. No step has to choose a basis, and no basis becomes singular.

Source: Haug, Mech. Based Des. Struct. Mach., 2016-2018 (tangent-space index-0 DAE).
"""

from typing import Any, final

import casadi as ca
import numpy as np

from symfric.integrator.equations.manifold import Manifold
from symfric.integrator.equations.matrices import factorise
from symfric.integrator.equations.system import System
from symfric.integrator.methods.method import Trial

POSITION, VELOCITY = 3, 4
"""Numbers of iterations with constant B, for q and for q', from the origin of the chart.

Each iteration gains an order in |w|, from order 2 for q and from order 1 for q'. The stages of a
method of order 5 need order 5.
"""


@final
class TangentChart:
    """Chart of a mechanism with y = (q, q', s, a, lam and normal forces, V, t).

    The unknowns in the chart are y_c = (w, w', other unknowns).

    Attributes:
        n, nv, m: numbers of coordinates, degrees of freedom and constraints.
        others: rows of s, a, lam and normal forces, which a chart leaves unchanged, as it does
            `time`.
        phi: (q, t, d) -> constraints.
        rate: (q, q', t, d) -> r = phi_q q' + phi_t.
        slopes: (q, q', t, d) -> phi_q, phi_t, r_q, r_t.
        q0, V, phi_q, lu: symbols for point, basis, Jacobian of the constraints and its factors.
        reduced: system in the chart, with its Jacobian at the origin; its run data are (d, chart).
        open: (y, d) -> (d, chart) for the chart at y.
        enter: (y, data) -> y_c at the origin of the chart.
        leave: (y_c, data) -> y, on the constraints to the order of the method.
        lift: (e_c, data) -> change of y, to first order.
        bend: (y0, y1, h, data) -> correction of the dense output normal to the chart: two columns,
            of a cubic with the values and rates at both ends.
    """

    def __init__(self, system: System, manifold: Manifold) -> None:
        n, m, nx, y, d = manifold.n, manifold.m, manifold.first, system.y, system.d
        self.system, self.manifold, self.n, self.nv, self.m = system, manifold, n, n - m, m
        self.others = list(range(2 * n, manifold.basis.start))
        self.time = list(range(manifold.basis.stop, system.n))
        self.q, self.qd, self.own, self.t = y[:n], y[n : 2 * n], y[self.others], y[self.time, 0]
        q, qd, t = self.q, self.qd, self.t
        phi, rate = ca.vertsplit(manifold.defect(y, d), m)
        slopes = [ca.jacobian(e, x) for e, x in ((phi, q), (phi, t), (rate, q), (rate, t))]
        self.phi = ca.Function("phi", [q, t, d], [phi], {"cse": True})
        self.rate = ca.Function("rate", [q, qd, t, d], [rate], {"cse": True})
        self.slopes = ca.Function("slopes", [q, qd, t, d], slopes, {"cse": True})
        self.q0, self.V = ca.SX.sym("q0", n), ca.SX.sym("V", n, self.nv)
        self.phi_q = ca.SX.sym("phi_q", slopes[0].sparsity())
        lu = factorise(ca.sparsify(self.phi_q @ self.phi_q.T), [range(m)])
        self.lu, self.solve = lu.symbols, lu.solver("solve")
        self.factor = ca.Function("factor", [self.phi_q], [lu.packed], {"cse": True})
        self.reduced = self._reduced(nx - 2 * n)
        y_c, data, basis = self.reduced.y, self.reduced.d, ca.SX.zeros(len(manifold.basis))
        w, wd, own, dt = self.parts(y_c)
        inside = ca.vertcat(ca.SX(self.nv, 1), self.V.T @ qd, self.own, t)
        change = ca.vertcat(self.V @ w, self.V @ wd, own, basis, dt)
        *at, after = self.embedded(y_c)
        at = ca.vertcat(*at, ca.vec(self.V), after)
        self.open = self._open()
        self.enter = ca.Function("enter", [y, data], [inside], {"cse": True})
        self.leave = ca.Function("leave", [y_c, data], [at], {"cse": True})
        self.lift = ca.Function("lift", [y_c, data], [change])
        self.bend = self._bend()

    def trial(self, found: Trial, y: Any, h: Any, d: Any, data: Any) -> Trial:
        """Convert a step in the chart to the unknowns of the mechanism."""
        free = self.leave(found.end, data)
        end = self.manifold.polish(free, d)
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

    def across(self, r: ca.SX) -> ca.SX:
        """Return U B r, column by column."""
        columns = (self.phi_q.T @ self.solve(self.lu, column) for column in ca.horzsplit(r))
        return ca.horzcat(ca.SX(self.n, 0), *columns)

    def parts(self, y_c: ca.SX) -> list[ca.SX]:
        """Return w, w', the unknowns that a chart leaves unchanged, and time."""
        nv, end = self.nv, 2 * self.nv + len(self.others)
        return [y_c[:nv], y_c[nv : 2 * nv], y_c[2 * nv : end], y_c[end:, 0]]

    def embedded(self, y_c: ca.SX) -> list[ca.SX]:
        """Return positions, velocities, other unknowns and time at y_c."""
        (w, wd, others, t), d = self.parts(y_c), self.system.d
        q, qd = self.q0 + self.V @ w, self.V @ wd
        for _ in range(POSITION):
            q = q - self.across(self.phi(q, t, d))
        for _ in range(VELOCITY):
            qd = qd - self.across(self.rate(q, qd, t, d))
        return [q, qd, others, t]

    def _reduced(self, states: int) -> System:
        """Return the system in the chart; `states` is the number of unknowns s."""
        system, n, nv, t = self.system, self.n, self.nv, self.t
        y_c = ca.vertcat(ca.SX.sym("w", nv), ca.SX.sym("w_dot", nv), self.own, t)
        arguments = [self.q, self.qd, self.own, t, system.d]
        f = ca.Function("others", arguments, [system.f[self.others]], {"cse": True})
        moved = f(*self.embedded(y_c), system.d)
        first, end = 2 * nv + states, 2 * nv + len(self.others)
        a = y_c[first : first + n]
        rates = ca.vertcat(y_c[nv : 2 * nv], self.V.T @ a, moved, ca.SX.ones(t.numel()))
        mass = ca.diagcat(ca.SX.eye(first), ca.SX(end - first, end - first), ca.SX.eye(t.numel()))
        names = [*(f"chart_{i}" for i in range(2 * nv)), *(system.names[i] for i in self.others)]
        chart = ca.vertcat(self.q0, ca.vec(self.V), _entries(self.phi_q), self.lu)
        starts = (first, first + n, first + n + self.m, end)
        return System(
            y_c,
            ca.vertcat(system.d, chart),
            rates,
            mass,
            first,
            system.timed,
            (*names, *(["t"] if system.timed else [])),
            np.ones(first),
            ca.SX(0, 1),
            ca.SX(0, 1),
            pivots=(*map(tuple, map(range, starts, starts[1:])), tuple(range(first))),
            slope=self._slope(y_c, first),
            branchless=system.branchless,
        )

    def _slope(self, y_c: ca.SX, first: int) -> ca.SX:
        """Return the Jacobian of the reduced equations at the origin of the chart.

        Accelerations begin at index `first` of the unknowns.
        """
        n, nv, d, f = self.n, self.nv, self.system.d, self.system.f[self.others]
        (_, wd, own, t), count = self.parts(y_c), nv + self.t.numel()
        to_q, to_qd = ca.SX.sym("to_q", n, count), ca.SX.sym("to_qd", n, count)
        along = ca.jtimes(f, ca.vertcat(self.q, self.qd), ca.vertcat(to_q, to_qd))
        slopes = ca.Function(
            "slopes_f", [self.q, self.qd, self.own, self.t, d, to_q, to_qd],
            [
                along, ca.jtimes(f, self.qd, to_q[:, :nv]), ca.jacobian(f, self.own),
                ca.jacobian(f, self.t),
            ],
            {"cse": True},
        )  # fmt: skip
        qd = self.V @ wd
        _, phi_t, r_q, r_t = self.slopes(self.q0, qd, t, d)
        if t.numel():
            qd = qd - self.across(phi_t)
            _, phi_t, r_q, r_t = self.slopes(self.q0, qd, t, d)
        q_t = -self.across(phi_t)
        to_q, to_qd = (
            ca.horzcat(self.V, q_t),
            ca.horzcat(-self.across(r_q @ self.V), -self.across(r_q @ q_t + r_t)),
        )
        moved, f_wd, f_own, f_t = slopes(self.q0, qd, own, t, d, to_q, to_qd)
        moved = ca.horzcat(moved[:, :nv], f_wd, f_own, moved[:, nv:] + f_t)
        rates = ca.SX(2 * nv, y_c.numel())
        rates[:nv, nv : 2 * nv] = ca.SX.eye(nv)
        rates[nv:, first : first + n] = self.V.T
        return ca.sparsify(ca.vertcat(rates, moved, ca.SX(t.numel(), y_c.numel())))

    def _open(self) -> ca.Function:
        """Return the Function `open`; Gram-Schmidt makes the projection of V orthonormal."""
        y, d, before = self.system.y, self.system.d, ca.SX.sym("before", self.n, self.nv)
        columns: list[ca.SX] = []
        for v in ca.horzsplit(before - self.across(self.phi_q @ before)):
            for earlier in columns:
                v = v - earlier * ca.dot(earlier, v)
            columns.append(v / ca.sqrt(ca.dot(v, v)))
        turned = ca.Function("turned", [before, self.phi_q, self.lu], [ca.horzcat(*columns)])
        phi_q = self.slopes(self.q, self.qd, self.t, d)[0]
        lu = self.factor(phi_q)
        basis = turned(ca.reshape(y[list(self.manifold.basis)], self.n, self.nv), phi_q, lu)
        chart = ca.vertcat(d, self.q, ca.vec(basis), _entries(phi_q), lu)
        return ca.Function("open", [y, d], [chart], {"cse": True})

    def _bend(self) -> ca.Function:
        """Return the Function `bend`, with cubics through positions and velocities at both ends."""
        n, h = self.n, ca.SX.sym("h")
        y0, y1 = self.system.y, ca.SX.sym("y1", self.system.n)
        first, second = ca.SX.zeros(self.system.n), ca.SX.zeros(self.system.n)
        for at, slope in ((0, n), (n, self.manifold.first)):
            rise = y1[at : at + n] - y0[at : at + n]
            one = h * y0[slope : slope + n] - rise
            two = rise - h * y1[slope : slope + n] - one
            first[at : at + n] = one - self.V @ (self.V.T @ one)
            second[at : at + n] = two - self.V @ (self.V.T @ two)
        return ca.Function("bend", [y0, y1, h, self.reduced.d], [first, second], {"cse": True})


def _entries(matrix: ca.SX) -> ca.SX:
    """Return the nonzeros of a matrix as a column."""
    return ca.vec(ca.SX(matrix.nz[:]))
