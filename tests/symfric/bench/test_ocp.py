"""The referee of optimal control agrees with closed forms and with the engine; rows."""

import math
from dataclasses import replace
from math import inf, isnan

import casadi as ca
import numpy as np
import pytest

from ocp.friction.event_check import set_valued
from symfric.bench import ocp
from symfric.bench.ocp import attempted, contenders
from symfric.bench.ocp_cases import CASES, MoveCase
from symfric.bench.ocp_contenders import Attempt, opti
from symfric.bench.ocp_referee import judged
from symfric.integrator import Hold

KNOWN = {case.name: case for case in CASES}
BLOCK = KNOWN["pushed_block"]
"""1 kg with dry friction of 5.886 N, 10 m out and back in 4 s."""


def even(case: MoveCase, count: int) -> np.ndarray:
    return np.linspace(0.0, case.T, count + 1)


def test_a_force_below_break_away_costs_and_moves_nothing() -> None:
    cost, miss = judged(BLOCK, even(BLOCK, 4), np.full(4, 5.0))
    assert cost == pytest.approx(4 * 25.0)
    assert miss == pytest.approx(1.0)


def test_a_push_slides_sticks_and_returns_as_in_closed_form() -> None:
    """A push of 1 s, then rest: s = v^2 / 2 (1 / a + 1 / F) with v = a 1 s, the same way back."""
    F, u = 5.886, 12.0
    a = u - F
    there = 0.5 * a**2 * (1 / a + 1 / F)
    case = replace(BLOCK, ends={0.5: {0: there, 1: 0.0}, 1.0: {0: 0.0, 1: 0.0}}, T=6.0)
    edges = np.array([0.0, 1.0, 3.0, 4.0, 6.0])
    cost, miss = judged(case, edges, np.array([u, 0.0, -u, 0.0]))
    assert cost == pytest.approx(2 * u**2)
    assert miss < 1e-9
    off = judged(replace(case, ends={1.0: {0: -there}}), edges, np.array([u, 0.0, -u, 0.0]))
    assert off.miss == pytest.approx(1.0)


def test_a_spring_with_friction_loses_the_same_stroke_each_half_period() -> None:
    """x_n = (-1)^n (x_0 - 2 n F / k), and rest once |x_n| <= F / k."""

    def rate(m: object, x: list[float], u: float, F: list[float]) -> list[float]:
        return [x[1], u - F[0] - 400.0 * x[0]]

    case = replace(
        BLOCK, rate=rate, levels=((50.0, 50.0),), start=(1.1, 0.0), ends={1.0: {0: 1.2, 1: 0.0}}
    )
    miss = judged(case, even(case, 3), np.zeros(3)).miss
    assert miss * 1.2 == pytest.approx(1.2 - (1.1 - 4 * 0.25), rel=1e-6)


def test_a_slip_that_touches_zero_for_less_than_a_step_ends() -> None:
    """v = (t - 1)^2 - 1e-9 in slip is negative for 60 us; at rest 4 + 2 (t - 1) is held."""

    def rate(m: object, x: list[float], u: float, F: list[float]) -> list[float]:
        return [x[1], 4.0 + 2.0 * (x[2] - 1.0) - F[0], 1.0]

    case = replace(
        BLOCK, states=("x", "v", "t"), rate=rate, levels=((6.0, 4.0),), T=1.9,
        start=(0.0, 1.0 - 1e-9, 0.0), ends={1.0: {0: 1.0 / 3.0, 1: 0.0}},
    )  # fmt: skip
    assert judged(case, even(case, 1), np.zeros(1)).miss < 1e-8


def test_bounds_are_part_of_the_miss_and_controls_are_clipped() -> None:
    case = replace(BLOCK, ends={1.0: {}}, bounds={0: (-inf, 1.0)}, limit=12.0)
    a, t = 12.0 - 5.886, 4.0
    x = 0.5 * a * t**2
    assert judged(case, even(case, 8), np.full(8, 50.0)).miss == pytest.approx((x - 1.0) / x)


def test_friction_above_the_level_of_sliding_holds() -> None:
    """5 N is above sliding (4 N) and below static friction (6 N) of the guide."""
    case = replace(KNOWN["out_and_back"], ends={1.0: {0: 1.0}})
    assert judged(case, even(case, 2), np.array([5.0, 5.0])).miss == pytest.approx(1.0)
    moved = judged(case, even(case, 100), np.array([6.1] + [5.0] * 99)).miss
    assert 0.0 < moved < 0.9


@pytest.mark.parametrize("name", [*KNOWN])
def test_formulas_by_hand_are_those_of_the_model(name: str) -> None:
    case, width = KNOWN[name], 0.1
    span = case.problem(width).spans[0]
    rate = ca.Function("rate", span.symbols, [span.model.function("ode")(*span.symbols)])
    random = np.random.default_rng(1)
    for _ in range(5):
        x = random.uniform(-0.7, 0.7, len(case.states))
        u = float(random.uniform(0.0, case.limit))
        expected = rate(0.0, x, [], u, span.p).full().ravel()
        found = case.smooth(math, x.tolist(), u, width)
        assert found == pytest.approx(expected.tolist(), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize(
    ("name", "mean", "range"),
    [
        ("voice_coil", 0.0, 5.0),
        pytest.param("three_blocks", 0.0, 4.0, marks=pytest.mark.slow),
        pytest.param("two_blocks", 0.0, 16.0, marks=pytest.mark.slow),
        ("parcel_on_tray", 2.9, 0.5),
    ],
)
def test_the_referee_agrees_with_the_engine(name: str, mean: float, range: float) -> None:
    """Both simulate a random control with exact friction; the miss is that of the last state."""
    case = KNOWN[name]
    edges = even(case, 10)
    controls = mean + range * np.random.default_rng(3).uniform(-1, 1, 10)
    model = case.problem().spans[0].model
    (u,) = (v.name for v in model.u)
    run = set_valued(
        model, case.T, t_start=0.0, u={u: Hold(edges[:-1], controls)}, rtol=1e-10,
        x0=dict(zip(case.states, case.start, strict=True)),
    )  # fmt: skip
    last = [float(run[n][-1]) for n in case.states]
    shifted = {i: value + 1e3 for i, value in enumerate(last)}
    for i, value in enumerate(last):
        alone = replace(case, ends={1.0: {i: shifted[i]}}, bounds={})
        miss = judged(alone, edges, controls).miss * max(1.0, shifted[i])
        assert shifted[i] - miss == pytest.approx(value, abs=1e-6)


def test_absent_and_failing_tools_are_rows() -> None:
    def absent(case: MoveCase, limit: float) -> Attempt:
        raise ModuleNotFoundError("No module named 'nosnoc'", name="nosnoc")

    def fails(case: MoveCase, limit: float) -> Attempt:
        raise RuntimeError("no  such\nthing")

    def stopped(case: MoveCase, limit: float) -> Attempt:
        return Attempt(0.0, "User_Requested_Stop", even(case, 1), np.zeros(1))

    assert attempted(absent, BLOCK, 1.0)[0] == "not installed: nosnoc"
    found, seconds = attempted(fails, BLOCK, 1.0)
    row = ocp.row_of(BLOCK, "other", found, seconds)
    assert row["status"] == "runtimeerror: no such thing"
    assert isnan(row[ocp.COST]) and isnan(row[ocp.MISS])
    with pytest.raises(KeyboardInterrupt):
        attempted(stopped, BLOCK, 1.0)


def test_rows_come_one_by_one_and_stay_after_an_interrupt(monkeypatch: pytest.MonkeyPatch) -> None:
    def still(case: MoveCase, limit: float) -> Attempt:
        return Attempt(7.0, "Solve_Succeeded", even(case, 2), np.zeros(2))

    def interrupted(case: MoveCase, limit: float) -> Attempt:
        raise KeyboardInterrupt

    monkeypatch.setattr(ocp, "contenders", lambda quick: {"a": still, "b": interrupted, "c": still})
    told: list[str] = []
    monkeypatch.setattr(ocp, "QUICK", ("pushed_block",))
    made = ocp.bench(True, lambda item, fraction, row: told.append(row))
    (row,) = made.tables[ocp.TITLE]
    assert (row["contender"], row["claimed cost"], row[ocp.COST]) == ("a", 7.0, 0.0)
    assert made.interrupted
    assert [text for text in told if text] == [
        f"pushed_block  a  {row[ocp.TIME]:.3g}  0  1  7  2  solve succeeded"
    ]


def test_quick_has_fewer_contenders() -> None:
    assert {*contenders(True)} < {*contenders(False)}


@pytest.mark.slow
def test_opti_solves_the_smooth_problem_and_misses_with_dry_friction() -> None:
    """Without friction, 10 m from rest to rest cost 12 (10 m)^2 / T^3."""
    found = opti(replace(BLOCK, ends={1.0: {0: 10.0, 1: 0.0}}), 10.0, width=0.01)
    assert found.status == "Solve_Succeeded"
    free = 12 * 10.0**2 / BLOCK.T**3
    assert free < found.claimed < free + BLOCK.T * 5.886**2
    assert judged(BLOCK, found.edges, found.controls).miss > 1e-4
