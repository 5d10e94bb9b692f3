"""Graph divided into straight parts with loops between them.

    part 0,  loops of stage 1,  part 1,  loops of stage 2,  ...,  last part

A loop belongs to the first stage at which all values that it takes from outside are known. A value
outside the loops is computed in the last part that precedes all its users.
"""

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from operator import itemgetter
from typing import NamedTuple, final

from symfric.emitter.c99 import TRANSCENDENTAL
from symfric.emitter.rolling import Arrays, Body, StoredRows, Strand, Sum, strands, woven
from symfric.foundation.graph import LEAVES, Graph, Node

CALL = 20
"""Cost of a transcendental function [operations]."""

SPARED = 8
"""Smallest number of operations that a loop must save."""

MORE = 1.1
"""Largest ratio of executed operations with and without loops."""


class ElementLoop(NamedTuple):
    """Loop over `size` elements in the stage `stage` >= 1."""

    stage: int
    size: int
    strands: tuple[Strand, ...]
    body: Body

    @property
    def sums(self) -> list[Sum]:
        """Sums that the loop computes."""
        return [strand for strand in self.strands if isinstance(strand, Sum)]

    @property
    def stores(self) -> list[StoredRows]:
        """Rows that the loop writes."""
        return [strand for strand in self.strands if isinstance(strand, StoredRows)]


@final
@dataclass(frozen=True)
class LoopPlan:
    """Graph with its loops in the order of their execution."""

    source: Graph
    loops: tuple[ElementLoop, ...] = ()

    @cached_property
    def last(self) -> int:
        """Number of the last straight part."""
        return max((loop.stage for loop in self.loops), default=0)

    @cached_property
    def totals(self) -> dict[int, Sum]:
        """Sums of all loops, by their node in the graph."""
        return {s.total: s for loop in self.loops for s in loop.sums}

    @cached_property
    def stored(self) -> set[tuple[int, int]]:
        """(result, row) of all rows that loops write."""
        return {
            (s.array.group, s.array.first + s.offset + i)
            for loop in self.loops
            for s in loop.stores
            for i in range(loop.size)
        }

    def started(self, part: int) -> list[tuple[int, int]]:
        """Return (total, start) of sums with a start in the loops after a straight part."""
        loops = (loop for loop in self.loops if loop.stage == part + 1)
        return [(s.total, s.start) for loop in loops for s in loop.sums if s.start is not None]

    @cached_property
    def needed(self) -> dict[int, int]:
        """Last straight part that serves all users, for each node outside the loops."""
        found: dict[int, int] = {}

        def need(nodes: Sequence[int], part: int) -> None:
            for i in nodes:
                found[i] = min(found.get(i, part), part)

        for group, row in enumerate(self.source.results):
            need([i for k, i in enumerate(row) if (group, k) not in self.stored], self.last)
        for loop in self.loops:
            need(loop.body.taken, loop.stage - 1)
        for part in range(self.last):
            need([start for _, start in self.started(part)], part)
        for i in reversed(range(len(self.source.nodes))):
            if i in found and i not in self.totals:
                need(self.source.nodes[i].args, found[i])
        return found

    @cached_property
    def part(self) -> dict[int, int]:
        """Straight part that computes each operation, without sums and operations in loops."""
        nodes = self.source.nodes
        return {
            i: part
            for i, part in sorted(self.needed.items())
            if i not in self.totals and nodes[i].op not in LEAVES
        }


def planned(source: Graph, arrays: Arrays) -> LoopPlan:
    """Return the graph with all loops that save statements at little cost.

    Loops are omitted if they are short, if their sums are unused, or if they would overwrite rows
    that another loop has yet to read. If too many operations would be repeated, the loops that
    repeat most of them are omitted as well.
    """
    chosen = {s: woven(source, [s], arrays) for s in strands(source, arrays)}
    while chosen:
        stages = _stages(source, chosen)
        groups = defaultdict[tuple[int, int], list[Strand]](list)
        for strand in chosen:
            groups[stages[strand], len(strand.lanes)].append(strand)
        loops = (
            ElementLoop(stage, size, tuple(group), woven(source, group, arrays))
            for (stage, size), group in sorted(groups.items(), key=itemgetter(0))
        )
        plan = LoopPlan(source, tuple(loops))
        out = _overwriting(plan.loops) or _idle(plan) or _wasteful(plan, chosen)
        if not out:
            return plan
        chosen = {s: body for s, body in chosen.items() if s not in out}
    return LoopPlan(source)


def _stages(source: Graph, bodies: Mapping[Strand, Body]) -> dict[Strand, int]:
    """Return the stage of each strand: after the values it needs; stores not before readers."""
    sums = {strand.total: strand for strand in bodies if isinstance(strand, Sum)}
    stages: dict[Strand, int] = {}
    known: list[int] = []

    def after(*needed: int | None) -> int:
        return max((known[k] for k in needed if k is not None), default=0)

    for i, node in enumerate(source.nodes):
        if i in sums:
            stages[sums[i]] = 1 + after(*bodies[sums[i]].taken, sums[i].start)
            known.append(stages[sums[i]])
        else:
            known.append(after(*node.args))
    stores = [strand for strand in bodies if isinstance(strand, StoredRows)]
    stages |= {store: 1 + after(*bodies[store].taken) for store in stores}
    for _ in range(max(stages.values(), default=0)):
        for store in stores:
            readers = (stages[s] for s, body in bodies.items() if _reads(body, store))
            stages[store] = max([stages[store], *readers])
    return stages


def _reads(body: Body, store: StoredRows) -> list[int]:
    """Return the offsets at which a body reads the memory that `store` writes."""
    return [offset for array, offset in body.reads if array.text == store.array.text]


def _overwriting(loops: Sequence[ElementLoop]) -> set[Strand]:
    """Return the stores that would overwrite rows before they have been read."""
    return {
        store
        for i, loop in enumerate(loops)
        for store in loop.stores
        if any(offset < store.offset for offset in _reads(loop.body, store))
        or any(_reads(later.body, store) for later in loops[i + 1 :])
    }


def _idle(plan: LoopPlan) -> set[Strand]:
    """Return sums without users, and the strands of short loops."""

    def spared(loop: ElementLoop) -> int:
        return (loop.size - 1) * (loop.body.graph.operations + len(loop.strands))

    short = {s for loop in plan.loops if spared(loop) < SPARED for s in loop.strands}
    return short | {s for total, s in plan.totals.items() if total not in plan.needed}


def _wasteful(plan: LoopPlan, chosen: Mapping[Strand, Body]) -> set[Strand]:
    """Return the strands that repeat most operations, if too many are repeated."""
    nodes = plan.source.nodes
    executed = _cost([nodes[i] for i in plan.part])
    for loop in plan.loops:
        executed += loop.size * (_cost(loop.body.graph.nodes) + len(loop.sums))
    if executed <= MORE * _cost(nodes):
        return set()
    places = Counter(dict.fromkeys(plan.part, 1))
    places.update(i for loop in plan.loops for i in loop.body.inside)
    waste = {
        strand: sum((places[i] - 1) * _cost([nodes[i]]) for i in body.inside)
        for strand, body in chosen.items()
    }
    most = max(waste.values())
    return {strand for strand, lost in waste.items() if 2 * lost >= most}


def _cost(nodes: Sequence[Node]) -> int:
    return sum(CALL if n.op in TRANSCENDENTAL else n.op not in LEAVES for n in nodes)
