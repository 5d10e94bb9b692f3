"""Definition of a controller (horizon, settings, measurements, controls), and data of a cycle."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import NamedTuple, final

import numpy as np

from ocp.formulation.phase import Array
from ocp.mpc.horizon import Horizon
from ocp.mpc.kernels import Kernels, kernels
from symfric.foundation.shown import brief


class CycleStatus(IntEnum):
    """Status of a cycle, with the numbers of the C code."""

    CONVERGED = 0
    NOT_CONVERGED = 1
    BAD_INPUT = 2
    FAILED = 3
    ROUNDED = 4

    @property
    def sentence(self) -> str:
        """Meaning of the status, with a remedy."""
        return {
            0: "converged",
            1: "not converged: the residual is above the tolerance after the last iteration; allow "
            "more of them, or use steps that resolve the transition velocity",
            2: "bad input: a number is not finite; the plan of the previous cycle continues",
            3: "failed: numbers were not finite; the plan of the previous cycle continues, the "
            "next one restarts",
            4: "optimal up to rounding errors, which are larger than the tolerance; `residual` "
            "contains an estimate of them",
        }[int(self)]


@final
@dataclass(frozen=True)
class Settings:
    """Limits of the work in one cycle.

    Attributes:
        tolerance: residual at which a plan is optimal.
        iterations: largest number of quadratic programs; 1 is the real-time iteration.
    """

    tolerance: float
    iterations: int


class Plan(NamedTuple):
    """Planned states (N+1, nx), inputs (N, nu), and multipliers of all rows."""

    X: Array
    U: Array
    z: Array


class CycleData(NamedTuple):
    """Data of one cycle over the whole horizon.

    Attributes:
        R: references, shape (N+1, number of references).
        t: times [s], shape (N+1,).
        p: parameters.
        b: bounds of the rows of an interval and of the end.
    """

    R: Array
    t: Array
    p: Array
    b: Array


@final
@dataclass(frozen=True)
class Control:
    """Output of a controller: an input, or the mean over an interval of an input with bounded rate.

    Attributes:
        name, unit: name and unit of the input.
        place: index of the input, or of the state if `rated`.
        rated: True if the input has a bounded rate and is a state of the horizon.
        lower, upper: indices of the bounds in the horizon; None without bound.
    """

    name: str
    unit: str
    place: int
    rated: bool
    lower: int | None
    upper: int | None

    def of(self, X: Array, U: Array, b: Array) -> float:
        """Return the value of the output in a plan, clipped to its bounds."""
        value = 0.5 * (X[0, self.place] + X[1, self.place]) if self.rated else U[0, self.place]
        if self.lower is not None and value < b[self.lower]:
            value = b[self.lower]
        if self.upper is not None and value > b[self.upper]:
            value = b[self.upper]
        return float(value)


@final
@dataclass(frozen=True, eq=False)
class Design:
    """Definition of a controller, without its state.

    Attributes:
        name: C identifier.
        horizon: problem over the horizon.
        settings: limits of the work in a cycle.
        measured: indices of the measured states; other states are taken from the plan.
        controls: outputs of the controller.
        x0, u0: states and inputs of the first plan.
        p0, r0: default parameters and references.
        penalty: penalty of violating a soft bound by its unit, per largest curvature of the cost.
    """

    name: str
    horizon: Horizon
    settings: Settings
    measured: tuple[int, ...]
    controls: tuple[Control, ...]
    x0: Array
    u0: Array
    p0: Array
    r0: Array
    penalty: float

    __repr__ = brief

    @cached_property
    def kernels(self) -> Kernels:
        """Functions of an interval."""
        return kernels(self.horizon)

    @property
    def bounds(self) -> Array:
        """Bounds of the rows of an interval and of the end."""
        return np.array([limit.bound for limit in self.horizon.all_limits], dtype=float)

    @property
    def measured_names(self) -> tuple[str, ...]:
        """Names of the measured states."""
        return tuple(self.horizon.model.x[i].name for i in self.measured)

    @cached_property
    def bound_names(self) -> tuple[str, ...]:
        """Unique C names of the bounds."""
        names: list[str] = []
        for limit in self.horizon.all_limits:
            side, _, rest = limit.name.partition(" ")
            words = "".join(c if c.isalnum() or c == "_" else " " for c in rest).split()
            stem = "_".join([w for w in words if w not in ("the", "bound", "on")] + [side])
            name, number = stem, 2
            while name in names:
                name, number = f"{stem}_{number}", number + 1
            names.append(name)
        return tuple(names)

    @cached_property
    def row_prices(self) -> Array:
        """Linear, and equal quadratic, penalties of rows of one interval and the end; 0 if hard."""
        soft = np.array([limit.soft for limit in self.horizon.all_limits], dtype=bool)
        return np.where(soft, self.penalty * self.horizon.weight, 0.0)

    @cached_property
    def prices(self) -> Array:
        """Penalties of the rows of all intervals and of the end."""
        each, end = np.split(self.row_prices, [len(self.horizon.limits)])
        return np.append(np.tile(each, self.horizon.count), end)
