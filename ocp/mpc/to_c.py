"""The C of a controller in files, and the proof that its plans are as optimal as it reports."""

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import final

import numpy as np
from numpy.typing import NDArray

from ocp.mpc.closed_loop import SLACK, Optimality
from ocp.mpc.design import CycleData, CycleStatus, Design
from ocp.mpc.session import Session
from ocp.mpc.source import header, source
from symfric.codegen.compiler import compile_object, needed_symbols
from symfric.emitter.c99 import TRANSCENDENTAL
from symfric.foundation import checks
from symfric.foundation.compiler import CompileError, find_compiler
from symfric.foundation.files import write_text

Array = NDArray[np.float64]

ALLOWED = frozenset(TRANSCENDENTAL.values()) | {
    "sqrt", "fabs", "fmin", "fmax", "floor", "ceil", "copysign", "sincos", "memcpy", "memmove",
    "memset", "_GLOBAL_OFFSET_TABLE_",
}  # fmt: skip
"""Symbols that the object file may need: math.h, and copies that the compiler itself makes."""

TINY = float(np.finfo(float).tiny)


@final
@dataclass(frozen=True, eq=False)
class GeneratedController:
    """Files that `Controller.to_c` wrote.

    Attributes:
        folder: where the files are.
        files: header and source.
        design: of the controller.
    """

    folder: Path
    files: tuple[Path, Path]
    design: Design

    def verify(self, cycles: int = 100) -> "ControllerCheck":
        """Compile the files and judge what they compute by a second opinion; see `ControllerCheck`.

        The loop is closed through the controller's own model, with noise, references that jump,
        far states, and measured numbers that are not finite. The second opinion on each residual is
        that of `Controller.simulate`: derivatives by CasADi of the whole program.
        """
        return _verified(self, cycles)


@final
@dataclass(frozen=True)
class ControllerCheck:
    """Result of checking generated C.

    Attributes:
        status: "verified", or the reason in a sentence.
        cycles: that were judged.
        warnings: what the compiler warned of.
        foreign: what the object file needs besides functions of math.h; None without `nm`.
        difference: largest relative difference of a control from its plan, and of a residual, as
            far as it is above the tolerance, from the second opinion; rounding is allowed.
        bytes: size of the struct that holds plan and work space.
    """

    status: str
    cycles: int
    warnings: tuple[str, ...]
    foreign: tuple[str, ...] | None
    difference: float
    bytes: int

    @property
    def ok(self) -> bool:
        """No warnings, nothing foreign, plans as optimal as reported."""
        return self.status == "verified"


def write_c(design: Design, folder: str | Path) -> GeneratedController:
    """Write header and source, whole or not at all."""
    place = checks.path("to_c: folder", folder)
    texts = {".h": header(design), ".c": source(design)}
    files = place / f"{design.name}.h", place / f"{design.name}.c"
    for file in files:
        write_text(file, texts[file.suffix])
    return GeneratedController(place, files, design)


def _verified(generated: GeneratedController, cycles: int) -> ControllerCheck:
    compiler = find_compiler()
    if compiler is None:
        reason = "not verified: no C compiler found; install gcc or clang, or set CC"
        return ControllerCheck(reason, 0, (), None, np.inf, 0)
    try:
        with TemporaryDirectory(prefix="symfric-") as name:
            target = Path(name) / "controller.o"
            warnings = tuple(compile_object(compiler, generated.files[1], target))
            needed = needed_symbols(target)
        session = Session(generated.design, *(f.read_text("utf-8") for f in generated.files))
        difference = _difference(generated.design, session, cycles)
    except CompileError as error:
        return ControllerCheck(f"not verified: {error}", 0, (), None, np.inf, 0)
    foreign = None if needed is None else tuple(sorted(needed - ALLOWED))
    wrong = [f"{len(warnings)} warnings"] * bool(warnings)
    wrong += [f"needs {', '.join(foreign)}"] if foreign else []
    wrong += [f"differs by {difference:.1e}"] * (difference > SLACK)
    status = f"failed: {'; '.join(wrong)}" if wrong else "verified"
    return ControllerCheck(status, cycles, warnings, foreign, difference, session.bytes)


def _difference(design: Design, session: Session, cycles: int) -> float:
    """Largest relative difference over a loop that is hard on the controller."""
    h, random, opinion = design.horizon, np.random.default_rng(0), Optimality(design)
    own = list(design.measured)
    nominal, settings = h.model.nominal("x")[own], design.settings
    measured, worst, goals = design.x0[own], 0.0, design.r0
    for k in range(cycles):
        if k % 25 == 0:
            goals = design.r0 + random.normal(size=design.r0.size)
        if k % 100 == 99:
            measured = 10.0 * nominal * random.normal(size=nominal.size)
        if k % 60 == 59:
            measured = np.full(nominal.size, np.nan)
        t = h.step * (k + np.arange(h.count + 1.0))
        data = CycleData(np.tile(goals, (h.count + 1, 1)), t, design.p0, design.bounds)
        action = session.cycle(measured, data, settings.tolerance, settings.iterations)
        plan, pairs = session.plan, list[tuple[float, float, float]]()
        if action.status is not CycleStatus.FAILED:
            planned = (c.of(plan.X, plan.U, data.b) for c in design.controls)
            given = zip(action.controls.values(), planned, strict=True)
            pairs += [(u, v, TINY) for u, v in given]
        if action.status not in (CycleStatus.FAILED, CycleStatus.BAD_INPUT):
            pairs += [(x, y, TINY) for x, y in zip(plan.X[0, own], measured, strict=True)]
            pairs.append((action.residual, opinion.residual(plan, data), settings.tolerance))
        worst = max([worst, *(abs(a - b) / max(abs(b), size) for a, b, size in pairs)])
        measured = plan.X[1, own] + 0.01 * nominal * random.normal(size=nominal.size)
    return float(worst)
