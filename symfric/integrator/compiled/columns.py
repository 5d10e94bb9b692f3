"""Compilation in the background, and application of a Function to many columns or steps.

One compiler runs at a time, at low priority. No thread waits for it; it is polled whenever compiled
code is requested. Results do not depend on the time at which it finishes, since both engines give
the same bits. A compiler that runs at exit is stopped, and its file is deleted. A forked process
does not touch the compiler of its parent and starts none, since its exit handlers may not run.

The compiled loop over columns reads the rows of arrays in place, without copies.
"""

import atexit
import ctypes
import os
import subprocess
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from string import Template
from tempfile import TemporaryFile
from time import perf_counter, sleep
from typing import Any, cast, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import Array, bound
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
    load,
    opened,
)
from symfric.integrator.compiled.loops import generated

BACKENDS = ("auto", "vm", "compiled")
"""Engines: the faster one, CasADi's virtual machine, and machine code of the step."""
NICENESS = 10
"""Niceness of a background compiler."""
PER_BYTE = 7e-6
"""Time of the compiler per byte of the source [s]."""
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
    _compiling: float = 0.0
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
        if self.hopeless or expected < 2 * look_up:
            return False
        if self._queued and os.getpid() == _OWNER:
            _advance()
            return self not in _queue and not self.hopeless
        if find_compiler() is None:
            return False
        if not self._looked:
            self._looked, source = True, self.write()
            self._compiling = 0.1 + PER_BYTE * len(source)
            if compiled_before(source) is not None:
                self.source = source
                return True
        if expected < self._compiling / 2:
            return False
        if not possible():
            return expected > 2 * self._compiling
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


Row = Array | tuple[Array, NDArray[np.intp]]
"""Arguments, one per row; or a table and the row number in it for each argument."""
NAME = "symfric_rows"
CHAINED, SIDE_BY_SIDE, MANY = 16, 32, 1024
"""Columns per call of the virtual machine; the last call repeats its last column. `MANY` are for at
least as many rows that are not chained.
"""
PER_INSTRUCTION = 3e-9
"""Time per instruction of the virtual machine [s]."""


@final
@dataclass(eq=False)
class Columns:
    """Function of columns, applied to the rows of arrays.

    The function runs in the virtual machine until compiling it is expected to save time. Only the
    caches are mutable.

    Attributes:
        function: Function of dense columns.
        chained: True if the first result of a column is the first argument of the next one.
        spent: time [s] spent in the virtual machine.
        source: returns the C of the function and the loop over rows; by default `rows_source`.
    """

    function: ca.Function
    chained: bool = False
    spent: float = 0.0
    source: Callable[[], str] | None = None

    @cached_property
    def _dense(self) -> ca.Function:
        return densified(self.function)

    @cached_property
    def _batches(self) -> dict[int, ca.Function]:
        return {}

    def _batch(self, size: int) -> ca.Function:
        """Return the Function of `size` columns."""
        if size not in self._batches:
            whole, name = self._dense, f"{self._dense.name()}_{size}"
            self._batches[size] = whole.mapaccum(name, size) if self.chained else whole.map(size)
        return self._batches[size]

    @cached_property
    def _prospect(self) -> Prospect:
        n = self.function.n_instructions()
        return Prospect(self.source or (lambda: rows_source(self._dense)), (NAME,), n)

    @cached_property
    def _loop(self) -> Callable[..., None]:
        """Compiled loop; raises `CompileError` without a working compiler."""
        loop = load(self._prospect.written(), NAME).symfric_rows
        loop.restype = None
        loop.argtypes = [ctypes.c_longlong, ctypes.c_int, *[ctypes.c_void_p] * 2]
        return loop

    def _compiled(self, backend: str, count: int) -> bool:
        """Return True if compiled code should run; "auto" compiles if it expects to save time."""
        if backend != "auto" or "_loop" in self.__dict__:
            return backend != "vm"
        if self._prospect.pays(self.spent + PER_INSTRUCTION * self._prospect.instructions * count):
            try:
                return bool(self._loop)
            except CompileError:  # evaluate in the VM if the compiler is broken
                self._prospect.hopeless = True
        return False

    def __call__(
        self, rows: Sequence[Row], first: Array | None = None, backend: str = "vm"
    ) -> list[Array]:
        """Return the results of all rows, each of shape (count, size), matrices column by column.

        Args:
            rows: for each argument, except the first one if `chained`, an array (count, ...), or a
                table and the numbers of its rows, shape (count,).
            first: if `chained`, the first argument of the first row.
            backend: "vm", "compiled" or "auto".
        """
        count = next(a.shape[0] for a in rows if isinstance(a, np.ndarray))
        if self._compiled(backend, count):
            return self._in_c(rows, first, count)
        began = perf_counter()
        results = self._in_vm(rows, first, count)
        self.spent += perf_counter() - began
        return results

    def _in_vm(self, rows: Sequence[Row], first: Array | None, count: int) -> list[Array]:
        most = CHAINED if self.chained else MANY if count >= MANY else SIDE_BY_SIDE
        batch = self._batch(most)
        arguments = [np.zeros(batch.numel_in(i)) for i in range(batch.n_in())]
        results = [np.zeros((most, batch.numel_out(i) // most)) for i in range(batch.n_out())]
        found = [np.empty((count, result.shape[1])) for result in results]
        blocks = [a.reshape(most, a.size // most) for a in arguments[self.chained :]]
        if self.chained:
            arguments[0][:] = np.ravel(cast(Array, first))
        call = bound(batch, arguments, results)
        for begin in range(0, count, most):
            size = min(most, count - begin)
            pick = slice(begin, begin + size)
            for block, row in zip(blocks, rows, strict=True):
                part = row[0][row[1][pick]] if isinstance(row, tuple) else row[pick]
                block[:size] = part.reshape(size, block.shape[1])
                block[size:] = block[size - 1]
            call()
            for whole, result in zip(found, results, strict=True):
                whole[begin : begin + size] = result[:size]
            if self.chained:
                arguments[0][:] = results[0][-1]
        return found

    def _in_c(self, rows: Sequence[Row], first: Array | None, count: int) -> list[Array]:
        function, begin = self._dense, int(self.chained)
        tables = [a[0] if isinstance(a, tuple) else a for a in rows]
        arrays = [_in_rows(a, function.numel_in(begin + i)) for i, a in enumerate(tables)]
        numbers = [np.ascontiguousarray(a[1]) if isinstance(a, tuple) else None for a in rows]
        if first is not None:
            arrays.insert(0, np.ascontiguousarray(first, dtype=float).reshape(1, -1))
            numbers.insert(0, None)
        results = [np.empty((count, function.numel_out(i))) for i in range(function.n_out())]
        # address of the first row, distance between rows, address of the row numbers
        of = [0 if a is None else _address(a) for a in (*numbers, *(None for _ in results))]
        every = zip((*arrays, *results), of, strict=True)
        places = np.array([(_address(a), a.strides[0], numbers) for a, numbers in every])
        here = _address(places)
        self._loop(count, begin, here, here + len(arrays) * places.strides[0])
        return results


def _address(array: NDArray[Any]) -> int:
    """Return the address of an array; faster than its attribute `ctypes`."""
    return array.__array_interface__["data"][0]


def _in_rows(array: Array, size: int) -> Array:
    """Return an array whose rows are `size` contiguous numbers, without a copy if possible.

    Raises:
        ValueError: rows of another size; the loop in C would read beyond their end.
    """
    flat = array if array.ndim == 2 else array.reshape(array.shape[0], size)
    if flat.shape[1] != size:
        raise ValueError(f"expected rows of {size} numbers, got {flat.shape[1]}")
    adjacent = size <= 1 or flat.strides[1] == flat.itemsize
    return (
        flat if adjacent and flat.dtype == np.float64 else np.ascontiguousarray(flat, dtype=float)
    )


def rows_source(function: ca.Function) -> str:
    """Return the C of `function`, generated by CasADi, with the loop over rows."""
    numbers = {"arguments": function.n_in(), "results": function.n_out()}
    loop = filled(Path(__file__).with_name("rows.c"), function, name=function.name(), **numbers)
    return f"{generated(NAME, function)}\n{loop}"


def filled(template: Path, *called: ca.Function, **values: object) -> str:
    """Return the C of a template file with `values` substituted.

    `arg`, `res`, `iw` and `w` are set to the work sizes of the Functions that the template calls.
    """
    for name in ("arg", "res", "iw", "w") if called else ():
        values[name] = max(1, *(getattr(function, f"sz_{name}")() for function in called))
    return Template(template.read_text(encoding="utf-8")).substitute(values)


def densified(function: ca.Function) -> ca.Function:
    """Return `function` with dense results, which buffers require."""
    if all(function.sparsity_out(i).is_dense() for i in range(function.n_out())):
        return function
    arguments = function.mx_in()
    results = [ca.densify(result) for result in function.call(arguments)]
    return ca.Function(function.name(), arguments, results)
