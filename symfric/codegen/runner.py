"""Compilation of generated C, and runs of a block in C and in CasADi's VM on the same inputs.

Both give one row per step: the states after it, the outputs, the states of each reset for the
inputs, and with guards the status.
"""

import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import GROUPS, Block
from symfric.codegen.guards import STEP_SIZE, Range, Status, parameter_range, range_of, state_limit
from symfric.codegen.layout import TEMPLATES, called, fields, filled, members, prefix
from symfric.emitter.c99 import Real
from symfric.foundation.graph import graph
from symfric.foundation.numeric import bound
from symfric.foundation.programs import PATIENCE, CompileError, Compiler, ProgramError, finished

WARNINGS = tuple(
    f"-W{name}"
    for name in ("all", "extra", "pedantic", "conversion", "double-promotion", "missing-prototypes")
)

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off")
"""Flags without contraction to fused multiply-add, so that the C has the bits of CasADi."""


def compile_object(compiler: Compiler, source: Path, target: Path) -> list[str]:
    """Compile `source` to an object file; return the warnings.

    Raises:
        CompileError: the compiler rejects it.
    """
    return compiler.warnings(*FLAGS, *WARNINGS, "-c", str(source), "-o", str(target))


def link_program(compiler: Compiler, parts: Sequence[Path], include: Path, target: Path) -> None:
    """Compile and link C and object files.

    Raises:
        CompileError: the compiler rejects them.
    """
    compiler.run(*FLAGS, f"-I{include}", *map(str, parts), "-o", str(target), "-lm")


def needed_symbols(target: Path) -> frozenset[str] | None:
    """Return the undefined names of an object file; None without `nm`."""
    nm = shutil.which("nm")
    if nm is None:
        return None
    try:
        listed = finished((nm, "-u", str(target))).output.decode(errors="replace")
    except ProgramError:
        return None
    names = [line.split()[-1] for line in listed.splitlines() if line.split()]
    if sys.platform == "darwin":
        names = [name.removeprefix("_") for name in names]
    return frozenset(names)


@final
@dataclass(frozen=True)
class Footprint:
    """Size of the object file of one source.

    Attributes:
        text: bytes of code and of constants; None without `size`.
        data: bytes of variables, always 0.
        stack: function -> bytes of its own frame, without functions of libm. Empty if the compiler
            does not report it.
    """

    text: int | None
    data: int | None
    stack: dict[str, int]

    def to_dict(self) -> dict[str, Any]:
        """Return all values by name."""
        return {"text": self.text, "data": self.data, "stack": dict(self.stack)}


def footprint(
    block: Block, real: Real, folder: Path, compiler: Compiler, flags: Sequence[str] = ()
) -> Footprint:
    """Compile the source of a block in `folder` and measure the object file.

    Args:
        flags: in addition to -std=c99 -O2 -ffp-contract=off, such as -mcpu=cortex-m4 of a
            cross-compiler.

    Raises:
        CompileError: the compiler rejects it.
    """
    stem = prefix(block, real)
    with TemporaryDirectory(prefix="symfric-") as place:
        target = Path(place) / f"{stem}.o"
        command = [*FLAGS, *flags, "-c", str(folder / f"{stem}.c"), "-o", str(target)]
        try:
            compiler.run("-fstack-usage", *command)
        except CompileError:  # clang before 11, and others, lack the option
            compiler.run(*command)
        said = target.with_suffix(".su")
        stack = _stack(said.read_text(encoding="utf-8")) if said.is_file() else {}
        text, data = _sizes(compiler, target)
    return Footprint(text, data, stack)


def _stack(text: str) -> dict[str, int]:
    """Return the frames in a file of -fstack-usage: "file:line:column:function", bytes, kind."""
    rows = [line.split("\t") for line in text.splitlines() if line.count("\t") >= 2]
    return {row[0].rpartition(":")[2]: int(row[1]) for row in rows}


def _sizes(compiler: Compiler, target: Path) -> tuple[int | None, int | None]:
    """Return bytes of text and of data with bss, by the `size` next to the compiler."""
    program = Path(compiler.command[0])
    beside = program.name.removesuffix("gcc") + "size" if program.name.endswith("gcc") else "size"
    size = shutil.which(str(program.with_name(beside))) or shutil.which(beside)
    if size is None:
        return None, None
    try:
        done = finished((size, str(target)))
    except ProgramError:
        return None, None
    if done.status:
        return None, None
    text, data, bss, *_ = done.output.decode().splitlines()[1].split()
    return int(text), int(data) + int(bss)


Array = NDArray[np.float64]

PER_STEP = 1e-3
"""Time limit of a step [s]."""


def program(block: Block, real: Real, guards: bool = True) -> str:
    """Return a C program that reads inputs from standard input and writes a row per step, all
    binary.

    With a second argument on its command line it reads the parameters before the inputs.
    """
    name = prefix(block, real)
    types = {group: f"{name}_{group}_t" for group in members(block)}
    own = {group: f"&{group}" for group in GROUPS} | {"param": "param"}
    call = called(block, real, guards, own, fields(block, "in"))
    if block.is_function:
        types |= {"out": real.name}
        calls = [*["status = 0u;"] * guards, f"out = {call};", _write("out")]
    else:
        calls = [f"{'status = ' * guards}{call};"]
        calls += [_write(g) for g in ("state", "out") if g in types]
    for reset in block.resets:
        rest = [own[group] for group in ("param", "in") if group in types]
        calls += [f"{name}_{reset}({', '.join(['&other', *rest])});", _write("other")]
    declarations = [f"{kind} {group};" for group, kind in types.items() if group != "param"]
    if block.inputs:
        calls.insert(0, _read("in"))
    if block.parameters:
        calls.insert(0, f"if (argc > 2) {{ {_read('given')} }}")
        declarations.append(f"{types['param']} given = {name}_default;")
        declarations.append(f"const {types['param']} *param = argc > 2 ? &given : &{name}_default;")
    if block.resets:
        declarations.append(f"{types['state']} other;")
    if guards:
        declarations += ["unsigned int status;", f"{real.name} said;"]
        calls += [f"said = ({real.name})status;", _write("said")]
    if block.is_function and block.inputs:
        declarations.append(f"{real.name} in[{len(block.inputs)}];")
    if block.states:
        declarations.append(f"{name}_init(&state, &{name}_start);")
    return filled(
        TEMPLATES / "steps.c",
        name=name,
        declarations="\n".join(f"    {line}" for line in declarations),
        body="\n".join(f"        {line}" for line in calls),
    )


def _write(what: str) -> str:
    return f"fwrite(&{what}, sizeof {what}, 1, stdout);"


def _read(what: str) -> str:
    return f"if (fread(&{what}, sizeof {what}, 1, stdin) != 1) {{ return 1; }}"


def run_c(
    block: Block,
    real: Real,
    executable: Path,
    inputs: Array,
    parameters: Array | None = None,
    *,
    guards: bool = True,
) -> Array:
    """Return rows (steps, columns) of the compiled `program` for `inputs` (steps, inputs).

    Args:
        parameters: of every step, shape (steps, parameters); by default those of the C.

    Raises:
        CompileError: the program does not run here, or ends too early.
    """
    given = inputs if parameters is None else np.column_stack([parameters, inputs])
    command = [str(executable), str(len(inputs)), *(["own"] if parameters is not None else [])]
    with np.errstate(over="ignore", under="ignore"):
        numbers = given.astype(real.kind).tobytes()
    try:
        limit = PATIENCE + PER_STEP * len(inputs)
        done = finished(command, numbers, limit=limit, name="the program that was compiled")
    except ProgramError as error:
        raise CompileError(str(error)) from None
    columns = len(signals(block, guards=guards))
    if done.status != 0 or len(done.output) != len(inputs) * columns * real.size:
        raise CompileError(f"the program ended too early, with status {done.status}")
    return np.frombuffer(done.output, real.kind).reshape(len(inputs), columns).astype(float)


def run_vm(
    block: Block,
    real: Real,
    inputs: Array,
    states: Array | None = None,
    parameters: Array | None = None,
    *,
    guards: bool = True,
) -> Array:
    """Return the same rows from CasADi in double, with inputs and parameters rounded to `real`.

    The guards are those of `GuardModel`.

    Args:
        states: shape (steps, states): every step but the first starts from the row before.
        parameters: of every step, shape (steps, parameters); by default those of the block.
    """
    model = GuardModel(block, real)
    inputs, said = real.rounded(inputs), np.zeros(len(inputs), np.int64)
    if guards:
        inputs, said = model.inputs(inputs)
    p, x, u = model.default.copy(), model.start.copy(), np.zeros(len(block.inputs))
    following, y = np.zeros_like(x), np.zeros(len(block.outputs))
    step = bound(block.step, (x, p, u), (following, y))
    others = [np.zeros_like(x) for _ in block.resets]
    calls = [
        bound(block.reset(reset), (x, p, u), (other,))
        for reset, other in zip(block.resets, others, strict=True)
    ]
    rows = np.zeros((len(inputs), len(signals(block, guards=guards))))
    for k, (row, now) in enumerate(zip(rows, inputs, strict=True)):
        u[:] = now
        if states is not None and k:
            x[:] = states[k - 1]
        if parameters is not None:
            p[:] = real.rounded(parameters[k])
            if guards:
                p[:], bits = model.parameters(p)
                said[k] |= bits
        if guards and model.lost(x):
            x[:] = model.start
            said[k] |= Status.STATE
        step()
        for call in calls:
            call()
        if guards and not np.isfinite(y).all():
            following[:], y[:] = model.start, 0.0
            said[k] |= Status.OUTPUT
        row[:] = np.concatenate([following, y, *others, said[k : k + 1] if guards else ()])
        x[:] = following
    return rows


def signals(block: Block, *, guards: bool = True) -> list[str]:
    """Return the names of the columns."""
    states = [v.name for v in block.states]
    later = [f"{r}.{name}" for r in block.resets for name in states]
    return states + list(block.outputs) + later + ["status"] * guards


@final
@dataclass(frozen=True, eq=False)
class GuardModel:
    """Guards of a block in NumPy, on rows of numbers of one type."""

    block: Block
    real: Real

    @cached_property
    def start(self) -> Array:
        """Start values of the states."""
        return self.real.rounded([v.start for v in self.block.states])

    @cached_property
    def default(self) -> Array:
        """Default parameters, in the type."""
        return self.real.rounded([v.start for v in self.block.parameters])

    def inputs(self, rows: Array) -> tuple[Array, NDArray[np.int64]]:
        """Return inputs (steps, inputs) after the guards, and the status of every step."""
        found, status = rows.copy(), np.zeros(len(rows), np.int64)
        for i in self._used:
            found[:, i], bits = self._mended(rows[:, i], range_of(self.block.inputs[i]))
            status |= bits
        return found, status

    def lost(self, states: Array) -> bool:
        """Return True if the states (states,) restart before a step."""
        return not bool((np.abs(states) <= self._limits).all())

    def parameters(self, values: Array) -> tuple[Array, int]:
        """Return parameters (parameters,) after the guards, and the status."""
        low, high, is_size = self._ranges
        unfit = ~((values >= low) & (values <= high))
        found = values.copy()
        if unfit[~is_size].any():
            found[~is_size] = self.default[~is_size]
        for i in np.flatnonzero(unfit & is_size):
            found[i] = np.clip(values[i], low[i], high[i])
            found[i] = found[i] if np.isfinite(values[i]) else self.default[i]
        return found, int(Status.PARAMETER) if unfit.any() else 0

    @cached_property
    def _used(self) -> tuple[int, ...]:
        """Inputs that the step depends on; only these are checked."""
        nodes = graph(self.block.step).nodes
        return tuple(n.entry[1] for n in nodes if n.op == ca.OP_INPUT and n.entry[0] == 2)

    @cached_property
    def _limits(self) -> Array:
        return self.real.rounded([state_limit(v) for v in self.block.states])

    @cached_property
    def _ranges(self) -> tuple[Array, Array, NDArray[np.bool_]]:
        ranges = [parameter_range(v) for v in self.block.parameters]
        low, high = (
            self.real.rounded([getattr(r, side) for r in ranges]) for side in ("low", "high")
        )
        return low, high, np.array([v.name == STEP_SIZE for v in self.block.parameters], bool)

    def _mended(self, column: Array, within: Range) -> tuple[Array, NDArray[np.int64]]:
        low, high, safe = self.real.rounded([within.low, within.high, within.safe])
        finite = np.isfinite(column)
        found = np.where(finite, np.clip(column, low, high), safe)
        kinds = np.where(finite, int(Status.CLAMPED), int(Status.NOT_FINITE))
        return found, np.where(finite & (found == column), 0, kinds).astype(np.int64)
