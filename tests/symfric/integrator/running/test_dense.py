"""Dense output: pieces between steps, cut at events, joined."""

from dataclasses import replace

import numpy as np
import pytest
from hybrid import ball
from numpy.typing import NDArray

from symfric import LuGre, rabinowicz, simulate
from symfric.integrator.running.crossings import cutting
from symfric.integrator.running.record import Dense, hermite
from symfric.integrator.step.layout import Record

Array = NDArray[np.float64]
RNG = np.random.default_rng(7)


def pieces(rows: int, count: int = 3, n: int = 2) -> Dense:
    """A continuous chain with random coefficients on [0, count] s."""
    t, y = np.arange(count + 1.0), RNG.normal(size=(count + 1, n))
    return Dense(t[:-1], t[1:], y[:-1], y[1:], RNG.normal(size=(count, rows, n)))


def cubic(t: Array) -> Array:
    return np.stack([1 + t - 2 * t**2 + t**3, 4 - t**3])


def cubic_slope(t: Array) -> Array:
    return np.stack([1 - 4 * t + 3 * t**2, -3 * t**2])


def test_hermite_interpolation_reproduces_cubics() -> None:
    t = np.array([0.0, 0.3, 1.0, 1.1, 2.5])
    fine = np.linspace(0, 2.5, 77)
    assert hermite(t, cubic(t), cubic_slope(t))(fine) == pytest.approx(cubic(fine), abs=1e-13)


@pytest.mark.parametrize("rows", [0, 1, 2, 3])
def test_ends_of_the_pieces_are_the_accepted_values(rows: int) -> None:
    dense = pieces(rows)
    every = np.arange(3)
    np.testing.assert_array_equal(dense.piece(every, np.zeros(3)), dense.y0)
    np.testing.assert_array_equal(dense.piece(every, np.ones(3)), dense.y1)
    assert (
        pytest.approx(np.vstack([dense.y0, dense.y1[-1:]]), abs=1e-14)
        == dense(np.array([0.0, 1.0, 2.0, 3.0])).T
    )


@pytest.mark.parametrize(("rows", "degree"), [(0, 1), (1, 2), (2, 3), (3, 4)])
def test_piece_is_a_polynomial_one_degree_above_its_rows(rows: int, degree: int) -> None:
    s = np.linspace(0, 1, 9)
    values = pieces(rows).piece(np.zeros(9, int), s)
    fitted = np.polynomial.polynomial.polyfit(s, values, degree)
    assert pytest.approx(values, abs=1e-10) == np.polynomial.polynomial.polyval(s, fitted).T
    if rows:
        less = np.polynomial.polynomial.polyfit(s, values, degree - 1)
        assert np.abs(np.polynomial.polynomial.polyval(s, less).T - values).max() > 1e-4


@pytest.mark.parametrize("rows", [0, 1, 2, 3])
@pytest.mark.parametrize("theta", [0.001, 0.37, 0.999, 1.0])
def test_step_cut_at_an_event_keeps_its_polynomial(rows: int, theta: float) -> None:
    whole = pieces(rows, 1)
    at = Record(2, rows)
    row = np.concatenate([whole.t0, whole.t1, whole.y0[0], whole.y1[0], whole.D.ravel()])
    cut = Dense.of(cutting(at)(theta, row).full().T, 2)
    assert (cut.t0.tolist(), cut.t1.tolist()) == ([0.0], [theta])
    times = np.linspace(0, theta, 101)
    assert cut(times) == pytest.approx(whole(times), abs=1e-12)


def test_value_at_a_jump_is_that_after_it() -> None:
    first, second = pieces(1, 1, 1), pieces(1, 1, 1)
    both = Dense.of(
        np.vstack([first.rows, replace(second, t0=second.t0 + 1, t1=second.t1 + 1).rows]), 1
    )
    assert both(np.array([1.0]))[0, 0] == second.y0[0, 0]
    assert both(np.array([np.nextafter(1.0, 0)]))[0, 0] == pytest.approx(first.y1[0, 0])
    assert both(np.array([2.0]))[0, 0] == pytest.approx(second.y1[0, 0])


@pytest.mark.parametrize("count", [0, 1, 4])
@pytest.mark.parametrize("rows", [0, 2, 3])
def test_records_are_taken_apart(count: int, rows: int) -> None:
    records = RNG.normal(size=(count, Record(3, rows).width))
    dense = Dense.of(records, 3)
    assert dense.D.shape == (count, rows, 3)
    np.testing.assert_array_equal(dense.rows, records)


@pytest.mark.parametrize("method", ["rodas5p", "rodas4p", "rodas3"])
def test_dense_output_is_as_accurate_as_the_steps(method: str) -> None:
    model = rabinowicz(LuGre())
    run = simulate(model, 8.0, method=method, rtol=1e-6)
    reference = simulate(model, 8.0, rtol=1e-11)
    at_steps = np.abs(run.at(run.step_times)["x"] - reference.at(run.step_times)["x"]).max()
    between = np.abs(run["x"] - reference["x"]).max()
    assert between < 3 * at_steps + 1e-6


def test_dense_output_of_a_parabola_is_exact_across_impacts() -> None:
    run = simulate(ball(0.5), 0.9, rtol=1e-10)
    hit = run.happened[0][0]
    early = run.t[run.t < hit]
    assert run["x"][: early.size] == pytest.approx(1 - 9.81 / 2 * early**2, abs=1e-9)
