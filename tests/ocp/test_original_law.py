"""Laws with states: the motion with their static side misses, and one with the law itself not."""

from math import sqrt

import numpy as np
import pytest
from phases import unit_move

from ocp import Phase, Problem, Shooting, integral, solve
from ocp.original_law import project_control
from ocp.solving.methods import Ipopt
from ocp.solving.starts import start_of
from ocp.transcription.schemes import Scheme, make_meshes
from ocp.transcription.transcribe import discretise
from symfric import LuGre, Status, drive


def test_the_nearest_control_to_none_is_that_of_least_effort() -> None:
    problem = unit_move()
    on = discretise(problem, Shooting("rodas5p", 2)).on(make_meshes(problem, 30))
    start = start_of(on, {"a": 0.0})[0]
    least = Ipopt().prepared(on.program).run(start)
    close = Ipopt().prepared(project_control(on, start.w)).run(start)
    assert close.status is Status.SOLVED
    np.testing.assert_allclose(close.iterate.w, least.iterate.w, atol=1e-6)


def test_the_nearest_control_to_one_that_arrives_is_itself() -> None:
    problem = unit_move()
    on = discretise(problem, Shooting("rodas5p", 2)).on(make_meshes(problem, 30))
    solved = Ipopt().prepared(on.program).run(start_of(on, None)[0])
    same = Ipopt().prepared(project_control(on, solved.iterate.w)).run(solved.iterate)
    assert same.cost == pytest.approx(0.0, abs=1e-12)


def bristles(sigma_0: float) -> Problem:
    """Out and back by a drive whose bristles give way by 6 N / sigma_0 before they slip."""
    law = LuGre(
        mu_s=6.0, mu_d=4.0, v_s=1e-2, sigma_0=sigma_0, sigma_1=1.4 * sqrt(sigma_0), sigma_2=0.5
    )
    stage = drive(law, m=1.0, N=1.0)
    out = Phase(stage, T=1.0, start={"x": 0.0, "v": 0.0}, end={"x": 1.0}, name="out")
    back = Phase(stage, T=1.0, end={"x": 0.0, "v": 0.0}, name="back")
    effort = integral(lambda s: s.force**2)
    return Problem(out >> back, effort, bounds={"force": (-20.0, 20.0)})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sigma_0", "scheme"),
    [(1e3, None), (1e4, None), (1e5, None), (1e4, Shooting("exponential", 10))],
)
def test_bristles_arrive_by_shooting_with_the_law_itself(
    sigma_0: float, scheme: Scheme | None
) -> None:
    solution = solve(bristles(sigma_0), scheme=scheme, starts=2)
    assert solution.verified
    assert isinstance(solution.scheme, Shooting)
    assert f"By {solution.scheme} with the law itself" in solution.message
    assert 64.71 < solution.cost < 64.8 + 70.0 / sqrt(sigma_0)
    assert [mode.kind for mode in solution.modes["guide"]] == ["slip+", "slip-"]
    assert solution["z"].size
