"""Small models with known solutions, on which the order of an integration method is measured."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from math import exp, sin

import casadi as ca
import numpy as np

from symfric import Model, Variable
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.equations.system import System, system
from symfric.integrator.methods.attempt import build_dense_step, build_fixed
from symfric.integrator.methods.method import Method
from symfric.integrator.running.record import Dense

T = 1.0
"""End time of every measurement [s]."""


@dataclass(frozen=True)
class ClosedForm:
    """A model and the values of all its unknowns over time."""

    model: Model
    exact: Callable[[float], Sequence[float]]


@cache
def assemble(model: Model) -> System:
    """The model without driven inputs, as an integration step sees it."""
    return system(model, input_data(model, None, 0.0, T))


@cache
def smooth_ode() -> ClosedForm:
    """Problem of Kaps, mu = 1: x = exp(-2t), y = exp(-t)."""
    x, y = Variable("x", "1", start=1.0), Variable("y", "1", start=1.0)
    X, Y = x.symbol, y.symbol
    rates = ca.vertcat(-3 * X + Y**2, X - Y - Y**2)
    return ClosedForm(Model("kaps", x=(x, y), ode=rates), lambda t: (exp(-2 * t), exp(-t)))


@cache
def smooth_dae() -> ClosedForm:
    """Index 1, nonlinear: x = exp(-2t), y = z = exp(-t)."""
    x, y = Variable("x", "1", start=1.0), Variable("y", "1", start=1.0)
    z = Variable("z", "1", start=1.0)
    X, Y, Z = x.symbol, y.symbol, z.symbol
    rates = ca.vertcat(-3 * X + Y * Z, X - Y - Z**2)
    model = Model("dae", x=(x, y), z=(z,), ode=rates, alg=Z * (1 + Y) - X - Y)
    return ClosedForm(model, lambda t: (exp(-2 * t), exp(-t), exp(-t)))


@cache
def timed_ode() -> ClosedForm:
    """Explicit time: x' = -(1 + t) x^2, x = 1 / (1 + t + t^2/2); time is an unknown, too."""
    x, t = Variable("x", "1", start=1.0), ca.SX.sym("t")
    model = Model("timed", x=(x,), ode=-(1 + t) * x.symbol**2, t=t)
    return ClosedForm(model, lambda s: (1 / (1 + s + s * s / 2), s))


@cache
def prothero_robinson(rate: float) -> ClosedForm:
    """x' = -rate (x - sin(t + 1/2)) + cos(t + 1/2), x = sin(t + 1/2): stiff, with smooth x."""
    x, t = Variable("x", "1", start=sin(0.5)), ca.SX.sym("t")
    slope = -rate * (x.symbol - ca.sin(t + 0.5)) + ca.cos(t + 0.5)
    return ClosedForm(Model("stiff", x=(x,), ode=slope, t=t), lambda s: (sin(s + 0.5), s))


def fixed_steps(case: ClosedForm, method: Method, count: int) -> float:
    """Largest error of any unknown at T after `count` equal steps."""
    step = build_fixed(assemble(case.model), method).mapaccum(count)
    y = step(case.exact(0.0), T / count, np.zeros(0)).full()[:, -1]
    return float(np.abs(y - case.exact(T)).max())


def between_fixed_steps(case: ClosedForm, method: Method, count: int) -> float:
    """Largest error of any unknown between `count` equal steps."""
    step, h = build_dense_step(assemble(case.model), method), T / count
    theta = np.linspace(0.0, 1.0, 11)
    y, worst = np.array(case.exact(0.0)), 0.0
    for k in range(count):
        rows = step(y, h, np.zeros(0)).full().reshape(-1, y.size)
        ends = np.array([k * h]), np.array([(k + 1) * h])
        piece = Dense(*ends, y[None], rows[:1], rows[None, 1:])
        exact = [case.exact((k + s) * h) for s in theta]
        worst = max(worst, float(np.abs(piece.piece(np.zeros(11, int), theta) - exact).max()))
        y = rows[0]
    return worst


def observed_order(counts: Sequence[int], errors: Sequence[float]) -> float:
    """Slope of log error over log step size."""
    return -float(np.polyfit(np.log(counts), np.log(errors), 1)[0])
