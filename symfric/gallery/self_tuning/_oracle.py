"""Machines solved by others: with error control by SUNDIALS (IDAS), and by fixed explicit steps."""

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.gallery.self_tuning._machines import Machine

Array = NDArray[np.float64]


def solve(machine: Machine, times: Array) -> dict[str, Array]:
    """What the machine shows at `times` [s], to ten digits."""
    dae = {"x": machine.y, "z": machine.unknown, "ode": machine.rates, "alg": machine.balance}
    options = {"reltol": 1e-10, "abstol": 1e-11, "max_num_steps": 200_000}
    run = ca.integrator("run", "idas", dae, float(times[0]), list(times), options)
    found = run(x0=machine.start, z0=_unknown(machine)(machine.start, 0.0))
    return _shown(machine, found["xf"], found["zf"])


def fixed_steps(machine: Machine, h: float, t_end: float) -> dict[str, Array]:
    """What the machine shows every `h` [s], by the classical method of Runge and Kutta, order 4."""
    unknown, ode = (
        _unknown(machine),
        ca.Function("f", [machine.y, machine.unknown], [machine.rates]),
    )
    y, z = ca.MX.sym("y", machine.y.numel()), ca.MX.sym("z", machine.unknown.numel())

    def rate(at: ca.MX) -> ca.MX:
        return ode(at, unknown(at, z))

    k1 = rate(y)
    k2 = rate(y + h / 2 * k1)
    k3 = rate(y + h / 2 * k2)
    k4 = rate(y + h * k3)
    end = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    step = ca.Function("step", [ca.vertcat(y, z)], [ca.vertcat(end, unknown(end, z))])
    first = ca.vertcat(machine.start, unknown(machine.start, 0.0))
    all_y = ca.horzcat(first, step.mapaccum("run", round(t_end / h))(first))
    rows = machine.y.numel()
    return _shown(machine, all_y[:rows, :], all_y[rows:, :])


def _unknown(machine: Machine) -> ca.Function:
    """(y, guess) -> unknowns, by Newton's method."""
    problem = {"x": machine.unknown, "p": machine.y, "g": machine.balance}
    newton = ca.rootfinder("newton", "newton", problem, {"abstol": 1e-9})
    y, guess = ca.MX.sym("y", machine.y.numel()), ca.MX.sym("z", machine.unknown.numel())
    return ca.Function("unknown", [y, guess], [newton(guess, y)])


def _shown(machine: Machine, y: ca.DM, unknown: ca.DM) -> dict[str, Array]:
    out = ca.Function("out", [machine.y, machine.unknown], [machine.shown]).map(y.shape[1])
    return dict(zip(machine.names, np.array(out(y, unknown)), strict=True))


def fastest(machine: Machine, y: Array) -> float:
    """Largest magnitude of the eigenvalues of the machine's equations at the state `y` [1/s]."""
    names = ("y", "unknown", "rates", "balance")
    at, z, rates, balance = (getattr(machine, name) for name in names)
    inner = ca.solve(ca.jacobian(balance, z), ca.jacobian(balance, at))
    slope = ca.jacobian(rates, at) - ca.jacobian(rates, z) @ inner
    found = ca.Function("slope", [at, z], [slope])(y, _unknown(machine)(y, 0.0))
    return float(np.abs(np.linalg.eigvals(np.array(found))).max())
