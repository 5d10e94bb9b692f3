"""Local errors of intervals by collocation of high order, against simulations."""

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from phases import on, slider_crank, solve_once
from tables import sampled

from ocp.checking.interval_errors import estimated_errors, local_errors
from ocp.checking.resimulate import arcs_of
from ocp.formulation.expressions import integral
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.problems import brachistochrone, out_and_back
from ocp.solving.starts import initial_points
from ocp.transcription.schemes import Legendre, Radau


def turned_crank() -> Problem:
    turn = Phase(slider_crank(), 0.3, end={"crank": 2.0, "crank_rate": 0.0})
    return Problem(turn, integral(lambda s: s.torque**2))


DRY = partial(out_and_back, v_t=0.2)


@pytest.mark.parametrize(
    ("make", "scheme"),
    sampled(
        [
            (brachistochrone, Radau(2)),
            (brachistochrone, Legendre(2)),
            (turned_crank, Legendre(2)),
            (turned_crank, Radau(3)),
            (DRY, Radau(3)),
        ],
        of=2,
    ),
)
def test_estimates_of_local_errors_agree_with_simulations(
    make: Callable[[], Problem], scheme: Radau | Legendre
) -> None:
    """An explicit model with free duration, a loop with reactions, and friction by two phases."""
    problem = make()
    made = on(problem, 20, scheme)
    solution = solve_once(problem, 20, scheme)
    arcs = arcs_of(problem, made.meshes, solution.points)
    found = estimated_errors(made, solution.iterate.w, made.program.values, arcs)
    for estimate, error in zip(found, local_errors(arcs, 1e-10), strict=True):
        small = error < 1e-5
        np.testing.assert_allclose(estimate[small], error[small], rtol=0.05, atol=1e-8)
        assert (abs(np.log2(estimate[~small] / error[~small])) < 1.0).all()


def test_intervals_that_collocation_does_not_resolve_are_simulated() -> None:
    """Layers a hundred thousand times narrower than the speeds."""
    problem = out_and_back(v_t=1e-5)
    made = on(problem)
    w = made.pack(initial_points(made))
    arcs = arcs_of(problem, made.meshes, made.unpack(w))
    found = estimated_errors(made, w, made.program.values, arcs)
    for estimate, error in zip(found, local_errors(arcs, 1e-6), strict=True):
        np.testing.assert_allclose(estimate, error, rtol=0.05, atol=1e-4)
