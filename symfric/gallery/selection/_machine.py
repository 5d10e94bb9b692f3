"""The pendulum on the box again, by equations written by hand, solved by SUNDIALS (IDAS).

Nothing but CasADi is used here, so that a mistake of the library cannot stand on both sides.
"""

import casadi as ca
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
M_BOX, M, L, J, R, G = 6.0, 20.0, 0.3, 1.8, 0.01, 9.81
"""Table 6; the radius of the hinge, which it does not give, as in the library's preset."""
FLOOR, HINGE, WIDTH = 0.02, 0.002, 1e-3
"""Dynamic coefficients and velocity [m/s] of the smooth Coulomb law in table 7."""


def balance(phi: ca.SX, v: ca.SX, w: ca.SX, unknown: ca.SX) -> ca.SX:
    """What must vanish, (4, 1): Newton for the box, moments of the pendulum, two normal forces.

    `unknown` are the accelerations of box [m/s^2] and pendulum [rad/s^2], the force of the floor
    and that of the hinge [N].
    """
    a, alpha, floor, hinge = ca.vertsplit(unknown)
    s, c = ca.sin(phi), ca.cos(phi)
    ax, az = a + L * (alpha * c - w**2 * s), L * (alpha * s + w**2 * c)  # of the mass
    hx, hz = M * ax, M * (az + G)  # what the hinge does to it
    return ca.vertcat(
        M_BOX * a + hx + floor * FLOOR * ca.tanh(v / WIDTH),
        J * alpha + hx * L * c + hz * L * s + R * hinge * HINGE * ca.tanh(R * w / WIDTH),
        floor - size(M_BOX * G + hz),
        hinge - size(ca.vertcat(hx, hz)),
    )


def size(f: ca.SX) -> ca.SX:
    """Length of a force, smooth at zero as the library has it."""
    return ca.sqrt(ca.sumsqr(f) + 1e-8) - 1e-4


def smooth_coulomb(times: Array) -> dict[str, Array]:
    """Positions, velocities and accelerations of box and pendulum at `times` [s], to ten digits."""
    x, phi, v, w = (ca.SX.sym(name) for name in ("x", "phi", "v", "w"))
    unknown = ca.SX.sym("unknown", 4)
    y, rates = ca.vertcat(x, phi, v, w), ca.vertcat(v, w, unknown[:2])
    alg = balance(phi, v, w, unknown)
    start, guess = [0.0, np.pi / 6, 0.0, 0.0], [0.0, 0.0, (M_BOX + M) * G, M * G]
    find = ca.rootfinder("find", "newton", {"x": unknown, "p": y, "g": alg})
    dae = {"x": y, "z": unknown, "ode": rates, "alg": alg}
    options = {"reltol": 1e-10, "abstol": 1e-11, "max_num_steps": 400_000}
    run = ca.integrator("run", "idas", dae, 0.0, list(times), options)
    found = run(x0=start, z0=find(guess, start))
    values = np.vstack([np.array(found["xf"]), np.array(found["zf"])[:2]])
    return dict(zip(("x", "phi", "x'", "phi'", "x''", "phi''"), values, strict=True))


def at_start() -> tuple[float, float]:
    """Accelerations at the start [m/s^2, rad/s^2], where nothing rubs yet, as a linear system."""
    s, c = np.sin(np.pi / 6), np.cos(np.pi / 6)
    mass = np.array([[M_BOX + M, M * L * c], [M * L * c, J + M * L**2]])
    a, alpha = np.linalg.solve(mass, [0.0, -M * G * L * s])
    return float(a), float(alpha)
