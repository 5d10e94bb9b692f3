"""From what a parameter may be and what the user wants of it to one unknown, orders kept."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, sqrt
from typing import Any, final

from identification.unknowns import roles
from identification.unknowns.spec import Above, Range, Spec, Tied, Unknown, as_spec
from symfric.foundation import checks
from symfric.foundation.parameters import Parameter, Variable

OTHERS = "others"
"""`fixed="others"`: whatever `free` does not name is held at its value."""
APART = 1.2
"""Upper over lower start value of two parameters in order of which one was moved."""
Order = tuple[str, str, bool]


@final
@dataclass(frozen=True)
class Wishes:
    """What the user said: specs of free parameters, values of fixed ones.

    Attributes:
        free: name -> spec.
        fixed: name -> value.
        only: whether nothing else than `free` is fitted.
        names: all that was named, by where.
        problems: what is wrong with the specs and values.
    """

    free: dict[str, Spec]
    fixed: dict[str, float]
    only: bool
    names: dict[str, tuple[str, ...]]
    problems: tuple[str, ...] = ()

    @property
    def started(self) -> frozenset[str]:
        """Names whose start is given."""
        return frozenset(
            n for n, s in self.free.items() if not isinstance(s, Tied) and s.start is not None
        )

    def check(self, known: Iterable[str]) -> None:
        """Refuse names that are not `known`, and all else that is wrong, in one error."""
        problems = list[str]()
        everything = list(known)
        for where, given in self.names.items():
            try:
                checks.check_names(where, given, everything)
            except ValueError as error:
                problems.append(str(error))
        refuse([*problems, *self.problems])


def wishes(free: object, fixed: object, start: Iterable[str] = ()) -> Wishes:
    """What `free` and `fixed` of a fit say, and the names in `start`; `Wishes.check` refuses.

    Raises:
        ValueError: what is neither names nor values by name.
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
    """One error for all problems of a fit."""
    if problems:
        raise ValueError("Fit: " + "; ".join(problems))


@final
@dataclass(frozen=True)
class Limits:
    """What a parameter is and may be, whoever declares it.

    Attributes:
        value: that it has.
        lower, upper: bounds by nature.
        window: bounds by what the data can tell, for those who ask for none.
        logarithmic: fitted by its logarithm, unless the user wants it otherwise.
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
    """The limits of a parameter of a law or a scene, by its role."""
    value = float(parameter.value)
    return Limits(
        name=parameter.name, unit=unit, value=value, lower=parameter.lower, upper=parameter.upper,
        window=roles.window(parameter, speeds), logarithmic=roles.is_logarithmic(parameter),
        scale=abs(value) or abs(parameter.default) or 1.0,
    )  # fmt: skip


def of_variable(variable: Variable) -> Limits:
    """The limits of a parameter of a model: logarithmic where it starts and stays positive."""
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
    """The unknowns of the `free` parameters, by name; tied ones among them, for their start.

    Raises:
        ValueError: bounds, starts and orders that contradict each other, all of them.
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
    """One unknown, orders aside."""
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
    """Keep low <= high by a bound, or by a coordinate where both are free."""
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
    """`high` counted from `low`, their starts in order; where it is bounded, the other way."""
    a, b = drafts[low], drafts[high]
    asked = wished.free.get(high)
    if isinstance(asked, Range) and asked.lower > a.lower:
        # a lower one with an upper bound of its own stays in its box: no coordinate keeps both,
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
    """The start, moved between the bounds."""
    return min(max(unknown.start, unknown.lower), unknown.upper)


def _contradictions(unknown: Unknown) -> list[str]:
    name, low, high = unknown.name, unknown.lower, unknown.upper
    if not low < high:
        return [f"{name}: expected lower < upper, got {low:g} and {high:g}; fix it instead"]
    if unknown.logarithmic and not unknown.above and not high > 0:
        return [f"{name}: expected positive bounds of a logarithm, got {low:g} and {high:g}"]
    return []
