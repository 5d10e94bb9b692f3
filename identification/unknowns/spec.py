"""Unknowns of a fit, and specifications of free parameters: a range, an order, a tie.

free={"sigma_0": log(1e3, 1e7), "mu_s": above("mu_d"), "sigma_1": tied(lambda p: ...)}
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf
from typing import Any, final

from symfric.foundation import checks


@final
@dataclass(frozen=True, eq=False)
class Unknown:
    """A fitted number, in the unit of the user.

    Attributes:
        name: of a parameter of the model; for a value of one record with its index: "x0.v[2]",
            "dead_time[0]".
        start: value from which the fit starts.
        lower, upper: bounds.
        scale: typical magnitude; a linear coordinate is value / scale.
        logarithmic: fitted by its logarithm, for positive scales of unknown magnitude.
        above: name of the value that is a lower bound of this one, or "".
        below: name of the value that is an upper bound of this one, or "".
        nuisance: a start value or dead time: fitted, but not requested.
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
        """The value that this one is ordered with, or ""."""
        return self.above or self.below


@final
@dataclass(frozen=True)
class Range:
    """A parameter between bounds.

    Attributes:
        lower, upper: bounds in the unit of the parameter; its own bounds hold, too.
        start: start value of the fit; None: from the data or the law.
        logarithmic: fitted by its logarithm or by its value; None: by its role.
    """

    lower: float = -inf
    upper: float = inf
    start: float | None = None
    logarithmic: bool | None = None


@final
@dataclass(frozen=True)
class Above:
    """A parameter that is at least another one, and at most `upper`."""

    name: str
    upper: float = inf
    start: float | None = None


@final
@dataclass(frozen=True)
class Tied:
    """A parameter computed from the others: `rule` takes them by name, as symbols or numbers."""

    rule: Callable[[Mapping[str, Any]], Any]


Spec = Range | Above | Tied


def log(lower: float, upper: float, start: float | None = None) -> Range:
    """Fit a parameter by its logarithm between 0 < lower < upper, for scales of unknown magnitude.

    Raises:
        ValueError: bounds that are not positive or not in order, a start outside them.
    """
    low = checks.number("log: lower", lower, above=0.0)
    checks.number("log: upper", upper, above=low)
    return _range("log", low, upper, start, True)


def linear(lower: float = -inf, upper: float = inf, start: float | None = None) -> Range:
    """Fit a parameter by its value between lower < upper, which may be infinite.

    Raises:
        ValueError: bounds that are not in order, a start outside them.
    """
    return _range("linear", lower, upper, start, False)


def above(name: str, upper: float = inf, start: float | None = None) -> Above:
    """Keep a parameter at or above the parameter `name`."""
    checks.text("above", name, "the name of a parameter, such as 'mu_d'")
    high = inf if _is_infinite(upper) else checks.number("above: upper", upper)
    return Above(name, high, None if start is None else checks.number("above: start", start))


def tied(to: str | Callable[[Mapping[str, Any]], Any], factor: float = 1.0) -> Tied:
    """Tie a parameter to `factor` times the parameter `to`, or to a function `to` of all of them.

    The function takes values by name and returns an expression in them: `lambda p: p["m"] * 9.81`.
    """
    if isinstance(to, str):
        times = checks.number("tied: factor", factor)
        return Tied(_Multiple(to, times))
    return Tied(checks.function("tied", to, "the name of a parameter or a function of them"))


@final
@dataclass(frozen=True)
class _Multiple:
    """Picklable function: a multiple of a named value."""

    name: str
    factor: float

    def __call__(self, values: Mapping[str, Any]) -> Any:
        if self.name not in values:
            checks.check_names("tied", [self.name], list(values))
        return self.factor * values[self.name]


def as_spec(where: str, value: object) -> Spec:
    """Return the specification of a user's entry: a class above, two bounds, a start, or None.

    Raises:
        ValueError: any other entry.
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
