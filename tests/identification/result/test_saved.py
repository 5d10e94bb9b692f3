"""A fit in a file of its own: exact, with the problem that it solved."""

import copy
import json
import pickle
from pathlib import Path

import numpy as np
import pytest

from identification import Fit, InverseDynamics, load_fit, synthetic_drive_data, tied
from identification.data.dataset import Dataset
from identification.result.fitted import Fitted
from symfric import load_run
from symfric.foundation.status import Status


@pytest.fixture(scope="module")
def data() -> Dataset:
    return synthetic_drive_data(speeds=(0.01, 0.05), dwell=0.3)


@pytest.fixture(scope="module")
def fit(data: Dataset) -> Fitted:
    return Fit(InverseDynamics(), "stribeck", data, starts=1).solve(throw=False)


def through_file(fit: Fitted, folder: Path) -> Fitted:
    fit.save(folder / "fit.npz")
    return load_fit(folder / "fit.npz")


def test_all_of_a_fit_comes_back_to_the_bit(fit: Fitted, data: Dataset, tmp_path: Path) -> None:
    copies = through_file(fit, tmp_path), pickle.loads(pickle.dumps(fit)), copy.deepcopy(fit)
    for back in (*copies, through_file(copies[0], tmp_path)):
        assert str(back) == str(fit)
        assert json.dumps(back.to_dict()) == json.dumps(fit.to_dict())
        assert back.parameters == fit.parameters
        np.testing.assert_array_equal(back.correlation, fit.correlation)
        for one, other in zip(back.series, fit.series, strict=True):
            np.testing.assert_array_equal(one.residual.y, other.residual.y)  # JSON has six digits
        assert back.live is None
        assert back.model.signals == fit.model.signals
    assert repr(copies[0].validate(data)) == repr(fit.validate(data))  # with NaN, which equals none
    ours, theirs = (f.profile("mu_d", points=2) for f in (fit, copies[0]))
    np.testing.assert_array_equal(ours.rise, theirs.rise)
    np.testing.assert_array_equal(ours.values, theirs.values)


def test_requests_made_with_functions_keep_their_numbers(data: Dataset, tmp_path: Path) -> None:
    rule = tied(lambda p: 1.4 * p["mu_d"])
    made = Fit(InverseDynamics(), "stribeck", data, free={"mu_s": rule}, starts=1)
    back = through_file(made.solve(throw=False), tmp_path)
    assert back.values["mu_s"] == pytest.approx(1.4 * back.values["mu_d"], rel=1e-12)
    with pytest.raises(ValueError, match=r"validate: expected a fit of this process.*functions"):
        back.validate(data)


def test_files_of_other_formats_are_distinguished(fit: Fitted, tmp_path: Path) -> None:
    fit.save(tmp_path / "fit.npz")
    with pytest.raises(ValueError, match=r"of the kind 'symfric run', got a 'symfric fit'"):
        load_run(tmp_path / "fit.npz")


def test_a_table_of_parameters(fit: Fitted) -> None:
    pytest.importorskip("pandas", reason="pandas is not installed")
    frame = fit.to_dataframe()
    assert list(frame.index) == list(fit.parameters)
    assert frame.loc["mu_s", "value"] == fit.values["mu_s"]
    assert frame.loc["m", "unit"] == "kg"
    assert frame.attrs["status"] == fit.status.name in Status.__members__


def test_a_notebook_shows_verdict_intervals_and_picture(fit: Fitted) -> None:
    page = fit._repr_html_()
    assert page.count("data:image/png;base64,") == 1
    assert fit.status.name in page
    for name in (name for name in fit.names if "[" not in name):  # not those of a record
        assert f">{name}<" in page
        assert f">{fit.parameters[name].low:.6g}<" in page
