"""The mass matrix at work: accelerations under forces, and how easily a contact is moved.

    M^-1 right,   W_i = G_i P G_i',   P = M^-1 - M^-1 phi_q' (phi_q M^-1 phi_q')^-1 phi_q M^-1

G_i is the row of sliding velocities s_i = G_i q' + ..., W_i the sliding acceleration that a unit
friction force takes away while all other forces stay.
"""

import casadi as ca

from symfric.multibody.equations import Equations
from symfric.multibody.joints import Floating
from symfric.multibody.spatial import GROUND, euler_e


def mirrored(M: ca.SX) -> ca.SX:
    """A symmetric matrix from one that is symmetric in value, but not in its zeros.

    What cancels on one side of the diagonal by itself may stand as 0 x there on the other.
    """
    if M.sparsity().is_symmetric():
        return M
    upper = ca.project(M, M.sparsity() * M.T.sparsity())
    return ca.triu2symm(ca.triu(upper))


def solve_mass(eq: Equations, right: ca.SX) -> ca.SX:
    """M^-1 times the columns of `right`, by blocks where bodies float freely."""
    topology = eq.kin.topology
    if not _free(eq):
        D, L, order = ca.ldl(mirrored(eq.mass))
        return ca.ldl_solve(ca.densify(right), D, L, order) if eq.n else right
    rows: list[ca.SX] = []
    for link in topology.links:
        body, own = topology.bodies[link.body], right[link.rows, 0]
        p, R = eq.q[link.rows, 0][3:], eq.kin.motion[link.body].R
        weight = ca.trace(body.J)
        turning = euler_e(p).T @ (R @ ca.solve(body.J, R.T @ (euler_e(p) @ own[3:])))
        rows.append(own[:3] / body.mass)
        rows.append(turning / 4 + p * (ca.dot(p, own[3:]) / weight))
    return ca.vertcat(*rows)


def _free(eq: Equations) -> bool:
    """Whether all bodies hang freely on the ground."""
    links = eq.kin.topology.links
    return bool(links) and all(isinstance(x.joint, Floating) and x.base == GROUND for x in links)


def mobility(eq: Equations, G: ca.SX) -> tuple[ca.SX, ca.SX]:
    """W of each row of `G`, and what it would be without the constraints, shape (k, 1) each."""
    J, k = eq.Phi_q, G.size1()
    right = ca.densify(ca.vertcat(G, J).T)
    columns = ca.horzsplit(right) if _free(eq) else [right]
    moved = ca.horzcat(*(solve_mass(eq, column) for column in columns))
    loose = ca.sum2(G * moved[:, :k].T)
    if not eq.m:
        return loose, loose
    across, S = J @ moved[:, :k], J @ moved[:, k:]
    D, L, order = ca.ldl(mirrored(S))
    held = ca.ldl_solve(ca.densify(across), D, L, order)
    return loose - ca.sum1(across * held).T, loose


def null_direction(J: ca.SX) -> ca.SX:
    """The unit vector Z with J Z = 0 of a matrix (n - 1, n), of its minors: smooth at full rank."""
    n = J.size2()
    minors = [ca.det(ca.densify(J[:, [j for j in range(n) if j != k]])) for k in range(n)]
    Z = ca.vertcat(*((-1) ** k * minor for k, minor in enumerate(minors)))
    return Z / ca.sqrt(ca.sumsqr(Z))
