"""Files are written whole or not at all."""

import os
from errno import ENOSPC
from pathlib import Path

import pytest

from symfric.foundation.files import read_json, write_text, written


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
    for place, message in (
        (".", r"output '.*': expected a file name, got a folder"),
        ("pipe", "expected a file name, got a device"),
        ("file/below.txt", r"expected a folder, got (the file|not a dir)"),
        ("a" * 300, "expected a file name, got file name too long"),
        ("a", circle), ("a/c.txt", circle),
        ("/a-folder-nobody-has/below/x.png", "expected a folder that exists, got none named '/a-f"),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=message):
            write_text(tmp_path / place, "")
    assert (tmp_path / "pipe").is_fifo()
    assert not Path("/a-folder-nobody-has").exists()


def test_a_full_disk_is_said_and_leaves_nothing(tmp_path: Path) -> None:
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
