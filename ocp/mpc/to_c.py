"""The C of a controller in files, and the proof that it computes what the virtual machine does."""

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import final

import numpy as np
from numpy.typing import NDArray

from ocp.mpc.design import Design
from ocp.mpc.interior_point import Given
from ocp.mpc.session import InC, InVm
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
        """Compile the files and compare them with the virtual machine; see `ControllerCheck`.

        The loop is closed through the controller's own model, with noise, references that jump,
        far states, and measured numbers that are not finite.
        """
        return _verified(self, cycles)


@final
@dataclass(frozen=True)
class ControllerCheck:
    """Result of checking generated C.

    Attributes:
        status: "verified", or the reason in a sentence.
        cycles: that were compared.
        warnings: what the compiler warned of.
        foreign: what the object file needs besides functions of math.h; None without `nm`.
        difference: largest difference of a control or residual from the virtual machine's, relative
            to its size; 0 means equal bits.
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
        """No warnings, nothing foreign, equal bits."""
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
        engine = InC(generated.design, *(f.read_text(encoding="utf-8") for f in generated.files))
        difference = _difference(generated.design, engine, cycles)
    except CompileError as error:
        return ControllerCheck(f"not verified: {error}", 0, (), None, np.inf, 0)
    foreign = None if needed is None else tuple(sorted(needed - ALLOWED))
    wrong = [f"{len(warnings)} warnings"] * bool(warnings)
    wrong += [f"needs {', '.join(foreign)}"] if foreign else []
    wrong += [f"differs by {difference:.1e}"] * (difference > 0.0)
    status = f"failed: {'; '.join(wrong)}" if wrong else "verified"
    return ControllerCheck(status, cycles, warnings, foreign, difference, engine.bytes)


def _difference(design: Design, engine: InC, cycles: int) -> float:
    """Largest relative difference of controls and residuals over a loop that is hard on both."""
    h, other, random = design.horizon, InVm(design), np.random.default_rng(0)
    nominal = h.model.nominal("x")[list(design.measured)]
    measured, worst = design.x0[list(design.measured)], 0.0
    goals = design.r0
    for k in range(cycles):
        if k % 25 == 0:
            goals = design.r0 + random.normal(size=design.r0.size)
        if k % 100 == 99:
            measured = 10.0 * nominal * random.normal(size=nominal.size)
        if k % 60 == 59:
            measured = np.full(nominal.size, np.nan)
        t = h.step * (k + np.arange(h.count + 1.0))
        given = Given(np.tile(goals, (h.count + 1, 1)), t, design.p0, design.bounds)
        settings = design.settings
        one, two = (
            e.cycle(measured, given, settings.tolerance, settings.iterations)
            for e in (engine, other)
        )
        pairs = zip((*one.u, one.report.residual), (*two.u, two.report.residual), strict=True)
        worst = max(worst, *(abs(a - b) / max(abs(b), 1.0) if a != b else 0.0 for a, b in pairs))
        if one.report.status != two.report.status:
            return np.inf
        plan = other.plan
        measured = plan.X[1, list(design.measured)] + 0.01 * nominal * random.normal(
            size=nominal.size
        )
    return float(worst)
