"""Loops over operations that repeat in the C of CasADi, and short functions for all others.

CasADi writes one statement per operation. The step of a chain of n links has a few functions of up
to 1,500 n statements, in which the same operations follow each other for every link, and gcc takes
more than 100 s for 64 links. `with_loops` divides such functions into parts:

    static void f_1(const double *x0, double *y0, double *v) {
      double a3, ...;
      for (int r=0; r<29; ++r) {
        a3=(x0[12+4*r]*v[7+2*r]);
        ...

x and y are arguments and results of the function. The array v holds the values that other parts or
other iterations use. Rows that are not affine in the iteration r are read from a table. Operations
and their order are those of CasADi, so all bits are the same.
"""

from collections import Counter
from collections.abc import Sequence
from re import MULTILINE, Match, compile
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]
Form = tuple[tuple[str, str, str], tuple[int, ...], tuple[int, ...]]
"""Text around the operands of a statement, and kind and group of both operands."""

LONG, LONGEST = 2000, 8000
"""Number of statements from which a function is divided: if loops save half of them, in any case.

The parts of a function exchange values in memory, which takes time: 6 % more for a six-joint arm.
"""
PART = 2000
"""Largest number of statements of a part without a loop."""
WINDOW, PERIODS = 32, 24
"""Length of the sequences of statements that are compared, and number of distances between equal
ones that are considered as length of a loop body.
"""
LEAST, SPARED = 3, 200
"""Smallest number of iterations of a loop, and of statements that it saves."""
APART = "__attribute__((noinline))"
"""Attribute without which compilers join the parts again."""

NONE, VALUE, ARGUMENT, NUMBER = range(-1, 3)
"""Kinds of operands: none, result of another statement, row of an argument, constant."""
KIND, GROUP, PLACE = range(3)
"""Columns of operands; the group is the number of the argument."""

FUNCTION = compile(
    r"^static int (\w+)\(const casadi_real\*\* arg, [^)]*\) \{\n(?:  casadi_real [^\n=]*;\n)+"
    r"((?:  (?:a\d+=|if \(res\[)[^\n]*;\n)+)  return 0;\n\}\n",
    MULTILINE,
)
OPERAND = compile(r"\ba\d+\b")
STATEMENT = compile(
    r"  (?:if \(res\[(\d+)\]!=0\) res\[\d+\]\[(\d+)\]=a(\d+)"
    r"|a(\d+)=(?:arg\[(\d+)\]\? arg\[\d+\]\[(\d+)\] : 0"
    r"|(-?(?:[\d.]+(?:e[-+]?\d+)?|casadi_inf|casadi_nan))"
    r"|([^\n]*?)\ba(\d+)\b(?:([^\n]*?)\ba(\d+)\b)?([^\na]*)));\n"
)
"""Statement that writes a result, reads an argument, sets a number, or has one or two operands."""


def generated(name: str, *functions: ca.Function) -> str:
    """Return the C of CasADi for `functions`, with loops; `name` prefixes internal names."""
    generator = ca.CodeGenerator(f"{name}.c", {"static_aux": True})
    for function in functions:
        generator.add(function)
    return with_loops(generator.dump())


def with_loops(source: str) -> str:
    """Return C of CasADi with its long functions of scalar operations divided into parts.

    A function with statements of another form, such as calls, stays unchanged.
    """
    return FUNCTION.sub(_divided, source)


def _divided(found: Match[str]) -> str:
    name, body = found.groups()
    count = body.count("\n")
    code = parsed(body) if count >= LONG else None
    if code is None:
        return found[0]
    parts = sections(code.form)
    if 2 * sum(part.length for part in parts) > code.form.size and count < LONGEST:
        return found[0]
    return written(name, code, parts)


class Code(NamedTuple):
    """Statements of a function, without those that only read an argument or a number.

    Attributes:
        form: number of the form of each statement, shape (n,); statements of one form differ only
            in registers and places.
        texts: text of each form, in pieces around its operands.
        register: register that each statement assigns; empty if it writes a result.
        row: row of the result that each statement writes, shape (n,).
        operands: kind, group and place of two operands, shape (n, 2, 3). The place is the number of
            a statement or of a constant, or the row of an argument.
        numbers: texts of the constants.
        sizes: number of used rows of each argument and result, x0, y0, ...
    """

    form: Integers
    texts: list[tuple[str, str, str]]
    register: list[str]
    row: Integers
    operands: Integers
    numbers: list[str]
    sizes: dict[str, int]


def parsed(body: str) -> Code | None:
    """Return the statements of a function body; None if some have another form."""
    lines = STATEMENT.findall(body)
    if len(lines) != body.count("\n"):
        return None
    held, numbers, sizes = dict[str, tuple[int, int, int]](), dict[str, int](), Counter[str]()
    forms, form, register = dict[Form, int](), list[int](), list[str]()
    rows, operands = list[int](), list[tuple[int, ...]]()
    for result, row, stored, to, argument, place, number, *pieces in lines:
        if argument:
            held[to] = ARGUMENT, int(argument), int(place)
            sizes[f"x{argument}"] = max(sizes[f"x{argument}"], int(place) + 1)
            continue
        if number:
            shown = f"({number})" if number[0] == "-" else number
            held[to] = NUMBER, 0, numbers.setdefault(shown, len(numbers))
            continue
        if result:
            pieces = f"y{result}", stored, "", "", ""
            sizes[f"y{result}"] = max(sizes[f"y{result}"], int(row) + 1)
        before, a, between, b, after = pieces
        first, second = held[a], held[b] if b else (NONE, 0, 0)
        held[to] = VALUE, 0, len(form)
        key = (before, between, after), first[:PLACE], second[:PLACE]
        form.append(forms.setdefault(key, len(forms)))
        register.append(to)
        rows.append(int(row or 0))
        operands.append(first + second)
    texts = [key[0] for key in forms]
    if any(OPERAND.search("\n".join(text)) for text in texts):  # a third operand
        return None
    table = np.array(operands).reshape(-1, 2, 3)
    return Code(np.array(form), texts, register, np.array(rows), table, [*numbers], dict(sizes))


class Section(NamedTuple):
    """Consecutive statements: `times` iterations of `length` statements of the same forms."""

    begin: int
    length: int
    times: int

    @property
    def end(self) -> int:
        """Number of the statement after the section."""
        return self.begin + self.length * self.times

    def folded(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return the values of its statements by iteration, shape (times, length, ...)."""
        own = values[self.begin : self.end]
        return own.reshape(self.times, self.length, *own.shape[1:])


def sections(form: Integers) -> list[Section]:
    """Return the loops that save most statements, and the statements between them."""
    n, every, found, at = form.size, np.arange(form.size), list[Section](), 0
    saved, length, times = np.zeros((3, n), dtype=int)
    for p in _periods(form):
        differs = np.append(np.flatnonzero(form[:-p] != form[p:]), n - p)
        alike = differs[np.searchsorted(differs[:-1], every)] - every
        count = np.maximum(alike, 0) // p + 1
        better = (count >= LEAST) & ((count - 1) * p > saved)
        saved[better], length[better], times[better] = ((count - 1) * p)[better], p, count[better]
    for k in np.flatnonzero(saved >= SPARED).tolist():
        if k >= at:
            found += _straight(at, k)
            found.append(Section(k, int(length[k]), int(times[k])))
            at = found[-1].end
    return [*found, *_straight(at, n)]


def _straight(begin: int, end: int) -> list[Section]:
    return [Section(k, min(PART, end - k), 1) for k in range(begin, end, PART)]


def _periods(form: Integers) -> list[int]:
    """Return the most frequent distances between neighbouring equal sequences of statements."""
    if form.size < 2 * WINDOW:
        return []
    windows = np.lib.stride_tricks.sliding_window_view(form.astype(np.uint64), WINDOW)
    weights = np.random.default_rng(0).integers(2**63, size=WINDOW, dtype=np.uint64)
    sums = windows @ weights
    order = np.argsort(sums, kind="stable")
    equal = sums[order[1:]] == sums[order[:-1]]
    return [p for p, _ in Counter(np.diff(order)[equal].tolist()).most_common(PERIODS)]


class Storage(NamedTuple):
    """Places of all values.

    Attributes:
        kept: mask of the operands that registers hold, shape (n, 2).
        places: row of the two operands in their arrays, or number of the statement whose register
            is read; row that is written, or -1; shape (n, 3).
        size: length of v.
    """

    kept: NDArray[np.bool_]
    places: Integers
    size: int


def storage_of(code: Code, parts: Sequence[Section]) -> Storage:
    """Return the places of all values if these `parts` of a function become C functions.

    A register holds an operand if the same iteration of the same part computes it, in all
    iterations at the same distance.
    """
    read, size = code.operands[:, :, PLACE].copy(), 0
    value = code.operands[:, :, KIND] == VALUE
    distance = np.arange(read.shape[0])[:, None] - read
    kept, used, slot = (
        np.zeros_like(value),
        np.zeros(read.shape[0], bool),
        np.full(read.shape[0], -1),
    )
    for s in parts:
        since = np.arange(s.length)[:, None]
        own, of = s.folded(value) & (s.folded(distance) <= since), s.folded(distance)
        s.folded(kept)[:] = (own & (of == of[0])).all(axis=0)
    used[read[value & ~kept]] = True
    for s in parts:
        rows = s.folded(used).any(axis=0)
        count = int(rows.sum())
        s.folded(slot)[:, rows] = size + np.arange(count * s.times).reshape(s.times, count)
        size += count * s.times
    read[value & ~kept] = slot[read[value & ~kept]]
    stores = np.array([not register for register in code.register])
    return Storage(kept, np.column_stack([read, np.where(stores, code.row, slot)]), size)


def written(name: str, code: Code, parts: Sequence[Section]) -> str:
    """Return the C of the function `name`, divided into `parts`."""
    storage, names = storage_of(code, parts), sorted(code.sizes)
    typed = "".join(f"{'const ' * (x[0] == 'x')}casadi_real *restrict {x}, " for x in names)
    functions, lines, end, used = list[str](), list[str](), storage.size, 1
    for x in names:
        if x[0] == "x":
            lines.append(f"const casadi_real *{x} = arg[{x[1:]}] ? arg[{x[1:]}] : zeros;")
            used = max(used, code.sizes[x])
        else:  # a null pointer is a result without use
            lines.append(f"casadi_real *{x} = res[{x[1:]}] ? res[{x[1:]}] : v+{end};")
            end += code.sizes[x]
    for k, part in enumerate(parts):
        head = f"static {APART} void {name}_{k}({typed}casadi_real *restrict v)"
        functions.append(f"{head} {{\n{_body(code, storage, part)}}}\n\n")
        lines.append(f"{name}_{k}({', '.join([*names, 'v'])});")
    lines = [f"static casadi_real zeros[{used}];", f"casadi_real v[{end + 1}];", *lines]
    body = "".join(f"  {line}\n" for line in (*lines, "return 0;"))
    head = "const casadi_real** arg, casadi_real** res, casadi_int* iw, casadi_real* w, int mem"
    return f"{''.join(functions)}static int {name}({head}) {{\n{body}}}\n"


def _body(code: Code, storage: Storage, s: Section) -> str:
    """Return the body of the C function of a part."""
    places = s.folded(storage.places)
    step = places[min(1, s.times - 1)] - places[0]
    affine = (places == places[0] + step * np.arange(s.times)[:, None, None]).all(axis=0)
    rows, numbers = list[list[int]](), list[list[str]]()
    lines, registers = list[str](), set[str]()

    def row(k: int, i: int) -> str:
        if affine[k, i]:
            return f"{places[0, k, i]}+{step[k, i]}*r" if step[k, i] else f"{places[0, k, i]}"
        rows.append(places[:, k, i].tolist())
        return f"rows[r][{len(rows) - 1}]"

    def operand(k: int, i: int) -> str:
        kind, group, place = code.operands[s.begin + k, i].tolist()
        if storage.kept[s.begin + k, i]:
            return f"a{code.register[place]}"
        if kind != NUMBER:
            return f"{'v' if kind == VALUE else f'x{group}'}[{row(k, i)}]"
        if affine[k, i] and not step[k, i]:
            return code.numbers[place]
        numbers.append([code.numbers[m] for m in places[:, k, i].tolist()])
        return f"numbers[r][{len(numbers) - 1}]"

    for k in range(s.length):
        before, between, after = code.texts[code.form[s.begin + k]]
        used = [operand(k, i) for i in (0, 1) if code.operands[s.begin + k, i, KIND] != NONE]
        register = code.register[s.begin + k]
        if not register:
            lines.append(f"{before}[{row(k, 2)}]={used[0]};")
            continue
        registers.add(f"a{register}")
        lines.append(f"a{register}={before}{between.join(used)}{after};")
        if places[0, k, 2] >= 0:
            lines.append(f"v[{row(k, 2)}]=a{register};")
    body = [f"casadi_real {', '.join(sorted(registers))};"] if registers else []
    for name, kind, columns in (("rows", "int", rows), ("numbers", "casadi_real", numbers)):
        if columns:
            table = ", ".join(f"{{{', '.join(map(str, x))}}}" for x in zip(*columns, strict=True))
            body.append(f"static const {kind} {name}[{s.times}][{len(columns)}] = {{{table}}};")
    body += lines if s.times == 1 else [f"for (int r=0; r<{s.times}; ++r) {{", *lines, "}"]
    return "".join(f"  {line}\n" for line in body)
