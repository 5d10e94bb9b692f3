"""Find a C compiler, compile a source once, and keep the result in the user's cache."""

import ctypes
import hashlib
import os
import platform
import shlex
import shutil
import subprocess
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path

from symfric.foundation.files import written

FLAGS = (
    "-O2", "-march=native", "-fno-math-errno", "-ffp-contract=off",
    "-fno-tree-pre", "-fno-code-hoisting", "-fno-gcse", "-fPIC", "-shared",
)  # fmt: skip
"""Nothing here lets the compiler round otherwise than CasADi's virtual machine does, so that a
result does not depend on which of them ran: no fused multiply-add, no reciprocals (repeated
divisions are taken out of the graph instead), no reordering. Looking for common parts in code that
has none left would take a third of the compiler's time."""


@cache
def find_compiler() -> tuple[str, ...] | None:
    """Command of the C compiler: `$CC`, else gcc, clang or cc; None if there is none."""
    wanted = os.environ.get("CC")
    candidates = [shlex.split(wanted)] if wanted else [["gcc"], ["clang"], ["cc"]]
    for command in candidates:
        path = shutil.which(command[0]) if command else None
        if path:
            return (path, *command[1:])
    return None


def cache_folder() -> Path:
    """Where compiled code is kept: `$SYMFRIC_CACHE`, else the user's cache folder."""
    chosen = os.environ.get("SYMFRIC_CACHE")
    if chosen:
        return Path(chosen)
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA", Path.home()))
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    return base / "symfric"


def library_path(source: str) -> Path | None:
    """File that holds, or will hold, the compiled `source`; None without a compiler.

    The name is a hash of the source, the compiler (path, size, time), its flags and the machine,
    so that code of another kind is never loaded.
    """
    compiler = find_compiler()
    if compiler is None:
        return None
    binary = Path(compiler[0]).stat()
    parts = (source, compiler, FLAGS, binary.st_size, binary.st_mtime_ns, platform.machine())
    name = hashlib.sha256(repr(parts).encode() + _processor()).hexdigest()[:32]
    return cache_folder() / f"{name}.so"


@cache
def _processor() -> bytes:
    """What `-march=native` depends on, so that a shared home does not mix processors."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor().encode()
    return next((line for line in lines if line.startswith(("flags", "Features"))), "").encode()


def load(source: str) -> ctypes.CDLL:
    """The shared library of `source`, compiled unless the cache holds it.

    Several processes may do this at once: the file appears whole, under its final name. A damaged
    one is compiled again.

    Raises:
        RuntimeError: no compiler, no place for its result, or it refused the source; its first
            error is quoted.
    """
    path, compiler = library_path(source), find_compiler()
    if path is None or compiler is None:
        raise RuntimeError(
            "compile: expected a C compiler ($CC, gcc, clang or cc), found none; use backend='vm'"
        )
    if path.exists():
        with suppress(OSError):
            return ctypes.CDLL(str(path))
    try:
        with written(path) as temporary:
            _compile(source, compiler, temporary)
        return ctypes.CDLL(str(path))
    except (ValueError, OSError) as error:
        raise RuntimeError(
            f"compile: expected to keep compiled code in {path.parent} and run it, got {error}; "
            "set SYMFRIC_CACHE to a folder where that is allowed, or use backend='vm'"
        ) from None


def _compile(source: str, compiler: tuple[str, ...], target: Path) -> None:
    done = subprocess.run(
        [*compiler, *FLAGS, "-x", "c", "-", "-o", str(target), "-lm"],
        input=source.encode(),
        capture_output=True,
        check=False,
    )
    if done.returncode:
        lines = done.stderr.decode(errors="replace").strip().splitlines()
        said = next((line for line in lines if "error" in line), "".join(lines[:1]))
        raise RuntimeError(f"compile: {compiler[0]} failed: {said}")
