"""Runs as tables of pandas and data sets of xarray."""

from typing import Any

import numpy as np
import pytest

from symfric.integrator import simulate
from symfric.laws import BrownMcPhee
from symfric.results import stored
from symfric.results.trajectory import Trajectory
from symfric.scenes import Pendulum


@pytest.fixture(scope="module")
def run() -> Trajectory:
    return simulate(Pendulum(BrownMcPhee()).model(), 0.2, samples=11)


def test_a_table_of_pandas(run: Trajectory) -> None:
    pandas: Any = pytest.importorskip("pandas", reason="needs the package pandas")
    frame = run.to_dataframe()
    assert isinstance(frame, pandas.DataFrame)
    assert list(frame.columns) == list(run.units)
    assert frame.index.name == "t"
    np.testing.assert_array_equal(frame.index.to_numpy(), run.t)
    np.testing.assert_array_equal(frame["phi"].to_numpy(), run["phi"])
    detail = next(iter(run.details))
    some = run.to_dataframe("phi", detail)
    assert list(some.columns) == ["phi", detail]
    assert some.attrs["units"] == {"t": "s", "phi": "rad", detail: run.details[detail]}


def test_a_data_set_of_xarray(run: Trajectory) -> None:
    pytest.importorskip("xarray", reason="needs the package xarray")
    data = run.to_xarray()
    assert set(data.data_vars) == set(run.units)
    assert {name: array.attrs["units"] for name, array in data.items()} == run.units
    assert data["t"].attrs["units"] == "s"
    assert data.attrs["scene"] == "pendulum"
    np.testing.assert_array_equal(data["phi"].values, run["phi"])


def test_without_the_packages_there_is_a_sentence(
    run: Trajectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(name: str) -> Any:
        raise ImportError(name)

    monkeypatch.setattr(stored, "import_module", none)
    with pytest.raises(ImportError, match="to_dataframe: expected the package pandas, got none"):
        run.to_dataframe()
    with pytest.raises(ImportError, match="pip install xarray"):
        run.to_xarray()
