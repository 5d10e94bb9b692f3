"""Ranges and phases of a problem, as given by the user and resolved to spans.

Transcription, verification and friction use the spans.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from math import inf, isfinite, isnan, sqrt
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.formulation.expressions import Cost, Signals, arguments
from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, is_number
from symfric.model import Model, check_model

Array = NDArray[np.float64]

Range = float | tuple[float | None, float | None]
"""A prescribed value, or (lower, upper) with None for no bound."""

Box = tuple[float, float]

FREE: Box = (-inf, inf)
"""No condition: `start={"x": FREE}` lets the optimiser choose the start inside the bounds."""

RANGE = "a finite number or (lower, upper) with lower <= upper and None for no bound"


@final
@dataclass(frozen=True)
class Free:
    """A duration [s] that the optimiser chooses between `lower` > 0 and `upper`.

    `guess` is its initial value, by default the geometric mean of the bounds.

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
        """Initial duration for the solver [s]."""
        return sqrt(self.lower * self.upper) if self.guess is None else self.guess


def initial(T: float | Free) -> float:
    """Return a duration [s], the initial one if it is free."""
    return T.start if isinstance(T, Free) else float(T)


def limits(T: float | Free) -> Box:
    """Return the least and the largest duration [s]."""
    return (T.lower, T.upper) if isinstance(T, Free) else (float(T), float(T))


def clipped(value: float, box: Box) -> float:
    """Return the number of a range that is nearest to `value`."""
    return min(max(value, box[0]), box[1])


def as_box(value: Range) -> Box:
    """Return (lower, upper) of a number or a pair with None for no bound."""
    if isinstance(value, tuple):
        low, high = value
        return (-inf if low is None else float(low), inf if high is None else float(high))
    return (float(value), float(value))


def meet(a: Box, b: Box) -> Box:
    """Return the intersection of two ranges; lower > upper if it is empty."""
    return (max(a[0], b[0]), min(a[1], b[1]))


def fixed(box: Box) -> bool:
    """Return True if the range is one number."""
    return box[0] == box[1]


def size_of(box: Box, default: float = 1.0) -> float:
    """Return the larger magnitude of the bounds that are finite and not zero."""
    return max((abs(b) for b in box if b and isfinite(b)), default=default)


def is_range(value: Any) -> bool:
    """Return True if `value` is a finite number or an ordered pair of bounds."""
    if not isinstance(value, tuple):
        return is_number(value) and isfinite(value)
    if len(value) != 2 or not all(v is None or is_number(v) for v in value):
        return False
    low, high = as_box(value)
    return not isnan(low) and not isnan(high) and low <= high and low < inf and high > -inf


Ranges = Mapping[str, Range]
"""Name -> prescribed value, or (lower, upper)."""

Start = Callable[[Signals], Scalar] | str | None
"""Start of a state that continues another phase: an expression in the signals at its end, the
name of one of them, or None for no condition."""

PathCondition = Callable[[Signals], object]
"""A function that returns a comparison, such as `lambda s: s.tip_z <= 0.9`."""

JoinCondition = Callable[[Signals, Signals], object]
"""A comparison of the signals before and after: `lambda before, after: after.x >= before.x`."""


@final
@dataclass(frozen=True, eq=False)
class Phase:
    """A part of the motion with one model and one set of conditions.

        x' = ode(t, x, z, u, p),  0 = alg(t, x, z, u, p),  0 <= t - t_start <= T

    Conditions are given by name: a number prescribes a value, a pair (lower, upper) a range in
    which None is no bound. Fields of a phase take precedence over those of the `Problem`.

    Attributes:
        model: an explicit model, `ode` with or without `alg`.
        T: duration [s], or `Free(lower, upper)` to let the optimiser choose.
        start: states, inputs and outputs at the start; those of an input hold on the first
            interval. States of the first phase that are not named have the start of the model.
            `FREE` leaves one open.
        end: the same at the end; states that are not named end anywhere.
        via: {0.5: {"x": 1.0}}: states and outputs at a fraction of T between 0 and 1.
        bounds: states, algebraic variables, inputs and outputs over the whole phase, in place of
            the bounds of the model.
        rates: bounds of the rates of inputs [unit/s]. Such an input becomes a state that is
            continuous, with the constant rate `<input>_rate` on each interval; its start is free
            unless `start` names it, and links and ends name it like any state.
        path: lambdas over the signals that return `a <= b`, `a >= b` or `a == b`.
        cost: of this phase alone, with `at_end` at its own end.
        link: state -> its start: `lambda before: -0.5 * before.v` from the signals at the end of
            the previous phase, the name of one of them, or None for no condition. States of the
            same name are continuous unless named here; others start anywhere in their bounds.
        joins: lambdas `(before, after)` over the signals at the end of the previous phase and at
            the start of this one that return a comparison.
        p: values of parameters of the model.
        name: for messages and figures.

    `Problem` reports errors of its phases.

    Limits: bounds on states and outputs, and `path`, hold at the collocation points, not between
    them; `verify` checks them there.
    """

    model: Model
    T: float | Free
    _: KW_ONLY
    start: Ranges = field(default_factory=dict[str, Range])
    end: Ranges = field(default_factory=dict[str, Range])
    via: Mapping[float, Ranges] = field(default_factory=dict[float, Ranges])
    bounds: Ranges = field(default_factory=dict[str, Range])
    rates: Ranges = field(default_factory=dict[str, Range])
    path: Sequence[PathCondition] = ()
    cost: Cost | None = None
    link: Mapping[str, Start] = field(default_factory=dict[str, Start])
    joins: Sequence[JoinCondition] = ()
    p: Mapping[str, float] = field(default_factory=dict[str, float])
    name: str = ""

    def __post_init__(self) -> None:
        check_model("Phase", self.model)

    def __rshift__(self, other: "Phase | Chain") -> "Chain":
        return Chain((self,)) >> other


@final
@dataclass(frozen=True, eq=False)
class Chain:
    """Consecutive phases: `out >> back`."""

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
        name: its subject, such as "the bound on tip_x", for messages.
        expression: SX (1, 1) in the symbols of the model of its span.
    """

    name: str
    expression: ca.SX
    lower: float
    upper: float

    @property
    def nominal(self) -> float:
        """Typical magnitude: that of its bounds, 1 if they are zero or infinite."""
        return size_of((self.lower, self.upper))


@final
@dataclass(frozen=True, eq=False)
class Link:
    """Start of a state: an expression in t, x, z, u, p of the model of the previous span."""

    state: str
    expression: ca.SX


@final
@dataclass(frozen=True, eq=False)
class Join:
    """A condition between the end of the previous span and the start of this one.

    Attributes:
        name: its subject.
        function: (t, x, z, u, p at the end of the previous span, t, x, z, u, p at the start of
            this one) -> one value, between `lower` and `upper`.
    """

    name: str
    function: ca.Function
    lower: float
    upper: float

    @property
    def nominal(self) -> float:
        """Typical magnitude, as that of a `Row`."""
        return size_of((self.lower, self.upper))


@final
@dataclass(frozen=True, eq=False)
class Span:
    """One phase of a problem in one scenario, in the symbols of `model`: t, x, z, u, p.

    `model.t` is the time since the start of the problem, over all phases.

    Attributes:
        name: of the phase, for messages.
        scenario, phase: their indices; 0 if there is only one.
        model: after `rates`, and with the references of costs as parameters.
        T: duration [s], or `Free`.
        p: numbers of all parameters of the model; of chosen ones their initial values.
        chosen: names of the parameters that the optimiser chooses.
        boxes: bounds of states, algebraic variables and inputs over the whole span.
        nodes: fraction of T -> state -> range there, within the bounds; 0, 1 and all `via`.
        inputs_at: 0 or 1 -> input -> range on the first or last interval, within the bounds.
        rows_at: fraction of T -> further conditions there; 0, 1 and all `via`. Algebraic variables
            and inputs in them are those of the interval before, at 0 of the first one.
        path: conditions at every collocation point.
        running, end: integrand, and value at the end, of the share of the cost, SX (1, 1).
        squares: least-squares form of the squared terms in `running`, as (weight, residual).
        links: starts of states that continue the previous span; none in the first span.
        joins: conditions to the previous span; none in the first span.
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

    @property
    def symbols(self) -> list[ca.SX]:
        """[t, x, z, u, p] of the model: arguments of Functions made of the expressions."""
        return arguments(self.model)

    def same_state(self, expression: ca.SX) -> str:
        """Return the name of the state that `expression` is, or ""."""
        same = (v.name for v in self.model.x if ca.is_equal(expression, v.symbol))
        return next(same, "")
