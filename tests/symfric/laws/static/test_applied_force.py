"""Laws that see the applied force: they hold at rest, and break away where they say."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from symfric import Coulomb, Law, rabinowicz, simulate
from symfric.integrator import Trajectory
from symfric.laws import Awrejcewicz, Karnopp, LeineSwitch, Wojewoda
from symfric.scenes import drive

LEVELS = {"mu_s": 0.3, "mu_d": 0.2}
STICKING = [
    Karnopp(**LEVELS),
    Karnopp(**LEVELS, form="original"),
    Awrejcewicz(**LEVELS),
    Awrejcewicz(**LEVELS, form="original"),
    LeineSwitch(0.3, form="original"),
]
SMOOTH = [Karnopp(**LEVELS), Awrejcewicz(**LEVELS)]


def name(law: Law) -> str:
    return f"{type(law).__name__}-{getattr(law, 'form', '')}"


@pytest.mark.parametrize("law", STICKING, ids=name)
@given(F_e=st.floats(-1.499, 1.499))
def test_contact_at_rest_carries_the_applied_force_in_full(law: Law, F_e: float) -> None:
    assert law.force(0.0, 5.0, F_e=F_e) == F_e


@pytest.mark.parametrize("law", STICKING, ids=name)
@pytest.mark.parametrize("F_e", [1.51, -1.7, 80.0])
def test_contact_at_rest_gives_no_more_than_the_static_level(law: Law, F_e: float) -> None:
    assert law.force(0.0, 5.0, F_e=F_e) == pytest.approx(np.sign(F_e) * 1.5, rel=1e-14)


@pytest.mark.parametrize("law", STICKING, ids=name)
@pytest.mark.parametrize("F_e", [0.0, 0.7, -99.0])
def test_fast_sliding_does_not_see_the_applied_force(law: Law, F_e: float) -> None:
    assert law.force(0.3, 5.0, F_e=F_e) == law.force(0.3, 5.0)


@pytest.mark.parametrize("law", SMOOTH, ids=name)
def test_smooth_form_tends_to_the_original_away_from_the_band(law: Law) -> None:
    v = np.array([-0.1, -2e-3, 2e-3, 0.05])
    original = replace(law, form="original")
    np.testing.assert_allclose(law.force(v, 5.0, F_e=0.4), original.force(v, 5.0, F_e=0.4))


@pytest.mark.parametrize("law", SMOOTH, ids=name)
def test_inside_the_band_friction_may_drive(law: Law) -> None:
    assert law.force(2e-4, 5.0, F_e=-1.4) < 0


@pytest.mark.parametrize("law", SMOOTH, ids=name)
def test_body_at_rest_stays_below_break_away_and_leaves_above(law: Law) -> None:
    runs = [
        simulate(drive(law, m=1.0, N=5.0), 1.0, x0={"v": 0.0}, u={"force": F}) for F in (1.49, 1.55)
    ]
    assert runs[0].final["v"] == 0.0
    assert runs[1].final["v"] > 0.3


def test_moving_body_comes_to_rest_as_slowly_as_stated() -> None:
    law = Karnopp(**LEVELS)
    at = [
        simulate(drive(law, m=1.0, N=5.0), t, x0={"v": 0.1}, rtol=1e-9).final["v"]
        for t in (20.0, 80.0)
    ]
    assert at[0] / at[1] == pytest.approx(2.0, rel=0.05)


def settled(run: Trajectory, since: float) -> tuple[float, float]:
    """Period and largest position."""
    late, x = run.t > since, run["x"] - 0.5
    falling = np.flatnonzero((x[:-1] > 0) & (x[1:] <= 0) & late[1:])
    share = x[falling] / (x[falling] - x[falling + 1])
    times = run.t[falling] + share * np.diff(run.t)[falling]
    return float(np.diff(times)[-1]), float(run["x"][late].max())


@pytest.mark.parametrize(
    ("v_eps", "period", "x_max"), [(1e-3, 11.298, 1.0671), (1e-2, 9.7097, None)]
)
def test_smooth_switch_model_has_the_published_stick_slip(
    v_eps: float, period: float, x_max: float | None
) -> None:
    law = LeineSwitch(mu_s=1.0, delta=3.0, v_eps=v_eps)
    model = rabinowicz(law, m=1.0, k=1.0, v_belt=0.2, g=1.0)
    run = simulate(model, 60.0, rtol=1e-9, samples=60_001)
    found = settled(run, 30.0)
    assert found[0] == pytest.approx(period, abs=1e-3)
    if x_max is not None:
        assert found[1] == pytest.approx(x_max, abs=2e-4)


@given(v=st.floats(-0.1, 0.1))
def test_wojewoda_without_acceleration_is_smooth_coulomb(v: float) -> None:
    law = Wojewoda(**LEVELS)
    expected = Coulomb(0.2, v_eps=1e-4).force(v, 5.0)
    assert law.force(v, 5.0, dv=0.0) == pytest.approx(expected, rel=1e-14, abs=1e-300)


def test_wojewoda_refuses_a_static_level_that_would_drive() -> None:
    with pytest.raises(ValueError, match=r"mu_s <= 2 mu_d = 0.2, got 0.25; otherwise friction"):
        Wojewoda(mu_s=0.25, mu_d=0.1)


@given(v=st.floats(1e-6, 1.0), dv=st.floats(-100.0, 100.0))
def test_wojewoda_opposes_the_motion_in_both_phases(v: float, dv: float) -> None:
    assert Wojewoda(mu_s=0.2, mu_d=0.1).force(v, 5.0, dv=dv) >= 0
