"""Vectors in the expressions of a scalar law: quantities that change sign have a direction.

A quantity of a law either changes sign when the motion is mirrored (v, deflections, forces) or does
not (N, ages, levels). In a plane or in space the first are vectors, the second numbers:

    number * vector = vector         vector + vector = vector
    vector * vector = number, a.b    vector + number: error, the law has no isotropic form
    odd f(a) = f(|a|) a/|a|          even f(a) = f(|a|)

On collinear vectors this is the arithmetic of their components, and it does not depend on axes: a
law evaluated with vectors is the scalar law in straight slip of any direction, and rotates with its
arguments. Only products of three vectors depend on their order.
"""

from collections.abc import Callable
from typing import Any, final

Scalar = Any
Vectors = Any
"""`Vector`, or a number."""

ODD = frozenset({"sin", "tan", "tanh", "atan", "asin", "asinh", "erf"})
EVEN = frozenset({"cos"})
ROUND = 1e-6
"""Smoothing of the length of a unitless vector; odd functions err by its square."""
TINY = 1e-30
"""Smoothing of a length whose kink is intended: keeps derivatives at zero finite."""


class NotIsotropicError(TypeError):
    """Expression that treats a vector as a number."""


@final
class Vector:
    """Vector as the list of its components, each a number of any type.

    Attributes:
        parts: components.
        turn: width over which `along` goes from unloading to loading, passed on to all results.
    """

    __slots__ = ("parts", "turn")
    __array_ufunc__ = None  # arrays leave arithmetic with vectors to this class
    __hash__ = None  # pyright: ignore[reportAssignmentType]

    def __init__(self, parts: list[Scalar], turn: Scalar) -> None:
        self.parts, self.turn = parts, turn

    def dot(self, other: "Vector") -> Scalar:
        """Return the scalar product."""
        return sum(a * b for a, b in zip(self.parts, other.parts, strict=True))

    def length(self, width: Scalar) -> Scalar:
        """Return the smooth length, sqrt(a.a + width^2)."""
        return (self.dot(self) + width * width) ** 0.5

    def odd(self, f: Callable[[Scalar], Scalar], width: Scalar) -> "Vector":
        """Return f(|a|) a/|a| of an odd function, with the length smoothed over `width`."""
        size = self.length(width)
        return f(size) / size * self

    def apply(self, f: Callable[[Scalar], Scalar], name: str) -> Vectors:
        """Apply the elementary function f; raises NotIsotropicError for one without parity."""
        if name in ODD:
            return self.odd(f, ROUND)
        if name in EVEN:
            return f(self.length(ROUND))
        raise NotIsotropicError(f"takes {name} of what has a direction")

    def __mul__(self, other: Vectors) -> Vectors:
        if isinstance(other, Vector):
            return self.dot(other)
        return Vector([a * other for a in self.parts], self.turn)

    __rmul__ = __mul__

    def __truediv__(self, other: Vectors) -> "Vector":
        if isinstance(other, Vector):
            raise NotIsotropicError("divides by what has a direction")
        return Vector([a / other for a in self.parts], self.turn)

    def __rtruediv__(self, other: Scalar) -> "Vector":
        raise NotIsotropicError("divides by what has a direction")

    def __pow__(self, n: Scalar) -> Vectors:
        if not isinstance(n, int | float) or n < 1 or n % 1:
            raise NotIsotropicError("raises what has a direction to a power that is no integer")
        even = self.dot(self) ** (n // 2)
        return even * self if n % 2 else even

    def __add__(self, other: Vectors) -> "Vector":
        if not isinstance(other, Vector):
            raise NotIsotropicError("adds a number to what has a direction")
        pairs = zip(self.parts, other.parts, strict=True)
        return Vector([a + b for a, b in pairs], self.turn)

    __radd__ = __add__

    def __neg__(self) -> "Vector":
        return Vector([-a for a in self.parts], self.turn)

    def __sub__(self, other: Vectors) -> "Vector":
        return self + -other

    def __rsub__(self, other: Vectors) -> "Vector":
        return -self + other

    def __lt__(self, other: Vectors) -> bool:
        raise NotIsotropicError("compares what has a direction")

    __gt__ = __le__ = __ge__ = __eq__ = __ne__ = __lt__  # pyright: ignore


@final
class Rows(tuple[Vectors, ...]):
    """Column with vectors in some rows."""

    __slots__ = ()

    @property
    def shape(self) -> tuple[int]:
        """Number of rows."""
        return (len(self),)


def no_vector(what: str, *values: Vectors) -> None:
    """Raise an error for vectors where a function needs numbers."""
    if any(isinstance(value, Vector) for value in values):
        raise NotIsotropicError(f"{what} what has a direction")
