"""Records shared by the tests: the EMPS benchmark, where it is on disk, and simulated drives."""

from pathlib import Path

import pytest

from identification import Dataset, Filter, Identification, identify, read_data
from identification.old.synthetic import synthetic_drive_data

EMPS = Path(__file__).resolve().parents[3] / "shared" / "data" / "EMPS"


def _emps(name: str) -> Dataset:
    path = EMPS / name
    if not path.is_file():
        pytest.skip("the EMPS record is not on this machine (../shared/data/EMPS)")
    return read_data(path)


@pytest.fixture(scope="session")
def emps() -> Dataset:
    return _emps("DATA_EMPS.mat")


@pytest.fixture(scope="session")
def emps_pulses() -> Dataset:
    return _emps("DATA_EMPS_PULSES.mat")


@pytest.fixture(scope="session")
def emps_symmetric(emps: Dataset, emps_pulses: Dataset) -> Identification:
    return identify(emps, "coulomb+viscous", validate=emps_pulses)


@pytest.fixture(scope="session")
def emps_directions(emps: Dataset, emps_pulses: Dataset) -> Identification:
    return identify(emps, "asymmetric(coulomb+viscous)", validate=emps_pulses)


@pytest.fixture(scope="session")
def stage() -> Dataset:
    """A short noisy record of the default drive: Stribeck, 28 N static and 20 N dynamic."""
    return synthetic_drive_data(speeds=(0.004, 0.01, 0.03, 0.1), dwell=0.5)


@pytest.fixture(scope="session")
def stribeck(stage: Dataset) -> Identification:
    filter = Filter(100.0, 10, v_min=1e-3)
    return identify(stage, "stribeck", validate=stage, filter=filter, folds=3)
