"""What programs on all meshes with the same numbers of intervals share."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import casadi as ca
import numpy as np

from ocp.formulation.bounds import Box, Free
from ocp.formulation.phase import Span
from ocp.formulation.problem import Problem
from ocp.transcription.assembly import Assembled, Slot, assemble
from ocp.transcription.blocks import Array, Piece
from ocp.transcription.bounds import bounds_of, scale_of
from ocp.transcription.closed_loops import Closing
from ocp.transcription.collocation import PointEquations, ends_of, gaps, pieces_of_points
from ocp.transcription.conditions import (
    AtNode,
    AtStarts,
    Between,
    largest,
    plain_links,
    whole,
)
from ocp.transcription.local import Data
from ocp.transcription.points import Layout, Sizes, lay_out
from ocp.transcription.program import Stages
from ocp.transcription.schemes import Coefficients, Scheme
from ocp.transcription.shooting import Shot, pieces_of_intervals
from ocp.transcription.stages import stages_of


@final
@dataclass(frozen=True, eq=False)
class Equations:
    """The equations of a problem at points and nodes, with derivatives.

    Attributes:
        problem, scheme: what was discretised, and how.
        spans: of each span the equations at its collocation points, or of its intervals.
        closing: of each span the constraints of its mechanism; None where it has none.
        nodes: conditions at single nodes.
        between: conditions between spans.
        starts: conditions at the starts of all intervals.
    """

    problem: Problem
    scheme: Scheme
    spans: tuple[PointEquations | Shot, ...]
    closing: tuple[Closing | None, ...]
    nodes: tuple[AtNode, ...]
    between: tuple[Between, ...]
    starts: tuple[AtStarts, ...] = ()

    @property
    def released(self) -> list[dict[float, dict[int, Box]]]:
        """Of each span: fraction of T -> states that follow from others -> their range."""
        return [{} if part is None else part.released for part in self.closing]


@final
@dataclass(frozen=True, eq=False)
class Skeleton:
    """What programs on all meshes of the same numbers of intervals share."""

    problem: Problem
    layout: Layout
    assembled: Assembled
    w: ca.MX
    p: ca.MX
    pieces: tuple[Piece, ...]
    scale: Array
    lower: Array
    upper: Array
    lower_g: Array
    upper_g: Array
    closing: tuple[Closing | None, ...]

    @cached_property
    def structure(self) -> tuple[Stages | None, str]:
        """Stages, or why there are none."""
        equality = self.lower_g == self.upper_g
        return stages_of(self.problem, self.layout, self.pieces, self.assembled, equality)


LARGEST = "the largest cost"


def fixed_duration(span: Span) -> float:
    """T of a span [s]; 1 where it is chosen."""
    return 1.0 if isinstance(span.T, Free) else float(span.T)


def numbers_of(problem: Problem, meshes: Sequence[Array], p: Mapping[str, float]) -> Array:
    """Numbers of [p, T, mesh] of each span."""
    parts: list[Array] = []
    for span, mesh in zip(problem.spans, meshes, strict=True):
        own = [p.get(v.name, x) for v, x in zip(span.model.p, span.p, strict=True)]
        parts += [np.array(own, dtype=float), np.array([fixed_duration(span)]), mesh]
    return np.concatenate(parts)


def _data(problem: Problem, p: ca.MX, meshes: Sequence[Array]) -> list[Data]:
    """The parts of p that belong to each span."""
    found: list[Data] = []
    first, phases = 0, len(problem.chain)
    before = ca.MX(0)
    for number, (span, mesh) in enumerate(zip(problem.spans, meshes, strict=True)):
        n = len(span.model.p)
        T = p[first + n]
        before = before if number % phases else ca.MX(0)
        found.append(
            Data(p[first : first + n], T, before, p[first + n + 1 : first + n + 1 + mesh.size])
        )
        before = before if isinstance(span.T, Free) else before + T
        first += n + 1 + mesh.size
    return found


def skeleton_of(
    made: Equations, meshes: Sequence[Array], nodes: Sequence[Mapping[float, int]]
) -> Skeleton:
    """Put the equations on the numbers of intervals of `meshes`."""
    problem, scheme = made.problem, made.scheme.coefficients()
    layout = _layout(made, scheme, meshes)
    w = ca.MX.sym("w", layout.size)
    p = ca.MX.sym("p", numbers_of(problem, meshes, {}).size)
    data = _data(problem, p, meshes)
    phases = len(problem.chain)
    pieces = list(_pieces(made, layout, scheme, data, nodes))
    scenarios = len(problem.spans) // phases
    c = np.zeros(layout.size)
    slots = [Slot()]
    if problem.kind == "mean":
        slots = [Slot(1.0 / scenarios)]
    elif problem.kind == "worst":
        slots = [Slot(0.0, len(pieces) + i) for i in range(scenarios)]
        pieces = [replace(piece, slot=piece.span // phases) for piece in pieces]
        pieces += largest(layout, scenarios, len(problem.spans), LARGEST)
        c[layout.largest] = 1.0
    assembled = assemble(w, p, pieces, slots, c)
    lower_g, upper_g = np.zeros(assembled.g.numel()), np.zeros(assembled.g.numel())
    for piece, at in zip(pieces, assembled.at, strict=True):
        lower_g[at], upper_g[at] = piece.lower[:, None], piece.upper[:, None]
    return Skeleton(
        problem,
        layout,
        assembled,
        w,
        p,
        tuple(pieces),
        scale_of(problem, layout),
        *bounds_of(problem, layout, scheme, nodes, made.released),
        lower_g,
        upper_g,
        made.closing,
    )


def _layout(made: Equations, scheme: Coefficients, meshes: Sequence[Array]) -> Layout:
    problem = made.problem
    phases = len(problem.chain)
    sizes: list[Sizes] = []
    for number, (span, mesh) in enumerate(zip(problem.spans, meshes, strict=True)):
        model = span.model
        like = number % phases if number >= phases else -1
        inputs, loops = [v.name for v in model.u], made.closing[number]
        shared = [i for i, name in enumerate(inputs) if name in problem.shared_inputs]
        sizes.append(
            Sizes(
                nx=len(model.x),
                nz=len(model.z),
                nu=len(inputs),
                extra=0 if loops is None or not scheme.degree else 2 * loops.m,
                intervals=mesh.size - 1,
                free_time=isinstance(span.T, Free),
                like=like,
                shared=tuple(shared) if like >= 0 else (),
            )
        )
    return lay_out(sizes, scheme.degree, len(problem.chosen), problem.kind == "worst")


def _pieces(
    made: Equations,
    layout: Layout,
    scheme: Coefficients,
    data: Sequence[Data],
    nodes: Sequence[Mapping[float, int]],
) -> Iterator[Piece]:
    """Rows and costs of all spans."""
    spans, phases = made.problem.spans, len(made.problem.chain)
    for number, (span, equations) in enumerate(zip(spans, made.spans, strict=True)):
        gap, loops = gaps(number, span, layout, scheme), made.closing[number]
        if loops is not None:
            yield from loops.pieces(layout, data[number], nodes[number], scheme.degree > 0)
        if loops is not None and scheme.degree:
            ends = ends_of(number, layout, scheme)
            gap = replace(gap, **loops.corrections(layout, ends, scheme, data[number]))
        if isinstance(equations, Shot):
            yield from pieces_of_intervals(number, equations, layout, gap, data[number])
        else:
            yield gap
            yield pieces_of_points(number, equations, layout, scheme, data[number])
        if number % phases:
            loose = made.released[number].get(0.0, ())
            yield from plain_links(number, spans[number - 1], span, layout, loose)
    for condition in made.nodes:
        number = condition.local.number
        node = nodes[number][condition.fraction]
        yield condition.piece(layout, scheme, data[number], node)
    for condition in made.starts:
        number = condition.local.number
        if layout.spans[number].intervals > 1:
            yield condition.piece(layout, scheme, data[number])
    for condition in made.between:
        yield condition.piece(layout, scheme, data)
    yield from whole(made.problem, layout, made.released)
