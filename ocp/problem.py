"""An optimal control problem: a model, what to reach, what to keep, what to minimise."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import inf, isfinite, isnan, sqrt
from typing import Any, final

import casadi as ca

from ocp.cost import Cost
from symfric.foundation import checks
from symfric.foundation.numeric import is_number
from symfric.foundation.parameters import check_names
from symfric.foundation.symbols import strays
from symfric.model import Model, check_model

Range = float | tuple[float | None, float | None]
"""A value to meet, or (lower, upper) to stay between; None is no bound."""

Box = tuple[float, float]

FREE: Box = (-inf, inf)
"""No condition: `initial={"x": FREE}` lets the optimiser choose the start inside the bounds."""


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


@final
@dataclass(frozen=True, eq=False)
class Problem:
    """Minimise a cost over the motion of a model within bounds.

        min J   subject to   x' = ode(t, x, z, u, p),  0 = alg(t, x, z, u, p),  0 <= t <= T

    Every condition names what it is about. A number is a value to meet, a pair
    (lower, upper) a range in which None is no bound.

    Attributes:
        model: an explicit model, `ode` with or without `alg`.
        T: duration [s], or `Free(lower, upper)` to let the optimiser choose.
        cost: a sum of `integral(...)`, `at_end(...)` and `TIME`.
        final: states at T; those not named end where they like.
        initial: states at 0; those not named start where the model says. `FREE` leaves one open.
        via: {0.5: {"x": 1.0}}: states at a fraction of T, strictly between 0 and 1.
        bounds: states, algebraic variables, inputs and outputs over the whole motion, in place of
            the bounds of the model.
        p: values of the model's parameters.

    Raises:
        ValueError: all problems at once.

    Limits: bounds on states and outputs hold at the collocation points, not between them. The
    constraints of a mechanism with loops hold on acceleration level and drift by the error of the
    collocation, so that `final` and `via` must name independent coordinates only: values of all
    would ask for more than can be met, and Ipopt does not converge.
    """

    model: Model
    T: float | Free
    cost: Cost | None = None
    final: Mapping[str, Range] = field(default_factory=dict[str, Range])
    initial: Mapping[str, Range] = field(default_factory=dict[str, Range])
    via: Mapping[float, Mapping[str, Range]] = field(
        default_factory=dict[float, Mapping[str, Range]]
    )
    bounds: Mapping[str, Range] = field(default_factory=dict[str, Range])
    p: Mapping[str, float] = field(default_factory=dict[str, float])

    def __post_init__(self) -> None:
        check_model("Problem", self.model)
        problems = list(self._kinds())
        if problems:
            raise ValueError(f"problem '{self.model.name}': " + "; ".join(problems))
        problems = [p for p in (*self._names(), *self._ranges(), *self._rest()) if p]
        # Values are looked at only when all names and ranges are right.
        problems = problems or [*self._start(), *self._costs()]
        problems = problems or [*self._reachable()]
        if problems:
            raise ValueError(f"problem '{self.model.name}': " + "; ".join(problems))

    def box(self, name: str) -> Box:
        """Lower and upper bound of a state, algebraic variable, input or output."""
        if name in self.bounds:
            return as_box(self.bounds[name])
        model = self.model
        known = {v.name: v for group in (model.x, model.z, model.u) for v in group}
        return (known[name].lower, known[name].upper) if name in known else FREE

    @property
    def bounded_outputs(self) -> tuple[str, ...]:
        """Outputs with a bound: the path constraints."""
        return tuple(name for name in self.model.outputs if name in self.bounds)

    @cached_property
    def costs(self) -> tuple[ca.SX, ca.SX]:
        """Integrand and end value of the cost in the symbols of the model."""
        return (self.cost or Cost()).expressions(self.model)

    @cached_property
    def start(self) -> dict[str, Box]:
        """Range of every state at 0."""
        given = {name: as_box(value) for name, value in self.initial.items()}
        # Where a range is given any number does: no start value depends on it (see `_start`).
        numbers = {name: low if low == high else 0.0 for name, (low, high) in given.items()}
        values = self.model.initial_state(numbers, self.p)
        start = {v.name: (x, x) for v, x in zip(self.model.x, values.tolist(), strict=True)}
        return {name: meet(box, self.box(name)) for name, box in (start | given).items()}

    def at(self, fraction: float) -> dict[str, Box]:
        """Range of every state at `fraction` of T: the bounds, and the values to meet there."""
        if fraction == 0.0:
            return self.start
        given = self.final if fraction == 1.0 else self.via.get(fraction, {})
        return {
            v.name: meet(self.box(v.name), as_box(given.get(v.name, FREE))) for v in self.model.x
        }

    def _kinds(self) -> Iterator[str]:
        """What is no mapping by name, or no fraction."""
        groups: dict[str, Any] = {"initial": self.initial, "final": self.final}
        groups |= {"bounds": self.bounds, "p": self.p}
        if isinstance(self.via, Mapping):  # pyright: ignore[reportUnnecessaryIsInstance]
            groups |= {f"via {checks.shown(at)}": values for at, values in self.via.items()}
            for at in self.via:
                if not is_number(at):
                    yield f"via: expected fractions of T, got {checks.shown(at)}"
        else:
            yield f"via: expected states by fractions of T, got {checks.shown(self.via)}"
        for what, given in groups.items():
            try:
                checks.named(what, given)
            except ValueError as error:
                yield str(error)

    def _names(self) -> Iterator[str]:
        model = self.model
        states = [v.name for v in model.x]
        all_of_them = [*states, *(v.name for v in (*model.z, *model.u)), *model.outputs]
        for what, given, known in (
            ("initial", self.initial, states),
            ("final", self.final, states),
            *((f"via {fraction:g}", values, states) for fraction, values in self.via.items()),
            ("bounds", self.bounds, all_of_them),
            ("p", self.p, [v.name for v in model.p]),
        ):
            yield _complaint(what, given, known)

    def _ranges(self) -> Iterator[str]:
        groups = [("initial", self.initial), ("final", self.final), ("bounds", self.bounds)]
        groups += [(f"via {fraction:g}", values) for fraction, values in self.via.items()]
        for what, given in groups:
            for name, value in given.items():
                if not _is_range(value):
                    yield (
                        f"{what}: expected {name} as a finite number or (lower, upper) with "
                        f"lower <= upper and None for no bound, got {value!r}"
                    )

    def _rest(self) -> Iterator[str]:
        if self.model.ode is None:
            yield "expected an explicit model (ode), got an implicit one (residual)"
        if not isinstance(self.T, Free) and not (is_number(self.T) and 0 < self.T < inf):
            yield f"expected a duration T > 0 [s] or Free(lower, upper), got {self.T!r}"
        for fraction in self.via:
            if not 0 < fraction < 1:
                yield f"via: expected fractions of T between 0 and 1, got {fraction:g}"
        if not isinstance(self.cost, Cost):
            hint = "; wrap it in integral(...) or at_end(...)" if callable(self.cost) else ""
            yield (
                f"expected a cost made of integral(...), at_end(...) and TIME, got {self.cost!r}"
                + hint
            )

    def _start(self) -> Iterator[str]:
        """A start value that is an expression needs numbers for all it depends on."""
        boxes = {name: as_box(value) for name, value in self.initial.items()}
        loose = [v for v in self.model.x if v.name in boxes and boxes[v.name][0] < boxes[v.name][1]]
        for v in self.model.x:
            needed = [o.name for o in loose if ca.depends_on(ca.SX(v.start), o.symbol)]
            if v.name not in self.initial and needed:
                yield (
                    f"initial: expected a value or range of {v.name}, whose start depends on "
                    f"{', '.join(needed)}; name it"
                )

    def _reachable(self) -> Iterator[str]:
        vias = [(f"via {fraction:g}", fraction) for fraction in self.via]
        for what, fraction in (("initial", 0.0), *vias, ("final", 1.0)):
            for name, (low, high) in self.at(fraction).items():
                if low > high:
                    bounds = self.box(name)
                    yield (
                        f"{what}: expected {name} inside its bounds [{bounds[0]:g}, {bounds[1]:g}],"
                        f" got {high if bounds[0] > high else low:g}"
                    )

    def _costs(self) -> Iterator[str]:
        try:
            costs = ca.vertcat(*self.costs)
        except ValueError as error:
            yield str(error)
            return
        known = ca.vertcat(self.model.t, *(self.model.vector(letter) for letter in "xzup"))
        stray = strays(costs, known)
        if stray:
            yield f"cost: expected only signals of the model, got {', '.join(stray)}"
        chosen = ca.vertcat(*(self.model.vector(letter) for letter in "xzu"))
        if not ca.depends_on(costs, chosen) and (not isinstance(self.T, Free) or costs.is_zero()):
            yield (
                "cost: expected one that depends on the motion, got a constant; TIME needs a free "
                "duration, T=Free(lower, upper)"
            )


def as_box(value: Range) -> Box:
    """(lower, upper) of a number or a pair with None for no bound."""
    if isinstance(value, tuple):
        low, high = value
        return (-inf if low is None else float(low), inf if high is None else float(high))
    return (float(value), float(value))


def meet(a: Box, b: Box) -> Box:
    """What lies in both ranges; empty (lower > upper) if nothing does."""
    return (max(a[0], b[0]), min(a[1], b[1]))


def _is_range(value: Any) -> bool:
    if not isinstance(value, tuple):
        return is_number(value) and isfinite(value)
    if len(value) != 2 or not all(v is None or is_number(v) for v in value):
        return False
    low, high = as_box(value)
    return not isnan(low) and not isnan(high) and low <= high and low < inf and high > -inf


def _complaint(where: str, names: Iterable[str], known: Iterable[str]) -> str:
    """What `check_names` has to say, or nothing."""
    try:
        check_names(where, names, list(known))
    except ValueError as error:
        return str(error)
    return ""
