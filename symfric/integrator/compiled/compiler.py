"""C libraries: compiled with fixed flags, and cached on disk.

A library is loaded into the process, so no other user may be able to write it. The folder and each
file in it belong to the user (or root), and only their owner may write them; links, pipes and
devices are ignored. The name of a file ends with a hash of its content, so a truncated or damaged
file does not match its name and is compiled again.
"""

import ctypes
import hashlib
import os
import platform
import stat
import sys
import tempfile
import time
import weakref
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import final

from symfric.foundation.programs import (
    CompileError,
    Compiler,
    find_compiler,
    first_error,
    is_clang,
    needed_compiler,
)

MOST_BYTES = 256 * 2**20
"""Cache size above which the oldest files are deleted; a step of a robot has half a megabyte."""
STALE = 86400.0
"""Age [s] of an unfinished file whose process was killed."""


def caches() -> Iterator["Cache"]:
    """Yield the caches of compiled code: `$SYMFRIC_CACHE` only, or the user's and a temporary one.

    The temporary folder is used if the user's cache folder is not writable.
    """
    chosen = os.environ.get("SYMFRIC_CACHE")
    if chosen:
        yield Cache(Path(chosen))
        return
    with suppress(RuntimeError):  # the user has no home folder
        if sys.platform == "win32":
            folder = Path(os.environ.get("LOCALAPPDATA") or Path.home())
        elif sys.platform == "darwin":
            folder = Path.home() / "Library" / "Caches"
        else:
            folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        yield Cache(folder / "symfric")
    user = str(os.getuid()) if hasattr(os, "getuid") else "user"
    yield Cache(Path(tempfile.gettempdir()) / f"symfric-{user}")


def trusted(found: os.stat_result) -> bool:
    """Return True if only this user or root may write a file with this status."""
    if not hasattr(os, "getuid"):
        return True
    return found.st_uid in (0, os.getuid()) and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


@final
@dataclass(frozen=True)
class Cache:
    """Folder of shared libraries, `<key>-<hash of the content>.so`."""

    folder: Path

    def find(self, key: str) -> Path | None:
        """Return the complete and trusted file of `key`, or None if there is none."""
        try:
            if not trusted(self.folder.stat()):
                return None
            names = sorted(name for name in os.listdir(self.folder) if name.startswith(f"{key}-"))
        except OSError:
            return None
        return next((self.folder / n for n in names if _whole(self.folder / n)), None)

    def begin(self, key: str) -> Path:
        """Create an empty temporary file in the folder.

        Raises:
            OSError: the folder cannot be created or written, or belongs to another user.
        """
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
        """Rename a temporary file to the final name for `key`."""
        content = temporary.read_bytes()
        temporary.chmod(0o700)
        temporary.replace(self.folder / f"{key}-{_digest(content)}.so")

    def evict(self) -> None:
        """Delete stale unfinished files, and the least recently used ones until the others fit."""
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
    """Return True if the regular file at `path` is trusted and matches the hash in its name.

    The modification time of the file is set to the current time, to mark its use.
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


FLAGS = (
    "-O2", "-march=native", "-fno-math-errno", "-ffp-contract=off",
    "-fno-tree-pre", "-fno-code-hoisting", "-fno-gcse", "-fPIC", "-shared",
)  # fmt: skip
"""Compiler flags with the rounding of CasADi's virtual machine, so that results do not depend on
the engine: no fused multiply-add, no reciprocals (the graph shares repeated divisions instead), no
reordering. Common subexpressions have been removed already; searching for them would take a third
of the compile time.
"""

OF_GCC = ("-fno-tree-pre", "-fno-code-hoisting", "-fno-gcse")
"""Flags for gcc only; clang rejects them."""
_close: Callable[[int], None] | None = getattr(sys.modules["_ctypes"], "dlclose", None)


def key_of(source: str, compiler: Compiler, flags: tuple[str, ...]) -> str:
    """Return a hash of the source, the compiler (path, size, time), its flags and the machine.

    Code from another source, or for another processor that shares the home folder, has another key.
    """
    binary = Path(compiler.command[0]).stat()
    made_by = (compiler.command, flags, binary.st_size, binary.st_mtime_ns)
    machine = (sys.platform, platform.machine(), processor())
    return hashlib.sha256(repr((source, made_by, machine)).encode()).hexdigest()[:32]


@cache
def processor() -> str:
    """Return the processor features that `-march=native` depends on."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line for line in lines if line.startswith(("flags", "Features"))), "")


def compiled_before(source: str) -> Path | None:
    """Return the cached library of `source`, or None if it has to be compiled."""
    compiler = find_compiler()
    if compiler is None:
        return None
    key = key_of(source, compiler, FLAGS)
    return next((path for place in caches() if (path := place.find(key))), None)


def load(source: str, *names: str) -> ctypes.CDLL:
    """Load the shared library of `source`; see `library`."""
    return opened(library(source, *names), names)


def library(source: str, *names: str, flags: tuple[str, ...] = FLAGS) -> Path:
    """Return the shared library of `source`, which defines `names`; compile it if not cached.

    Several processes may call this at once: a file gets its final name only when it is complete.

    Raises:
        CompileError: no compiler, no writable cache, or an error in the source; the message quotes
            the first error.
    """
    compiler = needed_compiler()
    key, problems = key_of(source, compiler, flags), list[str]()
    for place in caches():
        try:
            path = place.find(key)
            if path is None:
                temporary = place.begin(key)
                try:
                    arguments, variables = call_of(compiler, flags, temporary)
                    compiler.run(*arguments, code=source, variables=variables)
                    opened(temporary, names)  # do not keep an unusable library
                    place.keep(key, temporary)
                except CompileError as error:
                    reason = first_error(str(error).removeprefix("compile: "))
                    raise CompileError(f"compile: {reason}") from None
                finally:
                    temporary.unlink(missing_ok=True)
                place.evict()
                path = place.find(key)
            if path is None:
                raise OSError(0, "the stored file differs from the one written")
            opened(path, names)
            return path
        except OSError as error:
            problems.append(f"{place.folder} ({error.strerror or error})")
    raise CompileError(
        f"compile: expected a folder to store and load compiled code, tried "
        f"{' and '.join(problems)}; set SYMFRIC_CACHE to a folder where that is allowed, or use "
        "backend='vm'"
    )


def call_of(
    compiler: Compiler, flags: tuple[str, ...], path: Path
) -> tuple[tuple[str, ...], dict[str, str]]:
    """Return arguments and environment variables to compile standard input to the file `path`.

    The compiler writes its temporary files to the folder of that file.
    """
    if is_clang(compiler):
        flags = tuple(flag for flag in flags if flag not in OF_GCC)
    arguments = (*flags, "-x", "c", "-", "-o", str(path), "-lm")
    return arguments, dict.fromkeys(("TMPDIR", "TMP", "TEMP"), str(path.parent))


def opened(path: Path, names: tuple[str, ...]) -> ctypes.CDLL:
    """Load the library at `path`; unload it when it is no longer referenced.

    Unloading is needed because a process can map only some 10,000 libraries.

    Raises:
        OSError: the file is not a library, or must not be loaded from its folder.
        CompileError: the library does not define one of `names`.
    """
    found = ctypes.CDLL(str(path))
    if _close is not None:
        # do not unload at exit: a thread may still run the code
        weakref.finalize(found, _close, found._handle).atexit = False
    missing = [name for name in names if not hasattr(found, name)]
    if missing:
        raise CompileError(
            f"compile: expected a library that defines {', '.join(missing)}, found none in "
            f"{path.name}; is $CC a C compiler?"
        )
    return found
