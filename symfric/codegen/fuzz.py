"""Random steps of guarded C under sanitizers: no crash, and no change of valid data.

The program generates its own inputs. In three steps of four they are valid (including the ends of
their ranges, zeros, denormals and step sizes of 1e-9 ... 1e3 s); in the others an input, a
parameter or a state is NaN, infinite, huge, denormal or negative. For every step it checks that

    outputs are finite (a state that is not is detected by the next step),
    the status agrees with the ranges of inputs, parameters and states before the step, and
    if it is 0, all bits are those of the same step generated without guards.

The replacement of an output that is not finite with the default parameters is counted.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import final

import casadi as ca

from symfric.codegen.blocks.block import GROUPS, Block
from symfric.codegen.generated import generate
from symfric.codegen.guards import parameter_range, range_of, state_limit
from symfric.codegen.layout import TEMPLATES, called, fields, filled, members, prefix
from symfric.emitter.c99 import REALS, Real
from symfric.foundation import checks
from symfric.foundation.files import write_text
from symfric.foundation.graph import graph
from symfric.foundation.programs import Compiler, finished

SANITIZED = ("-std=c99", "-O1", "-g", "-ffp-contract=off", "-fsanitize=undefined,address",
             "-fno-sanitize-recover=all")  # fmt: skip

STEPS = 1_000_000
COUNTS = ("valid", "repaired", "altered", "unflagged", "unfinished", "last_resort")


@final
@dataclass(frozen=True)
class Fuzzed:
    """Result of the fuzz test of one block in one type.

    Attributes:
        valid: steps with a status of 0; their bits were compared.
        repaired: steps with another status.
        altered: valid steps whose bits are not those of the C without guards.
        unflagged: steps with a wrong status.
        unfinished: steps after which an output is not finite.
        last_resort: steps with default parameters in which an output was not finite and has been
            replaced by 0; with others, such as mu_s = 0, an output may be undefined.
        report: output of a sanitizer, "" if empty.
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
    report: str = ""

    @property
    def ok(self) -> bool:
        """True if there was no crash, no missing status and no change of valid data."""
        return not (self.altered or self.unflagged or self.unfinished or self.report)


def fuzz(block: Block, real: str, compiler: Compiler, *, steps: int = STEPS) -> Fuzzed:
    """Run `steps` random steps of the guarded C of `block` under sanitizers.

    Raises:
        ValueError: an unknown type, no steps.
        CompileError: the compiler rejects the C, or has no sanitizers.
    """
    checks.choice("fuzz: real", real, REALS)
    checks.count("fuzz: steps", steps, least=1)
    kind, bare = REALS[real], replace(block, name=f"{block.name}_bare")
    with TemporaryDirectory(prefix="symfric-") as name:
        folder = Path(name)
        sources = [
            generate(block, folder, real=real).source(real),
            generate(bare, folder, real=real, guards=False).source(real),
        ]
        write_text(folder / "main.c", _program(block, bare, kind))
        parts = [str(folder / "main.c"), *map(str, sources)]
        compiler.run(*SANITIZED, f"-I{folder}", *parts, "-o", str(folder / "main"), "-lm")
        done = finished([str(folder / "main"), str(steps)])
    numbers = done.output.split()
    if done.status != 0 or len(numbers) != len(COUNTS):
        said = (done.messages or f"it ended with {done.status}").strip()
        return Fuzzed(block.name, real, steps, report=said[:2000])
    found = dict(zip(COUNTS, map(int, numbers), strict=True))
    return Fuzzed(block.name, real, steps, **found)


DEFAULT = "memcpy(param, &{0}_default, sizeof {0}_default);"


def _program(block: Block, bare: Block, real: Real) -> str:
    """Return the program, with calls and ranges of the block in it."""
    inputs = [range_of(v) for v in block.inputs]
    parameters = [parameter_range(v) for v in block.parameters]
    used = _used(block)
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
    steps = [i for i, v in enumerate(block.parameters) if v.name == "h"]
    return filled(
        TEMPLATES / "fuzz.c",
        guarded=prefix(block, real),
        bare=prefix(bare, real),
        real=real.name,
        double=int(real.size == 8),
        states=len(block.states),
        params=len(block.parameters),
        inputs=len(block.inputs),
        outputs=len(block.outputs),
        size=steps[0] if steps else -1,
        columns="\n".join(_column(name, values, real) for name, values in columns.items()),
        call=_call(block, real, guards=True),
        call_bare=_call(bare, real, guards=False),
        default=DEFAULT.format(prefix(block, real)) if block.parameters else "",
    )


def _used(block: Block) -> set[tuple[int, int]]:
    """Return (argument, row) of the numbers that a step depends on."""
    return {node.entry for node in graph(block.step).nodes if node.op == ca.OP_INPUT}


def _column(name: str, values: Sequence[float], real: Real) -> str:
    shown = ", ".join(real.literal(value) for value in values) or real.literal(0.0)
    return f"static const {real.name} {name}[] = {{{shown}}};"


def _call(block: Block, real: Real, *, guards: bool) -> str:
    """Return statements that copy the numbers into structs, call a step, and copy them back."""
    groups, name = members(block), prefix(block, real)
    short = {group: letter for group, letter in zip(GROUPS, "spuy", strict=True) if group in groups}
    pointers = {group: f"&{letter}" for group, letter in short.items()}
    call = called(block, real, guards, pointers, fields(block, "in"))
    result = "out[0] = " if block.is_function else "status = " * guards
    lines = [f"{name}_{group}_t {letter};" for group, letter in short.items()]
    lines += [f"memcpy(&{s}, {g}, sizeof {s});" for g, s in short.items() if g != "out"]
    lines.append(f"{result}{call};")
    lines += [f"memcpy({g}, &{s}, sizeof {s});" for g, s in short.items() if g in ("state", "out")]
    return "\n    ".join(lines)
