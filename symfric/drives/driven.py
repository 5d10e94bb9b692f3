"""Models moved by the current of a drive instead of a force.

The input force F of a model is replaced by that of a drive,

    F = phi(F_m, v) - m_r a,   F_m = ratio torque_constant clip(i, +-limit)

The acceleration of explicit equations is a = alpha + beta F, which gives

    a = (alpha + beta phi) / (1 + beta m_r)

A mechanism, M a - g F = ..., has the velocity v = g' q', and the acceleration of its balance
replaces a.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from math import inf
from typing import NamedTuple, cast

import casadi as ca

from symfric.drives.drive import Drive
from symfric.foundation import checks
from symfric.foundation.numeric import equals
from symfric.foundation.parameters import Variable, symbolise
from symfric.laws.base import smooth
from symfric.model import Contact, Model, Output
from symfric.model.forces import opened
from symfric.model.kinds import WORK
from symfric.model.model import check_model
from symfric.model.parts import Holonomic
from symfric.model.start import Put

WHERE = "driven"
LIMITS = ("saturate", "bounds")
ENERGIES = ("kinetic", "energy", "conserved")
"""Results of a mechanism that include the kinetic energy."""


def driven(
    model: Model,
    drive: Drive,
    input: str | None = None,
    *,
    name: str = "",
    limit: str = "saturate",
    free: tuple[str, ...] = (),
) -> Model:
    """Return the model with the current of a drive as input instead of a force.

    The model has the inertia of the rotor, the losses of the gear, and these outputs:

        motor_torque   torque_constant i [N m]
        motor_speed    ratio v [rad/s]
        gear_loss      F_m v - phi v [W], >= 0 where |F_m| is not rounded
        copper_loss    i^2 resistance [W]; i^2 [A^2] without a resistance

    With limit="bounds", the input `current` has the bounds +-`current_limit` of the drive, which
    optimal control obeys: integral(lambda s: s.copper_loss) is its cost. Drives of several joints
    are added one by one, each with a name.

    The energy balance of a mechanism has the work of the motor as that of the actuator, and the
    losses of the gear as "gear"; the kinetic energy includes the rotor.

    Args:
        model: explicit model, or model of a mechanism, in which the force is an input.
        drive: the drive, rotary for a torque and linear for a force.
        input: input that is the force of the drive; by default the only input.
        name: prefix of the new names, such as "elbow" for elbow_current.
        limit: "saturate" clips the current at its limit, for simulation, and accepts any input;
            "bounds" only gives the input its bounds, for optimal control, which needs derivatives
            at the limit.
        free: parameters of the drive that become parameters of the model.

    Raises:
        ValueError: the model is implicit, the force does not act along one coordinate with a
            constant direction, units do not agree, or names are taken.
    """
    check_model(WHERE, model)
    checks.kind(f"{WHERE}: drive", drive, Drive, "a drive, such as Drive(torque_constant=0.1)")
    checks.choice(f"{WHERE}: limit", limit, LIMITS)
    where, names = f"{WHERE}: model '{model.name}'", [u.name for u in model.u]
    if input is None and len(names) != 1:
        raise ValueError(f"{where}: expected the name of its input, got {len(names)} inputs")
    checks.check_names(f"{where}: input", [input := input or names[0]], names)
    force = next(u for u in model.u if u.name == input)
    unit = "N m" if drive.turning else "N"
    if force.unit != unit:
        hint = "a drive without lead and drum_radius is rotary"
        raise checks.refused(f"{where}: input '{input}'", f"a force [{unit}]", force.unit, hint)
    drive, p = symbolise(drive, *free)
    most = drive.current_limit
    mark = f"{name}_" if name else ""
    bound = inf if most is None or limit == "saturate" else most
    current = Variable(
        f"{mark}current", "A", nominal=most or 1.0, doc="current of the drive", lower=-bound,
        upper=bound,
    )  # fmt: skip
    held = current.symbol
    if most is not None and limit == "saturate":
        held = ca.SX(smooth.clip(held, -most, most))
    motor = Motor(drive, force, current, held, p, mark, where)
    return _in_mechanism(model, motor) if model.holonomic is not None else _explicit(model, motor)


class Motor(NamedTuple):
    """Drive at one input of a model.

    Attributes:
        drive: the drive, which may contain the symbols of `p`.
        force: the input that it replaces.
        current: the input that replaces it.
        held: current within its limit.
        p: parameters of the drive.
        mark: prefix of names.
        where: beginning of messages.
    """

    drive: Drive
    force: Variable
    current: Variable
    held: ca.SX
    p: tuple[Variable, ...]
    mark: str
    where: str

    def outputs(self, v: ca.SX) -> dict[str, Output]:
        """Return the additional outputs at the velocity v of the load."""
        d, i = self.drive, self.held
        F_m = d.force_constant * i
        R, unit = (1.0, "A^2") if equals(d.resistance, 0.0) else (d.resistance, "W")
        loss = F_m * v - d.at_load(F_m, v) * v
        found = {
            "motor_torque": Output(d.torque_constant * i, "N m", "torque of the motor"),
            "motor_speed": Output(d.ratio * v, "rad/s", "speed of the motor"),
            "gear_loss": Output(loss, "W", "power lost in the gear"),
            "copper_loss": Output(R * i**2, unit, "copper loss" + ", per ohm" * (unit != "W")),
        }
        return {self.mark + name: output for name, output in found.items()}

    def phi(self, v: ca.SX) -> ca.SX:
        """Return the force at the load without the inertia of the rotor."""
        return ca.SX(self.drive.at_load(self.drive.force_constant * self.held, v))

    def inputs(self, u: tuple[Variable, ...]) -> tuple[Variable, ...]:
        """Return the inputs with the current instead of the force."""
        return tuple(self.current if v is self.force else v for v in u)


def _explicit(model: Model, motor: Motor) -> Model:
    """Return a model with explicit equations, with the current as input."""
    bare, contacts, where = model.open, (), f"{motor.where}: input '{motor.force.name}'"
    if bare is not model:
        if not isinstance(model.opening, partial) or model.opening.func is not opened:
            raise ValueError(f"{motor.where}: expected a model of this process, got one of a file")
        contacts: tuple[Contact, ...] = model.opening.args[0]["contacts"]
    if bare.ode is None:
        raise ValueError(f"{motor.where}: expected explicit equations, ode, got implicit ones")
    u = motor.force.symbol
    slope = ca.jacobian(bare.ode, u)
    rate = "rad/s" if motor.drive.turning else "m/s"
    rows = [k for k in slope.sparsity().row() if bare.x[k].unit == rate]
    if len(rows) != 1 or slope.nnz() != 1 or ca.depends_on(ca.vertcat(slope, bare.alg), u):
        such = f"one that accelerates a single state [{rate}] in proportion"
        raise ValueError(f"{where}: expected {such}, got another")
    k, beta, v, m_r = rows[0], slope[rows[0]], bare.x[rows[0]].symbol, motor.drive.rotor
    alpha, phi = ca.substitute(bare.ode[k], u, ca.SX(0)), motor.phi(v)
    a = (alpha + beta * phi) / (1 + beta * m_r)
    put, resting = Put(u, phi - m_r * a), Put(u, phi)

    def moved(c: Contact) -> Contact:
        """Return the contact, with its applied force that of rest if it is on the driven mass."""
        along = resting if ca.depends_on(ca.SX(c.slip), v) else put
        return replace(c, N=put(c.N), given={n: along(g) for n, g in c.given.items()})

    ode = ca.SX(bare.ode)
    ode[k] = a
    changes = put.explicit(bare)
    return replace(
        bare, **changes | {"ode": ode, "outputs": changes["outputs"] | motor.outputs(v)},
        u=motor.inputs(model.u), p=(*model.p, *motor.p), contacts=tuple(map(moved, contacts)),
    )  # fmt: skip


def _in_mechanism(model: Model, motor: Motor) -> Model:
    """Return the model of a mechanism, with the current as input."""
    mechanics = cast(Holonomic, model.holonomic)
    n, u, m_r = mechanics.n, motor.force.symbol, motor.drive.rotor
    g = -ca.jacobian(mechanics.implicit[:n, 0], u)
    if not g.is_constant() or g.is_zero():
        such = "a force with a constant direction along the coordinates, as of a joint"
        raise ValueError(f"{motor.where}: input '{motor.force.name}': expected {such}, got another")
    v = ca.dot(g, model.vector("x")[n : 2 * n, 0])
    phi = motor.phi(v)
    put = Put(u, phi - m_r * ca.dot(g, mechanics.a))
    inner = mechanics.inner
    if inner is not None:
        inner = replace(inner, f=put(inner.f), values=put(inner.values))
    changed = replace(
        mechanics, implicit=put(mechanics.implicit), rates=put(mechanics.rates), inner=inner,
        pressing=put(mechanics.pressing), solve=mechanics.solve if equals(m_r, 0.0) else None,
    )  # fmt: skip
    put = Put(u, phi - m_r * ca.dot(g, changed.explicit[0]))
    energy = m_r * v**2 / 2
    changes, opening = put.explicit(model), model.opening
    outputs = _with_rotor(changes["outputs"], energy) | motor.outputs(v)
    contacts = tuple(
        replace(c, N=put(c.N), given={n: put(x) for n, x in c.given.items()})
        for c in model.contacts
    )
    return replace(
        model, ode=None, alg=ca.SX(0, 1), outputs=outputs, holonomic=changed, contacts=contacts,
        monitors=changes["monitors"], events=changes["events"],
        details=partial(_details, model.details, put, motor, v, energy),
        u=motor.inputs(model.u), p=(*model.p, *motor.p),
        opening=None if opening is None else partial(_opened, opening, motor),
    )  # fmt: skip


def _opened(opening: Callable[[], Model], motor: Motor) -> Model:
    """Return the open model of a mechanism with the current as input."""
    return _in_mechanism(opening(), motor)


def _with_rotor(found: Mapping[str, Output], energy: ca.SX) -> dict[str, Output]:
    """Return the outputs with the energy of the rotor in those of the mechanism."""
    own = {n: o for n, o in found.items() if n in ENERGIES}
    return {**found, **{n: replace(o, expression=o.expression + energy) for n, o in own.items()}}


def _details(
    details: Callable[[], Mapping[str, Output]], put: Put, motor: Motor, v: ca.SX, energy: ca.SX
) -> dict[str, Output]:
    """Return the further results, with the power of the motor and the losses of the gear."""
    found, work, u = dict(details()), dict[str, Output](), motor.force.symbol
    for name, output in found.items():
        if output.kind == WORK and ca.depends_on(ca.SX(output.expression), u):
            F_m = motor.drive.force_constant * motor.held
            work[name] = replace(output, expression=Put(u, F_m)(output.expression))
    if work:
        lost = motor.outputs(v)[f"{motor.mark}gear_loss"].expression
        work[f"{motor.mark}gear_work_rate"] = Output(-lost, "W", "losses of the gear", WORK)
    return _with_rotor(put.outputs(lambda: found), energy) | work
