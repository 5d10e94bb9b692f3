"""Stabilised form of index 2 of a mechanism, for BDF: positions and velocities on the constraints.

    q' = q_rate + phi_q' eta,   M a + phi_q' lam = Q,   phi(q) = 0,   phi_q q_rate = 0

The accelerations a, the multipliers lam and eta and the normal forces are algebraic unknowns; eta
is zero along the exact solution. The form of index 1 holds phi_q a + gamma = 0 alone, so that
constraints drift away under it.

Limits: of index 2, so the methods of this package, which take index 1, do not apply.
Source: Gear, Leimkuhler, Gupta, J. Comput. Appl. Math. 12-13, 1985.
"""

from dataclasses import replace

import casadi as ca

from symfric.integrator.equations.system import System


def stabilised(system: System) -> System:
    """`system` with multipliers eta as last unknowns and the constraints on two levels.

    Raises:
        ValueError: it is no mechanism.
    """
    manifold = system.manifold
    if manifold is None:
        raise ValueError(
            "simulate_by_peer: expected rosenbrock or sundials for a model that is no mechanism, "
            "got ggl"
        )
    n, m = manifold.n, manifold.m
    eta = ca.SX.sym("eta", m)
    both = ca.densify(manifold.defect(system.y, system.d))
    phi, phi_dot = both[:m], both[m:]
    f = ca.SX(system.f)
    f[:n] += ca.jacobian(phi, system.y[:n]).T @ eta
    f[list(system.pivots[1])] = phi
    return replace(
        system,
        y=ca.vertcat(system.y, eta),
        f=ca.vertcat(f, phi_dot),
        mass=ca.diagcat(system.mass, ca.SX(m, m)),
        timed=False,
        names=(*system.names, *(f"{system.names[i]}_eta" for i in system.pivots[1])),
    )
