from dataclasses import replace

import numpy as np
import pytest

from identification import Dataset, Filter, Identification, identify, linear_regression
from identification.old.problem import STATUS
from identification.old.synthetic import synthetic_drive_data
from symfric import Coulomb, SolveError, Status, Sum, Viscous
from symfric.laws import SteadyStateLuGre

FILTER = Filter(100.0, 10, v_min=1e-3)
TRUTH = {"m": 95.0, "offset": -3.0, "mu_s": 28.0, "mu_d": 20.0, "v_s": 0.01, "sigma_2": 200.0}


@pytest.mark.parametrize("name", TRUTH)
def test_known_parameters_come_back_within_three_standard_errors(
    stribeck: Identification, name: str
) -> None:
    found = stribeck.parameters[name]
    assert found.standard_error is not None
    assert abs(found.value - TRUTH[name]) < 3 * found.standard_error
    assert found.standard_error < 0.01 * abs(TRUTH[name])


def test_another_law_and_another_load_come_back() -> None:
    law = Sum((Coulomb(mu_d=0.2, v_eps=1e-4), Viscous(40.0)))
    data = synthetic_drive_data(law, m=8.0, offset=1.0, normal_force=80.0, speeds=(0.01, 0.05, 0.1))
    found = identify(data, "coulomb+viscous", normal_force=80.0, filter=FILTER)
    truth = {"m": 8.0, "offset": 1.0, "mu_d": 0.2, "sigma_2": 40.0}
    for name, value in truth.items():
        error = found.parameters[name].standard_error
        assert error is not None
        assert abs(found.parameters[name].value - value) < 3 * error, name
    assert found.levels["mu_d"].value == pytest.approx(80 * found.parameters["mu_d"].value)
    assert found.levels["mu_d"].unit == "N"


def test_the_fit_is_the_regression_as_the_smoothing_vanishes(stage: Dataset) -> None:
    found = identify(stage, "coulomb+viscous", filter=FILTER, fixed={"v_eps": 1e-9})
    pairs = {"m": "m", "mu_d": "F_c", "sigma_2": "F_v", "offset": "offset"}
    for ours, theirs in pairs.items():
        assert found.parameters[ours].value == pytest.approx(found.linear.values[theirs], rel=1e-7)
        error = found.linear.standard_errors[theirs]
        assert found.parameters[ours].standard_error == pytest.approx(error, rel=1e-6)
    assert found.linear.values == linear_regression(found.signals).values


def test_emps_reproduces_the_published_estimate(emps_symmetric: Identification) -> None:
    published = {
        "m": (95.1089, 0.1085),
        "sigma_2": (203.5034, 1.1460),
        "mu_d": (20.3935, 0.1012),
        "offset": (-3.1648, 0.0444),
    }
    assert emps_symmetric.status is Status.SOLVED
    for name, (value, error) in published.items():
        assert abs(emps_symmetric.parameters[name].value - value) < error, name
        assert emps_symmetric.parameters[name].standard_error == pytest.approx(error, rel=0.02)
    assert emps_symmetric.validation is not None
    assert emps_symmetric.errors.force_relative == pytest.approx(4.083, rel=0.02)
    assert emps_symmetric.validation.force_relative == pytest.approx(5.98, rel=0.02)


def test_emps_reproduces_the_published_two_directions(emps_directions: Identification) -> None:
    published = {
        "m": (95.154, 0.083),
        "sigma_2_pos": (166.71, 1.23),
        "sigma_2_neg": (240.42, 1.23),
        "mu_d_pos": (20.144, 0.109),
        "mu_d_neg": (20.628, 0.109),
    }
    for name, (value, error) in published.items():
        assert abs(emps_directions.parameters[name].value - value) < error, name
    assert emps_directions.errors.force_relative == pytest.approx(3.112, rel=0.025)
    offset = emps_directions.parameters["offset"]
    assert (offset.value, offset.fixed) == (0.0, True)


@pytest.mark.parametrize("text", ["brown_mcphee", "self_tuning+viscous", "asymmetric(stribeck)"])
def test_every_static_law_can_be_fitted(stage: Dataset, text: str) -> None:
    found = identify(stage, text, filter=FILTER)
    assert found.status.ok
    assert found.errors.force_rms < 0.8 * found.linear.force_rms
    assert found.fitted_law.states == ()
    assert found.undetermined == ()


def test_parameters_that_cannot_be_told_apart_are_named(stage: Dataset) -> None:
    found = identify(stage, "coulomb+coulomb+viscous", filter=FILTER)
    assert found.undetermined == (("mu_d_1", "mu_d_2"),)
    assert found.parameters["mu_d_1"].standard_error is None
    assert found.parameters["mu_d_1"].note == "cannot be told from mu_d_2"
    assert found.parameters["m"].standard_error is not None
    assert found.levels["mu_d_1"].half_width is None


def test_a_parameter_without_influence_is_named(stage: Dataset) -> None:
    fixed = {"mu_s": 22.0, "mu_d": 22.0}
    found = identify(stage, "stribeck", filter=FILTER, fixed=fixed)
    assert found.undetermined == (("v_s",),)
    assert found.parameters["v_s"].note == "without influence"


def test_a_parameter_at_its_bound_is_named() -> None:
    coulomb = Sum((Coulomb(20.0, 1e-4), Viscous(200.0)))
    data = synthetic_drive_data(coulomb, speeds=(0.01, 0.1))
    reversed_viscous = replace(data, force=data.force - 250 * np.gradient(data.x, data.step))
    found = identify(reversed_viscous, "coulomb+viscous", filter=FILTER)
    sigma = found.parameters["sigma_2"]
    assert (sigma.note, sigma.standard_error) == ("at its bound", None)
    assert sigma.value == pytest.approx(0.0, abs=1e-2)


def test_shape_parameters_are_fitted_on_request(stage: Dataset) -> None:
    found = identify(stage, "stribeck", filter=FILTER, free=["delta"])
    delta = found.parameters["delta"]
    assert delta.standard_error is not None
    assert delta.value == pytest.approx(2.0, abs=0.15)
    assert delta.standard_error < 0.05


def test_cross_validation_leaves_pieces_out(stribeck: Identification) -> None:
    crossed = stribeck.cross_validation
    assert stribeck.errors.force_relative < crossed["force_relative"] < crossed["worst"]


def test_cross_validation_of_equal_pieces_agrees_with_the_fit() -> None:
    data = synthetic_drive_data(speeds=(0.05,) * 4)
    found = identify(data, "coulomb+viscous", filter=FILTER, folds=4)
    crossed = found.cross_validation["force_relative"]
    assert crossed == pytest.approx(found.errors.force_relative, rel=0.1)


def test_validation_uses_the_parameters_as_they_are(stribeck: Identification) -> None:
    assert stribeck.validation == stribeck.errors


def test_progress_rises_to_one(stage: Dataset) -> None:
    seen: list[tuple[str, float]] = []
    identify(stage, "viscous", filter=FILTER, progress=lambda *step: seen.append(step))
    fractions = [fraction for _, fraction in seen]
    assert fractions == sorted(fractions)
    assert seen[-1] == ("done", 1.0)


def test_a_failed_fit_raises_with_what_there_is(
    stage: Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(STATUS, "Solve_Succeeded", Status.MAX_ITERATIONS)
    with pytest.raises(SolveError, match="identify viscous: The maximum number of iter") as caught:
        identify(stage, "viscous", filter=FILTER)
    assert isinstance(caught.value.partial, Identification)
    assert identify(stage, "viscous", filter=FILTER, throw=False).status is Status.MAX_ITERATIONS


ALL = {"m": 95.0, "offset": 0.0, "sigma_2": 1.0}


@pytest.mark.parametrize(
    ("law", "options", "message"),
    [
        ("lugre", {}, "expected a static law, got LuGre with internal states z"),
        ("coulom", {}, "did you mean coulomb"),
        ("coulomb", {"folds": 1}, "folds: expected 0 or at least 2, got 1"),
        ("coulomb", {"normal_force": float("nan")}, "normal_force: expected a number > 0"),
        ("viscous", {"fixed": ALL}, "expected at least one free parameter, got all fixed"),
        ("stribeck", {"filter": Filter(100.0, 300)}, "expected at least 18 equations for 6"),
        ("coulomb", {"filter": Filter(800.0)}, "below the Nyquist frequency"),
    ],
)
def test_bad_input_is_refused(
    stage: Dataset, law: str, options: dict[str, object], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        identify(stage, law, **options)  # type: ignore[arg-type]


@pytest.mark.slow
def test_intervals_cover_the_truth_as_often_as_they_say() -> None:
    law = Sum((Coulomb(20.0, 1e-4), Viscous(200.0)))
    clean = synthetic_drive_data(law, position_noise=0.0, force_noise=0.0, ramp=0.4)
    truth = {"m": 95.0, "offset": -3.0, "mu_d": 20.0, "sigma_2": 200.0}
    runs, hits = 60, dict.fromkeys(truth, 0)
    for seed in range(runs):
        rng = np.random.default_rng(seed)
        data = replace(
            clean,
            x=clean.x + 1e-7 * rng.standard_normal(clean.x.size),
            force=clean.force + 2.0 * rng.standard_normal(clean.x.size),
            loop=None,
        )
        found = identify(data, "coulomb+viscous", filter=FILTER)
        for name, value in truth.items():
            low, high = found.parameters[name].lower95, found.parameters[name].upper95
            assert low is not None
            assert high is not None
            hits[name] += low <= value <= high
    # binomial: fewer than 52 of 60 has a probability of 0.5 % at 95 % coverage
    assert min(hits.values()) >= 52, hits


def test_levels_in_newtons_are_fitted() -> None:
    """Guards F_S and F_C being held at their defaults because "the load is constant"."""
    law = SteadyStateLuGre(F_S=28.0, F_C=20.0, v_s=0.01, sigma_2=200.0)
    record = synthetic_drive_data(law, speeds=(0.004, 0.01, 0.03, 0.1), dwell=0.5)
    found = identify(record, "steady_state_lugre", filter=FILTER)
    assert found.errors.force_rms < 3.0
    for name, truth in {"F_S": 28.0, "F_C": 20.0, "v_s": 0.01, "sigma_2": 200.0}.items():
        estimate = found.parameters[name]
        assert estimate.half_width is not None
        assert abs(estimate.value - truth) < max(estimate.half_width, 0.02 * truth)
