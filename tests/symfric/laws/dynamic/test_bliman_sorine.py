"""Bliman-Sorine friction: peak, steady state, rate independence, Dahl."""

from math import exp, log

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs import prescribed_motion, through

from symfric import Dahl, rabinowicz, simulate
from symfric.laws import BlimanSorine

N = 7.848


def pulled(law: BlimanSorine, v: float, path: float = 1.5e-4) -> np.ndarray:
    run = simulate(
        prescribed_motion(law, N, lambda t: ca.SX(v)), path / abs(v), rtol=1e-10, samples=20_001
    )
    return np.array([run["path"], run["friction"]])


def test_peak_has_the_published_place_and_height() -> None:
    path, F = pulled(BlimanSorine(), 1e-4)
    assert path[F.argmax()] == pytest.approx(8.812e-6, abs=1.5e-8)
    assert F.max() == pytest.approx(1.174969, abs=1e-6)
    assert F[-1] == pytest.approx(0.7848, rel=1e-5)


@pytest.mark.parametrize(("mu_1", "mu_2", "eta"), [(0.5, 0.3, 0.2), (0.2, 0.05, 0.7)])
def test_peak_follows_its_closed_form(mu_1: float, mu_2: float, eta: float) -> None:
    path, F = pulled(BlimanSorine(mu_1=mu_1, mu_2=mu_2, eta=eta), 1e-4)
    s = eta * 1e-5 / (1 - eta) * log(mu_1 / (eta * mu_2))
    height = N * (mu_1 * (1 - exp(-s / (eta * 1e-5))) - mu_2 * (1 - exp(-s / 1e-5)))
    assert path[F.argmax()] == pytest.approx(s, abs=2e-8)
    assert F.max() == pytest.approx(height, rel=1e-6)


@pytest.mark.parametrize("v", [1e-6, 1e-2, -1e-2])
def test_force_depends_on_the_path_alone(v: float) -> None:
    _, slow = pulled(BlimanSorine(), 1e-4)
    _, other = pulled(BlimanSorine(), v)
    assert np.sign(v) * other == pytest.approx(slow, abs=2e-6)


@given(v=st.floats(-0.1, 0.1), F=st.floats(-1.0, 1.0))
def test_first_order_is_dahl(v: float, F: float) -> None:
    law = BlimanSorine(order="1", mu_1=0.1, mu_2=0.0, s_f=1e-5, eta=0.4)
    dahl = Dahl(sigma_0=0.1 * N / 4e-6)
    expected = dahl.sigma_0 * dahl.rate(v, N, np.array([F / dahl.sigma_0]))[0]
    assert law.rate(v, N, np.array([F]))[0] == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_settled_cycle_dissipates() -> None:
    A = 2e-4 / (2 * np.pi)
    model = prescribed_motion(BlimanSorine(), N, through([0.0, *3 * [A, -A], A], 0.5))
    run = simulate(model, 3.5, t_eval=[2.5, 3.5], rtol=1e-10)
    work = run["work"][1] - run["work"][0]
    assert 0 < work < 4 * A * 1.174969 * 1.5


def test_slow_part_above_the_fast_one_is_refused() -> None:
    with pytest.raises(ValueError, match=r"mu_2 <= mu_1, got mu_2 = 0.4 and mu_1 = 0.3"):
        BlimanSorine(mu_2=0.4)


def test_block_that_rings_breaks_away_at_the_right_time() -> None:
    """2.4 mm off at rtol 1e-6, since nothing resolved the ringing; here by radau5 at 1e-10."""
    run = simulate(rabinowicz(BlimanSorine()), 20.0, samples=2)
    assert run.final["x"] == pytest.approx(0.33708515, abs=1e-4)
