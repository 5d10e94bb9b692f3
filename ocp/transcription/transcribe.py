"""Transcription of a problem to a nonlinear program on meshes.

    w = [x_0, (u_1, (x, z)_11 ... (x, z)_1d), x_1, ..., x_N, T] for each phase, chosen p

with a copy of the state at every node. `discretise` differentiates the equations of one point of
each phase and the conditions at single nodes once. `Discretisation.on` assembles them on meshes,
whose fractions are parameters of the program, as are the parameters of the models.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from ocp.formulation.phase import Free, Row, limits
from ocp.formulation.problem import Posed, Problem, posed
from ocp.transcription import conditions, intervals, unknowns
from ocp.transcription.assembly import Slot, assemble
from ocp.transcription.blocks import Array, Indices, Piece, numbered
from ocp.transcription.closed_loops import Closing, closing
from ocp.transcription.conditions import Maker
from ocp.transcription.intervals import PointEquations, Shot
from ocp.transcription.program import Place, Program, Stages, bounds_of, stages_of
from ocp.transcription.schemes import Scheme, Shooting, nodes_of
from ocp.transcription.unknowns import Grid, Layout, LocalUnknowns, SpanPoints, Values
from symfric.foundation import packed
from symfric.foundation.parameters import check_names

KEPT = 4
"""Number of programs that a discretisation caches, for the most recent meshes."""
LARGEST = "the largest cost"

Key = tuple[tuple[int, ...], ...]


@final
@dataclass(frozen=True, eq=False)
class Discretisation:
    """Problem with differentiated equations, independent of a mesh.

    Attributes:
        problem, scheme: the problem and its scheme.
        spans: for each phase, the equations at its collocation points or of its intervals.
        closing: for each phase, the constraints of its mechanism; None if it has none.
        conditions: conditions at single nodes, at starts of intervals, and between phases.
        starts: index of a phase -> further conditions at the starts of its intervals.
    """

    problem: Problem
    scheme: Scheme
    spans: tuple[PointEquations | Shot, ...]
    closing: tuple[Closing | None, ...]
    conditions: tuple[Maker, ...]
    starts: Mapping[int, Sequence[Row]]
    _made: dict[Key, Any] = field(default_factory=dict[Key, Any])

    def on(self, meshes: Sequence[Array]) -> "Transcription":
        """Return the transcription on `meshes`, one for each phase (see `make_meshes`).

        Programs on meshes with the same numbers of intervals and the same nodes with conditions
        differ only in values and share their symbols and Functions.

        Raises:
            ValueError: a mesh has no node at a fraction with conditions.
        """
        scenarios = len(self.problem.spans) // len(meshes)
        every = tuple(meshes) * scenarios  # meshes may be those of one scenario
        return Transcription(self.problem, self.scheme, every, self.starts, self.skeleton(every))

    def skeleton(self, meshes: Sequence[Array]) -> "Skeleton":
        """Return the common part of programs with the numbers of intervals of `meshes`."""
        problem = self.problem
        nodes = [nodes_of(span, mesh) for span, mesh in zip(problem.spans, meshes, strict=True)]
        key = tuple((mesh.size - 1, *at.values()) for mesh, at in zip(meshes, nodes, strict=True))
        skeleton: Skeleton = self._made.pop(key, None) or self._skeleton(
            [mesh.size - 1 for mesh in meshes], nodes
        )
        self._made[key] = skeleton  # the most recent one is last
        for old in list(self._made)[:-KEPT]:
            del self._made[old]
        return skeleton

    def _skeleton(
        self, intervals: Sequence[int], nodes: Sequence[Mapping[float, int]]
    ) -> "Skeleton":
        """Assemble the program for given numbers of intervals and indices of nodes."""
        problem, scheme = self.problem, self.scheme.coefficients()
        d = scheme.degree
        extra = [
            2 * part.m * (d > 0) + d * len(span.sides) if part else d * len(span.sides)
            for span, part in zip(problem.spans, self.closing, strict=True)
        ]
        layout = unknowns.lay_out(problem, scheme.degree, intervals, extra)
        released = [part.released if part else {} for part in self.closing]
        p = ca.MX.sym(
            "p", sum(len(s.model.p) for s in problem.spans) + sum(intervals) + 2 * len(nodes)
        )
        grid = Grid(layout, scheme, unknowns.data_of(problem, p, intervals), nodes, released)
        w, c = ca.MX.sym("w", layout.size), np.zeros(layout.size)
        pieces, phases = list(self._pieces(grid)), len(problem.chain)
        scenarios = len(problem.spans) // phases
        slots: list[Slot] = [(1.0 / scenarios if problem.kind == "mean" else 1.0, -1)]
        if problem.kind == "worst":
            slots = [(0.0, len(pieces) + i) for i in range(scenarios)]
            pieces = [replace(piece, slot=piece.span // phases) for piece in pieces]
            pieces += conditions.largest(layout, scenarios, len(problem.spans), LARGEST)
            c[layout.largest] = 1.0
        pieces = numbered(pieces)
        functions = assemble(w, p, pieces, slots, c)
        lower, upper = np.zeros(functions[1].numel()), np.zeros(functions[1].numel())
        for piece in pieces:
            sides = piece.rows.lower, piece.rows.upper
            lower[piece.at], upper[piece.at] = ((b / piece.rows.scale)[:, None] for b in sides)
        bounds, scale = bounds_of(problem, grid), unknowns.scale_of(problem, layout)
        program = Program(w, p, *functions, *bounds, lower, upper, np.zeros(0), scale)
        return Skeleton(problem, layout, program, pieces, self.closing)

    def _pieces(self, grid: Grid) -> Iterator[Piece]:
        """Yield the rows and costs of all phases."""
        spans = self.problem.spans
        for number, (span, equations) in enumerate(zip(spans, self.spans, strict=True)):
            gap, loops = intervals.gaps(number, span, grid), self.closing[number]
            if loops is not None:
                yield from loops.pieces(grid)
                gap = loops.corrected(gap, grid) if grid.scheme.degree else gap
            if isinstance(equations, Shot):
                yield from intervals.pieces_of_intervals(equations, gap, grid)
            else:
                yield gap
                yield intervals.piece_of_points(equations, grid)
            if span.phase:
                yield from conditions.plain_links(self.problem, number, grid)
        yield from filter(None, (condition(grid) for condition in self.conditions))
        yield from conditions.whole(self.problem, grid)


def discretise(
    problem: Problem, scheme: Scheme, starts: Mapping[int, Sequence[Row]] | None = None
) -> Discretisation:
    """Formulate the equations of `problem` at points and nodes, and differentiate them.

    Args:
        problem: the problem.
        scheme: the scheme, which must be collocation if there are `starts`.
        starts: index of a phase -> conditions at the start of each interval except the first
            one, with the inputs of this interval.
    """
    choices = {choice.name: choice.nominal for choice in problem.chosen}
    made: dict[tuple[object, ...], PointEquations | Shot] = {}
    spans: list[PointEquations | Shot] = []
    loops: list[Closing | None] = []
    nodes: list[Maker] = []
    joined: list[Maker] = []
    for number, span in enumerate(problem.spans):
        earlier = tuple((i, problem.spans[i]) for i in range(number - span.phase, number))
        local = LocalUnknowns(number, span, earlier, choices, not isinstance(scheme, Shooting))
        # scenarios differ only in values of parameters
        key = (span.phase, id(span.model), id(span.running), id(span.path))
        if key not in made:
            shooting = isinstance(scheme, Shooting)
            made[key] = (
                intervals.shot(local, scheme) if shooting else intervals.point_equations(local)
            )
        spans.append(made[key]._replace(local=local))
        periodic, named = () if earlier else problem.periodic, problem.chain[span.phase].start
        before, mechanics = earlier[-1][1] if earlier else None, span.model.holonomic
        closed = None
        if mechanics is not None and mechanics.phi.numel():
            closed = closing(local, mechanics, before, periodic, named)
        loops.append(closed)
        nodes += conditions.at_nodes(local)
        jumping = [] if isinstance(scheme, Shooting) else conditions.jumping(span)
        nodes += [conditions.at_starts(local, jumping, 0)] if jumping else []
        if earlier:
            joined += conditions.between(spans[-2].local, local)
    nodes += [
        conditions.at_starts(spans[k].local, rows, 1) for k, rows in (starts or {}).items() if rows
    ]
    more = (*nodes, *joined)
    return Discretisation(problem, scheme, tuple(spans), tuple(loops), more, starts or {})


@final
@dataclass(frozen=True, eq=False)
class Skeleton:
    """Common part of programs on meshes with the same numbers of intervals.

    Attributes:
        problem: the problem.
        layout: places of the unknowns in w.
        program: program without values of parameters and names of rows and unknowns.
        pieces: numbered rows and costs.
        closing: for each phase, the constraints of its mechanism; None if it has none.
    """

    problem: Problem
    layout: Layout
    program: Program
    pieces: tuple[Piece, ...]
    closing: tuple[Closing | None, ...]

    @cached_property
    def structure(self) -> tuple[Stages | None, str]:
        """Stages of the program, or None and the reason why it has none."""
        return stages_of(self.problem, self.layout, self.pieces, self.program.jacobian)

    @cached_property
    def violations(self) -> list[tuple[Indices, Indices, int]]:
        """(columns of w, rows, side) of the violations of each condition with a penalty."""
        found: list[tuple[Indices, Indices, int]] = []
        for number, span in enumerate(self.problem.spans):
            names = tuple(row.name for row in span.penalised)
            columns = self.layout.spans[number].slacks(len(span.sides))
            for piece in self.pieces:
                if names and piece.span == number and piece.names[-len(names) :] == names:
                    rows = piece.at[-len(names) :]
                    found += [
                        (own.T.ravel(), rows[k], side)
                        for own, (k, side) in zip(columns, span.sides, strict=True)
                    ]
        return found

    @cached_property
    def largest(self) -> list[int]:
        """Indices of the rows that bound the costs of scenarios by the largest one, if any."""
        return [int(piece.at[0, 0]) for piece in self.pieces if piece.names == (LARGEST,)]


@final
@dataclass(frozen=True, eq=False)
class Transcription(packed.Portable):
    """Nonlinear program of a problem on meshes, and its conversion to named values.

    Files and pickles contain the statement only, and the program is built when it is first used.

    Attributes:
        problem, scheme: the problem and its scheme.
        meshes: for each phase, fractions of T that bound the intervals.
        starts: index of a phase -> further conditions at the starts of its intervals.
        made: skeleton that was already built; None in files.
    """

    problem: Problem = field(metadata={"packed": Posed})
    scheme: Scheme
    meshes: tuple[Array, ...]
    starts: Mapping[int, Sequence[Row]]
    made: Skeleton | None

    def to_pack(self) -> dict[str, Any]:
        """Return the fields for a file, with the problem in its resolved form."""
        return packed.state_of(self) | {"problem": posed(self.problem), "made": None}

    @cached_property
    def skeleton(self) -> Skeleton:
        """Common part of programs with the same numbers of intervals."""
        made = self.made
        return made or discretise(self.problem, self.scheme, self.starts).skeleton(self.meshes)

    @cached_property
    def program(self) -> Program:
        """Program for a solver, with the values of its parameters."""
        return replace(
            self.skeleton.program,
            values=self.values(),
            places=lambda: (self.rows, self.unknowns),
            structure=lambda: self.skeleton.structure,
        )

    @property
    def layout(self) -> Layout:
        """Places of the unknowns in w."""
        return self.skeleton.layout

    def pack(self, points: Values) -> Array:
        """Return the vector w of `points`; shared unknowns take values of the first scenario."""
        w = np.zeros(self.layout.size)
        for span, own in zip(points.spans[::-1], self.layout.spans[::-1], strict=True):
            w[own.nodes], w[own.inner] = span.nodes, span.inner
            w[own.z], w[own.u] = span.z, span.u
            if own.T >= 0:
                w[own.T] = span.T
        for column, choice in zip(self.layout.chosen, self.problem.chosen, strict=True):
            w[column] = points.chosen.get(choice.name, choice.guess)
        w /= self.program.scale
        if self.layout.largest < 0 and not self.skeleton.violations:
            return w
        g = np.asarray(self.program.jacobian(w, self.program.values)[0]).ravel()
        for columns, rows, side in self.skeleton.violations:
            bound = (self.program.upper_g if side > 0 else self.program.lower_g)[rows]
            w[columns] = np.maximum(0.0, side * (g[rows] - bound))
        if self.layout.largest >= 0:  # the costs contain the penalties of the violations
            g = np.asarray(self.program.jacobian(w, self.program.values)[0]).ravel()
            w[self.layout.largest] = g[self.skeleton.largest].max()
        return w

    def unpack(self, w: ArrayLike) -> Values:
        """Return the points of the vector `w` in SI units."""
        values = np.asarray(w, dtype=float).ravel() * self.program.scale
        spans = tuple(
            SpanPoints(
                float(values[own.T]) if own.T >= 0 else limits(span.T)[0],
                *(values[columns] for columns in (own.nodes, own.inner, own.z, own.u)),
            )
            for span, own in zip(self.problem.spans, self.layout.spans, strict=True)
        )
        names = [choice.name for choice in self.problem.chosen]
        return Values(spans, dict(zip(names, values[self.layout.chosen].tolist(), strict=True)))

    def consistent(self, points: Values) -> Values:
        """Return `points` with coordinates and rates of mechanisms moved onto their constraints."""
        spans = [
            span if loops is None else loops.consistent(span, mesh, self.inner_fractions(number))
            for number, (span, mesh, loops) in enumerate(
                zip(points.spans, self.meshes, self.skeleton.closing, strict=True)
            )
        ]
        return replace(points, spans=tuple(spans))

    def when(self, w: Array, place: Place) -> str:
        """Return the time of a place as text, with its phase and scenario if there are several."""
        problem, span = self.problem, self.problem.spans[place.span]
        words: list[str] = []
        if np.isfinite(place.fraction):
            durations = [part.T for part in self.unpack(w).spans]
            begin = sum(durations[place.span - span.phase : place.span])
            words.append(f"at t = {begin + place.fraction * durations[place.span]:.4g} s")
        if len(problem.chain) > 1:
            words.append(f"in {span.name}")
        if problem.scenario_names:
            words.append(f"of scenario {problem.scenario_names[span.scenario]}")
        return " ".join(words)

    def inner_fractions(self, span: int) -> Array:
        """Return the collocation points of a phase as fractions of T, shape (N d,)."""
        mesh, nodes = self.meshes[span], self.scheme.coefficients().nodes[1:]
        inner = mesh[:-1, None] + np.diff(mesh)[:, None] * nodes
        if nodes.size and nodes[-1] == 1.0:
            inner[:, -1] = mesh[1:]
        return inner.ravel()

    def fractions(self, span: int) -> Array:
        """Return nodes and collocation points of a phase as increasing fractions of T."""
        return np.unique(np.concatenate([self.meshes[span], self.inner_fractions(span)]))

    def values(self, p: Mapping[str, float] | None = None) -> Array:
        """Return the values of the parameters of the program, [p, T, mesh] of each phase.

        Args:
            p: values of parameters of the models by name, which replace those of the problem in
                all phases and scenarios.

        Raises:
            ValueError: an unknown name.
        """
        spans, given = self.problem.spans, p or {}
        check_names("values", given, sorted({v.name for s in spans for v in s.model.p}))
        parts: list[ArrayLike] = []
        for span, mesh in zip(spans, self.meshes, strict=True):
            own = [given.get(v.name, x) for v, x in zip(span.model.p, span.p, strict=True)]
            parts += [np.asarray(own), [1.0 if isinstance(span.T, Free) else span.T], mesh]
        return np.concatenate([np.asarray(part, dtype=float) for part in parts])

    @cached_property
    def rows(self) -> list[Place]:
        """Names and places of all rows of the program."""
        places = [Place("", 0, 0.0)] * self.skeleton.program.g.numel()
        for piece in self.skeleton.pieces:
            mesh = self.meshes[piece.span]
            fractions = mesh[piece.interval] + np.diff(mesh)[piece.interval] * piece.offset
            for name, scale, numbers in zip(piece.names, piece.rows.scale, piece.at, strict=True):
                for k, fraction in zip(numbers.tolist(), fractions.tolist(), strict=True):
                    places[k] = Place(name, piece.span, fraction, float(scale))
        return places

    @cached_property
    def unknowns(self) -> list[Place]:
        """Names and places of all unknowns; shared unknowns belong to the first span."""
        scale = self.program.scale.tolist()
        places = [Place(LARGEST, 0, np.nan)] * self.layout.size
        for number, (span, own) in reversed(
            [*enumerate(zip(self.problem.spans, self.layout.spans, strict=True))]
        ):
            mesh, inner = self.meshes[number], self.inner_fractions(number)
            groups = own.names(span), (mesh, inner, inner, mesh[:-1], mesh[:-1])
            for names, columns, at in zip(groups[0], own[1:], groups[1], strict=True):
                for name, row in zip(names, columns.tolist(), strict=True):
                    for k, fraction in zip(row, at.tolist(), strict=True):
                        places[k] = Place(name, number, fraction, scale[k])
            if own.T >= 0:
                places[own.T] = Place("T", number, np.nan, scale[own.T])
        for k, choice in zip(self.layout.chosen.tolist(), self.problem.chosen, strict=True):
            places[k] = Place(choice.name, 0, np.nan, scale[k])
        return places
