"""Ranges and phases of a problem: as users write them, and resolved to spans.

Transcription, verification and friction read the spans.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, isfinite, isnan, sqrt
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.formulation.expressions import Cost, Signals, arguments
from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, is_number
from symfric.model import Model, check_model

Range = float | tuple[float | None, float | None]
"""A value to meet, or (lower, upper) to stay between; None is no bound."""

Box = tuple[float, float]

FREE: Box = (-inf, inf)
"""No condition: `start={"x": FREE}` lets the optimiser choose the start inside the bounds."""

RANGE = "a finite number or (lower, upper) with lower <= upper and None for no bound"


@final
@dataclass(frozen=True)
class Free:
    """A duration [s] that the optimiser chooses between `lower` > 0 and `upper`.

    `guess` is where it starts, the geometric mean of the bounds if none is given.

    Raises:
        ValueError: not 0 < lower <= guess <= upper < inf, or lower = upper.
    """

    lower: float
    upper: float
    guess: float | None = None

    def __post_init__(self) -> None:
        for name in ("lower", "upper", "guess"):
            value = getattr(self, name)
            if name != "guess" or value is not None:
                number = checks.number(f"Free: {name}", value, unit="s", above=0.0)
                object.__setattr__(self, name, number)
        guess = self.lower if self.guess is None else self.guess
        if not (0 < self.lower <= guess <= self.upper < inf and self.lower < self.upper):
            raise ValueError(
                f"Free: expected 0 < lower <= guess <= upper [s] and lower < upper, got "
                f"{self.lower!r}, {self.guess!r}, {self.upper!r}"
            )

    @property
    def start(self) -> float:
        """The duration the solver starts with [s]."""
        return sqrt(self.lower * self.upper) if self.guess is None else self.guess


def as_box(value: Range) -> Box:
    """(lower, upper) of a number or a pair with None for no bound."""
    if isinstance(value, tuple):
        low, high = value
        return (-inf if low is None else float(low), inf if high is None else float(high))
    return (float(value), float(value))


def meet(a: Box, b: Box) -> Box:
    """Intersection of two ranges; empty (lower > upper) if nothing does."""
    return (max(a[0], b[0]), min(a[1], b[1]))


def fixed(box: Box) -> bool:
    """True if the range is one number."""
    return box[0] == box[1]


def is_range(value: Any) -> bool:
    """True if `value` is a finite number or an ordered pair of bounds."""
    if not isinstance(value, tuple):
        return is_number(value) and isfinite(value)
    if len(value) != 2 or not all(v is None or is_number(v) for v in value):
        return False
    low, high = as_box(value)
    return not isnan(low) and not isnan(high) and low <= high and low < inf and high > -inf


Array = NDArray[np.float64]


Ranges = Mapping[str, Range]
"""Name -> value to meet, or (lower, upper)."""

Start = Callable[[Signals], Scalar] | str | None
"""Start of a state that continues another phase: an expression in the signals at its end, the
name of one of them, or None for anywhere."""

PathCondition = Callable[[Signals], object]
"""A function that returns a comparison, such as `lambda s: s.tip_z <= 0.9`."""

JoinCondition = Callable[[Signals, Signals], object]
"""Likewise of the signals before and after: `lambda before, after: after.x >= before.x`."""


def _nothing() -> dict[str, Range]:
    return {}


@final
@dataclass(frozen=True, eq=False)
class Phase:
    """A stretch of the motion with one model and one set of conditions.

        x' = ode(t, x, z, u, p),  0 = alg(t, x, z, u, p),  0 <= t - t_start <= T

    Every condition names what it is about. A number is a value to meet, a pair (lower, upper) a
    range in which None is no bound. What stands here wins over what stands in `Problem`.

    Attributes:
        model: an explicit model, `ode` with or without `alg`.
        T: duration [s], or `Free(lower, upper)` to let the optimiser choose.
        start: states, inputs and outputs at the start; those of an input hold on the first
            interval. States of the first phase that are not named have the start of the model.
            `FREE` leaves one open.
        end: likewise at the end; those not named end where they like.
        via: {0.5: {"x": 1.0}}: states and outputs at a fraction of T between 0 and 1.
        bounds: states, algebraic variables, inputs and outputs over the whole phase, in place of
            the bounds of the model.
        rates: bounds of the rates of inputs [unit/s]. Such an input becomes a state that is
            continuous, with the constant rate `<input>_rate` on each interval; it starts where the
            optimiser likes unless `start` names it, and links and ends name it like any state.
        path: lambdas over the signals that return `a <= b`, `a >= b` or `a == b`.
        cost: of this phase alone, with `at_end` at its own end.
        link: state -> where it starts: `lambda before: -0.5 * before.v` from the signals at the end
            of the phase before, the name of one of them, or None for anywhere. States of the same
            name are continuous unless named here; others start anywhere in their bounds.
        joins: lambdas `(before, after)` over the signals at the end of the phase before and at the
            start of this one that return a comparison.
        p: values of parameters of the model.
        name: for messages and pictures.

    `Problem` reports errors of its phases.

    Limits: bounds on states and outputs, and `path`, hold at the collocation points, not between
    them; `verify` checks them there.
    """

    model: Model
    T: float | Free
    start: Ranges = field(default_factory=_nothing, kw_only=True)
    end: Ranges = field(default_factory=_nothing, kw_only=True)
    via: Mapping[float, Ranges] = field(default_factory=dict[float, Ranges], kw_only=True)
    bounds: Ranges = field(default_factory=_nothing, kw_only=True)
    rates: Ranges = field(default_factory=_nothing, kw_only=True)
    path: Sequence[PathCondition] = field(default=(), kw_only=True)
    cost: Cost | None = field(default=None, kw_only=True)
    link: Mapping[str, Start] = field(default_factory=dict[str, Start], kw_only=True)
    joins: Sequence[JoinCondition] = field(default=(), kw_only=True)
    p: Mapping[str, float] = field(default_factory=dict[str, float], kw_only=True)
    name: str = field(default="", kw_only=True)

    def __post_init__(self) -> None:
        check_model("Phase", self.model)

    def __rshift__(self, other: "Phase | Chain") -> "Chain":
        return Chain((self,)) >> other


@final
@dataclass(frozen=True, eq=False)
class Chain:
    """Phases one after the other: `out >> back`."""

    phases: tuple[Phase, ...]

    def __iter__(self) -> Iterator[Phase]:
        return iter(self.phases)

    def __len__(self) -> int:
        return len(self.phases)

    def __rshift__(self, other: "Phase | Chain") -> "Chain":
        if isinstance(other, Chain):
            return Chain(self.phases + other.phases)
        such = "a phase, such as Phase(model, T=1.0)"
        return Chain((*self.phases, checks.kind("phases", other, Phase, such)))


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
        return _size(self.lower, self.upper)


@final
@dataclass(frozen=True, eq=False)
class Link:
    """Start of a state: an expression in t, x, z, u, p of the model of the span before."""

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

    @property
    def nominal(self) -> float:
        """Typical magnitude, as that of a `Row`."""
        return _size(self.lower, self.upper)


def _size(*bounds: float) -> float:
    return max((abs(b) for b in bounds if b and isfinite(b)), default=1.0)


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
        squares: least-squares form of the squared terms in `running`, as (weight, residual).
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
        return arguments(self.model)
