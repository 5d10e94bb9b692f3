"""Parts of a model in addition to its equations: outputs, monitors for error control, events."""

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
        expression: function of t, x, z, u, p, shape (1, 1).
        unit: unit as text; an unknown unit causes a warning.
        doc: short description.
        kind: kind of the signal, see `symfric.model.kinds`; may be empty.
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
    """Expression whose error is controlled in addition to the errors of the states.

    An example is a sliding velocity, which is the difference of velocities that may be a thousand
    times larger. `nominal` is the scale on which the friction force changes with it. Near zero a
    step changes the expression by at most a few `nominal`, so that narrow features are not skipped.

    Attributes:
        expression: function of t, x, z, u, p.
        nominal: scale above zero; a number, or a function of p.
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

    A jump of the expression through zero, caused by an input or by the reset of another event, is
    also an event. Two zero crossings within a step are detected: if the values at the quarters of
    the step allow a pair of crossings, the step is subdivided down to the event tolerance. This is
    reliable for expressions that are linear in the states between two events, because their dense
    output is a polynomial of degree 4. For all others, crossings of an oscillation within a quarter
    of a step may be missed, as may crossings after the expression was not finite. Expressions of
    time alone limit the steps.

    Attributes:
        name: name of the event.
        expression: function of t, x, z, u, p.
        direction: 1 for rising zeros only, -1 for falling zeros only, 0 for both.
        terminal: True if the event ends the simulation.
        reset: maps a state to its value after the event, in terms of the values before it.
        at_start: True if the event also occurs at the start when the expression is already beyond
            zero in the given direction, 1 or -1, or leaves zero in this direction.
        rtol: largest relative tolerance of a run with this event; it replaces a larger tolerance.
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
