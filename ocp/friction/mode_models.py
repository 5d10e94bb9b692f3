"""The models that friction is solved with: smoothed over widths, and in one mode of each contact.

    smooth      F = the law with its widths as parameters, or a smooth stand-in for it
    slip, +-1   F = law.sliding(v, N, side)              its force on that side of v = 0
    stick, 0    F with dv/dt = 0, an algebraic unknown   while -level(-1) <= F <= level(+1)

All of them have the names of the user's model, so that a cost, a bound or an output written for it
holds for them; only the states of laws are gone. Mechanisms keep their implicit equations, with
`F` and `0 = dv/dt` in the accelerations among them, and normal forces that follow from reactions.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any, final

import casadi as ca
import numpy as np

from ocp.friction.loops import Loop, loops_of
from symfric.foundation import checks
from symfric.foundation.numeric import tanh
from symfric.foundation.parameters import Parameter, Variable, parameters, with_values
from symfric.foundation.symbols import at_start, stacked
from symfric.laws import Law
from symfric.laws.base import smooth
from symfric.model import Contact, Model, Monitor, Output

RANK = 1e-11
"""Singular values below this share of the scaled equations count as zero."""
UNLOADED = 1e-9
"""Static level [N] at the start below which nothing presses there."""
WIDTH = 1e-3
"""Width [m/s] of a stand-in by default, where the law has no velocity scale."""


@final
@dataclass(frozen=True, eq=False)
class Width:
    """A parameter of a smooth model that sets how wide the layer around v = 0 is.

    Attributes:
        contact: whose it is.
        parameter: its name in `Model.p`, "<contact>_<width>".
        number: its value in the user's model.
        exponent: of the width in it: 1 for a width, -1 for a steepness.
        layer: width of the layer [m/s] at `number`; None for one of a load, as `JointFriction.eps`.
    """

    contact: str
    parameter: str
    number: float
    exponent: int
    layer: float | None

    def at(self, layer: float) -> float:
        """Its value for a layer of that width [m/s].

        Raises:
            ValueError: it is not one of velocities.
        """
        if self.layer is None:
            raise checks.refused(self.parameter, "a width of velocities", "one of a load [N]")
        return self.number * (layer / self.layer) ** self.exponent


def smooth_model(model: Model) -> Model:
    """`model` with the widths of all contacts as parameters, see `widths`.

    Laws that neither smooth nor are smooth (with modes, with states, without regularisation) have
    a stand-in with the same sliding force and static level. With s = tanh 4x, x = v / width,

        F = (1 + s)/2 sliding(|v|, +1) + (1 - s)/2 sliding(-|v|, -1) + excess x / (x^2/4 + 3/4)^2

    where the excess is what the static level has above sliding at v = 0.
    Raises ValueError for laws without a force on each side of v = 0.
    """
    return _smoothed(model)[0]


def widths(model: Model) -> tuple[Width, ...]:
    """The widths of `smooth_model(model)`."""
    return _smoothed(model)[1]


def _smoothed(model: Model) -> tuple[Model, tuple[Width, ...]]:
    kept: dict[str, Any] = model.memory
    if "smooth model" not in kept:
        kept["smooth model"] = _made_smooth(model) if model.contacts else (model, ())
    return kept["smooth model"]


def _made_smooth(model: Model) -> tuple[Model, tuple[Width, ...]]:
    forces, p, found = dict[str, ca.SX](), list[Variable](), list[Width]()
    watched: list[Monitor] = []
    for c in model.contacts:
        try:
            force, own, scale = _smooth_force(model, c)
        except ValueError as error:
            raise ValueError(f"model '{model.name}': contact '{c.name}': {error}") from None
        forces[c.name] = force
        p += own
        layer = float(at_start(scale, (*model.p, *own)))
        if isfinite(layer):
            watched.append(Monitor(c.slip, scale))
        exponents = c.law.widths
        found += [
            Width(c.name, v.name, float(v.start), exponents.get(_local(c, v), 1), layer)
            for v in own
        ]
    loads = {v.name: (c.name, v) for c in model.contacts for v in c.widths.values()}
    found += [Width(name, v.name, float(v.start), 1, None) for name, v in loads.values()]
    p += [v for _, v in loads.values()]
    return model.with_forces(forces, p=tuple(p), monitors=tuple(watched)), tuple(found)


def _local(contact: Contact, parameter: Variable) -> str:
    return parameter.name.removeprefix(f"{contact.name}_")


def _smooth_force(model: Model, contact: Contact) -> tuple[ca.SX, list[Variable], Any]:
    """Force [N], its widths as parameters, and the velocity [m/s] over which it changes."""
    law = _law(contact)
    by_itself = not law.states and not any(i.name not in contact.further for i in law.inputs)
    if by_itself and (law.widths or not jumps(model, contact)):
        known = parameters(law)
        own = [_parameter(model, contact, known[name]) for name in law.widths]
        pairs = zip(law.widths, own, strict=True)
        law = with_values(law, {name: v.symbol for name, v in pairs})
        force = ca.SX(law.force(contact.slip, contact.N, (), **contact.further))
        return force, [v for v in own if ca.depends_on(force, v.symbol)], law.velocity_scale
    scale = float(at_start(law.velocity_scale, model.p))
    width = Variable(
        f"{contact.name}_width", contact.unit("m/s"), start=scale if isfinite(scale) else WIDTH,
        nominal=scale if isfinite(scale) else WIDTH, lower=0.0, doc="width of the smoothed jump",
    )  # fmt: skip
    return _stand_in(contact, width.symbol), [width], width.symbol


def _parameter(model: Model, contact: Contact, width: Parameter) -> Variable:
    """A width of a law as a parameter of the model."""
    number = float(at_start(width.value, model.p))
    return Variable(
        f"{contact.name}_{width.name}", contact.unit(width.unit), start=number, nominal=number,
        lower=width.lower, upper=width.upper, doc=width.doc,
    )  # fmt: skip


def _stand_in(contact: Contact, width: ca.SX) -> ca.SX:
    v, N, law, given = contact.slip, contact.N, _law(contact), contact.further
    x, speed = v / width, smooth.magnitude(v, width)
    s, bump = tanh(4 * x), x / (0.25 * (x * x) + 0.75) ** 2
    force = ca.SX(0)
    for side in (1, -1):
        share = (1 + side * s) / 2
        sliding = law.sliding(side * speed, N, side, **given)
        top = law.static_level(N, side, **given) - side * law.sliding(0.0, N, side, **given)
        force += share * (sliding + top * bump)
    return force


def _law(contact: Contact) -> Law:
    law = contact.law
    if not isinstance(law, Law):
        raise checks.refused(f"contact '{contact.name}': law", "a law such as LuGre()", law)
    return law


def jumps(model: Model, contact: Contact) -> bool:
    """Whether friction holds at rest at all, at the start of the parameters.

    Viscous friction does not, nor does a contact that nothing presses.
    """
    law = _law(contact)
    if ca.SX(contact.N).is_zero():
        return False
    one = law.static_level(1.0, 1, **dict.fromkeys(contact.further, 0.0))
    return float(at_start(one, model.p)) != 0.0


def mode_model(model: Model, modes: Mapping[str, int]) -> Model:
    """`model` with each contact in one mode: sliding forward 1, backward -1, at rest 0.

    At rest the friction force is the algebraic unknown "<contact>_reaction", and the outputs
    "<contact>_grip_up" and "<contact>_grip_down" are what the static level leaves of it to both
    sides; both are above zero while the contact holds. What started at rest stays so; a sliding
    velocity that is not zero at the start of rest is kept. Contacts without a level at rest may be
    left out. Contacts of a loop of one degree of freedom rest together, see `ocp.friction.loops`;
    their reactions are outputs. The same modes of the same model give the same object.

    Raises:
        ValueError: names that are no contacts, contacts without a mode, modes that are none, and
            contacts at rest that share what holds them, so that no equation tells the shares.
    """
    where = f"model '{model.name}': modes"
    names = [c.name for c in model.contacts]
    given = checks.named(where, modes, names)
    for name, mode in given.items():
        checks.count(f"{where}: {name}", mode, least=-1, most=1)
    missing = [c.name for c in model.contacts if c.name not in given and jumps(model, c)]
    if missing:
        raise ValueError(
            f"{where}: expected 1, 0 or -1 for each contact, got none for {', '.join(missing)}"
        )
    kept: dict[Any, Model] = model.memory.setdefault("mode models", {})
    key = tuple((name, int(given.get(name, 1))) for name in names)
    if key not in kept:
        kept[key] = _in_modes(model, dict(key))
    return kept[key]


def restless(model: Model) -> str:
    """Why the contacts of `model` cannot rest one by one; mostly empty."""
    contacts = [c for c in model.contacts if jumps(model, c)]
    if loops := loops_of(model, contacts):
        names = ", ".join(c.name for c in loops[0].members)
        return (
            f"expected contacts that rest one by one, got {names}, which do so together in a loop"
        )
    try:
        mode_model(model, dict.fromkeys((c.name for c in model.contacts), 0))
    except ValueError as error:
        return str(error)
    return ""


def _in_modes(model: Model, modes: Mapping[str, int]) -> Model:
    held = [c for c in model.contacts if not modes[c.name]]
    together = _resting_loops(model, modes)
    shared = {c.name for loop in together for c in loop.members}
    alone = [c for c in held if c.name not in shared]
    forces = {c.name: c.sliding(modes[c.name]) for c in model.contacts if modes[c.name]}
    z, rows = list[Variable](), list[ca.SX]()
    for c in alone:
        z.append(_reaction(c.name, c.unit("N"), nominal_load(model, c)))
        rows.append(slip_change(model, c))
        forces[c.name] = z[-1].symbol
    for loop in together:
        loads = [nominal_load(model, c) for c in loop.members]
        z.append(_reaction(loop.name, "", sum(loads)))
        rows.append(loop.projected([slip_change(model, c) for c in loop.members]))
        names = (c.name for c in loop.members)
        forces |= dict(zip(names, loop.shares(z[-1].symbol), strict=True))
    made = model.with_forces(forces, z=tuple(z), alg=stacked(rows))
    if held:
        _refuse_shared(model, made, held)
    known = {v.name for v in z}
    outputs = dict(_grips(held, forces))
    reactions = {f"{c.name}_reaction": Output(forces[c.name], c.unit("N")) for c in held}
    outputs |= {name: output for name, output in reactions.items() if name not in known}
    return with_outputs(made, outputs)


def _reaction(name: str, unit: str, nominal: float) -> Variable:
    doc = "friction force that holds at rest"
    return Variable(f"{name}_reaction", unit, nominal=nominal, doc=doc)


def _resting_loops(model: Model, modes: Mapping[str, int]) -> list[Loop]:
    """Loops whose contacts rest: all of them, or none."""
    found: list[Loop] = []
    for loop in loops_of(model, [c for c in model.contacts if jumps(model, c)]):
        resting = [c.name for c in loop.members if not modes[c.name]]
        if resting and len(resting) < len(loop.members):
            names = ", ".join(c.name for c in loop.members)
            raise ValueError(
                f"model '{model.name}': modes: expected all or none of {names} at rest, which move "
                f"together in a loop of one degree of freedom, got {', '.join(resting)} at rest"
            )
        found += [loop] if resting else []
    return found


def _grips(held: Sequence[Contact], forces: Mapping[str, ca.SX]) -> Iterator[tuple[str, Output]]:
    for c in held:
        F, unit = forces[c.name], c.unit("N")
        yield f"{c.name}_grip_up", Output(c.static_level(1) - F, unit, "room below the level")
        yield f"{c.name}_grip_down", Output(c.static_level(-1) + F, unit, "room above minus that")


def with_outputs(model: Model, outputs: Mapping[str, Output]) -> Model:
    """`model` with further outputs."""
    if not outputs:
        return model
    changes: dict[str, Any] = {"outputs": {**model.outputs, **outputs}}
    if model.holonomic is not None:
        changes |= {"ode": None, "alg": ca.SX(0, 1)}  # made of `holonomic` once more
    return replace(model, **changes)


def slip_change(model: Model, contact: Contact) -> ca.SX:
    """Rate of change of a sliding velocity [m/s^2], in the forces of `model.open`.

    In a mechanism in its accelerations `holonomic.a`.

    Raises:
        ValueError: the sliding velocity depends on an input or an algebraic variable.
    """
    bare, slip = model.open, contact.slip
    x = bare.vector("x")
    if ca.depends_on(slip, ca.vertcat(bare.vector("u"), bare.vector("z"))):
        raise checks.refused(
            f"contact '{contact.name}': slip", "one of states, time and parameters", slip,
            "an input jumps, and a contact cannot rest on it",
        )  # fmt: skip
    mechanics = bare.holonomic
    if mechanics is None:
        rate = ca.SX(0, 1) if bare.ode is None else bare.ode
    else:
        n = mechanics.n
        rate = ca.vertcat(x[n : 2 * n], mechanics.a, mechanics.rates)
    return ca.jtimes(slip, x, rate) + ca.jacobian(slip, bare.t)


def nominal_load(model: Model, contact: Contact) -> float:
    """Typical size [N] of what holds a contact: its static level at the start."""
    symbols = ca.vertcat(model.vector("x"), model.vector("z"), model.vector("u"), model.t)
    level = ca.SX(contact.static_level())
    starts = [v.start for group in (model.x, model.z, model.u) for v in group]
    level = ca.substitute(level, symbols, ca.vertcat(*map(ca.SX, starts), ca.SX(0)))
    level = ca.substitute(level, symbols, ca.SX.zeros(symbols.numel()))
    value = abs(float(at_start(level, model.p)))
    return value if isfinite(value) and value > UNLOADED else 1.0


def _refuse_shared(model: Model, made: Model, held: Sequence[Contact]) -> None:
    """Refuse rest that the equations do not determine, in numbers at the start and near it.

    Loops may have fewer degrees of freedom than contacts, and a drive may prescribe a sliding.
    """
    z = made.vector("z")
    symbols = [made.t, *(made.vector(letter) for letter in "xzup")]
    slopes = ca.Function("slopes", symbols, [ca.densify(ca.jacobian(made.alg, z))])
    start, size = made.initial_state(), z.numel()
    starts = np.array([float(at_start(ca.SX(v.start), made.p)) for v in made.z])
    u, p = made.values("u"), made.values("p")
    for off in (0.0, 0.013):
        x, values = (a + off * np.sin(1.0 + np.arange(a.size)) for a in (start, starts + 10 * off))
        matrix = slopes(0.0, x, values, u, p).full()
        for axis in (1, 0):
            largest = np.abs(matrix).max(axis=axis, keepdims=True)
            matrix = matrix / np.where(largest > 0, largest, 1.0)
        if np.isfinite(matrix).all() and np.linalg.matrix_rank(matrix, tol=RANK) == size:
            return
    names = ", ".join(c.name for c in held)
    raise ValueError(
        f"model '{model.name}': modes: expected contacts at rest whose forces the equations "
        f"determine, got {names} at rest together; in a loop of few degrees of freedom, or under a "
        "prescribed motion, how they share what holds them is open: let friction act in one of them"
    )
