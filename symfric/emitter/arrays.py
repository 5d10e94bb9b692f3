"""C99 statements for a graph whose isomorphic parts become loops over arrays.

    const float u1 = ...;                      straight part: values that the loop needs
    float sum1 = 0.5f * v;
    for (int i = 0; i < 10; i++) {
        const float F_i = state->F[i];
        ...
        state->F[i] = ...;
        sum1 += ...;
    }
    out->F = sum1;                             straight part: values that need the loop

Each part is a separate graph, which `emit` writes. The operations of an element and the order in
which elements are added are those of CasADi, so double precision gives the same bits. Without
arrays or repetitions, the text is that of `emit`.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from re import fullmatch, sub
from typing import NamedTuple

import casadi as ca

from symfric.emitter.c99 import Real
from symfric.emitter.emit import INDENT, Code, emit
from symfric.emitter.logic import settled, simplified
from symfric.emitter.rolling import OUTER, READ, TABLE, TRUTH, Arrays, StoredRows, is_truth
from symfric.emitter.segments import ElementLoop, LoopPlan, planned
from symfric.foundation.graph import LEAVES, Graph, Node, pruned

Places = Mapping[tuple[int, int], str]


def looped(source: Graph, arrays: Arrays) -> set[str]:
    """Return the texts of the arrays that loops would read or write."""
    loops = planned(_better(source), arrays).loops
    reads = {array.text for loop in loops for array, _ in loop.body.reads}
    return reads | {store.array.text for loop in loops for store in loop.stores}


def emit_rolled(
    source: Graph,
    names: Sequence[Sequence[str]],
    targets: Sequence[Sequence[str]],
    real: Real,
    arrays: Arrays,
    loads: Places,
) -> Code:
    """Write `source` as C statements with loops over `arrays`.

    Args:
        source, names, targets, real, loads: arguments of `emit`. A place in `loads` that several
            parts use, or that a loop overwrites, is loaded first.
        arrays: rows that loops may index; an argument and a result with the same text share memory,
            all others must not overlap.

    Raises:
        ValueError: errors of `emit`.
    """
    plan = planned(_better(source), arrays)
    if plan.loops:
        return _Rolled(plan, names, targets, real, arrays, loads).code()
    return emit(source, names, targets, real, loads=loads)


def _better(source: Graph) -> Graph:
    """Return the graph that `emit` writes; parts that differ only by a known guard are equal."""
    return settled(simplified(source))


class _StraightPart(NamedTuple):
    """Straight part of a plan.

    Attributes:
        kept: operations of the part.
        into: nodes that the part takes from earlier parts and from sums.
        inputs: (argument, row) of the inputs that the part uses.
        rows: rows of every result that the part writes.
        results: nodes of these rows.
    """

    number: int
    kept: list[int]
    into: list[int]
    inputs: list[tuple[int, int]]
    rows: list[list[int]]
    results: list[list[int]]


def _part(plan: LoopPlan, number: int) -> _StraightPart:
    nodes = plan.source.nodes
    kept = [i for i, part in plan.part.items() if part == number]
    rows = [
        [k for k in range(len(row)) if number == plan.last and (g, k) not in plan.stored]
        for g, row in enumerate(plan.source.results)
    ]
    results = [[plan.source.results[g][k] for k in of] for g, of in enumerate(rows)]
    needed = {k for i in kept for k in nodes[i].args} | {i for row in results for i in row}
    needed = sorted(needed.union(start for _, start in plan.started(number)) - set(kept))
    into = [i for i in needed if nodes[i].op not in LEAVES]
    inputs = [nodes[i].entry for i in needed if nodes[i].op == ca.OP_INPUT]
    return _StraightPart(number, kept, into, inputs, rows, results)


@dataclass
class _Rolled:
    """Writer of a plan with loops, for the arguments of `emit_rolled`."""

    plan: LoopPlan
    names: Sequence[Sequence[str]]
    targets: Sequence[Sequence[str]]
    real: Real
    arrays: Arrays
    loads: Places

    def __post_init__(self) -> None:
        plan, names, arrays, loads = self.plan, self.names, self.arrays, self.loads
        self.source = plan.source
        self.taken = {name for row in names for name in row}
        self.index = self.free("i")
        self.parts = [_part(plan, number) for number in range(plan.last + 1)]
        outside = [i for loop in plan.loops for i in loop.body.taken]
        self.carried = {i for part in self.parts for i in part.into if i not in plan.totals}
        self.carried |= plan.part.keys() & outside
        self.local = {i: self.free(f"u{k}") for k, i in enumerate(sorted(self.carried), 1)}
        self.local |= {i: self.free(f"sum{k}") for k, i in enumerate(sorted(plan.totals), 1)}
        uses = Counter(entry for part in self.parts for entry in part.inputs)
        for node in (self.source.nodes[i] for i in outside):
            if node.op == ca.OP_INPUT:
                uses[node.entry] += 2  # so that it is loaded once, before the loop
        written = {array.text for array in arrays.written}
        lost = [array for array in arrays.read if array.text in written]
        self.first = {
            entry: text
            for entry, text in loads.items()
            if uses[entry] > 1 or (uses[entry] and any(a.holds(entry) for a in lost))
        }
        self.loads = {entry: text for entry, text in loads.items() if entry not in self.first}
        self.used = {*uses} | {
            (array.group, array.first + offset + i)
            for loop in plan.loops
            for array, offset in loop.body.reads
            for i in range(loop.size)
        }
        self.tables: dict[tuple[float, ...], str] = {}
        self.calls, self.operations = Counter[str](), 0

    def free(self, name: str) -> str:
        """Return an unused name that begins with `name`, and reserve it."""
        while name in self.taken:
            name += "_"
        self.taken.add(name)
        return name

    def code(self) -> Code:
        """Return all statements."""
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
        lines = (*tables, *lines)
        return Code(frozenset(self.used), lines, self.calls, self.operations)

    def _counted(self, code: Code, times: int = 1) -> tuple[str, ...]:
        """Return the lines of a part; count its operations, which are executed `times` times."""
        self.calls.update({call: times * count for call, count in code.calls.items()})
        self.operations += times * code.operations
        return code.lines

    def _split(self, nodes: Sequence[int]) -> list[list[int]]:
        """Return the numbers and the conditions among `nodes`."""
        return [[i for i in nodes if is_truth(self.source, i) == truth] for truth in (False, True)]

    def _straight(self, part: _StraightPart) -> Iterator[str]:
        """Return the lines of a straight part."""
        into, starts = self._split(part.into), self.plan.started(part.number)
        made = self._split([i for i in part.kept if i in self.carried])
        new = [[self.local[i] for i in group] for group in (*made, [i for i, _ in starts])]
        entries = {
            i: (len(self.names) + g, row) for g, of in enumerate(into) for row, i in enumerate(of)
        }
        nodes = [
            Node(ca.OP_INPUT, entry=entries[i]) if i in entries else node
            for i, node in enumerate(self.source.nodes)
        ]
        results = [*part.results, *made, [start for _, start in starts]]
        targets = [[self.targets[g][k] for k in rows] for g, rows in enumerate(part.rows)]
        code = emit(
            pruned(nodes, [tuple(row) for row in results]),
            [*self.names, *([self.local[i] for i in group] for group in into)],
            [*targets, *([f"{name} = {{}};" for name in group] for group in new)],
            self.real,
            loads=self.loads,
            stem="t" if part.number == 0 else f"t{part.number}_",
            conditions=(len(self.names) + 1,),
            truths=(len(targets) + 1,),
        )
        kinds = (f"const {self.real.name}", "const bool", self.real.name)
        waiting = {name: kind for kind, group in zip(kinds, new, strict=True) for name in group}
        return _declared(self._counted(code), waiting)

    def _loop(self, loop: ElementLoop) -> list[str]:
        """Return the lines of a loop."""
        body, i = loop.body, self.index
        reads: dict[str, str] = {}
        for array, offset in body.reads:
            name = f"{sub(r'.*[>.]', '', array.text)}_{i}{offset or ''}"
            while name in self.taken or name in reads:
                name += "_"
            reads[name] = f"{array.text}[{self._at(offset)}]"
        for values in body.tables:
            if values not in self.tables:
                self.tables[values] = self.free(f"c{len(self.tables) + 1}")
        tables = {f"{c}_{i}": f"{c}[{i}]" for c in (self.tables[values] for values in body.tables)}
        names = {
            OUTER: [self._outer(k) for k in body.outer],
            TRUTH: [self._outer(k) for k in body.truths],
            READ: [*reads],
            TABLE: [*tables],
        }
        loads = {(READ, k): place for k, place in enumerate(reads.values())}
        loads |= {(TABLE, k): place for k, place in enumerate(tables.values())}
        code = emit(
            body.graph,
            [names[k] for k in sorted(names)],
            [
                [self._stored(store) for store in loop.stores],
                [f"{self.local[s.total]} += {{}};" for s in loop.sums],
            ],
            self.real,
            loads=loads,
            stem="e",
            conditions=(TRUTH,),
        )
        zero = f"-{self.real.literal(0.0)}; /* adds nothing, not even to -0 */"
        return [
            *(f"{self.real.name} {self.local[s.total]} = {zero}"
              for s in loop.sums if s.start is None),
            f"for (int {i} = 0; {i} < {loop.size}; {i}++) {{",
            *(INDENT + line for line in self._counted(code, loop.size)),
            "}",
        ]  # fmt: skip

    def _outer(self, i: int) -> str:
        node = self.source.nodes[i]
        if node.op == ca.OP_INPUT:
            return self.names[node.entry[0]][node.entry[1]]
        return self.local[i]

    def _stored(self, store: StoredRows) -> str:
        return f"{store.array.text}[{self._at(store.offset)}] = {{}};"

    def _at(self, offset: int) -> str:
        return f"{self.index}+{offset}" if offset else self.index


def _declared(lines: Sequence[str], waiting: Mapping[str, str]) -> Iterator[str]:
    """Yield the lines with a declaration of each name, at its only assignment or before all lines.

    If a name only copies a local, the local is renamed to it.

    Args:
        waiting: type of each name to declare.
    """
    once = {name for name in waiting if any(line.startswith(f"{name} = ") for line in lines)}
    called: dict[str, str] = {}
    for line in lines:
        copy = fullmatch(r"(\w+) = (\w+);", line)
        if copy and copy[1] in once and waiting[copy[1]].startswith("const "):
            kind, local = waiting[copy[1]], copy[2]
            if any(other.startswith(f"{kind} {local} = ") for other in lines):
                called.setdefault(local, copy[1])
    for name, kind in waiting.items():
        if name not in once:
            yield f"{kind.removeprefix('const ')} {name};"
    for line in lines:
        name, _, value = line.partition(" = ")
        if called.get(value.removesuffix(";")) == name:
            continue
        shown = sub(r"\w+", lambda word: called.get(word[0], word[0]), line)
        yield f"{waiting[name]} {shown}" if name in once else shown
