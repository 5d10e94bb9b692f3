"""Selects that become `if` statements, and the operations that move into their branches.

A select with a costly side becomes a branch that contains the operations that only this side
needs. Branches may be nested; selects of one region with the same condition share a branch.
"""

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import casadi as ca

from symfric.emitter.c99 import TRANSCENDENTAL
from symfric.foundation.graph import LEAVES, SELECT, Graph

LEAST = 4
"""Smallest cost of a side that becomes a branch [additions]."""
SHARE = 2
"""Smallest cost of a side per select of the branch; cheaper ones only keep operands alive."""
DEEPEST = 30
"""Largest depth of branches; deeper selects are written with `?:`."""
COSTS = {ca.OP_DIV: 4, ca.OP_INV: 4, ca.OP_SQRT: 4, ca.OP_FLOOR: 8, ca.OP_CEIL: 8} | dict.fromkeys(
    TRANSCENDENTAL, 30
)
"""Cost of the operations whose cost is not 1 [additions]."""


class Region(NamedTuple):
    """Side of a branch, or the whole function.

    Attributes:
        parent: number of the region that contains the branch.
        depth: number of enclosing branches.
        label: label of the branch in its parent.
    """

    parent: int
    depth: int
    label: int


class Placed(NamedTuple):
    """Graph with the region of every operation.

    Attributes:
        source: the graph.
        regions: all regions; the function is first, and a parent precedes its inner regions.
        place: number of the region of each node.
        labels: labels of the selects that become branches; equal labels in a region share one.
        inside: (region, label, side) -> number of the region of that side; the side is 1 if the
            condition holds and 2 if not, as in the arguments of a select.
    """

    source: Graph
    regions: tuple[Region, ...]
    place: tuple[int, ...]
    labels: Mapping[int, int]
    inside: Mapping[tuple[int, int, int], int]


def placed(source: Graph, apart: Iterable[int] = ()) -> Placed:
    """Return the graph with the branches that save operations.

    Args:
        source: a simplified graph.
        apart: selects that do not share a branch with others.
    """
    alone = set(apart)
    selects = ((i, node.args[0]) for i, node in enumerate(source.nodes) if node.op == SELECT)
    labels = {i: -i if i in alone else condition for i, condition in selects}
    while True:
        found = _placed(source, labels)
        cheap = _cheap(found)
        if not cheap:
            return found
        labels = {i: label for i, label in labels.items() if i not in cheap}


def _placed(source: Graph, labels: Mapping[int, int]) -> Placed:
    """Return the graph with every node in the innermost region that contains all its users."""
    regions, inside = [Region(0, 0, 0)], dict[tuple[int, int, int], int]()
    place = [-1] * len(source.nodes)

    def inner(outer: int, label: int, side: int) -> int:
        key = (outer, label, side)
        if key not in inside:
            inside[key] = len(regions)
            regions.append(Region(outer, regions[outer].depth + 1, label))
        return inside[key]

    def take(i: int, region: int) -> None:
        other = region if place[i] < 0 else place[i]
        while region != other:
            if regions[region].depth < regions[other].depth:
                region, other = other, region
            region = regions[region].parent
        place[i] = region

    for row in source.results:
        for i in row:
            place[i] = 0
    for i in reversed(range(len(source.nodes))):
        homes = [place[i]] * len(source.nodes[i].args)
        if i in labels:
            homes[1:] = [inner(place[i], labels[i], side) for side in (1, 2)]
        for j, home in zip(source.nodes[i].args, homes, strict=True):
            take(j, home)
    return Placed(source, tuple(regions), tuple(place), labels, inside)


def _cheap(found: Placed) -> set[int]:
    """Return selects whose branches save too little; enclosing branches may depend on them."""
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
