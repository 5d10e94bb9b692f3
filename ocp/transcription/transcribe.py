"""From a problem to a nonlinear program on meshes.

    w = [x_0, (u_1, (x, z)_11 ... (x, z)_1d), x_1, ..., x_N, T] of each span, chosen p

with a copy of the state at every node. What has to be differentiated is one point of each span and
what holds at single nodes: `discretise` does it once. `Discretisation.on` puts it on meshes, whose
fractions, like all parameters, are parameters of the program.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import final

from ocp.formulation.phase import Row
from ocp.formulation.problem import Problem
from ocp.transcription.blocks import Array
from ocp.transcription.closed_loops import Closing, closing
from ocp.transcription.collocation import PointEquations, point_equations
from ocp.transcription.conditions import AtNode, Between, at_nodes, at_starts, between
from ocp.transcription.grid import check_meshes, nodes_of
from ocp.transcription.local import Local
from ocp.transcription.schemes import Scheme, Shooting
from ocp.transcription.shooting import Shot, shot
from ocp.transcription.skeleton import Equations, Skeleton, skeleton_of
from ocp.transcription.transcription import Transcription

KEPT = 4
"""Programs that a discretisation remembers: those of the meshes it was put on last."""

Key = tuple[tuple[int, ...], ...]


@final
@dataclass(frozen=True, eq=False)
class Discretisation:
    """A problem whose equations are differentiated, ready to be put on meshes.

    Attributes:
        equations: what holds at points, at nodes and between spans.
        made: what programs share, by numbers of intervals.
    """

    equations: Equations
    made: dict[Key, Skeleton] = field(default_factory=dict[Key, Skeleton])

    @property
    def problem(self) -> Problem:
        """What was discretised."""
        return self.equations.problem

    @property
    def scheme(self) -> Scheme:
        """How it was discretised."""
        return self.equations.scheme

    def on(self, meshes: Sequence[Array]) -> Transcription:
        """The program on `meshes`: one for each span, or one for each phase (see `make_meshes`).

        Meshes with as many intervals as before, and conditions at the same nodes, change numbers
        only: the symbols and Functions of their programs are the same objects.

        Raises:
            ValueError: no such meshes.
        """
        problem = self.problem
        given = check_meshes(problem, meshes)
        nodes = [nodes_of(span, mesh) for span, mesh in zip(problem.spans, given, strict=True)]
        key = tuple((mesh.size - 1, *at.values()) for mesh, at in zip(given, nodes, strict=True))
        skeleton = self.made.pop(key, None) or skeleton_of(self.equations, given, nodes)
        self.made[key] = skeleton  # the youngest stands last
        for old in list(self.made)[:-KEPT]:
            del self.made[old]
        return Transcription(problem, self.scheme, given, skeleton)


def discretise(
    problem: Problem, scheme: Scheme, starts: Mapping[int, Sequence[Row]] | None = None
) -> Discretisation:
    """Write the equations of `problem` at points and nodes, and differentiate them.

    Args:
        problem: what to discretise.
        scheme: how; one of collocation where there are `starts`.
        starts: number of a span -> conditions that hold at the start of each interval but the
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
