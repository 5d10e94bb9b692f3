"""Parts of a model besides its equations: results, monitors of error control, events."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf

from symfric.foundation import checks, units
from symfric.foundation.numeric import Scalar, is_casadi
from symfric.foundation.shown import figure_of
from symfric.foundation.symbolic import take_symbols


@dataclass(frozen=True, eq=False, repr=False)
class Output:
    """Named result of a model, as in `Model(outputs={"force": Output(50 * s, "N")})`.

    Attributes:
        expression: in t, x, z, u, p, shape (1, 1).
        unit: as text; an unknown unit warns.
        doc: short description.
        kind: type among the signals, see `symfric.model.kinds`; it may be empty.
    """

    expression: Scalar
    unit: str
    doc: str = ""
    kind: str = ""

    def __post_init__(self) -> None:
        take_symbols(self, "expression")
        checks.expression("Output", self.expression)
        if not isinstance(self.unit, str):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise checks.refused("Output: unit", "a text such as 'N'", self.unit)
        object.__setattr__(self, "unit", units.checked("Output", self.unit))

    def __repr__(self) -> str:
        return f"<output [{self.unit}]{': ' * bool(self.doc)}{self.doc}>"


@dataclass(frozen=True, eq=False, repr=False)
class Monitor:
    """Expression in t, x, z, u, p whose relative error is controlled along with the states.

    A sliding velocity is the difference of two velocities that may be a thousand times larger;
    `nominal` is the scale on which the friction force changes with it. Near zero, steps change it
    by no more than a few `nominal`, so that narrow features there are not skipped.

    Attributes:
        expression: in t, x, z, u, p.
        nominal: above zero; a number, or an expression in p.
    """

    expression: Scalar
    nominal: Scalar

    def __post_init__(self) -> None:
        take_symbols(self, "expression", "nominal")
        checks.expression("Monitor", self.expression)
        if is_casadi(self.nominal):
            checks.expression("Monitor: nominal", self.nominal)
        else:
            checks.number("Monitor: nominal", self.nominal, above=0.0)

    def __repr__(self) -> str:
        return f"<monitor on the scale {figure_of(self.nominal)}>"


@dataclass(frozen=True, eq=False, repr=False)
class Event:
    """Action when an expression passes through zero.

    A jump, of an input or by the reset of another event, also counts if it leads beyond zero. Two
    crossings within a step are found: if the values at the quarters of a step allow a pair of them,
    the step is subdivided, down to the event tolerance. That is certain for an expression that is
    linear in the states between two events, because it is a polynomial of degree 4 there. Other
    expressions are detected if the quarters show their bends: one that oscillates within a quarter
    may be missed, and so may one that was not finite before. Expressions in time alone limit the
    steps.

    Attributes:
        expression: in t, x, z, u, p.
        direction: +1 only rising, -1 only falling, 0 both.
        terminal: the simulation ends there.
        reset: state -> its value after the event, in terms of the values before it.
        at_start: True if it also happens at the start if the expression is already beyond zero in
            the given direction, 1 or -1, or leaves zero in it.
        rtol: largest relative tolerance of a run with this event; it replaces a larger one.
    """

    name: str
    expression: Scalar
    direction: int = 0
    terminal: bool = False
    reset: Mapping[str, Scalar] = field(default_factory=dict[str, Scalar])
    at_start: bool = False
    rtol: float = inf

    def __post_init__(self) -> None:
        where = f"event '{checks.line('Event: name', self.name)}'"
        take_symbols(self, "expression", "reset")
        checks.expression(where, self.expression)
        checks.count(f"{where}: direction", self.direction, least=-1, most=1)
        checks.flag(f"{where}: terminal", self.terminal)
        if checks.flag(f"{where}: at_start", self.at_start) and self.direction == 0:
            raise checks.refused(f"{where}: at_start", "a direction 1 or -1", 0)
        if self.rtol != inf:
            checks.number(f"{where}: rtol", self.rtol, above=0.0)
        object.__setattr__(self, "reset", checks.named(f"{where}: reset", self.reset))
        for name, value in self.reset.items():
            checks.expression(f"{where}: reset of {name}", value)

    def __repr__(self) -> str:
        way = {1: ", rising", -1: ", falling"}.get(self.direction, "")
        after = f", sets {', '.join(self.reset)}" if self.reset else ""
        return f"<event '{self.name}'{way}{after}{', ends the run' * self.terminal}>"
