"""Contract of guarded C: a fuzz test under sanitizers, and a proof by abstract interpretation.

No bits of states, inputs and parameters cause an undefined operation; all outputs are finite, and a
force F with a limit F_max is within this limit.

`fuzz` runs a C program that generates the inputs. In half of the steps they are valid (including
the ends of their ranges, zeros, denormals and step sizes of 1e-9 ... 1e3 s); in the others, an
input, a parameter or a state is NaN, infinite, huge, denormal or negative, or all states and some
inputs and parameters are random bits. After every step the program also checks that

    the status agrees with the ranges of inputs, parameters and states before the step, and
    if the status is 0, all bits equal those of the same step generated without guards (not with
    `FAST` flags, with which compilers round differently in each function).

Outputs that are not finite are found at once, states by the next step. The program also counts the
steps with default parameters in which the guards replace an output.

`prove` analyses one step with Eva of Frama-C, which computes an interval for every number of a
program, from arbitrary bits of states, inputs and parameters (except limits, which have their
defaults). It also proves that an output X with parameters X_low and X_high is between them. Eva
does not follow a number through its bits. The helpers of `guards` that compare bits are therefore
analysed as comparisons of numbers; a test shows that both agree for all floats. Eva assumes
correctly rounded operations, and functions of libm within their mathematical ranges.

Sources: Blazy, Buehler, Yakobowski, *Structuring Abstract Interpreters Through State and Value
Abstractions*, VMCAI 2017; https://frama-c.com.
"""

import re
import shutil
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite, isnan, nan
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import final

import casadi as ca

from symfric.codegen.blocks.block import TEMPLATES, Block, CBlock
from symfric.codegen.generated import generate
from symfric.codegen.guards import (
    STEP_SIZE,
    comparisons,
    parameter_range,
    range_of,
    state_limit,
)
from symfric.codegen.source import header, source
from symfric.emitter.c99 import REALS, Real, filled
from symfric.foundation import checks
from symfric.foundation.files import write_text
from symfric.foundation.graph import graph
from symfric.foundation.programs import (
    PATIENCE,
    CompileError,
    Compiler,
    ProgramError,
    finished,
)

SANITIZED = ("-std=c99", "-O1", "-g", "-ffp-contract=off", "-fsanitize=undefined,address",
             "-fno-sanitize-recover=all")  # fmt: skip

FAST = ("-std=c99", "-O2", "-ffast-math")
"""Flags with which compilers assume that no number is infinite or NaN."""

STEPS = 1_000_000
SLOWEST = 1e-4
"""Time of a step on a loaded machine [s]."""
COUNTS = ("valid", "repaired", "altered", "unflagged", "unfinished", "last_resort", "beyond")


@final
@dataclass(frozen=True)
class Fuzzed:
    """Result of the fuzz test of one block in one type.

    Attributes:
        valid: steps with status 0, whose bits were compared.
        repaired: steps with a nonzero status.
        altered: valid steps whose bits differ from those of the C without guards.
        unflagged: steps with a wrong status.
        unfinished: steps after which an output is not finite.
        last_resort: steps with default parameters in which an output was not finite and has been
            replaced by 0; with other parameters, such as mu_s = 0, or random bits, an output may be
            undefined.
        beyond: steps with a force F above its limit F_max.
        report: output of a sanitizer, or "".
    """

    name: str
    real: str
    steps: int
    valid: int = 0
    repaired: int = 0
    altered: int = 0
    unflagged: int = 0
    unfinished: int = 0
    last_resort: int = 0
    beyond: int = 0
    report: str = ""

    @property
    def ok(self) -> bool:
        """True without a crash, a missing status, a change of valid data, or too large a force."""
        wrong = self.altered + self.unflagged + self.unfinished + self.beyond
        return not (wrong or self.report)


def fuzz(
    block: Block, real: str, compiler: Compiler, *, steps: int = STEPS, fast: bool = False
) -> Fuzzed:
    """Run `steps` random steps of the guarded C of `block`.

    Args:
        block: the block.
        real: "float" or "double".
        compiler: C compiler.
        steps: number of steps.
        fast: compile the block with `FAST` flags instead of sanitizers.

    Raises:
        ValueError: an unknown type, or fewer than one step.
        CompileError: the compiler rejects the C, or has no sanitizers.
    """
    checks.choice("fuzz: real", real, REALS)
    checks.count("fuzz: steps", steps, least=1)
    c = CBlock(block, REALS[real])
    bare = CBlock(replace(block, name=f"{block.name}_bare"), c.real, guards=False)
    with TemporaryDirectory(prefix="symfric-") as name:
        folder = Path(name)
        write_text(folder / "main.c", _fuzzer(c, bare, compared=not fast))
        target, parts = str(folder / "main"), [str(folder / "main.c")]
        for one in (c, bare):
            made = str(
                generate(one.block, folder, real=real, guards=one.guards, kit=False).source(real)
            )
            parts.append(made)
            if fast:  # the checks of the program itself need NaN
                parts[-1] = f"{made}.o"
                compiler.run(*FAST, "-c", made, "-o", parts[-1])
        flags = ("-std=c99", "-O1") if fast else SANITIZED
        compiler.run(*flags, f"-I{folder}", *parts, "-o", target, "-lm")
        done = finished([target, str(steps)], limit=PATIENCE + SLOWEST * steps)
    numbers = done.output.split()
    if done.status != 0 or len(numbers) != len(COUNTS):
        said = (done.messages or f"it ended with {done.status}").strip()
        return Fuzzed(block.name, real, steps, report=said[:2000])
    found = dict(zip(COUNTS, map(int, numbers), strict=True))
    return Fuzzed(block.name, real, steps, **found)


def _fuzzer(c: CBlock, bare: CBlock, *, compared: bool) -> str:
    """Return the C program that calls the block with numbers in and outside its ranges."""
    block = c.block
    inputs = [range_of(v) for v in block.inputs]
    parameters = [parameter_range(v) for v in block.parameters]
    used = {node.entry for node in graph(block.step).nodes if node.op == ca.OP_INPUT}
    columns = {
        "IN_LOW": [r.low for r in inputs],
        "IN_HIGH": [r.high for r in inputs],
        "IN_NOMINAL": [v.nominal for v in block.inputs],
        "IN_USED": [float((2, i) in used) for i in range(len(inputs))],
        "PARAM_LOW": [r.low for r in parameters],
        "PARAM_HIGH": [r.high for r in parameters],
        "PARAM_START": [float(v.start) for v in block.parameters],
        "STATE_LIMIT": [state_limit(v) for v in block.states],
        "STATE_START": [float(v.start) for v in block.states],
    }
    places = {v.name: i for i, v in enumerate(block.parameters)}
    default = "memcpy(param, &{0}_default, sizeof {0}_default);" if block.parameters else ""
    return filled(
        TEMPLATES / "fuzz.c",
        **c.sizes,
        bare=bare.name,
        step_bare=bare.flat_step,
        double=int(c.real.size == 8),
        size=places.get(STEP_SIZE, -1),
        force=[*block.outputs].index("F") if "F" in block.outputs else -1,
        most=places.get("F_max", -1),
        compared=int(compared),
        columns="\n".join(_column(name, values, c.real) for name, values in columns.items()),
        default=default.format(c.name),
    )


def _column(name: str, values: Sequence[float], real: Real) -> str:
    shown = ", ".join(real.literal(value) for value in values) or real.literal(0.0)
    return f"static const {real.name} {name}[] = {{{shown}}};"


PROGRAM = "frama-c"
OPTIONS = ("-no-unicode", "-eva", "-eva-precision", "3", "-warn-special-float", "none")
LIMIT = 600.0
"""Time limit [s]; a plant of many bodies exceeds it and is not proved."""
PROVED = "proved"

COMPARISONS = """\
#define {0}_beyond(x, limit) ((x) != (x) || (x) < -(limit) || (x) > (limit))
#define {0}_outside(x, low, high) ((x) != (x) || (x) < (low) || (x) > (high))
"""
SHOWN = re.compile(r"Frama_C_show_each_(\d+): (.*)")
BEYOND = re.compile(r"Frama_C_show_each_beyond_(\d+):")
NUMBER = re.compile(r"NaN|-?inf|-?\d[-+.\de]*")


@final
@dataclass(frozen=True)
class Proof:
    """Result of the analysis of one block in one type.

    Attributes:
        status: "proved", or a sentence: what is not proved, or which tool is absent.
        ranges: interval of each output, rounded to twelve digits; NaN if Eva cannot exclude NaN.
    """

    name: str
    real: str
    status: str
    ranges: Mapping[str, tuple[float, float]]

    @property
    def ok(self) -> bool:
        """True if everything is proved."""
        return self.status == PROVED


def prove(block: Block, real: str = "float") -> Proof:
    """Analyse one step of the guarded C of `block` for all bits of its numbers.

    Args:
        block: the block.
        real: "float" or "double".

    Raises:
        ValueError: an unknown type.
        CompileError: Frama-C rejects the C.
    """
    checks.choice("prove: real", real, REALS)
    c = CBlock(block, REALS[real])
    if shutil.which(PROGRAM) is None:
        absent = "skipped: frama-c not found; install the package frama-c-base"
        return Proof(block.name, real, absent, {})
    with TemporaryDirectory(prefix="symfric-") as name:
        folder = Path(name)
        write_text(folder / f"{c.name}.h", header(c))
        write_text(folder / "proof.c", _analysed(c))
        try:
            done = finished((PROGRAM, *OPTIONS, str(folder / "proof.c")), limit=LIMIT)
        except ProgramError as error:
            return Proof(block.name, real, f"not proved: {error}", {})
    text = done.output.decode(errors="replace")
    alarms = re.search(r"(\d+) alarms? generated", text)
    if done.status or alarms is None:
        raise CompileError(f"frama-c failed with status {done.status}:\n{text[-2000:]}")
    found = [list[float]() for _ in block.outputs]
    for place, values in SHOWN.findall(text):
        found[int(place)] += map(float, NUMBER.findall(values))
    ranges = {n: _interval(x) for n, x in zip(block.outputs, found, strict=True)}
    beyond = {[*block.outputs][int(place)] for place in BEYOND.findall(text)}
    return Proof(block.name, real, _status(c, int(alarms[1]), ranges, beyond), ranges)


def _status(
    c: CBlock, alarms: int, ranges: Mapping[str, tuple[float, float]], beyond: Collection[str]
) -> str:
    """Return `PROVED`, or a sentence that names what is not proved."""
    doubts = [f"{alarms} operation{'s' * (alarms > 1)} may be undefined"] * bool(alarms)
    doubts += [f"{n} may not be finite" for n, x in ranges.items() if not all(map(isfinite, x))]
    for name, (low, high) in _limits(c).items():
        if name in beyond:
            unit = c.block.outputs[name].unit
            doubts.append(f"{name} may leave {low:g} ... {high:g} {unit}")
    return f"not proved: {', '.join(doubts)}" if doubts else PROVED


def _interval(values: Sequence[float]) -> tuple[float, float]:
    """Return the smallest and the largest value; NaN if one is NaN or there is none."""
    if not values or any(map(isnan, values)):
        return nan, nan
    return min(values), max(values)


def _limits(c: CBlock) -> dict[str, tuple[float, float]]:
    """Return the limits of outputs: defaults of F_max, or of X_low and X_high."""
    value = dict(zip((v.name for v in c.block.parameters), c.default.tolist(), strict=True))
    found = {
        name: (value[f"{name}_low"], value[f"{name}_high"])
        for name in c.block.outputs if {f"{name}_low", f"{name}_high"} <= {*value}
    }  # fmt: skip
    if "F_max" in value and "F" in c.block.outputs:
        found["F"] = -value["F_max"], value["F_max"]
    return found


def _analysed(c: CBlock) -> str:
    """Return the C with helpers that compare numbers, and a step from arbitrary bits."""
    text, parts, limits = source(c), comparisons(c), _limits(c)
    for what in ("bits", "beyond", "outside"):
        text = text.replace(parts[what], "")
    names = {"F_max", *(f"{name}_{end}" for name in limits for end in ("low", "high"))}
    fixed = [
        f"param[{k}] = {c.real.literal(float(v.start))};"
        for k, v in enumerate(c.block.parameters) if v.name in names
    ]  # fmt: skip
    shown = list[str]()
    for k, name in enumerate(c.block.outputs):
        shown.append(f"Frama_C_show_each_{k}(out[{k}]);")
        if name in limits:  # compared here, since Eva prints twelve digits
            low, high = map(c.real.literal, limits[name])
            shown.append(f"if (out[{k}] < {low} || out[{k}] > {high}) {{")
            shown.append(f"    Frama_C_show_each_beyond_{k}(out[{k}]);\n    }}")
    return filled(
        TEMPLATES / "proof.c",
        **c.sizes,
        source=COMPARISONS.format(c.name) + text,
        limits="\n    ".join(fixed),
        shown="\n    ".join(shown),
    )
