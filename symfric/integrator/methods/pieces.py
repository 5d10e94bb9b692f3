"""C code of attempts, for other programs and devices.

Functions of columns become C functions of arrays, written by symfric's own emitter, for FMUs and
graphics processors. The C needs only `math.h` and `stdbool.h` (available in C++ and CUDA), neither
work arrays nor CasADi integers. In double precision it gives the same bits as CasADi.

An SX Function becomes one C function without calls (`in_c`). An MX Function that calls others, such
as the step of a large mechanism, becomes one C function for each called Function, and one that
calls these; the code between two calls is written out. Code size and compile time then grow with
the blocks, not with the number of calls: those of a six-joint arm are 0.5 MB and 3 s. Both forms
give the same bits as CasADi.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple, final

import casadi as ca

from symfric.emitter.c99 import DOUBLE, TRANSCENDENTAL, Real, macro, representable
from symfric.emitter.emit import emit
from symfric.foundation.graph import graph


class Written(NamedTuple):
    """C function as text.

    Attributes:
        head: declaration without a semicolon.
        body: statements, one per line.
        calls: functions of `math.h` that it calls through macros (`macros`), by their names for
            double.
        operations: number of operations, including calls.
    """

    head: str
    body: tuple[str, ...]
    calls: frozenset[str]
    operations: int

    @property
    def text(self) -> str:
        """Source of the function."""
        return f"{self.head}\n{{\n" + "".join(f"    {line}\n" for line in self.body) + "}\n"


def in_c(
    function: ca.Function,
    name: str,
    arguments: Sequence[str] = (),
    results: Sequence[str] = (),
    real: Real = DOUBLE,
    head: str = "static ",
) -> Written:
    """Return the C of a Function, `head` void `name`(const real *S, ..., real *next, ...).

    Args:
        function: Function of columns, SX, or MX, which is inlined; sparse results are filled with
            zeros.
        name: name of the C function.
        arguments: C names of the arguments; by default, those of the Function.
        results: C names of the results, likewise; an empty name omits a result and the code for it.
            Results may not overlap arguments.
        real: floating point type.
        head: text before `void`.

    Raises:
        ValueError: the Function contains operations that C does not have.
    """
    arguments, results = arguments or function.name_in(), results or function.name_out()
    kept = [k for k, result in enumerate(results) if result]
    function = function if function.is_a("SXFunction") else function.expand()
    symbols = [ca.SX.sym(name, *function.size_in(k)) for k, name in enumerate(function.name_in())]
    values = function.call(symbols, True, False)
    source = ca.Function(function.name(), symbols, [ca.densify(values[k]) for k in kept])
    whole = representable(graph(source), real)
    places = [[f"{x}[{i}]" for i in range(source.numel_in(k))] for k, x in enumerate(arguments)]
    targets = [
        [f"{results[k]}[{i}] = {{}};" for i in range(source.numel_out(j))]
        for j, k in enumerate(kept)
    ]
    code = emit(whole, places, targets, real)
    used = {argument for argument, _ in code.used}
    idle = [f"(void){x};" for k, x in enumerate(arguments) if k not in used]
    idle += [f"(void){results[k]};" for j, k in enumerate(kept) if not source.numel_out(j)]
    handed = [f"const {real.name} *{x}" for x in arguments]
    handed += [f"{real.name} *{results[k]}" for k in kept]
    return Written(
        f"{head}void {name}({', '.join(handed)})",
        (*idle, *code.lines),
        frozenset(code.calls) & frozenset(TRANSCENDENTAL.values()),
        code.operations,
    )


def macros(written: Iterable[Written], real: Real = DOUBLE) -> str:
    """Return the definitions of the macros that these functions call, e.g. `#define SF_EXP exp`."""
    calls = sorted({call for one in written for call in one.calls})
    return "".join(f"#define {macro(call, real)} {call}{real.letter}\n" for call in calls)


def all_macros() -> str:
    """Return the definitions of the macros for all transcendental functions."""
    called = sorted(set(TRANSCENDENTAL.values()))
    return "".join(f"#define {macro(name, DOUBLE)} {name}\n" for name in called)


def routine(function: ca.Function, name: str) -> str:
    """Return the C of `function`: static void name(const double *a0, ..., double *r0, ...).

    Columns are dense. Results must not share memory with arguments.

    Raises:
        ValueError: operations that C does not have, or calls with sparse arguments.
    """
    if function.is_a("MXFunction"):
        return _Pieces(name).written(function)
    arguments = [f"a{i}" for i in range(function.n_in())]
    results = [f"r{i}" for i in range(function.n_out())]
    return in_c(function, name, arguments, results).text + "\n"


@final
class _Pieces:
    """Writer of the C functions of an MX Function and of the blocks that it calls.

    Attributes:
        name: name of the C function, and prefix of the names of its blocks.
        blocks: C of the blocks; `known` maps the hashes of their Functions to their names.
        arrays: symbols (n, 1) and the C arrays that hold their values.
        lines: C statements.
    """

    def __init__(self, name: str) -> None:
        self.name, self.blocks, self.lines = name, list[str](), list[str]()
        self.known, self.arrays = dict[int, str](), list[tuple[ca.SX, str]]()

    def written(self, function: ca.Function) -> str:
        """Return the C of `function` and of all Functions that it calls."""
        slots: dict[int, ca.SX] = {}
        results: dict[int, list[tuple[int, ca.SX]]] = {}
        for k in range(function.n_instructions()):
            op = function.instruction_id(k)
            into, of = function.instruction_output(k), function.instruction_input(k)
            if op == ca.OP_INPUT:
                slots[into[0]] = self._array(f"a{of[0]}", function.sparsity_in(of[0]))
            elif op == ca.OP_OUTPUT:  # a result may come in parts
                offset = function.instruction_MX(k).info()["offset"]
                results.setdefault(into[0], []).append((offset, slots[of[0]]))
            elif op == ca.OP_CALL:
                node = function.instruction_MX(k)
                found = self._call(node.which_function(), [slots[i] for i in of], k)
                slots |= {i: value for i, value in zip(into, found, strict=True) if i >= 0}
            else:
                slots[into[0]] = _between(function.instruction_MX(k), [slots[i] for i in of])
        values: list[ca.SX] = []
        for i in range(function.n_out()):
            parts = sorted(results.get(i, []), key=lambda part: part[0])
            column = ca.vertcat(ca.SX(0, 1), *(ca.vec(part) for _, part in parts))
            values.append(ca.densify(column))
        self._write(values, [f"r{i}" for i in range(len(values))])
        into = [f"a{i}" for i in range(function.n_in())]
        idle = [f"(void){a};" for a in into if not any(a in line for line in self.lines)]
        handed = [f"const double *{a}" for a in into]
        handed += [f"double *r{i}" for i in range(len(values))]
        body = "".join(f"    {line}\n" for line in (*idle, *self.lines))
        head = f"static void {self.name}({', '.join(handed)})"
        return "".join(self.blocks) + f"{head}\n{{\n{body}}}\n\n"

    def _array(self, name: str, sparsity: ca.Sparsity) -> ca.SX:
        """Return symbols for the entries of a C array."""
        if not sparsity.is_dense():
            raise ValueError(f"codegen '{self.name}': expected calls of dense columns, got sparse")
        symbols = ca.SX.sym(name, sparsity.numel())
        self.arrays.append((symbols, name))
        return ca.reshape(symbols, sparsity.size1(), sparsity.size2())

    def _call(self, function: ca.Function, arguments: list[ca.SX], number: int) -> list[ca.SX]:
        """Return the results of a call; the first call of a block also writes its C."""
        key = function.__hash__()
        if key not in self.known:
            self.known[key] = f"{self.name}_{len(self.known) + 1}_{function.name()}"
            self.blocks.append(routine(function, self.known[key]))
        name = self.known[key]
        places = [self._place(a, f"x{number}_{i}") for i, a in enumerate(arguments)]
        made = [f"y{number}_{i}" for i in range(function.n_out())]
        sizes = [max(1, function.numel_out(i)) for i in range(function.n_out())]
        self.lines += [f"double {one}[{size}];" for one, size in zip(made, sizes, strict=True)]
        self.lines.append(f"{name}({', '.join([*places, *made])});")
        dense = (ca.Sparsity.dense(*function.size_out(i)) for i in range(function.n_out()))
        return [self._array(one, shape) for one, shape in zip(made, dense, strict=True)]

    def _place(self, value: ca.SX, name: str) -> str:
        """Return the C array of an argument: part of an existing array, or a new one."""
        column = ca.vec(ca.densify(value))
        for symbols, array in self.arrays:
            begin = _within(column, symbols)
            if begin is not None:
                return f"{array} + {begin}" if begin else array
        self.lines.append(f"double {name}[{max(1, column.numel())}];")
        self._write([column], [name])
        return name

    def _write(self, values: Sequence[ca.SX], arrays: Sequence[str]) -> None:
        """Append statements that store `values` in C arrays."""
        used = [(s, name) for s, name in self.arrays if ca.depends_on(ca.veccat(*values), s)]
        glue = ca.Function(
            "between", [s for s, _ in used], ca.cse([ca.vec(value) for value in values])
        )
        names = [[f"{name}[{k}]" for k in range(s.numel())] for s, name in used]
        targets = [
            [f"{name}[{k}] = {{}};" for k in range(value.numel())]
            for value, name in zip(values, arrays, strict=True)
        ]
        code = emit(graph(glue), names, targets, DOUBLE)
        self.lines += ["{", *(f"    {line}" for line in code.lines), "}"]


def _within(column: ca.SX, symbols: ca.SX) -> int | None:
    """Return the offset of `column` in `symbols`; None if it is not a contiguous part."""
    count = column.numel()
    if not count or count > symbols.numel():
        return None
    own, whole = ([e.__hash__() for e in ca.vertsplit(x)] for x in (column, symbols))
    begin = whole.index(own[0]) if own[0] in whole else count
    return begin if whole[begin : begin + count] == own else None


def _between(node: ca.MX, arguments: list[ca.SX]) -> ca.SX:
    """Return the value of an MX operation that is not a call."""
    if not arguments:
        return ca.SX(ca.evalf(node))
    parts = [node.dep(i) for i in range(node.n_dep())]
    symbols = [ca.MX.sym("d", part.sparsity()) for part in parts]
    alone = ca.graph_substitute(node, parts, symbols)
    return ca.SX(ca.Function("operation", symbols, [alone]).call(arguments)[0])
