"""What a fit in closed loop says of the law that made the data, and of another one."""

import pytest

from identification.data.synthetic import synthetic_drive_data
from identification.fit import Fit
from identification.residuals.closed_loop import ClosedLoop
from symfric.foundation.status import Status


def test_the_law_that_made_the_data_is_believed() -> None:
    data = synthetic_drive_data(speeds=(0.01, 0.05), force="command")
    fit = Fit(ClosedLoop(), "stribeck", data, starts=1, fixed={"v_eps": 1e-4}).solve()
    mass = fit.parameters["m"]
    assert fit.status is Status.SOLVED
    assert mass.standard_error is not None
    assert abs(mass.value - 95.0) < mass.standard_error < 0.02


def test_another_law_is_doubtful() -> None:
    data = synthetic_drive_data(speeds=(0.01, 0.05), force="command")
    fit = Fit(ClosedLoop(), "coulomb+viscous", data, starts=1).solve(throw=False)
    assert fit.status is Status.DOUBTFUL


@pytest.mark.slow
def test_mass_has_no_bias_and_the_fit_no_doubt() -> None:
    """Although the law is held at another width of its step (8e-5 m/s) than made the data."""
    errors = list[float]()
    for seed in range(10):
        data = synthetic_drive_data(speeds=(0.004, 0.02, 0.08), seed=seed, force="command")
        fit = Fit(ClosedLoop(), "stribeck", data).solve()
        mass = fit.parameters["m"]
        assert fit.status is Status.SOLVED
        assert mass.standard_error is not None
        errors.append((mass.value - 95.0) / mass.standard_error)
    assert abs(sum(errors)) / len(errors) < 1.0
