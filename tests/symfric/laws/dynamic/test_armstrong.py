"""Armstrong's model in differential form: dwell, lag, Lorentzian limit."""

import casadi as ca
import numpy as np
import pytest
from rigs import prescribed_motion

from symfric import drive, simulate
from symfric.laws import Armstrong

N = 8.0


@pytest.mark.parametrize(("rest", "q"), [(0.05, 0.2), (0.2, 0.5), (1.0, 1 / 1.2)])
def test_dwell_follows_its_closed_form(rest: float, q: float) -> None:
    model = prescribed_motion(Armstrong(), N, lambda t: ca.SX(0.0))
    run = simulate(model, rest, x0={"q": 0.0}, rtol=1e-10, samples=2)
    assert run.final["q"] == pytest.approx(q, rel=1e-7)


@pytest.mark.parametrize("v", [2e-3, -2e-3, 0.05])
def test_long_sliding_ends_on_the_lorentzian_curve(v: float) -> None:
    law = Armstrong(sigma_2=0.4)
    run = simulate(prescribed_motion(law, N, lambda t: ca.SX(v)), 2.0, rtol=1e-9)
    expected = np.sign(v) * N * (0.1 + 0.01 / (1 + (v / 1e-3) ** 2)) + 0.4 * v
    assert run.final["friction"] == pytest.approx(expected, rel=1e-6)


def test_force_after_a_step_of_velocity_follows_the_filtered_one() -> None:
    """The lag is that of a first-order filter on the velocity in the Stribeck term."""
    law = Armstrong(mu_a=0.05, mu_inf=0.05, k_t=1e8)
    jump = lambda t: ca.if_else(t < 1.0, ca.SX(1e-3), 5e-3)  # noqa: E731
    run = simulate(prescribed_motion(law, N, jump), 1.1, rtol=1e-9, t_eval=[0.999, 1.01, 1.03])
    w = 5e-3 + (1e-3 - 5e-3) * np.exp(-np.array([0.01, 0.03]) / 0.02)
    expected = N * (0.1 + 0.05 / (1 + (w / 1e-3) ** 2))
    assert run["friction"][0] == pytest.approx(N * 0.125, rel=1e-6)
    assert run["friction"][1:] == pytest.approx(expected, rel=2e-3)


def break_away(rest: float) -> float:
    """Peak of the friction after a rest of the given duration, pulled up within 20 ms."""
    pull = {"force": lambda t: ca.fmin(ca.fmax((t - rest) / 0.02, 0), 1) * 2}
    run = simulate(drive(Armstrong(), N=N), rest + 0.05, u=pull, x0={"q": 0.0}, rtol=1e-8)
    return float(run["friction"].max())


def test_break_away_grows_with_the_rest() -> None:
    peaks = [break_away(rest) for rest in (0.02, 0.2, 2.0)]
    assert (np.diff(peaks) > 0.02).all()
    assert peaks[0] > N * 0.105
    assert peaks[-1] < N * 0.15


def test_spring_holds_below_its_level() -> None:
    pull = {"force": lambda t: ca.fmin(0.2 * t, 0.4)}
    run = simulate(drive(Armstrong(), N=N), 5.0, u=pull, rtol=1e-8)
    assert run.final["friction"] == pytest.approx(0.4, abs=5e-3)
    assert abs(run.final["x"]) < 1e-5
