"""Verification of generated C against CasADi."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import Block
from symfric.codegen.compared import TOLERANCE, Run, excitation, spoiled, terms, ulp, varied
from symfric.codegen.generated import Generated
from symfric.codegen.guards import HUGE, Status
from symfric.codegen.layout import prefix
from symfric.codegen.routines import routines
from symfric.codegen.runner import (
    compile_object,
    link_program,
    needed_symbols,
    program,
    run_c,
    run_vm,
    signals,
)
from symfric.emitter.c99 import REALS, Real
from symfric.foundation.checks import kind
from symfric.foundation.files import write_text
from symfric.foundation.programs import CompileError, Compiler, find_compiler, missing_compiler

Array = NDArray[np.float64]

STEPS = 20_000
FEWER = 4000
"""Number of steps with bad inputs, and with other parameters."""


@final
@dataclass(frozen=True)
class Check:
    """Result of the verification of one floating point type.

    Attributes:
        real: "double" or "float".
        steps: number of steps compared.
        warnings: of the compiler.
        ulp: in double, the largest distance from CasADi in units in the last place; 0 means equal
            bits (except for the sign of a zero). None in float.
        error: largest difference from CasADi, which computes in double from the same rounded
            inputs and parameters, relative to the magnitude of each signal: its nominal value, its
            peak, or the size of the terms it is the difference of, see `magnitudes`, whichever is
            the largest. In float every step starts from the states of the C: a contact that breaks
            away some rounding errors later is not an error of the C.
        foreign: undefined names of the object file other than functions of math.h in its own type;
            None without `nm`.
        runs_away: the step after which a state is huge or not finite in CasADi, too; None if none.
        worst: the signal that differs most, "" without a difference.
        rounding: change of that signal, in the unit of `error`, when every operation of CasADi in
            that step is rounded to float, to nearest and randomly up or down; an error of that
            size is caused by the type, not by the C. None if unknown, in double, and if the error
            is small.
        ties: in float, steps in which a mode of 0 or 1 differs because its decision ties: with its
            operations rounded, CasADi also gives the mode of the C. All other signals in these
            steps are compared as usual.
    """

    real: str
    steps: int
    warnings: tuple[str, ...]
    ulp: int | None
    error: float
    foreign: tuple[str, ...] | None
    runs_away: int | None = None
    worst: str = ""
    rounding: float | None = None
    ties: int = 0

    @property
    def near(self) -> bool:
        """True for equal bits in double, small errors in float."""
        return self.error <= TOLERANCE if self.ulp is None else self.ulp == 0

    @property
    def ok(self) -> bool:
        """True if there are no warnings, no foreign names, no differences and only finite
        values.
        """
        return self.near and not self.warnings and not self.foreign and self.runs_away is None

    @property
    def why(self) -> str:
        """Reason of the failure; "" if there is none."""
        if self.ulp:
            return f"{self.worst} differs from CasADi by {self.ulp} ulp"
        if not self.error <= TOLERANCE:
            off = f"{self.worst} is off by {self.error:.1e} of its magnitude"
            if self.rounding is None or not self.error <= ROUNDINGS * self.rounding:
                return f"{off}, more than rounding explains"
            return f"{off}, by rounding: float moves it by {self.rounding:.1e} in that step"
        if self.warnings:
            return self.warnings[0]
        return f"it needs {', '.join(self.foreign)}" if self.foreign else ""


ROUNDINGS = 4.0
"""Safety factor on the observed random rounding, which need not contain the worst case."""


@final
@dataclass(frozen=True)
class Verification:
    """Result of `verify`.

    Attributes:
        name: of the block.
        status: "verified", or a sentence with the reason.
        compiler: the command, None without one.
        checks: one for each floating point type.
    """

    name: str
    status: str
    compiler: str | None
    checks: tuple[Check, ...]

    @property
    def ok(self) -> bool:
        """True if every check passed."""
        return self.status == VERIFIED

    def to_dict(self) -> dict[str, Any]:
        """Return the content as plain types, for JSON."""
        return asdict(self) | {
            "ok": self.ok,
            "checks": [asdict(c) | {"ok": c.ok, "why": c.why} for c in self.checks],
        }

    def table(self) -> str:
        """Return a few lines of text."""
        head = f"{self.name}: {self.status}" + (f" ({self.compiler})" if self.compiler else "")
        if not self.checks:
            return head
        rows = [("real", "steps", "warnings", "bits", "error", "of", "ties", "foreign symbols")]
        rows += [_row(check) for check in self.checks]
        widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
        lines = (
            "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
            for row in rows
        )
        return "\n".join([head, *lines])


VERIFIED = "verified"


def verify(
    generated: Generated,
    *,
    compiler: str | None = None,
    adjustable: Callable[[], Block] | None = None,
) -> Verification:
    """Compile generated C, run it on the same inputs as CasADi and compare.

    There are three fixed pseudo-random sequences: 20 000 steps of `excitation` (slow sines, bursts,
    reversals, velocities down to 1e-12, exact zeros, loads that jump a thousandfold or vanish); for
    guarded C 4000 with NaN, infinities and absurd numbers, `spoiled`; and if there are parameters
    4000 with other values, including step sizes over three decades, `varied`. The guards of the C
    are repeated in NumPy, and the status is compared as well. The C is compiled with -O2
    -ffp-contract=off; if a compiler may fuse multiply and add, the last bits differ. A step in
    which float overflows, such as a plant under an absurd force, and reports it by its status is
    not compared.

    A plant that diverges under these inputs, in CasADi as in C, fails: its step is too long, and
    the status gives the longest of some shorter ones that is not, if h is a parameter.

    In float a signal may exceed the tolerance although the C is correct: where friction is steep,
    the last bit of the velocity has such an effect. That fails, too, with an explanation in the
    status. A mode, such as that of an element that returns to its limit exactly, may change one
    step earlier or later; that is not an error if CasADi rounded to float does the same, and is
    counted in `ties`.

    Args:
        generated: returned by `generate`.
        compiler: command that takes gcc's options; default $CC if it exists, else gcc or clang.
        adjustable: returns the same block with its step size h as a parameter, to search for a
            shorter one if it is a constant.

    Returns:
        The findings. Without a compiler, or with one whose programs do not run here, the status
        begins with "not verified"; nothing is raised.

    Raises:
        ValueError: `compiler` is given and does not exist.
    """
    kind("verify", generated, Generated, "what generate(...) returned")
    block, found = generated.block, find_compiler(compiler)
    if found is None:
        return Verification(block.name, f"not verified: {missing_compiler()}", None, ())
    given, of = _given(generated), cache(partial(terms, block))
    checks: list[Check] = []
    try:
        for real in generated.reals:
            checks.append(_check(generated, REALS[real], found, given, of))
    except CompileError as error:
        return Verification(block.name, f"not verified: {error}", str(found), tuple(checks))
    wrong = [f"{check.real}: {check.why}" for check in checks if not check.ok]
    status = f"failed in {'; in '.join(wrong)}" if wrong else VERIFIED
    lost = [check.runs_away for check in checks if check.runs_away is not None]
    if lost:
        whole = block if adjustable is None or "h" not in block.constants else adjustable()
        status = f"failed: {_too_long(whole, step_size(block), lost[0], given[0][0])}"
    return Verification(block.name, status, str(found), tuple(checks))


def _too_long(block: Block, h: float | None, steps: int, inputs: Array) -> str:
    """Describe a block that diverges, and suggest a remedy."""
    if h is None:
        return f"it runs away within {steps} steps, in CasADi as in C; check signs and parameters"
    said = f"after {steps} steps of {h:g} s it runs away, in CasADi as in C: that step is too long"
    shorter = longest_step(block, inputs, h)
    if shorter is None:
        return f"{said}; try a shorter one, or the method backward_euler, which is the most robust"
    return f"{said}, {shorter:g} s is not"


Given = list[tuple[Array, Array | None]]
"""Inputs and, where they are not the defaults of the C, parameters of every run."""


def _given(generated: Generated) -> Given:
    block = generated.block
    found: Given = [(excitation(block, STEPS), None)]
    few = found[0][0][:FEWER]
    if generated.guards and block.inputs:
        found.append((spoiled(block, few), None))
    if block.parameters:
        parameters = varied(block, FEWER, 10.0)
        rows = run_vm(block, REALS["double"], few, parameters=parameters, guards=False)
        if runs_away(block, rows) is not None:  # a plant needs no steps longer than its own
            parameters = varied(block, FEWER, 1.0)
        found.append((few, parameters))
    return found


def _check(
    generated: Generated,
    real: Real,
    compiler: Compiler,
    given: Given,
    of: Callable[[], ca.Function],
) -> Check:
    block = generated.block
    with TemporaryDirectory(prefix="symfric-") as name:
        folder = Path(name)
        target, main = folder / f"{prefix(block, real)}.o", folder / "main.c"
        warnings = compile_object(compiler, generated.source(real.name), target)
        write_text(main, program(block, real, generated.guards))
        link_program(compiler, [main, target], generated.folder, folder / "main")
        runs = [
            Run(generated, real, *g, *_rows(generated, real, folder / "main", *g), of)
            for g in given
        ]
        needed = needed_symbols(target)
        allowed = _allowed(block, real, generated.guards)
    worst = max(runs, key=lambda run: run.error)
    return Check(
        real=real.name,
        steps=sum(len(run.rows) for run in runs),
        warnings=tuple(warnings),
        ulp=max(ulp(run.rows, run.expected) for run in runs) if real.size == 8 else None,
        error=worst.error,
        foreign=None if needed is None else tuple(sorted(needed - allowed)),
        runs_away=runs_away(block, runs[0].expected),
        worst=worst.worst,
        rounding=worst.rounding if real.size == 4 and worst.error > TOLERANCE else None,
        ties=sum(int(run.tied.any(axis=1).sum()) for run in runs),
    )


def _rows(
    generated: Generated, real: Real, executable: Path, inputs: Array, parameters: Array | None
) -> tuple[Array, Array]:
    """Return the results of one sequence of inputs, by C and by CasADi."""
    block, guards = generated.block, generated.guards
    rows = run_c(block, real, executable, inputs, parameters, guards=guards)
    own = rows[:, : len(block.states)] if real.size == 4 else None
    return rows, run_vm(block, real, inputs, own, parameters, guards=guards)


def _allowed(block: Block, real: Real, guards: bool) -> set[str]:
    """Return the allowed functions: those of math.h, and memcpy, by which compilers copy
    structs.
    """
    functions = {call for routine in routines(block, real, guards) for call in routine.calls}
    if {"sin", "cos"} <= functions:
        functions.add("sincos")
    own = {f"{function}{real.letter}" for function in functions}
    return own | {"_GLOBAL_OFFSET_TABLE_", "memcpy"}


def _row(check: Check) -> tuple[str, ...]:
    bits = "-" if check.ulp is None else "equal" if check.ulp == 0 else f"{check.ulp} ulp"
    foreign = "not checked" if check.foreign is None else " ".join(check.foreign) or "none"
    error = f"{check.error:.1e}" if check.error else "0"
    numbers = check.real, str(check.steps), str(len(check.warnings)), bits, error
    return *numbers, check.worst or "-", str(check.ties), foreign


SHORTER = (0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3)


def runs_away(block: Block, rows: Array) -> int | None:
    """Return the first step after which a state is huge or not finite, or restarts; None if none.

    Args:
        rows: returned by `run_vm`.
    """
    scale = np.array([v.nominal for v in block.states])
    lost = ~(np.abs(rows[:, : scale.size]) <= HUGE * scale).all(axis=1)
    if rows.shape[1] == len(signals(block)):
        lost |= (rows[:, -1].astype(int) & int(Status.STATE | Status.OUTPUT)) != 0
    return int(np.argmax(lost)) + 1 if lost.any() else None


def step_size(block: Block) -> float | None:
    """Return the step size [s] of a block that has one, as a parameter or as a constant."""
    starts = {v.name: float(v.start) for v in block.parameters}
    return starts.get("h", block.constants.get("h"))


def longest_step(block: Block, inputs: Array, below: float) -> float | None:
    """Return the longest step size [s] of a few below `below` that does not diverge.

    Args:
        block: with its step size h as a parameter; None for others.
        inputs: of every step, shape (steps, inputs).
        below: the step size that is too long [s].
    """
    if all(v.name != "h" for v in block.parameters):
        return None
    for part in SHORTER:
        h = float(f"{part * below:.3g}")
        shorter = replace(
            block,
            parameters=tuple(replace(v, start=h) if v.name == "h" else v for v in block.parameters),
        )
        if runs_away(block, run_vm(shorter, REALS["double"], inputs, guards=False)) is None:
            return h
    return None
