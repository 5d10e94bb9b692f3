"""Sequences of modes that are wrong at first, and what comes of them."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ocp.formulation.phase import Chain
from ocp.friction.arc_solution import ModeSolver, Solved
from ocp.friction.mode_optimisation import KICK, SHORTEST, better, parameters_of, settled
from ocp.friction.sequence import Leg, Run, Track, cut, neighbours, shown, with_rests
from ocp.friction.smooth_models import smooth_model, widths
from ocp.friction.transfer import Known, sizes_of
from ocp.problems import out_and_back
from ocp.solving.methods import Ipopt
from ocp.solving.one_solve import solve_once
from ocp.transcription.schemes import Radau


@cache
def known() -> Known:
    """Out and back with friction smoothed over 0.05 m/s."""
    problem = out_and_back()
    phases = [
        replace(
            phase,
            model=smooth_model(phase.model),
            p={w.parameter: w.at(0.05) for w in widths(phase.model)},
        )
        for phase in problem.chain
    ]
    smooth = solve_once(replace(problem, phases=Chain(tuple(phases))), intervals=25)
    return Known(smooth.motions[0], parameters_of(problem, {}), {})


def modes_solver() -> ModeSolver:
    problem = out_and_back()
    sizes = sizes_of(problem, known())
    return ModeSolver(
        problem, sizes, ("guide",), Ipopt(max_iter=100), Radau(3), SHORTEST * 2, KICK * 2, None
    )


def legs_of(*runs: tuple[int, float, float]) -> tuple[Leg, ...]:
    track = Track("guide", tuple(Run(*run) for run in runs))
    return cut([track], (0, 0), 0.0, 1.0), cut([track], (1, 0), 1.0, 2.0)


def found_for(legs: tuple[Leg, ...]) -> Solved:
    first = modes_solver().solve(legs, known(), 30, 1e-2)
    assert first.ok
    return settled(modes_solver(), first, lambda solved: solved)


WRONG = {
    "rests everywhere": [(0, 0, 0.1), (1, 0.1, 0.9), (0, 0.9, 1.1), (-1, 1.1, 1.9), (0, 1.9, 2)],
    "turns early": [(1, 0, 0.9), (-1, 0.9, 2)],
    "turns late": [(1, 0, 1.05), (-1, 1.05, 2)],
    "wiggles at the end": [(1, 0, 0.95), (-1, 0.95, 1.8), (1, 1.8, 2)],
}


@pytest.mark.slow
@pytest.mark.parametrize("name", WRONG)
def test_what_is_superfluous_shrinks_and_is_pruned(name: str) -> None:
    found = found_for(legs_of(*WRONG[name]))
    assert shown(found.legs) == "+ | -"
    assert found.ideal_cost == pytest.approx(64.59984, rel=1e-3)


def test_rests_are_put_where_nothing_was_and_pruned_again() -> None:
    track = Track("guide", (Run(1, 0.0, 0.98), Run(-1, 0.98, 2.0)))
    rested = with_rests(track, lambda t: True, 0.01)
    legs = cut([rested], (0, 0), 0.0, 1.0), cut([rested], (1, 0), 1.0, 2.0)
    assert shown(legs) == "0+0- | -0"
    assert shown(found_for(legs).legs) == "+ | -"


def test_sequences_next_to_one_are_tried_and_the_better_one_is_kept() -> None:
    """Turning earlier or later than at the instant that is set costs more here."""
    legs = legs_of((1, 0, 1), (-1, 1, 2))
    assert [shown(other) for other in neighbours(legs, 0.01)] == ["+- | -", "+ | +-"]
    found = found_for(legs)
    kept = better(modes_solver(), found, 0.01, lambda solved: solved)
    assert shown(kept.legs) == "+ | -"
    assert kept.outcome.cost <= found.outcome.cost


def test_a_rest_that_leaves_below_the_static_level_is_no_solution() -> None:
    """The force when it breaks away is above the 6 N of the guide, from the start on."""
    found = found_for(legs_of((1, 0, 1), (-1, 1, 2)))
    forces = [points.u[0, 0] for points in found.points.spans]
    assert forces[0] >= 6.0 * 1.009
    assert forces[1] <= -6.0 * 1.009
    assert np.isfinite(found.loss)
