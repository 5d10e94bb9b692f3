"""Solutions before the set-valued law: what it accepts, and what it does not."""

from functools import cache

import numpy as np
import pytest

from ocp import Phase, Problem, Solution, integral, solve
from ocp.friction.event_check import motions, verify_exactly
from ocp.strategies import Friction
from symfric import BrownMcPhee, Model, drive


def stage() -> Model:
    return drive(BrownMcPhee(mu_s=6.0, mu_d=4.0, v_t=1e-4), m=1.0, N=1.0)


def move(model: Model) -> Problem:
    """0.3 m from rest to rest within 1 s."""
    phase = Phase(model, T=1.0, start={"x": 0.0, "v": 0.0}, end={"x": 0.3, "v": 0.0})
    return Problem(phase, integral(lambda s: s.force**2), bounds={"force": (-20.0, 20.0)})


@cache
def solved(friction: Friction) -> Solution:
    """By modes, or smoothed as the law is, on 20 intervals."""
    return solve(
        move(stage()), friction=friction, throw=False, intervals=20, verify=False,
        refine=friction != "smooth",
    )  # fmt: skip


def test_a_motion_by_modes_is_what_exact_friction_makes_of_its_control() -> None:
    solution = solved("modes")
    found = verify_exactly(solution, tolerance=1e-6)
    assert found.ok, str(found)
    assert {m.what for m in found.checked} >= {"start", "end", "cost"}
    assert found.cost == pytest.approx(solution.cost, rel=1e-9)
    (motion,) = motions(solution)
    told, exact = solution.modes["guide"], motion.modes["guide"]
    kept = [m for m in exact if m.end - m.begin > 1e-6]
    assert [m.kind for m in kept] == [m.kind for m in told]
    np.testing.assert_allclose([m.end for m in kept], [m.end for m in told], atol=1e-5)


def test_a_motion_of_a_smooth_law_on_a_coarse_mesh_is_not() -> None:
    """Its solver was content; under exact friction the end is missed."""
    solution = solved("smooth")
    assert solution.status.ok
    found = verify_exactly(solution)
    assert not found.ok
    assert (found.worst.what, found.worst.name) == ("end", "x")  # type: ignore[union-attr]


def test_what_is_no_solution_is_refused() -> None:
    with pytest.raises(ValueError, match="verify_exactly: expected a solution"):
        verify_exactly(move(stage()))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="verify_exactly: tolerance: expected"):
        verify_exactly(solved("smooth"), tolerance=0.0)
