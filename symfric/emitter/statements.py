"""The statements of a function: what becomes a local, what each statement takes, their order."""

from collections import Counter, defaultdict
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import final

import casadi as ca

from symfric.emitter.branches import Placed, placed
from symfric.emitter.c99 import FORMS
from symfric.emitter.schedule import ordered
from symfric.foundation.graph import LEAVES, Graph

LONGEST = 5
"""Operations of an operand beyond which it becomes a local."""


@final
@dataclass(frozen=True)
class Local:
    """A constant local: the value of `node`."""

    node: int


@final
@dataclass(frozen=True)
class Branch:
    """An `if` with the sides of the selects of `label` in `region`."""

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
    """A row of a result is written."""

    result: int
    row: int


Statement = Local | Branch | Side | Store


@final
@dataclass(frozen=True)
class Plan:
    """A function as statements.

    Attributes:
        placed: the graph with its branches.
        locals: nodes that have a local of their own.
        bodies: the statements of each region in order.
        takes: what each statement takes, what is inside it included: nodes of its own region.
        uses: how often each node is written out.
    """

    placed: Placed
    locals: frozenset[int]
    bodies: tuple[tuple[Statement, ...], ...]
    takes: dict[Statement, frozenset[int]]
    uses: Counter[int]


def planned(source: Graph, late: Collection[Store] = ()) -> Plan:
    """Statements for a simplified graph; results in `late` are written when all else is done."""
    apart: set[int] = set()
    while True:
        builder = _Planner(placed(source, apart), late)
        plan, waiting = builder.result()
        if not waiting:
            return plan
        apart |= waiting


class _Planner:
    def __init__(self, found: Placed, late: Collection[Store]) -> None:
        self.placed, self.late = found, late
        self.branches = _branches(found)
        self.uses = _uses(found)
        self.locals = _locals(found, self.uses)
        self.items: list[list[Statement]] = [[] for _ in found.regions]
        self.takes: dict[Statement, set[int]] = {}

    def result(self) -> tuple[Plan, set[int]]:
        """The plan, and the selects of branches that wait for each other."""
        self._collect()
        self._connect()
        bodies, waiting = list[tuple[Statement, ...]](), set[int]()
        for statements in self.items:
            body, left = self._ordered(statements)
            bodies.append(body)
            waiting.update(i for s in left if isinstance(s, Branch) for i in s.selects)
        takes = {statement: frozenset(values) for statement, values in self.takes.items()}
        return Plan(self.placed, self.locals, tuple(bodies), takes, self.uses), waiting

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
                    inner = found.inside[branch.region, branch.label, side]
                    self.items[inner].append(Side(i, side))
        for k, row in enumerate(found.source.results):
            self.items[0].extend(Store(k, j) for j in range(len(row)))

    def _connect(self) -> None:
        """What every statement takes."""
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
        """`statement` of a region writes out node `i`, or its name."""
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
        early = [s for s in statements if s not in self.late]
        takes = [self.takes[s] for s in early]
        makes = [_made(s) for s in early]
        order = ordered(takes, makes)
        body = [early[k] for k in order]
        body += [s for s in statements if s in self.late]
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
    """How often each node is written out."""
    uses: Counter[int] = Counter()
    for i, times in _written(found):
        uses[i] += times
    return uses


def _locals(found: Placed, uses: Counter[int]) -> frozenset[int]:
    """What is shared, or too long to be read inside a formula."""
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
