"""Rows of generated C beside those of CasADi: where they differ most, and if rounding does it."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import Block
from symfric.codegen.kit.generate import Generated
from symfric.codegen.proof.magnitude import magnitudes
from symfric.codegen.running.guarded import Model
from symfric.codegen.running.runner import signals
from symfric.codegen.writing.guards import Status
from symfric.emitter.c99 import Real

Array = NDArray[np.float64]

OVERFLOWS = 1e18
"""Of a number beyond, no square is one in float."""


@final
@dataclass(frozen=True, eq=False)
class Run:
    """One sequence of inputs, done by C and by CasADi.

    Attributes:
        inputs: as they were given, shape (steps, inputs).
        parameters: of every step, shape (steps, parameters); None: the defaults.
        rows, expected: what C and CasADi made of it, see `run_c`.
        terms: of the block, see `magnitude`, made where it is needed.
    """

    generated: Generated
    real: Real
    inputs: Array
    parameters: Array | None
    rows: Array
    expected: Array
    terms: Callable[[], ca.Function]

    @property
    def block(self) -> Block:
        """What was generated."""
        return self.generated.block

    @cached_property
    def relative(self) -> Array:
        """Differences relative to the magnitude of each signal, shape (steps, columns)."""
        with np.errstate(invalid="ignore"):
            difference = np.abs(self.rows - self.expected)
        if not difference.any():
            return difference
        difference[self._overflows] = 0.0
        ratio = np.where(difference == 0.0, 0.0, difference / self._scale)
        return np.where(np.isnan(ratio), np.inf, ratio)

    @property
    def _overflows(self) -> NDArray[np.bool_]:
        """Steps in which float overflows, as the status of the C says, and double does not."""
        if self.real.size == 8 or not self.generated.guards:
            return np.zeros(len(self.rows), bool)
        said = (self.rows[:, -1].astype(int) & int(Status.OUTPUT)) != 0
        return said & (np.abs(self.expected).max(axis=1) > OVERFLOWS)

    @cached_property
    def error(self) -> float:
        """The largest of them."""
        return float(self.relative.max(initial=0.0))

    @property
    def worst(self) -> str:
        """The signal that it belongs to, "" without a difference."""
        names = signals(self.block, guards=self.generated.guards)
        return names[self._place[1]] if self.error else ""

    @property
    def rounding(self) -> float:
        """How far a last bit of every argument of the worst step moves the worst signal."""
        row, column = self._place
        states, parameters, inputs = self._arguments
        own = parameters if parameters.ndim == 1 else parameters[row]
        point = (states[row], own, inputs[row])
        functions = [self.block.step, *(self.block.reset(name) for name in self.block.resets)]

        def value(*arguments: Array) -> float:
            found = [ca.vertcat(*_results(function, arguments)) for function in functions]
            columns = ca.vertcat(*found, ca.DM(0)).full().ravel()  # 0 for the status
            return float(columns[column])

        base, moved = value(*point), 0.0
        for i, group in enumerate(point):
            for j, number in enumerate(group):
                other = [g.copy() for g in point]
                other[i][j] += float(np.spacing(np.float32(number)))
                moved += abs(value(*other) - base)
        return moved / float(self._scale[column])

    @cached_property
    def _place(self) -> tuple[int, int]:
        """Step and column of the largest difference."""
        row, column = np.unravel_index(int(np.argmax(self.relative)), self.relative.shape)
        return int(row), int(column)

    @cached_property
    def _arguments(self) -> tuple[Array, Array, Array]:
        """States before every step, parameters and inputs, as the step takes them."""
        block, model = self.block, Model(self.block, self.real)
        start, inputs = model.start, model.typed(self.inputs)
        states = np.vstack([start, self.rows[:-1, : len(block.states)]])
        parameters = model.default if self.parameters is None else model.typed(self.parameters)
        if self.generated.guards:
            inputs, _ = model.inputs(inputs)
            states = np.where([[model.lost(x)] for x in states], start, states)
        return states, parameters, inputs

    @cached_property
    def _scale(self) -> Array:
        """The magnitude of every column: of its terms, its nominal value or its peak."""
        count = len(self.block.states)
        found = magnitudes(self.terms(), self.block, *self._arguments)
        found = np.concatenate([found, *(found[:count] for _ in self.block.resets)])
        if self.generated.guards:
            found = np.append(found, 1.0)  # the status
        finite = np.where(np.isfinite(self.expected), np.abs(self.expected), 0.0)
        found = np.maximum(found, finite.max(axis=0, initial=0.0))
        return np.where(found > 0.0, found, 1.0)


def _results(function: Any, arguments: tuple[Array, ...]) -> list[ca.DM]:
    found = function(*arguments)
    return list(found) if isinstance(found, tuple) else [found]


def ulp(a: Array, b: Array) -> int:
    """Largest distance in units in the last place, the largest integer if a value is not finite."""
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        return np.iinfo(np.int64).max
    distance = np.abs(_ordered(a) - _ordered(b))
    return int(distance.max(initial=0))


def _ordered(values: Array) -> NDArray[np.int64]:
    """Integers in the order of the floats, neighbours one apart, both zeros 0."""
    bits = np.ascontiguousarray(values).view(np.int64)
    return np.where(bits < 0, np.iinfo(np.int64).min - bits, bits)
