"""The least-squares problem of the inverse model, with derivatives by its structure.

    r(w) = D [force - f(v, a, p(w))] / s,     minimise 1/2 sum_i c_i r_i^2 / rows

f is the force the drive's own equations need for the motion v, a; D the decimation. Gradient and
exact Hessian are put together from the derivatives of f at one sample, mapped over all samples:

    J = D df/dw,   gradient = -J' (c r) / s,   Hessian = J' c J / s^2 - sum_k (D' c r)_k f_k'' / s
"""

from dataclasses import dataclass
from typing import final

import casadi as ca
import numpy as np

from identification.old.coordinates import Coordinates
from identification.old.data import Array
from identification.old.signals import MotionSignals
from symfric.foundation.status import Status
from symfric.model import Model

STATUS = {
    "Solve_Succeeded": Status.SOLVED,
    "Solved_To_Acceptable_Level": Status.ACCEPTABLE,
    "Search_Direction_Becomes_Too_Small": Status.ACCEPTABLE,
    "Maximum_Iterations_Exceeded": Status.MAX_ITERATIONS,
    "Infeasible_Problem_Detected": Status.INFEASIBLE,
    "Invalid_Number_Detected": Status.NOT_FINITE,
}


@final
@dataclass(frozen=True, eq=False)
class Fit:
    """Where the solver ended: coordinates, cost, status, iterations."""

    w: Array
    cost: float
    status: Status
    iterations: int


@final
@dataclass(frozen=True, eq=False)
class Problem:
    """Functions of the coordinates w (n,) and the weights c (rows,) of the equations."""

    coordinates: Coordinates
    rows: int
    scale: float
    residual: ca.Function
    jacobian: ca.Function
    solver: ca.Function

    def residuals(self, w: Array) -> Array:
        """D (force - f) [N], shape (rows,)."""
        return self.scale * np.asarray(self.residual(w).full()).ravel()

    def sensitivities(self, w: Array) -> Array:
        """D df/dw [N], shape (rows, n)."""
        return np.asarray(self.jacobian(w).full())

    def solve(self, w: Array, weights: Array | None = None) -> Fit:
        """Minimise by Ipopt from `w`."""
        c = np.ones(self.rows) if weights is None else weights
        bounds = self.coordinates
        found = self.solver(x0=w, p=c, lbx=bounds.lower, ubx=bounds.upper)
        stats = self.solver.stats()
        return Fit(
            np.asarray(found["x"].full()).ravel(),
            float(found["f"]),
            STATUS.get(stats["return_status"], Status.SOLVER_FAILED),
            int(stats["iter_count"]),
        )


def inverse_force(model: Model) -> ca.SX:
    """The force for which the drive's equations give the acceleration `model.xdot[1]`."""
    if model.ode is None:
        raise ValueError(f"model '{model.name}': expected explicit equations, got a residual")
    force = model.u[0].symbol
    rate = model.ode[1]
    slope = ca.jacobian(rate, force)
    return (model.xdot[1] - ca.substitute(rate, force, 0)) / slope


def problem(coordinates: Coordinates, signals: MotionSignals, scale: float) -> Problem:
    """The problem of fitting `coordinates` to `signals`; `scale` [N] is the expected residual."""
    model, w = coordinates.model, coordinates.w
    motion = ca.vertcat(model.x[1].symbol, model.xdot[1])
    f = ca.substitute(inverse_force(model), model.vector("p"), coordinates.p)
    n, D = signals.v.size, signals.matrix
    rows = D.shape[0]
    known = ca.DM(np.vstack([signals.v, signals.a]))
    measured = ca.DM(signals.equations(signals.force))

    W, c = ca.MX.sym("W", w.numel()), ca.MX.sym("c", rows)
    force = ca.Function("force", [motion, w], [f]).map("forces", "serial", n, [1], [])
    slope = ca.Function("slope", [motion, w], [ca.gradient(f, w)])
    slopes = slope.map("slopes", "serial", n, [1], [])
    weight, hessian = ca.SX.sym("weight"), ca.hessian(f, w)[0]
    bend = ca.Function("bend", [motion, w, weight], [weight * ca.densify(hessian)])
    bends = bend.map("bends", "serial", n, [1], [0])

    r = (measured - D @ force(known, W).T) / scale
    J = D @ slopes(known, W).T
    cost = ca.dot(c, r**2) / (2 * rows)
    gradient = -(J.T @ (c * r)) / (scale * rows)
    curvature = (J.T @ (ca.repmat(c, 1, w.numel()) * J)) / scale
    curvature -= bends(known, W, (D.T @ (c * r)).T)
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", 0)
    options = {
        "grad_f": ca.Function("grad_f", [W, c], [cost, gradient]),
        "hess_lag": ca.Function(
            "hess_lag", [W, c, lam_f, lam_g], [ca.triu(lam_f * curvature / (scale * rows))]
        ),
        "print_time": False,
        "ipopt": {
            "print_level": 0,
            "sb": "yes",
            "tol": 1e-10,
            "max_iter": 200,
            # the laws are defined inside their bounds only (asin of mu_d / mu_s)
            "bound_relax_factor": 0.0,
        },
    }
    solver = ca.nlpsol("fit", "ipopt", {"x": W, "p": c, "f": cost}, options)
    return Problem(
        coordinates,
        rows,
        scale,
        ca.Function("residual", [W], [r]),
        ca.Function("jacobian", [W], [J]),
        solver,
    )
