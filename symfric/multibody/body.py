"""A rigid body: mass, inertia about the centre of mass, named places."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.checks import shown
from symfric.foundation.numeric import Scalar
from symfric.multibody.spatial import Frame, Vector, is_scalar, is_vector, vector

Array = NDArray[np.float64]
GROUND = "ground"
"""The name of the body that does not move."""
MOMENTS = "write (Jxx, Jyy, Jzz) or (Jxx, Jyy, Jzz, Jxy, Jxz, Jyz)"
TRIANGLE = 1e-9
"""Relative rounding of principal moments that is no mistake."""


@final
@dataclass(frozen=True, eq=False)
class Body:
    """A rigid body.

    Attributes:
        name: C identifier.
        mass: [kg].
        inertia: about the centre of mass, in the body's axes [kg m^2]: three principal moments, or
            six numbers Jxx, Jyy, Jzz, Jxy, Jxz, Jyz.
        com: centre of mass from the origin of the body [m].
        frames: places where joints and forces act; "" is the origin.
        ideal: whether mass and inertia are taken as they are: a massless link between two joints,
            a point mass, numbers that no rigid body has. The mass matrix of the mechanism must
            be positive definite at the start all the same.
    """

    name: str
    mass: Scalar
    inertia: Sequence[Any]
    com: Vector = (0.0, 0.0, 0.0)
    frames: dict[str, Frame] = field(default_factory=lambda: {"": Frame()})
    ideal: bool = False

    @property
    def J(self) -> ca.SX:
        """Inertia about the centre of mass, shape (3, 3)."""
        J = ca.diag(ca.SX(ca.vertcat(*self.inertia[:3])))
        if len(self.inertia) == 6:
            for (i, j), value in zip(((0, 1), (0, 2), (1, 2)), self.inertia[3:], strict=True):
                J[i, j] = J[j, i] = value
        return ca.sparsify(J)

    @property
    def c(self) -> ca.SX:
        """Centre of mass from the origin of the body [m], shape (3, 1)."""
        return vector(self.com)

    def problems(self, p: ca.SX, values: ca.DM) -> Iterator[str]:
        """What is wrong with the numbers, symbols `p` replaced by `values`."""
        wrong = list(self._no_numbers())
        if wrong:
            yield from wrong
            return
        both = ca.substitute(ca.vertcat(self.mass, ca.vec(ca.densify(self.J))), p, ca.SX(values))
        numbers = ca.DM(both).full().ravel()
        if not np.isfinite(numbers).all():
            given = ", ".join(_short(dict.fromkeys(numbers)))
            yield f"mass, inertia: expected finite numbers, got {given}"
            return
        if self.ideal:
            return
        hint = "; `ideal=True` takes a massless link or a point mass as it is"
        if not numbers[0] > 0:
            yield f"mass: expected > 0 kg, got {numbers[0]:g}{hint}"
        yield from (f"{text}{hint}" for text in unphysical(numbers[1:].reshape(3, 3)))

    def _no_numbers(self) -> Iterator[str]:
        """What is no number or not as many as it should."""
        given: Any = self.inertia
        if not is_scalar(self.mass):
            yield f"mass: expected a number [kg], got {shown(self.mass)}"
        count = len(given) if hasattr(given, "__len__") else 0
        if count not in (3, 6):
            got = count or shown(given)
            yield f"inertia: expected 3 or 6 numbers [kg m^2], got {got}; {MOMENTS}"
        elif not all(map(is_scalar, given)):
            yield f"inertia: expected 3 or 6 numbers [kg m^2], got {shown(given)}; {MOMENTS}"
        if not is_vector(self.com):
            yield f"com: expected three numbers [m], got {shown(self.com)}"


def unphysical(J: Array, point: bool = False) -> Iterator[str]:
    """Why no rigid body has the inertia J [kg m^2] about its centre of mass.

    Args:
        J: shape (3, 3).
        point: whether principal moments of zero are fine: a point, a thin rod.
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
