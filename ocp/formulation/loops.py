"""Where mechanisms with loops start: coordinates and rates that close them."""

from collections.abc import Collection, Mapping

import casadi as ca
import numpy as np

from ocp.formulation.span import Array, Span
from symfric.model import Model

ROUNDS = 50
CLOSED = 1e-11
"""What is left of a constraint that is met, in the units of the constraint."""


def has_loops(model: Model) -> bool:
    """Whether constraints bind the coordinates of the model."""
    return model.holonomic is not None and model.holonomic.phi.numel() > 0


def following_loops(
    model: Model, open_states: Collection[str], values: Mapping[str, float]
) -> tuple[str, ...]:
    """Coordinates and rates that are open at the start, as some of them start in a range.

    The constraints, which hold at every node, say where. Where only coordinates start in a range
    and all rates are zero, these stay zero.
    """
    mechanics = model.holonomic
    n = 0 if mechanics is None else mechanics.n
    q, qd = ([v.name for v in model.x[k : k + n]] for k in (0, n))
    if not {*q, *qd} & set(open_states):
        return ()
    resting = not set(qd) & set(open_states) and not any(values[name] for name in qd)
    timed = mechanics is not None and ca.depends_on(mechanics.phi, model.t)
    return tuple(q) if resting and not timed else (*q, *qd)


def _defects(model: Model) -> tuple[ca.SX, ca.SX]:
    mechanics = model.holonomic
    if mechanics is None:
        return ca.SX(0, 1), ca.SX(0, 1)
    x, n, phi = model.vector("x"), mechanics.n, mechanics.phi
    q, qd = x[:n], x[n : 2 * n]
    return phi, ca.jtimes(phi, q, qd) + ca.jtimes(phi, model.t, ca.SX(1))


def closed(span: Span, values: Mapping[str, float], given: Collection[str]) -> dict[str, float]:
    """`values` of the states with loops closed by the smallest change of those not `given`.

    Positions first, then rates, by Newton's method with least norm.

    Raises:
        ValueError: what is given leaves no way to close them.
    """
    model = span.model
    mechanics = model.holonomic
    if mechanics is None or not has_loops(model):
        return dict(values)
    names = [v.name for v in model.x]
    x = np.array([values[name] for name in names])
    phi, phi_dot = _defects(model)
    n = mechanics.n
    symbols = model.vector("x")
    for what, defect, begin in (("positions", phi, 0), ("velocities", phi_dot, n)):
        free = [i for i in range(begin, begin + n) if names[i] not in given]
        slope = ca.jacobian(defect, symbols)[:, free]
        f = ca.Function("loops", span.symbols, [defect, slope])
        x = _solved(span, f, x, free, what)
    return dict(zip(names, x.tolist(), strict=True))


def _solved(span: Span, f: ca.Function, x: Array, free: list[int], what: str) -> Array:
    x, zeros = x.copy(), [np.zeros(s.numel()) for s in span.symbols]
    size = np.inf
    for _ in range(ROUNDS):
        defect, slope = (m.full() for m in f.call([0.0, x, zeros[2], zeros[3], span.p]))
        size = float(np.abs(defect).max())
        if size < CLOSED * max(1.0, float(np.abs(x).max())):
            return x
        if not free or not np.isfinite(size):
            break
        x[free] -= np.linalg.lstsq(slope, defect)[0][:, 0]
    raise ValueError(
        f"start: expected {what} from which all loops can be closed, got some that leave "
        f"{size:.3g} open; name fewer states and let the others follow"
    )
