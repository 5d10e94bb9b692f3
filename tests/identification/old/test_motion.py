"""Parameters come back from simulated, noisy motions, within their uncertainty."""

from typing import Any

import casadi as ca
import numpy as np
import pytest

from identification import identify_motion
from symfric import BrownMcPhee, LuGreNormalised, Model, SolveError, Status, Variable, simulate
from symfric.scenes import FourBar, Pendulum, Scene, SliderCrank

NOISE = 1e-3
LAW = BrownMcPhee(mu_s=0.3, mu_d=0.2, v_t=0.02)
CASES: dict[str, tuple[Scene, str, dict[str, float], float]] = {
    "a tree": (Pendulum(LAW), "phi", {"mu_d": 0.3}, 1.0),
    "a loop with friction from its reactions": (
        FourBar(LAW), "theta_crank", {"mu_d": 0.26, "mu_s": 0.39}, 1.0,
    ),
    "bristles in a loop": (
        SliderCrank(LuGreNormalised(mu_s=0.15, mu_d=0.12)), "crank", {"mu_d": 0.15}, 0.2,
    ),
}  # fmt: skip


def noisy(scene: Scene, signal: str, names: list[str], t_end: float) -> tuple[Model, Any, Any]:
    model, t = scene.model(free=names), np.linspace(0.0, t_end, 201)
    exact = simulate(model, t_end, t_eval=t, rtol=1e-9)[signal]
    return model, t, exact + NOISE * np.random.default_rng(0).standard_normal(t.size)


@pytest.mark.parametrize("case", CASES)
def test_friction_of_a_joint_comes_back_from_noisy_angles(case: str) -> None:
    scene, signal, guess, t_end = CASES[case]
    model, t, measured = noisy(scene, signal, list(guess), t_end)
    fit = identify_motion(model, t, {signal: measured}, p=guess)
    truth = dict(zip(guess, model.values("p"), strict=True))
    assert fit.status is Status.SOLVED
    assert fit.errors[signal] == pytest.approx(NOISE, rel=0.15)
    for name, estimate in fit.parameters.items():
        assert estimate.standard_error is not None
        assert 0 < estimate.standard_error < 0.01 * truth[name]
        assert abs(estimate.value - truth[name]) < 3 * estimate.standard_error


DECAY = Model(
    "decay",
    x=(x := Variable("x", "m", start=2.0),),
    p=(rate := Variable("rate", "1/s", start=1.0, lower=0.5), idle := Variable("idle", "1")),
    ode=-rate.symbol * x.symbol + 0 * idle.symbol,
)
T = np.linspace(0.0, 2.0, 21)


def test_decay_without_noise_is_met_to_the_tolerance() -> None:
    fit = identify_motion(DECAY, T, {"x": 2 * np.exp(-1.7 * T)}, free=["rate"])
    assert fit.parameters["rate"].value == pytest.approx(1.7, rel=1e-6)


def test_bounds_hold_and_are_said() -> None:
    fit = identify_motion(DECAY, T, {"x": 2 * np.exp(-0.3 * T)}, free=["rate"])
    assert fit.parameters["rate"].value == pytest.approx(0.5)
    assert fit.parameters["rate"].standard_error is None
    assert fit.parameters["rate"].note == "at its bound"


def test_what_has_no_influence_is_said() -> None:
    fit = identify_motion(DECAY, T, {"x": 2 * np.exp(-1.7 * T)})
    assert fit.undetermined == (("idle",),)
    assert fit.parameters["idle"].note == "without influence"
    assert fit.parameters["rate"].value == pytest.approx(1.7, rel=1e-6)


def test_a_fit_that_does_not_end_hands_over_what_it_has() -> None:
    with pytest.raises(SolveError, match="identify_motion: The maximum number of") as caught:
        identify_motion(DECAY, T, {"x": 2 * np.exp(-1.7 * T)}, free=["rate"], iterations=1)
    assert 1.0 < caught.value.partial.parameters["rate"].value < 2.0


def test_minimum_is_met_and_not_a_hundredth_of_the_cost_above_it() -> None:
    """Guards the mutant "the fit stops at 1e-2": noise, and a start far off."""
    measured = 2 * np.exp(-1.7 * T) + 0.05 * np.random.default_rng(1).standard_normal(T.size)
    fit = identify_motion(DECAY, T, {"x": measured}, free=["rate"], p={"rate": 9.0})
    rates = fit.parameters["rate"].value * (1 + np.array([-1e-4, 0.0, 1e-4]))
    costs = [np.sum((2 * np.exp(-rate * T) - measured) ** 2) for rate in rates]
    assert costs[1] < min(costs[0], costs[2])
    assert (fit.status, fit.message) == (Status.SOLVED, Status.SOLVED.value)


WALL = Model(
    "wall",
    x=(x,),
    p=(p := Variable("p", "1/s", start=1.0),),
    ode=-p.symbol * x.symbol + 1e-12 * ca.log(1.05 - p.symbol),
)


def test_an_edge_beyond_which_nothing_can_be_simulated_is_not_called_solved() -> None:
    """The data ask for p = 2; beyond 1.05 the motion is not finite."""
    with pytest.raises(SolveError, match=r"this is no minimum; .* because with p = 1\.05: sim"):
        identify_motion(WALL, T, {"x": 2 * np.exp(-2.0 * T)})
    fit = identify_motion(WALL, T, {"x": 2 * np.exp(-2.0 * T)}, throw=False)
    assert fit.status is Status.NO_DESCENT
    assert fit.parameters["p"].value == pytest.approx(1.05, rel=1e-3)


def test_scale_of_a_positive_parameter_need_not_be_known() -> None:
    """From six orders of magnitude above and three below; the other one is negative."""
    level = Variable("level", "m/s", start=-1.0)
    speed = Variable("speed", "1/s", start=1.0, lower=0.0)
    model = Model("fall", x=(x,), p=(speed, level), ode=level.symbol - speed.symbol * x.symbol)
    measured = (2 + 3 / 1.7) * np.exp(-1.7 * T) - 3 / 1.7
    for guess in (1.7e3, 1.7e-3):
        fit = identify_motion(model, T, {"x": measured}, p={"speed": guess})
        assert fit.parameters["speed"].value == pytest.approx(1.7, rel=1e-6)
        assert fit.parameters["level"].value == pytest.approx(-3.0, rel=1e-6)


def test_what_is_left_and_no_noise_is_said() -> None:
    """An exponential for a straight line; white noise is passed over."""
    t = np.linspace(0.0, 2.0, 201)
    fit = identify_motion(DECAY, t, {"x": 2 - 0.9 * t}, free=["rate"])
    assert "what is left of x is no white noise: the model does not follow it" in fit.message
    assert fit.status is Status.SOLVED


@pytest.mark.parametrize(
    ("t", "measured", "arguments", "message"),
    [
        (T, {"x": T}, {"free": ["rat"]}, "free: expected one of rate, idle, got rat; did you mean"),
        (T, {"y": T}, {}, "measured: expected one of x, got y"),
        (T, {}, {}, "expected measured signals, got none"),
        (T, {"x": T}, {"free": []}, "expected a model with free parameters, got none"),
        (T[::-1], {"x": T}, {}, r"t: expected increasing times \[s\], got"),
        (T, {"x": T[1:]}, {}, r"x: expected shape \(21,\), got \(20,\)"),
        (T, {"x": 0 * T}, {}, "x: expected a signal that changes, got a constant"),
        (T, {"x": T + np.nan}, {}, "x: expected finite numbers, got nan at 0"),
    ],
)
def test_bad_input_is_described(
    t: Any, measured: dict[str, Any], arguments: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        identify_motion(DECAY, t, measured, **arguments)
