"""Figures of a block under a given force: stiction, drift, break-away, and any push."""

from functools import cache

import numpy as np
import pytest

from symfric import Dahl, ExactCoulomb, GenericAsperity, LuGre, Viscous, law_from_text
from symfric.figures import Curve, break_away, drift, push, stiction
from symfric.figures.motion import scales
from symfric.figures.pushing import over_period
from symfric.laws import ElastoPlastic


def test_viscous_block_approaches_its_speed() -> None:
    curve = push(Viscous(sigma_2=4.0), force=2.0, t_end=1.0, mass=0.5, samples=11).curves[0]
    assert np.allclose(curve["v"], 0.5 * (1 - np.exp(-8 * curve["t"])), atol=2e-5)
    assert np.allclose(curve["F"], 4 * curve["v"], atol=1e-9)


def test_random_contacts_take_the_momentum_that_is_missing() -> None:
    law = GenericAsperity(k=1e5, count=50)
    curve = push(law, 1.0, force=0.5, t_end=0.1, mass=0.5, samples=4001).curves[0]
    left = np.trapezoid(curve["F_e"] - curve["F"], curve["t"])
    assert abs(0.5 * curve["v"][-1] / left - 1) < 1e-3
    assert 0.04 < curve["F"][-1] < 0.5


def test_at_rest_friction_is_the_force_that_pulls() -> None:
    data = stiction(ExactCoulomb(), 10.0)
    curve = data.curves[0]
    still = (np.abs(curve["v"]) < 1e-9) & (np.abs(curve["F_e"]) < 1.49)
    assert still.sum() > 50
    assert curve["F"][still] == pytest.approx(curve["F_e"][still], abs=1e-6)
    assert np.abs(curve["F"][still]).max() == pytest.approx(1.5, rel=0.02)
    assert np.abs(curve["F_e"]).max() == pytest.approx(1.3 * 1.5, rel=1e-3)


@cache
def of_lugre() -> Curve:
    return drift(LuGre())["lugre"]


def test_lugre_drifts_and_the_elasto_plastic_law_does_not() -> None:
    elastic = ElastoPlastic(z_ba=0.7 * 0.7848 / 1e5)
    assert abs(drift(elastic)["elasto_plastic"]["x"][-1]) < 3e-7
    assert of_lugre()["x"][-1] == pytest.approx(2.43e-4, rel=5e-3)  # SciPy's LSODA
    F_e = of_lugre()["F_e"]  # pushed below break-away at first and in the end
    assert (F_e.min(), F_e.max()) == pytest.approx((0.2 * 0.7848, 0.8 * 0.7848), rel=1e-3)


def test_the_vibration_starts_from_rest() -> None:
    """The elasto-plastic law "drifted" 9 cm at data where the push goes on for a second."""
    given = {"mu_s": 1.05, "mu_d": 0.2, "v_s": 98e-6, "delta": 0.78, "sigma_0": 1.6e5}
    data = drift(ElastoPlastic(z_ba=0.61e-6, sigma_1=0.08, **given), N=1.0)
    assert np.ptp(data.curves[0]["x"]) < 2e-6


SETTLING = ("maxwell_slip", *(pytest.param(n, marks=pytest.mark.slow) for n in ("gms", "leuven")))


@pytest.mark.parametrize("name", SETTLING)
def test_laws_with_hysteresis_settle_instead_of_drifting(name: str) -> None:
    curve = drift(law_from_text(name))[name]
    t, x = curve["t"], curve["x"]
    early, late = (np.mean(x[(t >= a) & (t < a + 1)]) for a in (3.0, 7.0))
    assert abs(late - early) < 2e-6  # LuGre: 1.6e-4


def test_a_mean_over_a_period_forgets_its_sine_and_keeps_a_line() -> None:
    t = np.linspace(0.0, 1.0, 401)
    found = over_period(t, 2 * t + np.sin(2 * np.pi * 10 * t), 0.1)
    inner = (t > 0.06) & (t < 0.94)
    assert found[inner] == pytest.approx(2 * t[inner], abs=1e-3)
    assert found[0] == pytest.approx(0.1, abs=1e-3)


def test_break_away_of_lugre_falls_with_the_rate_as_computed_independently() -> None:
    curve = break_away(LuGre(), rates=(0.1, 1.0, 10.0))["lugre"]
    # SciPy's Radau on plain Python, seed 2's parameters
    assert curve["F"] == pytest.approx([1.166, 1.125, 0.961], abs=5e-4)


def test_break_away_ends_at_the_kinetic_level_whatever_the_stiffness() -> None:
    """By LSODA on plain Python for sigma_0 = 1e4 and no damping: 0.9322, then F_C."""
    F_C = 0.1 * 7.848
    soft = break_away(LuGre(sigma_0=1e4, sigma_1=0.0), rates=(1.0, 30.0))
    assert soft.curves[0]["F"] == pytest.approx([0.9322, F_C], abs=5e-4)
    rates = (3.0, 100.0)
    for law in (LuGre(sigma_0=1e3), LuGre(sigma_0=1e6, sigma_1=0.0), Dahl(sigma_0=1e3)):
        assert (break_away(law, rates=rates).curves[0]["F"] > 0.9999 * F_C).all()


def test_scales_of_another_law_do_not_end_the_elastic_motion() -> None:
    """The scales of a contact ten times as stiff are given, as those of a whole comparison are."""
    stiff = scales(LuGre(sigma_0=1e6))
    given = break_away(LuGre(sigma_0=1e4, sigma_1=0.0), given=stiff, rates=(30.0,))
    assert given.curves[0]["F"][0] == pytest.approx(0.7848, abs=5e-4)


def test_break_away_of_a_static_law_does_not_know_the_rate() -> None:
    peak = break_away(law_from_text("brown_mcphee"), rates=(0.1, 10.0))["brown_mcphee"]["F"]
    assert peak == pytest.approx(np.full(2, 0.9996 * 0.15 * 7.848), rel=1e-4)
