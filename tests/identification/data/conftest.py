"""Records shared by the tests of data: the EMPS benchmark, where it is on disk, and a stage."""

from pathlib import Path

import pytest

from identification.data.dataset import Dataset
from identification.data.synthetic import synthetic_drive_data

SHARED = Path(__file__).resolve().parents[4] / "shared" / "data"


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of measured data, which may be missing."""
    return SHARED


@pytest.fixture(scope="session")
def emps_files(shared_data: Path) -> Dataset:
    files = [shared_data / "EMPS" / name for name in ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat")]
    if not all(file.is_file() for file in files):
        pytest.skip("the EMPS records are not on this machine (../shared/data/EMPS)")
    return Dataset.read(files)


@pytest.fixture(scope="session")
def stage_data() -> Dataset:
    """A short noisy record of the default drive: Stribeck, 28 N static and 20 N dynamic."""
    return synthetic_drive_data(speeds=(0.004, 0.02, 0.08), seed=3)
