from math import cos, sin
from pathlib import Path

import numpy as np
import pytest

from identification import read_data

T = np.linspace(0.0, 0.99, 100)


def csv(tmp_path: Path, header: str, rows: list[str] | None = None, name: str = "log.csv") -> Path:
    lines = rows or [f"{t!r},{sin(t)!r},{cos(t)!r}" for t in T.tolist()]
    file = tmp_path / name
    file.write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")
    return file


def test_columns_are_found_by_name_in_any_order(tmp_path: Path) -> None:
    rows = [f"9,{5 * t!r},{cos(t)!r},{t!r},{sin(t)!r}" for t in T.tolist()]
    data = read_data(csv(tmp_path, "spare [parsec], v [m/s],F [N], time [s],q [m]", rows))
    np.testing.assert_allclose(data.x, np.sin(T), rtol=1e-15)
    np.testing.assert_allclose(data.force, np.cos(T), rtol=1e-15)
    np.testing.assert_array_equal(data.v, 5 * T)


@pytest.mark.parametrize(
    ("header", "factors"),
    [
        ("t [ms],x [mm],force [kN]", (1e-3, 1e-3, 1e3)),
        ("t [us],x [µm],force [mN]", (1e-6, 1e-6, 1e-3)),
    ],
)
def test_units_become_si(tmp_path: Path, header: str, factors: tuple[float, float, float]) -> None:
    data = read_data(csv(tmp_path, header))
    expected = zip(factors, (T, np.sin(T), np.cos(T)), (data.t, data.x, data.force), strict=True)
    for factor, given, found in expected:
        np.testing.assert_allclose(found, factor * given, rtol=1e-15)


@pytest.mark.parametrize("delimiter", [";", "\t"])
def test_other_delimiters(tmp_path: Path, delimiter: str) -> None:
    rows = [delimiter.join(map(repr, (t, t * t, 1 - t))) for t in T.tolist()]
    data = read_data(csv(tmp_path, delimiter.join(["t [s]", "x [m]", "force [N]"]), rows))
    np.testing.assert_array_equal(data.x, T * T)


def test_columns_can_be_named(tmp_path: Path) -> None:
    file = csv(tmp_path, "t [s],encoder [mm],motor [N]")
    data = read_data(file, {"x": "encoder", "force": "motor"})
    np.testing.assert_allclose(data.x, 1e-3 * np.sin(T), rtol=1e-15)


ROWS = [f"{t!r},{t!r},{1 - t!r}" for t in T.tolist()]


@pytest.mark.parametrize(
    ("header", "rows", "message"),
    [
        ("t [s],x [m],u [N]", None, r"a column 'force \[N\]', got t \[s\], x \[m\], u \[N\]"),
        ("t [s],x [inch],force [N]", None, r"column 'x \[inch\]': expected a unit of m, mm.*inch"),
        ("t,x [m],force [N]", None, "column 't': expected a unit of s, ms, us.*got none"),
        ("t [s],x [m],q [m],F [N]", None, r"expected one column for x, got 'x \[m\]', 'q"),
        ("t [s],x [m],force [N]", [*ROWS[:5], "0.05,abc,1", *ROWS[6:]], "row 7: .*got 'abc'"),
        ("t [s],x [m],force [N]", [*ROWS[:5], "0.05,1", *ROWS[6:]], "row 7: .*number, got ''"),
        ("t [s],x [m],force [N]", [*ROWS[:5], "0.05,nan,1", *ROWS[6:]], "column x, row 7: .*nan"),
        ("t [s],x [m],force [N]", [*ROWS[:5], ROWS[4], *ROWS[6:]], "column t, row 7: .*increasing"),
        ("t [s],x [m],force [N]", ["0,0,0"], "expected at least 50 samples, got 1"),
        ("", [""], "got an empty file"),
    ],
)
def test_bad_cells_are_named(
    tmp_path: Path, header: str, rows: list[str] | None, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        read_data(csv(tmp_path, header, rows))


def test_header_alone_has_too_few_samples(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("t [s],x [m],force [N]\n")
    with pytest.raises(ValueError, match="at least 50 samples, got 0"):
        read_data(tmp_path / "log.csv")


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("log.xlsx", b"", r"expected a \.csv or \.mat file, got '\.xlsx'"),
        ("log.csv", b"\xff\xfe\x00", "expected UTF-8 text"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, name: str, content: bytes, message: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=message):
        read_data(tmp_path / name)


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"none\.csv'.*got nothing there"):
        read_data(tmp_path / "none.csv")


def test_unknown_signal_in_columns_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="expected one of t, x, v, force, got forse; did you mean"):
        read_data(csv(tmp_path, "t [s],x [m],force [N]"), {"forse": "u"})
