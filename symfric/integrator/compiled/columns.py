"""A Function applied to many columns, or step after step, without Python in between."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from time import perf_counter
from typing import Any, cast, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.compiler import CompileError
from symfric.foundation.numeric import flat_view
from symfric.integrator.compiled.background import Prospect
from symfric.integrator.compiled.rows import NAME, Row, Rows, rows_source

Array = NDArray[np.float64]
CHAINED, SIDE_BY_SIDE = 16, 32
"""Columns of one call of the virtual machine; the last call repeats its last column."""
PER_INSTRUCTION = 3e-9
"""Seconds that the virtual machine needs."""


@final
@dataclass(eq=False)
class Columns:
    """A Function of columns, applied to the rows of arrays.

    It runs in the virtual machine until compiling pays. Mutable only in what it remembers.

    Attributes:
        function: of dense columns.
        chained: the first result of a column is the first argument of the next one.
        spent: time [s] in the virtual machine.
        source: C of the function and the loop over rows, where it is not `rows_source`.
    """

    function: ca.Function
    chained: bool = False
    spent: float = 0.0
    source: Callable[[], str] | None = None

    @property
    def size(self) -> int:
        """Columns of one call."""
        return CHAINED if self.chained else SIDE_BY_SIDE

    @cached_property
    def _dense(self) -> ca.Function:
        return densified(self.function)

    @cached_property
    def _batch(self) -> ca.Function:
        if self.chained:
            return self._dense.mapaccum(f"{self._dense.name()}_{self.size}", self.size)
        return self._dense.map(self.size)

    @cached_property
    def _prospect(self) -> Prospect:
        n = self.function.n_instructions()
        return Prospect(self.source or (lambda: rows_source(self._dense)), (NAME,), n)

    @cached_property
    def _compiled(self) -> Rows:
        return Rows.of(self._dense, self.chained, self._prospect.written())

    def _choose(self, backend: str, count: int) -> Rows | None:
        """Compiled code, or none; "auto" compiles when that is predicted to pay."""
        if backend == "compiled":
            return self._compiled
        if backend == "vm":
            return None
        if "_compiled" in self.__dict__:
            return self._compiled
        if self._prospect.pays(self.spent + PER_INSTRUCTION * self._prospect.instructions * count):
            try:
                return self._compiled
            except CompileError:  # a broken compiler is no reason not to evaluate
                self._prospect.hopeless = True
        return None

    def __call__(
        self, rows: Sequence[Row], first: Array | None = None, backend: str = "vm"
    ) -> list[Array]:
        """Results of all rows, each of shape (count, size), matrices column by column.

        Args:
            rows: an array (count, ...) for every argument, without the first one where `chained`;
                or a table and the numbers of its rows, shape (count,).
            first: where `chained`, the first argument of the first row.
            backend: "vm", "compiled" or "auto".
        """
        most, began = self.size, perf_counter()
        count = next(a.shape[0] for a in rows if isinstance(a, np.ndarray))
        compiled = self._choose(backend, count)
        if compiled is not None:
            return compiled(rows, first)
        batch = self._batch
        arguments = [np.zeros(batch.numel_in(i)) for i in range(batch.n_in())]
        results = [np.zeros((most, batch.numel_out(i) // most)) for i in range(batch.n_out())]
        found = [np.empty((count, result.shape[1])) for result in results]
        blocks = [a.reshape(most, a.size // most) for a in arguments[self.chained :]]
        if self.chained:
            arguments[0][:] = np.ravel(cast(Array, first))
        buffer, call = cast(tuple[Any, Any], batch.buffer())
        for place, arrays in ((buffer.set_arg, arguments), (buffer.set_res, results)):
            for i, array in enumerate(arrays):
                if array.size:
                    place(i, flat_view(array))
        for begin in range(0, count, most):
            size = min(most, count - begin)
            for block, row in zip(blocks, rows, strict=True):
                if isinstance(row, tuple):
                    part = row[0][row[1][begin : begin + size]]
                else:
                    part = row[begin : begin + size]
                block[:size] = part.reshape(size, block.shape[1])
                block[size:] = block[size - 1]
            call()
            for whole, result in zip(found, results, strict=True):
                whole[begin : begin + size] = result[:size]
            if self.chained:
                arguments[0][:] = results[0][-1]
        self.spent += perf_counter() - began
        return found


def densified(function: ca.Function) -> ca.Function:
    """`function` with dense results, as buffers need them."""
    if all(function.sparsity_out(i).is_dense() for i in range(function.n_out())):
        return function
    arguments = function.mx_in()
    results = [ca.densify(result) for result in function.call(arguments)]
    return ca.Function(function.name(), arguments, results)
