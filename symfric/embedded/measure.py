"""Cost of a step of a block on a Cortex-M core, its accuracy, and the unit test of a kit there."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import inf, isfinite, nan
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import Block
from symfric.codegen.generated import Generated
from symfric.codegen.layout import CBlock, filled
from symfric.codegen.runner import compiled, run_c, run_vm
from symfric.embedded.target import (
    BY,
    CORES,
    SOURCES,
    Absent,
    Core,
    Said,
    Target,
    Tools,
    built,
    by_casadi,
    find_tools,
    own,
    said,
)
from symfric.emitter.c99 import REALS
from symfric.foundation import checks
from symfric.foundation.files import write_text
from symfric.foundation.parameters import Variable
from symfric.foundation.programs import CompileError, find_compiler

Array = NDArray[np.float64]

STEPS = 400

MEASURED = "measured"

FAMILY = 1e-3
"""Least peak of a signal that errors are divided by, in the largest peak of its unit."""


@final
@dataclass(frozen=True)
class Measured:
    """One block on one core.

    Attributes:
        block, real, core, by: what was measured; see `CORES` and `BY`.
        status: "measured", or a sentence that says what is absent; the numbers are NaN then.
        average, maximum: instructions of a step, the call included.
        text: bytes of code and constants of the block.
        library: bytes of the functions of libm and libgcc that are linked for it.
        data: bytes of RAM for an instance: states and, so that they can be changed, parameters.
        stack: bytes of stack that the call uses at most, library included.
        error: largest difference from CasADi's double from the same states, relative to the peak
            of each signal, at least a thousandth of the largest of its unit.
        equal: share of numbers with the bits of the host's C; NaN where it was not compared.
        finite: whether all numbers are.
    """

    block: str
    real: str
    core: str
    by: str = BY[0]
    status: str = MEASURED
    average: float = nan
    maximum: float = nan
    text: float = nan
    library: float = nan
    data: float = nan
    stack: float = nan
    error: float = nan
    equal: float = nan
    finite: bool = False

    @property
    def ok(self) -> bool:
        """Return True if it was measured and all numbers are finite."""
        return self.status == MEASURED and self.finite

    def to_dict(self) -> dict[str, Any]:
        """Everything by name; what was not measured is None."""
        return {
            name: None if isinstance(value, float) and not isfinite(value) else value
            for name, value in asdict(self).items()
        }


def measure(
    block: Block,
    real: str = "float",
    core: str = "m4f",
    *,
    by: str = "symfric",
    flags: Sequence[str] = ("-O2",),
    steps: int = STEPS,
    guards: bool = True,
    tools: Tools | Absent | None = None,
) -> Measured:
    """Cross-compile a step of `block`, run it under QEMU and compare it with the host.

    QEMU counts instructions exactly; it knows no cycles. The inputs are those of `day`. Nothing
    fuses multiply and add (-ffp-contract=off).

    Args:
        real: "float" or "double".
        core: one of `CORES`: "m0plus", "m3", "m4f", "m7".
        by: who writes the C, one of `BY`.
        flags: of the compiler, such as -Os.
        steps: how many, up to 4000.
        guards: whether our C clamps and repairs; CasADi's has no such thing.
        tools: what `find_tools` found.

    Returns:
        The numbers; where a tool is absent its name and package stand in `status`.

    Raises:
        ValueError: an unknown name; too many steps.
        CompileError: the compiler refuses the code, or the program fails under QEMU.
    """
    where = "embedded"
    checks.kind(where, block, Block, "law_block(LuGre())")
    for what, value, known in (("real", real, REALS), ("core", core, CORES), ("by", by, BY)):
        checks.choice(f"{where}: {what}", value, known)
    checks.count(f"{where}: steps", steps, least=1, most=4000)
    checks.flag(f"{where}: guards", guards)
    found = find_tools() if tools is None else tools
    if isinstance(found, Absent):
        return Measured(block.name, real, core, by, f"skipped: {found.advice}")
    inputs = day(block, steps)
    with TemporaryDirectory(prefix="symfric-") as name:
        folder = Path(name)
        if by == "symfric":
            subject = own(block, real, folder, guards=guards)
        else:
            subject = by_casadi(block, real, folder, functions_of_float=by != "casadi")
        target = Target(CORES[core], found, flags)
        image = built(subject, real, inputs, _columns(block), target)
        heard = said(target.heard(image), real, _columns(block))
        equal = _equal(CBlock(block, REALS[real], guards), subject.source, inputs, heard.rows)
    return _measured(block, real, CORES[core], by, inputs, heard, equal)


def _columns(block: Block) -> int:
    return len(block.states) + len(block.outputs)


def _measured(
    block: Block, real: str, core: Core, by: str, inputs: Array, heard: Said, equal: float
) -> Measured:
    c = CBlock(block, REALS[real])
    expected = run_vm(c, inputs, heard.rows[:, : len(block.states)])
    return Measured(
        block.name,
        real,
        core.name,
        by,
        average=float(heard.instructions.mean()),
        maximum=float(round(heard.instructions.max())),
        text=heard.text,
        library=heard.library,
        data=heard.data,
        stack=heard.stack,
        error=_error(block, heard.rows, expected[:, : _columns(block)]),
        equal=equal,
        finite=bool(np.isfinite(heard.rows).all()),
    )


def _error(block: Block, a: Array, b: Array) -> float:
    """Largest difference of a column relative to its peak in `b`.

    A peak below a thousandth of that of another signal of the same unit counts as so much: the
    torque of an upright axis under gravity is rounding alone.
    """
    units = np.array([v.unit for v in (*block.states, *block.outputs.values())])
    peak = np.abs(b).max(axis=0, initial=0.0)
    family = np.array([peak[units == unit].max() for unit in units])
    scale = np.maximum(peak, FAMILY * family)
    ratio = np.abs(a - b).max(axis=0, initial=0.0) / np.where(scale > 0.0, scale, 1.0)
    return float(np.where(np.isnan(ratio), inf, ratio).max(initial=0.0))


def _equal(c: CBlock, source: Path, inputs: Array, rows: Array) -> float:
    """Share of numbers with the bits of our C on the host; NaN without a compiler or with others'."""
    compiler = find_compiler()
    if compiler is None or source.stem != c.name:
        return nan
    host = run_c(c, compiled(c, [source], source.parent, compiler), inputs)
    return float((host[:, : rows.shape[1]] == rows).mean())


def wrong_on_target(
    generated: Generated,
    real: str = "float",
    core: str = "m4f",
    *,
    flags: Sequence[str] = ("-O2",),
    tools: Tools | Absent | None = None,
) -> int:
    """Number of wrong results of the kit's own unit test on a core under QEMU.

    Args:
        generated: what `generate` returned, with the floating point type `real`.
        core: one of `CORES`.
        flags: of the compiler.
        tools: what `find_tools` found.

    Raises:
        ValueError: an unknown core, a type that was not generated.
        CompileError: tools are absent, the compiler refuses the code, or the program fails.
    """
    where = "embedded"
    checks.kind(where, generated, Generated, "what generate(...) returned")
    checks.choice(f"{where}: real", real, generated.reals)
    checks.choice(f"{where}: core", core, CORES)
    found = find_tools() if tools is None else tools
    if isinstance(found, Absent):
        raise CompileError(f"{where}: {found.advice}")
    name = generated.c(real).name
    sources = [generated.folder / f"{name}{ending}.c" for ending in ("", "_test")]
    target = Target(CORES[core], found, flags)
    with TemporaryDirectory(prefix="symfric-") as folder:
        own = (f"-D{name.upper()}_TEST_NO_MAIN", f"-I{generated.folder}")
        image = target.linked(Path(folder), filled(SOURCES / "test.c", name=name), sources, *own)
        return int(target.heard(image)["wrong"][0])


STRETCH = 20
"""Steps of one kind of motion in a row."""

LOADS = (1.0, 1.5, 0.5, 1.0, 0.1, 10.0)
"""Of a load, in units of its nominal value, one after the other: steps up to a hundredfold."""


def day(block: Block, steps: int) -> Array:
    """Inputs of every step, shape (steps, inputs), the same at each call.

    In stretches of 20 steps, in units of the nominal value: a slow sine through zero, bursts up to
    2, values of 1e-12 ... 1e-3 of either sign, reversals between -0.1 and 0.1, rest: a fifth each,
    shuffled. A load (lower bound 0 or more) wavers by a tenth around levels that jump between the
    stretches by factors up to 100.
    """
    random = np.random.default_rng(0)
    columns = [np.zeros((steps, 0)), *(_signal(v, steps, random) for v in block.inputs)]
    values = np.column_stack(columns)
    lower = np.array([v.lower for v in block.inputs])
    upper = np.array([v.upper for v in block.inputs])
    return np.clip(values, lower, upper)


def _signal(variable: Variable, steps: int, random: np.random.Generator) -> Array:
    k = np.arange(steps)
    count = -(-steps // STRETCH)
    if variable.lower >= 0.0:
        levels = np.resize(LOADS, count).repeat(STRETCH)[:steps]
        return variable.nominal * levels * (1.0 + 0.1 * np.sin(0.3 * k + random.uniform(0.0, 6.0)))
    tiny = 10.0 ** random.uniform(-12.0, -3.0, steps) * random.choice([-1.0, 1.0], steps)
    pieces = [
        0.05 * np.sin(0.15 * k),
        np.clip(random.standard_normal(steps), -2.0, 2.0),
        tiny,
        0.1 * np.sign(np.sin(0.6 * k + 0.1)),
        np.zeros(steps),
    ]
    turns = np.resize(np.arange(len(pieces)), count)
    random.shuffle(turns)
    return variable.nominal * np.choose(turns.repeat(STRETCH)[:steps], pieces)
