"""Units, columns held in Python, and rows in which a channel has no number."""

from math import pi
from pathlib import Path

import numpy as np
import pytest
from recorders import GERMAN, Frame

from identification.data.dataset import Dataset
from identification.data.units import by_channel, is_common, unit


@pytest.mark.parametrize(("text", "si", "factor"), [
    ("m", "m", 1.0), ("µm", "m", 1e-6), ("μm", "m", 1e-6), ("ms", "s", 1e-3), ("min", "s", 60.0),
    ("deg", "rad", pi / 180), ("°", "rad", pi / 180), ("°/s", "rad/s", pi / 180),
    ("mrad", "rad", 1e-3), ("rpm", "rad/s", 2 * pi / 60), ("1/min", "rad/s", 2 * pi / 60),
    ("rev/s", "rad/s", 2 * pi), ("mm/s", "m/s", 1e-3), ("mm s^-1", "m/s", 1e-3),
    ("m/s²", "m/s^2", 1.0), ("m/s2", "m/s^2", 1.0), ("m/s/s", "m/s^2", 1.0),
    ("deg/s^2", "rad/s^2", pi / 180), ("kN", "N", 1e3), ("N m", "N m", 1.0), ("Nm", "N m", 1.0),
    ("N*m", "N m", 1.0), ("N·m", "N m", 1.0), ("N mm", "N m", 1e-3), ("mNm", "N m", 1e-3),
    ("mN m", "N m", 1e-3), ("Ncm", "N m", 1e-2), ("N m s/rad", "N m s/rad", 1.0),
    ("kg m^2", "kg m^2", 1.0), ("1/s", "1/s", 1.0), ("%", "1", 0.01), ("N/(m/s)", "N s/m", 1.0),
    ("N/(mm/s)", "N s/m", 1e3), ("rad/(s K)", "rad/(K s)", 1.0), ("Pa", "Pa", 1.0),
    ("bar", "Pa", 1e5), ("J", "J", 1.0), ("krad", "rad", 1e3), ("u/min", "rad/s", 2 * pi / 60),
    ("Sec", "s", 1.0), ("-", "1", 1.0),
])  # fmt: skip
def test_unit_becomes_si(text: str, si: str, factor: float) -> None:
    found = unit(text)
    assert found.si == si
    assert found.factor == pytest.approx(factor, rel=1e-14)


def test_what_is_no_unit_is_none() -> None:
    strange = ("parsec", "counts", "N/", "mmm", "kmin", "x y", "3", "m^m", "degF", "N (s/m)^d")
    assert [*map(unit, strange)] == [None] * len(strange)


def test_short_form_reaches_every_canonical_channel() -> None:
    given = by_channel("read", "deg, N mm")
    assert given == {"x": "deg", "v": "deg/s", "a": "deg/s^2", "force": "N mm", "F": "N mm"}
    assert by_channel("read", "ms, mm, mm/s, kN")["t"] == "ms"
    assert by_channel("read", "rpm, N m")["x"] == "rad"


def test_units_need_no_brackets_unless_they_may_be_names() -> None:
    assert all(map(is_common, ("mm", "N", "Nm", "rad/s", "sec", "1/s")))
    assert not any(map(is_common, ("d", "a", "t", "T", "rot", "bar", "counts")))


T = np.arange(100) / 100


def test_arrays_are_si_unless_units_are_given() -> None:
    record = Dataset.of(t=T, x=list(T), force=T[:, None], name="rig")[0]
    assert (record.name, record.unit("x"), record.unit("force")) == ("rig", "m", "N")
    record = Dataset.of({"t [ms]": T, "x": T, "tau_1 [N mm]": T}, units="deg, N m")[0]
    np.testing.assert_allclose(record.time, 1e-3 * T)
    np.testing.assert_allclose(record["x"], T * np.pi / 180)
    np.testing.assert_allclose(record["tau_1"], 1e-3 * T)


def test_frames_are_taken_by_their_columns() -> None:
    frame = Frame({"time [s]": T, "q [deg]": T, "tau [N m]": T, "mode": np.array(["on"] * 100)})
    record = Dataset.of(frame)[0]
    np.testing.assert_allclose(record["x"], T * np.pi / 180)
    assert record.left_out["mode"].startswith("sample 0: expected a number")
    stamps = np.datetime64("2026-05-01T12:00:00") + (1000 * T).astype("timedelta64[ms]")
    record = Dataset.of(Frame({"time": stamps, "q": T, "tau": T}), units="rad, N m")[0]
    np.testing.assert_allclose(record.time, T, atol=1e-9)
    for absent in (0, 7):
        stamps[absent] = "NaT"
        record = Dataset.of(time=stamps, x=T, force=T, missing="drop")[0]
        np.testing.assert_allclose(record.time, record["x"] - record["x"][0], atol=1e-9)


def test_masked_samples_were_not_measured() -> None:
    whole = Dataset.of(t=[0, 1, 2], x=np.ma.array([1, 2, 3]))
    assert whole[0]["x"].tolist() == [1.0, 2.0, 3.0]


NAMES = {"t": "Zeit", "x": "Winkel", "force": "Moment"}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "messung.csv"
    path.write_text(GERMAN, "latin-1")
    return path


def test_rows_without_a_number_are_left_out_with_their_times(file: Path) -> None:
    (found,) = Dataset.read(file, columns=NAMES, missing="drop")
    np.testing.assert_array_equal(found.t, [0.0, 0.02, 0.04])
    np.testing.assert_allclose(found["x"], [0.0, np.pi, 2 * np.pi], rtol=1e-15)
    np.testing.assert_array_equal(found["force"], [1.0, 3.0, 5.0])
    assert "Bemerkung" in found.left_out  # not requested, so its gaps remove no row


def test_samples_of_a_step_keep_their_times() -> None:
    x = np.array([0.0, np.nan, 2.0, 3.0])
    (found,) = Dataset.of(x=x, force=x + 1, step=0.5, missing="drop")
    np.testing.assert_array_equal(found.t, [0.0, 1.0, 1.5])


TWICE = "t [s],x [m],force [N]\n0,0,1\n1,1,2\n1,1,2\n2,1,2\n3,4,5\n"


def test_duplicate_rows_are_left_out_and_standstill_stays(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text(TWICE)
    (found,) = Dataset.read(path, missing="drop")
    np.testing.assert_array_equal(found.time, [0.0, 1.0, 2.0, 3.0])
    np.testing.assert_array_equal(found["x"], [0.0, 1.0, 1.0, 4.0])  # at rest is not twice
