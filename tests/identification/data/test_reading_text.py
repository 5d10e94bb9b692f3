from math import cos, sin
from pathlib import Path

import numpy as np
import pytest

from identification.data.dataset import Dataset

T = np.linspace(0.0, 0.99, 100)
TABLE = np.column_stack([T, np.sin(T), np.cos(T)])
HEADER = ["t [s]", "x [m]", "force [N]"]


def text(
    header: str,
    delimiter: str = ",",
    decimal: str = ".",
    table: np.ndarray = TABLE,
    end: str = "\n",
) -> str:
    rows = [delimiter.join(map(repr, row)).replace(".", decimal) for row in table.tolist()]
    return end.join([*([header] if header else []), *rows]) + end


def read(folder: Path, content: str | bytes, name: str = "log.csv", **options: object) -> Dataset:
    raw = content if isinstance(content, bytes) else content.encode()
    (folder / name).write_bytes(raw)
    return Dataset.read(folder / name, **options)  # pyright: ignore[reportArgumentType]


SEMICOLON = text(";".join(HEADER), ";", ",")
DIALECTS = {
    "comma": text(",".join(HEADER)),
    "semicolon": text(";".join(HEADER), ";"),
    "semicolon, decimal comma": SEMICOLON,
    "tab, decimal comma": text("\t".join(HEADER), "\t", ","),
    "spaces, decimal comma": text("t/s x/m F/N", "  ", ","),
    "tab": text("\t".join(HEADER), "\t"),
    "byte order mark": "\ufeff" + text(",".join(HEADER)),
    "UTF-16": text("\t".join(HEADER), "\t").encode("utf-16"),
    "carriage returns": text(",".join(HEADER), end="\r\n"),
    "empty lines": text(",".join(HEADER), end="\n\n"),
    "quotes": text('"t [s]","x [m]","force [N]"').replace("0.0,0.0,", '"0.0","0.0",', 1),
    "spaces round the cells": text(" t [s] , x [m] , force [N]", " , "),
    "comments first": "# rig 3, 2024-01-01\n% operator: A, B, C\n" + text(",".join(HEADER)),
    "title lines": "Recorder 7\nRate;100\n\n" + SEMICOLON,
    "comment in the middle": text(",".join(HEADER)).replace("\n0.5,", "\n# pause\n0.5,", 1),
    "header is a comment": text("# t [s] x_m F_N".replace(" [s]", "_s"), " "),
    "row of units": text("time\tpos\ttorque\ns\tm\tN", "\t"),
    "row of units in brackets": text("time;pos;Force\n[s];[m];[N]", ";"),
    "units in parentheses": text("Time (s),Position (m),Force (N)"),
    "units after a slash": text("t / s;x / m;F / N", ";", ","),
    "units at the end of the name": text("time_s,pos_m,force_N"),
    "other order and units": text(
        "F [mN],position [mm],t [ms]", table=TABLE[:, ::-1] * np.array([1e3, 1e3, 1e3])
    ),
    "trailing delimiter": text(",".join(HEADER)).replace("\n", ",\n"),
    "leading spaces": text("t_s x_m F_N", "   ").replace("\n", "\n   "),
}
ENCODER = text("clock [s],enc_3 [mm],u [N]", table=TABLE * np.array([1, 1e3, 1]))
CALLS: dict[str, tuple[str | bytes, dict[str, object]]] = {
    **{name: (content, {}) for name, content in DIALECTS.items()},
    "units of the call": (text("time,x,force"), {"units": "m, N"}),
    "units by channel": (text("time [s],x,force"), {"units": {"x": "m", "force": "N"}}),
    "names of the call": (text("", " "), {"columns": ["t", "x", "force"], "units": "m, N"}),
    "names with units": (text(""), {"columns": HEADER}),
    "step of the call": (text("x [m],force [N]", table=TABLE[:, 1:]), {"step": 0.01}),
    "columns by name": (ENCODER, {"columns": {"t": "clock", "x": "enc_3", "force": "u [N]"}}),
}


@pytest.mark.parametrize("name", CALLS)
def test_dialects_and_calls_give_the_same_record(tmp_path: Path, name: str) -> None:
    content, options = CALLS[name]
    record = read(tmp_path, content, **options)[0]
    np.testing.assert_allclose(record.time, T, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(record["x"], np.sin(T), rtol=1e-12)
    np.testing.assert_allclose(record["force"], np.cos(T), rtol=1e-12)
    if name == "columns by name":
        np.testing.assert_array_equal(record["enc_3"], record["x"])


def test_units_and_names_of_the_call(tmp_path: Path) -> None:
    data = read(tmp_path, text("time,angle,torque"), units="deg, N mm")
    np.testing.assert_allclose(data[0]["x"], np.sin(T) * np.pi / 180, rtol=1e-12)
    np.testing.assert_allclose(data[0]["force"], 1e-3 * np.cos(T), rtol=1e-12)
    assert data.rotary and data[0].unit("force") == "N m"
    content = text("t [s],x [mm],force [N]")  # a mapping overrules the file
    np.testing.assert_allclose(read(tmp_path, content, units={"x": "m"})[0]["x"], np.sin(T))
    data = read(tmp_path, text("", ";", ","), columns=["t", "-", "force"], units="m, N")
    assert list(data[0].signals) == ["force"]


def test_points_need_no_time(tmp_path: Path) -> None:
    record = read(tmp_path, "speed;torque\n1;2\n3;5\n", units="rpm, N m", points=True)[0]
    assert record.t is None
    np.testing.assert_allclose(record["v"], np.array([1, 3]) * np.pi / 30)
    np.testing.assert_array_equal(record["F"], [2, 5])


def test_other_columns_keep_their_names_and_text_is_left_out_with_its_reason(
    tmp_path: Path,
) -> None:
    content = text("t [s],theta_2 [deg],mode").replace("1.0\n", "auto\n", 1)
    record = read(tmp_path, content)[0]
    np.testing.assert_allclose(record["theta_2"], np.sin(T) * np.pi / 180, rtol=1e-12)
    assert "mode" in record.left_out


def test_several_files_are_records_and_all_their_problems_one_error(tmp_path: Path) -> None:
    for k in range(3):
        (tmp_path / f"run{k}.csv").write_text(text(",".join(HEADER)))
    data = Dataset.read(str(tmp_path / "run*.csv"))
    assert [record.name for record in data] == ["run0.csv", "run1.csv", "run2.csv"]
    assert len(Dataset.read([tmp_path / "run0.csv", str(tmp_path / "run[12].csv")])) == 3
    for k in (0, 2):
        (tmp_path / f"run{k}.csv").write_text(text("t [s],x [m],force [V]"))
    with pytest.raises(ValueError, match=r"^read .run0\.csv., .run2\.csv.: column [^\n]*got V$"):
        Dataset.read(str(tmp_path / "run*.csv"))


def test_numbers_survive_to_the_last_bit(tmp_path: Path) -> None:
    rows = [f"{k!r},{sin(k)!r},{cos(k)!r}" for k in range(20)]
    record = read(tmp_path, "\n".join([",".join(HEADER), *rows]))[0]
    assert record["x"].tolist() == [sin(k) for k in range(20)]
