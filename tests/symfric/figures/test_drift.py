"""Who drifts, who does not."""

import numpy as np
import pytest

from symfric import LuGre, law_from_text
from symfric.figures import compare, drift
from symfric.figures.pushing import over_period
from symfric.laws import ElastoPlastic


def test_lugre_drifts_and_the_elasto_plastic_law_does_not() -> None:
    elastic = ElastoPlastic(z_ba=0.7 * 0.7848 / 1e5)
    data = compare({"elasto-plastic": elastic, "LuGre": LuGre()}, "drift")
    assert abs(data["elasto-plastic"]["x"][-1]) < 3e-7
    assert data["LuGre"]["x"][-1] > 1e-4


def test_the_vibration_starts_from_rest() -> None:
    """The elasto-plastic law "drifted" 9 cm at data where the push goes on for a second."""
    given = {"mu_s": 1.05, "mu_d": 0.2, "v_s": 98e-6, "delta": 0.78, "sigma_0": 1.6e5}
    data = drift(ElastoPlastic(z_ba=0.61e-6, sigma_1=0.08, **given), N=1.0)
    assert np.ptp(data.curves[0]["x"]) < 2e-6
    assert drift(LuGre(sigma_1=0.08, **given), N=1.0).curves[0]["x"][-1] > 1e-5


def test_drift_of_lugre_is_that_of_an_independent_integration() -> None:
    assert drift(LuGre())["lugre"]["x"][-1] == pytest.approx(2.43e-4, rel=5e-3)  # SciPy's LSODA


@pytest.mark.parametrize("name", ["maxwell_slip", "gms", "leuven", "haessig_friedland"])
def test_laws_with_hysteresis_settle_instead_of_drifting(name: str) -> None:
    curve = drift(law_from_text(name))[name]
    t, x = curve["t"], curve["x"]
    early, late = (np.mean(x[(t >= a) & (t < a + 1)]) for a in (3.0, 7.0))
    assert abs(late - early) < 2e-6  # LuGre: 1.6e-4


def test_the_block_is_pushed_below_break_away_at_first_and_in_the_end() -> None:
    F_e = drift(LuGre())["lugre"]["F_e"]
    assert F_e.max() == pytest.approx(0.8 * 0.7848, rel=1e-3)
    assert F_e.min() == pytest.approx(0.2 * 0.7848, rel=1e-3)


@pytest.mark.slow
def test_the_mean_over_two_periods_drifts_with_lugre_and_stays_with_gms() -> None:
    data = compare(["lugre", "gms"], "drift")
    assert data.panels == (("t", "x_mean"),)
    for law, rise in (("lugre", 1.6e-4), ("gms", 0.0)):
        t, mean = data[law]["t"], data[law]["x_mean"]
        late = mean[np.abs(t - 7.0).argmin()] - mean[np.abs(t - 3.0).argmin()]
        assert late == pytest.approx(rise, rel=0.1, abs=2e-7)


def test_a_mean_over_a_period_forgets_its_sine_and_keeps_a_line() -> None:
    t = np.linspace(0.0, 1.0, 401)
    found = over_period(t, 2 * t + np.sin(2 * np.pi * 10 * t), 0.1)
    inner = (t > 0.06) & (t < 0.94)
    assert found[inner] == pytest.approx(2 * t[inner], abs=1e-3)
    assert found[0] == pytest.approx(0.1, abs=1e-3)
