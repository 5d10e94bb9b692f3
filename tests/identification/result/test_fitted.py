"""What a fit says of itself: numbers, text, errors, other data."""

from math import isnan

import numpy as np
import pytest
from fits import TRUTH, make, record

from identification.data.dataset import Dataset
from identification.result.fitted import Fitted
from identification.result.outcome import interval, percent, rounded, text_of
from identification.result.parts import Estimate
from symfric.foundation.status import Status
from symfric.laws import Stribeck
from symfric.model import Model


@pytest.fixture(scope="module")
def good() -> Fitted:
    return make(records=3, starts=3)


@pytest.fixture(scope="module")
def wrong() -> Fitted:
    return make("coulomb+viscous", records=2, starts=1)


def test_the_truth_lies_inside_the_intervals_and_white_noise_stays_white(good: Fitted) -> None:
    assert good.status is Status.SOLVED
    for name in ("mu_s", "mu_d", "v_s", "sigma_2"):
        e = good.parameters[name]
        assert abs(e.value - getattr(TRUTH, name)) < 4 * e.standard_error
        assert e.low < e.value < e.high
        assert e.standard_error == pytest.approx(e.white_error, rel=0.3)


def test_held_parameters_give_the_reason_and_those_of_records_are_separate(good: Fitted) -> None:
    held = {n: e for n, e in good.parameters.items() if e.fixed}
    assert held.keys() == {"delta", "v_eps"}
    assert all(e.note and e.low is None for e in held.values())
    assert [n for n, e in good.parameters.items() if e.nuisance] == [f"bias[{k}]" for k in range(3)]
    assert good.values["delta"] == 2.0
    assert len(good.names) == 7
    assert good.correlation.shape == (7, 7)


def test_coefficients_under_one_newton_are_forces(good: Fitted) -> None:
    units = {n: e.unit for n, e in good.parameters.items()}
    assert (units["mu_s"], units["delta"], units["sigma_2"]) == ("N", "1", "N s/m")


def test_law_and_model_hold_the_numbers(good: Fitted) -> None:
    assert isinstance(good.law, Stribeck)
    assert float(good.law.mu_s) == good.values["mu_s"]
    assert isinstance(good.model, Model)
    assert {v.name: v.start for v in good.model.p}["mu_s"] == good.values["mu_s"]
    assert good.drive is None


def test_errors_are_those_of_the_residuals(good: Fitted) -> None:
    r = good.live.point.evaluation.r
    for k in range(3):
        e, mine = good.errors[f"run {k + 1}", "force"], r[1500 * k : 1500 * (k + 1)]
        size = np.linalg.norm(record(k + 1)[0]["force"])
        assert e.rms == pytest.approx(np.sqrt(np.mean(mine**2)))
        assert e.relative == pytest.approx(100 * np.linalg.norm(mine) / size)
        assert (e.largest, e.rows, e.unit) == (np.abs(mine).max(), 1500, "N")
        assert e.effective > 1000


def test_other_data_get_their_own_bias_and_nothing_else(good: Fitted) -> None:
    errors = good.validate(record(6))
    assert list(errors) == [("run 6", "force")]
    assert errors["run 6", "force"].rms == pytest.approx(0.5, rel=0.05)  # bias -0.3 is estimated
    assert isnan(errors["run 6", "force"].effective)
    t = np.linspace(0, 1, 100)
    with pytest.raises(ValueError, match="force"):
        good.validate(Dataset.of(t=t, v=t))
    with pytest.raises(ValueError, match="validate: expected data"):
        good.validate(3)  # pyright: ignore[reportArgumentType]


def test_a_wrong_model_is_called_doubtful_at_the_top(wrong: Fitted) -> None:
    lines = str(wrong).splitlines()
    assert lines[0] == "coulomb+viscous fitted by ForceUnderVelocity(): DOUBTFUL"
    assert "residuals of force[" in " ".join(line.strip() for line in lines[1:8])
    e = wrong.parameters["mu_d"]
    assert e.standard_error > 5 * e.white_error
    assert repr(wrong) == "<Fitted coulomb+viscous: DOUBTFUL>"


def test_the_text_fits_80_columns_and_holds_every_number(good: Fitted, wrong: Fitted) -> None:
    for fit in (good, wrong):
        text = text_of(fit)
        assert max(map(len, text.splitlines())) <= 80
        for name, e in fit.parameters.items():
            row = [name, rounded(e.value, e.standard_error)]
            assert any(line.split()[:2] == row for line in text.splitlines())


def test_what_is_not_identifiable_has_no_interval() -> None:
    e = Estimate(8.2e-12, "N", 2.5, low=4.2e-142, high=1.593819374e119)
    assert interval(e) == "not identifiable"
    assert percent(e.relative_error) == "> 10000 %"


@pytest.mark.parametrize(("value", "error", "text"), [
    (95.10893, 0.1085, "95.11"), (0.00123456, 3e-6, "0.0012346"), (27.9, 300.0, "28"),
    (-1234.567, 0.5, "-1234.57"), (0.0, 0.1, "0"), (2.0, None, "2"),
])  # fmt: skip
def test_numbers_have_the_digits_that_their_error_leaves(
    value: float, error: float | None, text: str
) -> None:
    assert rounded(value, error) == text
