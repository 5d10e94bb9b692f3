"""Discretisation schemes (Radau and Gauss-Legendre collocation, shooting) and their meshes."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import ClassVar, NamedTuple, final

import casadi as ca
import numpy as np
from numpy.polynomial import legendre
from numpy.typing import ArrayLike

from ocp.formulation.phase import Span
from ocp.formulation.problem import Problem
from ocp.transcription.blocks import Array
from symfric.foundation import checks

MAX_DEGREE = 9


class Coefficients(NamedTuple):
    """Coefficients of collocation on one interval [0, 1].

    A state is the polynomial through its values at s_0 = 0 < s_1 < ... < s_d <= 1,

        x(s) = sum_r l_r(s) x_r,    x'(s_j) = sum_r slopes[r, j-1] x_r = h f(x_j),  j = 1 ... d,

    an integral is sum_j weights[j-1] L(x_j), and the interval ends with x(1) = sum_r ends[r] x_r.

    Attributes:
        nodes: s_0 ... s_d, shape (d + 1,).
        slopes: l_r'(s_j), shape (d + 1, d).
        weights: quadrature weights, shape (d,).
        ends: l_r(1), shape (d + 1,).
        inner_ends: values at 1 of the polynomials through s_1 ... s_d, which define the algebraic
            variables, shape (d,).
    """

    nodes: Array
    slopes: Array
    weights: Array
    ends: Array
    inner_ends: Array

    @property
    def degree(self) -> int:
        """Number of collocation points d."""
        return self.weights.size

    @property
    def meets_end(self) -> bool:
        """True if the last collocation point is the end of the interval."""
        return bool(self.nodes[-1] == 1.0)


@dataclass(frozen=True)
class _Collocation:
    """Collocation with `degree` points of CasADi's `kind`, of order 2 degree + gain."""

    degree: int = 3
    kind: ClassVar[str]
    gain: ClassVar[int]

    def __post_init__(self) -> None:
        where = f"{type(self).__name__}: degree"
        object.__setattr__(self, "degree", checks.count(where, self.degree, most=MAX_DEGREE))

    @property
    def order(self) -> int:
        """Order of the solution at the nodes of the mesh."""
        return 2 * self.degree + self.gain

    def coefficients(self) -> Coefficients:
        """Return the coefficients of the method on an interval."""
        return _collocation(self.kind, self.degree)


@final
@dataclass(frozen=True)
class Radau(_Collocation):
    """Radau IIA collocation with `degree` points: L-stable, order 2 d - 1 at the nodes.

    Limits: the order requires a smooth solution.
    Source: Hairer and Wanner, Solving Ordinary Differential Equations II, IV.5.

    Raises:
        ValueError: degree is not in 1 ... 9.
    """

    kind: ClassVar[str] = "radau"
    gain: ClassVar[int] = -1


@final
@dataclass(frozen=True)
class Legendre(_Collocation):
    """Gauss-Legendre collocation with `degree` points: order 2 d at the nodes, energy conservation.

    Limits: the method is A-stable but not L-stable, so stiff components oscillate between
    intervals. Algebraic variables at the end of an interval, which is no collocation point, are
    extrapolated.
    Source: Hairer and Wanner, Solving Ordinary Differential Equations II, IV.5.

    Raises:
        ValueError: degree is not in 1 ... 9.
    """

    kind: ClassVar[str] = "legendre"
    gain: ClassVar[int] = 0


@final
@dataclass(frozen=True)
class Shooting:
    """Multiple shooting: each interval is `steps` equal steps of a method of `symfric.flow`.

    The method "exponential" also resolves stiff bristles, for which collocation does not converge.

    Limits: bounds and path conditions hold only at the nodes of the mesh, and cannot include
    algebraic variables, which are internal to the steps. Second derivatives of implicit steps are
    expensive: for an arm with six joints, fifty times as expensive as those of collocation.

    Raises:
        ValueError: unknown method, or fewer than one step.
    """

    method: str = "rodas5p"
    steps: int = 2

    def __post_init__(self) -> None:
        from symfric.integrator.methods.tableaux import METHODS  # noqa: PLC0415  (of shooting only)

        checks.choice("Shooting: method", self.method, METHODS)
        object.__setattr__(self, "steps", checks.count("Shooting: steps", self.steps))

    def coefficients(self) -> Coefficients:
        """Return coefficients without inner points and without a polynomial."""
        none = np.zeros(0)
        return Coefficients(np.zeros(1), np.zeros((1, 0)), none, np.zeros(1), none)


Scheme = Radau | Legendre | Shooting


@cache
def _collocation(kind: str, degree: int) -> Coefficients:
    points = np.array(ca.collocation_points(degree, kind))
    nodes = np.concatenate([[0.0], points])
    moments = np.eye(degree)[0]  # of the shifted Legendre polynomials over [0, 1]
    weights = np.linalg.solve(legendre.legvander(2 * points - 1, degree - 1).T, moments)
    return Coefficients(nodes, _slopes(nodes)[:, 1:], weights, _at_end(nodes), _at_end(points))


def _slopes(nodes: Array) -> Array:
    """Return l_r'(s_j) at row r, column j, by the barycentric formula.

    Source: Berrut and Trefethen, SIAM Review 46(3), 2004, 501-517.
    """
    gaps = nodes[:, None] - nodes[None, :]
    np.fill_diagonal(gaps, 1.0)
    products = gaps.prod(axis=1)
    slopes = products[None, :] / products[:, None] / gaps.T
    np.fill_diagonal(slopes, 0.0)
    np.fill_diagonal(slopes, -slopes.sum(axis=0))  # the slope of a constant is zero
    return slopes


def _at_end(nodes: Array) -> Array:
    """Return l_r(1); exactly a unit vector if 1 is a node."""
    gaps = nodes[:, None] - nodes[None, :]
    np.fill_diagonal(gaps, 1.0)
    factors = np.tile(1.0 - nodes, (nodes.size, 1))
    np.fill_diagonal(factors, 1.0)
    return np.prod(factors, axis=1) / np.prod(gaps, axis=1)


SAME_NODE = 1e-9
MOST_INTERVALS = 10**6
"""Largest number of intervals; larger programs exceed the memory of a computer."""

WHAT = "their number or increasing fractions of T from 0 to 1"


def make_meshes(problem: Problem, intervals: int | ArrayLike | Sequence[ArrayLike]) -> list[Array]:
    """Return a mesh for each phase of each scenario: fractions of T that bound the intervals.

    Args:
        problem: the problem; the `via` fractions of its phases become nodes.
        intervals: the number of equal intervals of each phase, increasing fractions from 0 to 1
            for each phase, or a list with one of these for each phase.

    Raises:
        ValueError: an invalid value.
    """
    phases = len(problem.chain)
    first = next(iter(intervals), 0.0) if isinstance(intervals, Iterable) else 0.0
    single = checks.as_number(intervals) is not None or np.ndim(first) == 0
    if single and not (isinstance(intervals, list | tuple) and _counts(intervals, phases)):
        given: list[ArrayLike] = [intervals] * phases  # pyright: ignore[reportAssignmentType]
    else:
        given = list(checks.many("intervals", intervals, "meshes, one for each phase"))
    if len(given) != phases:
        raise ValueError(
            f"intervals: expected one mesh for each of {phases} phases, got {len(given)}"
        )
    return [_mesh(span, given[span.phase]) for span in problem.spans]


def _mesh(span: Span, intervals: ArrayLike) -> Array:
    if checks.as_number(intervals) is not None:
        count = checks.count("intervals", intervals, most=MOST_INTERVALS)
        mesh = np.linspace(0.0, 1.0, count + 1)
    else:
        mesh = checks.array("intervals", intervals, what=WHAT)
        if not _bounds_intervals(mesh):
            raise ValueError(f"intervals: expected {WHAT}, got {intervals!r}")
    missing = [s for s in span.nodes if np.abs(mesh - s).min() > SAME_NODE]
    return np.sort(np.concatenate([mesh, missing]))


def _bounds_intervals(mesh: Array) -> bool:
    """Return True if `mesh` consists of at least two increasing fractions from 0 to 1."""
    return mesh.size > 1 and mesh[0] == 0.0 and mesh[-1] == 1.0 and bool((np.diff(mesh) > 0).all())


def _counts(intervals: Sequence[object], phases: int) -> bool:
    """Return True if `intervals` are numbers of intervals, one for each phase, not fractions."""
    return len(intervals) == phases and all(
        (number := checks.as_number(value)) is not None and number >= 1 for value in intervals
    )


def nodes_of(span: Span, mesh: Array) -> dict[float, int]:
    """Return the index of the node at each fraction of T with conditions.

    Raises:
        ValueError: the mesh has no node at such a fraction.
    """
    nodes: dict[float, int] = {}
    for fraction in span.nodes:
        node = int(np.argmin(np.abs(mesh - fraction)))
        if abs(mesh[node] - fraction) > SAME_NODE:
            raise ValueError(
                f"mesh of {span.name}: expected a node at {fraction:g}, where the phase has "
                f"conditions, got one at {mesh[node]:g}; use make_meshes"
            )
        nodes[fraction] = node
    return nodes
