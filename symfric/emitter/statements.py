"""Statements of a function: what becomes a local, what each statement takes, their order."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from heapq import heappop, heappush
from typing import final

import casadi as ca

from symfric.emitter.branches import Placed, placed
from symfric.emitter.c99 import FORMS
from symfric.foundation.graph import LEAVES, Graph

IDLE = 2
"""Growth of a statement that makes and ends nothing: it waits for those that make one value."""


def ordered(takes: Sequence[Iterable[int]], makes: Sequence[Iterable[int]]) -> list[int]:
    """Return an order of statements 0, 1, ... in which what is taken has been made before.

    Of those that are ready the one comes next that adds least to the values that are live: it makes
    some, and ends those without another use. Of several it is the first that takes a single
    value, which is often a call, else the first. The time is that of sorting all that is taken.

    Args:
        takes: values that each statement takes; those that none makes are there from the beginning.
        makes: values that each statement makes, each by one.

    Returns:
        The order; statements that wait for each other in a circle, and what waits for them, are
        missing.
    """
    maker = {value: i for i, values in enumerate(makes) for value in values}
    takers: dict[int, set[int]] = {}
    waits = [0] * len(takes)
    next_ones: list[list[int]] = [[] for _ in takes]
    for i, values in enumerate(takes):
        for value in set(values):
            takers.setdefault(value, set()).add(i)
        before = {maker[value] for value in set(values) if value in maker}
        waits[i] = len(before)
        for j in before:
            next_ones[j].append(i)

    def rank(i: int) -> tuple[int, int, int]:
        made = sum(bool(takers.get(value)) for value in makes[i])
        ended = sum(len(takers[value]) == 1 for value in set(takes[i]))
        return made - ended if made or ended else IDLE, min(len(set(takes[i])), 2), i

    heap: list[tuple[int, int, int]] = []
    for i, count in enumerate(waits):
        if count == 0:
            heappush(heap, rank(i))
    found: list[int] = []
    done = [False] * len(takes)
    while heap:
        _, _, i = heappop(heap)
        if done[i]:
            continue
        done[i] = True
        found.append(i)
        fewer: set[int] = set()
        for value in set(takes[i]):
            takers[value].discard(i)
            if len(takers[value]) == 1:
                fewer |= takers[value]
        for j in next_ones[i]:
            waits[j] -= 1
            if waits[j] == 0:
                heappush(heap, rank(j))
        for j in fewer:
            if waits[j] == 0 and not done[j]:
                heappush(heap, rank(j))
    return found


LONGEST = 5
"""Operations of an operand beyond which it becomes a local."""


@final
@dataclass(frozen=True)
class Local:
    """Constant local: the value of `node`."""

    node: int


@final
@dataclass(frozen=True)
class Branch:
    """`if` with the sides of the selects of `label` in `region`."""

    region: int
    label: int
    selects: tuple[int, ...]


@final
@dataclass(frozen=True)
class Side:
    """Inside a branch: `select` gets the value of its argument number `side`."""

    select: int
    side: int


@final
@dataclass(frozen=True)
class Store:
    """Row of a result is written."""

    result: int
    row: int


Statement = Local | Branch | Side | Store


@final
@dataclass(frozen=True)
class Stores:
    """Rules for writing results.

    Attributes:
        late: all of them when all else is done.
        within: those that may be written inside a branch, where that decides about them alone.
        same: those that are written to where an input was loaded from, with its node.
    """

    late: bool = False
    within: frozenset[Store] = frozenset()
    same: Mapping[Store, int] = field(default_factory=dict[Store, int])


@final
@dataclass(frozen=True)
class Plan:
    """Function as statements.

    Attributes:
        placed: the graph with its branches.
        bodies: the statements of each region in order.
        takes: what each statement takes, what is inside it included: nodes of its own region.
        goals: select -> the select or result that it is a side or all of, whose place it takes.
    """

    placed: Placed
    bodies: tuple[tuple[Statement, ...], ...]
    takes: Mapping[Statement, frozenset[int]]
    goals: Mapping[int, int | Store]


def planned(source: Graph, bools: Sequence[bool], stores: Stores) -> Plan:
    """Statements for a simplified graph.

    Args:
        bools: whether each node is one.
        stores: how results are written.
    """
    apart: set[int] = set()
    while True:
        builder = _Planner(placed(source, apart), bools, stores)
        plan, waiting = builder.result()
        if not waiting:
            return plan
        apart |= waiting


class _Planner:
    def __init__(self, found: Placed, bools: Sequence[bool], stores: Stores) -> None:
        self.placed, self.stores = found, stores
        self.branches = _branches(found)
        uses = _uses(found)
        self.locals = _locals(found, uses)
        self.goals = _goals(found, bools, stores, uses)
        self.items: list[list[Statement]] = [[] for _ in found.regions]
        self.takes: dict[Statement, set[int]] = {}

    def result(self) -> tuple[Plan, set[int]]:
        """Return the plan, and the selects of branches that wait for each other."""
        self._collect()
        self._connect()
        bodies, waiting = list[tuple[Statement, ...]](), set[int]()
        for statements in self.items:
            body, left = self._ordered(statements)
            bodies.append(body)
            waiting.update(i for s in left if isinstance(s, Branch) for i in s.selects)
        takes = {statement: frozenset(values) for statement, values in self.takes.items()}
        return Plan(self.placed, tuple(bodies), takes, self.goals), waiting

    def _collect(self) -> None:
        """All statements by region, in the order of the graph."""
        found = self.placed
        done: set[Branch] = set()
        for i in range(len(found.source.nodes)):
            if i in self.locals:
                self.items[found.place[i]].append(Local(i))
            elif i in found.labels:
                branch = self.branches[found.place[i], found.labels[i]]
                if branch not in done:
                    done.add(branch)
                    self.items[found.place[i]].append(branch)
                for side in (1, 2):
                    if not self._is_there(i, found.source.nodes[i].args[side]):
                        inner = found.inside[branch.region, branch.label, side]
                        self.items[inner].append(Side(i, side))
        direct = {goal for goal in self.goals.values() if isinstance(goal, Store)}
        for k, row in enumerate(found.source.results):
            for j, i in enumerate(row):
                store = Store(k, j)
                if store not in direct and self.stores.same.get(store) != i:
                    self.items[0].append(store)

    def _is_there(self, select: int, value: int) -> bool:
        """Return True if a side of a select is in its place already and need not be written."""
        if self.goals.get(value) == select:
            return True
        goal: int | Store | None = select
        while isinstance(goal, int):
            goal = self.goals.get(goal)
        return goal is not None and self.stores.same.get(goal) == value

    def _connect(self) -> None:
        """Connect every statement with the nodes that it takes."""
        found = self.placed
        homes: dict[int, tuple[Statement, int]] = {}
        for number, statements in enumerate(self.items):
            for statement in statements:
                self.takes.setdefault(statement, set())
                for i in self._operands(statement):
                    self._take(i, statement, number, homes)
        for i in reversed(range(len(found.source.nodes))):
            if i in homes:
                for j in found.source.nodes[i].args:
                    self._take(j, *homes[i], homes)

    def _operands(self, statement: Statement) -> Sequence[int]:
        found = self.placed
        match statement:
            case Local(node):
                return found.source.nodes[node].args
            case Branch(selects=selects):
                return (found.source.nodes[selects[0]].args[0],)
            case Side(select, side):
                return (found.source.nodes[select].args[side],)
            case Store(result, row):
                return (found.source.results[result][row],)

    def _take(
        self, i: int, statement: Statement, region: int, homes: dict[int, tuple[Statement, int]]
    ) -> None:
        """Return `statement` of a region writes out node `i`, or its name."""
        node = self.placed.source.nodes[i]
        if node.op == ca.OP_CONST:
            return
        if not (node.op == ca.OP_INPUT or i in self.locals or i in self.placed.labels):
            homes[i] = (statement, region)
            return
        inner, at = statement, statement
        while region != self.placed.place[i]:
            outer = self.placed.regions[region]
            inner, at, region = at, self.branches[outer.parent, outer.label], outer.parent
        if isinstance(at, Branch) and i in at.selects and at is not statement:
            at = inner
        self.takes.setdefault(at, set()).add(i)

    def _ordered(
        self, statements: Sequence[Statement]
    ) -> tuple[tuple[Statement, ...], list[Statement]]:
        """In order; and those that wait for each other in a circle, with others."""
        early = [s for s in statements if not (self.stores.late and isinstance(s, Store))]
        takes = [self.takes[s] for s in early]
        makes = [_made(s) for s in early]
        order = ordered(takes, makes)
        body = [early[k] for k in order]
        body += [s for s in statements if self.stores.late and isinstance(s, Store)]
        chosen = set(order)
        return tuple(body), [s for k, s in enumerate(early) if k not in chosen]


def _made(statement: Statement) -> tuple[int, ...]:
    match statement:
        case Local(node):
            return (node,)
        case Branch(selects=selects):
            return selects
        case Side(select):
            return (select,)
        case Store():
            return ()


def _branches(found: Placed) -> dict[tuple[int, int], Branch]:
    groups: dict[tuple[int, int], list[int]] = defaultdict(list)
    for i, label in found.labels.items():
        groups[found.place[i], label].append(i)
    return {key: Branch(*key, tuple(sorted(selects))) for key, selects in groups.items()}


def _goals(
    found: Placed, bools: Sequence[bool], stores: Stores, uses: Counter[int]
) -> dict[int, int | Store]:
    """Branches that need no variable: all that becomes of their select is one result or side."""
    once = {i for i in found.labels if uses[i] == 1}
    goals: dict[int, int | Store] = {}
    for outer in found.labels:
        for i in found.source.nodes[outer].args[1:]:
            if i in once and bools[i] == bools[outer]:
                goals[i] = outer
    for store in stores.within:
        i = found.source.results[store.result][store.row]
        if i in once and not stores.late:
            goals[i] = store
    return goals


def _written(found: Placed) -> Iterator[tuple[int, int]]:
    """(node, how often) of every operand that is written somewhere."""
    conditions: set[tuple[int, int, int]] = set()
    for i, node in enumerate(found.source.nodes):
        if i in found.labels:
            conditions.add((found.place[i], found.labels[i], node.args[0]))
            yield from ((side, 1) for side in node.args[1:])
        else:
            repeats = FORMS[node.op].pattern.count("{0}") if node.op in FORMS else 0
            yield from ((operand, max(repeats, 1)) for operand in node.args)
    yield from ((condition, 1) for _, _, condition in conditions)
    yield from ((i, 1) for row in found.source.results for i in row)


def _uses(found: Placed) -> Counter[int]:
    """Number of times that each node is written out."""
    uses: Counter[int] = Counter()
    for i, times in _written(found):
        uses[i] += times
    return uses


def _locals(found: Placed, uses: Counter[int]) -> frozenset[int]:
    """Nodes that are shared, or too long to be read inside a formula."""
    whole = {i for row in found.source.results for i in row}
    whole |= {side for i in found.labels for side in found.source.nodes[i].args[1:]}
    kept, weight = set[int](), [0] * len(found.source.nodes)
    for i, node in enumerate(found.source.nodes):
        if node.op in LEAVES or i in found.labels:
            continue
        weight[i] = 1 + sum(weight[j] for j in node.args)
        if uses[i] > 1 or (weight[i] > LONGEST and i not in whole):
            kept.add(i)
            weight[i] = 0
    return frozenset(kept)
