"""`solve` from a problem to a verified solution: results, arguments, stops, imports."""

import re
import subprocess
import sys
from dataclasses import replace
from math import sqrt
from typing import Any

import numpy as np
import pytest
from bad_values import NAN, Thing, flag, number
from motions import double_integrator, stage
from phases import unit_move

from ocp import Ipopt, Phase, Problem, Progress, Radau, Shooting, Verification, solve
from ocp.formulation.expressions import at_end, integral, worst
from ocp.formulation.phase import Chain
from ocp.friction.homotopy import sharpened
from ocp.original_law import project_control
from ocp.problems import READY, Ready, out_and_back
from ocp.solving.starts import start_of
from ocp.transcription.schemes import Scheme, make_meshes
from ocp.transcription.transcribe import discretise
from symfric import GMS, BrownMcPhee, Exact, ExactCoulomb, LuGre, SolveError, Status, drive
from symfric.bench.ocp_cases import CASES
from symfric.laws import Law

FORCE = integral(lambda s: s.force**2)


# --- verified solutions -------------------------------------------------------------------------


def through(x: float) -> float:
    """Least integral of a^2 of a unit move in 1 s, from rest to rest, through x in the middle."""

    def half(d: float, v: float) -> float:  # from rest over d to velocity v in 1/2
        return 96.0 * d * d - 48.0 * d * v + 8.0 * v * v

    return half(x, 1.5) + half(1.0 - x, 1.5)  # the sum of both is least at v = 3/2 for every x


def test_least_effort_through_a_via_point_has_its_closed_form() -> None:
    phase = Phase(double_integrator(), 1.0, via={0.5: {"x": 0.8}}, end={"x": 1.0, "v": 0.0})
    cost = integral(lambda s: s.a**2) + at_end(lambda s: 3.0 * s.x)
    solution = solve(Problem(phase, cost), intervals=20)
    assert solution.verified
    assert solution["x"][abs(solution.t - 0.5).argmin()] == pytest.approx(0.8)
    assert solution.cost == pytest.approx(3.0 + through(0.8), rel=1e-4)
    assert isinstance(solution.verification, Verification)
    assert solution.verification.cost == pytest.approx(solution.cost, rel=1e-6)
    assert solution.miss < 1e-6
    assert solution.modes == {}


def test_wide_law_is_solved_as_it_is() -> None:
    solution = solve(unit_move(model=stage(0.5), cost=FORCE), intervals=10)
    assert solution.verified
    assert solution.modes == {}


def test_coarse_mesh_misses() -> None:
    with pytest.raises(SolveError, match="misses") as caught:
        solve(out_and_back(v_t=1e-3), friction="smooth", refine=False, intervals=25)
    assert caught.value.status is Status.TERMINAL_MISS
    assert caught.value.partial.miss > 1e-3
    assert not caught.value.partial.verified


def test_solution_is_a_start_for_another_mesh() -> None:
    first = solve(unit_move(), intervals=10, refine=False)
    again = solve(unit_move(), intervals=20, refine=False, guess=first)
    assert again.iterations <= first.iterations + 2
    assert again.verified


@pytest.mark.parametrize(
    "law",
    [
        ExactCoulomb(mu_s=6.0, mu_d=4.0),
        Exact(BrownMcPhee(mu_s=6.0, mu_d=4.0)),
        pytest.param(GMS(), marks=pytest.mark.slow),
    ],
)
def test_laws_with_states_are_verified_with_themselves(law: Law) -> None:
    move = Phase(drive(law, m=1.0, N=1.0), 1.0, end={"x": 1.0, "v": 0.0})
    solution = solve(Problem(move, FORCE), starts=1)
    assert solution.verified
    if isinstance(law, ExactCoulomb | Exact):
        assert "verified with exact Coulomb friction, the law of the model" in solution.message
    else:
        assert f"guide: {type(law).__name__}" in solution.message
        assert "With exact Coulomb friction it misses by" in solution.message
    assert solution.modes["guide"][0].kind in ("stick", "slip+")


def held_near_its_level(law: Law) -> Problem:
    """A move of 0.1 m, and a rest of 1 s under a force of 5.9 N, just below the level of 6 N."""
    guide = drive(law, m=1.0, N=1.0)
    move = Phase(guide, 1.0, start={"x": 0.0, "v": 0.0}, end={"x": 0.1, "v": 0.0})
    hold = Phase(guide, 1.0, end={"x": 0.1, "v": 0.0})
    return Problem(move >> hold, integral(lambda s: (s.force - 5.9) ** 2))


@pytest.mark.slow
def test_motion_that_creeps_under_its_law_is_told_from_one_that_is_wrong() -> None:
    """A smooth law needs a velocity of the width of its layer to hold a force near its level."""

    def found(v_t: float) -> Any:
        law = BrownMcPhee(mu_s=6.0, mu_d=4.0, v_t=v_t, N_t=1e-3)
        return solve(held_near_its_level(law), tolerance=1e-4, starts=1, throw=False)

    creeping = found(1.8e-5)
    assert creeping.status is Status.TERMINAL_MISS
    sentence = creeping.message.split(". ")[0]
    assert "The motion is valid with exact Coulomb friction (largest miss" in sentence
    assert "under the laws of the model, whose layers creep at rest, " in sentence
    assert "feedback along the motion, or the law ExactCoulomb or Exact(law) closes" in sentence
    width = re.search(r"a layer of (\S+) m/s \(guide\)", sentence)
    assert width is not None, sentence
    assert found(float(width[1])).verified


@pytest.mark.slow
@pytest.mark.parametrize("largest", [False, True])
def test_one_control_serves_dry_and_oiled(largest: bool) -> None:
    law = BrownMcPhee(mu_s=6.0, mu_d=4.0, v_t=1e-2, N_t=1e-3)
    model = drive(law, free=["mu_d"], m=1.0, N=1.0)
    phase = Phase(model, 1.2, start={"x": 0.0, "v": 0.0}, end={"x": (0.9, 1.1)})
    scenarios = {"dry": {"mu_d": 5.0}, "oiled": {"mu_d": 3.0}}
    both = Problem(phase, worst(FORCE) if largest else FORCE, scenarios=scenarios)
    solution = solve(both, starts=3)
    assert solution.verified
    ends = [motion["x"][-1] for motion in solution.scenarios.values()]
    assert min(ends) == pytest.approx(0.9, abs=1e-3)
    assert max(ends) <= 1.101


# --- shooting with the law itself ---------------------------------------------------------------


@pytest.mark.parametrize("moved", [False, True])
def test_nearest_control_is_that_of_least_effort_or_itself(moved: bool) -> None:
    """Nearest to zero, and nearest to the solution of the problem."""
    problem = unit_move()
    on = discretise(problem, Shooting("rodas5p", 1)).on(make_meshes(problem, 10))
    start = start_of(on, {"a": 0.0})[0]
    least = Ipopt().prepared(on.program).run(start)
    goal = least.iterate if moved else start
    close = Ipopt().prepared(project_control(on, goal.w)).run(goal)
    assert close.status is Status.SOLVED
    np.testing.assert_allclose(close.iterate.w, least.iterate.w, atol=1e-6)
    assert not moved or close.cost == pytest.approx(0.0, abs=1e-12)


def bristles(sigma_0: float) -> Problem:
    """Out and back by a drive whose bristles give way by 6 N / sigma_0 before they slip."""
    sigma_1 = 1.4 * sqrt(sigma_0)
    law = LuGre(mu_s=6.0, mu_d=4.0, v_s=1e-2, sigma_0=sigma_0, sigma_1=sigma_1, sigma_2=0.5)
    cart, problem = drive(law, m=1.0, N=1.0), out_and_back()
    return replace(problem, phases=Chain(tuple(replace(p, model=cart) for p in problem.chain)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sigma_0", "scheme"), [(1e3, None), (1e5, None), (1e4, Shooting("exponential", 10))]
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


# --- arguments ----------------------------------------------------------------------------------

HUGE = 10**400
WRONG: dict[str, list[Any]] = {  # see also `test_bad_tools.py`
    "intervals": [0, 1.5, "10", [0, 1, 0.5], [0, "a", 1], HUGE, [HUGE, 1], Thing(), [[0, 1]] * 2],
    "guess": [5, {"x": HUGE}, {"y": 1.0}, {"x": [NAN]}, {"x": lambda t: t[:3]}],
    "tolerance": [HUGE],
    "resting_margin": number(0.0, 0.2, HUGE),
    "starts": [HUGE],
    "friction": [np.zeros(3), []],
    "refine": flag(),
}
NARROW = drive(BrownMcPhee(mu_s=3.0, mu_d=3.0, v_t=1e-5), m=2.0, N=1.0)
WAYS: dict[str, tuple[Any, dict[str, Any]]] = {
    "modes": (NARROW, {}),
    "shooting": (drive(LuGre(), m=2.0, N=1.0), {"scheme": Shooting("exponential", 4)}),
}


def move(model: Any) -> Problem:
    ends = {"start": {"x": 0.0, "v": 0.0}, "end": {"x": 0.1, "v": 0.0}}
    return Problem(Phase(model, 1.0, **ends), FORCE)


@pytest.mark.parametrize("way", WAYS)
def test_wrong_arguments_are_refused_by_every_strategy(way: str) -> None:
    model, more = WAYS[way]
    problem, accepted = move(model), list[str]()
    for name, values in WRONG.items():
        for value in values:
            try:
                solve(problem, **{"max_time": 1e-3, "throw": False, **more, name: value})
            except ValueError as error:
                assert name in str(error), (name, value, str(error))
            else:
                accepted.append(f"{name}={value!r}")
    assert accepted == []
    with pytest.raises(ValueError, match="expected a contact that holds"):
        solve(unit_move(), friction="modes")


def test_homotopy_begins_with_the_number_of_intervals(monkeypatch: pytest.MonkeyPatch) -> None:
    counts = list[int]()

    def seen(*args: Any, intervals: int, **more: Any) -> Any:
        counts.append(intervals)
        return sharpened(*args, intervals=intervals, **more)

    monkeypatch.setattr("ocp.strategies.sharpened", seen)
    for intervals in (None, 25, np.int64(25), np.linspace(0, 1, 31), [[0.0, 0.5, 1.0]]):
        solve(move(NARROW), intervals=intervals, max_time=1e-3, throw=False)
    assert counts == [60, 25, 25, 30, 2]


def test_time_limits_and_errors_in_progress_keep_the_best_motion() -> None:
    solution = solve(out_and_back(), max_time=1e-3, throw=False)
    assert solution.status is Status.TIME_LIMIT
    assert solution.statistics.solves >= 1
    stages: list[str] = []

    def stop(now: Progress) -> None:
        stages.append(now.stage)
        if now.stage.startswith("width"):
            raise ValueError("enough")

    with pytest.raises(SolveError) as caught:
        solve(out_and_back(), starts=1, progress=stop)
    assert stages[0] == "start 1"
    assert caught.value.status is Status.INTERRUPTED
    assert isinstance(caught.value.__cause__, ValueError)
    assert caught.value.partial["x"].size > 0


# --- imports and ready problems -----------------------------------------------------------------

HEAVY = (
    "matplotlib", "scipy", "multiprocessing", "ocp.strategies", "ocp.checking", "ocp.friction",
    "ocp.mpc",
    "symfric.multibody", "symfric.integrator.simulate", "symfric.laws.catalogue",
)  # fmt: skip


def test_solve_is_imported_without_modules_of_a_run() -> None:
    code = "from ocp import solve\nimport sys; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not set(HEAVY) & set(done.stdout.split())


@pytest.mark.parametrize("ready", [r for r in READY.values() if r.friction], ids=lambda r: r.name)
def test_ready_problems_have_contacts_and_a_program(ready: Ready) -> None:
    problem = ready.make(v_t=1e-3)
    contacts = {c.name: c for span in problem.spans for c in span.model.contacts}
    assert {c.law.velocity_scale for c in contacts.values()} == {1e-3}
    program = discretise(problem, Radau(1)).on(make_meshes(problem, 2)).program
    assert program.w.numel() == program.lower_w.size
    assert ready.title


@pytest.mark.slow
def test_equal_motions_of_some_starts_do_not_end_the_search() -> None:
    case = next(case for case in CASES if case.name == "cart_pole")
    solution = solve(case.problem(), throw=False)  # three starts stay down, at 6470
    assert solution.cost == pytest.approx(652.65, abs=0.05)
    assert "valid with exact Coulomb friction" in solution.message
