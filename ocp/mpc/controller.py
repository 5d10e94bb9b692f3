"""Model predictive controllers derived from problems, and their generated C files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from re import fullmatch
from tempfile import TemporaryDirectory
from typing import final

import numpy as np

from ocp.formulation.phase import Array
from ocp.formulation.problem import Problem
from ocp.mpc.closed_loop import SLACK, ClosedLoopRun, Optimality, Reference, run_closed_loop
from ocp.mpc.design import Control, CycleData, CycleStatus, Design, Settings
from ocp.mpc.horizon import Horizon
from ocp.mpc.session import Action, Session
from ocp.mpc.source import header, source, timed
from symfric.codegen.blocks.block import KEYWORDS
from symfric.codegen.runner import compile_object, needed_symbols
from symfric.emitter.c99 import FLOAT, REALS, TRANSCENDENTAL
from symfric.foundation import checks
from symfric.foundation.files import write_text
from symfric.foundation.programs import CompileError, find_compiler
from symfric.foundation.variable import Variable
from symfric.model import Model

MATH = frozenset(TRANSCENDENTAL.values()) | {
    "sqrt", "fabs", "fmin", "fmax", "floor", "ceil", "copysign", "sincos",
}  # fmt: skip
ALLOWED = MATH | {f"{name}f" for name in MATH} | {
    "memcpy", "memmove", "memset", "_GLOBAL_OFFSET_TABLE_",
}  # fmt: skip
"""Symbols that the object file may need: functions of math.h and those inserted by compilers."""

UNDERSTATED = {"double": 1.0 + SLACK, "float": 4.0}
"""Largest `ControllerCheck.understated` of a verified controller."""
TINY = float(np.finfo(float).tiny)


@final
@dataclass(frozen=True)
class ControllerCheck:
    """Result of checking generated C.

    Attributes:
        status: "verified", or the reason why the check failed.
        cycles: number of checked cycles.
        warnings: warnings of the compiler.
        foreign: symbols other than those of math.h that the object file needs; None without `nm`.
        difference: largest relative difference of a control from its plan.
        understated: largest ratio of an independent residual in double to the reported residual,
            or to the tolerance if that is larger.
        bytes: size of the struct with plan and work space.
    """

    status: str
    cycles: int
    warnings: tuple[str, ...]
    foreign: tuple[str, ...] | None
    difference: float
    understated: float
    bytes: int

    @property
    def ok(self) -> bool:
        """True if there are no warnings and foreign symbols, and residuals are as reported."""
        return self.status == "verified"


@final
@dataclass(frozen=True, eq=False)
class GeneratedController:
    """Files written by `Controller.to_c`.

    Attributes:
        folder: folder of the files.
        files: paths of header and source.
        design: definition of the controller.
        real: floating-point type of the C.
    """

    folder: Path
    files: tuple[Path, Path]
    design: Design
    real: str = "double"

    def verify(self, cycles: int = 100) -> ControllerCheck:
        """Compile the files and check their results independently; see `ControllerCheck`.

        The loop is that of `disturbed`. The independent residual is that of
        `Controller.simulate`, by derivatives of the whole program with CasADi.
        """
        compiler, design = find_compiler(), self.design
        if compiler is None:
            reason = "not verified: no C compiler found; install gcc or clang, or set CC"
            return ControllerCheck(reason, 0, (), None, np.inf, np.inf, 0)
        try:
            with TemporaryDirectory(prefix="symfric-") as name:
                target = Path(name) / "controller.o"
                warnings = tuple(compile_object(compiler, self.files[1], target))
                needed = needed_symbols(target)
            texts = (f.read_text("utf-8") for f in self.files)
            session = Session(design, *texts, real=REALS[self.real])
            difference, understated = _differences(session, cycles)
        except CompileError as error:
            return ControllerCheck(f"not verified: {error}", 0, (), None, np.inf, np.inf, 0)
        foreign = None if needed is None else tuple(sorted(needed - ALLOWED))
        wrong = [f"{len(warnings)} warnings"] * bool(warnings)
        wrong += [f"needs {', '.join(foreign)}"] if foreign else []
        wrong += [f"differs by {difference:.1e}"] * (difference > SLACK)
        most = UNDERSTATED[self.real]
        wrong += [f"understates residuals {understated:.1f} times"] * (understated > most)
        status = f"failed: {'; '.join(wrong)}" if wrong else "verified"
        found = difference, understated, session.bytes
        return ControllerCheck(status, cycles, warnings, foreign, *found)


def _differences(session: Session, cycles: int) -> tuple[float, float]:
    """Return the attributes `difference` and `understated` of a `ControllerCheck`."""
    design, check = session.design, Optimality(session.design)
    own, tolerance, worst, understated = list(design.measured), design.settings.tolerance, 0.0, 0.0
    for measured, data, action in disturbed(session, cycles):
        plan, pairs = session.plan, list[tuple[float, float]]()
        if action.status is not CycleStatus.FAILED:
            planned = (c.of(plan.X, plan.U, data.b) for c in design.controls)
            pairs += zip(action.controls.values(), planned, strict=True)
            if action.status is not CycleStatus.BAD_INPUT:
                pairs += zip(plan.X[0, own], measured, strict=True)
                least = max(action.residual, tolerance)
                understated = max(understated, check.residual(plan, data) / least)
        worst = max([worst, *(abs(a - b) / max(abs(b), TINY) for a, b in pairs)])
    return float(worst), float(understated)


def disturbed(
    session: Session, cycles: int, *, scale: float = 1.0, broken: bool = True
) -> Iterator[tuple[Array, CycleData, Action]]:
    """Yield measurements, data and result of each cycle of a loop with disturbances.

    The plant is the model of the controller, with noise of a hundredth of the nominal states.
    References jump every 25 cycles by about 1, and the state every 100 cycles to about ten nominal
    states; `scale` multiplies all three. If `broken`, a measurement is not finite every 60 cycles.
    """
    design = session.design
    h, settings, own = design.horizon, design.settings, list(design.measured)
    random, nominal = np.random.default_rng(0), h.model.nominal("x")[own]
    measured, goals = design.x0[own], design.r0
    for k in range(cycles):
        if k % 25 == 0:
            goals = design.r0 + scale * random.normal(size=design.r0.size)
        if k % 100 == 99:
            measured = 10.0 * scale * nominal * random.normal(size=nominal.size)
        if broken and k % 60 == 59:
            measured = np.full(nominal.size, np.nan)
        t = h.step * (k + np.arange(h.count + 1.0))
        data = CycleData(np.tile(goals, (h.count + 1, 1)), t, design.p0, design.bounds)
        action = session.cycle(measured, data, settings.tolerance, settings.iterations)
        yield measured, data, action
        noise = 0.01 * scale * nominal * random.normal(size=nominal.size)
        measured = session.plan.X[1, own] + noise


OWN = ("residual", "violation", "iterations", "program_iterations", "status", "converged")
"""Members of the output struct in C other than controls."""


@final
@dataclass(frozen=True, eq=False)
class Controller:
    """Model predictive controller, created by `controller_of` or `problem.to_mpc`.

    Every `step` seconds the states are measured, the problem is solved from these states over the
    next T seconds, and the inputs of the first interval are applied.

    Attributes:
        design: horizon and settings of the controller.
    """

    design: Design

    def __repr__(self) -> str:
        h = self.design.horizon
        return f"<controller '{self.design.name}', {h.count} intervals of {h.step:g} s>"

    @property
    def step(self) -> float:
        """Time between cycles [s]."""
        return self.design.horizon.step

    @property
    def intervals(self) -> int:
        """Number of intervals of the horizon."""
        return self.design.horizon.count

    @property
    def measured(self) -> tuple[str, ...]:
        """Names of the measured states."""
        return self.design.measured_names

    @property
    def references(self) -> tuple[str, ...]:
        """Names of the references."""
        return self.design.horizon.references

    @property
    def bounds(self) -> dict[str, float]:
        """Name in C -> value of each bound."""
        return dict(zip(self.design.bound_names, self.design.bounds.tolist(), strict=True))

    def start(self) -> Session:
        """Return a running controller, without a plan; it runs the C of `to_c`.

        Raises:
            CompileError: there is no compiler (install gcc or clang, or set $CC), or it failed.
        """
        if find_compiler() is None:
            raise CompileError(
                "start: expected a C compiler ($CC, gcc, clang or cc), found none; a controller "
                "runs as C: install gcc or clang, or set $CC"
            )
        return Session(self.design)

    def simulate(
        self,
        plant: Model,
        t_end: float,
        references: Mapping[str, Reference] | None = None,
        *,
        x0: Mapping[str, float] | None = None,
        p: Mapping[str, float] | None = None,
        plant_p: Mapping[str, float] | None = None,
        noise: Mapping[str, float] | None = None,
        seed: int = 0,
        check: bool = True,
    ) -> ClosedLoopRun:
        """Simulate the controller on a plant, whose equations may differ from its model.

        The plant must have the controlled inputs and the measured signals by the same names. Its
        other inputs keep the values of the plant model.

        Args:
            plant: model of the plant, which may have events.
            t_end: end time [s], rounded to whole cycles.
            references: name -> number or function of times [s]; the controller knows future values.
            x0, plant_p: start values and parameters of the plant by name.
            p: parameters of the model of the controller by name.
            noise: standard deviations of measured states by name.
            seed: seed of the noise.
            check: compute an independent residual for each cycle, which takes some milliseconds.

        Raises:
            ValueError: unknown names or bad numbers.
            SolveError: the plant could not be simulated to the end.
            CompileError: see `start`.
        """
        return run_closed_loop(
            self.start(), plant, t_end, references or {},
            x0=x0, p=p, plant_p=plant_p, noise=noise, seed=seed, check=check,
        )  # fmt: skip

    def to_c(self, folder: str | Path, real: str = "double") -> GeneratedController:
        """Write the controller as C99: `NAME.h` and `NAME.c`, in float `NAME_f32.h`, `NAME_f32.c`.

        The C code allocates no memory, needs only math.h, and has only constant data; its memory is
        a struct of the caller. All loops are bounded, so the time of a cycle is bounded. Each cycle
        reports the residual of its output. `start` runs the same code in double. In float, the
        residual contains an estimate of rounding errors, see `ocp.mpc.source`.

        Args:
            folder: folder of the files.
            real: "double" or "float".

        Raises:
            ValueError: the folder is invalid, or an operation does not exist in C99.
        """
        checks.choice("to_c: real", real, REALS)
        design, place, kind = self.design, checks.path("to_c: folder", folder), REALS[real]
        if kind is FLOAT:
            design = replace(design, name=f"{design.name}_{kind.suffix}")
        files = place / f"{design.name}.h", place / f"{design.name}.c"
        for file, text in zip(files, (header(design, kind), source(design, kind)), strict=True):
            write_text(file, text)
        return GeneratedController(place, files, design, real)


def controller_of(
    problem: Problem,
    step: float = 0.01,
    *,
    method: str = "rodas3",
    steps: int = 8,
    measured: Sequence[str] | None = None,
    tolerance: float = 1e-3,
    iterations: int = 20,
    penalty: float = 1e3,
    name: str | None = None,
) -> Controller:
    """Derive a model predictive controller from a problem of one phase with the horizon T.

        min  sum_k h [sum_i w_i r_i^2 + L] + E(x_N)   s.t.  x_(k+1) = F(x_k, u_k),  bounds

    The controller solves sequential quadratic programs (`ocp.mpc.source`), starting from the
    shifted plan of the previous cycle, over N = T / step intervals with constant inputs. Costs are
    `track`, `effort`, and convex quadratic `integral` and `at_end`. A name such as "goal" in
    `track("x", "goal", 900.0)` is a reference of the controller, with its default in the `p` of the
    problem. The start of the phase is not used, because the state is measured. Bounds on inputs are
    hard. Bounds on states and outputs, path conditions and the end of the phase are soft, with an
    exact penalty.

    Args:
        problem: the problem to minimise.
        step: time between cycles [s].
        method, steps: method and number of steps of `flow` for an interval. The steps should
            resolve the transition velocity of friction: if v changes by much more than v_t in a
            step, iterations converge slowly or not at all, as the residual shows. Use
            "backward_euler" for laws with bristles.
        measured: names of measured states, by default all. Other states, such as bristles, are
            taken from the plan. Inputs with bounded rate (`rates`) are never measured.
        tolerance: residual (see `ocp.mpc.source`) at which a plan is optimal.
        iterations: largest number of quadratic programs in a cycle; 1 is the real-time iteration.
        penalty: penalty of violating a soft bound by its unit, per largest curvature of the cost.
        name: C identifier, by default the name of the model with "_mpc".

    Raises:
        ValueError: several phases, scenarios, chosen parameters, a free duration, via points,
            algebraic variables, events, time in the equations, a cost without curvature, or names
            that are not C identifiers.

    Limits: inputs are constant over an interval. States that are not measured are predicted, not
    estimated. Far from the optimum the limit of iterations may be reached, as the status reports.
    With very sharp friction a plan that sticks is optimal to first order, and the iterations
    converge to it. Use a v_t of about a hundredth of the velocities in the controller: a drive that
    moves at 1 m/s leaves stick with 1e-2 m/s, but not with 1e-3 m/s. The friction of the plant may
    be arbitrarily sharp.
    """
    h = Horizon(problem, step, method=method, steps=steps)
    tolerance = checks.number("to_mpc: tolerance", tolerance, above=0.0)
    settings = Settings(tolerance, checks.count("to_mpc: iterations", iterations, most=1000))
    own, span = problem.chain[0].model, problem.spans[0]
    states, inputs = [v.name for v in h.model.x], [v.name for v in h.model.u]
    measurable = [name for name in states if name not in {v.name for v in own.u}]
    if measured is not None:
        measurable = checks.names("to_mpc: measured", measured, measurable)
    bounds = {limit.name: i for i, limit in enumerate(h.limits)}
    boxes = np.array([span.boxes[name] for name in inputs])
    parameters = dict(zip((v.name for v in span.model.p), span.p.tolist(), strict=True))

    def control(v: Variable) -> Control:
        lower, upper = (bounds.get(f"{side} bound on {v.name}") for side in ("lower", "upper"))
        rated = v.name not in inputs
        place = (states if rated else inputs).index(v.name)
        return Control(v.name, v.unit, place, rated, lower, upper)

    design = Design(
        name=name or f"{own.name}_mpc",
        horizon=h,
        settings=settings,
        measured=tuple(i for i, state in enumerate(states) if state in measurable),
        controls=tuple(map(control, own.u)),
        x0=h.model.initial_state(p=parameters),
        u0=np.clip(h.model.values("u"), *boxes.T),
        p0=np.array([parameters[name] for name in h.parameters]),
        r0=np.array([parameters[name] for name in h.references]),
        penalty=checks.number("to_mpc: penalty", penalty, above=0.0),
    )
    _check_names(f"to_mpc '{problem.name}'", design)
    return Controller(design)


def _check_names(where: str, design: Design) -> None:
    """Raise ValueError unless all names are C identifiers and unique in their structs."""
    h = design.horizon
    structs = (
        [*h.parameters, *design.bound_names, "tolerance", "iterations"],
        [*design.measured_names, *h.references, *["t"] * timed(design)],
        [*(control.name for control in design.controls), *OWN],
    )
    problems = [
        f"expected C identifiers, got {name!r}"
        for name in (design.name, *(name for names in structs for name in names))
        if not (name.isascii() and fullmatch(r"[A-Za-z]\w*", name)) or name in KEYWORDS
    ]
    for names in structs:
        repeated = sorted({name for name in names if names.count(name) > 1})
        problems += [f"expected every name once, got {name!r} twice" for name in repeated]
    if not all(map(isfinite, (*design.x0, *design.u0, *design.p0, *design.r0))):
        problems.append("expected finite start values")
    if problems:
        raise ValueError(f"{where}: " + "; ".join(problems))
