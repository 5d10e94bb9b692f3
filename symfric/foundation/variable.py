"""Named scalars of a model, and functions of their symbols and start values."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from math import inf

import casadi as ca

from symfric.foundation import checks, units
from symfric.foundation import identity as identity  # makes objects with symbols picklable
from symfric.foundation.numeric import Scalar
from symfric.foundation.shown import figure_of
from symfric.foundation.symbolic import Symbolic, take_symbols

POSITIVE = 1e-12
"""Largest lower bound that stands for all positive numbers, because laws divide by the value."""


@dataclass(frozen=True, eq=False, repr=False)
class Variable(Symbolic):
    """Named scalar of a model, with its symbol, unit, start value and bounds.

    Equations may contain the variable instead of its symbol, see `Symbolic`:

        s, v = Variable("s", "m"), Variable("v", "m/s", start=0.1)
        Model("spring", x=(s, v), ode=ca.vertcat(v, -50 * s))

    A column is `ca.vertcat(*variables)`.

    Attributes:
        name: C identifier, such as x or theta_1.
        unit: unit, SI in laws and mechanisms; an unknown unit causes a warning with a suggestion.
        symbol: SX symbol, shape (1, 1).
        start: initial or default value; may be an expression of other symbols.
        nominal: typical magnitude, to which absolute tolerances and scalings are relative.
        lower, upper: bounds in optimisation and identification, and of values given by users.
        doc: short description.
        kind: kind of signal in a model, see `symfric.model.kinds`.

    Raises:
        ValueError: name or unit is not a string, start is not a number or an expression, nominal is
            not positive, or the bounds are invalid.
    """

    name: str
    unit: str
    start: Scalar = 0.0
    nominal: float = 1.0
    lower: float = -inf
    upper: float = inf
    doc: str = ""
    symbol: ca.SX = field(default_factory=lambda: ca.SX(0, 0))
    kind: str = ""

    def __post_init__(self) -> None:
        where = f"variable '{checks.line('variable: name', self.name)}'"
        if not isinstance(self.unit, str):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise checks.refused(f"{where}: unit", "a text such as 'N', or ''", self.unit)
        take_symbols(self, "start")
        object.__setattr__(self, "unit", units.checked(where, self.unit))
        symbol = checks.kind(f"{where}: symbol", self.symbol, ca.SX, "an SX symbol")
        if symbol.is_empty():
            object.__setattr__(self, "symbol", ca.SX.sym(self.name))
        elif not (symbol.is_scalar() and symbol.is_symbolic()):
            raise checks.refused(f"{where}: symbol", "one SX symbol", symbol)
        if ca.SX(checks.expression(f"{where}: start", self.start)).numel() != 1:
            raise checks.refused(f"{where}: start", "a number or one expression", self.start)
        checks.number(f"{where}: nominal", self.nominal, above=0.0)
        low, high = (checks.as_number(bound) for bound in (self.lower, self.upper))
        if low is None or high is None or not low <= high or low == inf or high == -inf:
            shown = f"{checks.shown(self.lower)} and {checks.shown(self.upper)}"
            raise ValueError(f"{where}: expected numbers lower <= upper, got {shown}")

    def __repr__(self) -> str:
        doc = f": {self.doc}" if self.doc else ""
        return f"<variable '{self.name}' [{self.unit}], start {figure_of(self.start)}{doc}>"

    def within(self, where: str, value: object) -> float:
        """Return `value`, which must be a finite number within the bounds."""
        if 0 < self.lower <= POSITIVE:
            return checks.number(where, value, unit=self.unit, above=0.0, upper=self.upper)
        return checks.number(where, value, unit=self.unit, lower=self.lower, upper=self.upper)


def take_si(where: str, given: object, *names: str) -> None:
    """Replace variables in the named fields of a frozen dataclass by their symbols.

    The variables must be in SI units, because laws and mechanisms do not convert units.

    Raises:
        ValueError: a variable has another unit.
    """
    for name in names:
        value = getattr(given, name)
        if isinstance(value, Variable):
            check_si(f"{where}: {name}", value)
    take_symbols(given, *names)


def check_si(where: str, value: object) -> None:
    """Check that `value` is not a variable in a known unit other than an SI unit."""
    size = units.in_si(value.unit) if isinstance(value, Variable) else None
    if isinstance(value, Variable) and size not in (None, 1.0):
        raise ValueError(
            f"{where}: expected SI units, got variable '{value.name}' [{value.unit}]; "
            f"write {size:.6g} * {value.name}"
        )


def stacked(rows: Iterable[Scalar]) -> ca.SX:
    """Return `rows` as a column SX (n, 1), which may be empty."""
    empty, rows = ca.SX(0, 1), tuple(rows)
    return ca.vertcat(empty, *rows) if rows else empty


def symbols_of(variables: Iterable[Variable]) -> ca.SX:
    """Return the symbols of variables as a column, SX (n, 1)."""
    return stacked(v.symbol for v in variables)


def starts_of(variables: Iterable[Variable]) -> ca.SX:
    """Return the start values of variables as a column, SX (n, 1), which may contain symbols."""
    return stacked(v.start for v in variables)


def at_start(expression: Scalar, variables: Sequence[Variable]) -> ca.DM:
    """Return the value of `expression` at the start values of its symbols, `variables`."""
    found = ca.SX(expression)
    if not found.is_constant():
        found = ca.substitute(found, symbols_of(variables), starts_of(variables))
    return ca.DM(found)


def undeclared(expression: Scalar, known: ca.SX) -> list[ca.SX]:
    """Return the symbols in `expression` that are not in `known`, without duplicates."""
    used = ca.symvar(ca.SX(expression))
    declared = {symbol.__hash__() for symbol in ca.symvar(known)} if used else ()
    return [s for s in used if s.__hash__() not in declared]


def strays(expression: Scalar, known: ca.SX) -> list[str]:
    """Return the names of symbols in `expression` that are not in `known`, without duplicates."""
    return list(dict.fromkeys(map(str, undeclared(expression, known))))
