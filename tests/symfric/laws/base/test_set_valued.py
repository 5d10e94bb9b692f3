"""Projections and complementarity against the definition of Coulomb's law."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import rabinowicz_coulomb

from symfric.laws.base import set_valued

levels = st.floats(0.1, 10.0)
rates = st.floats(1e-3, 1e3)


@given(v=st.floats(1e-3, 1.0), F_C=levels, r=rates)
def test_sliding_at_the_level_satisfies_the_law_for_every_r(v: float, F_C: float, r: float) -> None:
    assert set_valued.residual(F_C, v, F_C, r) == pytest.approx(0.0, abs=1e-12)
    assert set_valued.residual(-F_C, -v, F_C, r) == pytest.approx(0.0, abs=1e-12)
    assert abs(set_valued.residual(-F_C, v, F_C, r)) > 0
    assert abs(set_valued.residual(0.5 * F_C, v, F_C, r)) > 0


@given(share=st.floats(-1.0, 1.0), F_C=levels, r=rates)
def test_any_force_below_the_level_satisfies_the_law_at_rest(
    share: float, F_C: float, r: float
) -> None:
    assert set_valued.residual(share * F_C, 0.0, F_C, r) == 0.0


@given(excess=st.floats(1e-3, 1.0), F_C=levels, r=rates)
def test_force_beyond_the_level_never_satisfies_the_law(
    excess: float, F_C: float, r: float
) -> None:
    assert abs(set_valued.residual(F_C * (1 + excess), 0.0, F_C, r)) > 0


@given(F=st.tuples(*2 * [st.floats(-5.0, 5.0)]), other=st.tuples(*2 * [st.floats(-5.0, 5.0)]))
def test_projection_on_the_disc_is_the_nearest_point(
    F: tuple[float, float], other: tuple[float, float]
) -> None:
    """Variational inequality: (F - P) . (Y - P) <= 0 for every Y in the disc."""
    P, Y = (set_valued.project_disc(np.array(x), 2.0) for x in (F, other))
    assert np.hypot(*P) <= 2.0 * (1 + 1e-15)
    assert (np.array(F) - P) @ (Y - P) <= 1e-12


def test_projection_on_the_disc_takes_symbols() -> None:
    F = ca.SX.sym("F", 2)
    f = ca.Function("f", [F], [set_valued.project_disc(F, 2.0)])
    np.testing.assert_allclose(f([3.0, 4.0]).full().ravel(), [1.2, 1.6])
    np.testing.assert_array_equal(f([0.0, 0.0]).full().ravel(), [0.0, 0.0])


def test_block_braked_by_implicit_steps_stops_and_stays() -> None:
    v, F_C, m, h = 1.0, 4.0, 2.0, 1e-3
    velocities = [v]
    for _ in range(1000):
        v, F = set_valued.implicit_step(v, 0.5, F_C, m, h)
        velocities.append(v)
    stop = next(i for i, x in enumerate(velocities) if x == 0.0) * h
    assert stop == pytest.approx(m * 1.0 / (F_C - 0.5), abs=h)
    assert velocities[-1] == 0.0
    assert F == 0.5


def test_stepping_reproduces_the_closed_form_without_stiction() -> None:
    """Rabinowicz with mu_s = mu_d: the block settles, from rest, on the belt's amplitude."""
    m, k, belt, level, h = 0.8, 2.1, 0.1, 0.1 * 0.8 * 9.81, 1e-4
    x, v, peak = 0.0, 0.0, 0.0
    for _ in range(100_000):
        relative, _ = set_valued.implicit_step(v - belt, -k * (x + h * v), level, m + h * h * k, h)
        v = relative + belt
        x += h * v
        peak = max(peak, x)
    ideal = rabinowicz_coulomb(0.1, 0.1, m, k, belt, 9.81)
    assert peak == pytest.approx(ideal.x_max, rel=1e-3)


@given(a=st.floats(0.01, 10.0), eps=st.sampled_from([0.0, 1e-6, 1e-2]))
def test_fischer_burmeister_vanishes_on_the_relaxed_complement(a: float, eps: float) -> None:
    assert set_valued.fischer_burmeister(a, eps / a, eps) == pytest.approx(0.0, abs=1e-12)
    assert set_valued.fischer_burmeister(a, 0.5 + eps / a, eps) < 0
    assert set_valued.fischer_burmeister(-a, 0.0, eps) > 0


def test_complements_vanish_in_stick_and_slip() -> None:
    for v_p, v_n, F in ((0.3, 0.0, 2.0), (0.0, 0.3, -2.0), (0.0, 0.0, 1.1)):
        assert (set_valued.complementarity(v_p, v_n, F, 2.0) == 0).all()
    assert set_valued.complementarity(0.3, 0.0, 1.1, 2.0)[0] > 0


def test_relaxed_program_brakes_a_block_in_the_closed_form_distance() -> None:
    """Ipopt finds the stop of a block on which friction alone acts, by complementarity."""
    n, h, level = 40, 0.01, 4.0
    opti = ca.Opti()
    v_p, v_n, F = opti.variable(n), opti.variable(n), opti.variable(n)
    before = ca.vertcat(1.0, (v_p - v_n)[:-1])
    opti.subject_to(v_p - v_n == before - h * F)
    opti.subject_to(v_p >= 0)
    opti.subject_to(v_n >= 0)
    opti.subject_to(opti.bounded(-level, F, level))
    products = set_valued.complementarity(v_p, v_n, F, level)
    opti.subject_to(ca.vec(products) <= 1e-7)
    opti.minimize(0)
    opti.set_initial(v_p, 0.5)
    opti.solver("ipopt", {"print_time": False}, {"print_level": 0, "sb": "yes"})
    v = opti.solve().value(v_p - v_n)
    assert np.sum(v) * h == pytest.approx(1.0 / (2 * level), rel=0.05)
    assert abs(v[-1]) < 1e-4
