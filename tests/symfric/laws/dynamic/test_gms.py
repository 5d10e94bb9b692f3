"""GMS friction: event form against latched form, steady state, memory, lag, limits."""

import casadi as ca
import numpy as np
import pytest
from oracles import stribeck_curve
from rigs import prescribed_motion, through

from symfric import Trajectory, simulate
from symfric.laws import GMS, Element, Leuven, MaxwellSlip, Slider, Viscous

YIELDS = [0.2e-6, 0.5e-6, 1.0e-6, 1.6e-6]
POINTS = [0.0, 1.5e-6, 0.5e-6, 1.0e-6, 0.5e-6, -0.2e-6]
TURN = 2 * np.pi


def published(form: str = "smooth", **more: float) -> GMS:
    """Levels and lag of the published comparison, four elements of equal share."""
    elements = tuple(Element(0.25 * 1.05 / x, 0.25) for x in YIELDS)
    numbers = {"mu_s": 1.05, "mu_d": 0.2, "v_s": 98e-6, "delta": 0.78} | more
    return GMS(elements, form=form, **numbers)


def both(velocity, t_end: float) -> tuple[Trajectory, Trajectory]:
    t = np.linspace(0.0, t_end, 20_001)
    event, smooth = (
        simulate(prescribed_motion(published(form), 1.0, velocity), t_end, t_eval=t, rtol=1e-8)
        for form in ("event", "smooth")
    )
    return event, smooth


def rms_after(start: float, pair: tuple[Trajectory, Trajectory]) -> float:
    event, smooth = pair
    late = event.t >= start
    return float(np.sqrt(np.mean((event["friction"] - smooth["friction"])[late] ** 2)))


@pytest.mark.parametrize("f", [2, 5, 10])
def test_forms_agree_in_unidirectional_sliding(f: int) -> None:
    pair = both(lambda t: 250e-6 + 200e-6 * ca.sin(TURN * f * t), 3 / f)
    assert rms_after(2 / f, pair) < 5e-5


@pytest.mark.parametrize(("f", "rms"), [(2, 0.005), (10, 0.018)])
def test_forms_agree_through_reversals(f: int, rms: float) -> None:
    pair = both(lambda t: 400e-6 * ca.sin(TURN * f * t), 3 / f)
    assert rms_after(1 / f, pair) < rms
    assert np.ptp(pair[0]["friction"]) > 0.8


@pytest.mark.parametrize("leg", [1.6, 0.32, 0.08])
def test_forms_agree_in_pre_sliding(leg: float) -> None:
    assert rms_after(0.0, both(through(POINTS, leg), 5 * leg)) < 0.007


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


@pytest.mark.parametrize("form", ["smooth", "event"])
@pytest.mark.parametrize("v", [5e-6, -5e-6, 2e-4, -2e-4])
def test_long_sliding_ends_on_the_stribeck_curve(form: str, v: float) -> None:
    law = published(form, sigma_2=100.0)
    run = simulate(prescribed_motion(law, 1.0, lambda t: ca.SX(v)), 3.0, rtol=1e-9)
    expected = stribeck_curve(v, 1.0, 1.05, 0.2, 98e-6, 0.78, 100.0)
    assert run.final["friction"] == pytest.approx(expected, rel=2e-4)


@pytest.mark.parametrize(("f", "rising", "falling"), [(2, 0.479, 0.368), (10, 0.487, 0.304)])
@pytest.mark.parametrize("form", ["smooth", "event"])
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


@pytest.mark.parametrize("form", ["smooth", "event"])
def test_stop_from_sliding_keeps_the_force(form: str) -> None:
    law = published(form)
    z = law.steady_state(2e-4, 1.0)
    assert np.abs(law.rate(0.0, 1.0, z)[:4]).max() == 0.0


@pytest.mark.parametrize("form", ["smooth", "event"])
@pytest.mark.parametrize("amplitude", [1e-6, 3e-5])
def test_settled_cycle_dissipates(form: str, amplitude: float) -> None:
    law = published(form)
    velocity = through([0.0, *3 * [amplitude, -amplitude], amplitude], 0.25)
    run = simulate(prescribed_motion(law, 1.0, velocity), 1.75, t_eval=[1.25, 1.75], rtol=1e-9)
    work = run["work"][1] - run["work"][0]
    stored = sum((run[f"F_{i + 1}"] ** 2 * x / 0.525)[1] for i, x in enumerate(YIELDS))
    before = sum((run[f"F_{i + 1}"] ** 2 * x / 0.525)[0] for i, x in enumerate(YIELDS))
    assert stored == pytest.approx(before, rel=1e-2)
    assert work > 10 * abs(stored - before)


def test_shares_are_divided_by_their_sum() -> None:
    one, other = (
        GMS((Element(1e5, 1.0), Element(2e4, 3.0))),
        GMS((Element(1e5, 0.25), Element(2e4, 0.75))),
    )
    assert one.steady_state(0.1, 8.0) == pytest.approx(other.steady_state(0.1, 8.0))


def test_laws_of_elements_want_some_of_their_kind() -> None:
    """`GMS(elements=())` failed only when it was run."""
    for kind, one in ((GMS, "Element"), (MaxwellSlip, "Slider"), (Leuven, "Slider")):
        for elements in ((), [], (1.0,), Viscous(), None, (Viscous(),)):
            with pytest.raises(
                ValueError, match=rf"{kind.__name__}: elements: .*such as {one}\(\)"
            ):
                kind(elements=elements)  # type: ignore[arg-type]
    assert GMS(elements=[Element()]).elements[0].k == 1e5  # type: ignore[arg-type]
