"""C99 statements for a graph whose alike parts become loops over arrays.

    const float u1 = ...;                      straight part: what the loop needs
    float sum1 = 0.5f * v;
    for (int i = 0; i < 10; i++) {
        const float F_i = state->F[i];
        ...
        state->F[i] = ...;
        sum1 += ...;
    }
    out->F = sum1;                             straight part: what needs the loop

Every part is a graph of its own and written by `emit`. An element's operations and the order in
which elements are added are those of CasADi, so that double precision gives the same bits. Without
arrays, or where nothing repeats, the text is that of `emit`.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from re import fullmatch, sub
from typing import final

import casadi as ca

from symfric.emitter.c99 import Real
from symfric.emitter.emit import Code, emit
from symfric.emitter.logic import settled, simplified
from symfric.emitter.rolling import OUTER, READ, TABLE, TRUTH, Array, is_truth
from symfric.emitter.segments import Loop, Plan, planned
from symfric.foundation.graph import LEAVES, Graph, Node

INDENT = "    "

Places = Mapping[tuple[int, int], str]


@final
@dataclass(frozen=True)
class Arrays:
    """Rows that C can index: of arguments, which are `read`, and of results, `written`."""

    read: tuple[Array, ...] = ()
    written: tuple[Array, ...] = ()

    def used(self, source: Graph) -> "Arrays":
        """Return the nodes that a loop would read or write."""
        loops = planned(_better(source), self.read, self.written).loops
        reads = {entry for loop in loops for entry in loop.body.reads}
        stores = {(s.group, s.first) for loop in loops for s in loop.stores}
        return Arrays(
            tuple(a for a in self.read if any(a.holds(*entry) for entry in reads)),
            tuple(a for a in self.written if any(a.holds(*entry) for entry in stores)),
        )


def emit_rolled(
    source: Graph,
    names: Sequence[Sequence[str]],
    targets: Sequence[Sequence[str]],
    real: Real,
    arrays: Arrays,
    loads: Places | None = None,
) -> Code:
    """Write `source` as C statements with loops over `arrays`.

    Args:
        source, names, targets, real, loads: as for `emit`. What stands in `loads` and is used in
            several parts, or would be overwritten by a loop, is loaded first.
        arrays: rows that loops may index; an argument and a result with the same text are the same
            memory, all others must not overlap.

    Raises:
        ValueError: as `emit`.
    """
    if not (arrays.read or arrays.written):
        return emit(source, names, targets, real, loads=loads)
    plan = planned(_better(source), arrays.read, arrays.written)
    if not plan.loops:
        return emit(source, names, targets, real, loads=loads)
    return _Rolled(plan, names, targets, real, arrays, loads or {}).code()


def _better(source: Graph) -> Graph:
    """Return the graph as `emit` writes it: parts that differ by a known guard only are equal."""
    return settled(simplified(source))


class _Rolled:
    """Writes a plan with loops."""

    def __init__(
        self,
        plan: Plan,
        names: Sequence[Sequence[str]],
        targets: Sequence[Sequence[str]],
        real: Real,
        arrays: Arrays,
        loads: Places,
    ) -> None:
        self.plan, self.source, self.real = plan, plan.source, real
        self.names, self.targets, self.arrays = names, targets, arrays
        self.taken = {name for row in names for name in row}
        self.index = self.free("i")
        self.parts = [_Part(plan, number) for number in range(plan.last + 1)]
        self.carried = {i for part in self.parts for i in part.into if i not in plan.totals}
        self.carried |= {
            i
            for loop in plan.loops
            for i in (*loop.body.outer, *loop.body.truths)
            if i in plan.part
        }
        self.local = {i: self.free(f"u{k}") for k, i in enumerate(sorted(self.carried), 1)}
        for k, i in enumerate(sorted(plan.totals), 1):
            self.local[i] = self.free(f"sum{k}")
        self.first = self._loaded_first(loads)
        self.loads = {e: text for e, text in loads.items() if e not in self.first}
        self.tables: dict[tuple[float, ...], str] = {}
        self.calls, self.operations, self.outside = Counter[str](), 0, 0

    def free(self, name: str) -> str:
        """Return a name that nothing else has."""
        while name in self.taken:
            name += "_"
        self.taken.add(name)
        return name

    def _uses(self) -> Counter[tuple[int, int]]:
        """Number of straight parts that use a row of an argument; a loop counts as two."""
        uses = Counter(entry for part in self.parts for entry in part.inputs)
        for loop in self.plan.loops:
            for i in (*loop.body.outer, *loop.body.truths):
                if self.source.nodes[i].op == ca.OP_INPUT:
                    uses[self.source.nodes[i].entry] += 2
        return uses

    def _in_loops(self) -> Iterator[tuple[int, int]]:
        """Return the rows that loops read."""
        for loop in self.plan.loops:
            for group, row in loop.body.reads:
                yield from ((group, row + i) for i in range(loop.size))

    def _loaded_first(self, loads: Places) -> dict[tuple[int, int], str]:
        """Places that several parts need, or a loop from outside, or that a loop overwrites."""
        written = {array.text for array in self.arrays.written}
        lost = [array for array in self.arrays.read if array.text in written]
        uses = self._uses()
        return {
            entry: text
            for entry, text in loads.items()
            if uses[entry] > 1 or (uses[entry] and any(a.holds(*entry) for a in lost))
        }

    def code(self) -> Code:
        """All statements."""
        lines = [
            f"const {self.real.name} {self.names[a][row]} = {text};"
            for (a, row), text in sorted(self.first.items())
        ]
        for part in self.parts:
            lines += self._straight(part)
            for loop in self.plan.loops:
                if loop.stage == part.number + 1:
                    lines += self._loop(loop)
        tables = [
            f"static const {self.real.name} {name}[{len(values)}] = "
            f"{{{', '.join(map(self.real.literal, values))}}};"
            for values, name in self.tables.items()
        ]
        used = frozenset({*self._uses(), *self._in_loops()})
        return Code(used, (*tables, *lines), self.calls, self.operations, self.outside)

    def _counted(self, code: Code, times: int = 1) -> tuple[str, ...]:
        """Return the lines of a part that is executed so often."""
        self.calls.update({call: times * count for call, count in code.calls.items()})
        self.operations += times * code.operations
        self.outside += times * code.outside
        return code.lines

    def _straight(self, part: "_Part") -> list[str]:
        """Return the lines of a straight part."""
        numbers = [i for i in part.kept if i in self.carried and not self._truth(i)]
        truths = [i for i in part.kept if i in self.carried and self._truth(i)]
        starts = [
            (self.local[s.total], s.start)
            for loop in self.plan.loops
            if loop.stage == part.number + 1
            for s in loop.sums
            if s.start is not None
        ]
        arguments = len(self.names)
        results = [*(list(row) for row in part.results), numbers, truths, [i for _, i in starts]]
        graph, into = part.graph(results, arguments, self._truth)
        targets = [[self.targets[g][k] for k in rows] for g, rows in enumerate(part.rows)]
        made = [*([self.local[i] for i in group] for group in (numbers, truths))]
        made.append([name for name, _ in starts])
        code = emit(
            graph,
            [*self.names, *([self.local[i] for i in group] for group in into)],
            [*targets, *([f"{name} = {{}};" for name in group] for group in made)],
            self.real,
            loads=self.loads,
            stem="t" if part.number == 0 else f"t{part.number}_",
            conditions=(arguments + 1,),
            truths=(len(targets) + 1,),
        )
        kinds = [f"const {self.real.name}", "const bool", self.real.name]
        declared = [(kind, name) for kind, group in zip(kinds, made, strict=True) for name in group]
        return list(_declared(self._counted(code), declared))

    def _truth(self, i: int) -> bool:
        return is_truth(self.source, i)

    def _loop(self, loop: Loop) -> list[str]:
        """Return the lines of a loop."""
        body, i = loop.body, self.index
        taken = set[str]()
        reads = [self._read(*entry, taken) for entry in body.reads]
        tables = [self._table(values) for values in body.tables]
        loads = {(READ, k): place for k, (_, place) in enumerate(reads)}
        loads |= {(TABLE, k): f"{table}[{i}]" for k, table in enumerate(tables)}
        names = {
            OUTER: [self._outer(k) for k in body.outer],
            TRUTH: [self._outer(k) for k in body.truths],
            READ: [name for name, _ in reads],
            TABLE: [f"{table}_{i}" for table in tables],
        }
        stored = [self._written(store.group, store.first) for store in loop.stores]
        added = [f"{self.local[s.total]} += {{}};" for s in loop.sums]
        code = emit(
            body.graph,
            [names[k] for k in sorted(names)],
            [stored, added],
            self.real,
            loads=loads,
            stem="e",
            conditions=(TRUTH,),
        )
        zero = f"-{self.real.literal(0.0)}; /* adds nothing, not even to -0 */"
        starts = [
            f"{self.real.name} {self.local[s.total]} = {zero}" for s in loop.sums if s.start is None
        ]
        return [
            *starts,
            f"for (int {i} = 0; {i} < {loop.size}; {i}++) {{",
            *(INDENT + line for line in self._counted(code, loop.size)),
            "}",
        ]

    def _outer(self, i: int) -> str:
        node = self.source.nodes[i]
        if node.op == ca.OP_INPUT:
            return self.names[node.entry[0]][node.entry[1]]
        return self.local[i]

    def _read(self, group: int, row: int, taken: set[str]) -> tuple[str, str]:
        """Local, with a name that is not `taken`, and place of a row that a loop reads."""
        array = next(a for a in self.arrays.read if a.holds(group, row))
        offset = row - array.first
        name = f"{sub(r'.*[>.]', '', array.text)}_{self.index}{offset or ''}"
        while name in self.taken or name in taken:
            name += "_"
        taken.add(name)
        return name, f"{array.text}[{self._at(offset)}]"

    def _written(self, group: int, row: int) -> str:
        array = next(a for a in self.arrays.written if a.holds(group, row))
        return f"{array.text}[{self._at(row - array.first)}] = {{}};"

    def _at(self, offset: int) -> str:
        return f"{self.index}+{offset}" if offset else self.index

    def _table(self, values: tuple[float, ...]) -> str:
        if values not in self.tables:
            self.tables[values] = self.free(f"c{len(self.tables) + 1}")
        return self.tables[values]


def _declared(lines: Sequence[str], made: Sequence[tuple[str, str]]) -> Iterator[str]:
    """Return the lines with a declaration of every name, where it is given its value or before.

    A local that only another name is given to has that name.
    """
    waiting = {name: kind for kind, name in made}
    once = {name for name in waiting if any(line.startswith(f"{name} = ") for line in lines)}
    called: dict[str, str] = {}
    for line in lines:
        copy = fullmatch(r"(\w+) = (\w+);", line)
        if copy and copy[1] in once and waiting[copy[1]].startswith("const "):
            kind, local = waiting[copy[1]], copy[2]
            if any(other.startswith(f"{kind} {local} = ") for other in lines):
                called.setdefault(local, copy[1])
    yield from (
        f"{kind.removeprefix('const ')} {name};"
        for name, kind in waiting.items()
        if name not in once
    )
    for line in lines:
        name, _, value = line.partition(" = ")
        if called.get(value.removesuffix(";")) == name:
            continue
        shown = sub(r"\w+", lambda word: called.get(word[0], word[0]), line)
        yield f"{waiting[name]} {shown}" if name in once else shown


@final
class _Part:
    """One straight part of a plan.

    Attributes:
        kept: the operations in it.
        into: what it takes from earlier parts and from sums.
        inputs: (argument, row) that it uses.
        rows: of every result, the rows that it writes; `results` are their nodes.
    """

    def __init__(self, plan: Plan, number: int) -> None:
        source = plan.source
        self.source, self.number = source, number
        self.kept = [i for i, part in plan.part.items() if part == number]
        last, stored = number == plan.last, plan.stored
        self.rows = [
            [k for k in range(len(row)) if last and (g, k) not in stored]
            for g, row in enumerate(source.results)
        ]
        self.results = [[source.results[g][k] for k in rows] for g, rows in enumerate(self.rows)]
        starts = [
            s.start
            for loop in plan.loops
            if loop.stage == number + 1
            for s in loop.sums
            if s.start is not None
        ]
        asked = {k for i in self.kept for k in source.nodes[i].args}
        asked |= {i for row in self.results for i in row} | set(starts)
        leaves = {i for i in asked if source.nodes[i].op in LEAVES}
        self.into = sorted(asked - set(self.kept) - leaves)
        self.leaves = sorted(leaves)
        self.inputs = [
            source.nodes[i].entry for i in self.leaves if source.nodes[i].op == ca.OP_INPUT
        ]

    def graph(
        self, results: Sequence[Sequence[int]], arguments: int, truth: Callable[[int], bool]
    ) -> tuple[Graph, list[list[int]]]:
        """Return the part as a graph; what it takes are the arguments behind the `arguments` own
        ones.

        Returns:
            The graph, and the nodes behind the rows of the two further arguments: numbers, bools.
        """
        into = [[i for i in self.into if not truth(i)], [i for i in self.into if truth(i)]]
        entry = {
            i: (arguments + group, row)
            for group, rows in enumerate(into)
            for row, i in enumerate(rows)
        }
        number: dict[int, int] = {}
        nodes: list[Node] = []
        for i in sorted({*self.leaves, *self.into, *self.kept}):
            node = self.source.nodes[i]
            if i in entry:
                node = Node(ca.OP_INPUT, entry=entry[i])
            elif node.op not in LEAVES:
                node = replace(node, args=tuple(number[k] for k in node.args))
            number[i] = len(nodes)
            nodes.append(node)
        made = tuple(tuple(number[i] for i in row) for row in results)
        return Graph(tuple(nodes), made), into
