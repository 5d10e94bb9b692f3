"""Statements of a function: locals, operands of each statement, and their order."""

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
"""Rank of a statement that neither makes nor ends a value; those that make one come first."""


def ordered(takes: Sequence[Iterable[int]], makes: Sequence[Iterable[int]]) -> list[int]:
    """Return an order of statements 0, 1, ... in which a value is made before it is taken.

    The next statement is the ready one that increases the number of live values least: it makes
    some, and ends those without another use. Among several, the first that takes a single value
    (often a call) is next, else the first. The time is that of sorting all values taken.

    Args:
        takes: values that each statement takes; those that no statement makes exist initially.
        makes: values that each statement makes; one statement makes a value.

    Returns:
        The order, without statements that wait for each other in a cycle, and their followers.
    """
    needs = [set(values) for values in takes]
    maker = {value: i for i, values in enumerate(makes) for value in values}
    before = [{maker[value] for value in values if value in maker} for values in needs]
    waits = [len(makers) for makers in before]
    takers, followers = defaultdict[int, set[int]](set), defaultdict[int, list[int]](list)
    for i, values in enumerate(needs):
        for value in values:
            takers[value].add(i)
        for j in before[i]:
            followers[j].append(i)

    def rank(i: int) -> tuple[int, int, int]:
        made = sum(bool(takers.get(value)) for value in makes[i])
        ended = sum(len(takers[value]) == 1 for value in needs[i])
        return made - ended if made or ended else IDLE, min(len(needs[i]), 2), i

    heap = sorted(rank(i) for i, count in enumerate(waits) if count == 0)
    found: dict[int, None] = {}
    while heap:
        _, _, i = heappop(heap)
        if i in found:
            continue
        found[i] = None
        for j in followers[i]:
            waits[j] -= 1
        changed = {j for j in followers[i] if waits[j] == 0}
        for value in needs[i]:
            takers[value].discard(i)
            if len(takers[value]) == 1:
                changed |= {j for j in takers[value] if waits[j] == 0 and j not in found}
        for j in changed:
            heappush(heap, rank(j))
    return [*found]


LONGEST = 5
"""Largest number of operations of an operand inside a formula."""


@final
@dataclass(frozen=True)
class LocalConstant:
    """Constant local: the value of `node`."""

    node: int


@final
@dataclass(frozen=True)
class IfStatement:
    """`if` statement for the selects with the label `label` in `region`."""

    region: int
    label: int
    selects: tuple[int, ...]


@final
@dataclass(frozen=True)
class Side:
    """Statement in a branch: `select` gets the value of its argument number `side`."""

    select: int
    side: int


@final
@dataclass(frozen=True)
class StoreStatement:
    """Statement that writes a row of a result."""

    result: int
    row: int


Statement = LocalConstant | IfStatement | Side | StoreStatement


@final
@dataclass(frozen=True)
class Stores:
    """Rules for writing results.

    Attributes:
        late: True if all results are written last.
        within: stores that may be inside a branch, if it alone determines their values.
        same: stores to a place that an input is loaded from, with the node of the input.
    """

    late: bool = False
    within: frozenset[StoreStatement] = frozenset()
    same: Mapping[StoreStatement, int] = field(default_factory=dict[StoreStatement, int])


@final
class StatementPlan:
    """Statements of a function, region by region.

    Attributes:
        placed: graph with its branches.
        bodies: statements of each region in order.
        takes: nodes of its region that each statement, with its inner statements, takes.
        goals: select -> the select of which it is a side, or the result that it is, whose place it
            is written to.
        waiting: selects of branches that wait for each other.
    """

    def __init__(self, found: Placed, bools: Sequence[bool], stores: Stores) -> None:
        self.placed, self.nodes, self.stores = found, found.source.nodes, stores
        groups = defaultdict[tuple[int, int], list[int]](list)
        for i, label in sorted(found.labels.items()):
            groups[found.place[i], label].append(i)
        self.branches = {key: IfStatement(*key, tuple(selects)) for key, selects in groups.items()}
        uses = Counter[int]()
        for i, times in self._written():
            uses[i] += times
        self.locals = self._locals(uses)
        self.goals = self._goals(bools, uses)
        self.items: list[list[Statement]] = [[] for _ in found.regions]
        self.takes: dict[Statement, set[int]] = {}
        self._collect()
        self._connect()
        self.waiting = set[int]()
        self.bodies = [self._in_order(statements) for statements in self.items]

    def _in_order(self, statements: Sequence[Statement]) -> list[Statement]:
        """Return the statements of a region in order, without those that wait for each other."""
        last = [s for s in statements if self.stores.late and isinstance(s, StoreStatement)]
        early = [s for s in statements if s not in last]
        order = ordered([self.takes[s] for s in early], [_made(s) for s in early])
        left = (early[k] for k in {*range(len(early))}.difference(order))
        self.waiting.update(i for s in left if isinstance(s, IfStatement) for i in s.selects)
        return [*(early[k] for k in order), *last]

    def _written(self) -> Iterator[tuple[int, int]]:
        """Yield operands of formulas and the number of times that each is written."""
        labels, place = self.placed.labels, self.placed.place
        for i, node in enumerate(self.nodes):
            if i in labels:
                yield from ((side, 1) for side in node.args[1:])
            else:
                repeats = FORMS[node.op].pattern.count("{0}") if node.op in FORMS else 0
                yield from ((operand, max(repeats, 1)) for operand in node.args)
        conditions = {(place[i], label, self.nodes[i].args[0]) for i, label in labels.items()}
        yield from ((condition, 1) for *_, condition in conditions)
        yield from ((i, 1) for row in self.placed.source.results for i in row)

    def _locals(self, uses: Counter[int]) -> frozenset[int]:
        """Return nodes that are shared or too long to be written inside a formula."""
        labels = self.placed.labels
        whole = {i for row in self.placed.source.results for i in row}
        whole |= {side for i in labels for side in self.nodes[i].args[1:]}
        kept, weight = set[int](), [0] * len(self.nodes)
        for i, node in enumerate(self.nodes):
            if node.op in LEAVES or i in labels:
                continue
            weight[i] = 1 + sum(weight[j] for j in node.args)
            if uses[i] > 1 or (weight[i] > LONGEST and i not in whole):
                kept.add(i)
                weight[i] = 0
        return frozenset(kept)

    def _goals(self, bools: Sequence[bool], uses: Counter[int]) -> dict[int, int | StoreStatement]:
        """Return the goals of selects without a variable: each is used once, as result or side."""
        once = {i for i in self.placed.labels if uses[i] == 1}
        goals: dict[int, int | StoreStatement] = {
            i: outer
            for outer in self.placed.labels
            for i in self.nodes[outer].args[1:]
            if i in once and bools[i] == bools[outer]
        }
        for store in self.stores.within if not self.stores.late else ():
            i = self.placed.source.results[store.result][store.row]
            if i in once:
                goals[i] = store
        return goals

    def _collect(self) -> None:
        """Collect all statements by region, in the order of the graph."""
        found, done = self.placed, set[IfStatement]()
        for i, node in enumerate(self.nodes):
            if i in self.locals:
                self.items[found.place[i]].append(LocalConstant(i))
            elif i in found.labels:
                branch = self.branches[found.place[i], found.labels[i]]
                if branch not in done:
                    done.add(branch)
                    self.items[branch.region].append(branch)
                for side in (1, 2):
                    if not self._is_there(i, node.args[side]):
                        inner = found.inside[branch.region, branch.label, side]
                        self.items[inner].append(Side(i, side))
        direct = {goal for goal in self.goals.values() if isinstance(goal, StoreStatement)}
        for k, row in enumerate(found.source.results):
            stores = ((StoreStatement(k, j), i) for j, i in enumerate(row))
            same = self.stores.same
            self.items[0] += (s for s, i in stores if s not in direct and same.get(s) != i)

    def _is_there(self, select: int, value: int) -> bool:
        """Return True if a side of a select is already in its place and need not be written."""
        if self.goals.get(value) == select:
            return True
        goal: int | StoreStatement | None = select
        while isinstance(goal, int):
            goal = self.goals.get(goal)
        return goal is not None and self.stores.same.get(goal) == value

    def _connect(self) -> None:
        """Determine the nodes that each statement takes."""
        homes: dict[int, tuple[Statement, int]] = {}
        for number, statements in enumerate(self.items):
            for statement in statements:
                self.takes.setdefault(statement, set())
                for i in self._operands(statement):
                    self._take(i, statement, number, homes)
        for i in reversed(range(len(self.nodes))):
            if i in homes:
                for j in self.nodes[i].args:
                    self._take(j, *homes[i], homes)

    def _operands(self, statement: Statement) -> Sequence[int]:
        match statement:
            case LocalConstant(node):
                return self.nodes[node].args
            case IfStatement(selects=selects):
                return self.nodes[selects[0]].args[:1]
            case Side(select, side):
                return (self.nodes[select].args[side],)
            case StoreStatement(result, row):
                return (self.placed.source.results[result][row],)

    def _take(
        self, i: int, statement: Statement, region: int, homes: dict[int, tuple[Statement, int]]
    ) -> None:
        """Record that `statement` of a region contains node `i` or its name."""
        op = self.nodes[i].op
        if op == ca.OP_CONST:
            return
        if not (op == ca.OP_INPUT or i in self.locals or i in self.placed.labels):
            homes[i] = (statement, region)
            return
        inner, at = statement, statement
        while region != self.placed.place[i]:
            outer = self.placed.regions[region]
            inner, at, region = at, self.branches[outer.parent, outer.label], outer.parent
        if isinstance(at, IfStatement) and i in at.selects and at is not statement:
            at = inner
        self.takes.setdefault(at, set()).add(i)


def planned(source: Graph, bools: Sequence[bool], stores: Stores) -> StatementPlan:
    """Return the statements of a simplified graph.

    Args:
        bools: for each node, True if it is a bool.
        stores: rules for writing results.
    """
    apart: set[int] = set()
    while (plan := StatementPlan(placed(source, apart), bools, stores)).waiting:
        apart |= plan.waiting
    return plan


def _made(statement: Statement) -> tuple[int, ...]:
    """Return the nodes whose values a statement computes."""
    match statement:
        case LocalConstant(node):
            return (node,)
        case IfStatement(selects=selects):
            return selects
        case Side(select):
            return (select,)
        case StoreStatement():
            return ()
