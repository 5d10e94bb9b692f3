"""Compilation of generated C, and runs of a block in C, in CasADi's VM and in NumPy.

A run returns one row per step: the states after the step, the outputs, the states that each reset
returns for the inputs, and with guards the status (`CBlock.signals`).
"""

import shutil
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, partial
from math import isfinite, nan, remainder
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import TEMPLATES, CBlock
from symfric.codegen.guards import STEP_SIZE, Range, Status, parameter_range, range_of, state_limit
from symfric.emitter.c99 import filled
from symfric.foundation.files import write_text
from symfric.foundation.graph import SELECT, graph
from symfric.foundation.instructions import CODES
from symfric.foundation.numeric import bound, erf
from symfric.foundation.programs import PATIENCE, CompileError, Compiler, ProgramError, finished

WARNINGS = tuple(
    f"-W{name}"
    for name in ("all", "extra", "pedantic", "conversion", "double-promotion", "missing-prototypes")
)

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off")
"""Flags that prevent fused multiply-add, so that the C computes the same bits as CasADi."""


def compile_object(compiler: Compiler, source: Path, target: Path) -> list[str]:
    """Compile `source` to an object file; return the warnings.

    Raises:
        CompileError: the compiler rejects the C.
    """
    return compiler.warnings(*FLAGS, *WARNINGS, "-c", str(source), "-o", str(target))


def needed_symbols(target: Path) -> frozenset[str] | None:
    """Return the undefined names of an object file; None if `nm` is not available."""
    nm = shutil.which("nm")
    with suppress(ProgramError):
        if nm is not None:
            listed = finished((nm, "-u", str(target))).output.decode(errors="replace")
            names = (line.split()[-1] for line in listed.splitlines() if line.split())
            prefix = "_" * (sys.platform == "darwin")
            return frozenset(name.removeprefix(prefix) for name in names)
    return None


def footprint(c: CBlock, folder: Path, compiler: Compiler) -> dict[str, Any]:
    """Compile the source of a block in `folder` and measure the object file.

    Returns:
        text: bytes of code and of constants; None if the program `size` is not available.
        data: bytes of variables (0 for generated C); None as for `text`.
        stack: function -> bytes of its frame, without functions of libm; empty if the compiler does
            not report frames.

    Raises:
        CompileError: the compiler rejects the C.
    """
    with TemporaryDirectory(prefix="symfric-") as place:
        target = Path(place) / f"{c.name}.o"
        command = [*FLAGS, "-c", str(folder / f"{c.name}.c"), "-o", str(target)]
        try:
            compiler.run("-fstack-usage", *command)
        except CompileError:  # some compilers, such as clang before 11, lack the option
            compiler.run(*command)
        listed, (text, data) = target.with_suffix(".su"), _sizes(compiler, target)
        lines = listed.read_text(encoding="utf-8").splitlines() if listed.is_file() else []
        rows = (line.split("\t") for line in lines)  # file:line:column:function, bytes, kind
        stack = {row[0].rpartition(":")[2]: int(row[1]) for row in rows if len(row) > 2}
        return {"text": text, "data": data, "stack": stack}


def _sizes(compiler: Compiler, target: Path) -> tuple[int | None, int | None]:
    """Return bytes of text and of data with bss, from the program `size` of the compiler."""
    program = Path(compiler.command[0])
    name = program.name.removesuffix("gcc") + "size" if program.name.endswith("gcc") else "size"
    size = shutil.which(str(program.with_name(name))) or shutil.which(name)
    with suppress(ProgramError):
        if size is not None and (done := finished((size, str(target)))).status == 0:
            text, data, bss, *_ = map(int, done.output.decode().splitlines()[1].split()[:3])
            return text, data + bss
    return None, None


Array = NDArray[Any]

PER_STEP = 1e-3
"""Time limit per step [s], in addition to `PATIENCE`."""


def program(c: CBlock) -> str:
    """Return a C program that reads inputs and writes a row per step, as binary standard streams.

    With a second argument on its command line, it reads the parameters before the inputs.
    """
    start = f"{c.name}_init({c.casts['state']}, &{c.name}_start);" if c.block.states else ""
    if c.block.parameters:
        start += f" if (!own) {{ param = (const {c.real.name} *)&{c.name}_default; }}"
    given = [c.casts[group] for group in ("param", "in") if group in c.block.members]
    write = f"fwrite(other, sizeof({c.real.name}), STATES, stdout);"
    resets = (
        f"{c.name}_{reset}({', '.join([f'({c.name}_state_t *)other', *given])}); {write}"
        for reset in c.block.resets
    )
    steps = {"start": start, "resets": "\n        ".join(resets), "guards": int(c.guards)}
    return filled(TEMPLATES / "steps.c", **c.sizes, **steps)


def compiled(c: CBlock, parts: Sequence[Path], include: Path, compiler: Compiler) -> Path:
    """Compile the `program` of a block, link it with C or object files; return the executable.

    Raises:
        CompileError: the compiler rejects the C.
    """
    main = parts[0].parent / f"{c.name}_main.c"
    write_text(main, program(c))
    target = main.with_suffix("")
    files = [str(part) for part in (main, *parts)]
    compiler.run(*FLAGS, f"-I{include}", *files, "-o", str(target), "-lm")
    return target


def run_c(c: CBlock, executable: Path, inputs: Array, parameters: Array | None = None) -> Array:
    """Return rows (steps, columns) of the compiled `program` for `inputs` (steps, inputs).

    Args:
        parameters: parameters of every step, shape (steps, parameters); default those of the C.

    Raises:
        CompileError: the program does not run on this machine, or ends too early.
    """
    given = inputs if parameters is None else np.column_stack([parameters, inputs])
    command = [str(executable), str(len(inputs)), *["own"] * (parameters is not None)]
    with np.errstate(over="ignore", under="ignore"):
        numbers = given.astype(c.real.kind).tobytes()
    try:
        limit = PATIENCE + PER_STEP * len(inputs)
        done = finished(command, numbers, limit=limit, name="the program that was compiled")
    except ProgramError as error:
        raise CompileError(str(error)) from None
    shape = len(inputs), len(c.signals)
    if done.status != 0 or len(done.output) != shape[0] * shape[1] * c.real.size:
        raise CompileError(f"the program ended too early, with status {done.status}")
    return np.frombuffer(done.output, c.real.kind).reshape(shape).astype(float)


def run_vm(
    c: CBlock, inputs: Array, states: Array | None = None, parameters: Array | None = None
) -> Array:
    """Return the rows that CasADi computes in double from numbers rounded to the type.

    `GuardModel` replaces the guards of the C.

    Args:
        states: states after every step, shape (steps, states): each step except the first starts
            from the row before it; by default the steps start from their own results.
        parameters: parameters of every step, shape (steps, parameters); default those of the block.
    """
    block, model, steps = c.block, GuardModel(c), len(inputs)
    u, said = c.real.rounded(inputs), np.zeros(steps, np.int64)
    p = np.tile(c.default, (steps, 1)) if parameters is None else c.real.rounded(parameters)
    if c.guards:
        (u, said), (p, unfit) = model.inputs(u), model.parameters(p)
        said |= unfit
    if states is None:
        x, rows = _followed(c, p, u)
    else:
        x, rows = np.vstack([c.start, states])[:steps], None
    if c.guards:
        lost = model.lost(x)
        x[lost] = c.start
        said[lost] |= Status.STATE
    if rows is None:
        rows = evaluated(block.step, x, p, u)
    resets = [evaluated(block.reset(name), x, p, u) for name in block.resets]
    if not c.guards:
        return np.hstack([rows, *resets])
    count = len(block.states)
    bad = ~np.isfinite(rows[:, count:]).all(axis=1)
    rows[bad, :count], rows[bad, count:] = c.start, 0.0
    said[bad] |= Status.OUTPUT
    return np.hstack([rows, *resets, said[:, None]])


def _followed(c: CBlock, parameters: Array, inputs: Array) -> tuple[Array, Array]:
    """Return the states before every step and its results, each from the step before it."""
    step, model = c.block.step, GuardModel(c)
    x, p, u = c.start.copy(), c.default.copy(), np.zeros(inputs.shape[1])
    following, y = np.zeros(len(x)), np.zeros(step.numel_out(1))
    call = bound(step, (x, p, u), (following, y))
    before, rows = np.zeros((len(inputs), len(x))), np.zeros((len(inputs), len(x) + len(y)))
    for k in range(len(inputs)):
        before[k], p[:], u[:] = x, parameters[k], inputs[k]
        if c.guards and model.lost(x):
            x[:] = c.start
        call()
        rows[k] = np.concatenate([following, y])
        x[:] = c.start if c.guards and not np.isfinite(y).all() else following
    return before, rows


def evaluated(function: ca.Function, *arguments: Array) -> Array:
    """Return the results of a function, concatenated, for every row of its arguments.

    Args:
        function: function of columns with dense results.
        arguments: rows of each argument, shape (rows, size of the argument).
    """
    count = len(arguments[0])
    given = [np.ascontiguousarray(rows, float) for rows in arguments]
    results = [np.zeros((count, function.numel_out(i))) for i in range(function.n_out())]
    bound(function.map(count), given, results)()  # rows of arrays are columns in CasADi
    return np.hstack(results)


@final
@dataclass(frozen=True, eq=False)
class GuardModel:
    """Guards of a block in NumPy, for numbers rounded to its type."""

    c: CBlock

    def inputs(self, rows: Array) -> tuple[Array, NDArray[np.int64]]:
        """Return the guarded inputs (steps, inputs) and the status of every step."""
        found, status = rows.copy(), np.zeros(len(rows), np.int64)
        for i, within in self._used.items():
            low, high, safe = self.c.real.rounded(within)
            finite = np.isfinite(rows[:, i])
            found[:, i] = np.where(finite, np.clip(rows[:, i], low, high), safe)
            status[~finite] |= Status.NOT_FINITE
            status[finite & (found[:, i] != rows[:, i])] |= Status.CLAMPED
        return found, status

    def lost(self, states: Array) -> NDArray[np.bool_]:
        """Return True for the states (..., states) that the guards restart before a step."""
        return np.asarray((~(np.abs(states) <= self._limits)).any(axis=-1))

    def parameters(self, rows: Array) -> tuple[Array, NDArray[np.int64]]:
        """Return the guarded parameters (steps, parameters) and the status of every step."""
        low, high, is_size = self._ranges
        unfit = ~((rows >= low) & (rows <= high))
        replaced = (unfit & ~is_size).any(axis=1, keepdims=True) & ~is_size
        size = np.where(np.isfinite(rows), np.clip(rows, low, high), self.c.default)
        found = np.where(is_size, size, np.where(replaced, self.c.default, rows))
        return found, np.where(unfit.any(axis=1), int(Status.PARAMETER), 0)

    @cached_property
    def _used(self) -> dict[int, Range]:
        """Ranges of the inputs that the step depends on; only these are checked."""
        entries = (n.entry for n in graph(self.c.block.step).nodes if n.op == ca.OP_INPUT)
        return {row: range_of(self.c.block.inputs[row]) for group, row in entries if group == 2}

    @cached_property
    def _limits(self) -> Array:
        return self.c.real.rounded([state_limit(v) for v in self.c.block.states])

    @cached_property
    def _ranges(self) -> tuple[Array, Array, NDArray[np.bool_]]:
        ranges = [parameter_range(v) for v in self.c.block.parameters]
        low, high = (self.c.real.rounded([r[side] for r in ranges]) for side in (0, 1))
        return low, high, np.array([v.name == STEP_SIZE for v in self.c.block.parameters], bool)


def _remainder(x: float, y: float) -> float:  # that of NumPy is another function
    return remainder(x, y) if y and isfinite(x) else nan


NUMPY = {
    "sub": "subtract", "mul": "multiply", "div": "divide", "neg": "negative", "sq": "square",
    "inv": "reciprocal", "lt": "less", "le": "less_equal", "eq": "equal", "ne": "not_equal",
    "not": "logical_not", "and": "logical_and", "or": "logical_or", "pow": "power",
    "constpow": "power", "asin": "arcsin", "acos": "arccos", "atan": "arctan", "atan2": "arctan2",
    "asinh": "arcsinh", "acosh": "arccosh", "atanh": "arctanh",
}  # fmt: skip
"""Functions whose names differ in NumPy and CasADi."""

OPERATIONS: dict[int, Callable[..., Any]] = {
    code: getattr(np, NUMPY.get(name, name))
    for name, code in CODES.items()
    if hasattr(np, NUMPY.get(name, name))
} | {
    ca.OP_TWICE: partial(np.multiply, 2),
    ca.OP_ERF: erf,
    ca.OP_REMAINDER: np.vectorize(_remainder, otypes=[float]),
}
"""Functions of arrays, by the numbers of CasADi's operations."""


def in_type(
    function: ca.Function,
    arguments: Sequence[Array],
    kind: str,
    random: np.random.Generator | None = None,
) -> Array:
    """Return the results of a function, concatenated, with every operation rounded to a type.

    Args:
        function: function of SX with dense arguments and results.
        arguments: rows of each argument, shape (rows, size of the argument).
        kind: NumPy's name of the type, such as "f4".
        random: generator that rounds each inexact result randomly to one of its two neighbours;
            None rounds to the nearest. Differences between runs are rounding errors.
            Source: Vignes, Mathematics and Computers in Simulation 35 (1993), CESTAC.

    Returns:
        Results in double, shape (rows, results).
    """
    source, found = graph(function), list[Array]()
    with np.errstate(all="ignore"):
        for node in source.nodes:
            given = [found[i] for i in node.args]
            if node.op == ca.OP_INPUT:
                value = arguments[node.entry[0]][:, node.entry[1]]
            elif node.op == ca.OP_CONST:
                value = np.full(len(arguments[0]), node.value)
            elif node.op in (SELECT, ca.OP_IF_ELSE_ZERO):
                value = np.where(given[0] != 0, given[1], given[2] if len(given) > 2 else 0.0)
            elif random is None:
                value = OPERATIONS[node.op](*given)
            else:
                exact = np.asarray(OPERATIONS[node.op](*(x.astype(float) for x in given)), float)
                value = _up_or_down(exact, kind, random)
            found.append(np.asarray(value).astype(kind))
    return np.column_stack([found[i] for row in source.results for i in row]).astype(float)


def _up_or_down(exact: Array, kind: str, random: np.random.Generator) -> Array:
    """Return each number rounded randomly up or down to the type, unchanged if representable.

    The result of an operation on floats is approximated by the nearest double.
    """
    nearest = exact.astype(kind)
    beyond = np.where(exact > nearest, np.inf, -np.inf).astype(kind)
    other = (exact != nearest) & (random.random(exact.shape) < 0.5)
    return np.where(other, np.nextafter(nearest, beyond), nearest)
