"""Files of a block in fixed point, and their comparison with CasADi."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import ceil, floor, inf
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import final

import casadi as ca
import numpy as np

from symfric.codegen.blocks.block import GROUPS, Block, CBlock
from symfric.codegen.blocks.from_law import law_block
from symfric.codegen.fixed.bounds import Bounds, analysed
from symfric.codegen.fixed.formulas import IntegerWriter
from symfric.codegen.fixed.lowered import Hull, lowered, narrowed, recognised
from symfric.codegen.fixed.operations import bits_of
from symfric.codegen.guards import STEP_SIZE
from symfric.codegen.runner import compile_object, compiled, evaluated, run_c
from symfric.codegen.source import header, source
from symfric.emitter.branches import placed
from symfric.emitter.c99 import INTEGER
from symfric.foundation import checks
from symfric.foundation.files import write_text
from symfric.foundation.graph import Graph
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import Variable
from symfric.foundation.programs import Compiler
from symfric.laws import Law


@final
@dataclass(frozen=True, eq=False)
class FixedPoint:
    """C of a block in fixed point.

    Attributes:
        model: the block with real numbers.
        c: the block with integers, whose texts state formats and bounds.
        folder: folder of the files.
        bits: fractional bits of each state, input and output by name.
        ranges: range of each state and input by name.
        errors: proven largest error of each state after a step, and of each output, by name.
    """

    model: Block
    c: CBlock
    folder: Path
    bits: Mapping[str, int]
    ranges: Mapping[str, Hull]
    errors: Mapping[str, float]

    @property
    def files(self) -> tuple[Path, Path]:
        """Header and source."""
        return self.folder / f"{self.c.name}.h", self.folder / f"{self.c.name}.c"

    def scales(self, names: Sequence[str]) -> Array:
        """Return the integers of one unit of some variables."""
        return 2.0 ** np.array([self.bits[name] for name in names])

    def clamped(self, names: Sequence[str], values: Array) -> Array:
        """Return states or inputs, shape (steps, names), within their ranges, as in the C."""
        scales = self.scales(names)
        low, high = np.array([self.ranges[name] for name in names]).reshape(-1, 2).T * scales
        return np.clip(values, np.ceil(low) / scales, np.floor(high) / scales)

    def expected(self, found: Array, inputs: Array) -> Array:
        """Return states and outputs by CasADi in every step, from the states of the C before it.

        Args:
            found: states and outputs of the C, shape (steps, states + outputs).
            inputs: inputs in their units, shape (steps, inputs).
        """
        names = [v.name for v in self.model.states]
        before = np.vstack([np.zeros(len(names)), found[:-1, : len(names)]])
        given = self.clamped(names, before), np.zeros((len(inputs), 0)), inputs
        most = [max(map(abs, self.ranges[name])) for name in names]
        most = np.array(most + [inf] * len(self.model.outputs))
        return np.clip(evaluated(self.model.step, *given), -most, most)


def fixed_point(
    law: Law | Block,
    out: str | Path,
    ranges: Mapping[str, Hull],
    *,
    name: str | None = None,
    h: float | None = None,
) -> FixedPoint:
    """Write a law as C99 with integers of 32 bits, for cores without a floating-point unit.

    All parameters are constants. The formats of all values follow from the `ranges` of the inputs;
    inputs are clamped to them, so that the error of the force, stated in the header, holds for all
    bits. Products have 64 bits. Functions are tables of polynomials of fourth degree.

    Args:
        law: a law, or a block without parameters.
        out: folder, created if missing.
        ranges: (lowest, highest) value of each input and state by name.
        name: C identifier; default the name of the law.
        h: step size [s] of a law with states.

    Raises:
        ValueError: inputs or states without a range, operations that fixed point lacks, or values
            that are not bounded over the ranges.
    """
    folder = checks.path("fixed point: out", out)
    model = law_block(law, name=name, fold=True, h=h) if isinstance(law, Law) else law
    own = _ranges(model, ranges)
    entries = {(i, j): own[v.name] for i in (2, 0) for j, v in enumerate(model.groups[GROUPS[i]])}
    whole, found = _analysed(model, entries)
    results = [i for row in whole.results for i in row]
    names = [*(v.name for v in model.states), *model.outputs]
    bits = {name: bits_of(max(map(abs, ends))) for name, ends in own.items()}
    bits = dict(zip(names, (found.formats[i] for i in results), strict=True)) | bits
    errors = dict(zip(names, found.errors.tolist(), strict=True))
    limits = {
        n: (ceil(low * 2.0 ** bits[n]), floor(high * 2.0 ** bits[n]))
        for n, (low, high) in own.items()
    }
    texts = _described(model, own, bits, errors, _settled(model, found))
    writer = IntegerWriter(whole, found.formats, f"{model.name}_{INTEGER.suffix}", model, limits)
    c = CBlock(texts, INTEGER, False, writer)
    made = FixedPoint(model, c, folder, bits, own, errors)
    for file, text in zip(made.files, (header(c), source(c)), strict=True):
        write_text(file, text)
    return made


def _ranges(block: Block, given: Mapping[str, Hull]) -> dict[str, Hull]:
    """Return the range of each state and input of a block, limited by its bounds.

    Raises:
        ValueError: all problems at once, with parameters of the block.
    """
    where, variables = f"fixed point '{block.name}'", (*block.states, *block.inputs)
    checks.check_names(f"{where}: ranges", given, [v.name for v in variables])
    missing = [f"{v.name} [{v.unit}]" for v in variables if v.name not in given]
    problems = [f"expected a range of {', '.join(missing)}, got none"] * bool(missing)
    free = [v.name for v in block.parameters]
    if STEP_SIZE in free:
        problems.append("expected a step size, got none; add h, such as 0.001 (--step-size 0.001)")
    elif free:
        problems.append(f"expected a block without parameters, got {', '.join(free)}")
    found = dict[str, Hull]()
    for v in variables:
        low, high = given.get(v.name, (0.0, 1.0))
        found[v.name] = max(float(low), v.lower), min(float(high), v.upper)
        if not (np.isfinite(found[v.name]).all() and found[v.name][0] < found[v.name][1]):
            problems.append(f"{v.name}: expected low < high in its bounds, got {low:g} to {high:g}")
    if problems:
        raise ValueError(f"{where}: {'; '.join(problems)}")
    return found


COARSEST = 0.1
"""Largest error of an output, relative to its largest value."""


def _analysed(block: Block, ranges: Mapping[tuple[int, int], Hull]) -> tuple[Graph, Bounds]:
    """Return the graph of a step in fixed point, with its formats and bounds."""
    where = f"fixed point '{block.name}'"
    limits = [max(map(abs, ranges[0, j])) for j in range(len(block.states))]
    whole = lowered(recognised(block.step), limits, where)
    try:
        first = analysed(placed(whole), ranges)
        whole = narrowed(whole, first.hulls, first.cones)
        found = analysed(placed(whole), ranges)
    except ArithmeticError as error:
        raise ValueError(
            f"{where}: expected values that are bounded over the ranges, got {error}; narrow the "
            "ranges, and let loads that divide stay above 0"
        ) from error
    states, middles = len(block.states), found.boxes.mean(axis=1).T
    u, x = np.split(middles, [len(block.inputs)], axis=1)
    largest = np.abs(evaluated(block.step, x, np.zeros((len(x), 0)), u)).max(axis=0)
    for name, most, size in zip(
        block.outputs, found.errors[states:], largest[states:], strict=True
    ):
        if most > COARSEST * size:
            raise ValueError(
                f"{where}: expected an error of {name} below a tenth of its largest value, got "
                f"{most:.2g} {block.outputs[name].unit}; narrow the ranges, or choose a law "
                "without jumps"
            )
    return whole, found


SLOWEST = (0.1, 1e-2, 1e-3)
"""Magnitudes of the first input, relative to its range, for which the errors of steps are added."""


def _settled(block: Block, found: Bounds) -> list[str]:
    """Return sentences that estimate the error of a single state after any number of steps.

    A step multiplies the error e of the state by at most k, its derivative, and adds the error d of
    one step. If e is below d / (1 - k) in every box, it remains so. k is the maximum over the
    corners of a box, which is that of the box if the derivative is monotone.
    """
    if len(block.states) != 1:
        return []
    z, p, u = block.step.sx_in()
    slope = ca.Function("slope", [z, p, u], [ca.densify(ca.jacobian(block.step(z, p, u)[0], z))])
    count, steepest = found.boxes.shape[2], np.zeros(found.boxes.shape[2])
    for ends in product((0, 1), repeat=len(found.boxes)):
        corner = np.array([row[end] for row, end in zip(found.boxes, ends, strict=True)]).T
        given = corner[:, -1:], np.zeros((count, 0)), corner[:, :-1]
        steepest = np.maximum(steepest, np.abs(evaluated(slope, *given))[:, 0])
    errors = found.by_box[0] / np.maximum(1.0 - steepest, 1e-300)
    least, most = np.abs(found.boxes[0]).min(axis=0), np.abs(found.boxes[0]).max()
    first, state, sentences = block.inputs[0], block.states[0], list[str]()
    for share in SLOWEST:
        total = float(errors[least >= 0.5 * share * most].max(initial=0.0))
        sentences.append(
            f"While |{first.name}| >= {share * most:g} {first.unit}, the errors of all steps add "
            f"up to {_above(total)} {state.unit} of {state.name}. This is an estimate: the "
            "contraction of a step is taken at the corners of the ranges."
        )
    return sentences


def _described(
    block: Block, ranges: Mapping[str, Hull], bits: Mapping[str, int],
    errors: Mapping[str, float], settled: Sequence[str],
) -> Block:  # fmt: skip
    """Return the block with integers: formats, ranges and errors are in its texts."""

    def scaled(v: Variable) -> Variable:
        low, high = ranges[v.name]
        start = round(float(v.start) * 2.0 ** bits[v.name])
        doc = f"{v.doc}, times 2^{bits[v.name]}".removeprefix(", ")
        return replace(v, doc=doc, start=start, lower=low, upper=high)

    outputs = {
        n: replace(o, doc=f"{o.doc}, times 2^{bits[n]}, error at most {_above(errors[n])}")
        for n, o in block.outputs.items()
    }
    said = "In a step from exact states, the error of {} is at most {} {}."
    use = [said.format(v.name, _above(errors[v.name]), v.unit) for v in block.states]
    use += [
        "Numbers are integers: the value in its unit times a power of two.",
        "Inputs and states beyond their ranges are clamped to them. Errors are proven over the "
        "ranges, for exact inputs.",
    ]
    return replace(
        block, states=tuple(map(scaled, block.states)), inputs=tuple(map(scaled, block.inputs)),
        outputs=outputs, resets={}, use=(*block.use, *use, *settled),
    )  # fmt: skip


def _above(error: float) -> str:
    """Return a number of three digits that is not below `error`."""
    return f"{1.006 * error:.3g}"


COUNT = 100_000
"""Number of steps that the command line compares."""
ROUNDED = 4.0
"""Error of a result of CasADi in double [units in the last place]."""


def random_inputs(made: FixedPoint, count: int) -> Array:
    """Return inputs of steps, shape (steps, inputs): random ones, then all corners of the ranges.

    A third of the numbers are uniform over the range of the input, a third are near its middle, and
    a third have magnitudes of all orders.
    """
    random, names = np.random.default_rng(0), [v.name for v in made.model.inputs]
    low, high = np.array([made.ranges[name] for name in names]).T
    kinds = random.integers(0, 3, (count, len(names)))
    uniform, half = random.uniform(-1.0, 1.0, kinds.shape), 0.5 * (high - low)
    orders = np.sign(uniform) * 2.0 ** random.uniform(-30.0, 0.0, kinds.shape)
    orders *= np.maximum(np.abs(low), np.abs(high))
    middle = 0.5 * (low + high)
    found = np.choose(kinds, [middle + half * uniform, middle + half * uniform / 4096.0, orders])
    corners = np.array([*product(*zip(low, np.clip(0.0, low, high), high, strict=True))])
    return np.clip(np.vstack([found, corners]), low, high)


def compare(
    made: FixedPoint, compiler: Compiler, inputs: Array
) -> tuple[dict[str, float], list[str]]:
    """Run steps in C and compare each with CasADi from the same state and inputs.

    Args:
        inputs: inputs of every step in their units, shape (steps, inputs).

    Returns:
        The largest difference of each state and output by name, less the rounding of the double
        that it is compared with, and the warnings of the compiler.

    Raises:
        CompileError: the compiler rejects the C, or the program does not run.
    """
    model = made.model
    states, given = ([v.name for v in group] for group in (model.states, model.inputs))
    scales = made.scales(given)
    rounded = made.clamped(given, np.rint(inputs * scales) / scales)
    with TemporaryDirectory(prefix="symfric-") as folder:
        target = Path(folder) / f"{made.c.name}.o"
        warnings = compile_object(compiler, made.files[1], target)
        rows = run_c(made.c, compiled(made.c, [target], made.folder, compiler), rounded * scales)
    names = [*states, *model.outputs]
    found = rows / made.scales(names)
    expected = made.expected(found, rounded)
    worst = (np.abs(found - expected) - ROUNDED * np.spacing(np.abs(expected))).max(axis=0)
    return dict(zip(names, worst.tolist(), strict=True)), warnings
