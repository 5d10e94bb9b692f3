"""Files of data loggers, large files, archives of optional packages."""

from pathlib import Path

import numpy as np
import pytest

from identification import Dataset

T = 0.01 * np.arange(120)
ROWS = [f"{t:.2f},{np.sin(t):.9f},{3 * np.cos(t):.9f}" for t in T]
HEADER = "t [s],x [m],force [N]"
LOGGERS = {
    "lines of text": "Recorder,X200\nOperator,Jane\nRate [Hz],100\nDate,2024-05-01",
    "settings with numbers": "Model,1200,\nSample interval,0.01,s\nPoints,200,",
    "rows of numbers": "Gains,1.0,2.0\nOffsets,0.0,0.0",
    "a second table": "Name,axis\nEnd,133\n\nName,Pos,Torque\nSampleTime[ms],10,10\nOffset,0,0",
    "a rule": "Title\n=====",
}


def written(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


@pytest.mark.parametrize("above", LOGGERS.values(), ids=LOGGERS)
def test_rows_of_a_logger_before_the_header_are_skipped(tmp_path: Path, above: str) -> None:
    text = "\n".join([*above.split("\n"), HEADER, *ROWS])
    (record,) = Dataset.read(written(tmp_path / "log.csv", text))
    assert record.size == T.size and record.units == {"x": "m", "force": "N"}
    assert record.first_row == text.split("\n").index(HEADER) + 2
    np.testing.assert_allclose(record["force"], 3 * np.cos(T), atol=1e-8)


def test_a_rule_below_the_header_is_skipped(tmp_path: Path) -> None:
    file = written(tmp_path / "a.csv", "\n".join([HEADER, "-----,-----,-----", *ROWS]))
    assert Dataset.read(file).size == T.size


def test_large_files_have_the_bits_of_small_ones(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    numbers = np.column_stack([np.arange(30_000), rng.standard_normal((30_000, 2)) * 1e-7])
    lines = [
        "# a rig",
        "t [ms];x [mm];force [kN]",
        *(";".join(map(repr, r)) for r in numbers.tolist()),
    ]
    (large,) = Dataset.read(written(tmp_path / "large.csv", "\n".join(lines)))
    assert (tmp_path / "large.csv").stat().st_size > 2**20
    (small,) = Dataset.read(written(tmp_path / "small.csv", "\n".join(lines[:3000])))
    assert large.size == 30_000 and large.first_row == small.first_row == 3
    assert large.units == small.units
    for name in small.signals:
        assert np.array_equal(large[name][: small.size], small[name])
    assert np.array_equal(large["force"], 1e3 * numbers[:, 2])
    commas = "\n".join(lines).replace(".", ",")
    (same,) = Dataset.read(written(tmp_path / "commas.csv", commas))
    assert all(np.array_equal(same[name], large[name]) for name in large.signals)
    lines[20_000] = "1;2;three"
    with pytest.raises(ValueError, match=r"row 20001: expected a number, got 'three'"):
        Dataset.read(written(tmp_path / "bad.csv", "\n".join(lines)))
    lines[20_000] = "19998;inf;1"
    with pytest.raises(ValueError, match=r"row 20001: expected a finite number, got inf"):
        Dataset.read(written(tmp_path / "inf.csv", "\n".join(lines)))
    assert Dataset.read(tmp_path / "inf.csv", missing="drop").size == 29_999


def test_columns_are_named_by_patterns(tmp_path: Path) -> None:
    text = "\n".join(["Time_1,Axis3.ActPos,Axis3.ActTorque", *ROWS])
    file = written(tmp_path / "a.csv", text)
    called = {"t": "time*", "x": "*actpos", "force": "*TORQUE"}
    data = Dataset.read(file, columns=called, units="m, N")
    assert {*data[0].signals} == {"x", "force"}
    with pytest.raises(ValueError, match=r"one column '\*act\*' for x, got 2 of them"):
        Dataset.read(file, columns=called | {"x": "*act*"}, units="m, N")
    with pytest.raises(ValueError, match=r"one column '\*vel\*' for v, got Time_1, Axis3"):
        Dataset.read(file, columns=called | {"v": "*vel*"}, units="m, N")


def test_a_problem_of_many_files_is_printed_once(tmp_path: Path) -> None:
    for k in range(10):
        written(tmp_path / f"run{k}.csv", "\n".join(["t,x [m],force [N]", *ROWS]))
    with pytest.raises(ValueError, match="expected a unit of s") as error:
        Dataset.read(str(tmp_path / "run*.csv"))
    first, *others = str(error.value).split("\n")
    assert not others
    assert first.startswith("read 'run0.csv', 'run1.csv', 'run2.csv' and 7 more: column 't'")


@pytest.mark.parametrize(("suffix", "package"), [(".h5", "h5py"), (".parquet", "pyarrow")])
def test_a_missing_package_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str, package: str
) -> None:
    monkeypatch.setitem(__import__("sys").modules, package, None)
    file = written(tmp_path / f"a{suffix}", "data")
    with pytest.raises(
        ValueError, match=rf"expected the package {package} .*pip install {package}"
    ):
        Dataset.read(file)


def test_hdf5_files_are_read_like_mat_files(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        run = file.create_group("run")
        run["t [s]"], run["x [mm]"], run["force [N]"] = T, np.sin(T), np.cos(T).reshape(1, -1)
        run["nothing"] = h5py.SoftLink("/absent")
    (record,) = Dataset.read(path, variable="run")
    np.testing.assert_allclose(record["x"], 1e-3 * np.sin(T))
    assert np.array_equal(record["force"], np.cos(T))
    with pytest.raises(ValueError, match=r"expected an HDF5 file, got a damaged"):
        Dataset.read(written(tmp_path / "bad.h5", "data"))


def test_parquet_tables_are_read(tmp_path: Path) -> None:
    pyarrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    path = tmp_path / "log.parquet"
    columns = {"t [s]": T, "x [m]": np.sin(T), "force [N]": np.cos(T), "note": ["a"] * T.size}
    parquet.write_table(pyarrow.table(columns), path)
    (record,) = Dataset.read(path)
    assert np.array_equal(record["force"], np.cos(T))
    assert "note" in record.left_out
    with pytest.raises(ValueError, match=r"expected variable= only of \.mat, .* and \.h5 files"):
        Dataset.read(path, variable="run")
    with pytest.raises(ValueError, match=r"expected a Parquet file, got a damaged"):
        Dataset.read(written(tmp_path / "bad.parquet", "data"))
