"""Integrals of the signals of a run: over time, works, areas below curves and in loops."""

from collections.abc import Iterable
from typing import Protocol

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from symfric.foundation.numeric import Scalar
from symfric.model import Model

Array = NDArray[np.float64]
NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)
"""Of Gauss quadrature on (-1, 1): exact to degree 9, beyond any dense output."""
EXACT, HALVINGS = 1e-12, 24
"""Part of an integral by which two halves may differ from a whole; how often a step is halved."""


class Run(Protocol):
    """What is integrated."""

    @property
    def step_times(self) -> Array:
        """Ends of the accepted steps [s]."""
        ...

    def of(self, expression: Scalar, times: ArrayLike | None = None, /) -> Array:
        """Values of an expression."""
        ...


class Quadrature:
    """Integrals over the dense output of a run.

    Attributes:
        scene, t, span, model: of the run.
    """

    scene: str
    t: Array
    span: tuple[float, float]
    model: Model

    @property
    def step_times(self) -> Array:
        """Ends of the accepted steps [s]."""
        raise NotImplementedError

    def of(self, expression: Scalar, times: ArrayLike | None = None) -> Array:
        """Values of an expression."""
        raise NotImplementedError

    def check(self, names: Iterable[str]) -> None:
        """Refuse what is neither a signal nor a detail."""
        raise NotImplementedError

    def _inside(self, times: ArrayLike) -> Array:
        raise NotImplementedError

    def integral(self, name: str, times: ArrayLike | None = None) -> Array:
        """Integral of a signal or detail over time from the start, such as energy from power.

        By Gauss quadrature over the dense output of every accepted step, which costs the
        simulation nothing: `trajectory.integral("friction_power")` is a work [J].

        Args:
            name: of a signal or detail.
            times: up to where [s], shape (n,); `t` if not given.

        Raises:
            ValueError: unknown name, a time outside the span.
        """
        self.check([name])
        at = self.t if times is None else self._inside(times)
        return integrals(self, self.model.expression(name), at)[0]

    def work(self, force: str, rate: str, between: tuple[float, float] | None = None) -> float:
        """Integral of a force times a rate over time, such as the work of friction [J].

        Over the dense output, steps halved until quadrature is exact to rounding. A sum over the
        samples at `t` is off by what happens between them.

        Args:
            force: a signal or detail.
            rate: another one, such as a velocity.
            between: first and last time [s]; the whole span if not given.

        Raises:
            ValueError: unknown names, times outside the span or not in order.
        """
        self.check([force, rate])
        product = self.model.expression(force) * self.model.expression(rate)
        return self._integral_between(product, between)

    def area(self, y: str, x: str, between: tuple[float, float] | None = None) -> float:
        """Integral of y dx along the run: the area below a curve, or in a loop that closes.

        Positive for a loop that is run clockwise in the plane of x and y. Found as `work` is; what
        the reset of an event does to x at once is left out.

        Args:
            y: a signal or detail.
            x: one of the states and time alone, of a model with explicit equations.
            between: first and last time [s]; the whole span if not given.

        Raises:
            ValueError: unknown names, an x whose rate the equations do not give, times outside the
                span or not in order.
        """
        self.check([y, x])
        model, signal = self.model, ca.SX(self.model.expression(x))
        free = ca.vertcat(model.vector("z"), model.vector("u"))
        if model.ode is None or ca.depends_on(signal, free):
            raise ValueError(
                f"trajectory of '{self.scene}': area: expected an x of the states and time of "
                f"explicit equations, got '{x}'; work(y, rate) takes its rate, where it is a signal"
            )
        rate = ca.jacobian(signal, model.vector("x")) @ model.ode + ca.jacobian(signal, model.t)
        return self._integral_between(model.expression(y) * rate, between)

    def _integral_between(self, expression: ca.SX, times: tuple[float, float] | None) -> float:
        a, b = self.span if times is None else self._inside(times).tolist()
        if not a <= b:
            raise ValueError(
                f"trajectory of '{self.scene}': between: expected a first and a later time [s], "
                f"got {a:g} and {b:g} s"
            )
        return integral_between(self, expression, a, b)


def integrals(run: Run, expression: ca.SX, times: Array) -> Array:
    """Integrals of the rows of a column from the start up to `times`, shape (rows, times).

    Steps end at jumps of inputs and at events, so that the integrand is smooth inside each.
    """
    ends = run.step_times
    k = np.clip(np.searchsorted(ends, times, side="right") - 1, 0, ends.size - 2)
    whole = _pieces(run, expression, ends[:-1], ends[1:])
    before = np.concatenate([np.zeros((whole.shape[0], 1)), np.cumsum(whole, axis=1)], axis=1)
    return before[:, k] + _pieces(run, expression, ends[k], times)


def integral_between(run: Run, expression: ca.SX, a: float, b: float) -> float:
    """Integral of one expression from time a to b; a step is halved while its halves add detail."""
    ends = run.step_times
    cuts = np.unique(np.concatenate([[a], ends[(ends > a) & (ends < b)], [b]]))
    left, right, done = cuts[:-1], cuts[1:], 0.0
    for _ in range(HALVINGS):
        middle = (left + right) / 2
        halves = _pieces(run, expression, left, middle) + _pieces(run, expression, middle, right)
        off = np.abs(halves - _pieces(run, expression, left, right))[0]
        rough = off > EXACT * (abs(done) + np.abs(halves).sum())
        done += float(halves[0, ~rough].sum())
        left, middle, right = left[rough], middle[rough], right[rough]
        left, right = np.concatenate([left, middle]), np.concatenate([middle, right])
    return done + float(_pieces(run, expression, left, right).sum())


def _pieces(run: Run, expression: ca.SX, a: Array, b: Array) -> Array:
    """Integrals over the intervals from a to b, each within a step, shape (rows, intervals)."""
    half = (b - a)[:, None] / 2
    at = (a + b)[:, None] / 2 + half * NODES
    if not at.size:
        return np.zeros((expression.numel(), 0))
    values = np.atleast_2d(run.of(expression, at.ravel()))
    return np.einsum("rkg,g,k->rk", values.reshape(-1, *at.shape), WEIGHTS, half[:, 0])
