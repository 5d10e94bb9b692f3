"""Files are written whole or not at all; columns of CSV files."""

import os
from errno import ENOSPC
from pathlib import Path

import numpy as np
import pytest

from symfric.foundation.files import read_json, write_text, written
from symfric.foundation.tables import read_columns


def test_text_is_replaced_and_a_reader_of_the_old_file_sees_it_whole(tmp_path: Path) -> None:
    target = tmp_path / "new" / "folder" / "a.txt"
    write_text(target, "µ one")
    with target.open(encoding="utf-8") as reader:
        write_text(str(target), "µ two and more")
        assert reader.read() == "µ one"
    assert target.read_text(encoding="utf-8") == "µ two and more"
    assert [p.name for p in target.parent.iterdir()] == ["a.txt"]


def test_error_half_way_keeps_the_old_file_and_leaves_nothing(tmp_path: Path) -> None:
    target = tmp_path / "a.csv"
    for old in ([], ["old"]):
        for error in (RuntimeError, KeyboardInterrupt):
            for text in old:
                target.write_text(text)
            with pytest.raises(error), written(target) as temporary:
                assert (temporary.suffix, temporary.parent) == (".csv", tmp_path)
                temporary.write_text("half")
                raise error
            assert [path.read_text() for path in tmp_path.iterdir()] == old


def test_mode_is_that_of_an_ordinary_new_file_and_a_link_stays_one(tmp_path: Path) -> None:
    write_text(tmp_path / "a.txt", "")
    (tmp_path / "b.txt").touch()
    assert (tmp_path / "a.txt").stat().st_mode == (tmp_path / "b.txt").stat().st_mode
    (tmp_path / "link.txt").symlink_to(tmp_path / "a.txt")
    write_text(tmp_path / "link.txt", "new")
    assert (tmp_path / "link.txt").is_symlink()
    assert (tmp_path / "a.txt").read_text() == "new"


def test_places_that_hold_no_file_are_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "file").write_text("")
    (tmp_path / "a").symlink_to(tmp_path / "b")
    (tmp_path / "b").symlink_to(tmp_path / "a")
    circle = r"output '.*': expected a .*, got (a circle|too many)"
    missing = Path(f"/none-{os.getpid()}")  # of this run alone: a defect may make it
    for place, message in (
        (".", r"output '.*': expected a file name, got a folder"),
        ("pipe", "expected a file name, got a device"),
        ("file/below.txt", r"expected a folder, got (the file|not a dir)"),
        ("a" * 300, "expected a file name, got file name too long"),
        ("a", circle), ("a/c.txt", circle),
        (missing / "below" / "x.png", "expected a folder that exists, got none named '/none-"),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=message):
            write_text(tmp_path / place, "")
    assert (tmp_path / "pipe").is_fifo()
    assert not missing.exists()


def test_a_full_disk_is_reported_and_leaves_no_file(tmp_path: Path) -> None:
    message = r"output '.*a.txt': expected space on the disk, got no space"
    with pytest.raises(ValueError, match=message), written(tmp_path / "a.txt"):
        raise OSError(ENOSPC, os.strerror(ENOSPC))
    assert list(tmp_path.iterdir()) == []


def test_json_of_a_file_is_an_object(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    for text in ("{", "[1]", "[" * 100_000, "\ud800".encode(errors="surrogatepass"), "1"):
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        with pytest.raises(ValueError, match=r"case '.*a.json': expected a case, got something e"):
            read_json("case", path, "a case")
    path.write_text('{"a": 1}')
    assert read_json("case", path, "a case") == {"a": 1}
    with pytest.raises(ValueError, match="got no such file"):
        read_json("case", tmp_path / "none.json", "a case")


WANTED = {"t": (("t", "time"), "s"), "F": (("F", "force"), "N")}


def table(folder: Path, text: str) -> dict[str, list[float]]:
    (folder / "a.csv").write_text(text, encoding="utf-8")
    found = read_columns(folder / "a.csv", WANTED)
    return {name: column.tolist() for name, column in found.items()}


def test_units_become_si_and_other_columns_are_left_out(tmp_path: Path) -> None:
    text = "note;force [kN];time [ms]\nx;1;0\n\ny;2;500\n"
    assert table(tmp_path, text) == {"t": [0.0, 0.5], "F": [1000.0, 2000.0]}
    assert table(tmp_path, "F,t [s]\n3,1\n") == {"t": [1.0], "F": [3.0]}
    assert table(tmp_path, "F,t [s]\n3,1,\n") == {"t": [1.0], "F": [3.0]}  # a comma at the end
    assert table(tmp_path, "F [MN],t [ns]\n3,1\n") == {"t": [1e-9], "F": [3e6]}
    # recorders of years and of decimal commas
    text = "t [a];F [kN]\n0;1,5\n0,5;2.5\n"
    assert table(tmp_path, text) == {"t": [0.0, 15778800.0], "F": [1500.0, 2500.0]}


def test_a_rate_is_a_length_over_a_time(tmp_path: Path) -> None:
    for unit, text, factor in (
        ("m/s", "mm/a", 1e-3 / 31557600), ("m/s", "m/min", 1 / 60), ("rad/s", "°/s", np.pi / 180),
        ("rad/s", "rev/min", np.pi / 30), ("rad/s", "rpm", np.pi / 30),
    ):  # fmt: skip
        (tmp_path / "a.csv").write_text(f"v [{text}]\n2\n", encoding="utf-8")
        found = read_columns(tmp_path / "a.csv", {"v": (("v",), unit)})
        assert found["v"][0] == pytest.approx(2 * factor, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "read 'a.csv': expected a header such as 't [s], x [m], force [N]', got an empty"),
        ("F,t [J]\n1,2\n", "column 't [J]': expected a unit of s, ms, us, µs, min, h, d, a, yr in"),
        ("F [m],t [s]\n", "column 'F [m]': expected a unit of N, mN, kN in brackets, got m"),
        ("F,force,t [s]\n", "expected one column for F, got 'F', 'force'"),
        ("x,t [s]\n", "expected a column 'F [N]', got x, t [s]; check the header"),
        ("F,t [s]\n1,2\n1,2,5,3\n", "row 3: expected 2 cells as in the header, got 4; write numb"),
        ("F,t [s]\n1\n", "column 't [s]', row 2: expected a number, got ''"),
        ("F;t [s]\n1,5,0;2\n", "column 'F', row 2: expected a number, got '1,5,0'"),
        ("F [N/s];t [m]\n1;2\n", "column 't [m]': expected a unit of s, ms"),
        (f"F,t [s]\n{'1' * 200_000},2\n", "expected rows of short cells, got field larger than"),
    ],
)
def test_what_cannot_be_read_is_refused_with_its_place(
    tmp_path: Path, text: str, message: str
) -> None:
    with pytest.raises(ValueError) as caught:
        table(tmp_path, text)
    assert message in str(caught.value)
    assert len(str(caught.value)) < 300


def test_folders_missing_files_and_other_bytes_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="expected a file, got nothing there"):
        read_columns(tmp_path / "none.csv", WANTED)
    with pytest.raises(ValueError, match="expected a file, got a folder"):
        read_columns(tmp_path, WANTED)
    (tmp_path / "a.csv").write_bytes(np.arange(200, dtype=np.uint8).tobytes())
    with pytest.raises(ValueError, match="expected UTF-8 text, got other bytes"):
        read_columns(tmp_path / "a.csv", WANTED)
