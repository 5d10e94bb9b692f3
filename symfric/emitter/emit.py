"""C99 statements for the graph of a CasADi function.

A shared value becomes a constant local, written where it is used first; a value that is used once
is written where it is used, so that formulas stay recognisable. What only one side of a select
needs stands in a branch, see `branches`; cheap sides stay `?:`. The order of the operations in a
formula is CasADi's, so that double precision gives the same bits (`logic` says what about NaN and
the sign of zero).
"""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from re import fullmatch

import casadi as ca

from symfric.emitter.c99 import FORMS, FUNCTIONS, Real, operation_name
from symfric.emitter.expressions import Writer
from symfric.emitter.known import settled
from symfric.emitter.logic import LOWERED, simplified
from symfric.emitter.statements import Branch, Local, Plan, Side, Statement, Store, planned
from symfric.foundation.graph import LEAVES, Graph

INDENT = "    "


@dataclass(frozen=True)
class Code:
    """Statements of a function body.

    Attributes:
        used: (argument, row) of the inputs that occur.
        lines: C, one statement a line; what is inside a branch is indented by four blanks.
        calls: function of math.h (double's name) -> number of calls, in all branches.
        operations: number of operations, calls included, in all branches.
        outside: of these, those outside of branches: they are done each time.
    """

    used: frozenset[tuple[int, int]]
    lines: tuple[str, ...]
    calls: Counter[str]
    operations: int
    outside: int


def emit(
    source: Graph,
    names: Sequence[Sequence[str]],
    targets: Sequence[Sequence[str]],
    real: Real,
    *,
    loads: Mapping[tuple[int, int], str] | None = None,
    stem: str = "t",
    conditions: Collection[int] = (),
    truths: Collection[int] = (),
) -> Code:
    """Write `source` as C statements.

    Results are written as soon as they are known, so that arguments and results may share memory
    only in these ways: what stands in `loads` is read before a result with the same text is
    written; what is named by an identifier is a local. Where an argument that is used has another
    name (`a[3]`) all results are written after the last read.

    Args:
        source: the graph of the function.
        names: the C identifiers that hold the rows of each argument.
        targets: a pattern for every row of every result, such as "state->z = {};".
        real: floating point type.
        loads: (argument, row) -> text of the places (such as "state->z") whose values are loaded
            into locals, with the name in `names`, where they are used first.
        stem: what the names of locals begin with.
        conditions: arguments that are bools of C and no numbers.
        truths: results that are wanted as bools of C.

    Raises:
        ValueError: operations that have no counterpart in C99, all by name, or constants that do
            not fit the type.
    """
    unsupported = {node.op for node in source.nodes} - LEAVES - LOWERED - {*FORMS} - {*FUNCTIONS}
    if unsupported:
        got = ", ".join(sorted(map(operation_name, unsupported)))
        raise ValueError(f"codegen: expected operations that C99 has, got {got}")
    better = settled(simplified(source, conditions, truths))
    used = frozenset(node.entry for node in better.nodes if node.op == ca.OP_INPUT)
    every = [pattern for row in targets for pattern in row]
    shared = [names[i][j] for i, j in used if (i, j) not in (loads or {})]
    locked = any(pattern.startswith("return") for pattern in every)
    locked = locked or not all(fullmatch(r"\w+", name) for name in shared)
    stores = [Store(k, j) for k, row in enumerate(targets) for j in range(len(row))]
    plan = planned(better, frozenset(stores if locked else ()))
    body = _Body(plan, names, targets, real, loads or {}, stem, conditions, truths, locked)
    lines = body.region(0)
    ops = [
        (node.op, plan.placed.place[i])
        for i, node in enumerate(plan.placed.source.nodes)
        if node.op not in LEAVES
    ]
    return Code(
        used,
        tuple(lines),
        Counter(FUNCTIONS[op] for op, _ in ops if op in FUNCTIONS),
        len(ops),
        sum(place == 0 for _, place in ops),
    )


class _Body:
    """Lines of a plan."""

    def __init__(
        self,
        plan: Plan,
        names: Sequence[Sequence[str]],
        targets: Sequence[Sequence[str]],
        real: Real,
        loads: Mapping[tuple[int, int], str],
        stem: str,
        conditions: Collection[int],
        truths: Collection[int],
        locked: bool,
    ) -> None:
        self.plan, self.targets, self.truths = plan, targets, truths
        self.stem, self.count = _free(stem, [name for row in names for name in row]), 0
        self.writer = Writer(plan.placed.source, real, conditions)
        self.real, self.locked = real, locked
        self.loads: dict[int, str] = {}
        for i, node in enumerate(plan.placed.source.nodes):
            if node.op == ca.OP_INPUT:
                argument, row = node.entry
                self.writer.names[i] = names[argument][row]
                if node.entry in loads:
                    self.loads[i] = loads[node.entry]
        self.direct: dict[int, str] = {}
        """Selects whose sides are written to a result at once: its pattern."""
        self.stored: set[Store] = set()
        self.given: dict[int, int] = {}
        """Selects that are a side of another one and nothing else: they share its variable."""

    def region(self, number: int) -> list[str]:
        """The lines of a region."""
        lines: list[str] = []
        body = self.plan.bodies[number]
        self._share(body)
        for statement in body:
            for i in self._loaded(number, statement):
                place = self.loads.pop(i)
                lines.append(f"const {self.real.name} {self.writer.names[i]} = {place};")
            lines += self.statement(statement)
        return lines

    def _loaded(self, number: int, statement: Statement) -> list[int]:
        """What has to be loaded before a statement of a region."""
        places = self.plan.placed.place
        wanted = [i for i in self.plan.takes[statement] if i in self.loads and places[i] == number]
        written = self._written(statement)
        wanted += [i for i, text in self.loads.items() if text in written and i not in wanted]
        return sorted(wanted)

    def _written(self, statement: Statement) -> set[str]:
        """Places that a statement writes to."""
        patterns: list[str] = []
        if isinstance(statement, Store):
            patterns = [self.targets[statement.result][statement.row]]
        elif isinstance(statement, Branch):
            patterns = [self.direct[i] for i in statement.selects if i in self.direct]
        return {pattern.partition(" ")[0] for pattern in patterns}

    def _share(self, body: Sequence[Statement]) -> None:
        """Find selects that need no variable of their own."""
        placed, uses = self.plan.placed, self.plan.uses
        branches = {i for s in body if isinstance(s, Branch) for i in s.selects}
        for statement in body:
            match statement:
                case Store(result, row) if not self.locked and result not in self.truths:
                    i, pattern = placed.source.results[result][row], self.targets[result][row]
                    if i in branches and uses[i] == 1 and fullmatch(r"\S+ \+?= \{\};", pattern):
                        self.direct[i] = pattern
                        self.stored.add(statement)
                case Side(select, side):
                    i = placed.source.nodes[select].args[side]
                    same = self.writer.logical[i] == self.writer.logical[select]
                    if i in branches and uses[i] == 1 and same:
                        self.given[i] = select
                case _:
                    pass

    def statement(self, statement: Statement) -> list[str]:
        """The lines of one."""
        placed, write = self.plan.placed, self.writer
        match statement:
            case Local(node):
                text = write.expression(node).text
                return [f"const {self._kind(node)} {self._name(node)} = {text};"]
            case Branch():
                return self._branch(statement)
            case Side(select, side):
                value = placed.source.nodes[select].args[side]
                if self.given.get(value) == select:
                    return []
                if select in self.direct:
                    return [self.direct[select].format(write.number(value).text)]
                logical = write.logical[select]
                shown = write.expression(value) if logical else write.number(value)
                return [f"{write.names[select]} = {shown.text};"]
            case Store(result, row):
                if statement in self.stored:
                    return []
                value = placed.source.results[result][row]
                shown = write.truth(value) if result in self.truths else write.number(value)
                return [self.targets[result][row].format(shown.text)]

    def _branch(self, branch: Branch) -> list[str]:
        placed, write = self.plan.placed, self.writer
        lines: list[str] = []
        for i in branch.selects:
            if i in self.given:
                outer = self.given[i]
                if outer in self.direct:
                    self.direct[i] = self.direct[outer]
                else:
                    write.names[i] = write.names[outer]
            elif i not in self.direct:
                lines.append(f"{self._kind(i)} {self._name(i)};")
        condition = write.expression(placed.source.nodes[branch.selects[0]].args[0]).text
        yes, no = (self.region(placed.inside[branch.region, branch.label, side]) for side in (1, 2))
        lines.append(f"if ({condition}) {{")
        lines += [INDENT + line for line in yes]
        if no and no[0].startswith("if (") and _is_one_block(no):
            return [*lines, f"}} else {no[0]}", *no[1:]]
        return [*lines, "} else {", *(INDENT + line for line in no), "}"]

    def _kind(self, i: int) -> str:
        return "bool" if self.writer.logical[i] else self.real.name

    def _name(self, i: int) -> str:
        """A new name for the local of a node."""
        self.count += 1
        self.writer.names[i] = f"{self.stem}{self.count}"
        return self.writer.names[i]


def _is_one_block(lines: Sequence[str]) -> bool:
    """Whether the lines are a single `if` with all that belongs to it."""
    inner = (line.startswith((INDENT, "} else")) for line in lines[1:-1])
    return lines[-1] == "}" and all(inner)


def _free(stem: str, names: Sequence[str]) -> str:
    """A beginning of the locals' names that no argument has."""
    while any(fullmatch(stem + r"\d+", name) for name in names):
        stem += "_"
    return stem
