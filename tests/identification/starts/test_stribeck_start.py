"""Start values: the Stribeck curve, six steps, and every law of the catalogue by its roles."""

import numpy as np
import pytest
from tables import sampled

from identification.starts.experiments import SixSteps, six_steps, standard_errors
from identification.starts.measured import Measured
from identification.starts.start import start_values
from identification.starts.stribeck import StribeckCurve, binned, fit_curve
from symfric.foundation.parameters import parameters, with_values
from symfric.laws import Stribeck
from symfric.laws.catalogue import ALL_LAWS
from symfric.laws.composed.populations import steady_force
from symfric.scenes import Drive

PILOT = StribeckCurve(4.4861, 2.5498, 0.0012, 2.0, 230.0, 0.0, 0.0)
MAIN = StribeckCurve(4.2672, 2.6063, 0.0049, 3.2, 5.0, 0.0, 0.0)
"""Tables 5.1 and 5.2 of the thesis on laminator nips, whose speeds are 10 to 500 mm/min."""


def mm_min(first: int) -> np.ndarray:
    return np.arange(first, 501, 10) / 60e3


def test_curve_is_recovered_from_its_own_points() -> None:
    v = mm_min(10)
    found = fit_curve(binned(v, PILOT.force(v)))
    got = (found.F_S, found.F_C, found.v_s, found.delta, found.sigma_2)
    assert got == pytest.approx((4.4861, 2.5498, 0.0012, 2.0, 230.0), rel=1e-4)
    rising = fit_curve(binned(v, 2.0 + 100 * v))
    assert rising.F_S >= rising.F_C > 0 and rising.sigma_2 == pytest.approx(100, abs=1)


def test_spikes_and_direction_do_not_move_the_levels() -> None:
    rng = np.random.default_rng(0)
    v = rng.uniform(-8e-3, 8e-3, 20_000)
    F = PILOT.force(v) + 0.3 + 0.05 * rng.standard_normal(v.size)
    F[::50] += 40.0
    found = fit_curve(binned(v, F), delta=2.0)
    assert abs(found.offset - 0.3) < 0.01
    assert abs(found.F_C / PILOT.F_C - 1) < 0.02
    assert abs(found.v_s / PILOT.v_s - 1) < 0.05


def study(curve: StribeckCurve, first: int) -> SixSteps:
    """Six steps on nine noisy repetitions; the thesis saw stick-slip up to 140 mm/min."""
    v = np.repeat(mm_min(first), 9)
    noise = 1 + 0.02 * np.random.default_rng(0).standard_normal(v.size)
    return six_steps(v, curve.force(v) * noise, unstable=140 / 60e3)


def test_pilot_study_by_six_steps() -> None:
    found = study(PILOT, 10)
    truth = {"F_S": 4.4861, "F_C": 2.5498, "v_s": 0.0012, "sigma_2": 230.0, "delta": 2.0}
    assert found.values == pytest.approx(truth, rel=0.08)
    assert [step.number for step in found.steps] == [1, 2, 3, 4, 5, 6]
    reported = " ".join(found.doubts)
    assert "is among speeds of stick-slip" in reported and "not determined" not in reported


def test_main_study_reports_that_the_viscous_part_is_not_identifiable() -> None:
    reported = " ".join(study(MAIN, 100).doubts)
    assert "sigma_2 is not determined" in reported
    assert "lower bound" in reported
    assert "stick-slip" not in reported  # v_s = 294 mm/min is above the 140 of the thesis


def test_smallest_errors_of_the_main_study_are_those_of_its_points() -> None:
    v = mm_min(100)
    found = standard_errors(MAIN, v, 0.01 * MAIN.force(v).mean() / 3)
    assert np.allclose(
        [100 * found[n] for n in ("sigma_2", "F_C", "delta")], [430, 6.8, 4.5], rtol=0.01
    )


def test_points_without_a_falling_part_are_reported_and_give_no_law() -> None:
    v = mm_min(10)
    scatter = 0.14 * np.exp(-v / 2e-3) * np.random.default_rng(13).standard_normal(v.size)
    for force, why in ((PILOT.force(v) * (1 + scatter), "scatter"), (2.0 + 100 * v, "rises")):
        found = six_steps(v, force)
        assert [name for name, x in found.values.items() if np.isnan(x)] == ["v_s", "delta"]
        assert "no falling part was found" in found.doubts[0]
        assert why in found.doubts[0]
        assert found.doubts[0] in str(found)
        assert "nan" not in " ".join(found.doubts)
        with pytest.raises(ValueError, match="no falling part was found"):
            _ = found.law
    assert found.rms < 1e-9  # F_C + sigma_2 v is all that there is
    assert found.values["sigma_2"] == pytest.approx(100.0)


def test_of_few_points_the_best_curve_that_was_tried_is_taken() -> None:
    v = 1e-3 * np.array([1.0, 2.0, 4.0, 8.0, 16.0])
    found = fit_curve(binned(v, StribeckCurve(3.0, 2.0, 4e-3, 2.0, 5.0, 0.0, 0.0).force(v)))
    assert found.delta == 2.0
    assert abs(np.log(found.v_s / 4e-3)) < np.log(16) / 23  # one of 24 that were tried
    assert found.rms < 0.02


def test_exponent_hardly_feels_an_error_where_the_force_has_not_fallen_yet() -> None:
    v = 1e-3 * np.array([0.01, 0.25, *np.arange(0.4, 1.65, 0.1), 2.0, 3.0, 4.0, 5.0, 6.0])
    F = StribeckCurve(4.0, 2.0, 1e-3, 2.0, 10.0, 0.0, 0.0).force(v)
    F[1] -= 0.06  # half of what the force has fallen there
    assert abs(six_steps(v, F).values["delta"] - 2) < 0.05


T = 2.5e-3 * np.arange(4000)
V = 0.3 * np.sin(np.pi * T) * (1 + 0.5 * np.sin(0.7 * T))
NOISE = 0.5
ASKED = ("width", "load", "temperature", "geometry")


def friction(v: np.ndarray) -> np.ndarray:
    return np.sign(v) * (20 + 12 * np.exp(-((v / 0.03) ** 2))) + 40 * v


def record(a: np.ndarray | None = None, m: float = 0.0, offset: float = 0.0) -> Measured:
    noise = NOISE * np.random.default_rng(0).standard_normal(T.size)
    F = friction(V) + offset + noise + (0.0 if a is None else m * a)
    return Measured(V, F, t=T, a=a)


FEW = record().at([np.arange(0, T.size, 80)])


@pytest.mark.parametrize("name", sampled(ALL_LAWS, of=3))
def test_start_of_any_law_can_be_constructed(name: str) -> None:
    law = ALL_LAWS[name]()
    free = [n for n, p in parameters(law).items() if p.role not in ASKED]
    found = start_values(law, FEW, free=free)
    assert set(found) == set(free)
    with_values(law, found)


def test_start_of_a_right_law_is_within_the_noise() -> None:
    law = Stribeck(v_eps=1e-4)
    found = start_values(law, record(), free=["mu_s", "mu_d", "v_s", "sigma_2"])
    moving = np.abs(V) > 2e-3
    error = steady_force(with_values(law, found), V, 1.0) - friction(V)
    assert np.sqrt(np.mean(error[moving] ** 2)) < 0.3 * NOISE


def test_mass_and_offset_of_a_drive() -> None:
    a = np.gradient(V, T)
    free = ["m", "offset", "mu_s", "mu_d", "v_s", "sigma_2"]
    found = start_values(Drive(Stribeck(), N=1.0), record(a, m=30.0, offset=-3.0), free=free)
    assert abs(found["m"] - 30) < 0.5
    assert abs(found["offset"] + 3) < 0.2
