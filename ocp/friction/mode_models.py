"""Models with fixed contact modes, and the force that would hold a slipping contact.

    slip, +-1   F = law.sliding(v, N, side)              force on that side of v = 0
    stick, 0    F with dv/dt = 0, an algebraic unknown   while -level(-1) <= F <= level(+1)

Mode models have the names of the user's model except law states, so its costs, bounds and outputs
apply to them. The implicit equations of mechanisms are kept; `F` is added to their unknowns and
`0 = dv/dt` to their equations. Normal forces may depend on reactions.

Contacts of a loop of one degree of freedom stick together. Their slips are s_i = g_i(q) omega, with
the speed omega along the tangent of the constraints. The equations do not determine how the
contacts share the force T = sum g_i F_i that holds the loop. The loop is held as long as possible
if the shares are proportional to the static levels,

    F_i = sign(g_i) S_i T / sum |g_k| S_k,   S_i the static level

as in `symfric.multibody.applied`. All contacts then reach their levels at the same time.

A contact sticks while the required force is below its static level. Break-away depends on the
control *after* this time, which may differ from the control before. It is therefore evaluated in
the slip mode (`holding`). The force is one of the algebraic unknowns of the model in which the
contact sticks,

    0 = alg(x, z, u),    with 0 = d slip / dt among its rows and the force among z,

and is found by Newton's method from the values of the slip mode. One step suffices if the equations
are affine in z, as without normal forces that depend on reactions.
"""

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from ocp.formulation.changed_models import rebuilt
from ocp.formulation.expressions import arguments
from ocp.friction.smooth_models import sticking
from symfric.foundation import checks
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import at_start, stacked
from symfric.model import Contact, Model, Output
from symfric.model.start import rate_of
from symfric.multibody.applied import MINORS, forward, paths_of, tangent_of

RANK = 1e-11
"""Relative size below which singular values of the scaled equations count as zero."""
UNLOADED = 1e-9
"""Static level [N] at the start below which a contact counts as unloaded."""
SIDES = {1: "up", -1: "down"}
"""Side -> suffix of the output "<contact>_grip_<side>", the friction margin of a contact."""
NEWTON_STEPS = 2
"""Number of Newton steps. A normal force by reactions is a smoothed absolute value, which is affine
except near 0."""


class ContactLoop(NamedTuple):
    """Contacts of a loop or of one coordinate, which stick together.

    Attributes:
        members: the contacts, two or more.
        along: g_i of each contact, as a function of the coordinates.
        tangent: unit vector along the tangent of the constraints, SX (n, 1).
    """

    members: tuple[Contact, ...]
    along: tuple[ca.SX, ...]
    tangent: ca.SX

    def shares(self, force: ca.SX) -> list[ca.SX]:
        """Return F_i [N] of each member for the holding `force` T."""
        levels = [(c.static_level(1) + c.static_level(-1)) / 2 for c in self.members]
        weights = [forward(g) * S for g, S in zip(self.along, levels, strict=True)]
        total = self.projected(weights)
        return [w / total * force for w in weights]

    def projected(self, values: Sequence[ca.SX]) -> ca.SX:
        """Return the sum of g_i times the `values` of the members."""
        pairs = zip(self.along, values, strict=True)
        return sum((g * value for g, value in pairs), start=ca.SX(0))


def loops_of(model: Model) -> tuple[ContactLoop, ...]:
    """Return the loops, or coordinates outside loops, of a mechanism with several contacts."""
    mechanics = model.holonomic
    if mechanics is None or ca.depends_on(mechanics.phi, model.t):
        return ()
    q, qd = model.vector("x")[: mechanics.n], model.vector("x")[mechanics.n : 2 * mechanics.n]
    slopes = [(c, ca.jacobian(c.slip, qd)) for c in sticking(model)]
    J = ca.jacobian(mechanics.phi, q)
    loops: list[ContactLoop] = []
    for columns, rows in paths_of(J):
        if len(columns) != len(rows) + 1 or len(columns) > MINORS:
            continue
        tangent = tangent_of(J, columns, rows)
        members = [
            (c, ca.SX(G @ tangent))
            for c, G in slopes
            if G.nnz() and {*G.sparsity().get_col()} <= {*columns}
        ]
        if len(members) > 1:
            contacts, along = zip(*members, strict=True)
            loops.append(ContactLoop(contacts, along, tangent))
    return tuple(loops)


def mode_model(model: Model, modes: Mapping[str, int]) -> Model:
    """Return `model` with a mode for each contact: slip forward 1, slip backward -1, stick 0.

    In stick the friction force is the algebraic unknown "<contact>_reaction". The outputs
    "<contact>_grip_up" and "<contact>_grip_down" are its margins to the static level in both
    directions, which are positive while the contact sticks. The slip remains constant in stick, so
    it should be zero at the start. Contacts without a static level may be omitted. Contacts of a
    loop of one degree of freedom stick together (see above); their reactions are outputs. Results
    are cached in the model.

    Raises:
        ValueError: sticking contacts whose forces the equations do not determine.
    """
    kept: dict[Any, Model] = model.memory.setdefault("mode models", {})
    key = tuple((c.name, int(modes.get(c.name, 1))) for c in model.contacts)
    if key not in kept:
        kept[key] = _in_modes(model, dict(key))
    return kept[key]


def restless(model: Model) -> str:
    """Return the reason why contacts of `model` cannot stick individually, or "" if they can."""
    if loops := loops_of(model):
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
    together = _sticking_loops(model, modes)
    shared = {c.name for loop in together for c in loop.members}
    forces = {c.name: c.sliding(modes[c.name]) for c in model.contacts if modes[c.name]}
    z, rows = list[Variable](), list[ca.SX]()

    def reaction(name: str, unit: str, nominal: float, change: ca.SX) -> ca.SX:
        doc = "friction force in stick"
        z.append(Variable(f"{name}_reaction", unit, nominal=nominal, doc=doc))
        rows.append(change)
        return z[-1].symbol

    for c in held:
        if c.name not in shared:
            size, change = nominal_load(model, c), slip_change(model, c)
            forces[c.name] = reaction(c.name, c.unit("N"), size, change)
    for loop in together:
        size = sum(nominal_load(model, c) for c in loop.members)
        change = loop.projected([slip_change(model, c) for c in loop.members])
        force = reaction(f"{loop.members[0].name}_loop", "", size, change)
        names = (c.name for c in loop.members)
        forces |= dict(zip(names, loop.shares(force), strict=True))
    made = model.with_forces(forces, z=tuple(z), alg=stacked(rows))
    if held:
        _refuse_shared(model, made, held)
    outputs: dict[str, Output] = {}
    for c in held:
        for side, to in ((1, "the level"), (-1, "minus that")):
            margin = c.static_level(side) - side * forces[c.name]
            outputs[f"{c.name}_grip_{SIDES[side]}"] = Output(margin, c.unit("N"), f"margin to {to}")
    for c in held:
        if c.name in shared:
            outputs[f"{c.name}_reaction"] = Output(forces[c.name], c.unit("N"))
    return rebuilt(made, outputs={**made.outputs, **outputs})


def _sticking_loops(model: Model, modes: Mapping[str, int]) -> list[ContactLoop]:
    """Return the loops whose contacts stick; raise ValueError if only some of them stick."""
    loops: list[ContactLoop] = []
    for loop in loops_of(model):
        resting = [c.name for c in loop.members if not modes[c.name]]
        if resting and len(resting) < len(loop.members):
            names = ", ".join(c.name for c in loop.members)
            raise ValueError(
                f"model '{model.name}': modes: expected all or none of {names} at rest, which move "
                f"together in a loop of one degree of freedom, got {', '.join(resting)} at rest"
            )
        loops += [loop] if resting else []
    return loops


def slip_change(model: Model, contact: Contact) -> ca.SX:
    """Return the rate of change of a sliding velocity [m/s^2], with the forces of `model.open`.

    For a mechanism it depends on the accelerations `holonomic.a`.

    Raises:
        ValueError: the sliding velocity depends on an input or an algebraic variable.
    """
    bare, slip = model.open, contact.slip
    if ca.depends_on(slip, ca.vertcat(bare.vector("u"), bare.vector("z"))):
        raise checks.refused(
            f"contact '{contact.name}': slip", "one of states, time and parameters", slip,
            "an input may jump, so the contact cannot stick",
        )  # fmt: skip
    return rate_of(slip, bare)


def nominal_load(model: Model, contact: Contact) -> float:
    """Return the typical holding force [N] of a contact, its static level at the start."""
    symbols = ca.vertcat(model.vector("x"), model.vector("z"), model.vector("u"), model.t)
    level = ca.SX(contact.static_level())
    starts = [v.start for group in (model.x, model.z, model.u) for v in group]
    level = ca.substitute(level, symbols, ca.vertcat(*map(ca.SX, starts), ca.SX(0)))
    level = ca.substitute(level, symbols, ca.SX.zeros(symbols.numel()))
    value = abs(float(at_start(level, model.p)))
    return value if isfinite(value) and value > UNLOADED else 1.0


def _refuse_shared(model: Model, made: Model, held: Sequence[Contact]) -> None:
    """Raise ValueError if the equations do not determine the stiction forces near the start.

    A loop may have fewer degrees of freedom than contacts, and a drive may prescribe a slip.
    """
    slope = ca.densify(ca.jacobian(made.alg, made.vector("z")))
    slopes = ca.Function("slopes", arguments(made), [slope])
    start = made.initial_state()
    starts = np.array([float(at_start(ca.SX(v.start), made.p)) for v in made.z])
    u, p = made.values("u"), made.values("p")
    for off in (0.0, 0.013):
        x, values = (a + off * np.sin(1.0 + np.arange(a.size)) for a in (start, starts + 10 * off))
        matrix = slopes(0.0, x, values, u, p).full()
        for axis in (1, 0):
            largest = np.abs(matrix).max(axis=axis, keepdims=True)
            matrix = matrix / np.where(largest > 0, largest, 1.0)
        rank = np.linalg.matrix_rank(matrix, tol=RANK) if np.isfinite(matrix).all() else 0
        if rank == len(made.z):
            return
    names = ", ".join(c.name for c in held)
    raise ValueError(
        f"model '{model.name}': modes: expected contacts at rest whose forces the equations "
        f"determine, got {names} at rest together; in a loop of few degrees of freedom, or under a "
        "prescribed motion, their shares are undetermined: use friction in one of them"
    )


def holding(model: Model, modes: Mapping[str, int], contact: str) -> tuple[ca.SX, dict[int, ca.SX]]:
    """Return the force [N] that holds or would hold `contact`, and its margins to the static level.

    Args:
        model: the model with contacts.
        modes: contact -> 1, 0 or -1; `contact` may slip or stick.
        contact: name of the contact.

    Returns:
        The force, and side -> margin in this direction, which is negative if friction cannot hold
        the contact; SX (1, 1) in the symbols of the mode model of `modes`. If the equations are
        affine in the algebraic variables, force and margins do not depend on these, so they follow
        from states and inputs at the start of an interval.
    """
    moving, held = mode_model(model, modes), mode_model(model, {**modes, contact: 0})
    symbols = arguments(held)
    step = ca.Function("step", symbols, [newton(held)])
    names = [f"{contact}_reaction", *(f"{contact}_grip_{side}" for side in SIDES.values())]
    outputs = ca.Function("outputs", symbols, [held.expression(name) for name in names])
    t, x, _, u, p = arguments(moving)
    known = {v.name: v.symbol for v in moving.z}
    z = ca.vertcat(*(known.get(v.name, ca.SX(0)) for v in held.z))
    for _ in range(NEWTON_STEPS):
        z = step(t, x, z, u, p)
    force, *margins = (ca.SX(value) for value in outputs.call([t, x, z, u, p]))
    return force, dict(zip(SIDES, margins, strict=True))


def newton(model: Model) -> ca.SX:
    """Return the algebraic unknowns after a step of Newton's method."""
    z = model.vector("z")
    return z - ca.solve(ca.densify(ca.jacobian(model.alg, z)), model.alg)


def excess(model: Model, modes: Mapping[str, int], contact: str, side: int) -> ca.SX:
    """Return the excess [N] of the holding force of `contact` over its static level."""
    return -holding(model, modes, contact)[1][side]
