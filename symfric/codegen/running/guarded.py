"""What the guards of a block do, in NumPy, for CasADi's side of the comparison."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import Block
from symfric.codegen.writing.guards import (
    STEP_SIZE,
    Range,
    Status,
    parameter_range,
    range_of,
    state_limit,
)
from symfric.emitter.c99 import Real
from symfric.foundation.graph import graph

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Model:
    """What the guards of a block do, on rows of numbers of one type."""

    block: Block
    real: Real

    def typed(self, values: Sequence[Any] | Array) -> Array:
        """Numbers rounded to the type, as doubles."""
        kind = np.float32 if self.real.size == 4 else np.float64
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            return np.asarray(values, dtype=float).astype(kind).astype(float)

    @cached_property
    def start(self) -> Array:
        """Start values of the states."""
        return self.typed([v.start for v in self.block.states])

    @cached_property
    def default(self) -> Array:
        """Parameters as the block has them by default, in its type."""
        return self.typed([v.start for v in self.block.parameters])

    def inputs(self, rows: Array) -> tuple[Array, NDArray[np.int64]]:
        """Inputs (steps, inputs) as a guarded step sees them, and the status of every step."""
        found, status = rows.copy(), np.zeros(len(rows), np.int64)
        for i in self._used:
            found[:, i], bits = self._mended(rows[:, i], range_of(self.block.inputs[i]))
            status |= bits
        return found, status

    def lost(self, states: Array) -> bool:
        """Whether the states (states,) restart before a step."""
        return not bool((np.abs(states) <= self._limits).all())

    def parameters(self, values: Array) -> tuple[Array, int]:
        """Parameters (parameters,) as a guarded step sees them, and the status."""
        low, high, is_size = self._ranges
        unfit = ~((values >= low) & (values <= high))
        found = values.copy()
        if unfit[~is_size].any():
            found[~is_size] = self.default[~is_size]
        for i in np.flatnonzero(unfit & is_size):
            found[i] = np.clip(values[i], low[i], high[i])
            found[i] = found[i] if np.isfinite(values[i]) else self.default[i]
        return found, int(Status.PARAMETER) if unfit.any() else 0

    @cached_property
    def _used(self) -> tuple[int, ...]:
        """Inputs that the step depends on; no other is looked at."""
        nodes = graph(self.block.step).nodes
        return tuple(n.entry[1] for n in nodes if n.op == ca.OP_INPUT and n.entry[0] == 2)

    @cached_property
    def _limits(self) -> Array:
        return self.typed([state_limit(v) for v in self.block.states])

    @cached_property
    def _ranges(self) -> tuple[Array, Array, NDArray[np.bool_]]:
        ranges = [parameter_range(v) for v in self.block.parameters]
        low, high = (self.typed([getattr(r, side) for r in ranges]) for side in ("low", "high"))
        return low, high, np.array([v.name == STEP_SIZE for v in self.block.parameters], bool)

    def _mended(self, column: Array, within: Range) -> tuple[Array, NDArray[np.int64]]:
        low, high, safe = self.typed([within.low, within.high, within.safe])
        finite = np.isfinite(column)
        found = np.where(finite, np.clip(column, low, high), safe)
        kinds = np.where(finite, int(Status.CLAMPED), int(Status.NOT_FINITE))
        return found, np.where(finite & (found == column), 0, kinds).astype(np.int64)
