"""Layers of friction from wide to narrow."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from math import tanh

import pytest
from phases import unit_move

from ocp.formulation.expressions import integral
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.friction import homotopy
from ocp.friction.homotopy import FIRST, LAST, Sharp, sharpened
from ocp.friction.smooth_models import (
    Scale,
    has_jumps,
    own_level,
    same_size,
    smoothed,
    speeds_at,
    widths_at,
)
from ocp.problems import out_and_back, parcel_on_tray
from ocp.solving.methods import Ipopt
from ocp.transcription.schemes import Radau
from symfric import BrownMcPhee, ExactCoulomb, LuGre, drive

EXACT = 40.0 + 0.5 / (1.0 - 4.0 * tanh(0.25))
SCALES = {"guide": Scale(2.0)}


def path(problem: Problem, **more: object) -> Iterator[Sharp]:
    return sharpened(problem, Radau(3), Ipopt(), **more)


@pytest.fixture(scope="module")
def steps() -> list[Sharp]:
    return list(path(out_and_back(), starts=2))


def test_layers_narrow_down_to_a_hundredth(steps: list[Sharp]) -> None:
    levels = [step.level for step in steps]
    assert levels[0] == FIRST
    assert levels[-1] == pytest.approx(LAST)
    assert all(a / b <= 1.79 for a, b in pairwise(levels))
    assert 6 < len(steps) < 12


def test_the_cost_goes_to_that_of_coulomb(steps: list[Sharp]) -> None:
    # J is nearly linear in the width: from two widths to none
    (a, J_a), (b, J_b) = ((step.level, step.solution.cost) for step in (steps[-3], steps[-1]))
    assert J_b - b * (J_a - J_b) / (a - b) == pytest.approx(EXACT, rel=5e-3)


def test_a_step_tells_its_widths_and_its_errors(steps: list[Sharp]) -> None:
    last = steps[-1]
    assert last.error <= 1e-3
    speed = last.scales["guide"].speed
    assert last.solution.problem.p["guide_v_t"] == pytest.approx(LAST * speed)
    assert speeds_at(out_and_back(), last.scales, LAST) == {"guide": pytest.approx(LAST * speed)}
    assert abs(last.solution["v"]).max() == pytest.approx(speed, rel=0.2)


def test_only_the_first_solves_are_many(steps: list[Sharp]) -> None:
    counts = [step.solution.statistics.solves for step in steps]
    assert counts[0] <= 2 * 2 + 3
    assert all(b - a <= 6 for a, b in pairwise(counts))


def test_a_step_to_something_worse_is_taken_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(homotopy, "ABOVE", -1.0)  # nothing is good enough
    steps = list(path(out_and_back(), starts=1))
    assert [step.level for step in steps] == [FIRST]


def test_sizes_do_not_matter(steps: list[Sharp]) -> None:
    """A thousandth of the way by a thousandfold mass: forces and cost are the same."""
    law = BrownMcPhee(mu_s=6.0, mu_d=4.0, mu_v=500.0, v_t=1e-8, N_t=1e-3)
    heavy = drive(law, m=1000.0, N=1.0)
    small = [
        replace(phase, model=heavy, end={name: 1e-3 * value for name, value in phase.end.items()})
        for phase in out_and_back().chain
    ]
    problem = replace(out_and_back(), phases=small[0] >> small[1])
    first = next(path(problem, starts=2))
    assert first.scales["guide"].speed == pytest.approx(1e-3 * steps[0].scales["guide"].speed, 0.1)
    assert first.solution.cost == pytest.approx(steps[0].solution.cost, 0.02)


def test_users_widths_are_the_smallest() -> None:
    wide, sharp = out_and_back(v_t=0.5), out_and_back(v_t=1e-5)
    assert widths_at(wide, SCALES, 0.1) == {"guide_v_t": 0.5}
    assert widths_at(sharp, SCALES, 0.1) == {"guide_v_t": pytest.approx(0.2)}
    assert own_level(wide, SCALES) == 0.25
    assert own_level(sharp, SCALES) == pytest.approx(5e-6)


@pytest.mark.parametrize("law", [ExactCoulomb(mu_s=6.0, mu_d=4.0), LuGre(mu_s=6.0, mu_d=4.0)])
def test_laws_that_do_not_smooth_have_a_stand_in(law: object) -> None:
    move = Phase(drive(law, m=1.0, N=1.0), 1.0, end={"x": 1.0, "v": 0.0})
    problem = Problem(move, integral(lambda s: s.force**2))
    assert has_jumps(problem)
    assert own_level(problem, SCALES) == 0.0
    model = smoothed(problem).chain[0].model
    assert [v.name for v in model.x] == ["x", "v"]
    assert widths_at(problem, SCALES, 0.1) == {"guide_width": pytest.approx(0.2)}


def test_without_contacts_there_is_nothing_to_sharpen() -> None:
    assert not has_jumps(unit_move())
    assert has_jumps(parcel_on_tray())


def test_speeds_are_alike_within_a_factor() -> None:
    assert same_size(SCALES, {"guide": Scale(5.0)}, 3.0)
    assert not same_size(SCALES, {"guide": Scale(7.0)}, 3.0)
