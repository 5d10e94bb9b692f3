"""Compilation of libraries in the background.

One compiler runs at a time, at low priority. No thread waits for it; it is polled whenever compiled
code is requested. Results do not depend on the time at which it finishes, since both engines give
the same bits. A compiler that runs at exit is stopped, and its file is deleted. A forked process
does not touch the compiler of its parent and starts none, since its exit handlers may not run.
"""

import atexit
import os
import subprocess
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile
from time import perf_counter, sleep
from typing import final

from symfric.foundation.programs import (
    CompileError,
    ProgramError,
    end,
    find_compiler,
    needed_compiler,
    patience,
    started,
)
from symfric.integrator.compiled.compiler import (
    FLAGS,
    Cache,
    caches,
    call_of,
    compiled_before,
    key_of,
    opened,
)

NICENESS = 10
"""Niceness of a background compiler."""
_OWNER = os.getpid()
_queue: list["Prospect"] = []
"""Libraries to compile; the first one is in progress."""


def possible() -> bool:
    """Return True if a background compiler may run and will be stopped at exit."""
    return processors() > 1 and os.getpid() == _OWNER


def _advance() -> None:
    """Poll the first library of the queue; if it is done, continue with the next one."""
    while _queue and os.getpid() == _OWNER:
        if not _queue[0].finished():
            return
        del _queue[0]


def wait() -> None:
    """Wait until the queue is empty; used by measurements and tests."""
    while _queue and os.getpid() == _OWNER:
        _advance()
        sleep(1e-3)


@atexit.register
def _close() -> None:
    if _queue and os.getpid() == _OWNER and not _queue[0].finished():
        _queue[0].stop()
    _queue.clear()


def processors() -> int:
    """Return the number of processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@final
@dataclass(eq=False)
class Prospect:
    """Library that is compiled when this is expected to save time; only its progress is mutable.

    Attributes:
        write: function that returns the source.
        names: names that the library defines.
        instructions: number of instructions of the Function, from which costs are estimated.
        source: source of a library that is being compiled or about to be loaded.
        hopeless: True if no compiler or cache can be used, or if the compiler rejected the source.
    """

    write: Callable[[], str]
    names: tuple[str, ...]
    instructions: int
    source: str = ""
    hopeless: bool = False
    _looked: bool = False
    _queued: bool = False
    _process: subprocess.Popen[bytes] | None = None
    _file: tuple[Cache, str, Path] | None = None
    _limit: float = 0.0

    def pays(self, expected: float) -> bool:
        """Return True if the library should be loaded now.

        The method searches the cache and starts a background compiler if these steps are expected
        to save time. Loading runs the compiler only where no background compiler can run.

        Args:
            expected: time [s] that compiled code is expected to save.
        """
        look_up = 2e-3 + 1e-5 * self.instructions
        compiling = 0.1 + 1.5e-4 * self.instructions
        if self.hopeless or expected < 2 * look_up:
            return False
        if self._queued and os.getpid() == _OWNER:
            _advance()
            return self not in _queue and not self.hopeless
        if find_compiler() is None:
            return False
        if not self._looked:
            self._looked, source = True, self.write()
            if compiled_before(source) is not None:
                self.source = source
                return True
        if expected < compiling / 2:
            return False
        if not possible():
            return expected > 2 * compiling
        self.source, self._queued = self.write(), True
        _queue.append(self)
        _advance()
        return False

    def written(self) -> str:
        """Return the source for loading, and release it."""
        source, self.source = self.source or self.write(), ""
        return source

    def finished(self) -> bool:
        """Start or poll the compiler; return True once its result is stored or it has failed."""
        try:
            if self._process is None or self._file is None:
                self._start()
                return False
            status = self._process.poll()
            if status is None and perf_counter() < self._limit:
                return False
            if status != 0:
                raise CompileError(f"compile: status {status}")
            place, key, path = self._file
            opened(path, self.names)
            place.keep(key, path)
            place.evict()
        except (ProgramError, OSError):
            self.hopeless = True
        self.stop()
        return True

    def _start(self) -> None:
        """Start the compiler at low priority, in the first cache that can be written.

        Raises:
            ProgramError: no compiler, no writable cache, or a compiler that does not start.
        """
        compiler = needed_compiler()
        key = key_of(self.source, compiler, FLAGS)
        for place in caches():
            with suppress(OSError), TemporaryFile() as text:
                text.write(self.source.encode())
                text.seek(0)
                self._file = place, key, place.begin(key)
                arguments, variables = call_of(compiler, FLAGS, self._file[2])
                command = (*compiler.command, *arguments)
                self._process = started(command, stdin=text, variables=variables)
                if hasattr(os, "setpriority"):
                    with suppress(OSError):
                        os.setpriority(os.PRIO_PGRP, self._process.pid, NICENESS)
                self._limit = perf_counter() + patience(self.source)
                return
        raise CompileError("compile: expected a folder for compiled code, found none")

    def stop(self) -> None:
        """Stop the compiler if it still runs, and delete its output unless it has been stored."""
        if self._process is not None:
            end(self._process)
        if self._file is not None:
            with suppress(OSError):
                self._file[2].unlink()
