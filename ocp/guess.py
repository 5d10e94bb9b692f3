"""Where the optimiser starts: by default straight lines between the boundary values."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from math import isfinite

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ocp.layout import Points
from ocp.problem import Box, Free, Problem
from ocp.solution import Solution
from ocp.transcribe import Transcription
from symfric.foundation import checks
from symfric.model import Model

Array = NDArray[np.float64]

Guess = float | ArrayLike | Callable[[Array], ArrayLike]
"""A constant, samples at equal distances from 0 to T, or a function of the times [s]."""


def initial_points(into: Transcription, given: Mapping[str, Guess] | None = None) -> Points:
    """Points to start from: what is `given` by name, straight lines and mid values for the rest.

    States run straight between the middles of their ranges at 0, at the via points and at T. A
    state that is the rate of another one (x' = v) takes the slope of that one: with v = 0, where a
    friction law is steepest, Ipopt needs ten times the iterations or fails. Algebraic variables
    keep their start value; inputs are zero, or in the middle of their bounds where zero is outside.

    Raises:
        ValueError: unknown name, or values that are not finite or not one a time.
    """
    problem, model = into.problem, into.problem.model
    known = [v.name for group in (model.x, model.z, model.u) for v in group]
    given = checks.named("guess", given, known)
    T = _duration(problem)

    def row(name: str, fractions: Array, default: Array) -> Array:
        return _evaluate(name, given[name], fractions * T, T) if name in given else default

    at_x, at_u = into.fractions, (into.mesh[1:] + into.mesh[:-1]) / 2
    x = {v.name: row(v.name, at_x, _line(into, v.name)) for v in model.x}
    x |= {
        rate: np.gradient(x[name], at_x * T)
        for name, rate in _rates(model).items()
        if rate not in given
    }
    z = [row(v.name, at_x[1:], np.full(at_x.size - 1, float(v.start))) for v in model.z]
    u = [row(v.name, at_u, np.full(at_u.size, _rest(problem.box(v.name)))) for v in model.u]
    return Points(
        np.full(int(into.layout.free_time), T),
        np.array(list(x.values())).reshape(-1, at_x.size),
        np.array(z).reshape(-1, at_x.size - 1),
        np.array(u).reshape(-1, at_u.size),
    )


def resample(into: Transcription, solution: Solution) -> Points:
    """The points of a solution on another mesh, or of another model with the same names."""
    problem, model = into.problem, into.problem.model
    T, at = _duration(problem), solution.t / solution.T

    def hold(values: Array) -> Callable[[Array], Array]:
        return lambda t: values[np.searchsorted(solution.mesh, t / T, side="right") - 1]

    def line(values: Array) -> Callable[[Array], Array]:
        return lambda t: np.interp(t / T, at, values)

    signals, controls = solution.signals, solution.controls
    given: dict[str, Guess] = {
        v.name: line(signals[v.name]) for v in (*model.x, *model.z) if v.name in signals
    }
    given |= {v.name: hold(controls[v.name]) for v in model.u if v.name in controls}
    points = initial_points(into, given)
    if not isinstance(problem.T, Free):
        return points
    return replace(points, T=np.clip([solution.T], problem.T.lower, problem.T.upper))


def _duration(problem: Problem) -> float:
    return problem.T.start if isinstance(problem.T, Free) else float(problem.T)


def _evaluate(name: str, guess: Guess, times: Array, T: float) -> Array:
    try:
        made = guess(times) if callable(guess) else guess
    except (TypeError, ArithmeticError, RuntimeError) as error:
        what = f"for {name} a number, samples, or a function of the times"
        raise checks.refused("guess", what, error) from error
    values = checks.array(f"guess of {name}", made, ndim=None)
    sizes = (1, times.size) if callable(guess) else range(1, values.size + 1)
    if values.ndim > 1 or values.size not in sizes:
        raise ValueError(
            f"guess: expected for {name} a number, samples, or a function that returns one value "
            f"a time, got an array of shape {values.shape}"
        )
    if callable(guess) or values.ndim == 0:
        return np.broadcast_to(values, times.shape)
    return np.interp(times, np.linspace(0.0, T, values.size), values)


def _line(into: Transcription, name: str) -> Array:
    """Through what is asked of a state at 0, at the via points and at T; level where nothing is."""
    problem = into.problem
    asked = {0.0: problem.initial} | dict(problem.via) | {1.0: problem.final}
    boxes = {s: problem.at(s)[name] for s in sorted(asked) if s == 0.0 or name in asked[s]}
    values = {s: _middle(box) for s, box in boxes.items() if isfinite(box[0]) or isfinite(box[1])}
    values = values or {0.0: 0.0}
    return np.interp(into.fractions, list(values), list(values.values()))


def _rates(model: Model) -> dict[str, str]:
    """State -> the state that is its time derivative."""
    ode = model.function("ode")(model.t, *(model.vector(letter) for letter in "xzup"))
    return {
        v.name: other.name
        for i, v in enumerate(model.x)
        for other in model.x
        if ca.is_equal(ode[i], other.symbol)
    }


def _middle(box: Box) -> float:
    """The middle of a range, or its finite end."""
    low, high = box
    if isfinite(low) and isfinite(high):
        return (low + high) / 2
    return low if isfinite(low) else high


def _rest(box: Box) -> float:
    """Zero, or the middle of a range that does not hold it."""
    return 0.0 if box[0] <= 0.0 <= box[1] else _middle(box)
