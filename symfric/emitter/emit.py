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

from symfric.emitter.c99 import FORMS, FUNCTIONS, Real, Writer, operation_name
from symfric.emitter.logic import LOWERED, logical, settled, simplified
from symfric.emitter.statements import Branch, Local, Plan, Side, Statement, Store, Stores, planned
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
    bools = logical(better.nodes, conditions)
    stores = _stores(better, names, targets, loads or {}, truths)
    plan = planned(better, bools, stores)
    lines = _Body(plan, bools, names, targets, real, loads or {}, stem, truths).region(0)
    taken = {i for values in plan.takes.values() for i in values}
    nodes = enumerate(better.nodes)
    done = [(n.op, plan.placed.place[i] == 0) for i, n in nodes if n.op not in LEAVES]
    return Code(
        frozenset(better.nodes[i].entry for i in taken if better.nodes[i].op == ca.OP_INPUT),
        tuple(lines),
        Counter(FUNCTIONS[op] for op, _ in done if op in FUNCTIONS),
        len(done),
        sum(outside for _, outside in done),
    )


def _stores(
    source: Graph,
    names: Sequence[Sequence[str]],
    targets: Sequence[Sequence[str]],
    loads: Mapping[tuple[int, int], str],
    truths: Collection[int],
) -> Stores:
    """Rules for writing results, see `emit`."""
    inputs = {node.entry: i for i, node in enumerate(source.nodes) if node.op == ca.OP_INPUT}
    patterns = {Store(k, j): text for k, row in enumerate(targets) for j, text in enumerate(row)}
    shared = [names[i][j] for i, j in inputs if (i, j) not in loads]
    late = any(text.startswith("return") for text in patterns.values())
    places = {loads[entry]: i for entry, i in inputs.items() if entry in loads}
    return Stores(
        late or not all(fullmatch(r"\w+", name) for name in shared),
        frozenset(
            store
            for store, text in patterns.items()
            if fullmatch(r"\S+ \+?= \{\};", text) and store.result not in truths
        ),
        {
            store: places[_place(text)]
            for store, text in patterns.items()
            if text == f"{_place(text)} = {{}};" and _place(text) in places
        },
    )


def _place(pattern: str) -> str:
    """Place that a result is written to."""
    return pattern.partition(" ")[0]


class _Body:
    """Lines of a plan."""

    def __init__(
        self,
        plan: Plan,
        bools: Sequence[bool],
        names: Sequence[Sequence[str]],
        targets: Sequence[Sequence[str]],
        real: Real,
        loads: Mapping[tuple[int, int], str],
        stem: str,
        truths: Collection[int],
    ) -> None:
        self.plan, self.targets, self.truths, self.real = plan, targets, truths, real
        self.stem, self.count = _free(stem, [name for row in names for name in row]), 0
        self.writer = Writer(plan.placed.source, bools, real)
        self.loads: dict[int, str] = {}
        """Inputs that are still to be loaded, with their places."""
        taken = {i for values in plan.takes.values() for i in values}
        for i in sorted(taken):
            node = plan.placed.source.nodes[i]
            if node.op == ca.OP_INPUT:
                argument, row = node.entry
                self.writer.names[i] = names[argument][row]
                if node.entry in loads:
                    self.loads[i] = loads[node.entry]

    def region(self, number: int) -> list[str]:
        """Return the lines of a region."""
        lines: list[str] = []
        for statement in self.plan.bodies[number]:
            for i in self._loaded(number, statement):
                place = self.loads.pop(i)
                lines.append(f"const {self.real.name} {self.writer.names[i]} = {place};")
            lines += self.statement(statement)
        return lines

    def _loaded(self, number: int, statement: Statement) -> list[int]:
        """Nodes that have to be loaded before a statement of a region."""
        places, written = self.plan.placed.place, self._written(statement)
        taken = self.plan.takes[statement]
        wanted = [i for i in taken if i in self.loads and places[i] == number]
        return sorted({*wanted, *(i for i, text in self.loads.items() if text in written)})

    def _written(self, statement: Statement) -> set[str]:
        """Places that a statement writes to, what is inside it included."""
        match statement:
            case Store(result, row):
                return {_place(self.targets[result][row])}
            case Branch(selects=selects):
                goals = [self.plan.goals.get(i) for i in selects]
                stores = [goal for goal in goals if isinstance(goal, Store)]
                return {_place(self.targets[store.result][store.row]) for store in stores}
            case _:
                return set()

    def statement(self, statement: Statement) -> list[str]:
        """Return the lines of one."""
        nodes, write = self.plan.placed.source.nodes, self.writer
        match statement:
            case Local(node):
                text = write.expression(node).text
                return [f"const {self._kind(node)} {self._name(node)} = {text};"]
            case Branch():
                return self._branch(statement)
            case Side(select, side):
                value, goal = nodes[select].args[side], self._goal(select)
                if isinstance(goal, Store):
                    return [self._stored(goal, value)]
                shown = (write.expression if write.logical[goal] else write.number)(value)
                return [f"{write.names[goal]} = {shown.text};"]
            case Store(result, row):
                return [self._stored(statement, self.plan.placed.source.results[result][row])]

    def _goal(self, select: int) -> int | Store:
        """Return the result that a select becomes, or the select whose variable it shares."""
        goal = self.plan.goals.get(select)
        return select if goal is None else goal if isinstance(goal, Store) else self._goal(goal)

    def _stored(self, store: Store, value: int) -> str:
        shown = (self.writer.truth if store.result in self.truths else self.writer.number)(value)
        return self.targets[store.result][store.row].format(shown.text)

    def _branch(self, branch: Branch) -> list[str]:
        placed, write = self.plan.placed, self.writer
        own = [i for i in branch.selects if i not in self.plan.goals]
        lines = [f"{self._kind(i)} {self._name(i)};" for i in own]
        condition = placed.source.nodes[branch.selects[0]].args[0]
        yes, no = (self.region(placed.inside[branch.region, branch.label, side]) for side in (1, 2))
        if not yes:
            return [*lines, f"if ({write.negation(condition).text}) {{", *_indented(no), "}"]
        lines += [f"if ({write.expression(condition).text}) {{", *_indented(yes)]
        if not no:
            return [*lines, "}"]
        if no[0].startswith("if (") and _is_one_block(no):
            return [*lines, f"}} else {no[0]}", *no[1:]]
        return [*lines, "} else {", *_indented(no), "}"]

    def _kind(self, i: int) -> str:
        return "bool" if self.writer.logical[i] else self.real.name

    def _name(self, i: int) -> str:
        """Return a new name for the local of a node."""
        self.count += 1
        self.writer.names[i] = f"{self.stem}{self.count}"
        return self.writer.names[i]


def _indented(lines: Sequence[str]) -> list[str]:
    return [INDENT + line for line in lines]


def _is_one_block(lines: Sequence[str]) -> bool:
    """Return True if the lines are a single `if` with all that belongs to it."""
    inner = (line.startswith((INDENT, "} else")) for line in lines[1:-1])
    return lines[-1] == "}" and all(inner)


def _free(stem: str, names: Sequence[str]) -> str:
    """Return a beginning of the locals' names that no argument has."""
    while any(fullmatch(stem + r"\d+", name) for name in names):
        stem += "_"
    return stem
