"""Unknowns from the limits of the parameters and the requests of the user, in order."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, sqrt
from typing import Any, final

from identification.unknowns import roles
from identification.unknowns.spec import Above, Range, Spec, Tied, Unknown, as_spec
from symfric.foundation import checks
from symfric.foundation.parameters import Parameter, Variable

OTHERS = "others"
"""`fixed="others"`: every parameter that is not in `free` is held at its value."""
APART = 1.2
"""Ratio of the start values of two ordered parameters after one was moved."""
Order = tuple[str, str, bool]


@final
@dataclass(frozen=True)
class Wishes:
    """Requests of the user: specifications of free parameters, values of fixed ones.

    Attributes:
        free: name -> specification.
        fixed: name -> value.
        only: whether only the parameters in `free` are fitted.
        names: all given names, by argument.
        problems: errors in the specifications and values.
    """

    free: dict[str, Spec]
    fixed: dict[str, float]
    only: bool
    names: dict[str, tuple[str, ...]]
    problems: tuple[str, ...] = ()

    @property
    def started(self) -> frozenset[str]:
        """Names with a given start value."""
        return frozenset(
            n for n, s in self.free.items() if not isinstance(s, Tied) and s.start is not None
        )

    def check(self, known: Iterable[str]) -> None:
        """Raise one error for all names that are not `known` and all other problems."""
        problems = list[str]()
        everything = list(known)
        for where, given in self.names.items():
            try:
                checks.check_names(where, given, everything)
            except ValueError as error:
                problems.append(str(error))
        refuse([*problems, *self.problems])


def wishes(free: object, fixed: object, start: Iterable[str] = ()) -> Wishes:
    """Read the arguments `free` and `fixed` of a fit, and the names in `start`.

    Problems of single entries are collected; `Wishes.check` raises them.

    Raises:
        ValueError: an argument that is neither names nor values by name.
    """
    if free is None or isinstance(free, Mapping):
        given: dict[str, Any] = checks.named("Fit: free", free)
    else:
        given = dict.fromkeys(checks.names("Fit: free", free))
    only = isinstance(fixed, str)
    if only and fixed != OTHERS:
        raise checks.refused("Fit: fixed", f"values by name or '{OTHERS}'", fixed)
    numbers = {} if only else checks.named("Fit: fixed", fixed)
    problems: list[str] = []
    specs, held = dict[str, Spec](), dict[str, float]()
    for name, value in given.items():
        try:
            specs[name] = as_spec(f"free {name}", value)
        except ValueError as error:
            problems.append(str(error))
    for name, value in numbers.items():
        try:
            held[name] = checks.number(f"fixed {name}", value)
        except ValueError as error:
            problems.append(str(error))
    problems += [f"{n}: expected free or fixed, got both" for n in given if n in numbers]
    names = {"free": tuple(given), "fixed": tuple(numbers), "start": tuple(start)}
    return Wishes(specs, held, only, names, tuple(problems))


def refuse(problems: Sequence[str]) -> None:
    """Raise one error for all problems of a fit, if there are any."""
    if problems:
        raise ValueError("Fit: " + "; ".join(problems))


@final
@dataclass(frozen=True)
class Limits:
    """Value, bounds and scaling of a parameter of a law, a scene or a model.

    Attributes:
        value: its present value.
        lower, upper: bounds of its definition.
        window: bounds of what the data can resolve, used if the user gives no bounds.
        logarithmic: fitted by its logarithm, unless the user requests otherwise.
    """

    name: str
    unit: str
    value: float
    lower: float
    upper: float
    window: tuple[float, float]
    logarithmic: bool
    scale: float


def of_parameter(parameter: Parameter, unit: str, speeds: roles.Speeds) -> Limits:
    """Return the limits of a parameter of a law or a scene, by its role."""
    value = float(parameter.value)
    return Limits(
        name=parameter.name, unit=unit, value=value, lower=parameter.lower, upper=parameter.upper,
        window=roles.window(parameter, speeds), logarithmic=roles.is_logarithmic(parameter),
        scale=abs(value) or abs(parameter.default) or 1.0,
    )  # fmt: skip


def of_variable(variable: Variable) -> Limits:
    """Return the limits of a model parameter: logarithmic if it starts and stays positive."""
    value = float(variable.start)
    return Limits(
        name=variable.name,
        unit=variable.unit,
        value=value,
        lower=variable.lower,
        upper=variable.upper,
        window=(variable.lower, variable.upper),
        logarithmic=variable.lower >= 0 and value > 0,
        scale=abs(value) or variable.nominal,
    )


def drafted(
    free: Sequence[Limits], wished: Wishes, held: Mapping[str, float], orders: Iterable[Order]
) -> dict[str, Unknown]:
    """Return the unknowns of the `free` parameters, by name; tied ones included, for their start.

    Raises:
        ValueError: all bounds, starts and orders that contradict each other.
    """
    problems: list[str] = []
    drafts = dict[str, Unknown]()
    for limits in free:
        drafts[limits.name] = _draft(limits, wished.free.get(limits.name, Range()), problems)
    for order in orders:
        _order(drafts, wished, held, order, problems)
    for name, spec in wished.free.items():
        if isinstance(spec, Above) and name in drafts:
            if spec.name in held:
                low = max(held[spec.name], drafts[name].lower)
                drafts[name] = replace(drafts[name], lower=low, above="")
            elif spec.name not in drafts:
                problems.append(f"{name}: above: expected a parameter, got {spec.name}")
            else:
                _put_above(drafts, wished, spec.name, name, False)
    for unknown in drafts.values():
        problems += _contradictions(unknown)
    refuse(problems)
    return {n: u if u.partner else replace(u, start=_between(u)) for n, u in drafts.items()}


def _draft(limits: Limits, spec: Spec, problems: list[str]) -> Unknown:
    """Return one unknown, without orders."""
    low, high = limits.window
    logarithmic, start = limits.logarithmic, limits.value
    if isinstance(spec, Range):
        if spec.lower > -inf or spec.upper < inf:
            low, high = limits.lower, limits.upper
        for side, bound in (("lower", spec.lower), ("upper", spec.upper)):
            if abs(bound) < inf and not limits.lower <= bound <= limits.upper:
                allowed = f"[{limits.lower:g}, {limits.upper:g}]"
                problems.append(
                    f"free {limits.name}: {side}: expected a bound in {allowed}, got {bound:g}"
                )
        low, high = max(low, spec.lower), min(high, spec.upper)
        if spec.logarithmic is not None:
            logarithmic = spec.logarithmic
    elif isinstance(spec, Above):
        high = min(limits.upper, spec.upper)
    if not isinstance(spec, Tied) and spec.start is not None:
        start = spec.start
        if not limits.lower <= start <= limits.upper:
            allowed = f"[{limits.lower:g}, {limits.upper:g}]"
            problems.append(
                f"free {limits.name}: start: expected a value in {allowed}, got {start:g}"
            )
        low, high = min(low, start), max(high, start)
    if logarithmic and not start > 0:
        start = sqrt(low * high) if low > 0 and high < inf else limits.scale
    return Unknown(
        name=limits.name,
        unit=limits.unit,
        start=start,
        lower=low,
        upper=high,
        scale=limits.scale,
        logarithmic=logarithmic,
    )


def _order(
    drafts: dict[str, Unknown],
    wished: Wishes,
    held: Mapping[str, float],
    order: Order,
    problems: list[str],
) -> None:
    """Enforce low <= high by a bound, or by a coordinate if both are free."""
    low, high, strictly = order
    tied = [n for n in (low, high) if isinstance(wished.free.get(n), Tied)]
    step = 1 + 1e-6 * strictly
    if high in drafts and low in drafts and not tied:
        if drafts[low].upper > drafts[high].lower:
            _put_above(drafts, wished, low, high, strictly)
    elif high in drafts and low in held:
        lower = max(drafts[high].lower, held[low] * step)
        drafts[high] = replace(drafts[high], lower=lower)
    elif low in drafts and high in held:
        upper = min(drafts[low].upper, held[high] / step)
        drafts[low] = replace(drafts[low], upper=upper)
    elif low in held and high in held and held[low] > held[high]:
        problems.append(
            f"expected {low} <= {high}, got {low} = {held[low]:g} and {high} = {held[high]:g}"
        )


def _put_above(
    drafts: dict[str, Unknown], wished: Wishes, low: str, high: str, strictly: bool
) -> None:
    """Express `high` relative to `low`, or `low` relative to `high` if `high` has a lower bound."""
    a, b = drafts[low], drafts[high]
    asked = wished.free.get(high)
    if isinstance(asked, Range) and asked.lower > a.lower:
        # a lower value with its own upper bound keeps its box: no coordinate satisfies both,
        # and trials out of order are refused when the law is made
        if a.upper >= b.upper:
            first = min(a.start, _between(b))
            drafts[low] = replace(a, below=high, start=first, logarithmic=False)
        drafts[high] = replace(b, start=_between(b))
        return
    room = 1.01 if strictly else 1.0
    a = replace(a, lower=max(a.lower, b.lower), upper=min(a.upper, b.upper / room))
    a = replace(a, start=_between(a))
    if not a.start < b.start:
        if high in wished.started and low not in wished.started and b.start > 0:
            a = replace(a, start=b.start / APART)
        else:
            b = replace(b, start=a.start * APART if a.start > 0 else a.start + b.scale)
    drafts[low] = replace(a, start=_between(a))
    both = strictly and a.logarithmic and b.logarithmic
    drafts[high] = replace(b, above=low, logarithmic=both, scale=abs(b.start) or b.scale)


def _between(unknown: Unknown) -> float:
    """Return the start value, clipped to the bounds."""
    return min(max(unknown.start, unknown.lower), unknown.upper)


def _contradictions(unknown: Unknown) -> list[str]:
    name, low, high = unknown.name, unknown.lower, unknown.upper
    if not low < high:
        return [f"{name}: expected lower < upper, got {low:g} and {high:g}; fix it instead"]
    if unknown.logarithmic and not unknown.above and not high > 0:
        return [f"{name}: expected positive bounds of a logarithm, got {low:g} and {high:g}"]
    return []
