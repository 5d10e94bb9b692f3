"""Graph cut into straight parts with loops between them.

    part 0,  loops of stage 1,  part 1,  loops of stage 2,  ...,  last part

A loop belongs to the stage after everything that it takes from outside is known; a straight value
is computed in the last part that is early enough for all its users.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import final

from symfric.emitter.c99 import TRANSCENDENTAL
from symfric.emitter.rolling import Array, Body, Store, Strand, Sum, strands, woven
from symfric.foundation.graph import LEAVES, Graph, Node

CALL = 20
"""Operations that a transcendental function counts for."""

SPARED = 8
"""Operations that a loop must spare to be written."""

MORE = 1.1
"""How many times the operations may be executed, because a loop and another part need them."""


@final
@dataclass(frozen=True)
class Loop:
    """Loop over `size` elements in the stage `stage` >= 1."""

    stage: int
    size: int
    strands: tuple[Strand, ...]
    body: Body

    @property
    def sums(self) -> list[Sum]:
        """Sums that it adds up."""
        return [strand for strand in self.strands if isinstance(strand, Sum)]

    @property
    def stores(self) -> list[Store]:
        """Rows that it writes."""
        return [strand for strand in self.strands if isinstance(strand, Store)]

    @cached_property
    def cost(self) -> int:
        """Operations of one element."""
        return _cost(self.body.graph.nodes)


@final
@dataclass(frozen=True)
class Plan:
    """Place of every computation.

    Attributes:
        loops: in the order of their execution.
        part: node -> the straight part that computes it; leaves, sums and what only loops need
            have none.
        idle: loops' sums that are not used.
    """

    source: Graph
    loops: tuple[Loop, ...]
    part: dict[int, int]
    idle: tuple[Sum, ...] = ()

    @property
    def last(self) -> int:
        """Number of the last straight part."""
        return max((loop.stage for loop in self.loops), default=0)

    @property
    def totals(self) -> dict[int, Sum]:
        """Sums of all loops by their node."""
        return {s.total: s for loop in self.loops for s in loop.sums}

    @property
    def stored(self) -> set[tuple[int, int]]:
        """(result, row) of everything that loops write."""
        return {
            (store.group, store.first + i)
            for loop in self.loops
            for store in loop.stores
            for i in range(loop.size)
        }


def planned(source: Graph, read: Sequence[Array], written: Sequence[Array]) -> Plan:
    """Return the graph with all loops that spare statements and cost next to nothing.

    What is left out: loops that would write what another one has yet to read; unused sums;
    short loops; and, where too much would be computed twice, those that do so.
    """
    chosen = {s: woven(source, [s], read) for s in strands(source, read, written)}
    while chosen:
        plan = _plan(source, chosen, read, written)
        out = _overwriting(plan.loops, read, written) or _idle(plan) or _wasteful(plan, chosen)
        if not out:
            return plan
        chosen = {s: body for s, body in chosen.items() if s not in out}
    return Plan(source, (), {})


def _plan(
    source: Graph,
    chosen: Mapping[Strand, Body],
    read: Sequence[Array],
    written: Sequence[Array],
) -> Plan:
    stages = _stages(source, chosen, read, written)

    def key(strand: Strand) -> tuple[int, int]:
        return stages[strand], len(strand.lanes)

    loops = tuple(
        Loop(stage, size, group := tuple(members), woven(source, group, read))
        for (stage, size), members in groupby(sorted(chosen, key=key), key)
    )
    return Plan(source, loops, *_parts(source, loops))


def _idle(plan: Plan) -> set[Strand]:
    """Sums without users, and what short loops do."""

    def spared(loop: Loop) -> int:
        operations = sum(node.op not in LEAVES for node in loop.body.graph.nodes)
        return (loop.size - 1) * (operations + len(loop.strands))

    short = {s for loop in plan.loops if spared(loop) < SPARED for s in loop.strands}
    return short | set(plan.idle)


def _wasteful(plan: Plan, chosen: Mapping[Strand, Body]) -> set[Strand]:
    """Return the loop that repeats most computations, if too many are repeated."""
    nodes = plan.source.nodes
    executed = _cost([nodes[i] for i in plan.part])
    executed += sum(loop.size * (loop.cost + len(loop.sums)) for loop in plan.loops)
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


def _stages(
    source: Graph,
    bodies: Mapping[Strand, Body],
    read: Sequence[Array],
    written: Sequence[Array],
) -> dict[Strand, int]:
    """Return the stage of every strand: after what it needs, stores not before others have read."""
    sums = {strand.total: strand for strand in bodies if isinstance(strand, Sum)}
    stages: dict[Strand, int] = {}
    known: list[int] = []
    for i, node in enumerate(source.nodes):
        if i in sums:
            start = [sums[i].start]
            needs = [*bodies[sums[i]].outer, *bodies[sums[i]].truths]
            needs += [k for k in start if k is not None]
            stages[sums[i]] = 1 + max((known[k] for k in needs), default=0)
            known.append(stages[sums[i]])
        else:
            known.append(max((known[k] for k in node.args), default=0))
    for strand, body in bodies.items():
        if isinstance(strand, Store):
            stages[strand] = 1 + max((known[k] for k in (*body.outer, *body.truths)), default=0)
    latest = max(stages.values(), default=0)
    for _ in range(latest):
        for strand in bodies:
            if isinstance(strand, Store):
                text = _text(strand, written)
                readers = (s for s, b in bodies.items() if text in _texts(b, read))
                stages[strand] = max([stages[strand], *(stages[s] for s in readers)])
    return stages


def _text(store: Store, written: Sequence[Array]) -> str:
    return next(a.text for a in written if a.holds(store.group, store.first))


def _texts(body: Body, read: Sequence[Array]) -> dict[str, list[int]]:
    """Return the memory that a body reads -> offsets of its first elements in it."""
    found: dict[str, list[int]] = {}
    for group, row in body.reads:
        array = next(a for a in read if a.holds(group, row))
        found.setdefault(array.text, []).append(row - array.first)
    return found


def _overwriting(
    loops: Sequence[Loop], read: Sequence[Array], written: Sequence[Array]
) -> set[Strand]:
    """Loops that would overwrite rows before they have been read."""
    found = set[Strand]()
    for i, loop in enumerate(loops):
        for store in loop.stores:
            text = _text(store, written)
            array = next(a for a in written if a.holds(store.group, store.first))
            own = _texts(loop.body, read).get(text, [])
            if any(offset < store.first - array.first for offset in own):
                found.add(store)
            if any(text in _texts(later.body, read) for later in loops[i + 1 :]):
                found.add(store)
    return found


def _parts(source: Graph, loops: Sequence[Loop]) -> tuple[dict[int, int], tuple[Sum, ...]]:
    """Return the straight part of every node outside the loops, the latest that serves all users.

    And the sums without users.
    """
    last = max((loop.stage for loop in loops), default=0)
    totals = {s.total: s for loop in loops for s in loop.sums}
    stored = {
        (s.group, s.first + i) for loop in loops for s in loop.stores for i in range(loop.size)
    }
    need: dict[int, int] = {}

    def ask(i: int, part: int) -> None:
        need[i] = min(need.get(i, last), part)

    for group, row in enumerate(source.results):
        for k, i in enumerate(row):
            if (group, k) not in stored:
                ask(i, last)
    for loop in loops:
        for i in (*loop.body.outer, *loop.body.truths):
            ask(i, loop.stage - 1)
        for s in loop.sums:
            if s.start is not None:
                ask(s.start, loop.stage - 1)
    for i in reversed(range(len(source.nodes))):
        if i in need and i not in totals:
            for k in source.nodes[i].args:
                ask(k, need[i])
    parts = {
        i: part
        for i, part in sorted(need.items())
        if i not in totals and source.nodes[i].op not in LEAVES
    }
    return parts, tuple(s for total, s in totals.items() if total not in need)
