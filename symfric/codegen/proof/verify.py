"""Proof that generated C computes what CasADi computes."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import Block
from symfric.codegen.kit.generate import Generated
from symfric.codegen.running.compiler import compile_object, link_program, needed_symbols
from symfric.codegen.running.runaway import longest_step, runs_away, step_size
from symfric.codegen.running.runner import program, run_c, run_vm
from symfric.codegen.writing.layout import prefix
from symfric.codegen.writing.routines import routines
from symfric.emitter.c99 import REALS, Real
from symfric.foundation.checks import kind
from symfric.foundation.compiler import CompileError, Compiler, find_compiler
from symfric.foundation.files import write_text
from symfric.foundation.parameters import Variable

Array = NDArray[np.float64]

TOLERANCE = 1e-5
"""Largest error of float, relative to the peak of each signal."""

STEPS = 20_000


@final
@dataclass(frozen=True)
class Check:
    """What was found about one floating point type.

    Attributes:
        real: "double" or "float".
        steps: number of steps compared.
        warnings: what the compiler warned of.
        ulp: in double, the largest distance from CasADi in units in the last place; 0 means equal
            bits (but for the sign of a zero). None in float.
        error: largest difference from CasADi, which computes in double from the same rounded
            inputs and parameters, relative to the peak of each signal. In float every step begins
            from the states that the C has: a contact that breaks away some rounding errors later
            is no error of the C.
        foreign: what the object file needs besides functions of math.h in its own type; None where
            there is no `nm`.
        runs_away: the step after which a state is huge or not finite in CasADi, too; None if none.
    """

    real: str
    steps: int
    warnings: tuple[str, ...]
    ulp: int | None
    error: float
    foreign: tuple[str, ...] | None
    runs_away: int | None = None

    @property
    def ok(self) -> bool:
        """No warnings, nothing foreign, equal bits in double, small errors in float, all finite."""
        exact = self.error <= TOLERANCE if self.ulp is None else self.ulp == 0
        return exact and not self.warnings and not self.foreign and self.runs_away is None


@final
@dataclass(frozen=True)
class Verification:
    """Result of `verify`.

    Attributes:
        name: of the block.
        status: "verified", or a sentence that says why not.
        compiler: the command, None where there is none.
        checks: one for each floating point type.
    """

    name: str
    status: str
    compiler: str | None
    checks: tuple[Check, ...]

    @property
    def ok(self) -> bool:
        """Whether everything was checked and as it should be."""
        return self.status == VERIFIED

    def to_dict(self) -> dict[str, Any]:
        """The content as plain types, for JSON."""
        return asdict(self) | {
            "ok": self.ok,
            "checks": [asdict(check) | {"ok": check.ok} for check in self.checks],
        }

    def table(self) -> str:
        """A few lines of text."""
        head = f"{self.name}: {self.status}" + (f" ({self.compiler})" if self.compiler else "")
        if not self.checks:
            return head
        rows = [("real", "steps", "warnings", "bits", "error/peak", "foreign symbols")]
        rows += [_row(check) for check in self.checks]
        widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
        lines = (
            "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
            for row in rows
        )
        return "\n".join([head, *lines])


VERIFIED = "verified"
NO_COMPILER = "not verified: no C compiler found; install gcc or clang, or set CC"


def verify(
    generated: Generated,
    *,
    compiler: str | None = None,
    adjustable: Callable[[], Block] | None = None,
) -> Verification:
    """Compile generated C, run it beside CasADi on the same inputs and compare.

    The inputs (a fixed pseudo-random sequence of 20 000 steps) hold slow sines, bursts, reversals,
    velocities down to 1e-12, exact zeros and a varying load. The C is compiled with -O2
    -ffp-contract=off; where a compiler may fuse multiply and add, the last bits differ.

    A plant that runs away under these inputs, in CasADi as in C, fails: its step is too long for
    it, and the status names the longest of some shorter ones that is not, where h is a parameter.

    Args:
        generated: what `generate` returned.
        compiler: command that takes gcc's options; default $CC where it exists, else gcc or clang.
        adjustable: makes the same block with its step size h as a parameter, to look for a shorter
            one where it is a constant.

    Returns:
        The findings. Without a compiler, or with one whose programs do not run here, the status
        begins with "not verified"; nothing is raised.

    Raises:
        ValueError: `compiler` is given and does not exist.
    """
    kind("verify", generated, Generated, "what generate(...) returned")
    block, found = generated.block, find_compiler(compiler)
    if found is None:
        return Verification(block.name, NO_COMPILER, None, ())
    inputs = excitation(block)
    checks: list[Check] = []
    try:
        for real in generated.reals:
            checks.append(_check(generated, REALS[real], found, inputs))
    except CompileError as error:
        return Verification(block.name, f"not verified: {error}", str(found), tuple(checks))
    wrong = [check.real for check in checks if not check.ok]
    status = f"failed in {' and '.join(wrong)}" if wrong else VERIFIED
    lost = [check.runs_away for check in checks if check.runs_away is not None]
    if lost:
        whole = block if adjustable is None or "h" not in block.constants else adjustable()
        status = f"failed: {_too_long(whole, step_size(block), lost[0], inputs)}"
    return Verification(block.name, status, str(found), tuple(checks))


def _too_long(block: Block, h: float | None, steps: int, inputs: Array) -> str:
    """What became of a block that runs away, and what to try."""
    if h is None:
        return f"it runs away within {steps} steps, in CasADi as in C; check signs and parameters"
    said = f"after {steps} steps of {h:g} s it runs away, in CasADi as in C: that step is too long"
    shorter = longest_step(block, inputs, h)
    if shorter is None:
        return f"{said}; try a shorter one, or the method backward_euler, which is the most robust"
    return f"{said}, {shorter:g} s is not"


def _check(generated: Generated, real: Real, compiler: Compiler, inputs: Array) -> Check:
    block = generated.block
    with TemporaryDirectory(prefix="symfric-") as name:
        folder = Path(name)
        target, main = folder / f"{prefix(block, real)}.o", folder / "main.c"
        warnings = compile_object(compiler, generated.source(real.name), target)
        write_text(main, program(block, real, generated.guards))
        link_program(compiler, [main, target], generated.folder, folder / "main")
        rows = run_c(block, real, folder / "main", inputs, guards=generated.guards)
        needed = needed_symbols(target)
        allowed = _allowed(block, real, generated.guards)
    own = rows[:, : len(block.states)] if real.size == 4 else None
    expected = run_vm(block, real, inputs, own, guards=generated.guards)
    return Check(
        real=real.name,
        steps=len(inputs),
        warnings=tuple(warnings),
        ulp=_ulp(rows, expected) if real.size == 8 else None,
        error=_error(rows, expected),
        foreign=None if needed is None else tuple(sorted(needed - allowed)),
        runs_away=runs_away(block, expected),
    )


def excitation(block: Block) -> Array:
    """Inputs of every step, shape (steps, inputs), the same at each call.

    An input with a lower bound of 0 or more, such as a load, varies by half around its nominal
    value; the others see in turn, in units of their nominal value, slow sines, bursts up to 2,
    tiny values of 1e-12 ... 1e-3, a hundred zeros and abrupt reversals.
    """
    random = np.random.default_rng(0)
    return np.column_stack(
        [np.zeros((STEPS, 0)), *(_signal(variable, random) for variable in block.inputs)]
    )


def _signal(variable: Variable, random: np.random.Generator) -> Array:
    k = np.arange(STEPS)
    if variable.lower >= 0.0:
        return variable.nominal * (1.0 + 0.5 * np.sin(0.003 * k + random.uniform(0.0, 6.0)))
    tiny = 10.0 ** random.uniform(-12.0, -3.0, STEPS) * random.choice([-1.0, 1.0], STEPS)
    pieces = [
        0.05 * np.sin(0.008 * k),
        np.clip(random.standard_normal(STEPS), -2.0, 2.0),
        tiny,
        0.1 * np.sign(np.sin(0.03 * k)),
        np.zeros(STEPS),
    ]
    turn = np.repeat(random.integers(0, len(pieces), STEPS // 100), 100)
    return variable.nominal * np.choose(turn, pieces)


def _ulp(a: Array, b: Array) -> int:
    """Largest distance in units in the last place, the largest integer if a value is not finite."""
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        return np.iinfo(np.int64).max
    distance = np.abs(_ordered(a) - _ordered(b))
    return int(distance.max(initial=0))


def _ordered(values: Array) -> NDArray[np.int64]:
    """Integers in the order of the floats, neighbours one apart, both zeros 0."""
    bits = np.ascontiguousarray(values).view(np.int64)
    return np.where(bits < 0, np.iinfo(np.int64).min - bits, bits)


def _error(a: Array, b: Array) -> float:
    """Largest difference of a column relative to its peak in `b`."""
    peak = np.abs(b).max(axis=0, initial=0.0)
    difference = np.abs(a - b).max(axis=0, initial=0.0)
    ratio = np.where(difference == 0.0, 0.0, difference / np.where(peak > 0.0, peak, 1.0))
    return float(np.where(np.isnan(ratio), np.inf, ratio).max(initial=0.0))


def _allowed(block: Block, real: Real, guards: bool) -> set[str]:
    """Functions of math.h, and memcpy, with which compilers copy large structs."""
    functions = {call for routine in routines(block, real, guards) for call in routine.calls}
    if {"sin", "cos"} <= functions:
        functions.add("sincos")
    own = {f"{function}{real.letter}" for function in functions}
    return own | {"_GLOBAL_OFFSET_TABLE_", "memcpy"}


def _row(check: Check) -> tuple[str, ...]:
    bits = "-" if check.ulp is None else "equal" if check.ulp == 0 else f"{check.ulp} ulp"
    foreign = "not checked" if check.foreign is None else " ".join(check.foreign) or "none"
    error = f"{check.error:.1e}" if check.error else "0"
    return check.real, str(check.steps), str(len(check.warnings)), bits, error, foreign
