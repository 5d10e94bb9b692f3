"""A second opinion on plans: the conditions of optimality by CasADi's own derivatives.

Nothing here is shared with the solver but the expressions of the horizon. The program over all
states and inputs is written down whole, differentiated as one expression, and the multipliers of
the equations are those that make the gradient in the states zero (a linear system).
"""

from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.mpc.design import Design
from ocp.mpc.gauss_newton import Plan
from ocp.mpc.sweeps import Given
from symfric.foundation.numeric import evaluate_all

Array = NDArray[np.float64]


@final
class Optimality:
    """Residuals of plans of a design."""

    def __init__(self, design: Design) -> None:
        h = design.horizon
        self._design = design
        X, U = ca.MX.sym("X", h.x.numel(), h.count + 1), ca.MX.sym("U", h.u.numel(), h.count)
        R, t = ca.MX.sym("R", h.r.numel(), h.count + 1), ca.MX.sym("t", 1, h.count + 1)
        p, b = ca.MX.sym("p", h.p.numel()), ca.MX.sym("b", h.b.numel())
        symbols = [h.x, h.u, h.after, h.r, h.r_after, h.p, h.t, h.b]
        limits = [*h.limits, *h.end_limits]
        rows = [
            limit.sign * (limit.expression - h.b[i]) / limit.unit for i, limit in enumerate(limits)
        ]
        first = len(h.limits)
        v = ca.vertcat(ca.SX(0, 1), *rows[:first])
        cost = h.early.value + h.late.value
        to = h.x
        for _ in range(h.substeps):
            to = h.advance(to, h.u, h.r, h.p)
        interval = ca.Function("interval", symbols, [to - h.after, v, cost])
        last = ca.vertcat(ca.SX(0, 1), *rows[first:])
        end = ca.Function("end", [h.x, h.r, h.p, h.t, h.b], [last, h.end.value])
        c, v, q = interval.map(h.count, [False] * 5 + [True, False, True], [False] * 3)(
            X[:, :-1], U, X[:, 1:], R[:, :-1], R[:, 1:], p, t[:, :-1], b
        )
        v_end, q_end = end(X[:, -1], R[:, -1], p, t[:, -1], b)
        every = ca.vertcat(ca.vec(v), v_end)
        m = ca.MX.sym("m", every.numel())
        w = ca.vertcat(ca.vec(X[:, 1:]), ca.vec(U))
        lagrangian = ca.sum2(q) + q_end - ca.dot(m, every)
        gradient = ca.vertcat(
            ca.vec(ca.gradient(lagrangian, X)[:, 1:]), ca.vec(ca.gradient(lagrangian, U))
        )
        slopes = ca.horzcat(ca.jacobian(ca.vec(c), X)[:, h.x.numel() :], ca.jacobian(ca.vec(c), U))
        results = [ca.densify(gradient), ca.densify(slopes), ca.vec(c), every]
        self._states = h.x.numel() * h.count
        self._whole = ca.Function("whole", [X, U, R, t, p, b, m], results)
        self._size = w.numel()

    def residual(self, plan: Plan, given: Given) -> float:
        """As `gauss_newton` defines it."""
        h, prices = self._design.horizon, self._design.prices
        gradient, slopes, c, v = evaluate_all(
            self._whole, plan.X, plan.U, given.R, given.t, given.p, given.b, plan.z
        )
        n, model = self._states, h.model
        by_states, by_inputs = slopes[:, :n], slopes[:, n:]
        multipliers = np.linalg.solve(by_states.T, -gradient[:n, 0])
        left = (gradient[n:, 0] + by_inputs.T @ multipliers) * np.tile(model.nominal("u"), h.count)
        defects = c[:, 0] / np.tile(model.nominal("x"), h.count)
        v, below = v[:, 0], np.maximum(-v[:, 0], 0.0)
        kept = np.maximum(below, np.abs(plan.z * v) / np.maximum(plan.z, h.curvature))
        price = np.where(prices.soft, prices.rho, 1.0)
        owed = (prices.rho + prices.sigma * below - plan.z) * v / price
        rows = np.where(prices.soft & (v < 0.0), np.minimum(kept, np.abs(owed)), kept)
        parts = (left / h.curvature, defects, rows)
        return max(float(np.abs(part).max(initial=0.0)) for part in parts)
