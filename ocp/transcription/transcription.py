"""A problem on meshes: conversion between the vector of unknowns and named values."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from ocp.formulation.phase import Free, Span
from ocp.formulation.problem import Problem
from ocp.transcription.assembly import Assembled
from ocp.transcription.blocks import Array, Indices, Piece
from ocp.transcription.closed_loops import Closing
from ocp.transcription.program import Place, Places, Program, Stages, stages_of
from ocp.transcription.schemes import Scheme, check_meshes
from ocp.transcription.unknowns import Layout, Points, SpanPoints
from symfric.foundation.parameters import check_names


@final
@dataclass(frozen=True, eq=False)
class Skeleton:
    """The part common to programs on meshes with the same numbers of intervals.

    Attributes:
        program: without values of parameters and names of rows and unknowns.
        pieces, assembled: rows and costs, and their places in the program.
        closing: for each phase the constraints of its mechanism; None if it has none.
    """

    problem: Problem
    layout: Layout
    program: Program
    pieces: tuple[Piece, ...]
    assembled: Assembled
    closing: tuple[Closing | None, ...]

    @property
    def p(self) -> ca.MX:
        """Parameters of the program."""
        return self.program.p

    @cached_property
    def structure(self) -> tuple[Stages | None, str]:
        """Stages, or None and the reason."""
        equality = self.program.lower_g == self.program.upper_g
        return stages_of(self.problem, self.layout, self.pieces, self.assembled, equality)


LARGEST = "the largest cost"


def fixed_duration(span: Span) -> float:
    """Return T of a phase [s]; 1 if it is an unknown."""
    return 1.0 if isinstance(span.T, Free) else float(span.T)


def numbers_of(problem: Problem, meshes: Sequence[Array], p: Mapping[str, float]) -> Array:
    """Return the values [p, T, mesh] of each phase."""
    parts: list[Array] = []
    for span, mesh in zip(problem.spans, meshes, strict=True):
        own = [p.get(v.name, x) for v, x in zip(span.model.p, span.p, strict=True)]
        parts += [np.array(own, dtype=float), np.array([fixed_duration(span)]), mesh]
    return np.concatenate(parts)


@final
@dataclass(frozen=True, eq=False)
class Transcription:
    """A problem on meshes: the nonlinear program, and its conversion to named values.

    Attributes:
        problem, scheme: the problem and its scheme.
        meshes: for each phase, fractions of T that bound the intervals.
        skeleton: common part of meshes with the same numbers of intervals.
        program: for a solver.
    """

    problem: Problem
    scheme: Scheme
    meshes: tuple[Array, ...]
    skeleton: Skeleton
    program: Program = field(init=False)

    def __post_init__(self) -> None:
        shared, meshes = self.skeleton, self.meshes
        program = replace(
            shared.program,
            values=numbers_of(self.problem, meshes, {}),
            rows=Places(shared.program.g.numel(), lambda: _row_places(shared, meshes)),
            unknowns=Places(self.layout.size, lambda: _unknown_places(self)),
            structure=lambda: shared.structure,
        )
        object.__setattr__(self, "program", program)

    @property
    def layout(self) -> Layout:
        """Places of the unknowns in w."""
        return self.skeleton.layout

    def pack(self, points: Points) -> Array:
        """Return the vector w of `points`; shared values are those of the first phase."""
        w = np.zeros(self.layout.size)
        for span, own in zip(points.spans[::-1], self.layout.spans[::-1], strict=True):
            w[own.nodes], w[own.inner] = span.nodes, span.inner
            w[own.z], w[own.u] = span.z, span.u
            if own.T >= 0:
                w[own.T] = span.T
        for column, choice in zip(self.layout.chosen, self.problem.chosen, strict=True):
            w[column] = points.chosen.get(choice.name, choice.guess)
        w /= self.program.scale
        if self.layout.largest >= 0:
            rows = [i for i, place in enumerate(self.program.rows) if place.name == LARGEST]
            g = np.asarray(self.program.jacobian(w, self.program.values)[0]).ravel()
            w[self.layout.largest] = g[rows].max()
        return w

    def unpack(self, w: ArrayLike) -> Points:
        """Return the points of the vector `w` in SI units."""
        values = np.asarray(w, dtype=float).ravel() * self.program.scale
        spans = tuple(
            SpanPoints(
                float(values[own.T]) if own.T >= 0 else float(fixed_duration(span)),
                *(values[columns] for columns in (own.nodes, own.inner, own.z, own.u)),
            )
            for span, own in zip(self.problem.spans, self.layout.spans, strict=True)
        )
        names = [choice.name for choice in self.problem.chosen]
        return Points(spans, dict(zip(names, values[self.layout.chosen].tolist(), strict=True)))

    def consistent(self, points: Points) -> Points:
        """Return `points` with mechanisms moved onto their constraints."""
        spans = [
            span if loops is None else loops.consistent(span, mesh, self.inner_fractions(number))
            for number, (span, mesh, loops) in enumerate(
                zip(points.spans, self.meshes, self.skeleton.closing, strict=True)
            )
        ]
        return replace(points, spans=tuple(spans))

    def duration(self, points: Points, span: int) -> float:
        """Return T of a phase [s], free or fixed."""
        T = self.problem.spans[span].T
        return points.spans[span].T if isinstance(T, Free) else float(T)

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

    def values(
        self,
        p: Mapping[str, float] | None = None,
        meshes: Sequence[Array] | None = None,
    ) -> Array:
        """Return the values of the parameters of the program.

        Args:
            p: parameters of the models by name, in all phases that have them, instead of those of
                the problem, also in scenarios.
            meshes: with the same numbers of intervals as this transcription.

        Raises:
            ValueError: an unknown name, or other meshes.
        """
        given = self.meshes if meshes is None else check_meshes(self.problem, meshes)
        if [mesh.size for mesh in given] != [mesh.size for mesh in self.meshes]:
            raise ValueError("meshes: expected as many intervals as before; use Discretisation.on")
        known = {v.name for span in self.problem.spans for v in span.model.p}
        check_names("values", p or {}, sorted(known))
        return numbers_of(self.problem, given, p or {})


Columns = tuple[list[str], Indices, Indices, Array, Array]


def _row_places(skeleton: Skeleton, meshes: Sequence[Array]) -> Columns:
    """Return names of rows, and for each row index of the name, phase, fraction, scale."""
    m = skeleton.program.g.numel()
    names: list[str] = []
    name, span = np.zeros(m, np.int64), np.zeros(m, np.int64)
    fraction, scale = np.zeros(m), np.ones(m)
    for piece, at in zip(skeleton.pieces, skeleton.assembled.at, strict=True):
        mesh = meshes[piece.span]
        name[at] = len(names) + np.arange(piece.m)[:, None]
        names += piece.names
        span[at] = piece.span
        fraction[at] = mesh[piece.interval] + np.diff(mesh)[piece.interval] * piece.offset
        scale[at] = piece.rows.scale[:, None]
    return names, name, span, fraction, scale


def _unknown_places(transcription: Transcription) -> Columns:
    """Return names of unknowns, and for each index of the name, phase, fraction, scale."""
    layout, n = transcription.layout, transcription.layout.size
    names: list[str] = []
    name, owner = np.zeros(n, np.int64), np.zeros(n, np.int64)
    fraction = np.full(n, np.nan)
    for number in reversed(range(len(layout.spans))):
        own, model = layout.spans[number], transcription.problem.spans[number].model
        mesh, inner = transcription.meshes[number], transcription.inner_fractions(number)
        groups = (
            ([v.name for v in model.x], own.nodes, mesh),
            ([v.name for v in model.x], own.inner, inner),
            ([v.name for v in model.z], own.z, inner),
            ([v.name for v in model.u], own.u, mesh[:-1]),
            ([f"correction {k + 1}" for k in range(len(own.extra))], own.extra, mesh[:-1]),
            (
                ["T"],
                np.array([[own.T]])[:, : int(own.T >= 0)],
                np.array([np.nan])[: int(own.T >= 0)],
            ),
        )
        for labels, columns, at in groups:
            name[columns] = len(names) + np.arange(len(labels))[:, None]
            owner[columns], fraction[columns] = number, at
            names += labels
    for column, choice in zip(layout.chosen, transcription.problem.chosen, strict=True):
        name[column] = len(names)
        names.append(choice.name)
    if layout.largest >= 0:
        name[layout.largest] = len(names)
        names.append(LARGEST)
    return names, name, owner, fraction, transcription.program.scale
