"""A problem in its resolved form: what transcription, verification and friction read."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isfinite
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.formulation.bounds import Box, Free
from symfric.model import Model

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Row:
    """A condition lower <= expression <= upper.

    Attributes:
        name: what it is about, "the bound on tip_x", for messages.
        expression: SX (1, 1) in the symbols of the model of its span.
    """

    name: str
    expression: ca.SX
    lower: float
    upper: float

    @property
    def nominal(self) -> float:
        """Typical magnitude: that of its bounds, 1 where they are zero or none."""
        return max((abs(b) for b in (self.lower, self.upper) if b and isfinite(b)), default=1.0)


@final
@dataclass(frozen=True, eq=False)
class Link:
    """Where a state starts: at an expression in t, x, z, u, p of the model of the span before."""

    state: str
    expression: ca.SX


@final
@dataclass(frozen=True, eq=False)
class Join:
    """A condition between the end of the span before and the start of this one.

    Attributes:
        name: what it is about.
        function: (t, x, z, u, p of the span before at its end, t, x, z, u, p of this one at its
            start) -> one value, which lies between `lower` and `upper`.
    """

    name: str
    function: ca.Function
    lower: float
    upper: float


@final
@dataclass(frozen=True, eq=False)
class Span:
    """One phase of a problem in one scenario, in the symbols of `model`: t, x, z, u, p.

    `model.t` is the time since the start of the problem: phases continue it.

    Attributes:
        name: of the phase, for messages.
        scenario, phase: their numbers; 0 where there is one only.
        model: after `rates`, and with the references of costs as parameters.
        T: duration [s], or `Free`.
        p: numbers of all parameters of the model; of chosen ones where the solver starts.
        chosen: names of the parameters that the optimiser chooses.
        boxes: bounds of states, algebraic variables and inputs over the whole span.
        nodes: fraction of T -> state -> range there, met with the bounds; 0, 1 and all `via`.
        inputs_at: 0 or 1 -> input -> range on the first or last interval, met with the bounds.
        rows_at: fraction of T -> further conditions there; 0, 1 and all `via`. Algebraic variables
            and inputs in them are those of the interval before, at 0 of the first one.
        path: conditions at every collocation point.
        running, end: integrand, and value at the end, of the share of the cost, SX (1, 1).
        squares: least-squares form of what it can be told of in `running`, as (weight, residual).
        links: where states start that continue the span before; none in the first span.
        joins: conditions to the span before; none in the first span.
    """

    name: str
    scenario: int
    phase: int
    model: Model
    T: float | Free
    p: Array
    chosen: tuple[str, ...]
    boxes: Mapping[str, Box]
    nodes: Mapping[float, Mapping[str, Box]]
    inputs_at: Mapping[float, Mapping[str, Box]]
    rows_at: Mapping[float, tuple[Row, ...]]
    path: tuple[Row, ...]
    running: ca.SX
    end: ca.SX
    squares: tuple[tuple[float, ca.SX], ...]
    links: tuple[Link, ...]
    joins: tuple[Join, ...]

    def box(self, name: str) -> Box:
        """Lower and upper bound of a state, algebraic variable or input."""
        return self.boxes[name]

    @property
    def symbols(self) -> list[ca.SX]:
        """[t, x, z, u, p] of the model: arguments of Functions made of the expressions."""
        return [self.model.t, *(self.model.vector(letter) for letter in "xzup")]


Condition = Callable[..., object]
"""A lambda over signals that returns a comparison, such as `lambda s: s.tip_z <= 0.9`."""
