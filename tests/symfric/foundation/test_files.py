"""Files are written whole or not at all."""

import os
from errno import ENOSPC
from pathlib import Path

import pytest

from symfric.foundation.files import read_json, write_text, written


def test_text_is_written_and_replaced(tmp_path: Path) -> None:
    target = tmp_path / "new" / "folder" / "a.txt"
    write_text(target, "µ one")
    write_text(str(target), "µ two")
    assert target.read_text(encoding="utf-8") == "µ two"
    assert [p.name for p in target.parent.iterdir()] == ["a.txt"]


def test_reader_of_the_old_file_sees_it_whole(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    target.write_text("old")
    with target.open() as reader:
        write_text(target, "new and longer")
        assert reader.read() == "old"


class Stop(BaseException):
    """Such as KeyboardInterrupt."""


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt, Stop])
def test_error_half_way_keeps_the_old_file_and_leaves_nothing(
    tmp_path: Path, error: type[BaseException]
) -> None:
    target = tmp_path / "a.csv"
    target.write_text("old")
    with pytest.raises(error), written(target) as temporary:
        temporary.write_text("half")
        raise error
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_error_half_way_makes_no_file(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError), written(tmp_path / "a.csv"):
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []


def test_temporary_file_has_the_ending_of_the_target(tmp_path: Path) -> None:
    with written(tmp_path / "a.png") as temporary:
        assert temporary.suffix == ".png"
        assert temporary.parent == tmp_path


def test_mode_is_that_of_an_ordinary_new_file(tmp_path: Path) -> None:
    write_text(tmp_path / "a.txt", "")
    (tmp_path / "b.txt").touch()
    assert (tmp_path / "a.txt").stat().st_mode == (tmp_path / "b.txt").stat().st_mode


def test_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "real.txt").write_text("old")
    (tmp_path / "link.txt").symlink_to(tmp_path / "real.txt")
    write_text(tmp_path / "link.txt", "new")
    assert (tmp_path / "link.txt").is_symlink()
    assert (tmp_path / "real.txt").read_text() == "new"


def test_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"output '.*': expected a file name, got a folder"):
        write_text(tmp_path, "")


def test_device_is_refused_and_stays_one(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(ValueError, match=r"expected a file name, got a device"):
        write_text(pipe, "")
    assert pipe.is_fifo()


def test_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match=r"expected a folder, got (the file|not a dir)"):
        write_text(tmp_path / "file" / "below.txt", "")


def test_name_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"expected a file name, got file name too long"):
        write_text(tmp_path / ("a" * 300), "")


def test_no_folder_grows_directly_below_the_root() -> None:
    """`--plot /nonexist/x.png` made /nonexist."""
    path = Path("/a-folder-nobody-has/below/x.png")
    with pytest.raises(ValueError, match=r"expected a folder that exists, got none named '/a-fol"):
        write_text(path, "")
    assert not path.parents[1].exists()


def test_a_circle_of_links_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a").symlink_to(tmp_path / "b")
    (tmp_path / "b").symlink_to(tmp_path / "a")
    with pytest.raises(ValueError, match=r"output '.*': expected a .*, got (a circle|too many)"):
        write_text(tmp_path / "a", "")
    with pytest.raises(ValueError, match=r"output '.*': expected a .*, got (a circle|too many)"):
        write_text(tmp_path / "a" / "c.txt", "")


def test_a_full_disk_is_said_and_leaves_nothing(tmp_path: Path) -> None:
    with (
        pytest.raises(
            ValueError, match=r"output '.*a.txt': expected space on the disk, got no space"
        ),
        written(tmp_path / "a.txt"),
    ):
        raise OSError(ENOSPC, os.strerror(ENOSPC))
    assert list(tmp_path.iterdir()) == []


def test_json_of_a_file_is_an_object(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    for text in ("{", "[1]", "[" * 100_000, "\ud800".encode(errors="surrogatepass"), "1"):
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        with pytest.raises(
            ValueError, match=r"case '.*a.json': expected a case, got something else"
        ):
            read_json("case", path, "a case")
    path.write_text('{"a": 1}')
    assert read_json("case", path, "a case") == {"a": 1}
    with pytest.raises(ValueError, match="got no such file"):
        read_json("case", tmp_path / "none.json", "a case")
