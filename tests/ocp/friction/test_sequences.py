"""Sequences of modes: read, cut, pruned, edited, solved and repaired; starts around a motion."""

from dataclasses import replace
from functools import cache

import casadi as ca
import numpy as np
import pytest
from phases import on, solve_once

from ocp import Phase, integral, solve
from ocp.formulation.problem import Problem
from ocp.friction import sequence
from ocp.friction.arc_solution import ModeSolver, SolvedSequence
from ocp.friction.arcs import STOPPED, Rules, in_arcs
from ocp.friction.mode_optimisation import KICK, SHORTEST, better, settled
from ocp.friction.sequence import Leg, ModeInterval, Track
from ocp.friction.smooth_models import smoothed, widths
from ocp.friction.transfer import Known, Reader
from ocp.problems import cart_pendulum, goddard, load_through_spring, out_and_back
from ocp.solving.methods import Ipopt
from ocp.solving.one_solve import Task, starts_around
from ocp.solving.starts import initial_points
from symfric import BrownMcPhee, Contact, Model, Variable


def there_and_back() -> Track:
    t = np.linspace(0.0, 2.0, 201)
    return sequence.read("guide", t, np.sin(np.pi * t), creep=0.05, shortest=0.05)


def one(*runs: tuple[int, float, float]) -> tuple[Leg]:
    """One leg of 1 s of the contact "guide"."""
    return (
        sequence.cut(
            [Track("guide", tuple(ModeInterval(*run) for run in runs))], (0, 0), 0.0, runs[-1][2]
        ),
    )


SPRING = Rules(load_through_spring(), {"load": 6.0}, (), 1e-4)


def two(*runs: tuple[int, float, float], contact: str = "guide") -> tuple[Leg, Leg]:
    """Two legs of 1 s of a contact."""
    track = Track(contact, tuple(ModeInterval(*run) for run in runs))
    return sequence.cut([track], (0, 0), 0.0, 1.0), sequence.cut([track], (1, 0), 1.0, 2.0)


def test_runs_are_read_without_gaps() -> None:
    track = there_and_back()  # rests of 0.03 s at 0, 1 and 2 s are too short
    assert [run.mode for run in track.runs] == [1, -1]
    assert track.runs[0].begin == 0.0
    assert track.runs[0].end == track.runs[1].begin == pytest.approx(1.0)
    assert track.runs[1].end == 2.0
    t = np.linspace(0.0, 3.0, 301)
    slip = np.where(t < 1, 1.0, np.where(t < 2, 1e-3, -1.0))
    assert [run.mode for run in sequence.read("guide", t, slip, 0.01, 0.05).runs] == [1, 0, -1]


def test_rests_are_inserted_at_reversals_and_ends_that_can_hold() -> None:
    track = sequence.with_rests(there_and_back(), lambda t: True, 0.02)
    assert [run.mode for run in track.runs] == [0, 1, 0, -1, 0]
    for before, after in zip(track.runs[:-1], track.runs[1:], strict=True):
        assert before.end == after.begin
    held = sequence.with_rests(there_and_back(), lambda t: t > 1.5, 0.02, (True, True))
    assert [run.mode for run in held.runs] == [1, -1, 0]
    moving = sequence.with_rests(there_and_back(), lambda t: True, 0.02, (False, False))
    assert [run.mode for run in moving.runs] == [1, 0, -1]


def test_legs_are_cut_where_any_contact_changes() -> None:
    first = Track("one", (ModeInterval(1, 0.0, 1.2), ModeInterval(-1, 1.2, 2.0)))
    second = Track("two", (ModeInterval(0, 0.0, 0.5), ModeInterval(1, 0.5, 2.0)))
    legs = tuple(sequence.cut([first, second], (k, 0), k, k + 1.0) for k in range(2))
    assert sequence.shown(legs) == "(+0)(++) | (++)(-+)"
    assert [arc.duration for arc in sequence.flat(legs)] == pytest.approx([0.5, 0.5, 0.2, 0.8])
    assert sequence.tracks_of(legs) == {"one": [*first.runs], "two": [*second.runs]}


def test_vanished_arcs_are_pruned_and_modes_inserted() -> None:
    legs = sequence.placed(one((1, 0, 0.6), (0, 0.6, 0.7), (1, 0.7, 1)), [0.69, 1e-5, 0.31 - 1e-5])
    (left,) = sequence.pruned(legs, 1e-4)
    assert sequence.shown([left]) == "+"
    assert (left.arcs[0].begin, left.arcs[0].end) == (0.0, pytest.approx(1.0))
    longest = sequence.pruned(one((1, 0.0, 4e-5), (0, 4e-5, 1e-4)), 1e-3)
    assert sequence.shown(longest) == "0"
    assert sequence.shown(sequence.inserted(one((1, 0, 1)), 0, "guide", 0, 0.4, 0.5)) == "+0+"
    assert sequence.shown(sequence.inserted(one((1, 0, 1)), 0, "guide", 0, 0.4, 1.0)) == "+0"


@pytest.mark.parametrize("margin", [1e-2, 1e-4])
def test_rests_keep_their_margin(margin: float) -> None:
    rules = Rules(out_and_back(), {"guide": 1.0}, ("guide",), 1e-4, margin)
    rest, slip, _ = in_arcs(rules, two((0, 0, 0.1), (1, 0.1, 1), (-1, 1, 2))).chain
    assert rest.bounds["guide_up"] == (margin, None)
    assert rest.start["guide_first_down"] == (margin, None)
    assert slip.start["guide_pull"] == (margin, None)


@pytest.mark.parametrize(
    ("side", "stretch", "left"),
    [(1, 0.019, 0.0), (1, 0.02, -0.2), (-1, -0.019, 0.0), (-1, 0.01, 5.8)],
)
def test_stops_keep_a_distance_from_the_sliding_force(
    side: int, stretch: float, left: float
) -> None:
    """200 N/m hold a load that slides against 4 N: 5 % less than that is allowed at a stop."""
    made = in_arcs(SPRING, two((side, 0, 1), (0, 1, 2), contact="load")).chain[1].model
    symbols = [made.vector(letter) for letter in "xzup"]
    room = ca.Function("room", symbols, [made.expression(f"load{STOPPED}")])
    p = made.values("p", {})
    assert float(room([stretch, 0, 0, 0], 0, 0, p)) * 6.0 == pytest.approx(left, abs=1e-5)


@pytest.mark.parametrize(("left", "margin"), [(1.0, 0.01), (0.002, 0.01 * np.tanh(1.0)), (0, 0)])
def test_margin_fades_before_break_away(left: float, margin: float) -> None:
    made = in_arcs(SPRING, two((0, 0, 0.5), (1, 0.5, 2), contact="load")).chain[0].model
    symbols = [made.vector(letter) for letter in "xzup"]
    up, down = (ca.Function("f", symbols, [made.expression(f"load_{n}")]) for n in ("up", "down"))
    at = [0, 0, 0, 0, left], 0, 0, made.values("p", {})
    assert (float(up(*at)), float(down(*at))) == pytest.approx((1.0 - margin, 1.0), abs=1e-9)


# --- solved sequences ---------------------------------------------------------------------------


@cache
def known() -> Known:
    """Out and back with friction smoothed over 0.05 m/s."""
    p = {w.parameter: w.at(0.05) for w in widths(out_and_back().chain[0].model)}
    smooth = solve_once(replace(smoothed(out_and_back()), p=p), 25)
    return Known.of(out_and_back(), smooth.motions[0], {})


def test_rests_are_inserted_in_phases_whose_inputs_can_hold() -> None:
    """Inputs above the 6 N of friction cannot hold the load."""
    out, back = out_and_back().chain
    pushed = [replace(phase, bounds={"force": (10.0, 20.0)}) for phase in (out, back)]
    for phases, expected in (
        (out >> back, "0+0- | -0"),
        (pushed[0] >> back, "+- | -0"),
        (out >> pushed[1], "0+0- | -"),
    ):
        reader = Reader(replace(out_and_back(), phases=phases), known())
        assert sequence.shown(reader.sequence({"guide": 0.05})) == expected


def modes_solver() -> ModeSolver:
    problem = out_and_back()
    rules = Rules(problem, Reader(problem, known()).sizes(), ("guide",), SHORTEST * 2)
    return ModeSolver(rules, Task(problem, solver=Ipopt(max_iter=100)), KICK * 2)


def found_for(legs: tuple[Leg, ...]) -> SolvedSequence:
    first = modes_solver().solve(legs, known(), 30, 1e-2)
    assert first.ok
    return settled(modes_solver(), first)


def test_crossing_of_zero_is_a_reversal_and_a_dwell_is_stick() -> None:
    """With constant acceleration a the speed is below the creep for 2 creep / a at a reversal."""
    t = np.linspace(0.0, 1.0, 91)
    crossing = sequence.read("guide", t, t - 0.5, creep=0.1, shortest=0.01)
    assert [run.mode for run in crossing.runs] == [-1, 1]
    assert crossing.runs[0].end == pytest.approx(0.5, abs=0.02)
    slip = np.sign(t - 0.5) * np.maximum(np.abs(t - 0.5) - 0.1, 0.0)
    dwell = sequence.read("guide", t, slip, creep=0.1, shortest=0.01)
    assert [run.mode for run in dwell.runs] == [-1, 0, 1]


@pytest.mark.parametrize(
    "runs",
    [
        [(0, 0, 0.1), (1, 0.1, 0.9), (0, 0.9, 1.1), (-1, 1.1, 1.9), (0, 1.9, 2)],
        pytest.param([(1, 0, 0.9), (-1, 0.9, 2)], marks=pytest.mark.slow),
        pytest.param([(1, 0, 0.95), (-1, 0.95, 1.8), (1, 1.8, 2)], marks=pytest.mark.slow),
    ],
)
def test_superfluous_arcs_shrink_and_are_pruned(runs: list[tuple[int, float, float]]) -> None:
    found = found_for(two(*runs))
    assert sequence.shown(found.legs) == "+ | -"
    assert found.ideal_cost == pytest.approx(64.59984, rel=1e-3)


def test_neighbouring_sequences_are_tried_and_the_better_one_is_kept() -> None:
    """Reversing before or after the prescribed instant costs more; breaking away takes 6 N."""
    legs = two((1, 0, 1), (-1, 1, 2))
    assert [sequence.shown(other) for other in sequence.neighbours(legs, 0.01)] == [
        "+- | -",
        "+ | +-",
    ]
    found = found_for(legs)
    kept = better(modes_solver(), found, 0.01)
    assert sequence.shown(kept.legs) == "+ | -"
    assert kept.outcome.cost <= found.outcome.cost
    forces = [points.u[0, 0] for points in found.points.spans]
    assert forces[0] >= 6.0 * 1.009
    assert forces[1] <= -6.0 * 1.009
    assert np.isfinite(found.loss)


# --- starts around a motion ---------------------------------------------------------------------


def test_other_starts_differ_and_rates_belong_to_positions() -> None:
    into = on(cart_pendulum(), 200)
    begin = initial_points(into)
    first, second, third = starts_around(into, begin, range(3), 0.5)
    assert first is begin
    assert np.abs(second.spans[0].inner - third.spans[0].inner).max() > 0.1
    again = starts_around(into, begin, [1], 0.5)[0].spans[0]
    assert np.array_equal(again.u, second.spans[0].u)
    t = 2.0 * into.meshes[0]
    for position, rate in zip(again.nodes[:2], again.nodes[2:], strict=True):
        assert rate[5:-5] == pytest.approx(np.gradient(position, t)[5:-5], abs=1e-3)


def test_random_starts_stay_within_the_bounds_of_states() -> None:
    """Below the ground the density of the air, exp(500 (1 - h)), reaches 1e52."""
    into = on(goddard(), 20)
    for start in starts_around(into, initial_points(into), range(1, 6)):
        for rows in (start.spans[0].nodes, start.spans[0].inner):
            assert rows[0].min() >= 1.0 and rows[2].min() >= 0.6 and rows[2].max() <= 1.0


def test_ends_stay_phases_join_and_resting_states_take_the_size_of_their_unit() -> None:
    into = on(load_through_spring(), 20)
    begin = initial_points(into)
    starts = starts_around(into, begin, range(1, 20), 0.5)
    before, after = (span.nodes[:2] for span in starts[2].spans)
    assert before[:, 0] == pytest.approx(begin.spans[0].nodes[:2, 0])
    assert after[:, -1] == pytest.approx(begin.spans[1].nodes[:2, -1])
    assert before[:, -1] == pytest.approx(after[:, 0])
    assert np.ptp(begin.spans[0].nodes[0]) == 0.0
    ways = [np.ptp(np.hstack([s.nodes for s in points.spans])[:2], axis=1) for points in starts]
    typical = np.median(ways, axis=0)
    assert typical[0] == pytest.approx(typical[1], rel=0.9)


@pytest.mark.slow
def test_stick_of_a_periodic_motion_starts_without_slip() -> None:
    """A part on a shaken tray: without the condition, it would stick at any sliding velocity."""
    x, v, q, w = (Variable(n, u) for n, u in (("x", "m"), ("v", "m/s"), ("q", "m"), ("w", "m/s")))
    a = Variable("a", "m/s^2", nominal=5.0)
    tray = Contact("tray", v - w, 9.81, BrownMcPhee(mu_s=0.4, mu_d=0.3, v_t=1e-4))
    ode = ca.vertcat(v, -tray.force, w, a)
    model = Model("conveyor", x=(x, v, q, w), u=(a,), ode=ode, contacts=(tray,))
    cycle = Phase(model, 0.4, start={"x": 0.0, "q": 0.0}, end={"x": 0.05})
    limits = {"a": (-12.0, 12.0)}
    cost = integral(lambda s: s.a**2)
    found = solve(Problem(cycle, cost, periodic=["v", "q", "w"], bounds=limits), starts=2)
    assert found.verified
    (stick, slip) = found.modes["tray"]
    assert (stick.kind, slip.kind) == ("stick", "slip+")
    sliding = found["v"] - found["w"]
    assert np.abs(sliding[found.t < stick.end - 1e-6]).max() < 1e-6
    assert sliding[(found.t > slip.begin) & (found.t < slip.end)].min() > -1e-9
