"""Fields of a model, start values of its states, accelerations, and substitution in its parts."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from math import isfinite
from typing import Any, NamedTuple, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation import checks
from symfric.foundation.numeric import Buffered, Scalar, evaluate_all
from symfric.foundation.parameters import Variable
from symfric.foundation.units import per_second
from symfric.foundation.variable import stacked, starts_of, symbols_of
from symfric.model.contact import Contact, Variables
from symfric.model.parts import Event, Holonomic, Monitor, Output
from symfric.model.sketch import Sketch

SLOW = 1e-6
"""Sliding velocity, relative to the nominal values of the states, that counts as zero in x0."""


@dataclass(frozen=True, eq=False, repr=False)
class System:
    """Base class of `Model`: variables, equations and results, and start values of the states."""

    name: str
    x: Variables = ()
    z: Variables = ()
    u: Variables = ()
    p: Variables = ()
    ode: ca.SX | None = None
    alg: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    xdot: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    residual: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    outputs: Mapping[str, Output] = field(default_factory=dict[str, Output])
    monitors: tuple[Monitor, ...] = ()
    events: tuple[Event, ...] = ()
    t: ca.SX = field(default_factory=lambda: ca.SX.sym("t"))
    holonomic: Holonomic | None = None
    details: Callable[[], Mapping[str, Output]] = dict[str, Output]
    sketch: Callable[[], Sketch] | None = None
    contacts: tuple[Contact, ...] = ()

    def vector(self, letter: str) -> ca.SX:
        """Return the symbols of the group "x", "z", "u" or "p" as a column (n, 1)."""
        return self._vectors[letter]

    @cached_property
    def _vectors(self) -> dict[str, ca.SX]:
        return {letter: symbols_of(getattr(self, letter)) for letter in "xzup"}

    def nominal(self, letter: str) -> NDArray[np.float64]:
        """Return the typical magnitudes of a group of variables, shape (n,)."""
        return np.array([v.nominal for v in getattr(self, letter)], dtype=float)

    def values(self, letter: str, given: Mapping[str, float] | None = None) -> NDArray[np.float64]:
        """Return the values of the group "u" or "p": start values, replaced by those in `given`."""
        group: Variables = getattr(self, letter)
        if not group and given is None:
            return np.zeros(0)
        values = self.named(letter, given)
        for v in self.p if letter == "p" else ():
            if v.name in values:
                v.within(f"{self.name}.{v.name}", values[v.name])
        numbers = {v.name: v.start for v in group} | values
        return np.array(
            [checks.number(f"{self.name}.{name}", x) for name, x in numbers.items()], float
        )

    def named(self, what: str, given: Mapping[str, Any] | None) -> dict[str, Any]:
        """Return the values `given` by name for "x0", "u" or "p"; empty for None.

        Raises:
            ValueError: `given` is not a mapping, or has a name that is not in the group.
        """
        if given is None:
            return {}
        known = self._names[what[0]]
        if type(given) is dict and given.keys() <= known.keys():
            return given.copy()  # the usual case
        values = checks.named(f"model '{self.name}' {what}", given)
        fixed = ", ".join(f'"{name}"' for name in values if name not in known)
        ways = {
            "p": f"free it when the model is made, rabinowicz(law, free=[{fixed}]), or with "
            f"symbolise(law, {fixed}) and Model(p=...)",
            "u": "the model has no inputs" * (not known),
        }
        hint = ways.get(what, "")
        if what == "x0" and not {v.name for v in self.z}.isdisjoint(values):
            hint = "algebraic variables follow from their equations"
        checks.check_names(f"model '{self.name}' {what}", values, known, hint)
        return values

    def initial_state(
        self, given: Mapping[str, float] | None = None, p: Mapping[str, float] | None = None,
        t: float = 0.0,
    ) -> NDArray[np.float64]:  # fmt: skip
        """Return the start values of x at the time `t` [s], replaced by those in `given`.

        A start value may be an expression: a bristle in steady sliding depends on the sliding
        velocity. It is evaluated with the given values of the other states and the parameters, and
        with the start values of the algebraic variables. The result has the shape (nx,).
        """
        return self.started(given, self.values("p", p), t)

    def started(
        self, given: Mapping[str, float] | None, p: NDArray[np.float64], t: float
    ) -> NDArray[np.float64]:
        """Return `initial_state` for the values of all parameters."""
        known, chosen = self._chosen(given)
        (start,) = self._starting(known, chosen, self._inputs_at_start, p, t)
        if not isfinite(sum(start.tolist())):
            for v, x in zip(self.x, start.tolist(), strict=True):
                checks.number(f"{self.name}.{v.name}", x)
        if given and self.modes:
            self._check_modes(given, start[:, None], self._inputs_at_start[:, None], p[:, None], t)
        return start

    def initial_states(
        self,
        given: Mapping[str, NDArray[np.float64]],
        p: Mapping[str, NDArray[np.float64]],
        count: int,
        t: float | NDArray[np.float64] = 0.0,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the start values (count, nx) and parameters (count, n_p) of `count` members.

        `t` [s] is the start time; it has the shape (count,) if it differs between members.
        """
        given, p = self.named("x0", given), self.named("p", p)

        def rows(group: Variables, values: Mapping[str, Any], start: Any) -> NDArray[np.float64]:
            found = np.tile(np.reshape(start, (-1, 1)), (1, count))
            for i, v in enumerate(group):
                found[i] = values.get(v.name, found[i])
            return found

        parameters = rows(self.p, p, self.values("p"))
        known = rows(self.x, given, np.zeros(len(self.x)))
        chosen = rows((), {}, [float(v.name in given) for v in self.x])
        inputs, times = rows((), {}, self.values("u")), np.broadcast_to(t, (1, count))
        start = self._start.map(count)(known, chosen, inputs, parameters, times).full()
        if given and self.modes:
            self._check_modes(given, start, inputs, parameters, times)
        return start.T, parameters.T

    @cached_property
    def modes(self) -> dict[str, Contact]:
        """Contacts by the name of their mode, for laws whose only state is a mode."""
        return {
            c.states[0].name: c for c in self.contacts if [s.name for s in c.law.states] == ["mode"]
        }

    @cached_property
    def _slips(self) -> ca.Function:
        """Function (x, z, u, p, t) -> sliding velocities of `modes`, and their slopes by x."""
        slips, x = stacked(c.slip for c in self.modes.values()), self.vector("x")
        groups = [self.vector(letter) for letter in "xzup"]
        every = [ca.densify(slips), ca.densify(ca.jacobian(slips, x))]
        return ca.Function("slips", [*groups, self.t], every)

    def _check_modes(self, given: Mapping[str, Any], x: Any, u: Any, p: Any, t: Any) -> None:
        """Refuse a given mode that contradicts the sliding velocity; columns are members.

        Raises:
            ValueError: a contact sticks while it slides, or slides in the other direction.
        """
        count, z = x.shape[1], np.array([[float(v.start)] for v in self.z]).reshape(-1, 1)
        times = np.broadcast_to(t, (1, count))
        found = self._slips(x, np.tile(z, count), u, p, times)
        speeds, slopes = (np.array(one) for one in found)
        least = SLOW * np.abs(slopes).reshape(len(speeds), count, -1) @ self.nominal("x")
        for i, name in enumerate(self.modes):
            if name not in given:
                continue
            modes = np.round(x[self._names["x"][name]])
            wrong = np.where(modes == 0, np.abs(speeds[i]), -modes * speeds[i]) > least[i]
            if wrong.any():
                k = int(wrong.argmax())
                raise ValueError(
                    f"{self.name}.{name}: expected 0 in stick, else the direction of sliding, got "
                    f"{modes[k]:g} at a sliding velocity of {speeds[i, k]:g}; leave it out of x0"
                )

    def start_slopes(
        self, given: Mapping[str, float] | None = None, p: Mapping[str, float] | None = None,
        t: float = 0.0,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:  # fmt: skip
        """Return the derivatives of `initial_state` with respect to p and to values in `given`."""
        rows = *self._chosen(given), self.values("u"), self.values("p", p), [t]
        by_p, by_start = evaluate_all(self._start_slopes, *map(np.array, rows))
        return by_p, by_start

    def _chosen(self, given: Mapping[str, float] | None) -> tuple[list[float], list[float]]:
        """Return the given start values of all states, else 0, and 1 for each given one, else 0."""
        known, chosen = [0.0] * len(self.x), [0.0] * len(self.x)
        for name, x in self.named("x0", given).items():
            i = self._names["x"][name]
            usual = type(x) is float and isfinite(x)
            known[i] = x if usual else checks.number(f"{self.name}.{name}", x)
            chosen[i] = 1.0
        return known, chosen

    @cached_property
    def _names(self) -> dict[str, dict[str, int]]:
        """Position of each variable by name, for each group."""
        groups = {letter: getattr(self, letter) for letter in "xup"}
        return {a: {v.name: i for i, v in enumerate(group)} for a, group in groups.items()}

    @cached_property
    def _inputs_at_start(self) -> NDArray[np.float64]:
        return self.values("u")

    @cached_property
    def _starting(self) -> Buffered:
        return Buffered(self._start)

    @cached_property
    def _start(self) -> ca.Function:
        """Start values as a Function of (given values, mask of given values, u, p, t)."""
        return start_function(self.x, self.vector("u"), self.vector("p"), self.t, self.z)

    @cached_property
    def _start_slopes(self) -> ca.Function:
        """Derivatives of `_start` with respect to p and to the given values."""
        arguments = self._start.sx_in()
        x = self._start(*arguments)
        slopes = [ca.densify(ca.jacobian(x, arguments[i])) for i in (3, 0)]
        return ca.Function("slopes", arguments, slopes)


def start_function(
    x: Sequence[Variable], u: ca.SX, p: ca.SX, t: ca.SX, z: Sequence[Variable] = ()
) -> ca.Function:
    """Return start values of states as a Function of (values, mask of given values, u, p, t).

    Start values that depend on the algebraic variables `z` use the start values of `z`, because the
    solution of the algebraic equations requires the states.
    """
    n, states = len(x), symbols_of(x)
    known, chosen = ca.SX.sym("known", n), ca.SX.sym("chosen", n)
    rows = [ca.if_else(chosen[i], known[i], v.start) for i, v in enumerate(x)]
    values = ca.substitute(stacked(rows), symbols_of(z), starts_of(z))
    for _ in x:
        if not ca.depends_on(values, states):
            break
        values = ca.substitute(values, states, values)
    arguments = [known, chosen, u, p, t]
    return ca.Function("start", arguments, [values], ["known", "chosen", "u", "p", "t"], ["x"])


def accelerations(model: System) -> dict[str, Output]:
    """Return the rate of r as the output `<q>_acc` for every state q whose rate is a state r.

    A speed that is not the rate of a state, as in models without angles, has the output
    `<speed>_acc`. States of friction laws have no such output. Neither have implicit models, since
    their rates are not expressions.
    """
    if model.ode is None:
        return {}
    places = {v.symbol.__hash__(): i for i, v in enumerate(model.x)}
    of_laws = {v.name for contact in model.contacts for v in contact.states}
    found: dict[str, Output] = {}
    rates = ca.vertsplit(ca.densify(model.ode))
    # copies of a symbol share its node, so the hash of the node identifies the symbol
    pairs = [(v, places.get(r.__hash__()) if r.is_symbolic() else None)
             for v, r in zip(model.x, rates, strict=True)]  # fmt: skip
    taken = {i for _, i in pairs if i is not None}
    for k, (v, i) in enumerate(pairs):
        alone = k not in taken and v.unit in ("m/s", "rad/s") and v.name not in of_laws
        if i is None and not alone:
            continue
        r = k if i is None else i
        unit = model.x[r].unit and per_second(model.x[r].unit)
        found[f"{v.name}_acc"] = Output(model.ode[r], unit, f"acceleration of {v.name}")
    return found


def rate_of(expression: ca.SX, model: System) -> ca.SX:
    """Return the time derivative of an expression of states, parameters and time.

    For a mechanism it depends on the accelerations `holonomic.a`.
    """
    x, mechanics = symbols_of(model.x), model.holonomic
    rates = ca.SX(0, 1) if model.ode is None else model.ode
    if mechanics is not None:
        rates = ca.vertcat(x[mechanics.n : 2 * mechanics.n], mechanics.a, mechanics.rates)
    return ca.jtimes(expression, x, rates) + ca.jacobian(expression, model.t)


@final
class Put(NamedTuple):
    """Substitution of the symbols `old` by the expressions `new`, both SX (n, 1)."""

    old: ca.SX
    new: ca.SX

    def __call__(self, expression: Scalar) -> ca.SX:
        """Return the expression after the substitution."""
        return ca.substitute(ca.SX(expression), self.old, self.new)

    def explicit(self, model: System) -> dict[str, Any]:
        """Return equations, outputs, monitors and events of a model after the substitution."""
        names = list(model.outputs)
        parts = [ca.SX(0, 1) if model.ode is None else ca.SX(model.ode), ca.SX(model.alg)]
        parts += [ca.SX(model.outputs[name].expression) for name in names]
        ode, alg, *values = ca.substitute(parts, [self.old], [self.new])  # together: shared parts
        pairs = zip(names, values, strict=True)
        return {
            "ode": ode,
            "alg": alg,
            "outputs": {n: replace(model.outputs[n], expression=value) for n, value in pairs},
            "monitors": tuple(map(self.monitor, model.monitors)),
            "events": tuple(map(self.event, model.events)),
            "details": partial(self.outputs, model.details),
        }

    def outputs(self, write: Callable[[], Mapping[str, Output]]) -> dict[str, Output]:
        """Return the further results of `write` after the substitution."""
        return {n: replace(o, expression=self(o.expression)) for n, o in write().items()}

    def monitor(self, monitor: Monitor) -> Monitor:
        """Return a monitor after the substitution."""
        return replace(monitor, expression=self(monitor.expression))

    def event(self, event: Event) -> Event:
        """Return an event after the substitution."""
        reset = {name: self(value) for name, value in event.reset.items()}
        return replace(event, expression=self(event.expression), reset=reset)
