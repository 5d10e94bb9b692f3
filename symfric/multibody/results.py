"""Results of a mechanism that are written only when somebody asks for one of them.

    joint_Fx ... joint_Mz   what a joint's constraints transmit to its child
    rod_tension             force in a massless rod, negative under pressure
    body_x ... body_vz      position and velocity of a centre of mass in the world
    force_work_rate         power that a force which is not conservative puts into the bodies
    friction_work_rate      the same of friction in all joints, above zero where it drives
    drive_work_rate         the same of prescribed motions
    conserved               kinetic and potential energy without potentials of time or inputs

Carried along always, the reactions alone would take the outputs of a six-joint arm from 377 to
1910 operations and from 21 to 51 in number; written when asked for, all details take 5 ms.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import casadi as ca

from symfric.foundation.symbols import stacked, strays
from symfric.model import Output
from symfric.model.kinds import WORK
from symfric.multibody.equations import Equations
from symfric.multibody.forces import Axial, Force
from symfric.multibody.joint import COMPONENTS, FORCE, Joint
from symfric.multibody.joints import Distance
from symfric.multibody.kinematics import angles
from symfric.multibody.spatial import GROUND

Put = Callable[[Sequence[ca.SX]], list[ca.SX]]
"""Expressions in accelerations and friction forces -> the same in the symbols of the model."""


def results(
    eq: Equations,
    joints: Iterable[Joint],
    forces: Iterable[Force],
    undetermined: Sequence[str],
    p: ca.SX,
    put: Put,
) -> dict[str, Output]:
    """All further results by name.

    Args:
        eq: equations of the mechanism.
        joints, forces: all of them.
        undetermined: names of joints whose reactions are not unique; they are left out.
        p: symbols of the parameters.
        put: brings expressions into the symbols of the model.
    """
    by_name = {joint.name: joint for joint in joints}
    found = [
        *_reactions(eq, [j for j in by_name.values() if j.name not in undetermined]),
        *_centres(eq),
        *_work(eq, by_name, forces, ca.vertcat(eq.q, angles(eq.turns), p)),
    ]
    values = put([output.expression for _, output in found])
    own = {str(eq.q[i]) for i in range(eq.n)}
    return {
        name: replace(output, expression=value)
        for (name, output), value in zip(found, values, strict=True)
        if name not in own  # absolute coordinates are the centres of mass
    }


def _reactions(eq: Equations, joints: Sequence[Joint]) -> Iterator[tuple[str, Output]]:
    """Force [N] and moment [N m] on the child of each joint about its joint point.

    In the axes of the joint's frame on the child; friction, motors and springs along or about the
    axis of the joint are not in it.
    """
    for joint in joints:
        column = ca.vertcat(*eq.reactions[joint.name])
        for component in joint.transmits:
            unit, what = ("N", "force") if component in FORCE else ("N m", "moment")
            value = column[COMPONENTS.index(component)]
            doc = f"{what} of joint '{joint.name}' on its child along {component[1]} of its frame"
            yield f"{joint.name}_{component}", Output(value, unit, doc)
        if isinstance(joint, Distance):
            relative = eq.kin.relative(joint)
            along = ca.dot(relative.R @ column[:3], relative.p)
            yield f"{joint.name}_tension", Output(-along / joint.length, "N", "force in the rod")


def _centres(eq: Equations) -> Iterator[tuple[str, Output]]:
    """Positions [m] and velocities [m/s] of all centres of mass in the world."""
    for name, motion in eq.kin.motion.items():
        if name == GROUND:
            continue
        at, v = motion.point(eq.kin.topology.bodies[name].c)
        for i, axis in enumerate("xyz"):
            yield f"{name}_{axis}", Output(at[i], "m", f"centre of mass of '{name}' along {axis}")
        for i, axis in enumerate("xyz"):
            yield f"{name}_v{axis}", Output(v[i], "m/s", f"its velocity along {axis}")


def _work(
    eq: Equations, joints: dict[str, Joint], forces: Iterable[Force], still: ca.SX
) -> Iterator[tuple[str, Output]]:
    """Powers [W] that change the sum of kinetic energy and of potentials of q alone.

    A potential that depends on anything but `still` (its spring hangs on an input or on time) is
    none: the whole power of its force counts.
    """
    kin, conserved = eq.kin, eq.kinetic
    positions = ca.vertcat(eq.q, angles(eq.turns))
    rates = ca.vertcat(eq.qd, stacked(turn.rate for turn in eq.turns))
    for force in forces:
        energy = ca.SX(force.energy(kin, joints))
        own = not strays(energy, still)
        if own:
            conserved += energy
        if own and force.conservative:
            continue
        power = ca.SX(0)
        for load in force.loads(kin, joints):
            if isinstance(load, Axial):
                power += load.value * kin.rate(load.joint, load.direction)
            else:
                power += load.power(kin)
        if own:
            power += ca.jtimes(energy, positions, rates)
        yield f"{force.name}_work_rate", Output(power, "W", f"power put in by '{force.name}'", WORK)
    if eq.contacts:
        taken = sum((-ca.dot(c.F, c.slip) for c in eq.contacts), ca.SX(0))
        yield (
            "friction_work_rate",
            Output(taken, "W", "power put in by friction, above zero where it drives", WORK),
        )
    if eq.m and not eq.phi_t.is_zero():
        drive = ca.dot(eq.lam, eq.phi_t)
        yield "drive_work_rate", Output(drive, "W", "power put in by prescribed motions", WORK)
    yield "conserved", Output(conserved, "J", "energy without potentials of time or inputs")


CONSTRAINT = {"N": "m", "N m": "rad", "N/m": "m^2"}
"""Unit of a multiplier -> that of its constraint: their product is an energy."""


def multiplier_units(eq: Equations) -> dict[str, str]:
    """Name of a multiplier -> its unit; "" where the user's expression has none that is known.

    A constraint on places is loaded by a force, one on directions by a moment; that of a rod, on
    the square of its length, by a force over length.
    """
    found: dict[str, str] = {}
    for loop in eq.loops:
        m = loop.phi.numel()
        for i in range(m):
            label = f"{loop.joint.name}_lambda" + (f"_{i + 1}" if m > 1 else "")
            found[label] = "N/m" if isinstance(loop.joint, Distance) else _of(loop.C_v[i, :])
    found |= {label: part.unit for part in eq.held for label in part.labels}
    found |= {f"{link.joint.name}_norm": "J" for link in eq.kin.topology.links}
    return found


def _of(along: ca.SX) -> str:
    """That of the multiplier of a constraint whose rate is `along` times a velocity, and so on."""
    return "N m" if along.nnz() == 0 or along.is_zero() else "N"


def constraint_units(units: list[str]) -> tuple[str, str, str]:
    """Those of the norms of the constraints on three levels; "" where they are of several kinds."""
    kinds = {CONSTRAINT.get(unit, "") for unit in units}
    unit = kinds.pop() if len(kinds) == 1 else ""
    return (unit, f"{unit}/s", f"{unit}/s^2") if unit else ("", "", "")
