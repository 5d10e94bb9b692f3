"""Named scalars of a model, and columns of their symbols."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from math import inf

import casadi as ca

from symfric.foundation import checks, units
from symfric.foundation import identity as identity  # what holds symbols pickles
from symfric.foundation.numeric import Scalar
from symfric.foundation.shown import figure_of
from symfric.foundation.symbolic import Symbolic, take_symbols


@dataclass(frozen=True, eq=False, repr=False)
class Variable(Symbolic):
    """Named scalar of a model: its symbol, unit, start value, bounds.

    It is used in equations like its symbol, see `Symbolic`:

        s, v = Variable("s", "m"), Variable("v", "m/s", start=0.1)
        Model("spring", x=(s, v), ode=ca.vertcat(v, -50 * s))

    A column is `ca.vertcat(*variables)`.

    Attributes:
        name: C identifier, such as x or theta_1.
        unit: as text, SI in laws and mechanisms; an unknown unit warns and suggests a known one.
        symbol: SX symbol, shape (1, 1).
        start: initial or default value; an expression in other symbols if it depends on them.
        nominal: typical magnitude; absolute tolerances and scalings are relative to it.
        lower, upper: bounds for optimisation and identification, and of a given parameter.
        doc: short description.
        kind: type among the signals of a model, see `symfric.model.kinds`.

    Raises:
        ValueError: name or unit is not a text, start is not a number or expression, nominal is not
            above zero, or invalid bounds.
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
        said = f": {self.doc}" if self.doc else ""
        return f"<variable '{self.name}' [{self.unit}], start {figure_of(self.start)}{said}>"

    def within(self, where: str, value: object) -> float:
        """Return `value` as a finite number inside the bounds."""
        return checks.number(where, value, unit=self.unit, lower=self.lower, upper=self.upper)


def take_si(where: str, given: object, *names: str) -> None:
    """Replace variables, which must be in SI units, by symbols in fields of a frozen dataclass.

    Laws and mechanisms compute in SI: 50 mm/s would be taken for 50 m/s.

    Raises:
        ValueError: a variable in another unit.
    """
    for name in names:
        value = getattr(given, name)
        if isinstance(value, Variable):
            check_si(f"{where}: {name}", value)
    take_symbols(given, *names)


def check_si(where: str, value: object) -> None:
    """Check that a variable with a known unit is in SI units; other values pass."""
    size = units.in_si(value.unit) if isinstance(value, Variable) else None
    if isinstance(value, Variable) and size not in (None, 1.0):
        raise ValueError(
            f"{where}: expected SI units, got variable '{value.name}' [{value.unit}]; "
            f"write {size:.6g} * {value.name}"
        )


def stacked(rows: Iterable[Scalar]) -> ca.SX:
    """Return `rows` as a column, SX (n, 1), empty without rows."""
    return ca.vertcat(ca.SX(0, 1), *rows)


def symbols_of(variables: Iterable[Variable]) -> ca.SX:
    """Return their symbols, SX (n, 1)."""
    return stacked(v.symbol for v in variables)


def starts_of(variables: Iterable[Variable]) -> ca.SX:
    """Return their start values, SX (n, 1); expressions if they depend on other symbols."""
    return stacked(v.start for v in variables)


def at_start(expression: Scalar, variables: Sequence[Variable]) -> ca.DM:
    """Return the value of `expression` with `variables`, its only symbols, at their start
    values.
    """
    starts = ca.SX(starts_of(variables))
    return ca.DM(ca.substitute(ca.SX(expression), symbols_of(variables), starts))


def undeclared(expression: Scalar, known: ca.SX) -> list[ca.SX]:
    """Return the symbols in `expression` that are not among `known`, each once."""
    declared = {symbol.__hash__() for symbol in ca.symvar(known)}
    return [s for s in ca.symvar(ca.SX(expression)) if s.__hash__() not in declared]


def strays(expression: Scalar, known: ca.SX) -> list[str]:
    """Return the names of symbols in `expression` that are not among `known`, each once."""
    return list(dict.fromkeys(map(str, undeclared(expression, known))))
