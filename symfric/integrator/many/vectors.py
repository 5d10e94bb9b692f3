"""CasADi Functions as C on vectors: members of an ensemble in parallel, one per lane.

The C has the operations of the Function in the same order; `lanes.h` defines functions like exp.
"""

from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import final

import casadi as ca

from symfric.foundation.graph import LEAVES, SELECT, Graph, Node, graph

PART = 1000
"""Number of operations of one C function. For twice as many, compilers take more than twice as long
and keep fewer values in registers.
"""

MASKS = {ca.OP_LT: "<", ca.OP_LE: "<=", ca.OP_EQ: "==", ca.OP_NE: "!="}
"""Comparisons, whose results are masks."""
LOGIC = {ca.OP_AND: "{} & {}", ca.OP_OR: "{} | {}", ca.OP_NOT: "~{}"}
"""Operations on masks."""
PLAIN = {
    ca.OP_ADD: "{} + {}", ca.OP_SUB: "{} - {}", ca.OP_MUL: "{} * {}", ca.OP_DIV: "{} / {}",
    ca.OP_NEG: "-{}", ca.OP_SQ: "{0} * {0}", ca.OP_TWICE: "2. * {}", ca.OP_INV: "1. / {}",
}  # fmt: skip
"""Operators of C."""
CALLS = {
    ca.OP_SQRT: "sqrt", ca.OP_FABS: "fabs", ca.OP_SIGN: "sign", ca.OP_FMIN: "fmin",
    ca.OP_FMAX: "fmax", ca.OP_COPYSIGN: "copysign", ca.OP_FLOOR: "floor", ca.OP_CEIL: "ceil",
    ca.OP_EXP: "exp", ca.OP_EXPM1: "expm1", ca.OP_LOG: "log", ca.OP_LOG1P: "log1p",
    ca.OP_POW: "pow", ca.OP_CONSTPOW: "pow", ca.OP_TAN: "tan", ca.OP_ASIN: "asin",
    ca.OP_ACOS: "acos", ca.OP_ATAN: "atan", ca.OP_ATAN2: "atan2", ca.OP_SINH: "sinh",
    ca.OP_COSH: "cosh", ca.OP_TANH: "tanh", ca.OP_ASINH: "asinh", ca.OP_ACOSH: "acosh",
    ca.OP_ATANH: "atanh", ca.OP_ERF: "erf", ca.OP_HYPOT: "hypot", ca.OP_FMOD: "fmod",
    ca.OP_REMAINDER: "remainder",
}  # fmt: skip
"""Functions v_NAME of `lanes.h`."""


def c_text(name: str) -> str:
    """Return the text of a C file of this folder."""
    return Path(__file__).with_name(name).read_text(encoding="utf-8")


def lanes_header(lanes: int = 0) -> str:
    """Return the C of vectors with `lanes` lanes, by default as many as the processor supports."""
    text = c_text("lanes.h")
    return f"#define LANES {lanes}\n{text}" if lanes else text


def vector_source(name: str, function: ca.Function, groups: int = 1) -> tuple[str, int]:
    """Return the C function `name` for a Function of dense columns on vectors, and its work size.

    Its declaration is `static void name(const V *const *arg, V *const *res, V *w)`, with a pointer
    for every argument and result, and w for the returned number of vectors; results must not
    overlap arguments. With several groups, each group has three such parameters: while operations
    of one group wait for their operands, those of another group are executed.
    """
    whole = graph(function if function.is_a("SXFunction") else function.expand())
    parts = _Parts(whole, name, range(groups))
    text = "".join(parts.functions())
    handed = ", ".join(f"arg{g}, res{g}, w{g}" for g in range(groups))
    calls = "".join(f"  {part}({handed});\n" for part in parts.names)
    return f"{text}{_head(name, range(groups))}\n{{\n{calls}}}\n\n", parts.slots


def _head(name: str, groups: range) -> str:
    kinds = ("const V *const *restrict arg{}", "V *const *restrict res{}", "V *restrict w{}")
    taken = ", ".join(kind.format(g) for g in groups for kind in kinds)
    return f"static void {name}({taken})"


@final
class _Parts:
    """Graph divided into C functions; slots of w hold values that later functions need."""

    def __init__(self, whole: Graph, name: str, groups: range) -> None:
        self.whole, self.name, self.groups = whole, name, groups
        self.names: list[str] = []
        self.slots = 0
        made = [i for i, node in enumerate(whole.nodes) if node.op not in LEAVES]
        self.cuts = [made[k : k + PART] for k in range(0, len(made), PART)] or [[]]
        self.part = {i: k for k, part in enumerate(self.cuts) for i in part}
        self.last = dict[int, int]()
        for i in made:
            for j in whole.nodes[i].args:
                self.last[j] = self.part[i]
        self.results: list[list[tuple[str, int]]] = [[] for _ in self.cuts]
        for k, row in enumerate(whole.results):
            for place, i in enumerate(row):
                part = self.part.get(i, len(self.cuts) - 1)
                self.results[part].append((f"res@[{k}][{place}]", i))

    def functions(self) -> Iterator[str]:
        free, slot = deque[int](), dict[int, int]()
        for k, part in enumerate(self.cuts):
            self.names.append(f"{self.name}_{k}")
            body = _Body(self.whole.nodes, slot, set(part))
            for i in part:
                body.add(i)
            for place, i in self.results[k]:
                body.lines.append(f"{place} = {body.number(i)};")
            for i in [i for i in slot if self.last[i] == k]:
                free.append(slot.pop(i))
            for i in part:
                if self.last.get(i, k) > k:
                    if not free:
                        free.append(self.slots)
                        self.slots += 1
                    slot[i] = free.popleft()
                    body.lines.append(f"w@[{slot[i]}] = {body.number(i)};")
            each = (line.replace("@", str(g)) for line in body.lines for g in self.groups)
            lines = "".join(f"  {line}\n" for line in each)
            noinline = "" if len(self.cuts) == 1 else "__attribute__((noinline)) "
            yield f"{noinline}{_head(self.names[-1], self.groups)}\n{{\n{lines}}}\n\n"


@final
class _Body:
    """Lines of one C function; values are vectors v, comparisons are masks m, @ is the group."""

    def __init__(self, nodes: tuple[Node, ...], slot: dict[int, int], own: set[int]) -> None:
        self.nodes, self.slot, self.own = nodes, dict(slot), own
        self.lines: list[str] = []
        self.known: set[int] = set()
        self.angles: set[int] = set()

    def number(self, i: int) -> str:
        """Return the node i as a vector."""
        node = self.nodes[i]
        if node.op == ca.OP_CONST:
            return f"ALL({_literal(node.value)})"
        if i in self.own:
            return f"as_number(m{i}_@)" if _is_mask(node) else f"v{i}_@"
        if i not in self.known:
            self.known.add(i)
            place = (
                f"arg@[{node.entry[0]}][{node.entry[1]}]"
                if node.op == ca.OP_INPUT
                else f"w@[{self.slot[i]}]"
            )
            self.lines.append(f"const V v{i}_@ = {place};")
        return f"v{i}_@"

    def mask(self, i: int) -> str:
        """Return the node i as a mask, true where the node is nonzero."""
        if i in self.own and _is_mask(self.nodes[i]):
            return f"m{i}_@"
        return f"as_mask({self.number(i)})"

    def add(self, i: int) -> None:
        """Add the lines that compute the node i."""
        node = self.nodes[i]
        if node.op in MASKS:
            a, b = (self.number(j) for j in node.args)
            self.lines.append(f"const I m{i}_@ = (I)({a} {MASKS[node.op]} {b});")
        elif node.op in LOGIC:
            operands = [self.mask(j) for j in node.args]
            self.lines.append(f"const I m{i}_@ = {LOGIC[node.op].format(*operands)};")
        elif node.op in (ca.OP_SIN, ca.OP_COS):
            self.angle(node.args[0])
            self.lines.append(f"const V v{i}_@ = {'sc'[node.op == ca.OP_COS]}{node.args[0]}_@;")
        else:
            self.lines.append(f"const V v{i}_@ = {self.value(node)};")

    def value(self, node: Node) -> str:
        if node.op == SELECT:
            condition, yes, no = node.args
            # CasADi adds zero to the selected half, which removes the sign of a zero
            return f"pick({self.mask(condition)}, {self.number(yes)}, {self.number(no)}) + 0."
        if node.op == ca.OP_IF_ELSE_ZERO:
            return f"where({self.mask(node.args[0])}, {self.number(node.args[1])})"
        operands = [self.number(j) for j in node.args]
        if node.op in PLAIN:
            return PLAIN[node.op].format(*operands)
        if node.op not in CALLS:
            raise ValueError(
                f"vectors: expected operations that C has, got CasADi operation {node.op}; use "
                "backend='vm'"
            )
        return f"v_{CALLS[node.op]}({', '.join(operands)})"

    def angle(self, j: int) -> None:
        """Add the sine and cosine of the node j, computed together and only once."""
        if j not in self.angles:
            self.angles.add(j)
            self.lines.append(f"V c{j}_@;")
            self.lines.append(f"const V s{j}_@ = v_sincos({self.number(j)}, &c{j}_@);")


def _is_mask(node: Node) -> bool:
    return node.op in MASKS or node.op in LOGIC


def _literal(value: float) -> str:
    named = {"nan": "NAN", "inf": "INFINITY", "-inf": "-INFINITY"}
    return named.get(repr(value), f"({value!r})")
