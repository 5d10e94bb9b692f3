"""Ranges and phases of a problem as given by the user, and their resolved form, the spans.

Transcription, verification and friction modules use only the spans.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from math import inf, isfinite, isnan, sqrt
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.formulation.changed_models import Form, Forms
from ocp.formulation.expressions import Cost, Signals, arguments
from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, is_number
from symfric.foundation.storable import agree
from symfric.model import Model, check_model

Array = NDArray[np.float64]

Range = float | tuple[float | None, float | None]
"""A prescribed value, or (lower, upper) with None for no bound."""

Box = tuple[float, float]

FREE: Box = (-inf, inf)
"""Range without bounds: `start={"x": FREE}` lets the optimiser choose the start."""

RANGE = "a finite number or (lower, upper) with lower <= upper and None for no bound"


@final
@dataclass(frozen=True)
class Free:
    """Duration [s] that the optimiser chooses between `lower` > 0 and `upper`.

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
    """Return a duration [s]; if it is free, its initial value."""
    return T.start if isinstance(T, Free) else float(T)


def limits(T: float | Free) -> Box:
    """Return the smallest and the largest duration [s]."""
    return (T.lower, T.upper) if isinstance(T, Free) else (float(T), float(T))


def clipped(value: float, box: Box) -> float:
    """Return the number in `box` that is nearest to `value`."""
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
    """Return the larger magnitude of the finite nonzero bounds, or `default` if there is none."""
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
"""Start of a state of a phase that follows another one: an expression in the signals at the end of
the previous phase, the name of one of these signals, or None for no condition."""

PathCondition = Callable[[Signals], object]
"""A function that returns a comparison, such as `lambda s: s.tip_z <= 0.9`."""

JoinCondition = Callable[[Signals, Signals], object]
"""A function that returns a comparison, such as `lambda before, after: after.x >= before.x`."""


@final
@dataclass(frozen=True, eq=False)
class Phase:
    """Part of the motion with one model and one set of conditions.

        x' = ode(t, x, z, u, p),  0 = alg(t, x, z, u, p),  0 <= t - t_start <= T

    Conditions are given by name. A number prescribes a value; a pair (lower, upper) prescribes a
    range, with None for no bound. Fields of a phase take precedence over those of the `Problem`.

    Attributes:
        model: an explicit model, `ode` with or without `alg`.
        T: duration [s], or `Free(lower, upper)` to let the optimiser choose.
        start: conditions on states, inputs and outputs at the start; those on an input apply to the
            first interval. States of the first phase that are not named have the start of the
            model; `FREE` releases a state.
        end: conditions at the end; states that are not named are free there.
        via: conditions on states and outputs at fractions of T, such as {0.5: {"x": 1.0}}.
        bounds: bounds of states, algebraic variables, inputs and outputs over the whole phase,
            which replace the bounds of the model.
        inputs: input -> its form over time (see `Form`), by default "constant" on each interval,
            and "linear" with a bounded rate. Inputs of other forms and their derivatives
            `<input>_rate`, `<input>_rate_rate` are states, whose start is free unless `start`
            names them; bounds, links and ends can name them.
        rates: bounds of the rates of inputs [unit/s].
        path: functions of the signals that return `a <= b`, `a >= b` or `a == b`; also `soft` and
            `complementary` conditions.
        at: fraction of T -> such functions, also `soft` ones, that apply at this time only.
        cost: cost of this phase only; `at_end` refers to the end of this phase.
        link: state -> its start: a function such as `lambda before: -0.5 * before.v` of the signals
            at the end of the previous phase, the name of one of them, or None for no condition.
            By default states of the same name are continuous and others start free.
        joins: functions `(before, after)` of the signals at the end of the previous phase and at
            the start of this one that return a comparison.
        p: values of parameters of the model.
        name: name for messages and figures.

    `Problem` reports errors of its phases.

    Limits: bounds on states and outputs, and `path`, are imposed at the collocation points. Those
    that contain inputs and no algebraic variables are also imposed at the starts of all intervals,
    where inputs jump. `verify` checks all of them between these points.
    """

    model: Model
    T: float | Free
    _: KW_ONLY
    start: Ranges = field(default_factory=dict[str, Range])
    end: Ranges = field(default_factory=dict[str, Range])
    via: Mapping[float, Ranges] = field(default_factory=dict[float, Ranges])
    bounds: Ranges = field(default_factory=dict[str, Range])
    rates: Ranges = field(default_factory=dict[str, Range])
    inputs: Forms = field(default_factory=dict[str, Form])
    path: Sequence[PathCondition] = ()
    at: Mapping[float, Sequence[PathCondition]] = field(
        default_factory=dict[float, Sequence[PathCondition]]
    )
    cost: Cost | None = None
    link: Mapping[str, Start] = field(default_factory=dict[str, Start])
    joins: Sequence[JoinCondition] = ()
    p: Mapping[str, float] = field(default_factory=dict[str, float])
    name: str = ""

    def __post_init__(self) -> None:
        check_model("Phase", self.model)

    @property
    def stops(self) -> list[float]:
        """Fractions of T inside the phase with conditions, in increasing order."""
        return sorted({float(s) for s in (*self.via, *self.at)} - {0.0, 1.0})

    def __rshift__(self, other: "Phase | Chain") -> "Chain":
        return Chain((self,)) >> other


@final
@dataclass(frozen=True, eq=False)
class Chain:
    """Sequence of consecutive phases, written `out >> back`."""

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
    """Condition lower <= expression <= upper.

    Attributes:
        name: subject for messages, such as "the bound on tip_x".
        expression: SX (1, 1) in the symbols of the model of its span.
        linear, quadratic: weights in the cost of a violation, for rows with a penalty.
        size: typical magnitude if it does not follow from the bounds.
        parts: for a product, its factors; for e - max e, e. They determine the magnitude of values.
            At a time, the violation of a row with a penalty, a constant state.
    """

    name: str
    expression: ca.SX
    lower: float
    upper: float
    linear: float = 0.0
    quadratic: float = 0.0
    size: float = 0.0
    parts: tuple[ca.SX, ...] = ()

    @property
    def nominal(self) -> float:
        """Typical magnitude: that of the bounds, or 1 if they are zero or infinite."""
        return self.size or size_of((self.lower, self.upper))

    @property
    def is_peak(self) -> bool:
        """True for e - max e <= 0, which defines the cost of a largest value."""
        return len(self.parts) == 1

    @property
    def is_product(self) -> bool:
        """True for the product of complementary signals."""
        return len(self.parts) == 2

    @property
    def violation(self) -> ca.SX:
        """Distance of the expression from its range, SX (1, 1)."""
        e = self.expression
        return ca.fmax(0.0, ca.fmax(e - self.upper, self.lower - e))

    @property
    def penalty(self) -> ca.SX:
        """Penalty of the violation, SX (1, 1)."""
        return self.linear * self.violation + self.quadratic * self.violation**2


@final
@dataclass(frozen=True, eq=False)
class Link:
    """Start of a state as an expression in t, x, z, u, p of the model of the previous span."""

    state: str
    expression: ca.SX


@final
@dataclass(frozen=True, eq=False)
class Join:
    """Condition between the end of the previous span and the start of this one.

    Attributes:
        name: subject for messages.
        function: (t, x, z, u, p at the end of the previous span, t, x, z, u, p at the start of
            this one) -> one value, between `lower` and `upper`.
    """

    name: str
    function: ca.Function
    lower: float
    upper: float

    @property
    def nominal(self) -> float:
        """Typical magnitude; see `Row`."""
        return size_of((self.lower, self.upper))


@final
@dataclass(frozen=True, eq=False)
class Span:
    """Phase of a problem in one scenario, expressed in the symbols t, x, z, u, p of `model`.

    `model.t` is the time since the start of the problem, over all phases.

    Attributes:
        name: name of the phase for messages.
        scenario, phase: index of the scenario and of the phase.
        model: model with `rates` applied and with the references of costs as parameters.
        T: duration [s], or `Free`.
        p: values of all parameters of the model; initial values for chosen parameters.
        chosen: names of the parameters that the optimiser chooses.
        boxes: bounds of states, algebraic variables and inputs over the whole span.
        nodes: fraction of T (0, 1 and all `via`) -> state -> range there, within the bounds.
        inputs_at: 0 or 1 -> input -> range on the first or last interval, within the bounds.
        rows_at: fraction of T (0, 1 and all `via`) -> further conditions there. They use algebraic
            variables and inputs of the preceding interval; at 0, of the first interval.
        path: conditions at every collocation point.
        softened, absolutes: conditions at every collocation point with a penalty: of the user, and
            e = 0 for the costs |e|.
        running, end: integrand and end value of the contribution to the cost, SX (1, 1).
        squares: least-squares form of the squared terms in `running`, as (weight, residual).
        links: starts of states that follow from the previous span; empty for the first span.
        joins: conditions between the previous span and this one; empty for the first span.
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
    softened: tuple[Row, ...] = ()
    absolutes: tuple[Row, ...] = ()

    def check_fields(self) -> None:
        """Raise an error if a file contains names that the model does not have."""
        x, z, u, p = ({v.name for v in getattr(self.model, k)} for k in "xzup")
        agree(
            "Span",
            {*self.boxes} == x | z | u,
            all({*ranges} == x for ranges in self.nodes.values()),
            all({*ranges} == u for ranges in self.inputs_at.values()),
            p.issuperset(self.chosen),
            self.p.shape == (len(p),),
        )

    @property
    def penalised(self) -> tuple[Row, ...]:
        """Conditions at every collocation point with a penalty."""
        return self.softened + self.absolutes

    @property
    def integrand(self) -> ca.SX:
        """Integrand of the contribution to the cost with all penalties, which have kinks."""
        return sum((row.penalty for row in self.penalised), self.running)

    @property
    def sides(self) -> tuple[tuple[int, int], ...]:
        """(index of a penalised row, 1 or -1 for its upper or lower bound) of each violation."""
        pairs = enumerate(self.penalised)
        return tuple(
            (k, side)
            for k, row in pairs
            for side, bound in ((1, row.upper), (-1, row.lower))
            if isfinite(bound)
        )

    @property
    def symbols(self) -> list[ca.SX]:
        """Symbols [t, x, z, u, p] of the model: arguments of Functions of the expressions."""
        return arguments(self.model)

    def same_state(self, expression: ca.SX) -> str:
        """Return the name of the state that `expression` equals, or "" if there is none."""
        same = (v.name for v in self.model.x if ca.is_equal(expression, v.symbol))
        return next(same, "")
