"""Derivatives of what was computed: the accepted steps, differentiated with their sizes held fixed.

The step-size controller takes no part (internal numerical differentiation), so the derivatives are
those of the discrete solution and exact to rounding.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.integrator.dense import Dense
from symfric.integrator.inputs import Drivers
from symfric.integrator.integrator import Integrator
from symfric.integrator.step import build_dense_step, build_fixed
from symfric.integrator.system import system
from symfric.integrator.tableaux import ROSENBROCK
from symfric.model import Model
from symfric.parameters import check_names

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Seeds:
    """What to differentiate with respect to.

    Attributes:
        names: as the user wrote them: a parameter, or "x0.v" for the start value of a state.
        parameters: row in d of each name, -1 for a start value.
        states: row in y of each name, -1 for a parameter.
    """

    names: tuple[str, ...]
    parameters: tuple[int, ...]
    states: tuple[int, ...]


def seeds(model: Model, names: Sequence[str]) -> Seeds:
    """Look the names up.

    Raises:
        ValueError: a name that is neither a free parameter nor "x0." and a state; a model with
            events, whose jumps are not differentiated.
    """
    p, x = [v.name for v in model.p], [v.name for v in model.x]
    known = [*p, *(f"x0.{name}" for name in x)]
    check_names(f"sensitivities of '{model.name}' (parameters must be free)", names, known)
    if model.events:
        raise ValueError(
            f"sensitivities of '{model.name}': expected a model without events, got "
            f"{len(model.events)}; use a smooth or bristle law"
        )
    return Seeds(
        tuple(names),
        tuple(p.index(n) if n in p else -1 for n in names),
        tuple(x.index(n[3:]) if n not in p else -1 for n in names),
    )


def start(integrator: Integrator, which: Seeds, y: Array, d: Array, p_of_start: Array) -> Array:
    """Derivatives of the consistent start values, shape (n, names).

    Args:
        integrator: of the model.
        which: what to differentiate with respect to.
        y, d: start values and run data.
        p_of_start: derivative of the start values of x by p, shape (nx, n_p).
    """
    s = integrator.system
    S = np.zeros((s.n, len(which.names)))
    for column, (parameter, state) in enumerate(zip(which.parameters, which.states, strict=True)):
        if state >= 0:
            S[state, column] = 1.0
        else:
            S[: s.nx, column] = p_of_start[:, parameter]
    rows, columns = s.algebraic
    if rows:
        by_y = ca.Function("by_y", [s.y, s.d], [ca.jacobian(s.f[rows], s.y)])(y, d).full()
        by_d = ca.Function("by_d", [s.y, s.d], [ca.jacobian(s.f[rows], s.d)])(y, d).full()
        others = [i for i in range(s.n) if i not in columns]
        right = by_y[:, others] @ S[others] + by_d @ _of_data(which, d.size)
        S[columns] = -np.linalg.solve(by_y[:, columns], right)
    return S


def _of_data(which: Seeds, n_d: int) -> Array:
    """Derivative of the run data by the seeds, shape (n_d, names)."""
    selector = np.zeros((n_d, len(which.names)))
    for column, parameter in enumerate(which.parameters):
        if parameter >= 0:
            selector[parameter, column] = 1.0
    return selector


def forward(
    integrator: Integrator, which: Seeds, dense: Dense, S: Array, inputs: Drivers, p: Array
) -> Dense:
    """Derivatives of the solution as dense output with n * names columns.

    Every accepted step is differentiated once, all of them in one mapped call; the rest is a
    product of small matrices.
    """
    s, count = integrator.system, dense.t0.size
    names = len(which.names)
    middle = (dense.t0 + dense.t1) / 2
    d = np.vstack([np.tile(p[:, None], (1, count)), inputs.values[:, inputs.interval(middle)]])
    step = build_dense_step(s, integrator.tableau)
    both = step.factory("derivatives", ["y", "h", "d"], ["jac:all:y", "jac:all:d"])
    by_y, by_d = both.map(count)(dense.y0.T, (dense.t1 - dense.t0)[None, :], d)
    rows = step.numel_out(0)
    by_y = by_y.full().reshape(rows, count, s.n).transpose(1, 0, 2)
    by_d = by_d.full().reshape(rows, count, s.d.numel()).transpose(1, 0, 2)
    pushed = by_d @ _of_data(which, s.d.numel())
    begin, end = np.zeros((count, s.n, names)), np.zeros((count, s.n, names))
    bend = np.zeros((count, rows - s.n, names))
    for k in range(count):
        begin[k] = end[k - 1] if k else S
        after = by_y[k] @ begin[k] + pushed[k]
        end[k], bend[k] = after[: s.n], after[s.n :]
    width = s.n * names
    return Dense(
        dense.t0,
        dense.t1,
        begin.reshape(count, width),
        end.reshape(count, width),
        bend.reshape(count, -1, width),
    )


def of_signals(
    integrator: Integrator, which: Seeds, t: Array, y: Array, d: Array, S: Array
) -> Array:
    """Derivatives of all signals at times t (m,), shape (signals, names, m).

    Args:
        integrator: of the model.
        which: what to differentiate with respect to.
        t, y, d: times, solution (n, m) and run data (n_d, m).
        S: derivatives of the solution, shape (n, names, m).
    """
    count, size = t.size, integrator.system.n
    signals = integrator.signals
    names = signals.name_in()
    both = signals.factory("signals", names, [f"jac:{signals.name_out(0)}:{n}" for n in names[1:]])
    by_y, by_d = both.map(count)(t[None, :], y, d)
    rows = signals.numel_out(0)
    by_y = by_y.full().reshape(rows, count, size)
    by_d = by_d.full().reshape(rows, count, d.shape[0])
    through_y = np.einsum("rmn,nsm->rsm", by_y, S)
    return through_y + np.einsum("rmd,ds->rsm", by_d, _of_data(which, d.shape[0]))


def flow(model: Model, *, steps: int = 20, method: str = "rodas5p") -> ca.Function:
    """The flow of a model as a CasADi Function (x0, u, p, T) -> xf, for the user's own NLP.

        xf = x(T),   x(0) = x0,   u and p constant

    `steps` equal steps of the method; derivatives of any order by CasADi, exact for the discrete
    map. Time in the equations counts from 0. Compare a result with `simulate`: fixed steps have no
    error control.

    Args:
        model: explicit or implicit model without events and algebraic variables.
        steps: number of steps; choose it so that h = T/steps resolves the transition velocity.
        method: as in `simulate`.

    Raises:
        ValueError: unknown method, events or algebraic variables, fewer than one step.
    """
    check_names("flow: method", [method], ROSENBROCK)
    if steps < 1:
        raise ValueError(f"flow: expected steps >= 1, got {steps}")
    if model.events or model.z or model.ode is None:
        raise ValueError(
            f"flow: expected an explicit model without events and algebraic variables, got "
            f"'{model.name}' with {len(model.events)} events and {len(model.z)} algebraic variables"
        )
    u = model.vector("u")
    whole = system(model, Drivers(u, u, np.zeros(2), np.zeros((len(model.u), 1)), ("flow",)))
    fixed = build_fixed(whole, ROSENBROCK[method])
    x0, inputs = ca.MX.sym("x0", len(model.x)), ca.MX.sym("u", len(model.u))
    p, T = ca.MX.sym("p", len(model.p)), ca.MX.sym("T")
    y0 = ca.vertcat(x0, ca.MX(0)) if whole.timed else x0
    data = ca.vertcat(p, inputs)
    chain = fixed.mapaccum("chain", steps)
    all_y = chain(y0, ca.repmat(T / steps, 1, steps), ca.repmat(data, 1, steps))
    xf = all_y[: len(model.x), -1]
    return ca.Function("flow", [x0, inputs, p, T], [xf], ["x0", "u", "p", "T"], ["xf"])
