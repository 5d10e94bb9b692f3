"""Reset integrator: peak over steady level, both forms, elastic stick."""

import casadi as ca
import numpy as np
import pytest
from rigs import prescribed_motion, through

from symfric import simulate
from symfric.laws import HaessigFriedland

N = 10.0
BACK_AND_FORTH = through([0.0, 3e-5, -3e-5], 1.0)


def test_event_form_has_the_published_peak_and_levels() -> None:
    """Limit 1e-5 m and gradient 0.3: stick up to 1.3 N, slip at 1 N, -1 N after the reversal."""
    law = HaessigFriedland(mu_s=0.13, sigma_1=0.0, form="event")
    run = simulate(prescribed_motion(law, N, BACK_AND_FORTH), 2.0, rtol=1e-9, samples=20_001)
    assert run["friction"].max() == pytest.approx(1.3, abs=2e-3)
    assert np.interp(0.9, run.t, run["friction"]) == pytest.approx(1.0, rel=1e-9)
    assert run["friction"][-2] == pytest.approx(-1.0, rel=1e-9)
    assert [name for _, name in run.happened][:3] == ["slip_begins", "reversal", "slip_begins"]


def test_smooth_form_tends_to_the_event_form() -> None:
    points = np.linspace(0.0, 2.0, 2001)
    exact = HaessigFriedland(sigma_1=0.0, form="event")
    model = prescribed_motion(exact, N, BACK_AND_FORTH)
    expected = simulate(model, 2.0, t_eval=points, rtol=1e-9)["friction"]
    errors = []
    for n, knee in ((20.0, 0.1), (100.0, 0.02), (500.0, 0.004)):
        law = HaessigFriedland(sigma_1=0.0, n=n, knee=knee)
        model = prescribed_motion(law, N, BACK_AND_FORTH)
        found = simulate(model, 2.0, t_eval=points, rtol=1e-9)["friction"]
        errors.append(np.abs(found - expected).mean())
    assert errors[0] > 2 * errors[1] > 4 * errors[2]


@pytest.mark.parametrize("form", ["smooth", "event"])
@pytest.mark.parametrize("v", [1e-4, -1e-4])
def test_long_sliding_ends_at_the_dynamic_level(form: str, v: float) -> None:
    law = HaessigFriedland(form=form)
    run = simulate(prescribed_motion(law, N, lambda t: ca.SX(v)), 1.0, rtol=1e-9)
    assert run.final["friction"] == pytest.approx(np.sign(v) * 1.0, rel=1e-6)


def test_stick_is_a_spring_with_the_stiction_gradient_and_damping() -> None:
    law = HaessigFriedland()
    assert law.force(0.0, N, np.array([2e-6])) == pytest.approx(1.5 * 0.2)
    assert law.force(1e-4, N, np.array([0.0])) == pytest.approx(0.019)
