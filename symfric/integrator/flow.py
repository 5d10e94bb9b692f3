"""The flow of a model over a time as one differentiable CasADi Function."""

import casadi as ca
import numpy as np

from symfric.foundation import checks
from symfric.integrator.equations.initial import first_guess
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.equations.manifold import Manifold
from symfric.integrator.equations.system import System, system
from symfric.integrator.methods.method import suited_to_start
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.step.attempt import build_fixed
from symfric.model import Model, check_model


def flow(model: Model, *, steps: int = 20, method: str = "rodas5p") -> ca.Function:
    """The flow of a model as a CasADi Function (x0, u, p, T) -> xf, for the user's own NLP.

        xf = x(T),   x(0) = x0,   u and p constant

    `steps` equal steps of the method; derivatives of any order by CasADi, exact for the discrete
    map. Time in the equations counts from 0. Algebraic variables start where their equations hold,
    by Newton's method from their start values. Compare a result with `simulate`: fixed steps have
    no error control, and do not see friction that jams.

    Args:
        model: explicit or implicit model without events.
        steps: number of steps; choose it so that h = T/steps resolves the transition velocity.
        method: as in `simulate`, or one of fixed steps: "backward_euler" (order 1, stays bounded
            where h resolves nothing), "exponential" (order 1, one evaluation).

    Raises:
        ValueError: unknown method, events, fewer than one step.
    """
    check_model("flow", model)
    checks.choice("flow: method", method, METHODS)
    steps = checks.count("flow: steps", steps)
    if model.events:
        raise ValueError(
            f"flow: expected a model without events, got {len(model.events)} in '{model.name}'; "
            "leave out events of your own, and use a smooth or bristle law"
        )
    u = model.vector("u")
    whole = system(model, InputData(u, u, np.zeros(2), np.zeros((len(model.u), 1)), ("flow",)))
    whole = suited_to_start(whole, METHODS[method], model)
    fixed = build_fixed(whole, METHODS[method])
    x0, inputs = ca.MX.sym("x0", len(model.x)), ca.MX.sym("u", len(model.u))
    p, T = ca.MX.sym("p", len(model.p)), ca.MX.sym("T")
    data = ca.vertcat(p, inputs)
    chain = fixed.mapaccum("chain", steps)
    start = _start(model, whole, x0, data)
    all_y = chain(start, ca.repmat(T / steps, 1, steps), ca.repmat(data, 1, steps))
    xf = all_y[: len(model.x), -1]
    return ca.Function("flow", [x0, inputs, p, T], [xf], ["x0", "u", "p", "T"], ["xf"])


def _start(model: Model, whole: System, x0: ca.MX, data: ca.MX) -> ca.MX:
    """All unknowns at time 0, the algebraic ones consistent."""
    guess = first_guess(whole, model, np.zeros(whole.nx))[whole.nx :]
    y, free = ca.vertcat(x0, ca.DM(guess)), ca.DM(whole.free)
    if whole.manifold is not None:
        y = _on_constraints(whole, whole.manifold)(y, data)
    if free.numel():
        change = ca.SX.sym("change", free.shape[1])
        g = ca.substitute(whole.f[whole.algebraic[0]], whole.y, whole.y + free @ change)
        problem = {"x": change, "p": ca.vertcat(whole.y, whole.d), "g": g}
        newton = ca.rootfinder("consistent", "newton", problem, {"error_on_fail": True})
        y = y + free @ newton(0, ca.vertcat(y, data))
    return y


def _on_constraints(whole: System, manifold: Manifold) -> ca.Function:
    """(y, d) -> y on the constraints, with a basis of the tangent space where one is needed."""
    y = ca.SX(manifold.project(whole.y, whole.d))
    if manifold.charted:
        phi = manifold.defect(whole.y, whole.d)[: manifold.m]
        slope = ca.Function("slope", [whole.y, whole.d], [ca.jacobian(phi, whole.y[: manifold.n])])
        y[list(manifold.basis)] = ca.vec(ca.nullspace(ca.densify(slope(y, whole.d))))
    return ca.Function("on_constraints", [whole.y, whole.d], [y], {"cse": True})
