"""Fuzz test of guarded C under sanitizers: random steps neither crash nor change valid data.

A C program generates the inputs. In half of the steps they are valid (including the ends of their
ranges, zeros, denormals and step sizes of 1e-9 ... 1e3 s); in the others, an input, a parameter or
a state is NaN, infinite, huge, denormal or negative, or all states and some inputs and parameters
are random bits. After every step the program checks that

    outputs are finite (the next step detects states that are not),
    a force F with a limit F_max is within this limit,
    the status agrees with the ranges of inputs, parameters and states before the step, and
    if the status is 0, all bits equal those of the same step generated without guards (not with
    `FAST` flags, with which compilers round differently in each function).

It also counts the steps with default parameters in which the guards replace an output.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import final

import casadi as ca

from symfric.codegen.blocks.block import Block
from symfric.codegen.generated import generate
from symfric.codegen.guards import STEP_SIZE, parameter_range, range_of, state_limit
from symfric.codegen.layout import TEMPLATES, CBlock, filled
from symfric.emitter.c99 import REALS, Real
from symfric.foundation import checks
from symfric.foundation.files import write_text
from symfric.foundation.graph import graph
from symfric.foundation.programs import PATIENCE, Compiler, finished

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
        write_text(folder / "main.c", _program(c, bare, compared=not fast))
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


def _program(c: CBlock, bare: CBlock, *, compared: bool) -> str:
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
