"""Parts of a model: outputs, monitors for error control, events, mechanical structure."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import inf
from typing import Any, final

import casadi as ca

from symfric.foundation import checks, units
from symfric.foundation.numeric import Scalar, is_casadi
from symfric.foundation.packed import state_of
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


@final
@dataclass(frozen=True, eq=False)
class Inner:
    """Equations with inner unknowns l, so that each equation depends on few unknowns.

        0 = f(y, l),   l_k = g_k(y, l_1 ... l_{k-1})

    Attributes:
        l: SX symbols (k, 1) of the inner unknowns.
        values: SX (k, 1), the expressions g.
        f: SX, the residual f in terms of l.
        groups: symbols of all unknowns, including l, in the best order of elimination.
    """

    l: ca.SX  # noqa: E741
    values: ca.SX
    f: ca.SX
    groups: tuple[ca.SX, ...]


@final
@dataclass(frozen=True, eq=False)
class Solving:
    """Solution M^-1 r, SX (n, 1), as an expression in the symbols r, SX (n, 1)."""

    r: ca.SX
    result: ca.SX

    def __call__(self, r: ca.SX) -> ca.SX:
        """Return M^-1 r."""
        return ca.substitute(self.result, self.r, ca.densify(r))


@final
@dataclass(frozen=True, eq=False)
class Holonomic:
    """Structure of a mechanical model beyond its equations: constraints on its coordinates.

    The states of the model begin with the coordinates q and their rates q', and the algebraic
    variables with the multipliers lam of the constraints phi(q, t) = 0. The accelerations a are
    symbols, so that the mass matrix need not be inverted:

        M a + phi_q' lam = Q,   d^2 phi / dt^2 = phi_q a + ... = 0,   further algebraic equations

    `ode` and `alg` of the model are derived from these equations by elimination of a.

    Attributes:
        n: number of coordinates.
        phi: SX (m, 1), the constraints; without rows for a tree.
        a: SX symbols (n, 1) of the accelerations.
        implicit: SX (n + nz, 1), the equations above in q, q', the other states, a, z, u, p, t;
            the first n are affine in a.
        rates: SX (nx - 2 n, 1), rates of the other states.
        solve: function that applies M^-1 to a column, if this costs less than factorising M.
        norms: number of multipliers, the last ones, that belong to norms of Euler parameters; they
            carry no load, and error control ignores them.
        index: 0 for integration in the tangent space of the constraints, with as many unknowns as
            degrees of freedom; 1 for integration of all coordinates, which are projected onto the
            constraints at the end of each step. Both solutions agree within the tolerance.
        inner: the same equations with inner unknowns for long chains, which make the derivatives
            sparse; None for all other mechanisms.
        pressing: SX (k, 1), normal forces divided by their typical magnitude, which must not be
            negative.
        pressed: names of these normal forces.
        advice: hint that is shown if friction and reactions have no solution; may be empty.
        applied: number of algebraic variables that are forces in stick. They follow the
            multipliers, and their equations follow the constraints.
    """

    n: int
    phi: ca.SX
    a: ca.SX
    implicit: ca.SX
    rates: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    solve: Callable[[ca.SX], ca.SX] | None = None
    norms: int = 0
    index: int = 1
    inner: Inner | None = None
    pressing: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    pressed: tuple[str, ...] = ()
    advice: str = ""
    applied: int = 0

    def to_pack(self) -> dict[str, Any]:
        """Return the fields and derived expressions, with `solve` converted to an expression."""
        state = state_of(self)
        if self.solve is not None:
            right = ca.SX.sym("right", self.n)
            state["solve"] = Solving(right, self.solve(right))
        return state | {"explicit": self.explicit}

    @cached_property
    def explicit(self) -> tuple[ca.SX, ca.SX]:
        """Accelerations (n, 1) and algebraic equations (nz, 1) without the symbols a."""
        balance, others = self.implicit[: self.n, 0], self.implicit[self.n :, 0]
        right = -ca.substitute(balance, self.a, ca.SX.zeros(self.n))
        if self.solve is None:
            D, L, order = ca.ldl(ca.jacobian(balance, self.a))
            acceleration = ca.ldl_solve(ca.densify(right), D, L, order)
        else:
            acceleration = self.solve(right)
        return acceleration, ca.substitute(others, self.a, acceleration)
