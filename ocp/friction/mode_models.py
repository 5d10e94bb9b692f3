"""Models with fixed contact modes, and the force that would hold a slipping contact.

    slip, +-1   F = law.sliding(v, N, side)              its force on that side of v = 0
    stick, 0    F with dv/dt = 0, an algebraic unknown   while -level(-1) <= F <= level(+1)

They have the names of the user's model, so that its costs, bounds and outputs apply to them; only
law states are absent. Mechanisms keep their implicit equations, with `F` and `0 = dv/dt` in the
accelerations among them, and normal forces that follow from reactions.

Contacts of a loop of one degree of freedom stick together. The slips are s_i = g_i(q) omega, with
omega the speed along the tangent of the constraints. The equations do not determine how the
contacts share the force T = sum g_i F_i that holds the loop. They hold it as long as possible,
which requires shares proportional to their static levels,

    F_i = sign(g_i) S_i T / sum |g_k| S_k,   S_i the static level

as in `symfric.multibody.applied`. All of them reach their levels at the same instant.

A sticking contact keeps sticking while the force needed is below its static level. Break-away
depends on the control *after* that instant, which may differ from the one before, and is evaluated
in the slip mode, where nothing holds the contact (`holding`): the force is part of the algebraic
unknowns of the model in which it sticks,

    0 = alg(x, z, u),    with 0 = d slip / dt among its rows and the force among z,

found by Newton's method from the values of the slip mode: in one step if the equations are affine
in z, as without normal forces that follow from reactions.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any, final

import casadi as ca
import numpy as np

from ocp.friction.smooth_models import jumps
from symfric.foundation import checks
from symfric.foundation.graph import coupled
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import at_start, stacked
from symfric.laws.base import smooth
from symfric.model import Contact, Model, Output
from symfric.multibody.applied import null_direction

MINORS = 8
"""Largest number of coordinates of a loop, whose tangent is computed from minors."""
RANK = 1e-11
"""Singular values below this share of the scaled equations count as zero."""
UNLOADED = 1e-9
"""Static level [N] at the start below which a contact is unloaded."""
SIDES = {1: "up", -1: "down"}
"""Suffixes of the outputs "<contact>_grip_<side>": friction margin of a sticking contact."""
NEWTON_STEPS = 2
"""Newton steps; a normal force is a smoothed absolute value of reactions, affine except near 0."""


@final
@dataclass(frozen=True, eq=False)
class Loop:
    """Contacts that stick together.

    Attributes:
        members: the contacts, two or more.
        along: g_i of each, in the coordinates.
    """

    members: tuple[Contact, ...]
    along: tuple[ca.SX, ...]

    @property
    def name(self) -> str:
        """Name of the force that holds the loop."""
        return f"{self.members[0].name}_loop"

    def shares(self, force: ca.SX) -> list[ca.SX]:
        """Return F_i [N] of each member for a holding force T."""
        levels = [(c.static_level(1) + c.static_level(-1)) / 2 for c in self.members]
        weights = [
            ca.SX(smooth.choose(g < 0, -1.0, 1.0)) * S
            for g, S in zip(self.along, levels, strict=True)
        ]
        total = sum((g * w for g, w in zip(self.along, weights, strict=True)), start=ca.SX(0))
        return [w / total * force for w in weights]

    def projected(self, changes: Sequence[ca.SX]) -> ca.SX:
        """Return the combination of the members' slip rates that is zero in stick."""
        pairs = zip(self.along, changes, strict=True)
        return sum((g * change for g, change in pairs), start=ca.SX(0))


def loops_of(model: Model, contacts: Sequence[Contact]) -> tuple[Loop, ...]:
    """Return the loops of a mechanism in which several of `contacts` stick together."""
    mechanics = model.holonomic
    if mechanics is None or not mechanics.phi.numel() or ca.depends_on(mechanics.phi, model.t):
        return ()
    q, qd = model.vector("x")[: mechanics.n], model.vector("x")[mechanics.n : 2 * mechanics.n]
    found: list[Loop] = []
    pattern = ca.DM(ca.jacobian(mechanics.phi, q).sparsity(), 1).full() != 0
    for columns, rows in coupled(pattern):
        if len(columns) != len(rows) + 1 or len(columns) > MINORS:
            continue
        tangent = ca.SX(mechanics.n, 1)
        tangent[columns] = null_direction(ca.jacobian(mechanics.phi, q)[rows, columns])
        slopes = [(c, ca.jacobian(c.slip, qd)) for c in contacts]
        touched = {c.name: {*G.sparsity().get_col()} for c, G in slopes}
        members = [
            (c, ca.SX(G @ tangent))
            for c, G in slopes
            if touched[c.name] and touched[c.name] <= {*columns}
        ]
        if len(members) > 1:
            found.append(Loop(tuple(c for c, _ in members), tuple(g for _, g in members)))
    return tuple(found)


def mode_model(model: Model, modes: Mapping[str, int]) -> Model:
    """Return `model` with a mode for each contact: slip forward 1, slip backward -1, stick 0.

    In stick the friction force is the algebraic unknown "<contact>_reaction", and the outputs
    "<contact>_grip_up" and "<contact>_grip_down" are its margins to the static level in both
    directions, both positive while the contact holds. A contact without slip keeps it zero; a
    nonzero slip at the start of stick is kept. Contacts without a static level may be omitted.
    Contacts of a loop of one degree of freedom stick together (see above); their reactions are
    outputs. The same modes of the same model return the same object.

    Raises:
        ValueError: names that are not contacts, contacts without a mode, invalid modes, and
            sticking contacts whose forces the equations do not determine.
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
    """Return the reason why contacts of `model` cannot stick individually, or ""."""
    contacts = [c for c in model.contacts if jumps(model, c)]
    if loops := loops_of(model, contacts):
        names = ", ".join(c.name for c in loops[0].members)
        return (
            f"expected contacts that stick one by one, got {names}, which stick together in a loop"
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
    doc = "friction force in stick"
    return Variable(f"{name}_reaction", unit, nominal=nominal, doc=doc)


def _resting_loops(model: Model, modes: Mapping[str, int]) -> list[Loop]:
    """Return the loops whose contacts stick, all of them."""
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
        yield f"{c.name}_grip_up", Output(c.static_level(1) - F, unit, "margin to the level")
        yield f"{c.name}_grip_down", Output(c.static_level(-1) + F, unit, "margin to minus that")


def with_outputs(model: Model, outputs: Mapping[str, Output]) -> Model:
    """Return `model` with additional outputs."""
    if not outputs:
        return model
    changes: dict[str, Any] = {"outputs": {**model.outputs, **outputs}}
    if model.holonomic is not None:
        changes |= {"ode": None, "alg": ca.SX(0, 1)}  # derived again from `holonomic`
    return replace(model, **changes)


def slip_change(model: Model, contact: Contact) -> ca.SX:
    """Return the rate of change of a sliding velocity [m/s^2], in the forces of `model.open`.

    For a mechanism it is a function of the accelerations `holonomic.a`.

    Raises:
        ValueError: the sliding velocity depends on an input or an algebraic variable.
    """
    bare, slip = model.open, contact.slip
    x = bare.vector("x")
    if ca.depends_on(slip, ca.vertcat(bare.vector("u"), bare.vector("z"))):
        raise checks.refused(
            f"contact '{contact.name}': slip", "one of states, time and parameters", slip,
            "an input may jump, so the contact cannot stick",
        )  # fmt: skip
    mechanics = bare.holonomic
    if mechanics is None:
        rate = ca.SX(0, 1) if bare.ode is None else bare.ode
    else:
        n = mechanics.n
        rate = ca.vertcat(x[n : 2 * n], mechanics.a, mechanics.rates)
    return ca.jtimes(slip, x, rate) + ca.jacobian(slip, bare.t)


def nominal_load(model: Model, contact: Contact) -> float:
    """Return the typical holding force [N] of a contact: its static level at the start."""
    symbols = ca.vertcat(model.vector("x"), model.vector("z"), model.vector("u"), model.t)
    level = ca.SX(contact.static_level())
    starts = [v.start for group in (model.x, model.z, model.u) for v in group]
    level = ca.substitute(level, symbols, ca.vertcat(*map(ca.SX, starts), ca.SX(0)))
    level = ca.substitute(level, symbols, ca.SX.zeros(symbols.numel()))
    value = abs(float(at_start(level, model.p)))
    return value if isfinite(value) and value > UNLOADED else 1.0


def _refuse_shared(model: Model, made: Model, held: Sequence[Contact]) -> None:
    """Raise ValueError if the equations do not determine the stiction forces, near the start.

    Loops may have fewer degrees of freedom than contacts, and a drive may prescribe a slip.
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
        "prescribed motion, their shares are undetermined: use friction in one of them"
    )


def rubbing(model: Model) -> tuple[Contact, ...]:
    """Return the contacts that can stick: friction that is zero at v = 0 has no modes."""
    return tuple(contact for contact in model.contacts if jumps(model, contact))


def holding(model: Model, modes: Mapping[str, int], contact: str) -> tuple[ca.SX, dict[int, ca.SX]]:
    """Return the force [N] that holds `contact`, or would, and its margins to the static level.

    Args:
        model: the model with contacts.
        modes: +1, 0 or -1 of each contact; `contact` may slip or stick.
        contact: name of the contact.

    Returns:
        The force, and side -> margin in that direction, negative if friction cannot hold; SX (1, 1)
        in the symbols of the mode model of `modes`. They do not depend on algebraic variables if
        the equations are affine in these: at the start of an interval they follow from states and
        inputs there.
    """
    moving, held = mode_model(model, modes), mode_model(model, {**modes, contact: 0})
    symbols = [held.t, *(held.vector(letter) for letter in "xzup")]
    z = symbols[2]
    newton = z - ca.solve(ca.densify(ca.jacobian(held.alg, z)), held.alg)
    step = ca.Function("step", symbols, [newton])
    names = [f"{contact}_reaction", *(f"{contact}_grip_{side}" for side in SIDES.values())]
    outputs = ca.Function("outputs", symbols, [held.expression(name) for name in names])
    t, x, u, p = moving.t, *(moving.vector(letter) for letter in "xup")
    known = {v.name: v.symbol for v in moving.z}  # each mode model has its own reactions
    found = ca.vertcat(*(known.get(v.name, ca.SX(0)) for v in held.z))
    for _ in range(NEWTON_STEPS):
        found = step(t, x, found, u, p)
    force, *rooms = (ca.SX(value) for value in outputs.call([t, x, found, u, p]))
    return force, dict(zip(SIDES, rooms, strict=True))


def excess(model: Model, modes: Mapping[str, int], contact: str, side: int) -> ca.SX:
    """Return the excess [N] of the holding force of `contact` over its static level."""
    return -holding(model, modes, contact)[1][side]
