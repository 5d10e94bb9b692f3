"""Proof of the contract of guarded C by abstract interpretation, with Eva of Frama-C.

Eva computes an interval for every number of a program. One step is analysed from arbitrary bits of
states, inputs and parameters (except limits, which have their defaults). It proves that

    no operation is undefined (memory, overflow of integers, shifts, conversions),
    all outputs are finite,
    a force F with a limit F_max is within this limit, and
    an output X with parameters X_low and X_high is between them.

Eva does not follow a number through its bits. The helpers of `guards` that compare bits are
therefore analysed as comparisons of numbers; a test shows that both agree for all floats.
Eva assumes correctly rounded operations, and functions of libm within their mathematical ranges.

Sources: Blazy, Buehler, Yakobowski, *Structuring Abstract Interpreters Through State and Value
Abstractions*, VMCAI 2017; https://frama-c.com.
"""

import re
import shutil
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, isnan, nan
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import final

from symfric.codegen.blocks.block import Block
from symfric.codegen.guards import comparisons
from symfric.codegen.layout import TEMPLATES, CBlock, filled
from symfric.codegen.source import header, source
from symfric.emitter.c99 import REALS
from symfric.foundation import checks
from symfric.foundation.files import write_text
from symfric.foundation.programs import CompileError, ProgramError, finished

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
        write_text(folder / "proof.c", _program(c))
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


def _program(c: CBlock) -> str:
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
