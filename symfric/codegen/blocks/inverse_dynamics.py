"""Blocks of a mechanism: inverse dynamics with joint friction, and gravity compensation."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from symfric.codegen.blocks.block import SHEET, Block
from symfric.codegen.blocks.joints import ContactStep, contact_step, with_gravity, with_payload
from symfric.codegen.blocks.variables import in_arrays, numbered, step_size
from symfric.foundation import checks
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import stacked, starts_of, symbols_of
from symfric.model import Output, Variables
from symfric.multibody import Mechanism
from symfric.multibody.actuated import ActuatedContact
from symfric.multibody.contact import Contact, ElementContact, JointContact
from symfric.multibody.equations import Equations
from symfric.multibody.urdf import read_urdf

WHERE = "inverse dynamics"

SAID = SHEET["mechanism"]
NEWTON = 4
"""Number of Newton steps for the multipliers of couplings with friction."""


def inverse_dynamics_block(
    mechanism: Mechanism | str | Path,
    *,
    name: str | None = None,
    p: Variables = (),
    payload: str | None = None,
    payload_inertia: bool = False,
    tunable_gravity: bool = False,
    separate: bool = False,
    fold: bool = False,
    h: float | None = None,
) -> Block:
    """Return the block of the forces that a motion requires, including joint friction.

        tau = M(q) qdd + c(q, qd) + g(q) + friction(qd, N(q, qd, qdd), z)

    The block uses the Newton-Euler recursion. The normal force N of a bearing loaded by reactions
    is that of this motion, including payload and acceleration; it must not depend on friction, so
    no equation is solved. Bristles are states of the block and make a step with velocity and normal
    force held, see `law_block`; use the velocity and acceleration that are planned for the step.

    Inputs are q_1 ... q_n, qd_1 ..., qdd_1 ... in the order of the joints that the header names;
    outputs are tau_1 ... [N m or N], positive along the joint. Parameters and states of the laws,
    and constant normal forces, have the numbers of their joints; the parameters can be changed at
    run time. Inputs of the mechanism keep their start values; those of motors are zero.

    Couplings of constant ratio, such as fingers that mimic another one in URDF files, reduce the
    coordinates to those of the leading joints; tau includes the forces that move the others. In a
    coupling with friction, a leads b: the forces tau act on a. Its normal force depends on its own
    friction and follows from four Newton steps, which are exact for friction proportional to N.

    Args:
        mechanism: a mechanism, a URDF file or its text; `read_urdf(file, law=..., bearings=...)`
            selects the friction of a URDF file.
        name: C identifier; default the name of the mechanism.
        p: parameters of the mechanism that remain variable, as for `Mechanism.build`.
        payload: the frame "body.frame", or the body or link, that carries a load whose mass
            payload_m and centre of mass payload_c are parameters, initially zero.
        payload_inertia: True if the load also has moments of inertia payload_J.
        tunable_gravity: True if the gravity vector is a parameter, as for a robot on a vehicle.
        separate: True if friction, which tau contains, is also output as friction_1 ...
        fold: True if the parameters of friction become constants.
        h: step size [s] of laws with states as a constant; without it h is a parameter.

    Raises:
        ValueError: closed loops, balls or free bodies, prescribed motion; laws without a step of
            their states (Leuven, smooth GMS) or that need the applied force (exact Coulomb,
            Karnopp); friction whose normal force depends on other friction; a payload at an
            unknown place; errors of `Mechanism.build`.
    """
    checks.flag(f"{WHERE}: separate", separate)
    checks.flag(f"{WHERE}: fold", fold)
    machine = _machine(mechanism, p, payload, payload_inertia, tunable_gravity)
    eq, size = machine.eq, step_size(WHERE, h)
    parts = [
        contact_step(contact, machine.along(contact), normal, ca.SX(size.h), fold=fold)
        for contact, normal in zip(eq.contacts, eq.normals, strict=True)
    ]
    machine = machine.loaded(stacked(part.force for part in parts))
    labels = [machine.label(part.along) for part in parts]
    states, order = numbered([part.law.states for part in parts], labels)
    if h is not None and not states:
        raise ValueError(f"{WHERE}: h: expected none without laws with states, got {h!r}")
    still = ca.substitute(eq.balance, eq.F, ca.SX.zeros(eq.F.numel()))
    friction = ca.jacobian(eq.balance, eq.F) @ stacked(part.force for part in parts)
    motion, friction = machine.leading(still), machine.leading(friction)
    following, sliding = (
        machine.moved(ca.SX(stacked(columns))[order] if order else ca.SX(0, 1))
        for columns in ([p.following for p in parts], [p.sliding for p in parts])
    )
    outputs = machine.outputs("tau", motion + friction, "force required by the motion")
    if separate:
        outputs |= machine.outputs("friction", friction, "friction, included in tau")
    of_laws, _ = numbered([part.parameters for part in parts], labels)
    return in_arrays(Block(
        name or machine.identifier,
        **machine.texts("Inverse dynamics", parts),
        states=states,
        inputs=machine.inputs,
        parameters=(*machine.parameters, *of_laws, *(size.parameters if states else ())),
        next=following,
        outputs=outputs,
        resets={"init_sliding": (sliding, SHEET["law"]["sliding"])} if states else {},
        constants=size.constants,
    ))  # fmt: skip


def gravity_block(
    mechanism: Mechanism | str | Path,
    *,
    name: str | None = None,
    p: Variables = (),
    payload: str | None = None,
    tunable_gravity: bool = False,
) -> Block:
    """Return the block of the forces that hold a mechanism at rest, tau = g(q), without friction.

    Springs are included. The arguments are those of `inverse_dynamics_block`; the default name ends
    in _gravity.
    """
    machine = _machine(mechanism, p, payload, False, tunable_gravity)
    eq = machine.eq
    zero = [ca.SX.zeros(eq.n), ca.SX.zeros(eq.n), ca.SX.zeros(eq.F.numel())]
    holding = machine.leading(ca.substitute([eq.balance], [eq.qd, eq.a, eq.F], zero)[0])
    return in_arrays(Block(
        name or f"{machine.identifier}_gravity",
        **machine.texts("Forces that hold it at rest: g(q)", ()),
        inputs=tuple(v for v in machine.inputs if v.name.startswith("q_")),
        parameters=tuple(v for v in machine.parameters if ca.depends_on(holding, v.symbol)),
        outputs=machine.outputs("tau", holding, "force that holds it"),
    ))  # fmt: skip


class _Machine(NamedTuple):
    """Equations of a mechanism in its leading coordinates.

    Attributes:
        joints: leading coordinates.
        inputs: q, qd, qdd of the leading coordinates.
        symbols, values: symbols in the equations, and their values in terms of the inputs.
        T: matrix of the rates of all coordinates by the leading rates, shape (n, k).
        follows: indices of the other coordinates.
    """

    name: str
    eq: Equations
    joints: Variables
    inputs: Variables
    parameters: Variables
    symbols: Sequence[ca.SX]
    values: Sequence[ca.SX]
    T: ca.DM
    follows: Sequence[int]

    @property
    def identifier(self) -> str:
        """Name as a C identifier; names in robot files may begin with a digit."""
        return self.name if self.name[:1].isalpha() else f"robot_{self.name.lstrip('_')}"

    def along(self, contact: Contact) -> str:
        """Return the coordinate that a contact resists."""
        if isinstance(contact, JointContact):
            joint = self.eq.kin.topology.link_of[contact.part].joint
            return joint.coordinate(joint.directions[contact.direction])
        return contact.name

    def label(self, coordinate: str) -> str:
        """Return the number of a leading coordinate, or the name of another coordinate."""
        names = [v.name for v in self.joints]
        return str(names.index(coordinate) + 1) if coordinate in names else coordinate

    def moved(self, expression: ca.SX) -> ca.SX:
        """Return an expression of all coordinates in terms of the leading coordinates."""
        return ca.substitute([expression], list(self.symbols), list(self.values))[0]

    def loaded(self, F: ca.SX) -> "_Machine":
        """Return the machine with the multipliers of couplings under the friction forces `F`.

        Without forces on the coordinates that follow, their rows of the balance vanish.
        """
        eq = self.eq
        if not ca.depends_on(F, eq.lam):
            return self
        pairs = [(s, v) for s, v in zip(self.symbols, self.values, strict=True) if s is not eq.lam]
        rows = ca.substitute(eq.balance, eq.F, F)[list(self.follows), 0]
        (rows,) = ca.substitute([rows], [s for s, _ in pairs], [v for _, v in pairs])
        following, lam = eq.lam - ca.solve(ca.jacobian(rows, eq.lam), rows), ca.SX.zeros(eq.m)
        for _ in range(NEWTON):
            lam = ca.substitute(following, eq.lam, lam)
        values = [lam if s is eq.lam else v for s, v in zip(self.symbols, self.values, strict=True)]
        return self._replace(values=values)

    def leading(self, forces: ca.SX) -> ca.SX:
        """Return forces along all coordinates as forces along the leading coordinates."""
        return ca.densify(ca.SX(self.T.T) @ self.moved(forces))

    def outputs(self, stem: str, column: ca.SX, doc: str) -> dict[str, Output]:
        """Return one output for each leading coordinate."""
        units = ("N m" if v.unit == "rad" else "N" for v in self.joints)
        rows = zip(ca.vertsplit(column), units, strict=True)
        return {f"{stem}_{k}": Output(row, unit, doc) for k, (row, unit) in enumerate(rows, 1)}

    def texts(self, what: str, parts: Sequence[ContactStep]) -> dict[str, Any]:
        """Return the texts of the data sheet."""
        laws = {part.law.name: part.law for part in parts}
        order = ", ".join(f"{k} {v.name}" for k, v in enumerate(self.joints, start=1))
        where = (
            f"{law} in {', '.join(self.label(p.along) for p in parts if p.law.name == law)}"
            for law in laws
        )

        def all_of(field: str) -> list[str]:
            texts = (getattr(law, field) for law in laws.values())
            each = (text if isinstance(text, tuple) else (text,) * bool(text) for text in texts)
            return list(dict.fromkeys(sentence for several in each for sentence in several))

        every = [text for law in laws.values() for text in (law.doc, law.equations) if text]
        return {
            "doc": f"{what} of '{self.name}'.",
            "equations": "\n\n".join(
                [SAID["equations"], *[SAID["friction"]] * bool(parts), *every]
            ),
            "discretisation": "\n\n".join(all_of("discretisation")),
            "use": (
                f"Joints: {order}.",
                *[f"Friction, numbered by joints: {'; '.join(where)}."] * bool(parts),
                *SAID["use"],
                *[SAID["mean"]] * any(law.states for law in laws.values()),
            ),
            "limits": (*SAID["limits"], *all_of("limits")),
            "sources": (*SAID["sources"], *all_of("sources")),
        }


def _machine(
    mechanism: Mechanism | str | Path, p: Variables, payload: str | None, inertia: bool, g: bool
) -> _Machine:
    """Return the equations of a mechanism, with variable payload and gravity if requested."""
    checks.flag(f"{WHERE}: payload_inertia", inertia)
    checks.flag(f"{WHERE}: tunable_gravity", g)
    if inertia and payload is None:
        raise ValueError(f"{WHERE}: payload_inertia: expected with a payload only")
    if payload is not None:
        checks.text(f"{WHERE}: payload", payload, "the name of a frame, such as 'tool0'")
    if not isinstance(mechanism, Mechanism):
        mechanism = read_urdf(mechanism)
    parameters = tuple(p)
    if payload is not None:
        mechanism, load = with_payload(mechanism, payload, inertia=inertia)
        parameters += load
    if g:
        mechanism, gravity = with_gravity(mechanism)
        parameters += gravity
    made = mechanism.prepare(parameters)
    eq, u = made.eq, tuple(mechanism.inputs)
    _check(eq, mechanism)
    T, offset, leads = couplings(eq)
    joints = tuple(made.q[i] for i in leads)
    inputs = [
        Variable(
            f"{stem}_{k}", f"{v.unit}{per}", doc=what, nominal=nominal, lower=-limit, upper=limit
        )
        for stem, per, what, nominal, limit in (
            ("q", "", "coordinate", 1.0, 1e4),
            ("qd", "/s", "velocity", 1.0, 1e3),
            ("qdd", "/s^2", "acceleration", 5.0, 1e5),
        )
        for k, v in enumerate(joints, start=1)
    ]
    y, yd, ydd = ca.vertsplit(symbols_of(inputs), len(joints))
    T_sx = ca.SX(T)
    return _Machine(
        name=mechanism.name,
        eq=eq,
        joints=joints,
        inputs=tuple(inputs),
        parameters=parameters,
        symbols=[eq.q, eq.qd, eq.a, eq.lam, symbols_of(u)],
        values=[T_sx @ y + offset, T_sx @ yd, T_sx @ ydd, ca.SX.zeros(eq.m), ca.SX(starts_of(u))],
        T=T,
        follows=[i for i in range(eq.n) if i not in leads],
    )


def _check(eq: Equations, mechanism: Mechanism) -> None:
    """Check that the recursion supports the mechanism.

    Raises:
        ValueError: the mechanism is not supported; the message names the joints.
    """
    where = f"{WHERE} of '{mechanism.name}'"
    if eq.loops:
        names = ", ".join(loop.joint.name for loop in eq.loops)
        raise ValueError(
            f"{where}: expected an open chain or tree, got loops that close in {names}, whose "
            "multipliers are not determined by the motion alone; `plant_block` and "
            "`functions` support loops"
        )
    balls = [v.joint.name for v in eq.kin.topology.links if v.joint.quaternion is not None]
    if balls:
        raise ValueError(
            f"{where}: expected joints that turn about or slide along axes, got Euler parameters "
            f"in {', '.join(balls)}; a fixed base needs a Fixed joint or the ground"
        )
    everything = ca.veccat(eq.balance, *eq.normals, eq.phi)
    if ca.depends_on(everything, eq.kin.t):
        raise ValueError(f"{where}: expected time-independent forces and constraints, got others")
    pairs = zip(eq.contacts, eq.normals, strict=True)
    own = [(c, N) for c, N in pairs if not isinstance(c, ActuatedContact)]
    if pressed := [c.part for c, N in own if ca.depends_on(N, eq.F)]:
        raise ValueError(
            f"{where}: expected normal forces that do not depend on friction, got that of "
            f"{', '.join(dict.fromkeys(pressed))}, which depends on other friction; give it a "
            "constant normal force"
        )


def couplings(eq: Equations) -> tuple[ca.DM, ca.DM, list[int]]:
    """Return T, c and the indices of the leading coordinates y; all coordinates are T y + c.

    Raises:
        ValueError: a constraint that is not linear in the coordinates, or whose ratio is not a
            number; constraints that do not determine the other coordinates.
    """
    J, at_zero = ca.jacobian(eq.phi, eq.q), ca.substitute(eq.phi, eq.q, ca.SX.zeros(eq.n))
    if not (J.is_constant() and at_zero.is_constant()):
        raise ValueError(
            f"{WHERE}: expected constraints with constant ratios, got others; leave them "
            "out, or use `plant_block`"
        )
    matrix, constant = ca.DM(ca.densify(J)).full(), ca.DM(at_zero).full()
    elements = (c.ends[1] for c in eq.contacts if isinstance(c, ElementContact))
    links = eq.kin.topology.link_of
    driven = {links[b.joint.name].first + b.joint.directions[b.direction] for b in elements}
    follows: list[int] = []
    for row in matrix:
        free = (i for i in range(eq.n) if row[i] != 0.0 and i not in follows)
        follows.append(max(free, key=lambda i: (i in driven, i)))
    leads = [i for i in range(eq.n) if i not in follows]
    T, c = np.zeros((eq.n, len(leads))), np.zeros((eq.n, 1))
    T[leads, range(len(leads))] = 1.0
    if follows:
        own = matrix[:, follows]
        T[follows] = -np.linalg.solve(own, matrix[:, leads])
        c[follows] = -np.linalg.solve(own, constant)
    return ca.DM(ca.sparsify(ca.DM(T))), ca.DM(c), leads
