"""Choice of selects that become `if`, with every operation in the branch that needs it.

A select whose side costs something becomes a branch, with the operations that only this side takes
inside, nested as deep as it goes; selects of one place with the same condition share a branch.
"""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import final

import casadi as ca

from symfric.emitter.c99 import TRANSCENDENTAL
from symfric.foundation.graph import LEAVES, SELECT, Graph

LEAST = 4
"""Cost of a side from which on it is worth a branch."""
SHARE = 2
"""Cost of a side for each select of a branch: else it only keeps their operands waiting."""
DEEPEST = 30
"""Branches within each other; what is nested deeper is chosen by `?:`."""
COSTS = {ca.OP_DIV: 4, ca.OP_INV: 4, ca.OP_SQRT: 4, ca.OP_FLOOR: 8, ca.OP_CEIL: 8} | dict.fromkeys(
    TRANSCENDENTAL, 30
)
"""In additions, of what costs more than one."""


@final
@dataclass(frozen=True)
class Region:
    """Side of a branch, or the whole function.

    Attributes:
        parent: number of the region that the branch stands in.
        depth: number of branches round it.
        label: of the branch in its parent.
        side: 1 where the condition holds, 2 where it does not, as in the arguments of a select.
    """

    parent: int
    depth: int
    label: int
    side: int


@final
@dataclass(frozen=True)
class Placed:
    """Graph with the place of every operation.

    Attributes:
        source: the graph.
        regions: all, the function first, a parent before what is inside it.
        place: number of the region of each node.
        labels: of the selects that are branches; selects in one region with one label are one.
        inside: (region, label, side) -> number of the region that is that side.
    """

    source: Graph
    regions: tuple[Region, ...]
    place: tuple[int, ...]
    labels: Mapping[int, int]
    inside: Mapping[tuple[int, int, int], int]


def placed(source: Graph, apart: Iterable[int] = ()) -> Placed:
    """Return the graph with branches where they spare something.

    Args:
        source: a simplified graph.
        apart: selects that do not share a branch with others.
    """
    alone = set(apart)
    labels = {
        i: -i if i in alone else node.args[0]
        for i, node in enumerate(source.nodes)
        if node.op == SELECT
    }
    while True:
        found = _Placement(source, labels).result()
        cheap = _cheap(found)
        if not cheap:
            return found
        labels = {i: label for i, label in labels.items() if i not in cheap}


def _cheap(found: Placed) -> set[int]:
    """Selects that are no branches or not worth one; what they hold is then not, either."""
    cost = [0] * len(found.regions)
    for i, node in enumerate(found.source.nodes):
        if node.op not in LEAVES:
            cost[found.place[i]] += COSTS.get(node.op, 1)
    for number in reversed(range(1, len(cost))):
        cost[found.regions[number].parent] += cost[number]
    count = Counter((found.place[i], label) for i, label in found.labels.items())
    worth = {
        (region.parent, region.label)
        for number, region in enumerate(found.regions)
        if 0 < region.depth <= DEEPEST
        and cost[number] >= max(LEAST, SHARE * count[region.parent, region.label])
    }
    return {i for i, label in found.labels.items() if (found.place[i], label) not in worth}


class _Placement:
    """One pass from the results to the inputs."""

    def __init__(self, source: Graph, labels: Mapping[int, int]) -> None:
        self.source, self.labels = source, labels
        self.regions = [Region(0, 0, 0, 0)]
        self.inside: dict[tuple[int, int, int], int] = {}
        self.place = [-1] * len(source.nodes)

    def result(self) -> Placed:
        """Every node in the innermost region that holds all its users."""
        for row in self.source.results:
            for i in row:
                self.place[i] = 0
        for i in reversed(range(len(self.source.nodes))):
            self._take_arguments(i)
        return Placed(
            self.source,
            tuple(self.regions),
            tuple(self.place),
            self.labels,
            self.inside,
        )

    def _take_arguments(self, i: int) -> None:
        node, region = self.source.nodes[i], self.place[i]
        if i in self.labels:
            self._take(node.args[0], region)
            for side in (1, 2):
                self._take(node.args[side], self._side(region, i, side))
            return
        for j in node.args:
            self._take(j, region)

    def _take(self, i: int, region: int) -> None:
        """Node `i` is needed in a region."""
        other = self.place[i]
        if other < 0:
            self.place[i] = region
            return
        while region != other:
            if self.regions[region].depth < self.regions[other].depth:
                region, other = other, region
            region = self.regions[region].parent
        self.place[i] = region

    def _side(self, region: int, i: int, side: int) -> int:
        """Return the region of a side of select `i`."""
        key = (region, self.labels[i], side)
        if key not in self.inside:
            outer = self.regions[region]
            self.inside[key] = len(self.regions)
            self.regions.append(Region(region, outer.depth + 1, self.labels[i], side))
        return self.inside[key]
