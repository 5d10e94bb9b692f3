"""Unknowns of a fit, and specifications of free parameters: ranges, orders and ties.

free={"sigma_0": log(1e3, 1e7), "mu_s": above("mu_d"), "sigma_1": tied(lambda p: ...)}
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, sqrt
from typing import Any, NamedTuple, final

from symfric.foundation import checks
from symfric.foundation.variable import Variable


@final
@dataclass(frozen=True, eq=False)
class Unknown:
    """A number to be fitted, in the unit of the user.

    Attributes:
        name: name of a parameter of the model; for a value of one record with the index of the
            record: "x0.v[2]", "dead_time[0]".
        unit: unit of all values.
        start: value from which the fit starts.
        lower, upper: bounds.
        scale: typical magnitude; a linear coordinate is value / scale.
        logarithmic: True if fitted by its logarithm, for positive scales of unknown magnitude.
        above: name of the value that is a lower bound of this one, or "".
        below: name of the value that is an upper bound of this one, or "".
        nuisance: True for a start value or a dead time, which is fitted but not requested.
    """

    name: str
    unit: str
    start: float
    lower: float = -inf
    upper: float = inf
    scale: float = 1.0
    logarithmic: bool = False
    above: str = ""
    below: str = ""
    nuisance: bool = False

    @property
    def partner(self) -> str:
        """Name of the value that bounds this one, or ""."""
        return self.above or self.below


@final
@dataclass(frozen=True)
class Range:
    """Specification of a parameter between bounds.

    Attributes:
        lower, upper: bounds in the unit of the parameter, in addition to its declared bounds.
        start: start value of the fit; None: from the data or the law.
        logarithmic: True for the logarithm, False for the value; None: according to its role.
    """

    lower: float = -inf
    upper: float = inf
    start: float | None = None
    logarithmic: bool | None = None


@final
@dataclass(frozen=True)
class Above:
    """Specification of a parameter at least as large as another one, and at most `upper`."""

    name: str
    upper: float = inf
    start: float | None = None


@final
@dataclass(frozen=True)
class Tied:
    """Specification of a parameter computed by `rule` from a mapping of the other values by name.

    The values are symbols or numbers.
    """

    rule: Callable[[Mapping[str, Any]], Any]


Spec = Range | Above | Tied


def log(lower: float, upper: float, start: float | None = None) -> Range:
    """Fit a parameter by its logarithm between 0 < lower < upper, for scales of unknown magnitude.

    Raises:
        ValueError: bounds are not positive or not in order, or the start is outside them.
    """
    low = checks.number("log: lower", lower, above=0.0)
    checks.number("log: upper", upper, above=low)
    return _range("log", low, upper, start, True)


def linear(lower: float = -inf, upper: float = inf, start: float | None = None) -> Range:
    """Fit a parameter by its value between lower < upper, which may be infinite.

    Raises:
        ValueError: bounds are not in order, or the start is outside them.
    """
    return _range("linear", lower, upper, start, False)


def above(name: str, upper: float = inf, start: float | None = None) -> Above:
    """Keep a parameter at or above the parameter `name`."""
    checks.text("above", name, "the name of a parameter, such as 'mu_d'")
    high = inf if _is_infinite(upper) else checks.number("above: upper", upper)
    return Above(name, high, None if start is None else checks.number("above: start", start))


def tied(to: str | Callable[[Mapping[str, Any]], Any], factor: float = 1.0) -> Tied:
    """Tie a parameter to `factor` times the parameter `to`, or to a function `to` of parameters.

    The function maps values by name to an expression in them: `lambda p: p["m"] * 9.81`.
    """
    if isinstance(to, str):
        times = checks.number("tied: factor", factor)
        return Tied(_Multiple(to, times))
    return Tied(checks.function("tied", to, "the name of a parameter or a function of them"))


@final
@dataclass(frozen=True)
class _Multiple:
    """Picklable function that returns a multiple of a named value."""

    name: str
    factor: float

    def __call__(self, values: Mapping[str, Any]) -> Any:
        if self.name not in values:
            checks.check_names("tied", [self.name], list(values))
        return self.factor * values[self.name]


def as_spec(where: str, value: object) -> Spec:
    """Return the specification for an entry of the user.

    The entry is a `Range`, `Above` or `Tied`, two bounds, a start value, or None.

    Raises:
        ValueError: another entry.
    """
    if isinstance(value, Range | Above | Tied):
        return value
    if value is None:
        return Range()
    if isinstance(value, tuple | list):
        pair: list[Any] = list(value)  # pyright: ignore[reportUnknownArgumentType]
        if len(pair) != 2:
            raise checks.refused(where, "two bounds", value, "write (lower, upper)")
        return _range(where, pair[0], pair[1], None, None)
    if checks.as_number(value) is None:
        such = "a start value, (lower, upper), log(...), linear(...), above(...) or tied(...)"
        raise checks.refused(where, such, value)
    return Range(start=checks.number(where, value))


def _range(
    where: str, lower: object, upper: object, start: object, logarithmic: bool | None
) -> Range:
    low = -inf if _is_infinite(lower) else checks.number(f"{where}: lower", lower)
    high = inf if _is_infinite(upper) else checks.number(f"{where}: upper", upper)
    if not low < high:
        raise ValueError(f"{where}: expected lower < upper, got {low:g} and {high:g}")
    first = None
    if start is not None:
        first = checks.number(f"{where}: start", start, lower=low, upper=high)
    return Range(low, high, first, logarithmic)


def _is_infinite(value: object) -> bool:
    number = checks.as_number(value)
    return number is not None and abs(number) == inf


OTHERS = "others"
"""Value of `fixed` that holds every parameter that is not in `free`."""
APART = 1.2
"""Ratio of the start values of two ordered parameters after one of them was moved."""
Order = tuple[str, str, bool]


class Requests:
    """Checked arguments `free` and `fixed` of a fit.

    Attributes:
        free: name -> specification.
        fixed: name -> value of a held parameter.
        only: True if only the parameters in `free` are fitted.
        problems: errors in the specifications and values, which `check` raises.

    Raises:
        ValueError: an argument is neither a list of names nor a mapping.
    """

    def __init__(self, free: object, fixed: object, start: Iterable[str] = ()) -> None:
        given: dict[str, Any] = (
            checks.named("Fit: free", free)
            if free is None or isinstance(free, Mapping)
            else dict.fromkeys(checks.names("Fit: free", free))
        )
        self.only = isinstance(fixed, str)
        if self.only and fixed != OTHERS:
            raise checks.refused("Fit: fixed", f"values by name or '{OTHERS}'", fixed)
        numbers = {} if self.only else checks.named("Fit: fixed", fixed)
        self.free, self.fixed, self.problems = dict[str, Spec](), dict[str, float](), list[str]()
        for argument, entries in (("free", given), ("fixed", numbers)):
            for name, value in entries.items():
                try:
                    if argument == "free":
                        self.free[name] = as_spec(f"free {name}", value)
                    else:
                        self.fixed[name] = checks.number(f"fixed {name}", value)
                except ValueError as error:
                    self.problems.append(str(error))
        self.problems += [f"{n}: expected free or fixed, got both" for n in given if n in numbers]
        self.names = {"free": [*given], "fixed": [*numbers], "start": [*start]}

    @property
    def started(self) -> frozenset[str]:
        """Names of parameters with a given start value."""
        return frozenset(n for n, s in self.free.items() if getattr(s, "start", None) is not None)

    @property
    def ties(self) -> dict[str, Tied]:
        """Parameters computed from other parameters."""
        return {n: s for n, s in self.free.items() if isinstance(s, Tied)}

    def check(self, known: Sequence[str]) -> None:
        """Raise one error for all names that are not in `known` and all other problems."""
        problems = list[str]()
        for where, given in self.names.items():
            try:
                checks.check_names(where, given, known)
            except ValueError as error:
                problems.append(str(error))
        refuse([*problems, *self.problems])


def refuse(problems: Sequence[str]) -> None:
    """Raise one error for all problems of a fit; do nothing without problems."""
    if problems:
        raise ValueError("Fit: " + "; ".join(problems))


class Draft(NamedTuple):
    """Unknown together with the declared bounds of its parameter.

    The bounds of the unknown are the range that the data can resolve, used by default.
    """

    unknown: Unknown
    lower: float
    upper: float


def of_variable(v: Variable) -> Draft:
    """Return the draft of a model parameter, logarithmic if its start and bounds are positive."""
    value, logarithmic = float(v.start), v.lower >= 0 and float(v.start) > 0
    scale = abs(value) or v.nominal
    unknown = Unknown(v.name, v.unit, value, v.lower, v.upper, scale, logarithmic)
    return Draft(unknown, v.lower, v.upper)


def drafted(
    free: Sequence[Draft], requests: Requests, held: Mapping[str, float], orders: Iterable[Order]
) -> dict[str, Unknown]:
    """Return name -> unknown of the `free` parameters, including tied ones for their start.

    Raises:
        ValueError: no free parameters; or bounds, starts and orders that contradict each other, in
            one error.
    """
    if not free:
        raise ValueError("Fit: expected at least one free parameter, got all fixed")
    problems: list[str] = []
    specs = requests.free
    found = {d.unknown.name: _first(d, specs.get(d.unknown.name, Range()), problems) for d in free}
    for order in orders:
        _order(found, requests, held, order, problems)
    for name, spec in specs.items():
        if isinstance(spec, Above) and name in found:
            if spec.name in held:
                low = max(held[spec.name], found[name].lower)
                found[name] = replace(found[name], lower=low, above="")
            elif spec.name not in found:
                problems.append(f"{name}: above: expected a parameter, got {spec.name}")
            else:
                _put_above(found, requests, spec.name, name, False)
    for u in found.values():
        if not u.lower < u.upper:
            such = f"expected lower < upper, got {u.lower:g} and {u.upper:g}; fix it instead"
            problems.append(f"{u.name}: {such}")
        elif u.logarithmic and not u.above and not u.upper > 0:
            such = f"expected positive bounds of a logarithm, got {u.lower:g} and {u.upper:g}"
            problems.append(f"{u.name}: {such}")
    refuse(problems)
    return {n: u if u.partner else replace(u, start=_between(u)) for n, u in found.items()}


def _first(draft: Draft, spec: Spec, problems: list[str]) -> Unknown:
    """Return one unknown without its orders."""
    unknown, lowest, highest = draft
    low, high, start = unknown.lower, unknown.upper, unknown.start
    logarithmic = unknown.logarithmic

    def check(what: str, such: str, value: float) -> None:
        if not lowest <= value <= highest:
            such = f"expected {such} in [{lowest:g}, {highest:g}], got {value:g}"
            problems.append(f"free {unknown.name}: {what}: {such}")

    if isinstance(spec, Range):
        for side, bound in (("lower", spec.lower), ("upper", spec.upper)):
            if abs(bound) < inf:
                low, high = lowest, highest
                check(side, "a bound", bound)
        low, high = max(low, spec.lower), min(high, spec.upper)
        logarithmic = logarithmic if spec.logarithmic is None else spec.logarithmic
    elif isinstance(spec, Above):
        high = min(highest, spec.upper)
    if not isinstance(spec, Tied) and spec.start is not None:
        start = spec.start
        check("start", "a value", start)
        low, high = min(low, start), max(high, start)
    if logarithmic and not start > 0:
        start = sqrt(low * high) if low > 0 and high < inf else unknown.scale
    return replace(unknown, start=start, lower=low, upper=high, logarithmic=logarithmic)


def _order(
    found: dict[str, Unknown], requests: Requests, held: Mapping[str, float], order: Order,
    problems: list[str],
) -> None:  # fmt: skip
    """Enforce low <= high by a bound, or by a coordinate if both parameters are free."""
    low, high, strictly = order
    step = 1 + 1e-6 * strictly
    if high in found and low in found and not {low, high} & requests.ties.keys():
        if found[low].upper > found[high].lower:
            _put_above(found, requests, low, high, strictly)
    elif high in found and low in held:
        lower = max(found[high].lower, held[low] * step)
        found[high] = replace(found[high], lower=lower)
    elif low in found and high in held:
        upper = min(found[low].upper, held[high] / step)
        found[low] = replace(found[low], upper=upper)
    elif low in held and high in held and held[low] > held[high]:
        got = f"{low} = {held[low]:g} and {high} = {held[high]:g}"
        problems.append(f"expected {low} <= {high}, got {got}")


def _put_above(
    found: dict[str, Unknown], requests: Requests, low: str, high: str, strictly: bool
) -> None:
    """Express `high` relative to `low`, or the opposite if `high` has a lower bound."""
    a, b = found[low], found[high]
    spec = requests.free.get(high)
    if isinstance(spec, Range) and spec.lower > a.lower:
        # `low` keeps a smaller upper bound of its own, because no coordinate satisfies bound and
        # order; the law then refuses trials that are out of order
        if a.upper >= b.upper:
            start = min(a.start, _between(b))
            found[low] = replace(a, below=high, start=start, logarithmic=False)
        found[high] = replace(b, start=_between(b))
        return
    upper = min(a.upper, b.upper / (1.01 if strictly else 1.0))
    a = replace(a, lower=max(a.lower, b.lower), upper=upper)
    a = replace(a, start=_between(a))
    if not a.start < b.start:
        if high in requests.started and low not in requests.started and b.start > 0:
            a = replace(a, start=b.start / APART)
        else:
            b = replace(b, start=a.start * APART if a.start > 0 else a.start + b.scale)
    found[low] = replace(a, start=_between(a))
    both = strictly and a.logarithmic and b.logarithmic
    found[high] = replace(b, above=low, logarithmic=both, scale=abs(b.start) or b.scale)


def _between(unknown: Unknown) -> float:
    """Return the start value clipped to the bounds."""
    return min(max(unknown.start, unknown.lower), unknown.upper)
