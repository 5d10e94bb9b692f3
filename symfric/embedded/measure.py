"""Cost and accuracy of a step of a block on a Cortex-M core, and unit tests of kits on it."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from math import inf, nan
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import Block, CBlock
from symfric.codegen.fixed.generated import FixedPoint
from symfric.codegen.generated import Generated
from symfric.codegen.runner import compiled, run_c, run_vm
from symfric.codegen.verification import motions
from symfric.embedded.target import (
    BY,
    CLOCK,
    CORES,
    PATIENCE,
    SHIFT,
    SOURCES,
    Absent,
    Subject,
    Target,
    Tools,
    by_casadi,
    find_tools,
    literals,
    of_c,
)
from symfric.emitter.c99 import REALS, filled
from symfric.foundation import checks
from symfric.foundation.files import json_data
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import Variable
from symfric.foundation.programs import CompileError, find_compiler

STEPS = 400

MEASURED = "measured"

FAMILY = 1e-3
"""Smallest scale of the errors of a signal, relative to the largest peak of its unit."""


@final
@dataclass(frozen=True)
class BlockMeasurement:
    """Measurement of one block on one core.

    Attributes:
        block, real, core, by: names of block, type, core and author of the C; see `CORES`, `BY`.
        status: "measured", or a sentence about absent tools; the numbers are then NaN.
        average, maximum: average number of instructions of a step over `day`, with the call, and
            the maximum over `day` and `REGIMES`.
        regimes: average number of instructions of a step in each of the `REGIMES`.
        text: bytes of code and constants of the block.
        library: bytes of the linked functions of libm and libgcc.
        data: bytes of RAM of an instance: states and adjustable parameters.
        stack: bytes of stack used by the call, including libraries.
        error: largest difference from a step of CasADi in double from the same states, relative to
            the peak of each signal, or to a thousandth of the largest peak of its unit.
        equal: fraction of numbers with the same bits as the C on the host; NaN if not compared.
        finite: True if all numbers are finite.
    """

    block: str
    real: str
    core: str
    by: str = BY[0]
    status: str = MEASURED
    average: float = nan
    maximum: float = nan
    regimes: Mapping[str, float] = field(default_factory=dict[str, float])
    text: float = nan
    library: float = nan
    data: float = nan
    stack: float = nan
    error: float = nan
    equal: float = nan
    finite: bool = False

    @property
    def ok(self) -> bool:
        """True if the block was measured and all numbers are finite."""
        return self.status == MEASURED and self.finite

    def to_dict(self) -> dict[str, Any]:
        """Return all values by name; None for values that were not measured."""
        return json_data(asdict(self))


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
) -> BlockMeasurement:
    """Cross-compile a step of `block`, run it under QEMU and compare it with the host.

    QEMU counts instructions exactly, but not cycles. The inputs are those of `day`, then those of
    `regimes`. The compiler does not fuse multiply and add (-ffp-contract=off).

    Args:
        block: the block.
        real: "float" or "double".
        core: one of `CORES`: "m0plus", "m3", "m4f", "m7".
        by: author of the C, one of `BY`.
        flags: flags of the compiler, such as -Os.
        steps: number of steps of `day`, up to 4000.
        guards: True if the C of symfric has guards, see `symfric.codegen.guards`.
        tools: result of `find_tools`.

    Returns:
        The measurement; its `status` names absent tools and their packages.

    Raises:
        ValueError: an unknown name, or too many steps.
        CompileError: the compiler rejects the code, or the program fails under QEMU.
    """
    where = "embedded"
    checks.kind(where, block, Block, "law_block(LuGre())")
    for what, value, known in (("real", real, REALS), ("core", core, CORES), ("by", by, BY)):
        checks.choice(f"{where}: {what}", value, known)
    checks.count(f"{where}: steps", steps, least=1, most=4000)
    checks.flag(f"{where}: guards", guards)
    found = find_tools() if tools is None else tools
    if isinstance(found, Absent):
        return BlockMeasurement(block.name, real, core, by, f"skipped: {found.advice}")
    c = CBlock(block, REALS[real], guards)

    def write(folder: Path) -> Subject:
        if by == "symfric":
            return of_c(c, folder)
        return by_casadi(block, real, folder, functions_of_float=by != "casadi")

    further = regimes(block)
    inputs = np.vstack([day(block, steps), *further.values()])
    rows, cost = _on_core(c, Target(CORES[core], found, flags), write, inputs, steps, further)
    expected = run_vm(CBlock(block, c.real), inputs, rows[:, : len(block.states)])
    error = _error(block, rows, expected[:, : rows.shape[1]])
    return BlockMeasurement(block.name, real, core, by, error=error, **cost)


def measure_fixed(made: FixedPoint, core: str = "m0plus") -> BlockMeasurement:
    """Measure a step in fixed point, as `measure` does; its error is that of the block.

    Inputs are those of `measure`, clamped to their ranges.
    """
    checks.choice("embedded: core", core, CORES)
    block, real, tools = made.model, made.c.real.name, find_tools()
    if isinstance(tools, Absent):
        return BlockMeasurement(block.name, real, core, status=f"skipped: {tools.advice}")
    names, ends = [v.name for v in block.inputs], [*(v.name for v in block.states), *block.outputs]
    further = regimes(block)
    inputs = made.clamped(names, np.vstack([day(block, STEPS), *further.values()]))
    target, whole = Target(CORES[core], tools, ("-O2",)), np.rint(inputs * made.scales(names))
    write = partial(of_c, made.c)
    rows, cost = _on_core(made.c, target, write, whole, STEPS, further)
    found = rows / made.scales(ends)
    error = _error(block, found, made.expected(found, inputs))
    return BlockMeasurement(block.name, real, core, error=error, **cost)


def _on_core(
    c: CBlock, target: Target, write: Callable[[Path], Subject], inputs: Array, steps: int,
    further: Iterable[str],
) -> tuple[Array, dict[str, Any]]:  # fmt: skip
    """Return the results of every step on a core, and fields of a `BlockMeasurement`.

    Args:
        write: function that writes the step into a folder.
        inputs: inputs of `steps` steps, then those of the regimes `further`.
    """
    columns = len(c.block.states) + len(c.block.outputs)
    with TemporaryDirectory(prefix="symfric-") as name:
        folder = Path(name)
        source, parts = write(folder)
        words, count = counted(target, folder, source, parts, c.real.name, inputs, columns)
        rows = words["rows"].view(c.real.kind).reshape(-1, columns).astype(float)
        equal = _equal(c, source, inputs, rows)
    means = count[steps:].reshape(-1, STRETCH).mean(axis=1).tolist()
    return rows, {
        "equal": equal,
        "finite": bool(np.isfinite(rows).all()),
        "average": float(count[:steps].mean()),
        "maximum": float(round(count.max())),
        "regimes": dict(zip(further, means, strict=True)),
    } | {name: int(words[name][0]) for name in ("text", "library", "data", "stack")}


def counted(
    target: Target,
    folder: Path,
    source: Path,
    parts: Mapping[str, str],
    real: str,
    inputs: Array,
    columns: int,
    *,
    shift: int = SHIFT,
    limit: float = PATIENCE,
) -> tuple[dict[str, NDArray[np.uint32]], Array]:
    """Run `source` on a core; return the words of `sources/measured.c` and the instructions.

    Args:
        target: core with tools and flags.
        folder: folder for the files of the program.
        source: file with the step.
        parts: other placeholders of `sources/measured.c`.
        real: floating-point type.
        inputs: inputs of every step, shape (steps, inputs).
        columns: number of results of a step.
        shift, limit: see `Target.heard`.
    """
    rows = [f"{{{literals(row, real) or '0'}}}" for row in inputs.tolist()]
    main = filled(
        SOURCES / "measured.c",
        real=real,
        steps=len(inputs),
        inputs=max(inputs.shape[1], 1),
        columns=columns,
        values=",\n".join(rows),
        **parts,
    )
    image = target.linked(folder, main, (source,))
    words = target.heard(image, shift=shift, limit=limit)
    return words, (words["ticks"] - words["idle"].mean()) * (1e9 / CLOCK / 2**shift)


def _error(block: Block, a: Array, b: Array) -> float:
    """Return the largest difference of a column relative to its peak in `b`.

    A peak counts as at least a thousandth of the largest peak of the same unit, because a signal
    such as the torque of an upright axis under gravity may consist of rounding errors.
    """
    units = np.array([v.unit for v in (*block.states, *block.outputs.values())])
    peak = np.abs(b).max(axis=0, initial=0.0)
    family = np.array([peak[units == unit].max() for unit in units])
    scale = np.maximum(peak, FAMILY * family)
    ratio = np.abs(a - b).max(axis=0, initial=0.0) / np.where(scale > 0.0, scale, 1.0)
    return float(np.where(np.isnan(ratio), inf, ratio).max(initial=0.0))


def _equal(c: CBlock, source: Path, inputs: Array, rows: Array) -> float:
    """Return the fraction of numbers with the same bits as on the host.

    NaN without a compiler on the host, or for C of CasADi.
    """
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
    """Return the number of wrong results of the unit test of a kit on a core under QEMU.

    Args:
        generated: result of `generate`, which includes the type `real`.
        real: floating-point type.
        core: one of `CORES`.
        flags: flags of the compiler.
        tools: result of `find_tools`.

    Raises:
        ValueError: an unknown core, or a type that was not generated.
        CompileError: tools are absent, the compiler rejects the code, or the program fails.
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
        options = (f"-D{name.upper()}_TEST_NO_MAIN", f"-I{generated.folder}")
        main = filled(SOURCES / "test.c", name=name)
        image = target.linked(Path(folder), main, sources, *options)
        return int(target.heard(image)["wrong"][0])


STRETCH = 20
"""Number of consecutive steps with the same type of motion."""

LOADS = (1.0, 1.5, 0.5, 1.0, 0.1, 10.0)
"""Consecutive levels of a load relative to its nominal value, which step up to a hundredfold."""


REGIMES = {"rest": 0.0, "creeping": 1e-3, "sliding": 0.5, "no load": 0.5}
"""Inputs relative to their nominal values, in steady motion; without load, loads are 0."""


def regimes(block: Block) -> dict[str, Array]:
    """Return the inputs of `STRETCH` equal steps in each regime that the block has."""
    low, nominal = np.array([(v.lower, v.nominal) for v in block.inputs]).reshape(-1, 2).T
    load = (low >= 0.0) & np.array([v.unit in ("N", "N m") for v in block.inputs], bool)
    found = {
        name: nominal * np.where(load, name != "no load", np.where(low >= 0.0, 1.0, level))
        for name, level in REGIMES.items() if load.any() or name != "no load"
    }  # fmt: skip
    return {name: np.tile(row, (STRETCH, 1)) for name, row in found.items()}


def day(block: Block, steps: int) -> Array:
    """Return inputs of every step, shape (steps, inputs), the same at each call.

    Every 20 steps, the type of motion changes; the five types are shuffled and equally frequent.
    Relative to the nominal value, they are a slow sine through zero, bursts up to 2, values of
    1e-12 ... 1e-3 of either sign, reversals between -0.1 and 0.1, and rest. A load (lower bound 0
    or more) varies by a tenth around levels that jump every 20 steps by factors up to 100.
    """
    random = np.random.default_rng(0)
    columns = [np.zeros((steps, 0)), *(_signal(v, steps, random) for v in block.inputs)]
    lower, upper = np.array([(v.lower, v.upper) for v in block.inputs]).reshape(-1, 2).T
    return np.clip(np.column_stack(columns), lower, upper)


def _signal(variable: Variable, steps: int, random: np.random.Generator) -> Array:
    k, count = np.arange(steps), -(-steps // STRETCH)
    if variable.lower >= 0.0:
        levels = np.resize(LOADS, count).repeat(STRETCH)[:steps]
        return variable.nominal * levels * (1.0 + 0.1 * np.sin(0.3 * k + random.uniform(0.0, 6.0)))
    pieces = motions(random, steps, 0.15, 0.6, 0.1)
    turns = np.resize(np.arange(len(pieces)), count)
    random.shuffle(turns)
    return variable.nominal * np.choose(turns.repeat(STRETCH)[:steps], pieces)
