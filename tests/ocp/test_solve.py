"""The whole way from a problem to a verified solution."""

from math import tanh

import pytest
from motions import double_integrator
from phases import there_and_back, unit_move

from ocp import (
    TIME,
    Free,
    Ipopt,
    Phase,
    Problem,
    Progress,
    Radau,
    Verification,
    at_end,
    integral,
    solve,
    worst,
)
from ocp.problems import out_and_back
from symfric import GMS, BrownMcPhee, ExactCoulomb, SolveError, Status, drive
from symfric.laws import Law

OUT_AND_BACK = 40.0 + 0.5 / (1.0 - 4.0 * tanh(0.25))


def test_least_effort_has_its_closed_form() -> None:
    solution = solve(unit_move(), intervals=40)
    assert solution.cost == pytest.approx(12.0, rel=1e-3)
    assert solution.verified
    assert solution.miss < 1e-6
    assert solution.modes == {}


def test_what_is_asked_for_on_the_way_is_met() -> None:
    move = Problem(
        Phase(double_integrator(), 1.0, via={0.5: {"x": 0.8}}, end={"x": 1.0, "v": 0.0}),
        integral(lambda s: s.a**2) + at_end(lambda s: 3.0 * s.x),
    )
    solution = solve(move, intervals=80)
    assert solution.verified
    assert solution["x"][abs(solution.t - 0.5).argmin()] == pytest.approx(0.8)
    assert solution.cost == pytest.approx(3.0 + _through(0.8), rel=1e-3)


def _through(x: float) -> float:
    """Least integral of a^2 of a unit move in 1 s, from rest to rest, through x in the middle."""

    def half(d: float, v: float) -> float:  # from rest over d to velocity v in 1/2
        return 96.0 * d * d - 48.0 * d * v + 8.0 * v * v

    v = 1.5  # the sum of both halves is least at 3/2 whatever x is
    return half(x, v) + half(1.0 - x, v)


def test_the_cost_is_that_of_the_simulation() -> None:
    solution = solve(unit_move(cost=integral(lambda s: s.a**2 + 50.0 * s.x**2)), intervals=20)
    assert isinstance(solution.verification, Verification)
    assert solution.verification.cost == pytest.approx(solution.cost, rel=1e-6)


def test_phases_go_on_from_each_other() -> None:
    solution = solve(there_and_back(), intervals=30)
    assert solution.verified
    assert [phase.name for phase in solution.phases] == ["out", "back"]
    assert solution.T == 2.0


def test_friction_is_solved_by_modes_from_the_default_guess() -> None:
    solution = solve(out_and_back(v_t=1e-5))
    assert solution.verified
    assert solution.miss < 1e-4
    assert [mode.kind for mode in solution.modes["guide"]] == ["slip+", "slip-"]
    assert solution.cost == pytest.approx(OUT_AND_BACK, rel=1e-3)


def test_a_wide_law_is_solved_as_it_is() -> None:
    solution = solve(out_and_back(v_t=0.1))
    assert solution.verified
    assert solution.modes == {}
    assert solution.cost == pytest.approx(67.6, rel=5e-3)


def test_one_mesh_misses_and_says_so() -> None:
    with pytest.raises(SolveError, match="misses") as caught:
        solve(out_and_back(v_t=1e-3), friction="smooth", refine=False, intervals=25)
    assert caught.value.status is Status.TERMINAL_MISS
    partial = caught.value.partial
    assert partial.miss > 1e-3
    assert not partial.verified


def test_a_limit_of_time_keeps_what_there_is() -> None:
    solution = solve(out_and_back(), max_time=1e-3, throw=False)
    assert solution.status is Status.TIME_LIMIT
    assert solution.statistics.solves >= 1


def test_progress_tells_the_stage_and_stops_the_way() -> None:
    stages: list[str] = []

    def stop(now: Progress) -> None:
        stages.append(now.stage)
        if now.stage.startswith("width"):
            raise ValueError("enough")

    with pytest.raises(SolveError) as caught:
        solve(out_and_back(), progress=stop)
    assert stages[0] == "start 1"
    assert caught.value.status is Status.INTERRUPTED
    assert isinstance(caught.value.__cause__, ValueError)
    assert caught.value.partial["x"].size > 0


def test_a_solution_is_a_start_for_another_mesh() -> None:
    first = solve(unit_move(), intervals=10, refine=False)
    again = solve(unit_move(), intervals=20, refine=False, guess=first)
    assert again.iterations <= first.iterations + 2
    assert again.verified


def test_the_shortest_time_is_that_on_paper() -> None:
    fast = Phase(double_integrator(1.0), Free(0.5, 5.0), end={"x": 1.0, "v": 0.0})
    solution = solve(Problem(fast, TIME), scheme=Radau(2), solver=Ipopt(max_iter=100))
    assert pytest.approx(2.0, rel=1e-3) == solution.T
    assert solution.verified


def test_modes_need_contacts_that_have_them() -> None:
    with pytest.raises(ValueError, match="expected a contact that holds"):
        solve(unit_move(), friction="modes")


@pytest.mark.parametrize("law", [ExactCoulomb(mu_s=6.0, mu_d=4.0), GMS()])
def test_laws_with_states_are_verified_with_themselves(law: Law) -> None:
    move = Phase(drive(law, m=1.0, N=1.0), 1.0, end={"x": 1.0, "v": 0.0})
    solution = solve(Problem(move, integral(lambda s: s.force**2)), starts=2)
    assert solution.verified
    assert f"guide: {type(law).__name__}" in solution.message
    assert "With exact Coulomb friction it misses by" in solution.message
    assert solution.modes["guide"][0].kind in ("stick", "slip+")


def test_a_stop_while_modes_are_sought_leaves_the_smooth_motion() -> None:
    stages: list[str] = []

    def leave(progress: Progress) -> None:
        stages.append(progress.stage)
        if progress.stage.startswith("modes"):
            raise KeyboardInterrupt

    stopped = solve(out_and_back(v_t=1e-4), starts=1, progress=leave, throw=False)
    assert stopped.status is Status.INTERRUPTED
    assert "Stopped while modes were sought; friction is still smooth." in stopped.message
    assert stopped.modes == {}
    assert sum(stage.startswith("modes") for stage in stages) == 1
    assert abs(stopped["x"][-1]) < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("largest", [False, True])
def test_one_control_serves_dry_and_oiled(largest: bool) -> None:
    law = BrownMcPhee(mu_s=6.0, mu_d=4.0, v_t=1e-2, N_t=1e-3)
    stage = drive(law, free=["mu_d"], m=1.0, N=1.0)
    move = Phase(stage, 1.2, start={"x": 0.0, "v": 0.0}, end={"x": (0.9, 1.1)})
    effort = integral(lambda s: s.force**2)
    both = Problem(
        move,
        worst(effort) if largest else effort,
        scenarios={"dry": {"mu_d": 5.0}, "oiled": {"mu_d": 3.0}},
    )
    solution = solve(both, starts=3)
    assert solution.verified
    ends = [motion["x"][-1] for motion in solution.scenarios.values()]
    assert min(ends) == pytest.approx(0.9, abs=1e-3)
    assert max(ends) <= 1.101
