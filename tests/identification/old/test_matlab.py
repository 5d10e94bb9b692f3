from pathlib import Path

import numpy as np
import pytest

from identification import Dataset, read_data

io = pytest.importorskip("scipy.io")
T = np.linspace(0.0, 0.99, 100)


def mat(tmp_path: Path, **variables: object) -> Path:
    io.savemat(tmp_path / "log.mat", variables)
    return tmp_path / "log.mat"


def test_named_variables_are_si_columns(tmp_path: Path) -> None:
    file = mat(tmp_path, clock=T[:, None], encoder=np.sin(T), u=np.cos(T))
    data = read_data(file, {"t": "clock", "x": "encoder", "force": "u"})
    np.testing.assert_array_equal(data.x, np.sin(T))
    assert data.loop is None


def test_usual_names_need_no_mapping(tmp_path: Path) -> None:
    data = read_data(mat(tmp_path, t=T, q=np.sin(T), force=np.cos(T), dq=np.cos(T)))
    np.testing.assert_array_equal(data.v, np.cos(T))


@pytest.mark.parametrize(
    ("variables", "message"),
    [
        (
            {"t": T, "speed": T},
            "expected variables x, force, got speed, t; name them with columns=",
        ),
        ({"t": T, "x": np.eye(3), "force": T}, r"variable x: expected a vector.*\(3, 3\)"),
        ({"t": T, "x": {"a": T}, "force": T}, "variable x: expected a vector of numbers, got a st"),
        ({"t": T, "x": "text", "force": T}, "variable x: expected a vector of numbers, got text"),
        (
            {"t": T, "x": T + 1j, "force": T},
            r"variable x: .* got a matrix of complex",
        ),
        ({"t": T, "x": T[:9], "force": 1 - T}, r"expected columns of one length.*x: \(9,\)"),
    ],
)
def test_bad_variables_are_named(
    tmp_path: Path, variables: dict[str, object], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        read_data(mat(tmp_path, **variables))


def test_other_bytes_are_refused(tmp_path: Path) -> None:
    (tmp_path / "log.mat").write_bytes(b"no matlab file at all, but long enough to be read" * 9)
    with pytest.raises(ValueError, match=r"log\.mat': expected a MATLAB file, got one that is"):
        read_data(tmp_path / "log.mat")


def test_version_7_3_is_refused_with_the_way_out(tmp_path: Path) -> None:
    header = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM"
    (tmp_path / "log.mat").write_bytes(header + bytes(512))
    with pytest.raises(ValueError, match=r"version 7\.3; save it with -v7"):
        read_data(tmp_path / "log.mat")


def test_emps_force_is_gain_times_command(emps_pulses: Dataset) -> None:
    loop = emps_pulses.loop
    assert loop is not None
    assert emps_pulses.benchmark == "EMPS"
    assert (loop.kp, loop.kv) == pytest.approx((160.18, 243.45))
    assert loop.gain == pytest.approx(35.15065, rel=1e-6)
    assert set(np.unique(loop.disturbance)) == {0.0, 5.0}
    assert np.abs(emps_pulses.force).max() / loop.gain < 10.0 + 5.0
