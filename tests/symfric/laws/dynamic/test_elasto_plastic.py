"""Elasto-plastic friction: elastic below break-away, no drift, LuGre in sliding."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import stribeck_curve
from rigs import prescribed_motion

from symfric import Law, LuGre, Model, Variable, contact, simulate
from symfric.laws import ElastoPlastic

N = 7.848
LEVEL, STATIC = 0.1 * N, 0.15 * N


@given(z=st.floats(-1e-7, 1e-7), v=st.floats(-0.1, 0.1))
def test_below_break_away_the_bristle_follows_the_slip(z: float, v: float) -> None:
    assert ElastoPlastic().rate(v, N, np.array([z]))[0] == v


@given(share=st.floats(0.0, 1.5), v=st.floats(1e-6, 0.1))
def test_unloading_is_elastic(share: float, v: float) -> None:
    z = np.array([share * STATIC / 1e5])
    assert ElastoPlastic().rate(-v, N, z)[0] == -v
    assert ElastoPlastic().rate(v, N, -z)[0] == v


@given(share=st.floats(1.0, 1.5), v=st.floats(1e-6, 0.1))
def test_beyond_the_steady_deflection_it_is_lugre(share: float, v: float) -> None:
    z = share * LuGre().steady_state(v, N)
    expected = LuGre().rate(v, N, z)[0]
    assert ElastoPlastic().rate(v, N, z)[0] == pytest.approx(expected, rel=1e-12, abs=1e-12 * v)


@given(share=st.floats(-1.2, 1.2), v=st.floats(1e-6, 0.1))
def test_step_misses_the_original_sine_by_less_than_a_twentieth(share: float, v: float) -> None:
    z = share * LuGre().steady_state(v, N)
    smooth, original = (ElastoPlastic(v_eps=e).sliding_share(v, N, z) for e in (1e-12, 0.0))
    assert smooth == pytest.approx(original, abs=0.05)


@pytest.mark.parametrize("v", [-0.2, -1e-3, 5e-4, 0.05])
@pytest.mark.parametrize("v_eps", [1e-9, 0.0])
def test_long_sliding_ends_on_the_stribeck_curve(v: float, v_eps: float) -> None:
    law = ElastoPlastic(sigma_2=0.4, v_eps=v_eps)
    run = simulate(prescribed_motion(law, N, lambda t: ca.SX(v)), 1e-3 / abs(v), rtol=1e-9)
    expected = stribeck_curve(v, N, 0.15, 0.1, 1e-3, 2.0, 0.4)
    assert run.final["friction"] == pytest.approx(expected, rel=1e-6)


def vibrated(law: Law) -> Model:
    """Block pulled beyond break-away, let go to half the dynamic level, then shaken at 10 Hz."""
    x, v, t = Variable("x", "m", nominal=1e-5), Variable("v", "m/s", nominal=1e-3), ca.SX.sym("t")
    rising = 1.05 * STATIC * t
    held, shaken = 0.5 * LEVEL, 0.3 * LEVEL * ca.sin(20 * ca.pi * t)
    late = ca.if_else(t < 2, held, held + shaken)
    pull = ca.if_else(t < 1, rising, ca.if_else(t < 1.05, 1.05 * STATIC, late))
    slip = contact("guide", law, v, N)
    rates = ca.vertcat(v.symbol, (pull - slip.force) / 0.8)
    return Model("shaken", x=(x, v), ode=rates, contacts=(slip,), t=t)


def drift(law: Law) -> np.ndarray:
    """Distance from where the shaking began, one sample a period."""
    run = simulate(vibrated(law), 8.0, t_eval=np.linspace(0.0, 8.0, 81), rtol=1e-8)
    return run["x"][20:] - run["x"][20]


def test_vibration_below_break_away_does_not_drift_where_lugre_does() -> None:
    elastic = ElastoPlastic(z_ba=0.7 * LEVEL / 1e5)
    assert np.abs(drift(elastic)).max() < 3e-7
    assert drift(LuGre())[-1] == pytest.approx(2.4e-4, rel=0.03)


def test_elastic_share_beyond_the_dynamic_level_is_refused_by_name_and_value() -> None:
    with pytest.raises(ValueError, match=r"expected z_ba < .* = 7.848e-06 m, got z_ba = 8e-06 m"):
        ElastoPlastic(z_ba=8e-6).rate(0.1, N, np.array([0.0]))
    assert ElastoPlastic(z_ba=7e-6).rate(0.1, N, np.array([0.0]))[0] == 0.1
