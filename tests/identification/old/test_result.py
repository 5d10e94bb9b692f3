import json
from pathlib import Path

import numpy as np
import pytest

from identification import Estimate, Identification
from symfric import simulate


def test_interval_takes_the_larger_error() -> None:
    assert Estimate(10.0, "N", 1.0, 2.0).lower95 == pytest.approx(10 - 3.919928)
    assert Estimate(10.0, "N", 3.0, 2.0).upper95 == pytest.approx(10 + 5.879892)


def test_no_error_no_interval() -> None:
    e = Estimate(1.0, "m", note="at its bound")
    assert (e.half_width, e.lower95, e.upper95) == (None, None, None)
    assert e.times(2.0, "N").standard_error is None


def test_level_is_a_scaled_estimate() -> None:
    level = Estimate(0.2, "1", 0.01, 0.02).times(50.0, "N")
    assert (level.value, level.standard_error, level.block_error) == pytest.approx((10, 0.5, 1.0))


def test_json_holds_everything_and_no_nan(stribeck: Identification, tmp_path: Path) -> None:
    stribeck.to_json(tmp_path / "found.json")
    read = json.loads((tmp_path / "found.json").read_text())
    assert read["law"] == "stribeck"
    assert set(read["parameters"]["m"]) >= {"value", "standard_error", "unit"}
    assert read["parameters"]["N"]["standard_error"] is None
    assert read["parameters"]["N"]["fixed"] is True
    assert read["errors"]["force_relative"] == stribeck.errors.force_relative
    assert read["validation"]["closed_loop"]["x"] == read["errors"]["closed_loop"]["x"]
    assert np.diag(read["correlation"]["matrix"]).tolist() == pytest.approx([1.0] * 6)
    assert read["correlation"]["names"] == list(stribeck.names)


def test_fitted_drive_simulates(stribeck: Identification) -> None:
    moved = simulate(stribeck.drive.model(), 0.1, u={"force": 60.0})
    assert 0 < moved.final["x"] < 0.5 * 60 / 95 * 0.1**2


def test_fitted_law_is_the_one_in_the_drive(stribeck: Identification) -> None:
    assert stribeck.fitted_law.force(1.0, 1.0) == pytest.approx(
        stribeck.parameters["mu_d"].value + stribeck.parameters["sigma_2"].value
    )
