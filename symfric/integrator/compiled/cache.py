"""Compiled code on disk: whole, of this user, and not more than a given size of it.

A library is loaded into the process, so nobody else may be able to write it. The folder is the
user's (or root's), only its owner may write it, and each file in it likewise; links, pipes and
devices are passed over. The name of a file ends with a hash of its content: one that is truncated
or damaged is not the file of that name, and is made again.
"""

import hashlib
import os
import stat
import sys
import tempfile
import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import final

MOST_BYTES = 256 * 2**20
"""The oldest files go when a cache grows beyond this; a step of a robot has half a megabyte."""
STALE = 86400.0
"""Seconds after which an unfinished file is one of a process that was killed."""


def caches() -> Iterator["Cache"]:
    """Where compiled code is kept: in `$SYMFRIC_CACHE` alone, else in the user's cache folder, and
    where that cannot be written in a folder of the user among temporary files.
    """
    chosen = os.environ.get("SYMFRIC_CACHE")
    if chosen:
        yield Cache(Path(chosen))
        return
    with suppress(RuntimeError):  # nobody knows a home
        yield Cache(users_folder() / "symfric")
    user = str(os.getuid()) if hasattr(os, "getuid") else "user"
    yield Cache(Path(tempfile.gettempdir()) / f"symfric-{user}")


def users_folder() -> Path:
    """Where the system keeps caches of the user.

    Raises:
        RuntimeError: the user has no home.
    """
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home())
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


def trusted(found: os.stat_result) -> bool:
    """Whether only this user or root may write what has this status."""
    if not hasattr(os, "getuid"):
        return True
    return found.st_uid in (0, os.getuid()) and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


@final
@dataclass(frozen=True)
class Cache:
    """A folder of shared libraries, `<key>-<hash of the content>.so`."""

    folder: Path

    def find(self, key: str) -> Path | None:
        """The file of `key`, whole and trusted; None where there is none."""
        try:
            if not trusted(self.folder.stat()):
                return None
            names = sorted(name for name in os.listdir(self.folder) if name.startswith(f"{key}-"))
        except OSError:
            return None
        return next((self.folder / n for n in names if _whole(self.folder / n)), None)

    @contextmanager
    def new(self, key: str) -> Generator[Path]:
        """A temporary file in the folder that is kept under `key` when the block ends well.

        Raises:
            OSError: the folder cannot be made or written, or is somebody else's.
        """
        temporary = self.begin(key)
        try:
            yield temporary
            self.keep(key, temporary)
        finally:
            with suppress(FileNotFoundError):
                temporary.unlink()

    def begin(self, key: str) -> Path:
        """An empty temporary file in the folder; raises as `new` does."""
        self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = self.folder.stat()
        if not trusted(found) and hasattr(os, "getuid") and found.st_uid == os.getuid():
            self.folder.chmod(0o700)
        if not trusted(self.folder.stat()):
            raise OSError(0, "others may write there")
        handle, name = tempfile.mkstemp(prefix=f".{key}-", suffix=".so", dir=self.folder)
        os.close(handle)
        return Path(name)

    def keep(self, key: str, temporary: Path) -> None:
        """Keep a temporary file under `key`."""
        content = temporary.read_bytes()
        temporary.chmod(0o700)
        temporary.replace(self.folder / f"{key}-{_digest(content)}.so")

    def evict(self) -> None:
        """Remove the files used longest ago until the others fit, and unfinished ones."""
        found: list[tuple[float, int, Path]] = []
        for path in self.folder.glob("*.so"):
            with suppress(OSError):
                status = path.lstat()
                found.append((status.st_mtime, status.st_size, path))
        found.sort(reverse=True)
        total = 0
        for age, (used, size, path) in enumerate(found):
            total += size
            unfinished = path.name.startswith(".")
            stale = unfinished and time.time() - used > STALE
            if stale or (total > MOST_BYTES and age and not unfinished):
                with suppress(OSError):
                    path.unlink()


def _whole(path: Path) -> bool:
    """Whether the regular file at `path` is trusted, and has the content its name tells of.

    It counts as used now.
    """
    try:
        found = path.lstat()
        if not stat.S_ISREG(found.st_mode) or not trusted(found):
            return False
        whole = path.stem.endswith(f"-{_digest(path.read_bytes())}")
    except OSError:
        return False
    with suppress(OSError):
        os.utime(path)
    return whole


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:32]
