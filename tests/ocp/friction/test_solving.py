"""From wide layers to exact modes, and the messages of what fails on the way.

Machines are judged by `rubbing.Machine.follow`: the equations again in NumPy, modes by hand, SciPy.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import groupby, pairwise
from math import tanh
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from phases import unit_move
from rubbing import KINDS, Machine, machine

from ocp import (
    Phase,
    Problem,
    Progress,
    Solution,
    at_end,
    integral,
    problems,
    solve,
    strategies,
)  # fmt: skip
from ocp.formulation.phase import FREE
from ocp.friction import homotopy, smooth_models
from ocp.friction.event_check import verify_exactly
from ocp.friction.homotopy import FIRST, LAST, Sharp, sharpened
from ocp.friction.mode_models import holding, mode_model
from ocp.friction.smooth_models import Scale, own_level, speeds_at, sticking, widths_at
from ocp.problems import out_and_back
from ocp.solving.one_solve import STARTS, Task
from symfric import BrownMcPhee, Contact, ExactCoulomb, Model, SolveError, Status, Variable, drive
from symfric.scenes import PendulumBox

OUT_AND_BACK = 40.0 + 0.5 / (1.0 - 4.0 * tanh(0.25))
SCALES = {"guide": Scale(2.0)}
FORCE = integral(lambda s: s.force**2)


# --- layers from wide to narrow -----------------------------------------------------------------


def test_layers_narrow_down_to_a_hundredth(steps: tuple[Sharp, ...]) -> None:
    levels = [step.level for step in steps]
    assert levels[0] == FIRST
    assert levels[-1] == pytest.approx(LAST)
    assert all(a / b <= 1.79 for a, b in pairwise(levels))
    assert 6 < len(steps) < 12
    counts = [step.solution.statistics.solves for step in steps]  # only the first are many
    assert counts[0] <= 2 * 2 + 3
    assert all(b - a <= 6 for a, b in pairwise(counts))
    last = steps[-1]
    speed = last.scales["guide"].speed
    assert last.error <= 1e-3
    assert last.solution.problem.p["guide_v_t"] == pytest.approx(LAST * speed)
    assert speeds_at(out_and_back(), last.scales, LAST) == {"guide": pytest.approx(LAST * speed)}
    assert abs(last.solution["v"]).max() == pytest.approx(speed, rel=0.2)


def test_cost_tends_to_that_of_coulomb(steps: tuple[Sharp, ...]) -> None:
    """J is nearly linear in the width: from two widths to none."""
    (a, J_a), (b, J_b) = ((step.level, step.solution.cost) for step in (steps[-3], steps[-1]))
    assert J_b - b * (J_a - J_b) / (a - b) == pytest.approx(OUT_AND_BACK, rel=5e-3)


def test_step_to_a_worse_motion_is_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(homotopy, "ABOVE", -1.0)  # nothing is good enough
    steps = list(sharpened(Task(out_and_back()), starts=1, intervals=20))
    assert [step.level for step in steps] == [FIRST]


def test_a_failed_solve_on_the_finer_mesh_is_repeated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(homotopy, "ONTO", {"max_iter": 1})
    first = next(sharpened(Task(out_and_back()), starts=1, intervals=20))
    assert first.solution.ok


def test_sizes_do_not_matter(steps: tuple[Sharp, ...]) -> None:
    """A thousandth of the way by a thousandfold mass: forces and cost are the same."""
    law = BrownMcPhee(mu_s=6.0, mu_d=4.0, mu_v=500.0, v_t=1e-8, N_t=1e-3)
    heavy = drive(law, m=1000.0, N=1.0)
    out, back = (
        replace(phase, model=heavy, end={name: 1e-3 * value for name, value in phase.end.items()})
        for phase in out_and_back().chain
    )
    problem = replace(out_and_back(), phases=out >> back)
    first = next(sharpened(Task(problem), starts=2))
    assert first.scales["guide"].speed == pytest.approx(1e-3 * steps[0].scales["guide"].speed, 0.1)
    assert first.solution.cost == pytest.approx(steps[0].solution.cost, 0.02)


def test_widths_follow_from_speeds_and_are_not_smaller_than_the_users() -> None:
    wide, sharp = out_and_back(v_t=0.5), out_and_back(v_t=1e-5)
    assert widths_at(wide, SCALES, 0.1) == {"guide_v_t": 0.5}
    assert widths_at(sharp, SCALES, 0.1) == {"guide_v_t": pytest.approx(0.2)}
    assert own_level(wide, SCALES) == 0.25
    assert own_level(sharp, SCALES) == pytest.approx(5e-6)
    assert smooth_models.same_size(SCALES, {"guide": Scale(5.0)}, 3.0)
    assert not smooth_models.same_size(SCALES, {"guide": Scale(7.0)}, 3.0)
    assert not sticking(unit_move().chain[0].model)
    assert sticking(problems.parcel_on_tray().chain[0].model)


def test_peak_of_a_smooth_law_is_below_its_level_by_the_shortfall() -> None:
    x = np.linspace(0.5, 2.0, 100_001)
    peak = (4.0 * np.tanh(4 * x) + 2.0 * x / (0.25 * x * x + 0.75) ** 2).max()
    share = smooth_models.shortfall(out_and_back().chain[0].model)
    assert share == pytest.approx(1.0 - peak / 6.0, rel=0.05)
    exact = drive(ExactCoulomb(mu_s=6.0, mu_d=4.0), m=1.0, N=1.0)
    assert smooth_models.shortfall(exact) == 0.0


# --- motions by modes ---------------------------------------------------------------------------


def test_out_and_back_by_modes_has_its_closed_form(by_modes: Solution) -> None:
    """Held controls cost a little more; the superfluous rests are pruned."""
    assert by_modes.verified
    assert by_modes.miss < 1e-4
    assert OUT_AND_BACK < by_modes.cost < 1.001 * OUT_AND_BACK
    (modes,) = by_modes.modes.values()
    assert [mode.kind for mode in modes] == ["slip+", "slip-"]
    assert [mode.end for mode in modes] == pytest.approx([1.0, 2.0])
    assert [phase.name for phase in by_modes.phases] == ["out", "back"]
    assert [phase.T for phase in by_modes.phases] == pytest.approx([1.0, 1.0])
    assert by_modes["x"][by_modes.t.searchsorted(1.0 - 1e-9)] == pytest.approx(1.0)
    assert set(by_modes.signals) >= {"x", "v", "force", "friction"}


def test_motion_by_modes_holds_under_exact_friction(by_modes: Solution) -> None:
    found = verify_exactly(by_modes, tolerance=1e-6)
    assert found.ok, str(found)
    assert {m.what for m in found.checked} >= {"start", "end", "cost"}
    assert found.cost == pytest.approx(by_modes.cost, rel=1e-9)
    out, back = (run["guide_F"][5:-5] for run in found.trajectories)
    assert out.min() >= 4.0 and back.max() <= -4.0  # slides forwards, then backwards
    with pytest.raises(ValueError, match="verify_exactly: expected a solution"):
        verify_exactly(out_and_back())  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="verify_exactly: tolerance: expected"):
        verify_exactly(by_modes, tolerance=0.0)


def test_smooth_law_on_a_coarse_mesh_does_not_hold_under_exact_friction() -> None:
    model = drive(BrownMcPhee(mu_s=6.0, mu_d=4.0, v_t=1e-4), m=1.0, N=1.0)
    phase = Phase(model, 1.0, start={"x": 0.0, "v": 0.0}, end={"x": 0.3, "v": 0.0})
    options = {"friction": "smooth", "intervals": 20, "verify": False, "refine": False}
    solution = solve(Problem(phase, FORCE, bounds={"force": (-20.0, 20.0)}), **options)
    assert solution.status.ok
    found = verify_exactly(solution)
    assert not found.ok
    assert (found.worst.what, found.worst.name) == ("end", "x")  # type: ignore[union-attr]


NEAR = 1e-3
"""Tolerance of `solve`: distance of the exact motion from its goal, over its way."""
TELLING = ("Friction is still smooth", "Modes were not found", "re-simulated", "maximum number",
           "unstable", "No point satisfies", "time limit")  # fmt: skip
"""Texts of a message about a motion that is not right, or of other friction than the user's."""


def judged(of: Machine, found: Solution) -> str:
    """Return "exact", "reported", or the fault of a motion."""
    if found.modes and found.verified:
        missed = of.missed(found)
        return "exact" if missed < NEAR else f"misses by {missed:.1e}: {found.message}"
    return "reported" if any(text in found.message for text in TELLING) else found.message


def test_motion_by_modes_arrives_by_other_equations(by_modes: Solution) -> None:
    guide = Machine(
        "guide", 1, lambda s, c, q, v: [[1.0]], lambda s, c, q, v: [0.5 * v[0]], (0,), ((1.0,),),
        ((6.0, 4.0),), {0: 1.0},
    )  # fmt: skip
    controls = np.array([by_modes.controls["force"]])
    end = guide.follow(np.append(by_modes.t_control, by_modes.T), controls)
    assert np.abs(end).max() < NEAR


@pytest.mark.slow
def test_a_hundred_machines_are_solved_or_reported() -> None:
    ends = {}
    for seed in range(len(KINDS), len(KINDS) + 100):
        of = machine(seed)
        ends[seed] = judged(of, solve(of.problem(), throw=False))
    wrong = {seed: text for seed, text in ends.items() if text not in ("exact", "reported")}
    assert wrong == {}
    assert sum(text == "exact" for text in ends.values()) >= 98


@pytest.mark.slow
@pytest.mark.parametrize(
    ("make", "cost", "kinds"),
    [
        (problems.cart_pendulum, 71.534, {"x": ["slip+", "slip-", "stick", "slip+"]}),
        (problems.load_through_spring, 28.469, {"load": ["stick", "slip+", "stick", "slip-"]}),
        (problems.two_blocks, 58.74, {}),
    ],
)
def test_rests_on_the_way_hold_under_exact_friction(
    make: Callable[..., Problem], cost: float, kinds: dict[str, list[str]]
) -> None:
    solution = solve(make(1e-5), friction="modes")
    assert solution.cost == pytest.approx(cost, rel=5e-3)
    for name, expected in kinds.items():
        assert [mode.kind for mode in solution.modes[name]][: len(expected)] == expected
    every = {mode.kind for modes in solution.modes.values() for mode in modes}
    assert every == {"slip+", "slip-", "stick"}
    assert verify_exactly(solution, tolerance=1e-4).ok


def test_holding_force_of_one_joint_contains_the_reaction_of_the_other() -> None:
    model = PendulumBox(BrownMcPhee()).model()
    modes = {"x": 1, "phi": 0}
    moving = mode_model(model, modes)
    force, rooms = holding(model, modes, "x")
    known = [moving.t, *(moving.vector(letter) for letter in "xzup")]
    assert not ca.Function("held", known, [force, *rooms.values()], {"allow_free": True}).has_free()


# --- margins of rests ---------------------------------------------------------------------------

PUSH, MOST = 2.0, 5.0
"""mu g of a part on a tray, and the largest acceleration of the tray [m/s^2]."""
BEST = (MOST - PUSH**2 / MOST) / 16.0
"""Way of the part in a cycle of 1 s: it rests under PUSH, and slides under -MOST [m]."""


def conveyor() -> Problem:
    """The farthest way of a part on a shaken tray in a period."""
    tray, part = (Variable(name, "m", nominal=0.1) for name in ("tray", "part"))
    v_tray, v_part = (Variable(name, "m/s") for name in ("v_tray", "v_part"))
    w = Variable("w", "m/s^2", lower=-MOST, upper=MOST, nominal=MOST)
    law = BrownMcPhee(mu_s=PUSH, mu_d=PUSH, v_t=1e-5)
    bed = Contact("bed", v_part.symbol - v_tray.symbol, 1.0, law)
    model = Model(
        "conveyor", x=(tray, v_tray, v_part, part), u=(w,), contacts=(bed,),
        ode=ca.vertcat(v_tray.symbol, w.symbol, -bed.force, v_part.symbol),
    )  # fmt: skip
    start = {"tray": 0.0, "part": 0.0, "v_tray": FREE, "v_part": FREE}
    names = ["tray", "v_tray", "v_part"]
    return Problem(Phase(model, 1.0, start=start), at_end(lambda s: -s.part), periodic=names)


@pytest.mark.slow
@pytest.mark.parametrize(("margin", "least", "rel"), [(1e-4, 0.0, 5e-4), (0.02, 0.01, 2e-3)])
def test_conveyor_has_its_closed_form_but_for_the_cost_of_its_margin(
    margin: float, least: float, rel: float
) -> None:
    found = solve(conveyor(), resting_margin=margin)
    assert found.verified
    text = re.search(r"Stiction keeps (\S+) of .*, which costs about (\S+) of", found.message)
    assert text is not None, found.message
    cost = float(text[2])
    assert float(text[1]) == margin
    assert cost >= least * BEST
    assert -found.cost + cost == pytest.approx(BEST, rel=rel)


def test_motion_faster_than_the_layers_ends_the_first_starts_and_a_stop_ends_all() -> None:
    stages: list[str] = []

    def report(now: Progress) -> None:
        stages.append(now.stage)
        if not now.stage.startswith("start"):
            raise KeyboardInterrupt

    stopped = solve(conveyor(), progress=report, throw=False)
    assert stopped.status is Status.INTERRUPTED
    starts = [stage for stage, _ in groupby(stages)]
    again = starts.index("start 1", 1)
    assert again < STARTS  # the others would have too narrow layers as well
    assert starts[again:-1] == [f"start {number}" for number in range(1, STARTS + 2)]


# --- failures on the way ------------------------------------------------------------------------

INTERNAL = RuntimeError("variables [z] are free")


def raising(error: BaseException) -> Callable[..., Any]:
    def fails(*_: object, **__: object) -> object:
        raise error

    return fails


def sharpened_by(monkeypatch: pytest.MonkeyPatch, steps: tuple[Sharp, ...]) -> None:
    """Use known layers instead of a search."""
    monkeypatch.setattr(strategies, "sharpened", lambda *_, **__: iter(steps))


@pytest.mark.parametrize("error", [INTERNAL, SolveError("no mode", Status.SOLVER_FAILED)], ids=str)
def test_failed_modes_end_in_the_sharpened_motion(
    error: Exception, monkeypatch: pytest.MonkeyPatch, steps: tuple[Sharp, ...]
) -> None:
    sharpened_by(monkeypatch, steps)
    monkeypatch.setattr(strategies, "optimise_modes", raising(error))
    found = solve(out_and_back(v_t=1e-5), throw=False)
    assert found.ok
    assert found.modes == {}
    assert "Friction is still smooth: guide over" in found.message
    assert f"Modes were not found: {'internal error, ' * (error is INTERNAL)}" in found.message
    assert str(error) in found.message
    monkeypatch.setattr(strategies, "optimise_modes", raising(KeyboardInterrupt()))
    with pytest.raises(KeyboardInterrupt):
        solve(out_and_back(v_t=1e-5))


def test_failed_layers_end_in_the_smooth_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    def layers(*_: object, **__: object) -> Iterator[object]:
        yield raising(INTERNAL)()

    monkeypatch.setattr(strategies, "sharpened", layers)
    monkeypatch.setattr(strategies, "verified", raising(INTERNAL))
    found = solve(out_and_back(v_t=0.2), throw=False, intervals=10, refine=False)
    assert found.ok and not found.verified
    assert "Friction was not sharpened: internal error, RuntimeError: variables" in found.message
    assert "It was not verified: internal error, RuntimeError: variables" in found.message


def test_failed_simulation_with_exact_friction_is_reported(
    monkeypatch: pytest.MonkeyPatch, steps: tuple[Sharp, ...], by_modes: Solution
) -> None:
    sharpened_by(monkeypatch, steps)
    error = ValueError("expected no events, got 1")
    monkeypatch.setattr(strategies, "verify_exactly", raising(error))
    found_modes = SimpleNamespace(
        margins=(1e-2,), motion=lambda *_, **__: by_modes, rests=lambda *_: ""
    )
    monkeypatch.setattr(strategies, "optimise_modes", lambda *_, **__: found_modes)
    found = solve(out_and_back(v_t=1e-5))
    assert found.verified
    assert found.modes
    assert "With exact Coulomb friction it was not simulated: expected no events" in found.message


def test_stop_during_the_search_for_modes_leaves_the_smooth_motion(
    monkeypatch: pytest.MonkeyPatch, steps: tuple[Sharp, ...]
) -> None:
    stages: list[str] = []

    def leave(progress: Progress) -> None:
        stages.append(progress.stage)
        if progress.stage.startswith("modes"):
            raise KeyboardInterrupt

    sharpened_by(monkeypatch, steps)
    stopped = solve(out_and_back(v_t=1e-5), progress=leave, throw=False)
    assert stopped.status is Status.INTERRUPTED
    assert "Stopped while modes were sought; friction is still smooth." in stopped.message
    assert stopped.modes == {}
    assert sum(stage.startswith("modes") for stage in stages) == 1
    assert abs(stopped["x"][-1]) < 1e-3
