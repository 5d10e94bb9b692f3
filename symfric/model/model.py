"""Models, which are the interface between equations and solvers.

Scenes and mechanisms create a `Model`; simulation, optimal control, identification and code
generation use it. The letters are those of CasADi's DaeBuilder: time t, differential states x,
algebraic variables z, inputs u, parameters p.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property, partial
from typing import Any

import casadi as ca
import numpy as np

from symfric.foundation import checks, packed
from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import Variable, check_names
from symfric.foundation.shown import Showing, Shown, TextTable, among, counted, figure_of
from symfric.foundation.variable import stacked
from symfric.model.forces import closed, opened, reopened, with_forces
from symfric.model.kinds import MODE
from symfric.model.parts import Holonomic, Monitor, Output
from symfric.model.problems import (
    GROUPS,
    contact_problems,
    equation_problems,
    kind_problems,
    naming_problems,
)
from symfric.model.start import System, accelerations

Variables = tuple[Variable, ...]
"""Ordered variables; () without variables."""


@dataclass(frozen=True, eq=False, repr=False)
class Model(Showing, System):
    """Dynamic system 0 = F(t, x', x, z, u, p), explicit where possible.

    The explicit form is a semi-explicit DAE of index 1, or an ODE without z:

        x' = ode(t, x, z, u, p),   0 = alg(t, x, z, u, p)

    A model is defined by `ode` and `alg`; by `residual` and `xdot` for a fully implicit model of
    index 1, whose matrix of rates may be singular (as for capacitors between nodes); or by
    `holonomic` for a mechanism, from which `ode` and `alg` are derived.

    Equations are SX expressions of the variables, which can be used like their symbols:

        x, v, u = Variable("x", "m"), Variable("v", "m/s"), Variable("u", "N")
        Model("mass", x=(x, v), u=(u,), ode=ca.vertcat(v, (u - 50 * x) / 2.0))

    Attributes:
        name: name of the model.
        x, z, u, p: named variables; a group without variables is empty and adds no cost.
        ode: SX (nx, 1), or None for an implicit model.
        alg: SX (nz, 1).
        xdot: SX symbols (nx, 1) of the rates; created automatically for an explicit model.
        residual: SX (nx + nz, 1).
        outputs: named results in addition to x, z and u.
        monitors: expressions that error control monitors in addition to x.
        events: actions at zero crossings.
        t: SX symbol of time [s].
        holonomic: equations of a mechanism, with constraints on its coordinates that the integrator
            enforces on positions, velocities and accelerations.
        details: function that returns further results, such as reactions; add a result to `outputs`
            to use it in derivatives and in C.
        sketch: function that returns a drawing of the machine.
        contacts: contacts with friction, whose laws close the equations.
        opening: function that returns `open` of a closed model.

    Raises:
        ValueError: repeated names, wrong row counts, undeclared symbols, or an `ode` or `alg` that
            contradicts `holonomic`; the message lists all problems.
    """

    opening: "Callable[[], Model] | None" = None

    def __post_init__(self) -> None:
        self._refuse(kind_problems(self))
        for name in GROUPS:
            object.__setattr__(self, name, tuple(getattr(self, name)))
        for name in ("alg", "xdot", "residual"):
            object.__setattr__(self, name, ca.SX(getattr(self, name)))
        if not self.x and self.residual.is_empty():  # algebraic equations alone are explicit
            object.__setattr__(self, "ode", ca.SX(0, 1))
        if self.contacts and self.opening is None:
            self._close()
        if self.holonomic is not None:
            self._take(self.holonomic)
        if self.ode is not None:
            object.__setattr__(self, "ode", ca.SX(self.ode))
            rates = [ca.SX.sym(f"{v.name}_dot") for v in self.x]
            object.__setattr__(self, "xdot", stacked(rates))
            if self.ode.numel() == len(self.x):
                object.__setattr__(
                    self, "residual", ca.vertcat(self.xdot - ca.vec(self.ode), self.alg)
                )
        self._refuse([*naming_problems(self), *equation_problems(self, self._symbols())])

    def check_fields(self) -> None:
        """Check a model that was read from a file, without constructing it again."""
        self._refuse(kind_problems(self))
        self._refuse([*naming_problems(self), *equation_problems(self, self._symbols())])

    def shown(self) -> Shown:
        """Describe the parts of the model without their expressions."""
        return shown(self)

    def _refuse(self, problems: list[str]) -> None:
        if problems:
            raise ValueError(f"model {self.name!r}: " + "; ".join(problems))

    def _close(self) -> None:
        """Replace the contact forces by those of their laws, and store the open form."""
        self._refuse(contact_problems(self))
        given = {item.name: getattr(self, item.name) for item in fields(self)}
        object.__setattr__(self, "opening", partial(opened, given, Model))
        for name, value in closed(self).items():
            object.__setattr__(self, name, value)

    @cached_property
    def open(self) -> "Model":
        """Model with the forces of its `contacts` as inputs named "<name>_F".

        Further widths (`Contact.widths`) are parameters. A `ValueError` is raised if variables were
        replaced.
        """
        return self if self.opening is None else reopened(self, self.opening())

    def with_forces(
        self, forces: Mapping[str, Scalar], p: Variables = (), z: Variables = (),
        alg: Scalar | None = None, monitors: tuple[Monitor, ...] = (),
    ) -> "Model":  # fmt: skip
        """Return the model with friction forces other than those of its laws.

        The arguments are those of `symfric.model.forces.with_forces`.
        """
        bare = self.open
        return replace(bare, **with_forces(self, bare, forces, p, z, alg, monitors))

    def _take(self, mechanics: Holonomic) -> None:
        """Set `ode` and `alg` from the equations of a mechanism."""
        acceleration, alg = mechanics.explicit
        rate = self.vector("x")[mechanics.n : 2 * mechanics.n, 0]
        for name, made in (("ode", ca.vertcat(rate, acceleration, mechanics.rates)), ("alg", alg)):
            given = getattr(self, name)
            if given is not None and not given.is_empty() and not _same(given, made):
                raise ValueError(
                    f"model '{self.name}': {name}: expected none with `holonomic`, from whose "
                    "equations it is derived, got others; change `holonomic.implicit`"
                )
            object.__setattr__(self, name, made)

    def _symbols(self) -> ca.SX:
        return ca.vertcat(self.t, self.xdot, *(self.vector(letter) for letter in "xzup"))

    @cached_property
    def memory(self) -> dict[str, Any]:
        """Caches of solvers for this model, deleted with the model."""
        return {}

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields without caches."""
        return packed.state_of(self)

    def __copy__(self) -> "Model":
        """Return a model with the same symbols and without caches."""
        made = object.__new__(Model)
        vars(made).update(self.__getstate__())
        return made

    def to_pack(self) -> dict[str, Any]:
        """Return the fields, with the results of all functions that create parts on demand."""
        state, Given = self.__getstate__(), packed.Given
        state["details"] = Given(dict(self.further))
        state["sketch"] = None if self.sketch is None else Given(self.sketch())
        state["opening"] = None if self.opening is None else Given(self.opening())
        return state

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the whole model; expressions that share a symbol share it after loading."""
        return packed.loads, (packed.dumps(self),)

    @cached_property
    def signals(self) -> dict[str, str]:
        """Units by name of all signals of a trajectory except time: x, z, u and outputs."""
        found = {v.name: v.unit for group in (self.x, self.z, self.u) for v in group}
        return found | {name: output.unit for name, output in self.outputs.items()}

    @cached_property
    def further(self) -> dict[str, Output]:
        """Results of `details`, and accelerations `<q>_acc` unless these names are in use.

        Raises:
            ValueError: `details` uses a name of the model.
        """
        found = dict(self.details())
        repeated = sorted(found.keys() & {*self.signals, *(v.name for v in self.p)})
        if repeated:
            raise ValueError(
                f"model '{self.name}': details: expected new names, got {', '.join(repeated)}"
            )
        taken = {*found, *self.signals, *(v.name for v in self.p)}
        own = accelerations(self).items()
        return found | {name: output for name, output in own if name not in taken}

    @cached_property
    def cyclic(self) -> tuple[str, ...]:
        """Names of the states on which no equation or event depends, such as a counted angle."""
        pattern = ca.DM(ca.jacobian_sparsity(self._conditions, self.vector("x")), 1)
        used = zip(self.x, pattern.full().any(axis=0), strict=True)
        return tuple(v.name for v, depends in used if not depends and v.kind != MODE)

    @cached_property
    def angles(self) -> tuple[str, ...]:
        """Names of the angles [rad] of which a whole turn changes no equation and no event.

        They are compared at eight random points with angles up to 100 rad.
        """
        symbols = self._symbols()
        f = ca.Function("rows", [symbols], [self._conditions])
        points = np.random.default_rng(0).uniform(0.1, 1.0, (symbols.numel(), 8))
        rows = {v.name: k for k, v in enumerate(self.x, 1 + self.xdot.numel()) if v.unit == "rad"}
        points[[*rows.values()]] *= 100  # beyond the stops of several turns
        first, found = f(points).full(), list[str]()
        for name, row in rows.items():
            turned = points + 2 * np.pi * (np.arange(len(points)) == row)[:, None]
            same = np.abs(f(turned).full() - first).max() <= 1e-9 * np.abs(first).max()
            if same and name not in self.cyclic:
                found.append(name)
        return tuple(found)

    @property
    def _conditions(self) -> ca.SX:
        """Equations, constraints, and expressions of events."""
        constraints = ca.SX(0, 1) if self.holonomic is None else self.holonomic.phi
        events = [ca.SX(e) for one in self.events for e in (one.expression, *one.reset.values())]
        return ca.vertcat(self.residual, constraints, *events)

    def expression(self, name: str) -> ca.SX:
        """Return the signal or detail `name` in the symbols of the model.

        Raises:
            ValueError: unknown name.
        """
        checks.text(f"model '{self.name}'", name, "the name of a signal")
        variables = {v.name: v.symbol for group in (self.x, self.z, self.u) for v in group}
        if name in variables:
            return variables[name]
        outputs = self.outputs if name in self.outputs else self.further
        check_names(f"model '{self.name}'", [name], [*self.signals, *outputs])
        return ca.SX(outputs[name].expression)

    def function(self, what: str) -> ca.Function:
        """Return a CasADi Function with named arguments.

        Args:
            what: "ode" or "alg" with the arguments (t, x, z, u, p); "residual" with (t, xdot, x, z,
                u, p); "signals" with (t, x, z, u, p), which stacks x, z, u and the outputs in the
                order of `signals`; or the name of an output or detail.

        Raises:
            ValueError: unknown name, or "ode" for an implicit model.
        """
        checks.text(f"model '{self.name}'", what, "the name of a function")
        outputs = {name: ca.SX(output.expression) for name, output in self.outputs.items()}
        variables = {letter: self.vector(letter) for letter in "xzup"}
        known = {"alg": self.alg} | ({} if self.ode is None else {"ode": self.ode})
        known["signals"] = ca.vertcat(*(self.vector(g) for g in "xzu"), *outputs.values())
        known |= outputs | {"residual": self.residual}
        if what not in known:
            known |= {name: ca.SX(output.expression) for name, output in self.further.items()}
        check_names(f"model '{self.name}'", [what], known)
        rates = {"xdot": self.xdot} if what == "residual" else {}
        given = {"t": self.t, **rates, **variables}
        return ca.Function(what, [*given.values()], [known[what]], [*given], [what])


def _same(a: ca.SX, b: ca.SX) -> bool:
    """Return True if two columns contain the same expressions."""
    return a.shape == b.shape and ca.is_equal(ca.densify(a), ca.densify(b))


def check_model(where: str, model: object) -> None:
    """Raise an error if `model` is not a model, with a hint for laws, scenes and mechanisms."""
    if isinstance(model, Model):
        return
    ways = {
        "model": "call its model()",
        "build": "call its build()",
        "force": "put the law in a scene",
    }
    hint = next((advice for way, advice in ways.items() if hasattr(model, way)), "")
    if isinstance(model, type):
        hint = f"make one, as in {model.__name__}(LuGre()).model()" * hasattr(model, "model")
    raise checks.refused(where, "a model, such as rabinowicz(LuGre())", model, hint)


WORDS = {
    "x": ("state", "states"),
    "z": ("algebraic variable", "algebraic variables"),
    "u": ("input", "inputs"),
    "p": ("parameter", "parameters"),
}


def shown(model: System) -> Shown:
    """Return the names, units and start values of all variables, and the laws of all contacts."""
    counts = [counted(len(getattr(model, g)), *words) for g, words in WORDS.items()]
    counts += [counted(len(model.outputs), "output")]
    rows = [
        (v.name, one, v.unit, figure_of(v.start), v.doc)
        for g, (one, _) in WORDS.items()
        for v in getattr(model, g)
    ]
    rows += [(name, "output", o.unit, "", o.doc) for name, o in model.outputs.items()]
    lists = {
        "friction": friction(model),
        "events": among(e.name for e in model.events) if model.events else "",
        "further results": among(further) if (further := vars(model).get("further")) else "",
    }
    return Shown(
        f"model '{model.name}': {', '.join(c for c in counts if not c.startswith('no '))}",
        table=TextTable(("name", "what", "unit", "start", ""), tuple(rows), numbers=(3,)),
        after=tuple(f"{what}: {text}" for what, text in lists.items() if text),
    )


def friction(model: System) -> str:
    """Return the contacts grouped by law as text, such as "belt by LuGre"."""
    laws: dict[str, list[str]] = {}
    for contact in model.contacts:
        laws.setdefault(type(contact.law).__name__, []).append(contact.name)
    return "; ".join(f"{among(places, 4)} by {law}" for law, places in laws.items())
