"""Rotations, Euler parameters, frames and rigid bodies.

Monogram notation: `R_AB` converts components in B to components in A, `p_AB` is the vector from A
to B in components of A. Euler parameters p = (e0, e), |p| = 1, of the rotation R = E G':

    E = [-e, e~ + e0 I],  G = [-e, -e~ + e0 I],  w = 2 E p' (in A),  w' = 2 G p' (in B)

Source: Nikravesh, Computer-Aided Analysis of Mechanical Systems, 1988, chapter 6.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import isfinite
from typing import Any, final

import casadi as ca
import numpy as np

from symfric.foundation import checks
from symfric.foundation.checks import shown
from symfric.foundation.numeric import Array, Scalar, is_number, is_symbolic
from symfric.foundation.variable import Variable, at_start, stacked

Vector = Sequence[Any] | ca.SX | ca.DM
"""Three numbers or symbols."""


def vector(values: Vector) -> ca.SX:
    """Return `values` as a column (3, 1)."""
    rows: list[Any] = [values[i] for i in range(3)]
    return ca.SX(rows) if all(type(row) is float for row in rows) else stacked(rows)


def is_vector(values: Any) -> bool:
    """Return True if `values` are three finite numbers or scalar expressions."""
    entries = ca.SX(values).elements() if isinstance(values, ca.SX | ca.DM) else values
    return hasattr(entries, "__len__") and len(entries) == 3 and all(map(is_scalar, entries))


def is_scalar(value: Any) -> bool:
    """Return True if `value` is a finite number or a scalar expression."""
    if isinstance(value, ca.SX | ca.DM):
        return value.numel() == 1 and (is_symbolic(value) or isfinite(float(value)))
    return is_number(value) and isfinite(value)


def skew(a: ca.SX) -> ca.SX:
    """Return the matrix a~ with a~ b = a x b."""
    return ca.vertcat(
        ca.horzcat(0, -a[2], a[1]), ca.horzcat(a[2], 0, -a[0]), ca.horzcat(-a[1], a[0], 0)
    )


def rotation_x(angle: ca.SX) -> ca.SX:
    """Return R of a rotation by `angle` about x."""
    c, s = ca.cos(angle), ca.sin(angle)
    return ca.vertcat(ca.horzcat(1, 0, 0), ca.horzcat(0, c, -s), ca.horzcat(0, s, c))


def rotation_y(angle: ca.SX) -> ca.SX:
    """Return R of a rotation by `angle` about y."""
    c, s = ca.cos(angle), ca.sin(angle)
    return ca.vertcat(ca.horzcat(c, 0, s), ca.horzcat(0, 1, 0), ca.horzcat(-s, 0, c))


def rotation_z(angle: ca.SX) -> ca.SX:
    """Return R of a rotation by `angle` about z."""
    c, s = ca.cos(angle), ca.sin(angle)
    return ca.vertcat(ca.horzcat(c, -s, 0), ca.horzcat(s, c, 0), ca.horzcat(0, 0, 1))


def euler_e(p: ca.SX) -> ca.SX:
    """Return E(p), shape (3, 4)."""
    return ca.horzcat(-p[1:4], skew(p[1:4]) + p[0] * ca.SX.eye(3))


def euler_g(p: ca.SX) -> ca.SX:
    """Return G(p), shape (3, 4)."""
    return ca.horzcat(-p[1:4], -skew(p[1:4]) + p[0] * ca.SX.eye(3))


def rotation(p: ca.SX) -> ca.SX:
    """Return R(p) = E G' = (e0^2 - e'e) I + 2 e e' + 2 e0 e~."""
    e0, e = p[0], p[1:4]
    return (e0 * e0 - ca.dot(e, e)) * ca.SX.eye(3) + 2 * (e @ e.T) + 2 * e0 * skew(e)


def euler_parameters(R: ca.DM) -> ca.DM:
    """Return Euler parameters (e0, e) with e0 >= 0 of a numerical rotation matrix."""
    trace = float(R[0, 0] + R[1, 1] + R[2, 2])
    squares = [1 + trace] + [1 - trace + 2 * float(R[i, i]) for i in range(3)]
    k = squares.index(max(squares))
    e0 = (squares[0] / 4) ** 0.5
    off = [float(R[2, 1] - R[1, 2]), float(R[0, 2] - R[2, 0]), float(R[1, 0] - R[0, 1])]
    if k == 0:
        return ca.DM([e0, *(x / (4 * e0) for x in off)])
    i = k - 1
    largest = (squares[k] / 4) ** 0.5
    e = [float(R[i, j] + R[j, i]) / (4 * largest) for j in range(3)]
    e[i] = largest
    p = ca.DM([off[i] / (4 * largest), *e])
    return -p if float(p[0]) < 0 else p


@final
@dataclass(frozen=True, eq=False)
class Frame:
    """Frame fixed to a body.

    Attributes:
        at: position of the origin relative to that of the body [m], in the body's components.
        z, x: directions of the axes. z is the axis of a joint, x is made orthogonal to z, and y is
            z x x. If x is None, an arbitrary direction orthogonal to z is used.
        outline: lines [m] in the axes of the frame that figures and films draw instead of lines
            between the frames, shape (n, 3); NaN separates lines, see `symfric.multibody.outlines`.
    """

    at: Vector = (0.0, 0.0, 0.0)
    z: Sequence[float] = (0.0, 0.0, 1.0)
    x: Sequence[float] | None = None
    outline: Array | None = None
    R: ca.SX = field(init=False)
    p: ca.SX = field(init=False)

    def __post_init__(self) -> None:
        if self.outline is not None and np.shape(self.outline)[1:] != (3,):
            raise checks.refused("frame: outline", "points of shape (n, 3)", self.outline)
        if not is_vector(self.at):
            raise ValueError(f"frame: at: expected three numbers [m], got {self.at}")
        z = _unit("z", self.z)
        if self.x is None:
            smallest = min(range(3), key=lambda i: abs(float(z[i])))
            # the default frame has the axes of the body
            x = ca.DM([float(i == (smallest if abs(float(z[2])) < 1 else 0)) for i in range(3)])
        else:
            x = _unit("x", self.x)
        x -= ca.dot(x, z) * z
        if not float(ca.norm_2(x)) > 1e-12:
            raise ValueError(f"frame: x: expected a direction not parallel to z, got {self.x}")
        x = x / ca.norm_2(x)
        object.__setattr__(self, "R", ca.SX(ca.sparsify(ca.horzcat(x, ca.cross(z, x), z))))
        object.__setattr__(self, "p", vector(self.at))


def _unit(name: str, a: Any) -> ca.DM:
    """Return the unit vector in the direction of three numbers."""
    numbers = is_vector(a) and not is_symbolic(vector(a))
    length = float(ca.norm_2(ca.DM(vector(a)))) if numbers else 0.0
    if not 0.0 < length < ca.inf:
        raise ValueError(f"frame: {name}: expected three numbers that are not all zero, got {a}")
    return ca.DM(vector(a)) / length


GROUND = "ground"
"""Name of the fixed body."""
TRIANGLE = 1e-9
"""Relative rounding error that is accepted in principal moments."""


@final
@dataclass(frozen=True, eq=False)
class Body:
    """Rigid body.

    Attributes:
        name: C identifier.
        mass: mass [kg].
        inertia: inertia about the centre of mass in the body's axes [kg m^2]: three principal
            moments, or six numbers Jxx, Jyy, Jzz, Jxy, Jxz, Jyz.
        com: position of the centre of mass relative to the origin of the body [m].
        frames: frames where joints and forces act, by name; "" is the origin.
        ideal: True to accept mass and inertia unchecked, for a massless link between two joints, a
            point mass, or unphysical numbers. The mass matrix of the mechanism must still be
            positive definite at the start.
    """

    name: str
    mass: Scalar
    inertia: Sequence[Any]
    com: Vector = (0.0, 0.0, 0.0)
    frames: dict[str, Frame] = field(default_factory=lambda: {"": Frame()})
    ideal: bool = False

    @cached_property
    def J(self) -> ca.SX:
        """Inertia about the centre of mass [kg m^2], shape (3, 3)."""
        J = ca.diag(ca.SX(ca.vertcat(*self.inertia[:3])))
        if len(self.inertia) == 6:
            for (i, j), value in zip(((0, 1), (0, 2), (1, 2)), self.inertia[3:], strict=True):
                J[i, j] = J[j, i] = value
        return ca.sparsify(J)

    @cached_property
    def c(self) -> ca.SX:
        """Position of the centre of mass relative to the origin [m], shape (3, 1)."""
        return vector(self.com)

    def problems(self, p: Sequence[Variable]) -> Iterator[str]:
        """Yield messages about invalid numbers, with the parameters `p` at their start values."""
        wrong = list(self._no_numbers())
        if wrong:
            yield from wrong
            return
        numbers = at_start(ca.vertcat(self.mass, ca.vec(ca.densify(self.J))), p).full().ravel()
        if not np.isfinite(numbers).all():
            given = ", ".join(_short(dict.fromkeys(numbers)))
            yield f"mass, inertia: expected finite numbers, got {given}"
            return
        if self.ideal:
            return
        hint = "; `ideal=True` accepts a massless link or a point mass"
        if not numbers[0] > 0:
            yield f"mass: expected > 0 kg, got {numbers[0]:g}{hint}"
        yield from (f"{text}{hint}" for text in unphysical(numbers[1:].reshape(3, 3)))

    def _no_numbers(self) -> Iterator[str]:
        """Yield messages about values that are not numbers or whose count is wrong."""
        inertia: Any = self.inertia
        if not is_scalar(self.mass):
            yield f"mass: expected a number [kg], got {shown(self.mass)}"
        count = len(inertia) if hasattr(inertia, "__len__") else 0
        if count not in (3, 6) or not all(map(is_scalar, inertia)):
            got = count if count not in (0, 3, 6) else shown(inertia)
            yield (
                f"inertia: expected 3 or 6 numbers [kg m^2], got {got}; write (Jxx, Jyy, Jzz) or "
                "(Jxx, Jyy, Jzz, Jxy, Jxz, Jyz)"
            )
        if not is_vector(self.com):
            yield f"com: expected three numbers [m], got {shown(self.com)}"


def unphysical(J: Array, point: bool = False) -> Iterator[str]:
    """Yield reasons why no rigid body has the inertia J [kg m^2] about its centre of mass.

    Args:
        J: shape (3, 3).
        point: True to allow principal moments of zero, as those of a point or a thin rod.
    """
    principal = np.linalg.eigvalsh(J)
    spread = TRIANGLE * abs(principal[2])
    if not (principal[0] > 0 or (point and principal[0] >= -spread)):
        expected = "no negative principal moment" if point else "positive principal moments"
        yield f"inertia: expected {expected}, got {', '.join(_short(principal))} kg m^2"
    elif principal[2] > principal[0] + principal[1] + spread:
        yield (
            "inertia: expected the largest principal moment to be at most the sum of the "
            f"others, got {', '.join(_short(principal))} kg m^2"
        )


def _short(numbers: Any) -> list[str]:
    return [f"{number:g}" for number in numbers]
