"""Maxwell-slip friction: virgin curve, Masing, return points, wiping out, loop work."""

from itertools import pairwise

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs import prescribed_motion, through

from symfric import Trajectory, parameters, simulate
from symfric.laws import MaxwellSlip, Slider

N = 10.0
STIFFNESS, LIMITS = [5e4, 2.5e4, 1.5e4, 1e4], [0.25] * 4
LAW = MaxwellSlip(n=100.0)
EXACT = MaxwellSlip(form="event")


def virgin(x: float) -> float:
    return sum(min(k * x, w) for k, w in zip(STIFFNESS, LIMITS, strict=True))


def forces(points: list[float]) -> list[float]:
    """Friction at each point of a motion that starts at zero, by exact updates."""
    F, found = np.zeros(4), [0.0]
    for a, b in pairwise(points):
        F = EXACT.update(F, b - a, N)
        found.append(float(np.sum(F)))
    return found


def moved(law: MaxwellSlip, points: list[float], speed: float = 1.0) -> Trajectory:
    velocity = through(points, 1.0 / speed)
    model = prescribed_motion(law, N, velocity)
    return simulate(model, (len(points) - 1) / speed, rtol=1e-10, samples=len(points) * 200 - 199)


def at_points(run: Trajectory, points: list[float]) -> np.ndarray:
    return np.interp(np.arange(len(points)) * run.t[-1] / (len(points) - 1), run.t, run["friction"])


@given(x=st.floats(0.0, 1e-4))
def test_virgin_curve_is_the_sum_of_springs_with_limits(x: float) -> None:
    assert forces([0.0, x])[-1] == pytest.approx(virgin(x), rel=1e-12, abs=1e-15)


@given(x=st.floats(1e-7, 1e-4), back=st.floats(0.0, 1.0))
def test_reversal_branch_is_twice_the_virgin_curve(x: float, back: float) -> None:
    turn, end = forces([0.0, x, x - 2 * x * back])[1:]
    assert end == pytest.approx(turn - 2 * virgin(x * back), abs=1e-12)


@given(
    outer=st.floats(1e-6, 5e-5),
    loops=st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)), max_size=5),
)
def test_closed_inner_loops_are_forgotten(outer: float, loops: list[tuple[float, float]]) -> None:
    """Wiping out: the force at the outer turning point and beyond does not know of them."""
    low, points = -outer, [0.0, outer, -outer]
    for a, b in loops:
        top = low + 2 * outer * max(a, b)
        points += [top, low + (top - low) * min(a, b), top, low]
    points += [1.3 * outer]
    assert forces(points)[-1] == pytest.approx(forces([0.0, outer, -outer, 1.3 * outer])[-1])


@given(span=st.floats(1e-7, 4e-5), starts=st.tuples(*2 * [st.floats(0.0, 1.0)]))
def test_loops_over_the_same_span_are_congruent(span: float, starts: tuple[float, float]) -> None:
    """Wherever the loop lies and whatever came before it, its height is the same."""
    heights = []
    for start in starts:
        x = 1e-4 * start
        one, other = forces([0.0, 1e-4, x, x + span, x, x + span])[-2:]
        heights.append(other - one)
    assert heights[0] == pytest.approx(heights[1], abs=1e-12)


def test_event_form_follows_the_exact_updates() -> None:
    points = [0.0, 3e-5, -1e-5, 1e-5, -1e-5, 2.5e-5, -3e-5]
    assert at_points(moved(EXACT, points), points) == pytest.approx(forces(points), abs=1e-7)


def test_smooth_form_tends_to_the_exact_one_with_the_sharpness() -> None:
    points = [0.0, 3e-5, -1e-5, 1e-5, -1e-5, 2.5e-5, -3e-5]
    exact = np.array(forces(points))
    errors = [
        np.abs(at_points(moved(MaxwellSlip(n=n), points), points) - exact).max()
        for n in (10.0, 100.0, 1000.0)
    ]
    assert errors[0] > 5 * errors[1] > 25 * errors[2]
    assert errors[2] < 1e-3


@pytest.mark.parametrize(("n", "share"), [(1.0, 0.632), (2.0, 0.762), (10.0, 0.937), (50.0, 0.986)])
def test_sharpness_has_the_stated_shares_at_the_corner(n: float, share: float) -> None:
    law = MaxwellSlip((Slider(1e5, 0.1),), n=n)
    run = simulate(prescribed_motion(law, N, lambda t: ca.SX(1e-5)), 1.0, rtol=1e-9)
    assert run.final["friction"] == pytest.approx(share, abs=5.1e-4)


@pytest.mark.parametrize("speed", [5.0, 20.0])
@pytest.mark.parametrize("law", [LAW, EXACT])
def test_force_depends_on_the_path_alone(law: MaxwellSlip, speed: float) -> None:
    points = [0.0, 3e-5, -1e-5, 1e-5, -1e-5, 2.5e-5]
    slow, fast = (at_points(moved(law, points, s), points) for s in (1.0, speed))
    assert fast == pytest.approx(slow, abs=1e-6)


def test_loop_takes_the_closed_form_work() -> None:
    A = 4e-5
    points = [0.0, A, -A, A, -A, A]
    run = moved(EXACT, points)
    work = np.interp([3.0, 5.0], run.t, run["work"])
    expected = 4 * sum(w * (A - w / k) for k, w in zip(STIFFNESS, LIMITS, strict=True))
    assert work[1] - work[0] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("law", [LAW, EXACT, MaxwellSlip(n=2.0)])
def test_work_is_never_less_than_what_the_springs_gain(law: MaxwellSlip) -> None:
    run = moved(law, [0.0, 3e-5, -1e-5, 1e-5, -1e-5, 2.5e-5, -3e-5])
    stored = sum(run[f"F_{i + 1}"] ** 2 / (2 * k) for i, k in enumerate(STIFFNESS))
    assert np.diff(run["work"] - stored).min() > -1e-12
    assert run.final["work"] > 5e-5


def test_one_stiff_element_is_coulomb_friction() -> None:
    law = MaxwellSlip((Slider(1e12, 0.1),))
    assert law.update(np.zeros(1), 1e-9, N)[0] == 1.0
    assert law.update(np.ones(1), -1e-9, N)[0] == -1.0


def test_elements_carry_numbered_parameters() -> None:
    names = [f"{n}_{i}" for i in range(1, 5) for n in ("k", "mu")]
    assert set(parameters(LAW)) == {*names, "n", "v_eps", "r_eps"}
    assert set(parameters(MaxwellSlip((Slider(),)))) == {"k", "mu", "n", "v_eps", "r_eps"}
    with pytest.raises(ValueError, match=r"form: expected one of smooth, event, got 'exact'"):
        MaxwellSlip(form="exact")
