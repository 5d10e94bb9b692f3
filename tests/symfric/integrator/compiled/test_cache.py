"""Compiled code on disk: only what is whole, of this user, and a plain file; not for ever."""

import os
import stat
import sys
import tempfile
import time
from pathlib import Path

import pytest

from symfric.integrator.compiled import compiler as module
from symfric.integrator.compiled.compiler import STALE, Cache, caches, trusted, users_folder

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="owners and modes of POSIX")


@pytest.fixture
def place(tmp_path: Path) -> Cache:
    return Cache(tmp_path / "cache")


def put(place: Cache, key: str, content: bytes = b"code") -> Path:
    with place.new(key) as temporary:
        temporary.write_bytes(content)
    found = place.find(key)
    assert found is not None
    return found


def test_what_is_put_is_found_again_in_a_folder_of_ones_own(place: Cache) -> None:
    path = put(place, "k", b"abc")
    assert path.read_bytes() == b"abc"
    assert list(place.folder.iterdir()) == [path]
    assert stat.S_IMODE(place.folder.stat().st_mode) == 0o700
    assert stat.S_IMODE(path.stat().st_mode) == 0o700
    assert place.find("other") is None
    assert Cache(place.folder / "none").find("k") is None


def test_what_fails_leaves_nothing_behind(place: Cache) -> None:
    with pytest.raises(KeyboardInterrupt), place.new("k"):
        raise KeyboardInterrupt
    assert list(place.folder.iterdir()) == []


def test_damaged_files_are_not_found(place: Cache) -> None:
    """4f644ad loaded a truncated library, which is a SIGBUS."""
    for damage in (b"", b"cod", b"codf", b"code and more"):
        path = put(place, "k")
        path.write_bytes(damage)
        assert place.find("k") is None
        assert put(place, "k") == path


def test_only_plain_files_are_looked_into(place: Cache) -> None:
    """A pipe blocked 4f644ad for ever; a link leads where others may write."""
    path = put(place, "k")
    path.unlink()
    os.mkfifo(path)
    assert place.find("k") is None
    path.unlink()
    path.mkdir()
    assert place.find("k") is None
    path.rmdir()
    (place.folder / "real").write_bytes(b"code")
    path.symlink_to(place.folder / "real")
    assert place.find("k") is None


def test_what_others_may_write_is_not_found(place: Cache) -> None:
    """4f644ad ran a file that another user had put into a shared folder."""
    path = put(place, "k")
    for mode in (0o722, 0o702, 0o777):
        path.chmod(mode)
        assert place.find("k") is None
    path.chmod(0o755)
    assert place.find("k") == path
    place.folder.chmod(0o777)
    assert place.find("k") is None
    put(place, "other")
    assert stat.S_IMODE(place.folder.stat().st_mode) == 0o700


def test_trust_is_a_question_of_owner_and_mode(
    monkeypatch: pytest.MonkeyPatch, place: Cache
) -> None:
    def status(owner: int, mode: int) -> os.stat_result:
        return os.stat_result((mode, 0, 0, 1, owner, 0, 0, 0, 0, 0))

    monkeypatch.setattr(module.os, "getuid", lambda: 1000)
    assert trusted(status(1000, 0o100755))
    assert trusted(status(0, 0o100755))
    assert not trusted(status(1001, 0o100755))
    assert not trusted(status(1000, 0o100775))
    assert not trusted(status(0, 0o041777))


def test_what_belongs_to_others_is_not_found_and_not_written(
    monkeypatch: pytest.MonkeyPatch, place: Cache
) -> None:
    put(place, "k")
    real = os.getuid()
    monkeypatch.setattr(module, "trusted", lambda found: found.st_uid != real)
    assert place.find("k") is None
    with pytest.raises(OSError, match="others may write there"), place.new("k"):
        pass


def test_the_oldest_go_when_there_is_too_much(
    monkeypatch: pytest.MonkeyPatch, place: Cache
) -> None:
    """4f644ad never removed anything."""
    monkeypatch.setattr(module, "MOST_BYTES", 250)
    paths = [put(place, f"k{i}", bytes([i]) * 100) for i in range(4)]
    for i, path in enumerate(paths):
        os.utime(path, (i, i))
    assert place.find("k0") == paths[0]  # used now
    place.evict()
    assert sorted(place.folder.iterdir()) == sorted([paths[0], paths[3]])
    monkeypatch.setattr(module, "MOST_BYTES", 10)
    place.evict()
    assert list(place.folder.iterdir()) == [paths[0]]


def test_unfinished_files_go_once_their_process_must_be_dead(place: Cache) -> None:
    put(place, "k")
    fresh, stale = place.folder / ".k-a.so", place.folder / ".k-b.so"
    for path in (fresh, stale):
        path.write_bytes(b"half")
    long_ago = time.time() - STALE - 10
    os.utime(stale, (long_ago, long_ago))
    place.evict()
    assert fresh.exists()
    assert not stale.exists()
    assert place.find("k") is not None


@pytest.mark.parametrize(
    ("system", "variable"), [("linux", "XDG_CACHE_HOME"), ("win32", "LOCALAPPDATA")]
)
def test_the_folder_lies_where_the_system_keeps_caches(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, system: str, variable: str
) -> None:
    monkeypatch.delenv("SYMFRIC_CACHE", raising=False)
    monkeypatch.setattr(module.sys, "platform", system)
    monkeypatch.setenv(variable, str(tmp_path))
    assert users_folder() == tmp_path
    assert next(caches()).folder == tmp_path / "symfric"


def test_a_chosen_folder_is_the_only_one(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("SYMFRIC_CACHE", str(tmp_path / "mine"))
    assert [place.folder for place in caches()] == [tmp_path / "mine"]


def test_who_has_no_home_has_temporary_files(monkeypatch: pytest.MonkeyPatch) -> None:
    def homeless() -> Path:
        raise RuntimeError("Could not determine home directory.")

    for name in ("SYMFRIC_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    own = Path(tempfile.gettempdir()) / f"symfric-{os.getuid()}"
    assert [place.folder for place in caches()][1:] == [own]
    monkeypatch.setattr(module.Path, "home", homeless)
    assert [place.folder for place in caches()] == [own]
