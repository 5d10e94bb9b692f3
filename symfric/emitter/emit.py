"""C99 statements for the graph of a CasADi function.

A shared value becomes a constant local before its first use; a value that is used once is written
inside the formula that uses it, so that formulas remain recognisable. Operations that only one side
of a select needs are in a branch, see `branches`; selects with cheap sides become `?:`. The
operations in a formula have CasADi's order, so double precision gives the same bits (for NaN and
the sign of zero, see `logic`).
"""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from re import fullmatch
from typing import final

import casadi as ca

from symfric.emitter.c99 import FORMS, FUNCTIONS, Formulas, Real, Writer, operation_name
from symfric.emitter.logic import LOWERED, logical, settled, simplified
from symfric.emitter.statements import (
    IfStatement,
    LocalConstant,
    Side,
    Statement,
    Stores,
    StoreStatement,
    planned,
)
from symfric.foundation.graph import LEAVES, Graph

INDENT = "    "


@dataclass(frozen=True)
class Code:
    """Statements of a function body.

    Attributes:
        used: (argument, row) of the inputs that occur.
        lines: lines of C; statements inside a branch are indented by four blanks.
        calls: function of math.h (name for double) -> number of calls, in all branches.
        operations: number of operations, including calls, in all branches.
    """

    used: frozenset[tuple[int, int]]
    lines: tuple[str, ...]
    calls: Counter[str]
    operations: int


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

    Results are written as soon as they are known. Therefore an argument and a result may share
    memory only if the place of the argument in `loads` has the text of the result; it is then read
    first. An argument named by an identifier is a local variable. If a used argument has another
    name (`a[3]`), all results are written after the last read.

    Args:
        source: graph of the function.
        names: C names of the rows of each argument.
        targets: pattern for every row of every result, such as "state->z = {};".
        real: floating-point type.
        loads: (argument, row) -> text of a place, such as "state->z", whose value is loaded into a
            local with the name in `names` before its first use.
        stem: first letters of the names of locals.
        conditions: arguments that are bools in C.
        truths: results that are bools in C.

    Raises:
        ValueError: operations without counterpart in C99 (the message names them all), or constants
            outside the range of the type.
    """
    unsupported = {node.op for node in source.nodes} - LEAVES - LOWERED - {*FORMS} - {*FUNCTIONS}
    if unsupported:
        got = ", ".join(sorted(map(operation_name, unsupported)))
        raise ValueError(f"codegen: expected operations that C99 has, got {got}")
    better = settled(simplified(source, conditions, truths))
    bools = logical(better.nodes, conditions)
    write = Writer(better, bools, real)
    body = StatementWriter(better, names, targets, write, loads or {}, stem, truths)
    lines = tuple(body.region(0))
    calls = Counter(FUNCTIONS[node.op] for node in better.nodes if node.op in FUNCTIONS)
    return Code(frozenset(body.used), lines, calls, better.operations)


@final
@dataclass
class StatementWriter:
    """Writer of the statements of a simplified graph, for the arguments of `emit`.

    Attributes:
        writer: writer of the formulas.
        used: (argument, row) of the inputs that occur.
        waiting: places of the inputs that are still to be loaded, by node.
    """

    source: Graph
    names: Sequence[Sequence[str]]
    targets: Sequence[Sequence[str]]
    writer: Formulas
    loads: Mapping[tuple[int, int], str]
    stem: str = "t"
    truths: Collection[int] = ()

    def __post_init__(self) -> None:
        self.real = self.writer.real
        self.plan = planned(self.source, self.writer.logical, self._stores())
        while any(fullmatch(self.stem + r"\d+", name) for row in self.names for name in row):
            self.stem += "_"
        self.count = 0
        taken = sorted({i for values in self.plan.takes.values() for i in values})
        nodes = self.source.nodes
        entries = {i: nodes[i].entry for i in taken if nodes[i].op == ca.OP_INPUT}
        self.used = set(entries.values())
        self.writer.names |= {i: self.names[k][row] for i, (k, row) in entries.items()}
        self.waiting = {i: self.loads[e] for i, e in entries.items() if e in self.loads}

    def _stores(self) -> Stores:
        """Return the rules for writing results, see `emit`."""
        nodes, loads = enumerate(self.source.nodes), self.loads
        inputs = {node.entry: i for i, node in nodes if node.op == ca.OP_INPUT}
        patterns = {
            StoreStatement(k, j): text
            for k, row in enumerate(self.targets)
            for j, text in enumerate(row)
        }
        shared = [self.names[i][j] for i, j in inputs if (i, j) not in loads]
        late = any(text.startswith("return") for text in patterns.values())
        assigned = {f"{loads[entry]} = {{}};": i for entry, i in inputs.items() if entry in loads}
        return Stores(
            late or not all(fullmatch(r"\w+", name) for name in shared),
            frozenset(
                store
                for store, text in patterns.items()
                if fullmatch(r"\S+ \+?= \{\};", text) and store.result not in self.truths
            ),
            {store: assigned[text] for store, text in patterns.items() if text in assigned},
        )

    def region(self, number: int) -> list[str]:
        """Return the lines of a region."""
        lines: list[str] = []
        for statement in self.plan.bodies[number]:
            for i in self._loaded(number, statement):
                place = self.waiting.pop(i)
                words = self.real.declared(constant=True)
                lines.append(f"{words} {self.writer.names[i]} = {place};")
            lines += self.statement(statement)
        return lines

    def _loaded(self, number: int, statement: Statement) -> list[int]:
        """Return the nodes that must be loaded before a statement of a region."""
        places, taken = self.plan.placed.place, self.plan.takes[statement]
        stores: list[object] = [statement]
        if isinstance(statement, IfStatement):
            stores = [self.plan.goals.get(i) for i in statement.selects]
        written = {
            self.targets[store.result][store.row].partition(" ")[0]
            for store in stores
            if isinstance(store, StoreStatement)
        }
        return sorted(
            i
            for i, text in self.waiting.items()
            if text in written or (i in taken and places[i] == number)
        )

    def statement(self, statement: Statement) -> list[str]:
        """Return the lines of a statement."""
        nodes, write = self.source.nodes, self.writer
        match statement:
            case LocalConstant(node):
                text = write.expression(node).text
                words = self.real.declared(write.logical[node], constant=True)
                return [f"{words} {self._name(node)} = {text};"]
            case IfStatement():
                return self._branch(statement)
            case Side(select, side):
                value, goal = nodes[select].args[side], self._goal(select)
                if isinstance(goal, StoreStatement):
                    return [self._stored(goal, value)]
                shown = (write.expression if write.logical[goal] else write.number)(value)
                return [f"{write.names[goal]} = {shown.text};"]
            case StoreStatement(result, row):
                return [self._stored(statement, self.source.results[result][row])]

    def _goal(self, select: int) -> int | StoreStatement:
        """Return the result that a select is written to, or the select whose variable it shares."""
        goal = self.plan.goals.get(select, select)
        return goal if goal == select or isinstance(goal, StoreStatement) else self._goal(goal)

    def _stored(self, store: StoreStatement, value: int) -> str:
        shown = (self.writer.truth if store.result in self.truths else self.writer.number)(value)
        return self.targets[store.result][store.row].format(shown.text)

    def _branch(self, branch: IfStatement) -> list[str]:
        placed, write = self.plan.placed, self.writer
        own = [i for i in branch.selects if i not in self.plan.goals]
        lines = [f"{self.real.declared(write.logical[i])} {self._name(i)};" for i in own]
        condition = placed.source.nodes[branch.selects[0]].args[0]
        yes, no = (self.region(placed.inside[branch.region, branch.label, side]) for side in (1, 2))
        inner_yes, inner_no = ([INDENT + line for line in side] for side in (yes, no))
        if not yes:
            return [*lines, f"if ({write.negation(condition).text}) {{", *inner_no, "}"]
        lines += [f"if ({write.expression(condition).text}) {{", *inner_yes]
        if not no:
            return [*lines, "}"]
        inside = all(line.startswith((INDENT, "} else")) for line in no[1:-1])
        if no[0].startswith("if (") and no[-1] == "}" and inside:
            return [*lines, f"}} else {no[0]}", *no[1:]]
        return [*lines, "} else {", *inner_no, "}"]

    def _name(self, i: int) -> str:
        """Return a new name for the local of a node, and record it."""
        self.count += 1
        self.writer.names[i] = f"{self.stem}{self.count}"
        return self.writer.names[i]
