"""Inverse dynamics of a robot, linear in its inertial parameters, and its URDF with new ones.

    tau = Y(q, q', q'') pi,   pi = (m, m c, J) of each body: ten numbers

J are the moments of inertia about the origin of the body. Since tau is linear in pi, Y is the
Jacobian of the inverse dynamics at m = 1, c = 0, where it has the fewest terms.
"""

import warnings
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from math import inf, pi
from pathlib import Path
from typing import final

import casadi as ca
import numpy as np

from identification.data.record import Array
from symfric.codegen.blocks.inverse_dynamics import couplings
from symfric.foundation.parameters import Variable
from symfric.foundation.shown import brief
from symfric.foundation.variable import starts_of, symbols_of
from symfric.multibody.mechanism import Mechanism
from symfric.multibody.urdf import carried, holding, merged, read_urdf
from symfric.multibody.urdf_file import SINGLE, Inertial, Urdf, UrdfJoint, parse
from symfric.multibody.urdf_tags import tags

TERMS = ("m", "mx", "my", "mz", "Jxx", "Jyy", "Jzz", "Jxy", "Jxz", "Jyz")
"""Inertial parameters of a body: mass, first moments, moments of inertia about its origin."""
UNITS = ("kg", *("kg m",) * 3, *("kg m^2",) * 6)
ROWS, COLUMNS = (0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)
"""Positions of the moments of inertia of `TERMS` in their matrix."""
WHERE = "identify robot"


@final
@dataclass(frozen=True, eq=False)
class RobotModel:
    """Robot of a URDF file whose n joints have measured torques.

    Attributes:
        urdf: content of the file, in which joints that move no mass are fixed.
        joints: the n joints; joints that mimic another one are not included.
        bodies: link that names each of k moving bodies with a mass.
        pi: inertial parameters of the file, ten for each body, shape (10 k,).
        regressor: CasADi function (q, qd, qdd) -> Y, shape (n, 10 k).
    """

    urdf: Urdf
    joints: tuple[UrdfJoint, ...]
    bodies: tuple[str, ...]
    pi: Array
    regressor: ca.Function

    __repr__ = brief

    @classmethod
    def read(cls, source: str | Path) -> "RobotModel":
        """Read a URDF file. Its friction is not used, because friction is identified.

        Raises:
            ValueError: mistakes of the file (see `read_urdf`), no inertias, a planar joint.
        """
        urdf, _ = holding(parse(source))
        moved = [joint for joint in urdf.outwards() if joint.kind != "fixed"]
        if not any(urdf.links.values()) or not moved:
            what = "joints" if any(urdf.links.values()) else "links with <inertial>"
            hint = "the file defines the kinematics and rough values of all masses"
            raise ValueError(f"{WHERE}: expected {what}, got none in '{urdf.name}'; {hint}")
        wide = [joint.name for joint in moved if joint.kind not in SINGLE]
        if wide:
            such = "joints that turn about or slide along an axis"
            raise ValueError(f"{WHERE}: expected {such}, got {', '.join(wide)}")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of parts such as limits that are not needed here
            mechanism = copy(read_urdf(source))
        mechanism.joints = [replace(joint, friction=None) for joint in mechanism.joints]
        places = carried(urdf)
        links = [link for link in urdf.links if link == places[link].body != urdf.root]
        weights = {link: merged(urdf, places, link) for link in links}
        regressor, leads = _regressor(mechanism, [*weights.values()])
        bodies = tuple(link for link, weight in weights.items() if weight.mass > 0)
        numbers = [inertial_numbers(weights[link]) for link in bodies]
        called = dict(zip((joint.name for joint in mechanism.joints), moved, strict=True))
        joints = tuple(called[name] for name in leads)
        return cls(urdf, joints, bodies, np.concatenate(numbers), regressor)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the joints."""
        return tuple(joint.name for joint in self.joints)

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the coordinates, "rad" or "m"."""
        return tuple("m" if joint.kind == "prismatic" else "rad" for joint in self.joints)

    @property
    def forces(self) -> tuple[str, ...]:
        """Units of the torques and forces, "N m" or "N"."""
        return tuple("N" if unit == "m" else "N m" for unit in self.units)

    def limits(self, key: str, otherwise: float = inf) -> Array:
        """Return a limit of each joint, one of lower, upper, velocity, effort, shape (n,).

        Zero speeds and efforts, which some exporters write, count as missing.
        """
        found = [joint.limits.get(key, otherwise) for joint in self.joints]
        if key in ("velocity", "effort"):
            found = [value or otherwise for value in found]
        turning = [joint.kind == "continuous" for joint in self.joints]
        return np.where(turning, otherwise, found) if key in ("lower", "upper") else np.array(found)

    @property
    def span(self) -> tuple[Array, Array]:
        """Lower and upper positions; half a turn or 0.5 m where the file has no limits, (n,)."""
        half = np.where(np.array(self.units) == "rad", pi, 0.5)
        low, high = self.limits("lower"), self.limits("upper")
        known = np.isfinite(low) & np.isfinite(high) & (low < high)
        return np.where(known, low, -half), np.where(known, high, half)

    def inertial_columns(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Return Y at N samples; the arguments have shape (N, n), the result (N, n, 10 k)."""
        count, n = q.shape
        many = self.regressor.map(count)(q.T, qd.T, qdd.T).full()
        return many.T.reshape(count, -1, n).transpose(0, 2, 1)

    def torques(self, q: Array, qd: Array, qdd: Array, values: Array | None = None) -> Array:
        """Return the torques without friction of N samples, shape (N, n).

        Args:
            q, qd, qdd: motion, shape (N, n) each.
            values: inertial parameters, shape (10 k,); None: those of the file.
        """
        return self.inertial_columns(q, qd, qdd) @ (self.pi if values is None else values)

    def random_motion(self, count: int, seed: int = 0) -> tuple[Array, Array, Array]:
        """Return independent random positions, rates and accelerations within the limits."""
        rng = np.random.default_rng(seed)
        low, high = self.span
        speed = np.minimum(self.limits("velocity"), high - low)
        q = rng.uniform(low, high, (count, low.size))
        qd, qdd = (rng.uniform(-1.0, 1.0, q.shape) * speed * size for size in (1.0, 3.0))
        return q, qd, qdd


def inertial_numbers(weight: Inertial) -> Array:
    """Return (m, m c, J) of a body about its origin, shape (10,)."""
    m, c = weight.mass, weight.com
    J = weight.J + m * (c @ c * np.eye(3) - np.outer(c, c))
    return np.array([m, *(m * c), *J[ROWS, COLUMNS]])


def inertial_of(numbers: Array) -> Inertial:
    """Return mass, centre of mass and inertia about it; the inverse of `inertial_numbers`."""
    m, c, J = float(numbers[0]), numbers[1:4] / numbers[0], np.zeros((3, 3))
    J[ROWS, COLUMNS] = J[COLUMNS, ROWS] = numbers[4:]
    return Inertial(m, c, J - m * (c @ c * np.eye(3) - np.outer(c, c)))


def _regressor(mechanism: Mechanism, weights: Sequence[Inertial]) -> tuple[ca.Function, list[str]]:
    """Return Y of the bodies with a mass, and the names of the leading joints."""
    bodies, variables = [mechanism.bodies[0]], list[Variable]()
    for body, weight in zip(mechanism.bodies[1:], weights, strict=True):
        if not weight.mass > 0:
            bodies.append(body)
            continue
        starts = [weight.mass, *weight.com, *weight.J[ROWS, COLUMNS]]
        own = [
            Variable(f"{term}_{body.name}", "1", start=float(start))
            for term, start in zip(TERMS, starts, strict=True)
        ]
        m, *others = (v.symbol for v in own)
        variables += own
        bodies.append(replace(body, mass=m, com=others[:3], inertia=others[3:], ideal=True))
    mechanism.bodies = bodies
    made = mechanism.prepare(tuple(variables))
    eq = made.eq
    T, offset, leads = couplings(eq)
    motion = [ca.SX.sym(name, len(leads)) for name in ("q", "qd", "qdd")]
    y, yd, ydd = motion
    u = symbols_of(mechanism.inputs)
    none, inputs = ca.SX.zeros(eq.m), ca.SX(starts_of(mechanism.inputs))
    values = [T @ y + offset, T @ yd, T @ ydd, none, inputs]
    balance = ca.substitute([eq.balance], [eq.q, eq.qd, eq.a, eq.lam, u], values)[0]
    slopes = ca.jacobian(ca.SX(T.T) @ balance, symbols_of(variables))
    simple = ca.DM([1.0, *[0.0] * 9] * (len(variables) // 10))
    columns = ca.densify(ca.substitute(slopes, symbols_of(variables), simple))
    return ca.Function("Y", motion, [columns], {"cse": True}), [made.q[k].name for k in leads]


ENTRIES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


def updated_urdf(
    content: str, model: RobotModel, pi: Array, friction: Mapping[str, tuple[float, float]]
) -> str:
    """Return the URDF with new inertias and friction; other tags and comments are unchanged.

    The inertia of a body that consists of several links is written to the link that names it; the
    links behind fixed joints become massless. `<dynamics>` is replaced, not added to.

    Args:
        content: the URDF.
        model: its robot.
        pi: inertial parameters, shape (10 k,).
        friction: joint -> Coulomb friction [N m, N] and damping [N m s/rad, N s/m].
    """
    robot = tags(content.strip().encode(), "utf-8", comments=True)
    places, numbers = carried(model.urdf), dict(zip(model.bodies, pi.reshape(-1, 10), strict=True))
    for link in robot.findall("link"):
        name = link.get("name", "")
        old = link.find("inertial")
        if places[name].body not in numbers:
            continue
        if old is not None:
            link.remove(old)
        if name in numbers:
            link.insert(0, _inertial(numbers[name]))
    for joint in robot.findall("joint"):
        found = friction.get(joint.get("name", ""))
        if joint.find("mimic") is not None:  # its friction is part of that of the other joint
            found = (0.0, 0.0) if joint.find("dynamics") is not None else None
        if found is not None:
            dynamics = joint.find("dynamics")
            if dynamics is None:
                dynamics = ET.SubElement(joint, "dynamics")
            dynamics.set("friction", repr(found[0]))
            dynamics.set("damping", repr(found[1]))
    ET.indent(robot)
    return ET.tostring(robot, encoding="unicode")


def _inertial(numbers: Array) -> ET.Element:
    """Return the tag of a body, with axes parallel to those of its link."""
    weight = inertial_of(numbers)
    tag = ET.Element("inertial")
    place = " ".join(repr(x) for x in weight.com.tolist())
    ET.SubElement(tag, "origin", xyz=place, rpy="0 0 0")
    ET.SubElement(tag, "mass", value=repr(weight.mass))
    values = weight.J[ROWS, COLUMNS].tolist()
    ET.SubElement(tag, "inertia", dict(zip(ENTRIES, map(repr, values), strict=True)))
    return tag
