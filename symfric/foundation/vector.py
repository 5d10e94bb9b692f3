"""Vectors as arguments of scalar laws, for slip in a plane or in space.

If the motion is mirrored, some quantities of a law change sign (v, deflections, forces), and others
do not (N, ages, levels). In a plane or in space the former are vectors, the latter are numbers:

    number * vector = vector         vector + vector = vector
    vector * vector = number, a.b    vector + number: error, the law has no isotropic form
    odd f(a) = f(|a|) a/|a|          even f(a) = f(|a|)

For collinear vectors these rules are the arithmetic of components, and they do not depend on the
axes. A law evaluated with vectors is therefore isotropic and equals the scalar law for straight
slip in any direction. Only products of three vectors depend on their order.
"""

from collections.abc import Callable
from typing import Any, final

Scalar = Any
Vectors = Any
"""`Vector` or number."""

ODD = frozenset({"sin", "tan", "tanh", "atan", "asin", "asinh", "erf"})
EVEN = frozenset({"cos"})
ROUND = 1e-6
"""Smoothing width of the length of a unitless vector; the error of odd functions is its square."""
TINY = 1e-30
"""Smoothing width of a length that keeps its kink; it makes derivatives at zero finite."""


class NotIsotropicError(TypeError):
    """Error for an expression that treats a vector as a number."""


@final
class Vector:
    """Vector of numbers of any type.

    Attributes:
        parts: components.
        turn: width of the transition of `along` from unloading to loading; results inherit it.
    """

    __slots__ = ("parts", "turn")
    __array_ufunc__ = None  # arrays defer to the operators of this class
    __hash__ = None  # pyright: ignore[reportAssignmentType]

    def __init__(self, parts: list[Scalar], turn: Scalar) -> None:
        self.parts, self.turn = parts, turn

    def dot(self, other: "Vector") -> Scalar:
        """Return the scalar product."""
        return sum(a * b for a, b in zip(self.parts, other.parts, strict=True))

    def length(self, width: Scalar) -> Scalar:
        """Return the smoothed length sqrt(a.a + width^2)."""
        return (self.dot(self) + width * width) ** 0.5

    def odd(self, f: Callable[[Scalar], Scalar], width: Scalar) -> "Vector":
        """Return f(|a|) a/|a| for an odd function f, with the length smoothed over `width`."""
        size = self.length(width)
        return f(size) / size * self

    def apply(self, f: Callable[[Scalar], Scalar], name: str) -> Vectors:
        """Return the elementary function f of the vector.

        Raises:
            NotIsotropicError: the function is neither odd nor even.
        """
        if name in ODD:
            return self.odd(f, ROUND)
        if name in EVEN:
            return f(self.length(ROUND))
        raise NotIsotropicError(f"takes {name} of a vector")

    def __mul__(self, other: Vectors) -> Vectors:
        if isinstance(other, Vector):
            return self.dot(other)
        return Vector([a * other for a in self.parts], self.turn)

    __rmul__ = __mul__

    def __truediv__(self, other: Vectors) -> "Vector":
        if isinstance(other, Vector):
            raise NotIsotropicError("divides by a vector")
        return Vector([a / other for a in self.parts], self.turn)

    def __rtruediv__(self, other: Scalar) -> "Vector":
        raise NotIsotropicError("divides by a vector")

    def __pow__(self, n: Scalar) -> Vectors:
        if not isinstance(n, int | float) or n < 1 or n % 1:
            raise NotIsotropicError("raises a vector to a power that is not an integer")
        even = self.dot(self) ** (n // 2)
        return even * self if n % 2 else even

    def __add__(self, other: Vectors) -> "Vector":
        if not isinstance(other, Vector):
            raise NotIsotropicError("adds a number to a vector")
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
        raise NotIsotropicError("compares a vector")

    __gt__ = __le__ = __ge__ = __eq__ = __ne__ = __lt__  # pyright: ignore


@final
class VectorRows(tuple[Vectors, ...]):
    """Column in which some rows are vectors."""

    __slots__ = ()

    @property
    def shape(self) -> tuple[int]:
        """Shape of the column, (number of rows,)."""
        return (len(self),)


def no_vector(what: str, *values: Vectors) -> None:
    """Raise an error if one of `values` is a vector; `what` describes the operation."""
    if any(isinstance(value, Vector) for value in values):
        raise NotIsotropicError(f"{what} a vector")
