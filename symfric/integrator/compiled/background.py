"""Libraries made while everything else goes on.

One compiler at a time, of low priority, looked at whenever somebody asks whether compiled code is
there: no thread waits for it. Results never depend on when that is, as both engines give the same
bits. At exit a compiler that still runs is stopped, and leaves no file. A forked process leaves its
parent's compiler alone and starts none beside, as it may end without any of that.
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
"""What is being made, the first one now."""


@final
@dataclass(eq=False)
class Making:
    """A library that is being made; mutable only in how far that is.

    Attributes:
        source, names: as `library` takes them.
        done: whether it lies in a cache or has failed.
        failed: whether the compiler refused it.
    """

    source: str
    names: tuple[str, ...]
    done: bool = False
    failed: bool = False
    _unfinished: Unfinished | None = None

    def look(self) -> None:
        """Start, take or give up what is due."""
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
        """Keep the library where it is ready, and stop its compiler where not."""
        self.look()
        if self._unfinished is not None and not self.done:
            self._unfinished.stop()


def beside() -> bool:
    """Whether a compiler may run beside this process, and is stopped when it ends."""
    return processors() > 1 and os.getpid() == _OWNER


def make(source: str, *names: str) -> Making:
    """Have a library made."""
    making = Making(source, names)
    _row.append(making)
    _advance()
    return making


def _advance() -> None:
    """Look at the first of the row, and at the next one where it is done."""
    while _row and os.getpid() == _OWNER:
        _row[0].look()
        if not _row[0].done:
            return
        del _row[0]


def wait() -> None:
    """Wait until everything is made: for measurements and tests."""
    while _row and os.getpid() == _OWNER:
        _advance()
        sleep(1e-3)


@atexit.register
def _close() -> None:
    if _row and os.getpid() == _OWNER:
        _row[0].end()
    _row.clear()


def processors() -> int:
    """How many this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@final
@dataclass(eq=False)
class Prospect:
    """Decides when compiled code is worth its compiler; mutable in what was found out.

    Attributes:
        write: () -> source.
        names: what the library defines.
        instructions: of the Function, for what it costs.
        source: written for a library that is about to be loaded.
        hopeless: whether compiling failed.
    """

    write: Callable[[], str]
    names: tuple[str, ...]
    instructions: int
    source: str = ""
    hopeless: bool = False
    _looked: bool = False
    _making: Making | None = None

    def pays(self, expected: float) -> bool:
        """Whether to load the library now, which takes a compiler only where none can run beside.

        It is looked for in the cache when that is predicted to pay, and made when that is, in the
        background where possible.

        Args:
            expected: time [s] that compiled code is predicted to save.
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
        """The source, for loading; kept no longer."""
        source, self.source = self.source or self.write(), ""
        return source
