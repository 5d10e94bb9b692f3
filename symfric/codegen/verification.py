"""Verification of generated C against CasADi."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, final

import numpy as np

from symfric.codegen.blocks.block import Block, CBlock
from symfric.codegen.compared import TOLERANCE, ComparedRun, ulp
from symfric.codegen.generated import Generated
from symfric.codegen.guards import HUGE, STEP_SIZE, Status, parameter_range, range_of
from symfric.codegen.runner import compile_object, compiled, needed_symbols, run_c, run_vm
from symfric.codegen.source import routines
from symfric.emitter.c99 import DOUBLE
from symfric.foundation.checks import kind
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import Variable
from symfric.foundation.programs import CompileError, Compiler, find_compiler, missing_compiler
from symfric.foundation.shown import columns

STEPS = 20_000
FEWER = 4000
"""Number of steps with bad inputs, and of steps with other parameters."""


@final
@dataclass(frozen=True)
class Check:
    """Result of the verification of one floating-point type.

    Attributes:
        real: "double" or "float".
        steps: number of steps compared.
        warnings: warnings of the compiler.
        ulp: in double, the largest distance from CasADi in units in the last place; 0 means equal
            bits (except for the sign of a zero). None in float.
        error: largest difference from CasADi, which computes in double from the same rounded
            inputs and parameters, relative to the magnitude of each signal. The magnitude is the
            largest of the nominal value, the peak and the terms of the signal, see `magnitudes`.
            In float, every step starts from the states of the C, so that a break-away delayed by
            rounding is not counted as an error of the C.
        foreign: undefined names of the object file other than functions of math.h in its own type;
            None without `nm`.
        runs_away: first step after which a state is huge or not finite in CasADi; None if none.
        worst: signal with the largest difference; "" if there is no difference.
        rounding: change of that signal, relative as `error`, if every operation of CasADi in that
            step is rounded to float, to nearest and randomly up or down; the type, not the C,
            causes an error of this size. None if unknown, in double, and if the error is small.
        ties: in float, number of steps in which a mode of 0 or 1 differs because its decision ties:
            with rounded operations, CasADi also gives the mode of the C. The other signals of these
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
        """True if the bits are equal (double) or the errors are small (float)."""
        return self.error <= TOLERANCE if self.ulp is None else self.ulp == 0

    @property
    def ok(self) -> bool:
        """True if results agree and are finite, without warnings and foreign names."""
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

    @property
    def row(self) -> tuple[str, ...]:
        """Cells of the row in `Verification.table`."""
        bits = "-" if self.ulp is None else "equal" if self.ulp == 0 else f"{self.ulp} ulp"
        foreign = "not checked" if self.foreign is None else " ".join(self.foreign) or "none"
        error = f"{self.error:.1e}" if self.error else "0"
        numbers = self.real, str(self.steps), str(len(self.warnings)), bits, error
        return *numbers, self.worst or "-", str(self.ties), foreign


ROUNDINGS = 4.0
"""Safety factor on the observed random rounding, which may miss the worst case."""


@final
@dataclass(frozen=True)
class Verification:
    """Result of `verify`.

    Attributes:
        name: name of the block.
        status: "verified", or a sentence with the reason of the failure.
        compiler: command of the compiler; None without a compiler.
        checks: one check for each floating-point type.
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
        """Return the result as a text table."""
        head = f"{self.name}: {self.status}" + (f" ({self.compiler})" if self.compiler else "")
        if not self.checks:
            return head
        rows = [("real", "steps", "warnings", "bits", "error", "of", "ties", "foreign symbols")]
        rows += [check.row for check in self.checks]
        return "\n".join([head, *columns(rows)])


VERIFIED = "verified"


def verify(
    generated: Generated,
    *,
    compiler: str | None = None,
    adjustable: Callable[[], Block] | None = None,
) -> Verification:
    """Compile generated C, run it on the same inputs as CasADi and compare.

    The inputs are three fixed pseudo-random sequences: 20 000 steps of `excitation` (slow sines,
    bursts, reversals, velocities down to 1e-12, exact zeros, loads that jump a thousandfold or
    vanish); for guarded C, 4000 steps with NaN, infinities and absurd numbers (`spoiled`); for
    blocks with parameters, 4000 steps with other values, including step sizes over three decades
    (`varied`). The guards of the C are reimplemented in NumPy, and the status is compared as well.
    The flags are -O2 -ffp-contract=off; if a compiler fuses multiply and add, the last bits differ.
    A step is not compared if it overflows in float and its status reports it, such as that of a
    plant under an absurd force.

    A plant that diverges under these inputs, in CasADi as in C, fails: its step is too long. If h
    is a parameter, the status states the longest of some shorter steps that does not diverge.

    In float, a signal may exceed the tolerance although the C is correct: where friction is steep,
    the last bit of the velocity may have this effect. This fails as well, and the status explains
    it. A mode, such as that of an element that returns to its limit exactly, may change one step
    earlier or later; this is not an error if CasADi rounded to float does the same, and is counted
    in `ties`.

    Args:
        generated: returned by `generate`.
        compiler: command that takes gcc's options; default $CC if it exists, else gcc or clang.
        adjustable: function that returns the same block with its step size h as a parameter, for
            the search for a shorter step if h is a constant of the block.

    Returns:
        The findings. Without a working compiler on this machine, the status begins with "not
        verified" and no error is raised.

    Raises:
        ValueError: `compiler` is given and does not exist.
    """
    kind("verify", generated, Generated, "what generate(...) returned")
    block, found = generated.block, find_compiler(compiler)
    if found is None:
        return Verification(block.name, f"not verified: {missing_compiler()}", None, ())
    sequences = _sequences(block, generated.guards)
    checks: list[Check] = []
    try:
        for real in generated.reals:
            checks.append(_check(generated, generated.c(real), found, sequences))
    except CompileError as error:
        return Verification(block.name, f"not verified: {error}", str(found), tuple(checks))
    wrong = [f"{check.real}: {check.why}" for check in checks if not check.ok]
    status = f"failed in {'; in '.join(wrong)}" if wrong else VERIFIED
    lost = [check.runs_away for check in checks if check.runs_away is not None]
    if lost:
        whole = block if adjustable is None or "h" not in block.constants else adjustable()
        status = f"failed: {_too_long(whole, block.sample_time, lost[0], sequences[0][0])}"
    return Verification(block.name, status, str(found), tuple(checks))


def _too_long(block: Block, h: float | None, steps: int, inputs: Array) -> str:
    """Return a description of a block that diverges, with a remedy."""
    if h is None:
        return f"it runs away within {steps} steps, in CasADi as in C; check signs and parameters"
    said = f"after {steps} steps of {h:g} s it runs away, in CasADi as in C: that step is too long"
    shorter = longest_step(block, inputs, h)
    if shorter is None:
        return f"{said}; try a shorter one, or the method backward_euler, which is the most robust"
    return f"{said}, {shorter:g} s is not"


Sequences = list[tuple[Array, Array | None]]
"""Inputs and parameters of every run; None for the default parameters of the C."""


def _sequences(block: Block, guards: bool) -> Sequences:
    found: Sequences = [(excitation(block, STEPS), None)]
    few = found[0][0][:FEWER]
    if guards and block.inputs:
        found.append((spoiled(block, few), None))
    if block.parameters:
        parameters, bare = varied(block, FEWER, 10.0), CBlock(block, DOUBLE, guards=False)
        if runs_away(bare, run_vm(bare, few, parameters=parameters)) is not None:
            parameters = varied(block, FEWER, 1.0)  # longer steps than its own may diverge
        found.append((few, parameters))
    return found


def _check(generated: Generated, c: CBlock, compiler: Compiler, sequences: Sequences) -> Check:
    is_float, runs = c.real.size == 4, list[ComparedRun]()
    with TemporaryDirectory(prefix="symfric-") as name:
        target = Path(name) / f"{c.name}.o"
        warnings = compile_object(compiler, generated.source(c.real.name), target)
        executable = compiled(c, [target], generated.folder, compiler)
        for inputs, parameters in sequences:
            rows = run_c(c, executable, inputs, parameters)
            states = rows[:, : len(c.block.states)] if is_float else None
            expected = run_vm(c, inputs, states, parameters)
            runs.append(ComparedRun(c, inputs, parameters, rows, expected))
        needed = needed_symbols(target)
    called = {call for routine in routines(c) for call in routine.calls}
    called |= {"sincos"} if {"sin", "cos"} <= called else set()
    allowed = {f"{function}{c.real.letter}" for function in called}
    allowed |= {"_GLOBAL_OFFSET_TABLE_", "memcpy"}  # memcpy copies structs
    worst = max(runs, key=lambda run: run.error)
    return Check(
        real=c.real.name,
        steps=sum(len(run.rows) for run in runs),
        warnings=tuple(warnings),
        ulp=None if is_float else max(ulp(run.rows, run.expected) for run in runs),
        error=worst.error,
        foreign=None if needed is None else tuple(sorted(needed - allowed)),
        runs_away=runs_away(c, runs[0].expected),
        worst=worst.worst,
        rounding=worst.rounding if is_float and worst.error > TOLERANCE else None,
        ties=sum(int(run.tied.any(axis=1).sum()) for run in runs),
    )


SHORTER = (0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3)


def runs_away(c: CBlock, rows: Array) -> int | None:
    """Return the first step after which a state is huge, not finite or restarts; None if none.

    Args:
        rows: results of `run_vm`.
    """
    scale = np.array([v.nominal for v in c.block.states])
    lost = ~(np.abs(rows[:, : scale.size]) <= HUGE * scale).all(axis=1)
    if c.guards:
        lost |= (rows[:, -1].astype(int) & int(Status.STATE | Status.OUTPUT)) != 0
    return int(np.argmax(lost)) + 1 if lost.any() else None


def longest_step(block: Block, inputs: Array, below: float) -> float | None:
    """Return the longest of a few step sizes [s] below `below` with which `block` does not diverge.

    Returns None if there is none, or if the step size h is not a parameter of `block`.

    Args:
        inputs: inputs of every step, shape (steps, inputs).
        below: step size that is too long [s].
    """
    if all(v.name != STEP_SIZE for v in block.parameters):
        return None
    for part in SHORTER:
        h = float(f"{part * below:.3g}")
        parameters = (replace(v, start=h) if v.name == STEP_SIZE else v for v in block.parameters)
        c = CBlock(replace(block, parameters=tuple(parameters)), DOUBLE, guards=False)
        if runs_away(c, run_vm(c, inputs)) is None:
            return h
    return None


STRETCH = 100
"""Number of consecutive steps with the same type of motion or level of load."""

LOADS = (1.0, 10.0, 0.1, 1.5, 0.0, 1.0, 1e-3, 6.0, 0.5, 0.0, 100.0, 1.0)
"""Levels of a load relative to its nominal value, drawn at random."""

BAD = (np.nan, np.inf, -np.inf, 1e300, -1e300, 1e9, -1e9, 1e-310, -1.0)
"""Bad values of an input, relative to its nominal value."""


def excitation(block: Block, steps: int) -> Array:
    """Return valid inputs of every step, shape (steps, inputs), the same at each call.

    An input with a lower bound of 0 or more, such as a load, fluctuates about levels between which
    it jumps by factors up to 1e5, including zero. Other inputs alternate between slow sines, bursts
    up to 2, tiny values of 1e-12 ... 1e-3, a hundred zeros and abrupt reversals, all relative to
    the nominal value. All inputs stay within their bounds.
    """
    random = np.random.default_rng(0)
    columns = [_signal(variable, steps, random) for variable in block.inputs]
    return np.column_stack([np.zeros((steps, 0)), *columns])


def _signal(variable: Variable, steps: int, random: np.random.Generator) -> Array:
    stretches = -(-steps // STRETCH)
    if variable.lower >= 0.0:
        levels = np.repeat(random.choice(LOADS, stretches), STRETCH)[:steps]
        wavering = 1.0 + 0.5 * np.sin(0.003 * np.arange(steps) + random.uniform(0.0, 6.0))
        return _within(variable, variable.nominal * levels * wavering)
    pieces = motions(random, steps, 0.008, 0.03)
    turn = np.repeat(random.integers(0, len(pieces), stretches), STRETCH)[:steps]
    return _within(variable, variable.nominal * np.choose(turn, pieces))


def motions(
    random: np.random.Generator, steps: int, slow: float, turning: float, phase: float = 0.0
) -> list[Array]:
    """Return slow sines, bursts up to 2, values of 1e-12 ... 1e-3, reversals, and rest.

    Args:
        slow, turning: phase per step of the sines and of the reversals [rad].
        phase: initial phase of the reversals [rad].
    """
    k = np.arange(steps)
    tiny = 10.0 ** random.uniform(-12.0, -3.0, steps) * random.choice([-1.0, 1.0], steps)
    bursts = np.clip(random.standard_normal(steps), -2.0, 2.0)
    turns = 0.1 * np.sign(np.sin(turning * k + phase))
    return [0.05 * np.sin(slow * k), bursts, tiny, turns, np.zeros(steps)]


def _within(variable: Variable, values: Array) -> Array:
    limits = range_of(variable)
    return np.clip(values, limits.low, limits.high)


def spoiled(block: Block, inputs: Array) -> Array:
    """Return the inputs with a twentieth of the values replaced by bad values."""
    random = np.random.default_rng(1)
    nominal = np.array([v.nominal for v in block.inputs])
    bad = random.choice(BAD, inputs.shape) * nominal
    return np.where(random.uniform(size=inputs.shape) < 0.05, bad, inputs)


def varied(block: Block, steps: int, longest: float) -> Array:
    """Return parameters of every step, shape (steps, parameters), constant over `STRETCH` steps.

    The step size varies over three decades up to `longest` times its default, other parameters by
    +-20 %, or between 0 and 0.1 if their default is 0, all within their bounds.
    """
    random = np.random.default_rng(2)
    stretches = -(-steps // STRETCH)
    columns = [np.zeros((stretches, 0))]
    for variable in block.parameters:
        start, limits = float(variable.start), parameter_range(variable)
        if variable.name == STEP_SIZE:
            values = start * longest * 10.0 ** random.uniform(-3.0, 0.0, stretches)
        elif start == 0.0:
            values = random.uniform(0.0, 0.1, stretches)
        else:
            values = start * random.uniform(0.8, 1.2, stretches)
        columns.append(np.clip(values, limits.low, limits.high))
    return np.repeat(np.column_stack(columns), STRETCH, axis=0)[:steps]
