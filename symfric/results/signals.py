"""Signals of a simulation at any time; extremes and integrals over steps, which resolve slip."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symfric.foundation import checks
from symfric.foundation.numeric import Array, Scalar
from symfric.foundation.shown import Showing
from symfric.foundation.status import Status
from symfric.foundation.variable import strays
from symfric.model import Model
from symfric.results.stored import Statistics

Of = Callable[[ca.SX, Array], Array]
"""Function that returns the values of an expression at times."""
ROUNDS, PARTS = 2, 16
"""Number of refinements around an extreme, and number of parts in each refinement."""
NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)
"""Gauss quadrature on (-1, 1), exact up to degree 9, which exceeds that of all dense outputs."""
EXACT, HALVINGS = 1e-12, 24
"""Relative difference between the integral of a step and those of its halves above which the step
is halved, and largest number of halvings."""


def looks(t: Array, steps: Array, jumps: Array) -> Array:
    """Return times that resolve a run: `t`, ends and middles of `steps`, and before `jumps`."""
    middles = (steps[:-1] + steps[1:]) / 2
    before = np.nextafter(jumps, -np.inf)
    every = np.sort(np.concatenate([t, steps, middles, before]))
    every = every[np.append(True, np.diff(every) > 0)]  # np.unique would load numpy.ma
    return every[(every >= steps[0]) & (every <= steps[-1])]


def extremes(
    times: Array, values: Mapping[str, Array], evaluate: Callable[[Array], Mapping[str, Array]]
) -> dict[str, Array]:
    """Return the smallest and largest value of each signal by name, shape (2,).

    The search is refined between the `times`. Both values are NaN if a signal is NaN at any time.
    """
    names, sense = list(values), np.array([1.0, -1.0])  # the largest is the smallest of -values
    every = np.array([values[name] for name in names])[:, None] * sense[:, None]
    found, best = every.argmin(axis=2), every.min(axis=2)
    low, high = times[np.maximum(found - 1, 0)], times[np.minimum(found + 1, times.size - 1)]
    for _ in range(ROUNDS):
        at = np.linspace(low, high, PARTS + 1)
        seen = evaluate(at.ravel())
        rows = [seen[name].reshape(at.shape)[:, i] for i, name in enumerate(names)]
        looked = np.stack(rows, axis=1) * sense
        j = looked.argmin(axis=0)[None]
        least = np.take_along_axis(looked, j, axis=0)[0]
        best = np.where(least < best, least, best)
        low, high = (
            np.take_along_axis(at, np.clip(j + side, 0, PARTS), axis=0)[0] for side in (-1, 1)
        )
    return dict(zip(names, best * sense, strict=True))


def integrals(ends: Array, of: Of, expression: ca.SX, times: Array) -> Array:
    """Return the integrals of the rows of a column from the start to `times`, shape (rows, times).

    `ends` are the ends of steps. The integrand is smooth in each step, because steps end at events
    and at jumps of inputs.
    """
    k = np.clip(np.searchsorted(ends, times, side="right") - 1, 0, ends.size - 2)
    whole = _pieces(of, expression, ends[:-1], ends[1:])
    before = np.concatenate([np.zeros((whole.shape[0], 1)), np.cumsum(whole, axis=1)], axis=1)
    return before[:, k] + _pieces(of, expression, ends[k], times)


def integral_between(ends: Array, of: Of, expression: ca.SX, a: float, b: float) -> float:
    """Return the integral of one expression from time a to b.

    Steps between `ends` are halved until the integrals of the halves agree with the whole.
    """
    cuts = np.unique(np.concatenate([[a], ends[(ends > a) & (ends < b)], [b]]))
    left, right, done = cuts[:-1], cuts[1:], 0.0
    for _ in range(HALVINGS):
        middle = (left + right) / 2
        halves = _pieces(of, expression, left, middle) + _pieces(of, expression, middle, right)
        off = np.abs(halves - _pieces(of, expression, left, right))[0]
        rough = off > EXACT * (abs(done) + np.abs(halves).sum())
        done += float(halves[0, ~rough].sum())
        left, middle, right = left[rough], middle[rough], right[rough]
        left, right = np.concatenate([left, middle]), np.concatenate([middle, right])
    return done + float(_pieces(of, expression, left, right).sum())


def _pieces(of: Of, expression: ca.SX, a: Array, b: Array) -> Array:
    """Return the integrals from a to b, each within one step, shape (rows, intervals)."""
    half = (b - a)[:, None] / 2
    at = (a + b)[:, None] / 2 + half * NODES
    if not at.size:
        return np.zeros((expression.numel(), 0))
    values = np.atleast_2d(of(expression, at.ravel()))
    return np.einsum("rkg,g,k->rk", values.reshape(-1, *at.shape), WEIGHTS, half[:, 0])


@dataclass(frozen=True, eq=False, repr=False)
class Signals(Showing):
    """Named signals of a simulated model over time; `Trajectory` documents the fields."""

    hidden = Showing.hidden | {
        "count", "delays", "ends", "evaluate", "express", "pull_back", "states",
    }  # fmt: skip

    scene: str
    t: Array
    units: dict[str, str]
    status: Status
    message: str
    count: Callable[[], Statistics]
    span: tuple[float, float]
    ends: Callable[[], Array]
    states: Callable[[Array], dict[str, Array]]
    evaluate: Callable[[Array], dict[str, Array]]
    express: Callable[[ca.SX, Array], Array]
    model: Model
    happened: tuple[tuple[float, str], ...] = ()
    differentiate: Callable[[Array], dict[str, dict[str, Array]]] | None = None
    pull_back: Callable[[Mapping[str, Array]], dict[str, float]] | None = None
    delays: Callable[[], dict[str, Array]] | None = None

    @property
    def _where(self) -> str:
        return f"trajectory of '{self.scene}'"

    @property
    def doubts(self) -> str:
        """Message about errors that the tolerances do not bound; "" if none are known."""
        return self.message.removeprefix(self.status.value).strip() if self.status.ok else ""

    @cached_property
    def statistics(self) -> Statistics:
        """Numbers of steps and evaluations, and wall times."""
        return self.count()

    @cached_property
    def step_times(self) -> Array:
        """Start and ends of the accepted steps [s], shape (steps + 1,).

        `at(step_times)` returns the signals there. If the steps would need too much memory, they
        are not kept, and the simulation is repeated when they, or values between the times `t`, are
        used.
        """
        return self.ends()

    @cached_property
    def signals(self) -> dict[str, Array]:
        """Values at `t` by name, shape (n,): states, algebraic variables, inputs, outputs."""
        return self.evaluate(self.t)

    @cached_property
    def looks(self) -> Array:
        """Times [s] for plots, shape (k,), which resolve every accepted step and include `t`."""
        jumps = np.array([time for time, _ in self.happened], dtype=float)
        return looks(self.t, self.step_times, jumps)

    @cached_property
    def _looked(self) -> dict[str, Array]:
        return self.evaluate(self.looks)

    def at_looks(self, name: str) -> Array:
        """Return a signal or detail at `looks`, the times of plots."""
        self.check([name])
        if name in self._looked:
            return self._looked[name]
        return self.of(self.model.expression(name), self.looks)

    @cached_property
    def extremes(self) -> dict[str, tuple[float, float]]:
        """Smallest and largest value of each signal by name, over all accepted steps."""
        found = extremes(self.looks, self._looked, self.evaluate)
        return {name: (float(low), float(high)) for name, (low, high) in found.items()}

    @cached_property
    def _own_states(self) -> dict[str, Array]:
        return self.states(self.t)

    def __getitem__(self, name: str) -> Array:
        if name == "t":
            return self.t
        if not isinstance(name, str) or name not in self.units:  # pyright: ignore[reportUnnecessaryIsInstance]
            self.check([name])
            return self._further[name]
        states = self._own_states
        return states[name] if name in states else self.signals[name]

    @cached_property
    def _further(self) -> dict[str, Array]:
        """All details at `t`, evaluated together because one alone would cost almost as much."""
        column = ca.vertcat(*(o.expression for o in self.model.further.values()), 0)
        return dict(zip(self.model.further, self.of(column), strict=False))

    @cached_property
    def details(self) -> dict[str, str]:
        """Units of the results that are computed on request, such as reactions, by name."""
        return {name: output.unit for name, output in self.model.further.items()}

    def unit(self, name: str) -> str:
        """Return the unit of a signal or detail."""
        return self.units[name] if name in self.units else self.details[name]

    def check(self, names: Iterable[str]) -> None:
        """Check that all names are signals or details.

        Raises:
            ValueError: a name is unknown; the message offers the nearest one.
        """
        names = [checks.text(self._where, name, "the name of a signal") for name in names]
        known = self.units if all(n in self.units for n in names) else self.units | self.details
        checks.check_names(self._where, names, known)

    def of(self, expression: Scalar, times: ArrayLike | None = None) -> Array:
        """Return the values of an expression in the symbols t, x, z, u, p of the model.

        Args:
            expression: scalar SX, or a column (rows, 1).
            times: times [s], shape (n,); by default `t`.

        Returns:
            Values of shape (n,), or (rows, n) for a column.

        Raises:
            ValueError: the expression contains other symbols, or a time is outside the span.
        """
        column, model = ca.SX(checks.expression(f"{self._where}: of", expression)), self.model
        known = ca.vertcat(model.t, *(model.vector(letter) for letter in "xzup"))
        if stray := strays(column, known):
            raise ValueError(
                f"{self._where}: expected an expression in the symbols of its model, got "
                f"{', '.join(stray)}"
            )
        values = self.express(ca.vec(column), self.t if times is None else self._inside(times))
        return values[0] if column.is_scalar() else values

    def at(self, times: ArrayLike) -> dict[str, Array]:
        """Return all signals at `times` [s] in the simulated span, by dense output.

        Raises:
            ValueError: a time is outside the span.
        """
        return self.evaluate(self._inside(times))

    def _inside(self, times: ArrayLike) -> Array:
        where = f"{self._where}: times"
        at = np.atleast_1d(checks.array(where, times, ndim=None, what="times [s]"))
        if at.ndim > 1:
            raise checks.refused(where, "a time or a sequence of times [s]", times)
        first, last = self.span
        if at.size and not (first <= at.min() and at.max() <= last):
            raise ValueError(
                f"{self._where}: expected times in [{first:g}, {last:g}] s, got {at.min():g} ... "
                f"{at.max():g} s"
            )
        return at

    @cached_property
    def final(self) -> dict[str, float]:
        """All signals at the last time reached."""
        return {k: float(v[0]) for k, v in self.evaluate(np.array(self.span[1:])).items()}

    def integral(self, name: str, times: ArrayLike | None = None) -> Array:
        """Return the integral of a signal or detail over time from the start.

        It is computed by Gauss quadrature over the dense output of every accepted step. For
        example, `trajectory.integral("friction_power")` is the work of friction [J].

        Args:
            name: name of a signal or detail.
            times: upper limits [s], shape (n,); by default `t`.

        Raises:
            ValueError: the name is unknown, or a time is outside the span.
        """
        self.check([name])
        at = self.t if times is None else self._inside(times)
        return integrals(self.step_times, self.of, self.model.expression(name), at)[0]

    def work(self, force: str, rate: str, between: tuple[float, float] | None = None) -> float:
        """Return the integral of a force times a rate over time, such as the work of friction [J].

        Steps of the dense output are halved until the quadrature is exact up to rounding. A sum
        over the samples at `t` would miss events between them.

        Args:
            force: name of a signal or detail.
            rate: name of a signal or detail, such as a velocity.
            between: first and last time [s]; by default the whole span.

        Raises:
            ValueError: a name is unknown, or times are outside the span or not in order.
        """
        self.check([force, rate])
        product = self.model.expression(force) * self.model.expression(rate)
        return self._integral_between(product, between)

    def area(self, y: str, x: str, between: tuple[float, float] | None = None) -> float:
        """Return the integral of y dx along the run: the area below a curve, or in a closed loop.

        The area of a loop is positive if it is traversed clockwise in the x-y plane. The method is
        the same as in `work`; jumps of x by the reset of an event are not included.

        Args:
            y: name of a signal or detail.
            x: name of a signal or detail that depends on states and time only; the model must have
                explicit equations.
            between: first and last time [s]; by default the whole span.

        Raises:
            ValueError: a name is unknown, the rate of x is not explicit, or times are outside the
                span or not in order.
        """
        self.check([y, x])
        model, signal = self.model, ca.SX(self.model.expression(x))
        free = ca.vertcat(model.vector("z"), model.vector("u"))
        if model.ode is None or ca.depends_on(signal, free):
            raise ValueError(
                f"{self._where}: area: expected an x of the states and time of "
                f"explicit equations, got '{x}'; work(y, rate) takes its rate, where it is a signal"
            )
        rate = ca.jacobian(signal, model.vector("x")) @ model.ode + ca.jacobian(signal, model.t)
        return self._integral_between(model.expression(y) * rate, between)

    def _integral_between(self, expression: ca.SX, times: tuple[float, float] | None) -> float:
        a, b = self.span if times is None else self._inside(times).tolist()
        if not a <= b:
            raise ValueError(
                f"{self._where}: between: expected a first and a later time [s], got {a:g} and "
                f"{b:g} s"
            )
        return integral_between(self.step_times, self.of, expression, a, b)

    @cached_property
    def sensitivities(self) -> dict[str, dict[str, Array]]:
        """Derivatives of the signals at `t`, shape (n,), by requested name and by signal.

        Names are those passed to `simulate`. Derivatives jump at an event whose time depends on the
        name; at the time of the event, the values after it are returned.

        Raises:
            ValueError: no derivatives were requested, or an event is not differentiable: its
                expression touches zero without crossing, or it coincides with a jump of an input or
                with another event and their order matters.
        """
        return self._requested(self.differentiate)(self.t)

    @cached_property
    def event_sensitivities(self) -> dict[str, Array]:
        """Derivatives of the event times in `happened` by requested name, shape (events,).

        The unit is s per unit of the name. For a terminal event, it is the derivative of the end
        time. The errors are those of `sensitivities`.
        """
        return self._requested(self.delays)()

    def gradient(self, weights: Mapping[str, ArrayLike]) -> dict[str, float]:
        """Return the derivatives of the sum over signals s and times t_i of weights[s][i] s(t_i).

        One backward sweep over the steps computes all derivatives, at a cost that does not depend
        on the number of names passed to `simulate`. For a cost J of the signals at `t`, the weights
        are dJ/ds(t_i).

        Args:
            weights: weights by signal: a number for each time in `t`, or one number for all times.

        Returns:
            Derivatives by the names passed to `simulate`.

        Raises:
            ValueError: no sensitivities were requested, a signal is unknown, or the number of
                weights is wrong.
        """
        pull_back, where = self._requested(self.pull_back), f"{self._where}: gradient"
        named = checks.named(where, weights, self.units)
        given = {n: checks.array(f"{where}: {n}", w, ndim=None) for n, w in named.items()}
        odd = (f"{n} of shape {w.shape}" for n, w in given.items()
               if w.shape not in ((), self.t.shape))  # fmt: skip
        if shapes := ", ".join(odd):
            raise ValueError(
                f"{where}: expected numbers or arrays of {self.t.size} weights, got {shapes}"
            )
        return pull_back({n: np.broadcast_to(w, self.t.shape) for n, w in given.items()})

    def _requested(self, function: Any) -> Any:
        """Return a function of derivatives, which is None if they were not requested."""
        if function is None:
            raise ValueError(
                f"{self._where}: expected sensitivities, got none; request them by "
                "simulate(..., sensitivities=[...])"
            )
        return function
