"""Bounds of the unknowns of a program."""

from collections.abc import Mapping, Sequence

import numpy as np

from ocp.formulation.bounds import Box, Free
from ocp.formulation.phase import Span
from ocp.formulation.problem import Problem
from ocp.transcription.blocks import Array
from ocp.transcription.local import time_scale
from ocp.transcription.points import Layout, SpanLayout
from ocp.transcription.schemes import Coefficients


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
