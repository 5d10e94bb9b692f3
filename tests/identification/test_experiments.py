"""Usual experiments: one file for each speed, plateaus, sweeps, swings; each fits its law."""

import numpy as np
import pytest
from tables import sampled

from identification import Dataset, Fit, InverseDynamics, Points, cross_validate, plateaus
from identification.result.page import page_of
from symfric.foundation.status import Status
from symfric.laws import Stribeck

LAW = Stribeck(mu_s=4.5, mu_d=2.5, v_s=0.1, sigma_2=1.0, v_eps=1e-4)
TRUE = {"mu_s": 4.5, "mu_d": 2.5, "v_s": 0.1, "sigma_2": 1.0}


def at_speed(v: float, jitter: float, count: int = 100) -> Dataset:
    """Return points near one speed, with noise of the force."""
    rng = np.random.default_rng(round(1e3 * abs(v)) + (v > 0))
    speeds = v * (1 + jitter * rng.standard_normal(count))
    forces = np.array([float(LAW.force(x, 1.0)) for x in speeds])
    return Dataset.of(
        v=speeds, F=forces + 0.1 * rng.standard_normal(count), points=True, name=f"at {v:g}"
    )


@pytest.mark.parametrize("jitter", sampled([0.01, 0.0], of=2))
def test_one_record_for_each_speed_is_a_curve(jitter: float) -> None:
    size = np.array([0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.2])
    some = [at_speed(v, jitter) for v in np.concatenate([-size, size]).tolist()]
    data = Dataset(tuple(one[0] for one in some))
    assert not data.check()
    fit = Fit(Points(), "stribeck", data, starts=1)
    found = fit.solve()
    assert found.status is Status.SOLVED
    for name, true in TRUE.items():
        p = found.parameters[name]
        assert abs(p.value - true) < 4 * (p.standard_error or 0.0), name
    left = cross_validate(fit, folds=2, start=TRUE)
    assert left.relative < 5, str(left)


def test_records_over_time_at_one_speed_each_are_points() -> None:
    rng, t = np.random.default_rng(0), 1e-3 * np.arange(1500)
    some = [
        Dataset.of(
            t=t, x=v * t + 1e-7 * rng.standard_normal(t.size), name=f"at {v}",
            force=float(LAW.force(v, 1.0)) + 0.1 * rng.standard_normal(t.size),
        )[0]
        for v in (-1.0, -0.4, -0.1, -0.03, 0.03, 0.1, 0.4, 1.0)
    ]  # fmt: skip
    data = Dataset(tuple(some))
    with pytest.raises(ValueError, match=r"record at one speed is a point: .*plateaus\(data\)"):
        Fit(InverseDynamics(), "stribeck", data).solve()
    (points,) = plateaus(data)
    assert points.size == len(some)
    found = Fit(Points(), "stribeck", plateaus(data), starts=1).solve(throw=False)
    for name, true in TRUE.items():
        assert found.parameters[name].value == pytest.approx(true, rel=0.02), name


def test_speeds_of_one_direction_get_one_warning() -> None:
    data = Dataset(tuple(at_speed(v, 0.01)[0] for v in (0.05, 0.1, 0.4, 1.0)))
    text = str(data.check())
    assert text.count("one direction") == 1
    assert "at 0.05 and 3 more: All points have one direction" in text
    found = Fit(Points(), "stribeck", data, starts=1).solve(throw=False)
    assert str(found).count("one direction") == 1


def test_forces_that_no_speed_explains_are_refused() -> None:
    """The spread over all records does not hide a useless model."""
    rng = np.random.default_rng(0)
    some = [
        Dataset.of(v=np.full(100, v), F=rng.standard_normal(100), points=True, name=f"{v}")[0]
        for v in (-1.0, -0.5, 0.5, 1.0)
    ]
    found = Fit(Points(), "coulomb", Dataset(tuple(some)), starts=1).solve(throw=False)
    assert found.status is Status.IMPLAUSIBLE


def test_a_record_of_one_direction_is_shown_in_that_direction_only() -> None:
    """No green heading over values that the data do not identify, no curve without data."""
    t, w = 1e-3 * np.arange(3000), 9.0
    v, a = 0.3 + 0.25 * np.sin(w * t), 0.25 * w * np.cos(w * t)
    x = 0.3 * t - 0.25 / w * np.cos(w * t)
    rng = np.random.default_rng(0)
    force = 2 * a + np.array([float(LAW.force(s, 1.0)) for s in v])
    force += 0.1 * rng.standard_normal(t.size)
    data = Dataset.of(t=t, x=x, force=force)
    found = Fit(InverseDynamics(), "stribeck", data, starts=1).solve(throw=False)
    assert found.status is Status.SOLVED and found.curve is not None
    assert found.parameters["m"].value == pytest.approx(2.0, rel=0.01)
    assert {*found.undetermined[0]} == {"offset", "mu_s", "mu_d"}
    assert found.curve.law.t.min() > 0
    page = page_of(found)
    assert 'class="verdict doubtful"' in page and 'class="verdict good"' not in page
    assert "Good fit; not identifiable: mu_d, mu_s, offset" in page
