"""Meshes, fractions of the duration of a span, and bounds of the unknowns on them."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ocp.formulation.bounds import Box, Free
from ocp.formulation.phase import Span
from ocp.formulation.problem import Problem
from ocp.transcription.blocks import Array
from ocp.transcription.schemes import Coefficients
from ocp.transcription.unknowns import Layout, SpanLayout, time_scale
from symfric.foundation import checks

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


def scale_of(problem: Problem, layout: Layout) -> Array:
    """SI values of the unknowns divided by w, shape (n,)."""
    scale = np.ones(layout.size)
    for span, own in zip(problem.spans, layout.spans, strict=True):
        model = span.model
        for letter, columns in (("x", own.nodes), ("x", own.inner), ("z", own.z), ("u", own.u)):
            scale[columns] = model.nominal(letter)[:, None]
        if own.T >= 0:
            scale[own.T] = time_scale(span)
    scale[layout.chosen] = [choice.nominal for choice in problem.chosen]
    return scale


def bounds_of(
    problem: Problem,
    layout: Layout,
    scheme: Coefficients,
    nodes: Sequence[Mapping[float, int]],
    released: Sequence[Mapping[float, Mapping[int, Box]]],
) -> tuple[Array, Array]:
    """Lower and upper bounds of w, scaled.

    Args:
        nodes: of each span, number of the node at each fraction with conditions.
        released: of each span, states at these fractions that follow from others, and ranges of
            them.

    Where the last collocation point is the end of its interval, the copy at the node alone is
    bounded: bounds on both would depend on each other.
    """
    lower, upper = np.full(layout.size, -np.inf), np.full(layout.size, np.inf)
    every = zip(problem.spans, layout.spans, nodes, released, strict=True)
    for span, own, at, loose in every:
        _bound(span, own, scheme, (at, loose), (lower, upper))
    for column, choice in zip(layout.chosen, problem.chosen, strict=True):
        lower[column], upper[column] = choice.lower, choice.upper
    scale = scale_of(problem, layout)
    return lower / scale, upper / scale


def _bound(
    span: Span,
    own: SpanLayout,
    scheme: Coefficients,
    conditions: tuple[Mapping[float, int], Mapping[float, Mapping[int, Box]]],
    sides: tuple[Array, Array],
) -> None:
    model, d = span.model, scheme.degree
    states = [v.name for v in model.x]
    open_end = scheme.meets_end and d > 0
    inner = own.inner.reshape(len(states), own.intervals, d)[:, :, : d - 1 if open_end else d]
    for side, bound in enumerate(sides):

        def of(names: Sequence[str], boxes: Mapping[str, Box], side: int = side) -> Array:
            return np.array([boxes[name][side] for name in names], dtype=float)

        x = of(states, span.boxes)
        bound[own.nodes] = x[:, None]
        bound[inner] = x[:, None, None]
        bound[own.z] = of([v.name for v in model.z], span.boxes)[:, None]
        inputs = [v.name for v in model.u]
        u = np.tile(of(inputs, span.boxes)[:, None], (1, own.intervals))
        meet = (np.maximum, np.minimum)[side]
        for fraction, column in ((0.0, 0), (1.0, -1)):
            u[:, column] = meet(u[:, column], of(inputs, span.inputs_at[fraction]))
        bound[own.u] = meet(u, bound[own.u])  # shared inputs may be bounded in each scenario
        for fraction, node in conditions[0].items():
            bound[own.nodes[:, node]] = of(states, span.nodes[fraction])
            for i, box in conditions[1].get(fraction, {}).items():
                bound[own.nodes[i, node]] = box[side]
        if isinstance(span.T, Free):
            bound[own.T] = (span.T.lower, span.T.upper)[side]
