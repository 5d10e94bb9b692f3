"""Constraints of a mechanism, enforced on positions, velocities and accelerations.

The unknowns of a holonomic model include its accelerations, in addition to multipliers and normal
forces. Therefore no mass matrix is inverted, and no derivative goes through a factorisation:

    x' = (q', a, ...),   M a + phi_q' lam = Q,   phi_q a + gamma = 0,   normal forces

Each accepted step ends on the constraints:

    q  <- q  - phi_q' (phi_q phi_q')^-1 phi(q)       repeated with one factorisation
    q' <- q' - phi_q' (phi_q phi_q')^-1 (phi_q q' + phi_t)

Limits: impacts are excluded, and so are tangential shocks (Painleve), in which friction makes the
reactions grow a thousandfold (`SHOCK`): both end a run. A step across a position in which phi_q
loses rank is rejected, because the motion beyond it is not determined; there the sign of
det(phi_q(q1) phi_q(q0)') changes. Two such positions within one step are not detected, nor is a
step that ends on another branch.
"""

from dataclasses import dataclass
from typing import final

import casadi as ca
import numpy as np

from symfric.foundation.numeric import Array, evaluate
from symfric.integrator.equations.matrices import factorise
from symfric.model import Model
from symfric.model.parts import Holonomic

DEPENDENT = 1e-4
"""Ratio of singular values of phi_q below which a stopped mechanism is called singular.

At tight tolerances, rounding stops a run at this distance from the singularity.
"""
PULLING = 1e-3
"""Fraction of their typical size up to which negative normal forces count as integration errors."""
SHOCK = 1e-3
"""Smallest accepted pivot of I - dN/dN, which is 1 without friction.

Its inverse is the factor by which friction multiplies a load on a bearing. As the pivot approaches
0, that load stops the sliding within microseconds, while the pivot falls exponentially with the
sliding velocity: without this limit the tolerance would decide which runs pass. Moving machines
stay above 0.4, machines near jamming above 0.02 (`tests/symfric/stress/test_mechanisms.py`).
"""
ITERATIONS, NEARBY = (4, 3), (2, 2)
"""Numbers of Newton iterations with frozen derivatives, on positions and on velocities.

They reduce an error of 1e-3, or of 1e-5, to 1e-13.
"""


@final
@dataclass(frozen=True, eq=False)
class Manifold:
    """Functions that project a column of unknowns onto the constraints of a holonomic model.

    Attributes:
        project: (y, d) -> y with positions and velocities on the constraints; unchanged y without
            constraints.
        polish: the same for y near the constraints, with fewer iterations.
        defect: (y, d) -> constraints and their rates.
        n, m, first: numbers of accelerations, of multipliers and of states. After the states, the
            algebraic unknowns are in this order: accelerations, multipliers, forces carried in
            stick, normal forces.
        applied: number of forces carried in stick.
        basis: rows of y that hold V, a basis of the tangent space, column by column.
        slope: (y, d) -> derivatives of the algebraic equations with respect to the algebraic
            unknowns.
        branch: (y0, y1, d) -> sign of det(phi_q(q1) phi_q(q0)'), which changes if a step crosses a
            position in which constraints depend on each other.
        pressing: (y, d) -> normal forces divided by their typical size; they must not be negative.
        pressed: names of these normal forces.
    """

    project: ca.Function
    polish: ca.Function
    defect: ca.Function
    n: int
    m: int
    first: int
    applied: int
    basis: range
    slope: ca.Function
    branch: ca.Function
    pressing: ca.Function
    pressed: tuple[str, ...]

    @property
    def loop(self) -> int:
        """Index of the first normal force among the algebraic unknowns."""
        return self.n + self.m + self.applied

    @property
    def charted(self) -> bool:
        """True if the mechanism is integrated in charts of the tangent space."""
        return len(self.basis) > 0


def holonomic_columns(model: Model, mechanics: Holonomic) -> tuple[ca.SX, ca.SX, ca.SX, list[str]]:
    """Return unknowns (x, a, z, V) of a holonomic model, right-hand sides, mass matrix and names.

    V is a basis of the tangent space of the constraints, column by column, at the start of the
    previous step. Its rates are zero. Without constraints it has no rows.
    """
    n, x, V = mechanics.n, model.vector("x"), ca.SX.sym("V", _of_basis(mechanics))
    f = ca.vertcat(x[n : 2 * n], mechanics.a, mechanics.rates, mechanics.implicit)
    names = [v.name for v in model.x] + [f"{v.name}_dot" for v in model.x[n : 2 * n]]
    names += [v.name for v in model.z] + [f"V_{i}" for i in range(V.numel())]
    mass = ca.diagcat(ca.SX.eye(x.numel()), ca.SX(*2 * [n + len(model.z)]), ca.SX.eye(V.numel()))
    y = ca.vertcat(x, mechanics.a, model.vector("z"), V)
    return y, ca.vertcat(f, ca.SX.zeros(V.numel())), mass, names


def _of_basis(mechanics: Holonomic) -> int:
    """Return the number of entries of V: n for each degree of freedom, 0 without a chart."""
    n, m = mechanics.n, mechanics.phi.numel()
    return n * (n - m) if m and mechanics.index == 0 else 0


def manifold(
    model: Model, mechanics: Holonomic, y: ca.SX, d: ca.SX, f: ca.SX, u: ca.SX
) -> Manifold:
    """Return the constraints of a holonomic model as Functions of the unknowns of its system.

    Args:
        model, mechanics: holonomic model and its equations.
        y, d: unknowns and constants of a run.
        f: right-hand sides.
        u: inputs in terms of y and d.
    """
    n, nx, phi = mechanics.n, len(model.x), mechanics.phi
    q, qd, fixed, m = y[:n], y[n : 2 * n], ca.vertcat(model.t, d), phi.numel()
    J, rate = ca.jacobian(phi, q), ca.jtimes(phi, q, qd) + ca.jacobian(phi, model.t)
    at = ca.Function("at", [q, qd, fixed], [phi, rate])
    lu = factorise(ca.sparsify(J @ J.T), [range(m)])

    def across(defect: ca.SX) -> ca.SX:
        return J.T @ lu.inserted(lu.solve(defect))[0]

    def projection(name: str, iterations: tuple[int, int]) -> ca.Function:
        on = [q, qd]
        for i, count in enumerate(iterations if m else ()):
            for _ in range(count):
                on[i] = on[i] - across(at.call([*on, fixed])[i])
        return ca.Function(name, [y, d], [ca.vertcat(*on, y[2 * n :])], {"cse": True})

    algebraic = list(range(nx, nx + n + len(model.z)))
    before, here = ca.SX.sym("y0", y.numel()), ca.Function("here", [y, d], [J])
    turned = factorise(ca.sparsify(here(y, d) @ here(before, d).T), [range(m)])
    branch = turned.inserted(turned.sign())
    pressing = ca.substitute(mechanics.pressing, model.vector("u"), u)
    return Manifold(
        projection("project", ITERATIONS),
        projection("polish", NEARBY),
        ca.Function("defect", [y, d], [ca.vertcat(phi, rate)]),
        n,
        m,
        nx,
        mechanics.applied,
        range(algebraic[-1] + 1, algebraic[-1] + 1 + _of_basis(mechanics)),
        ca.Function("slope", [y, d], [ca.jacobian(f[algebraic], y[algebraic])]),
        ca.Function("branch", [before, y, d], branch, {"cse": True}),
        ca.Function("pressing", [y, d], [ca.densify(pressing)]),
        mechanics.pressed,
    )


def jammed(manifold: Manifold, names: tuple[str, ...], y: Array, d: Array) -> str:
    """Return a message if friction jams or a bearing pulls at y; empty otherwise.

    The motion is valid if det(I - dN/dN) > SHOCK and N > 0.
    """
    return grows(manifold, names, y, d, SHOCK) or pulls(manifold, y, d, 0.0)


def pulls(manifold: Manifold, y: Array, d: Array, margin: float) -> str:
    """Return a message if normal forces are negative or, with a margin, almost zero."""
    if not manifold.pressed:
        return ""
    limit = PULLING if margin > 0.0 else -PULLING
    for share, what in zip(evaluate(manifold.pressing, y, d), manifold.pressed, strict=True):
        if share < limit:
            how = f"below zero ({share:.3g} times its typical size): it"
            how = "to zero; below, it" if abs(share) <= PULLING else how
            return f"the {what} falls {how} would pull, and its friction would drive"
    return ""


def grows(manifold: Manifold, names: tuple[str, ...], y: Array, d: Array, margin: float) -> str:
    """Return a message if normal forces grow with the friction that they cause."""
    k = manifold.loop
    if manifold.slope.size1_out(0) == k:
        return ""
    A = manifold.slope(y, d).full()
    if not np.isfinite(A).all():
        return ""
    try:
        loop = A[k:, :k] @ np.linalg.solve(A[:k, :k], A[:k, k:]) - A[k:, k:]
    except np.linalg.LinAlgError:
        return ""
    determinant = float(np.linalg.det(loop))
    if determinant > margin:
        return ""
    values, vectors = np.linalg.eig(loop)
    worst = int(np.argmax(np.abs(vectors[:, int(np.argmin(np.real(values)))])))
    return (
        f"friction jams, most of all through {names[manifold.first + k + worst]}: the reactions "
        f"grow with the friction that they cause (det(I - dN/dN) = {determinant:.3g}, 1 without "
        "friction), a tangential shock where it slides, and impacts are excluded; less friction, "
        "a longer bearing or a brake that does not lock itself would let it move"
    )


def singular(manifold: Manifold, names: tuple[str, ...], y: Array, d: Array) -> str:
    """Return a message naming constraints that become dependent at y; empty if there are none."""
    n, m = manifold.n, manifold.m
    phi_q = manifold.slope(y, d).full()[n : n + m, :n]
    if not m or not np.isfinite(phi_q).all():
        return ""
    u, s, _ = np.linalg.svd(phi_q)
    if s[-1] > DEPENDENT * s[0]:
        return ""
    worst = np.argsort(-np.abs(u[:, -1]))[:2]
    labels = ", ".join(sorted(names[manifold.first + n + int(i)] for i in worst))
    return (
        f"the configuration is singular: constraints depend on each other, most of all those of "
        f"{labels} (singular values of phi_q {s[-1]:.1e} ... {s[0]:.1e}); where the mechanism goes "
        "from here is not determined"
    )
