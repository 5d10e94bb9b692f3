"""Haug's machines in one or two angles, with equations written by hand.

This file uses only CasADi, so that an error of the library cannot affect both sides of a
comparison. The normal forces are unknowns like the accelerations, since they depend on friction.

`solve` integrates with error control by SUNDIALS (IDAS), `fixed_steps` by explicit steps.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import casadi as ca
import numpy as np

from symfric.foundation.numeric import Array

Coefficient = Callable[[ca.SX, ca.SX | float], ca.SX]
"""Function of sliding velocity [m/s] and normal force [N] that returns F/N."""


@final
@dataclass(frozen=True, eq=False)
class PaperMachine:
    """Equations y' = rates(y, unknown), balance(y, unknown) = 0, y(0) = start; `shown` by name."""

    y: ca.SX
    rates: ca.SX
    unknown: ca.SX
    balance: ca.SX
    names: tuple[str, ...]
    shown: ca.SX
    start: list[float]


def brown_mcphee(mu_s: float, mu_d: float, v_t: float) -> Coefficient:
    """Return Brown and McPhee's coefficient of friction."""

    def mu(v: ca.SX, _: ca.SX | float) -> ca.SX:
        x = v / v_t
        return mu_d * ca.tanh(4 * x) + (mu_s - mu_d) * x / (x**2 / 4 + 0.75) ** 2

    return mu


def self_tuning(mu_s: float, mu_d: float, v_t: float) -> Coefficient:
    """Return the self-tuning coefficient with E = 0 and its peak at v_t."""
    C = 2 - 2 / np.pi * np.arcsin(mu_d / mu_s)

    def mu(v: ca.SX, _: ca.SX | float) -> ca.SX:
        return mu_s * ca.sin(C * ca.atan(np.tan(np.pi / 2 / C) * v / v_t))

    return mu


def own_stiffness(mu_s: float, mu_d: float, **_: float) -> Coefficient:
    """Return the self-tuning coefficient with B [s/m] reconstructed from load and mu_s - mu_d."""
    C = 2 - 2 / np.pi * np.arcsin(mu_d / mu_s)

    def mu(v: ca.SX, N: ca.SX | float) -> ca.SX:
        B = 1000 - 900 * ca.exp(-(mu_s - mu_d) / 0.05 * N / 50)
        return mu_s * ca.sin(C * ca.atan(B * v))

    return mu


def four_mass(mu: Coefficient) -> PaperMachine:
    """Return the four sliders; the signals are positions [m], velocities and accelerations."""
    g, th, x4, w, v4, a, l5, l6 = 9.8, *map(ca.SX.sym, ("th", "x4", "w", "v4", "a", "l5", "l6"))
    x1, y2 = 5 * ca.cos(th), 5 * ca.sin(th)
    z3 = ca.sqrt(49 - y2**2)
    v1, v2 = -y2 * w, x1 * w
    v3 = -y2 * v2 / z3
    a1, a2 = -y2 * a - x1 * w**2, x1 * a - y2 * w**2
    a3 = -(v2**2 + y2 * a2 + v3**2) / z3
    a4 = (-10 * (x4 - x1 - 1) - size(6 * g) * mu(v4, size(6 * g))) / 6
    N1, N2 = size(l5 * y2) + size(2 * g), size(l5 * x1) + size(l6 * z3 - 2 * g)
    N3 = size(l6 * y2)
    balance = ca.vertcat(
        2 * a1 + 2 * (x1 - 3) - 10 * (x4 - x1 - 1) + l5 * x1 + N1 * mu(v1, N1),
        2 * a2 + 2 * (y2 - 4) + (l5 + l6) * y2 + N2 * mu(v2, N2),
        6 * (a3 + g) + 2 * (z3 - 3) + l6 * z3 + N3 * mu(v3, N3),
    )
    names = ("x1", "y2", "z3", "x4", "x1'", "y2'", "z3'", "x4'", "x1''", "y2''", "z3''", "x4''")
    shown = ca.vertcat(x1, y2, z3, x4, v1, v2, v3, v4, a1, a2, a3, a4)
    y, rates, unknown = ca.vertcat(th, x4, w, v4), ca.vertcat(w, v4, a, a4), ca.vertcat(a, l5, l6)
    start = [float(np.arctan2(3, 4)), 5.0, 0.0, -1.0]
    return PaperMachine(y, rates, unknown, balance, names, shown, start)


def slider_crank(mu: Coefficient) -> PaperMachine:
    """Return crank and slider; the signals are angle [rad], position [m] and their rates."""
    m_crank, m_slider, J, r, length, R, a, g = 0.5, 5.0, 0.2, 0.08, 0.3, 0.1, 0.1, 9.8
    th, w, alpha, rod, N = map(ca.SX.sym, ("th", "w", "alpha", "rod", "N"))
    c, s = ca.cos(th), ca.sin(th)
    py, pz = 0.1 - r * s, 0.1 + r * c
    x = ca.sqrt(length**2 - py**2 - pz**2)
    v = ca.jacobian(x, th) * w
    acc = ca.jacobian(x, th) * alpha + ca.jacobian(v, th) * w
    f = rod * ca.vertcat(-x, py, pz)  # force on the pin of the crank
    moment = ca.cross(ca.vertcat(0, -r * s, r * c), f)
    F, T = -f - ca.vertcat(0, 0, -m_crank * g), -moment  # load of the bearing
    along, across = ca.vertcat(0, -s, c), ca.vertcat(0, -c, -s)
    f2 = ca.vertcat(-ca.dot(across, T) / a, ca.dot(along, T) / a)
    f1 = ca.vertcat(-ca.dot(along, F), -ca.dot(across, F)) - f2
    balance = ca.vertcat(
        J * alpha - moment[0] + R * N * mu(R * w, N),
        m_slider * acc - rod * x,
        N - size(f1) - size(f2) - size(F[0]),
    )
    names = ("crank", "crank'", "crank''", "slider", "slider'", "slider''")
    shown, unknown = ca.vertcat(th, w, alpha, x, v, acc), ca.vertcat(alpha, rod, N)
    y, rates, start = ca.vertcat(th, w), ca.vertcat(w, alpha), [0.0, 120.0]
    return PaperMachine(y, rates, unknown, balance, names, shown, start)


def size(f: ca.SX | float) -> ca.SX:
    """Return the magnitude of a force, smoothed at zero as in the reference data."""
    return ca.sqrt(ca.sumsqr(f) + 1e-8) - 1e-4


def solve(machine: PaperMachine, times: Array) -> dict[str, Array]:
    """Return the signals of the machine at `times` [s], accurate to ten digits."""
    dae = {"x": machine.y, "z": machine.unknown, "ode": machine.rates, "alg": machine.balance}
    options = {"reltol": 1e-10, "abstol": 1e-11, "max_num_steps": 200_000}
    run = ca.integrator("run", "idas", dae, float(times[0]), list(times), options)
    found = run(x0=machine.start, z0=_unknown(machine)(machine.start, 0.0))
    return _shown(machine, found["xf"], found["zf"])


def fixed_steps(machine: PaperMachine, h: float, t_end: float) -> dict[str, Array]:
    """Return signals every `h` [s], by the classical Runge-Kutta method of order 4."""
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


def _unknown(machine: PaperMachine) -> ca.Function:
    """Return the Function (y, guess) -> unknowns, by Newton's method."""
    problem = {"x": machine.unknown, "p": machine.y, "g": machine.balance}
    newton = ca.rootfinder("newton", "newton", problem, {"abstol": 1e-9})
    y, guess = ca.MX.sym("y", machine.y.numel()), ca.MX.sym("z", machine.unknown.numel())
    return ca.Function("unknown", [y, guess], [newton(guess, y)])


def _shown(machine: PaperMachine, y: ca.DM, unknown: ca.DM) -> dict[str, Array]:
    out = ca.Function("out", [machine.y, machine.unknown], [machine.shown]).map(y.shape[1])
    return dict(zip(machine.names, np.array(out(y, unknown)), strict=True))


def fastest(machine: PaperMachine, y: Array) -> float:
    """Return the largest magnitude [1/s] of the eigenvalues of a machine at the state `y`."""
    names = ("y", "unknown", "rates", "balance")
    at, z, rates, balance = (getattr(machine, name) for name in names)
    inner = ca.solve(ca.jacobian(balance, z), ca.jacobian(balance, at))
    slope = ca.jacobian(rates, at) - ca.jacobian(rates, z) @ inner
    found = ca.Function("slope", [at, z], [slope])(y, _unknown(machine)(y, 0.0))
    return float(np.abs(np.linalg.eigvals(np.array(found))).max())
