"""Parallel elements: Maxwell-slip, GMS and Leuven."""

from itertools import pairwise

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import stribeck_curve
from rigs import prescribed_motion, through

from symfric import Trajectory, simulate
from symfric.laws import GMS, Element, Leuven, MaxwellSlip, Slider
from symfric.laws.composed.populations import GenericAsperity, Population, RandomBristles

N = 10.0
STIFFNESS, LIMITS = [5e4, 2.5e4, 1.5e4, 1e4], [0.25] * 4
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


def test_loop_takes_the_closed_form_work() -> None:
    A = 4e-5
    points = [0.0, A, -A, A, -A, A]
    run = moved(EXACT, points)
    work = np.interp([3.0, 5.0], run.t, run["work"])
    expected = 4 * sum(w * (A - w / k) for k, w in zip(STIFFNESS, LIMITS, strict=True))
    assert work[1] - work[0] == pytest.approx(expected, rel=1e-6)


YIELDS = [0.2e-6, 0.5e-6, 1.0e-6, 1.6e-6]
POINTS = [0.0, 1.5e-6, 0.5e-6, 1.0e-6, 0.5e-6, -0.2e-6]
TURN = 2 * np.pi


def published(form: str = "smooth", **more: float) -> GMS:
    """Levels and lag of the published comparison, four elements of equal share."""
    elements = tuple(Element(0.25 * 1.05 / x, 0.25) for x in YIELDS)
    numbers = {"mu_s": 1.05, "mu_d": 0.2, "v_s": 98e-6, "delta": 0.78} | more
    return GMS(elements, form=form, **numbers)


def test_latched_form_tends_to_the_event_form_with_its_share() -> None:
    velocity = lambda t: 400e-6 * ca.sin(TURN * 2 * t)  # noqa: E731
    t = np.linspace(0.5, 1.0, 2001)
    runs = [
        simulate(prescribed_motion(law, 1.0, velocity), 1.0, t_eval=t, rtol=1e-8)["friction"]
        for law in (published("event"), *(published(rho=r) for r in (0.1, 0.03, 0.01)))
    ]
    errors = [np.abs(run - runs[0]).max() for run in runs[1:]]
    assert errors[0] > 2 * errors[1] > 4 * errors[2]
    assert errors[2] < 3e-3


@pytest.mark.parametrize(
    ("form", "f", "rising", "falling"),
    [("smooth", 2, 0.479, 0.368), ("event", 2, 0.479, 0.368), ("event", 10, 0.487, 0.304)],
)
def test_lag_has_the_published_forces_at_150_um_per_second(
    form: str, f: int, rising: float, falling: float
) -> None:
    model = prescribed_motion(
        published(form), 1.0, lambda t: 250e-6 + 200e-6 * ca.sin(TURN * f * t)
    )
    run = simulate(model, 3 / f, rtol=1e-8, samples=6001)
    late, speeding = run.t > 2 / f, np.gradient(run["v"], run.t) > 0
    found = []
    for branch in (late & speeding, late & ~speeding):
        order = np.argsort(run["v"][branch])
        found.append(np.interp(150e-6, run["v"][branch][order], run["friction"][branch][order]))
    assert found == pytest.approx([rising, falling], abs=1.5e-3)
    static = stribeck_curve(150e-6, 1.0, 1.05, 0.2, 98e-6, 0.78)
    assert found[0] > static > found[1]


def corner_forces(law: GMS | MaxwellSlip, leg: float) -> np.ndarray:
    run = simulate(prescribed_motion(law, 1.0, through(POINTS, leg)), 5 * leg, rtol=1e-9)
    return np.interp(np.arange(6) * leg, run.t, run["friction"])


@pytest.mark.parametrize(("form", "error"), [("event", 1e-6), ("smooth", 2e-3)])
def test_closed_loop_in_pre_sliding_is_forgotten(form: str, error: float) -> None:
    """The two visits of 0.5 um have the same force; with equal levels, as g depends on v."""
    forces = corner_forces(published(form, mu_d=1.05), 1.6)
    assert forces[4] == pytest.approx(forces[2], abs=error)


def test_equal_levels_and_strong_attraction_are_maxwell_slip() -> None:
    sliders = tuple(Slider(0.25 * 1.05 / x, 0.25 * 1.05) for x in YIELDS)
    expected = corner_forces(MaxwellSlip(sliders, form="event"), 1.0)
    found = corner_forces(published("event", mu_d=1.05, C=1e6), 1.0)
    assert found == pytest.approx(expected, abs=1e-6)


def test_one_stiff_element_is_the_stribeck_curve_with_lag() -> None:
    """After a step of velocity the force follows exponentially with the time constant g/C."""
    law = GMS((Element(1e9),), mu_s=0.15, mu_d=0.1, v_s=1e-3, C=24.0, form="event")
    low, high = (stribeck_curve(v, 8.0, 0.15, 0.1, 1e-3, 2.0) for v in (2e-4, 5e-3))
    jump = lambda t: ca.if_else(t < 1.0, ca.SX(2e-4), 5e-3)  # noqa: E731
    run = simulate(prescribed_motion(law, 8.0, jump), 1.1, t_eval=[0.99, 1.0 + high / 24.0])
    assert run["friction"][0] == pytest.approx(low, rel=1e-5)
    assert run["friction"][1] == pytest.approx(high + (low - high) / np.e, rel=1e-3)


def test_shares_are_divided_by_their_sum() -> None:
    one, other = (
        GMS((Element(1e5, 1.0), Element(2e4, 3.0))),
        GMS((Element(1e5, 0.25), Element(2e4, 0.75))),
    )
    assert one.steady_state(0.1, 8.0) == pytest.approx(other.steady_state(0.1, 8.0))


SLIDERS = tuple(Slider(0.25 * 1.05 / x, 0.25 * 1.05 * 1.0001) for x in YIELDS)
LEUVEN_POINTS = [0.0, 1.0e-6, 0.4e-6, 0.8e-6, 0.4e-6, -0.2e-6]


def test_far_below_the_level_it_is_maxwell_slip() -> None:
    """Up to half the level the transition takes less than (1/2)^8/8 of the stretch."""
    strong = Leuven(SLIDERS, mu_s=1.05, mu_d=1.05, sigma_1=0.0, n=100.0, delta_l=50.0)
    points = [0.5 * x for x in LEUVEN_POINTS]
    velocity = through(points, 1.0)
    one, other = (
        simulate(prescribed_motion(law, 1.0, velocity), 5.0, rtol=1e-9)["friction"]
        for law in (strong, MaxwellSlip(SLIDERS, n=100.0))
    )
    assert one == pytest.approx(other, abs=1e-4)


def sliding(v: float, path: float = 6e-5, step: float = 5e-7) -> tuple[np.ndarray, np.ndarray]:
    x = np.arange(0.0, path, step)
    return x / v, x


def mean_force(v: float, law: GenericAsperity) -> float:
    F = law.force(*sliding(v), N)
    return float(F[-40:].mean())


def test_sliding_force_weakens_with_the_velocity_between_its_coefficients() -> None:
    forces = [mean_force(v, GenericAsperity()) for v in (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)]
    assert (np.diff(forces) < 0).all()
    assert forces[0] < 0.2 * N
    assert forces[-1] > 0.2 * 0.05 * N
    assert forces[0] > 2 * forces[-1]


def test_same_seed_gives_the_same_force_and_another_seed_another() -> None:
    motion = sliding(1e-4)
    one, again, other = (
        GenericAsperity(seed=seed, count=200).force(*motion, N) for seed in (3, 3, 4)
    )
    np.testing.assert_array_equal(one, again)
    assert np.abs(one - other).max() > 1e-3


def test_force_is_proportional_to_load_at_fixed_stretch_over_load() -> None:
    motion = sliding(1e-4)
    one = GenericAsperity(k=1e6).force(*motion, N)
    two = GenericAsperity(k=2e6).force(*motion, 2 * N)
    assert two == pytest.approx(2 * one, rel=1e-12)


def test_small_inner_loop_returns_to_the_outer_one() -> None:
    """Memory: after a small excursion the force comes back to where it was."""
    out, back = np.linspace(0.0, 2e-6, 400), np.linspace(2e-6, 1.6e-6, 80)
    x = np.concatenate([out, back, back[::-1]])
    t = np.linspace(0.0, 1.0, x.size) * 1e-3
    F = GenericAsperity(tau_c=1e-6).force(t, x, N)
    assert F[399] - F[479] > 0.05
    assert F[-1] == pytest.approx(F[399], rel=0.05)


def test_bristles_slide_at_a_mean_force_below_their_limit() -> None:
    law = RandomBristles(count=500)
    t, x = sliding(1e-4, 3e-4)
    F = law.force(t, x, N)
    assert 0.3 < F[-100:].mean() < 0.7
    assert F.max() < 1.0
    mirrored = law.force(t, -x, N)
    assert mirrored[-100:].mean() == pytest.approx(-F[-100:].mean(), rel=0.1)


def test_bristles_that_do_not_snap_are_a_spring() -> None:
    x = np.linspace(0.0, 1e-9, 11)
    F = RandomBristles().force(np.arange(11.0), x, N)
    assert F - F[0] == pytest.approx(1e5 * x, abs=1e-15)


@pytest.mark.parametrize("law", [GenericAsperity(count=50), RandomBristles()])
def test_a_long_way_is_made_in_steps(law: Population) -> None:
    one, F = law.advance(law.begin(), 7.3 * law.step, 1e-3, N)
    other = law.begin()
    for _ in range(8):
        other, G = law.advance(other, 7.3 * law.step / 8, 1e-3 / 8, N)
    np.testing.assert_allclose(one.z, other.z, rtol=1e-12, atol=1e-18)
    assert pytest.approx(G, rel=1e-12) == F


def test_one_contact_is_the_same_as_an_array_and_as_an_expression() -> None:
    law = GenericAsperity()
    z, r, dx = ca.SX.sym("z", 3), ca.SX.sym("r"), ca.SX.sym("dx")
    step = ca.Function("step", [z, r, dx], [law.contact(z, r, dx, 1e-3, N)])
    start = law.begin()
    after = law.contact(start.z, start.r, 3e-7, 1e-3, N)
    for i in (0, 17, 999):
        one = step(start.z[:, i], start.r[i], 3e-7).full().ravel()
        np.testing.assert_allclose(one, after[:, i], rtol=1e-14, atol=1e-300)


def test_a_single_old_asperity_slips_at_its_closed_form() -> None:
    """In the middle of its contact it bears pi/(2 duty) N and slips at mu_inf of that."""
    law = GenericAsperity(count=1, k=1e12, tau_c=1e-9)
    z = np.array([[0.299], [0.0], [1.0]])
    F = law.contact(z, np.zeros(1), 0.001 * law.lam, 1.0, N)[-1]
    assert F[0] == pytest.approx(0.2 * N * np.pi / 1.2, rel=1e-9)


def test_steady_force_of_stiff_old_asperities_is_that_of_coulomb() -> None:
    law = GenericAsperity(k=1e9, tau_c=1e-9)
    F = law.steady_force([-1e-3, 0.0, 1e-3], N)
    assert list(F) == pytest.approx([-0.2 * N, 0.0, 0.2 * N], rel=2e-3)


def test_rest_makes_the_next_break_away_harder() -> None:
    law, peaks = GenericAsperity(), []
    for rest in (1e-3, 0.02, 0.5):
        contacts = law.begin()
        for _ in range(60):
            contacts, _ = law.advance(contacts, law.step, law.step / 1e-2, N)
        contacts, _ = law.advance(contacts, 0.0, rest, N)
        forces = []
        for _ in range(40):
            contacts, F = law.advance(contacts, law.step / 4, law.step / 4e-2, N)
            forces.append(F)
        peaks.append(max(forces))
    assert peaks[0] < 0.8 * peaks[1] < 0.64 * peaks[2]
