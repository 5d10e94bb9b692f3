"""Meshes: fractions of the duration of a span that bound its intervals."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ocp.formulation.phase import Span
from ocp.formulation.problem import Problem
from symfric.foundation import checks

Array = NDArray[np.float64]
SAME_NODE = 1e-9
MOST_INTERVALS = 10**6
"""Beyond these a program has no room in any memory."""

WHAT = "their number or increasing fractions of T from 0 to 1"


def make_mesh(span: Span, intervals: int | ArrayLike) -> Array:
    """Fractions of T that bound the intervals of a span.

    Args:
        span: its `via` fractions become nodes, where they are not already.
        intervals: number of equal intervals, or the fractions 0 = s_0 < s_1 < ... < s_N = 1.

    Raises:
        ValueError: neither.
    """
    if checks.as_number(intervals) is not None:
        count = checks.count("intervals", intervals, most=MOST_INTERVALS)
        mesh = np.linspace(0.0, 1.0, count + 1)
    else:
        mesh = checks.array("intervals", intervals, what=WHAT)
        if mesh.size < 2 or mesh[0] != 0.0 or mesh[-1] != 1.0 or not (np.diff(mesh) > 0).all():
            raise ValueError(f"intervals: expected {WHAT}, got {intervals!r}")
    missing = [s for s in span.nodes if np.abs(mesh - s).min() > SAME_NODE]
    return np.sort(np.concatenate([mesh, missing]))


def make_meshes(problem: Problem, intervals: int | ArrayLike | Sequence[ArrayLike]) -> list[Array]:
    """A mesh for each span.

    Args:
        problem: what is to be put on them.
        intervals: the number for each span, fractions for each span, or a list with one of
            these for each phase.

    Raises:
        ValueError: none of these.
    """
    phases = len(problem.chain)
    single = checks.as_number(intervals) is not None or np.ndim(_first(intervals)) == 0
    if single and not (isinstance(intervals, list | tuple) and _counts(intervals, phases)):
        given: list[ArrayLike] = [intervals] * phases  # pyright: ignore[reportAssignmentType]
    else:
        given = list(checks.many("intervals", intervals, "meshes, one a phase"))
    if len(given) != phases:
        raise ValueError(
            f"intervals: expected one mesh for each of {phases} phases, got {len(given)}"
        )
    return [make_mesh(span, given[span.phase]) for span in problem.spans]


def _first(intervals: object) -> Any:
    return next(iter(intervals), 0.0) if isinstance(intervals, Iterable) else 0.0


def _counts(intervals: Sequence[object], phases: int) -> bool:
    """Whether these are numbers of intervals, one a phase, and no fractions."""
    return len(intervals) == phases and all(
        (number := checks.as_number(value)) is not None and number >= 1 for value in intervals
    )


def nodes_of(span: Span, mesh: Array) -> dict[float, int]:
    """Number of the node at each fraction that the span has conditions at.

    Raises:
        ValueError: there is none.
    """
    found: dict[float, int] = {}
    for fraction in span.nodes:
        node = int(np.argmin(np.abs(mesh - fraction)))
        if abs(mesh[node] - fraction) > SAME_NODE:
            raise ValueError(
                f"mesh of {span.name}: expected a node at {fraction:g}, where the span has "
                f"conditions, got one at {mesh[node]:g}; use make_mesh"
            )
        found[fraction] = node
    return found


def check_meshes(problem: Problem, meshes: Sequence[Array]) -> tuple[Array, ...]:
    """A mesh for each span; with one a phase, it serves all scenarios.

    Raises:
        ValueError: another number of them, no increasing fractions from 0 to 1, or different ones
            for spans that share inputs.
    """
    spans, phases = problem.spans, len(problem.chain)
    given = [np.asarray(mesh, dtype=float).ravel() for mesh in meshes]
    if len(given) == phases:
        given = given * (len(spans) // phases)
    if len(given) != len(spans):
        raise ValueError(
            f"meshes: expected one for each of {len(spans)} spans or {phases} phases, got "
            f"{len(given)}"
        )
    for span, mesh in zip(spans, given, strict=True):
        if mesh.size < 2 or mesh[0] != 0.0 or mesh[-1] != 1.0 or not (np.diff(mesh) > 0).all():
            raise ValueError(
                f"mesh of {span.name}: expected increasing fractions of T from 0 to 1, got "
                f"{mesh.size} numbers from {mesh[0]:g} to {mesh[-1]:g}"
                if mesh.size
                else f"mesh of {span.name}: expected fractions of T from 0 to 1, got none"
            )
        if problem.shared_inputs and not np.array_equal(mesh, given[span.phase]):
            raise ValueError(
                f"mesh of {span.name}: expected the same in all scenarios, which share inputs"
            )
    return tuple(given)


def split(mesh: Array, parts: Sequence[int]) -> Array:
    """Cut interval k into `parts[k]` equal ones.

    Raises:
        ValueError: not a number >= 1 for each interval.
    """
    counts = np.asarray(parts, dtype=int)
    if counts.shape != (mesh.size - 1,) or (counts < 1).any():
        raise ValueError(
            f"split: expected {mesh.size - 1} numbers of parts >= 1, got {counts.tolist()}"
        )
    pieces = [
        np.linspace(low, high, n, endpoint=False)
        for low, high, n in zip(mesh[:-1], mesh[1:], counts, strict=True)
    ]
    return np.concatenate([*pieces, mesh[-1:]])


def join(mesh: Array, away: Sequence[int], keep: Iterable[float] = ()) -> Array:
    """Take inner nodes away by their numbers, except those at fractions to `keep`."""
    kept = np.ones(mesh.size, dtype=bool)
    kept[list(away)] = False
    kept[[0, -1]] = True
    for fraction in keep:
        kept[np.abs(mesh - fraction) <= SAME_NODE] = True
    return mesh[kept]
