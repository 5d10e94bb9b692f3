"""The error that each interval makes by itself."""

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.checking.arcs import Arc
from symfric.foundation.parameters import Variable
from symfric.integrator import simulate_many
from symfric.model import Model

Array = NDArray[np.float64]

RTOL = 1e-6
"""Relative tolerance of the flow over one interval."""


def local_errors(arcs: Sequence[Arc], rtol: float = RTOL) -> tuple[Array, ...]:
    """How far the model, started at each node, is from the next one; of each arc, shape (N,).

        e_k = max_i |flow(x_k, u_k)_i - x_(k+1),i| / size_i

    All intervals are members of one ensemble: 25 ms for 100 of them. An interval over which the
    model cannot be simulated has the error inf.

    Args:
        arcs: what was optimised.
        rtol: of the simulation, in each step.
    """
    return tuple(
        np.max(np.abs(_ends(arc, rtol) - arc.nodes[:, 1:]) / arc.sizes[:, None], axis=0, initial=0)
        for arc in arcs
    )


def _ends(arc: Arc, rtol: float) -> Array:
    """Where the model is at the end of each interval, started at its first node, (nx, N)."""
    model, N = arc.span.model, arc.intervals
    local = _local(model)
    p: dict[str, Any] = {name: np.full(N, x) for name, x in arc.parameters().items()}
    t_end: Any = np.diff(arc.times)
    if local is not model:
        p |= {local.p[-1].name: arc.times[:-1]}
    run = simulate_many(
        local,
        t_end,
        x0={v.name: row[:-1] for v, row in zip(model.x, arc.nodes, strict=True)},
        p=p,
        u={v.name: row for v, row in zip(model.u, arc.u, strict=True)},
        rtol=rtol,
        backend="vm",  # a compiler needs longer than all passes together
        executor="serial",
    )
    ends = np.array([run[v.name][:, 0] for v in model.x]).reshape(len(model.x), N)
    return np.where(np.isfinite(ends), ends, np.inf)


def _local(model: Model) -> Model:
    """`model` with time since the start of each member, where its equations know time at all.

    Of a mechanism only the explicit equations are left: its constraints are not kept over an
    interval, whose drift is below all errors that are looked for.
    """
    kept = model.memory.get("ocp local")
    if kept is None:
        kept = model
        if ca.depends_on(ca.vertcat(_explicit(model), model.alg), model.t):
            kept = _from_zero(model)
        model.memory["ocp local"] = kept
    return kept


def _explicit(model: Model) -> ca.SX:
    return ca.SX(0, 1) if model.ode is None else model.ode


def _from_zero(model: Model) -> Model:
    taken = {v.name for group in (model.x, model.z, model.u, model.p) for v in group}
    names = (f"t_node{'_' * k}" for k in range(len(taken) + 1))
    begin = Variable(next(name for name in names if name not in taken), "s")
    old, new = [model.t], [model.t + begin.symbol]
    ode, alg = ca.substitute([_explicit(model), model.alg], old, new)
    return Model(
        f"{model.name}_from_each_node",
        x=model.x,
        z=model.z,
        u=model.u,
        p=(*model.p, begin),
        ode=ode,
        alg=alg,
        t=model.t,
    )
