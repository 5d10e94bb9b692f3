"""Transcription of a problem to a nonlinear program on meshes.

    w = [x_0, (u_1, (x, z)_11 ... (x, z)_1d), x_1, ..., x_N, T] for each phase, chosen p

with a copy of the state at every node. Only one point of each phase and the conditions at single
nodes are differentiated, once, by `discretise`. `Discretisation.on` puts them on meshes, whose
fractions, like all parameters, are parameters of the program.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import final

import casadi as ca
import numpy as np

from ocp.formulation.phase import Box, Free, Row
from ocp.formulation.problem import Problem
from ocp.transcription.assembly import Slot, assemble
from ocp.transcription.blocks import Array, Piece
from ocp.transcription.closed_loops import Closing, closing
from ocp.transcription.collocation import (
    PointEquations,
    ends_of,
    gaps,
    pieces_of_points,
    point_equations,
)
from ocp.transcription.conditions import (
    AtNode,
    AtStarts,
    Between,
    at_nodes,
    at_starts,
    between,
    largest,
    plain_links,
    whole,
)
from ocp.transcription.program import Program
from ocp.transcription.schemes import (
    Coefficients,
    Scheme,
    Shooting,
    bounds_of,
    check_meshes,
    nodes_of,
    scale_of,
)
from ocp.transcription.shooting import Shot, pieces_of_intervals, shot
from ocp.transcription.transcription import LARGEST, Skeleton, Transcription, numbers_of
from ocp.transcription.unknowns import Data, Layout, Local, Sizes, lay_out


@final
@dataclass(frozen=True, eq=False)
class Equations:
    """The equations of a problem at points and nodes, with derivatives.

    Attributes:
        problem, scheme: the problem and its scheme.
        spans: for each phase the equations at its collocation points, or of its intervals.
        closing: for each phase the constraints of its mechanism; None if it has none.
        nodes: conditions at single nodes.
        between: conditions between phases.
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
        """For each phase: fraction of T -> states that follow from others -> their range."""
        return [{} if part is None else part.released for part in self.closing]


def _data(problem: Problem, p: ca.MX, meshes: Sequence[Array]) -> list[Data]:
    """Return the parts of p that belong to each phase."""
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
    """Assemble the program for the numbers of intervals of `meshes`."""
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
        rows = piece.rows
        lower_g[at], upper_g[at] = (
            (bound / rows.scale)[:, None] for bound in (rows.lower, rows.upper)
        )
    program = Program(
        w,
        p,
        assembled.f,
        assembled.g,
        assembled.gradient,
        assembled.jacobian,
        assembled.hessian,
        *bounds_of(problem, layout, scheme, nodes, made.released),
        lower_g,
        upper_g,
        values=np.zeros(0),
        rows=(),
        unknowns=(),
        scale=scale_of(problem, layout),
    )
    return Skeleton(problem, layout, program, tuple(pieces), assembled, made.closing)


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
    """Yield the rows and costs of all phases."""
    spans, phases = made.problem.spans, len(made.problem.chain)
    for number, (span, equations) in enumerate(zip(spans, made.spans, strict=True)):
        gap, loops = gaps(number, span, layout, scheme), made.closing[number]
        if loops is not None:
            yield from loops.pieces(layout, data[number], nodes[number], scheme.degree > 0)
        if loops is not None and scheme.degree:
            ends = ends_of(number, layout, scheme)
            gap = loops.corrected(gap, ends, layout, scheme, data[number])
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


KEPT = 4
"""Number of programs that a discretisation caches, for the most recent meshes."""

Key = tuple[tuple[int, ...], ...]


@final
@dataclass(frozen=True, eq=False)
class Discretisation:
    """A problem with differentiated equations, to be put on meshes.

    Attributes:
        equations: at points, at nodes and between phases.
        made: common parts of programs, by numbers of intervals.
    """

    equations: Equations
    made: dict[Key, Skeleton] = field(default_factory=dict[Key, Skeleton])

    @property
    def problem(self) -> Problem:
        """The problem that was discretised."""
        return self.equations.problem

    @property
    def scheme(self) -> Scheme:
        """The scheme of the discretisation."""
        return self.equations.scheme

    def on(self, meshes: Sequence[Array]) -> Transcription:
        """Return the program on `meshes`, one for each phase (see `make_meshes`).

        Meshes with the same numbers of intervals and the same nodes with conditions change only
        values: the symbols and Functions of their programs are the same objects.

        Raises:
            ValueError: invalid meshes.
        """
        problem = self.problem
        given = check_meshes(problem, meshes)
        nodes = [nodes_of(span, mesh) for span, mesh in zip(problem.spans, given, strict=True)]
        key = tuple((mesh.size - 1, *at.values()) for mesh, at in zip(given, nodes, strict=True))
        skeleton = self.made.pop(key, None) or skeleton_of(self.equations, given, nodes)
        self.made[key] = skeleton  # the most recent one is last
        for old in list(self.made)[:-KEPT]:
            del self.made[old]
        return Transcription(problem, self.scheme, given, skeleton)


def discretise(
    problem: Problem, scheme: Scheme, starts: Mapping[int, Sequence[Row]] | None = None
) -> Discretisation:
    """Formulate the equations of `problem` at points and nodes, and differentiate them.

    Args:
        problem: the problem.
        scheme: scheme; collocation if there are `starts`.
        starts: index of a phase -> conditions at the start of each interval but the
            first one, with the inputs that begin there.
    """
    choices = {choice.name: choice.nominal for choice in problem.chosen}
    phases = len(problem.chain)
    made: dict[tuple[object, ...], PointEquations | Shot] = {}
    spans: list[PointEquations | Shot] = []
    loops: list[Closing | None] = []
    nodes: list[AtNode] = []
    joined: list[Between] = []
    for number, span in enumerate(problem.spans):
        first = number - number % phases
        earlier = tuple((i, problem.spans[i]) for i in range(first, number))
        local = Local(number, span, earlier, choices, not isinstance(scheme, Shooting))
        # scenarios differ in numbers only, which are parameters of the equations
        key = (span.phase, id(span.model), id(span.running), id(span.path))
        if key not in made:
            shooting = isinstance(scheme, Shooting)
            made[key] = shot(local, scheme) if shooting else point_equations(local)
        spans.append(replace(made[key], local=local))
        ends = () if earlier else problem.periodic
        named = problem.chain[span.phase].start
        loops.append(closing(local, earlier[-1][1] if earlier else None, ends, named))
        nodes += at_nodes(local)
        if earlier:
            joined += between(spans[-2].local, local)
    held = tuple(at_starts(spans[k].local, rows) for k, rows in (starts or {}).items() if rows)
    equations = Equations(
        problem=problem,
        scheme=scheme,
        spans=tuple(spans),
        closing=tuple(loops),
        nodes=tuple(nodes),
        between=tuple(joined),
        starts=held,
    )
    return Discretisation(equations)
