"""Least squares end at a minimum, or say why they do not."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.old.descent import Evaluate, Point, descend, remaining
from symfric.foundation.status import Status

Array = NDArray[np.float64]
FREE = np.array([np.inf, np.inf])
X = np.linspace(0.0, 3.0, 40)
NOISE = 0.05 * np.random.default_rng(0).standard_normal(X.size)


def decay(w: Array) -> Point:
    """Residuals of a exp(-b x) beside 2 exp(-0.7 x) with noise."""
    e = np.exp(-w[1] * X)
    J = np.column_stack([e, -w[0] * X * e])
    return Point(w, w[0] * e - 2 * np.exp(-0.7 * X) - NOISE, J, None)


def test_minimum_is_met_to_the_last_digits_and_not_to_a_hundredth() -> None:
    """Guards the mutant "the fit stops at 1e-2": the gradient is zero, the start forgotten."""
    ends = [
        descend(decay, decay(np.array(w)), -FREE, FREE, 0.0, 50)
        for w in ([0.3, 3.0], [5.0, 0.1], [2.0, 0.7])
    ]
    for end in ends:
        assert (end.status, end.why) == (Status.SOLVED, "")
        gradient = end.point.J.T @ end.point.r
        size = np.linalg.norm(end.point.J, axis=0) * np.linalg.norm(end.point.r)
        assert np.abs(gradient / size).max() < 1e-5
        assert end.point.w == pytest.approx(ends[0].point.w, rel=1e-5)


def wall(at: float) -> Evaluate:
    """The same, but nothing is known beyond b = at."""
    return lambda w: decay(w) if w[1] < at else "with b there: nothing is known"


def test_an_edge_of_what_can_be_simulated_is_no_minimum() -> None:
    """Guards "no trial lowers the cost" being called solved."""
    start = decay(np.array([2.0, 0.2]))
    end = descend(wall(0.4), start, -FREE, FREE, 0.0, 200)
    assert end.status is Status.NO_DESCENT
    assert "trials could not be simulated, the last because with b there: nothing" in end.why
    assert end.point.cost < start.cost


def test_wrong_derivatives_are_no_minimum() -> None:
    def wrong(w: Array) -> Point:
        point = decay(w)
        return Point(w, point.r, -point.J, None)

    end = descend(wrong, wrong(np.array([1.0, 0.7])), -FREE, FREE, 0.0, 50)
    assert end.status is Status.NO_DESCENT
    assert "trials fit worse" in end.why


def test_bound_stops_the_fit_and_the_other_coordinate_goes_on() -> None:
    low, high = np.array([-np.inf, 0.9]), FREE
    end = descend(decay, decay(np.array([1.0, 1.5])), low, high, 0.0, 50)
    assert (end.status, end.point.w[1]) == (Status.SOLVED, 0.9)
    J, r = end.point.J, end.point.r
    assert abs(J[:, 0] @ r) < 1e-6 * np.linalg.norm(J[:, 0]) * np.linalg.norm(r)
    assert remaining(end.point, np.array([True, False])) < 1e-9
    assert remaining(end.point, np.array([True, True])) > 1e-3


def rough(size: float) -> Evaluate:
    """The same with errors of the computation that depend on w erratically."""

    def at(w: Array) -> Point:
        seed = int(abs(hash(tuple(w.tolist()))) % 2**32)
        point = decay(w)
        error = size * np.random.default_rng(seed).standard_normal(X.size)
        return Point(w, point.r + error, point.J, None)

    return at


def test_falls_that_rounding_hides_are_not_asked_for() -> None:
    for size in (1e-9, 1e-6, 1e-4):
        at = rough(size)
        rounding = 10 * size * X.size**0.5
        end = descend(at, at(np.array([1.0, 0.3])), -FREE, FREE, rounding, 100)
        assert end.status is Status.SOLVED


def test_within_a_tenth_of_a_standard_error_is_acceptable() -> None:
    """Nobody said that the residuals are rough."""
    at = rough(1e-5)
    end = descend(at, at(np.array([1.0, 0.3])), -FREE, FREE, 0.0, 100)
    assert end.status is Status.ACCEPTABLE


def test_a_coordinate_that_loses_its_influence_does_not_run_away() -> None:
    """Guards the constant of 4.9e108: 1 - exp(-b x) at large b."""

    def saturated(w: Array) -> Point:
        e = np.exp(-np.exp(w[1]) * (X + 0.1))
        J = np.column_stack([1 - e, w[0] * (X + 0.1) * np.exp(w[1]) * e])
        return Point(w, w[0] * (1 - e) - 1.0 - 0.1 * NOISE, J, None)

    end = descend(saturated, saturated(np.array([0.5, 1.0])), -FREE, FREE, 0.0, 100)
    assert end.status.ok
    assert np.exp(end.point.w[1]) < 1e5


def test_no_fall_is_promised_by_a_coordinate_without_influence() -> None:
    """All of r lies in the direction of the second one, a million times too weak."""
    point = Point(np.zeros(2), np.array([0.0, 1.0]), np.diag([1.0, 1e-6]), None)
    both = np.array([True, True])
    assert 1e-6 < remaining(point, both) < 1e-4
    assert remaining(Point(point.w, point.r, np.eye(2), None), both) == pytest.approx(1.0)


def test_steps_run_out() -> None:
    end = descend(decay, decay(np.array([0.3, 3.0])), -FREE, FREE, 0.0, 2)
    assert (end.status, end.steps) == (Status.MAX_ITERATIONS, 2)


def test_a_valley_is_followed_and_no_step_leaves_the_region_of_trust() -> None:
    """Rosenbrock's function from the usual start; each trial within the radius that was trusted."""
    tried = [np.array([-1.2, 1.0])]

    def valley(w: Array) -> Point:
        tried.append(w)
        r = np.array([10 * (w[1] - w[0] ** 2), 1 - w[0]])
        return Point(w, r, np.array([[-20 * w[0], 10.0], [-1.0, 0.0]]), None)

    end = descend(valley, valley(tried[0]), -FREE, FREE, 0.0, 60)
    assert end.status is Status.SOLVED
    assert end.point.w == pytest.approx([1.0, 1.0], abs=1e-6)
    assert max(np.linalg.norm(b - a) for a, b in pairwise(tried)) < 4.0


def test_trust_grows_where_derivatives_keep_their_promise() -> None:
    """A straight way of 60 from a first step of 1."""

    def line(w: Array) -> Point:
        return Point(w, w - 60.0, np.eye(1), None)

    end = descend(line, line(np.zeros(1)), -FREE[:1], FREE[:1], 0.0, 12)
    assert (end.status, end.point.w[0]) == (Status.SOLVED, pytest.approx(60.0))
