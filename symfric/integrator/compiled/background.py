"""Compilation of libraries in the background.

One compiler runs at a time, at low priority, and is polled whenever compiled code is requested: no
thread waits for it. Results never depend on when it finishes, since both engines give the same
bits.
At exit a running compiler is stopped, and leaves no file. A forked process leaves its parent's
compiler alone and starts none in the background, since it may end without these exit handlers.
"""

import atexit
import os
from collections.abc import Callable
from dataclasses import dataclass
from time import sleep
from typing import final

from symfric.foundation.programs import CompileError, find_compiler
from symfric.integrator.compiled.compiler import Unfinished, begun, compiled_before

_OWNER = os.getpid()
_row: list["Making"] = []
"""Queue of libraries; the first one is being compiled."""


@final
@dataclass(eq=False)
class Making:
    """Library being compiled; mutable in its progress only.

    Attributes:
        source, names: as in `library`.
        done: True if it is in a cache or has failed.
        failed: True if the compiler rejected it.
    """

    source: str
    names: tuple[str, ...]
    done: bool = False
    failed: bool = False
    _unfinished: Unfinished | None = None

    def look(self) -> None:
        """Start the compiler, or store its result."""
        if self.done:
            return
        try:
            if self._unfinished is None:
                self._unfinished = begun(self.source, self.names)
            else:
                self.done = self._unfinished.finish()
        except CompileError:
            self.done = self.failed = True

    def end(self) -> None:
        """Store the library if it is ready, otherwise stop its compiler."""
        self.look()
        if self._unfinished is not None and not self.done:
            self._unfinished.stop()


def beside() -> bool:
    """Return True if a background compiler may run and will be stopped at exit."""
    return processors() > 1 and os.getpid() == _OWNER


def make(source: str, *names: str) -> Making:
    """Queue a library for compilation."""
    making = Making(source, names)
    _row.append(making)
    _advance()
    return making


def _advance() -> None:
    """Poll the first library of the queue, and the next one if it is done."""
    while _row and os.getpid() == _OWNER:
        _row[0].look()
        if not _row[0].done:
            return
        del _row[0]


def wait() -> None:
    """Wait until the queue is empty: for measurements and tests."""
    while _row and os.getpid() == _OWNER:
        _advance()
        sleep(1e-3)


@atexit.register
def _close() -> None:
    if _row and os.getpid() == _OWNER:
        _row[0].end()
    _row.clear()


def processors() -> int:
    """Return the number of processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@final
@dataclass(eq=False)
class Prospect:
    """Decision when compiled code is worth its compile time; mutable in its findings.

    Attributes:
        write: () -> source.
        names: that the library defines.
        instructions: of the Function, to estimate its cost.
        source: written for a library that is about to be loaded.
        hopeless: True if compiling failed.
    """

    write: Callable[[], str]
    names: tuple[str, ...]
    instructions: int
    source: str = ""
    hopeless: bool = False
    _looked: bool = False
    _making: Making | None = None

    def pays(self, expected: float) -> bool:
        """Return True if the library is to be loaded now.

        The cache is searched if that is expected to save time, and the library is compiled if that
        is, in the background if possible; loading runs the compiler only where no background
        compiler can run.

        Args:
            expected: time [s] that compiled code is expected to save.
        """
        look_up = 2e-3 + 1e-5 * self.instructions
        compiling = 0.1 + 1.5e-4 * self.instructions
        if self.hopeless or expected < 2 * look_up:
            return False
        if self._making is not None and os.getpid() == _OWNER:
            _advance()
            self.hopeless = self._making.failed
            return self._making.done and not self.hopeless
        if find_compiler() is None:
            return False
        if not self._looked:
            self._looked, source = True, self.write()
            if compiled_before(source) is not None:
                self.source = source
                return True
        if expected < compiling / 2:
            return False
        if not beside():
            return expected > 2 * compiling
        self.source = self.write()
        self._making = make(self.source, *self.names)
        return False

    def written(self) -> str:
        """Return the source, for loading, and release it."""
        source, self.source = self.source or self.write(), ""
        return source
