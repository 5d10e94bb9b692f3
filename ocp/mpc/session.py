"""A controller at work: cycles in compiled C, or in the virtual machine with the same bits."""

import ctypes
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from time import perf_counter, thread_time
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ocp.mpc.design import Design
from ocp.mpc.gauss_newton import CycleStatus, Plan, Report, improved
from ocp.mpc.interior_point import Given
from ocp.mpc.source import header, sizes, source, timed
from symfric.foundation import checks
from symfric.foundation.compiler import find_compiler
from symfric.foundation.numeric import address
from symfric.integrator.compiled.compiler import FLAGS, library, opened

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Cycle:
    """What one cycle gave.

    Attributes:
        u: controls.
        seconds, cpu: time it took on the clock, and of the processor [s]; of the C without Python
            around it, but for its call.
    """

    u: Array
    report: Report
    seconds: float
    cpu: float


@final
class InVm:
    """The loops in NumPy, the kernels in CasADi's virtual machine."""

    def __init__(self, design: Design) -> None:
        self._design = design
        self.forget()

    def forget(self) -> None:
        """Start afresh, from a plan that rests."""
        design = self._design
        n = design.horizon.count
        self._warm = False
        self._plan = Plan(
            np.tile(design.x0, (n + 1, 1)),
            np.tile(design.u0, (n, 1)),
            np.zeros(design.prices.soft.size),
        )

    @property
    def plan(self) -> Plan:
        """A copy of the plan."""
        return Plan(self._plan.X.copy(), self._plan.U.copy(), self._plan.z.copy())

    def cycle(self, measured: Array, given: Given, tolerance: float, iterations: int) -> Cycle:
        """One cycle, as the C goes through it."""
        began, busy = perf_counter(), thread_time()

        def cycle(report: Report, u: Array) -> Cycle:
            return Cycle(u, report, perf_counter() - began, thread_time() - busy)

        design = self._design
        if self._warm:
            self._plan = self._plan.shifted(design.sweeps)
        numbers = (measured, given.R, given.t, given.p, given.b, np.array([tolerance]))
        if not all(np.isfinite(n).all() for n in numbers):
            report = Report(CycleStatus.BAD_INPUT, inf, 0.0, 0, 0)
            return cycle(report, self._shown(given))
        X = self._plan.X.copy()
        X[0, list(design.measured)] = measured
        if not self._warm:
            X[1:] = X[0]
        self._plan = Plan(X, self._plan.U, self._plan.z)
        u = self._shown(given)
        with np.errstate(all="ignore"):
            settings = replace(design.settings, tolerance=tolerance, iterations=iterations)
            plan, report = improved(design.sweeps, self._plan, given, design.prices, settings)
        self._plan, self._warm = plan, report.status is not CycleStatus.FAILED
        if self._warm:
            u = self._shown(given)
        else:
            self.forget()
        return cycle(report, u)

    def _shown(self, given: Given) -> Array:
        plan = self._plan
        return np.array([c.of(plan.X, plan.U, given.b) for c in self._design.controls])


SCALAR = (*FLAGS, "-fno-tree-vectorize")
"""Between calls of libm, which has tanh in SSE, a few vector instructions of AVX would make a cycle
seven times longer (measured: 1.1 -> 7.9 ms)."""

WRAPPER = Path(__file__).with_name("wrapper.c").read_text(encoding="utf-8")
"""C between ctypes and a controller, called NAME in it."""


@final
class InC:
    """The C of the controller, compiled: made here, or read from files."""

    def __init__(self, design: Design, head: str = "", body: str = "") -> None:
        self._design = design
        parts = sizes(design)
        self._doubles = len(design.controls) + 2
        params = parts["NPAR"] + parts["NB"] + 1
        text = body or source(design)
        text = text.replace(f'#include "{design.name}.h"', head or header(design))
        text += "#include <string.h>\n"
        text += f"#define SF_PARAM {params}\n#define SF_OUT {self._doubles}\n"
        text += "\n" + WRAPPER.replace("NAME", design.name)
        names = ("sf_cycle", "sf_init", "sf_bytes", "sf_plan")
        self._library = opened(library(text, *names, flags=SCALAR), names)
        self.bytes = int(self._library.sf_bytes())
        self._self = np.zeros(self.bytes // 8 + 1)
        self._timed = timed(design)
        self._cycle = self._library.sf_cycle
        pointer = ctypes.c_void_p
        self._cycle.argtypes = [pointer, pointer, ctypes.c_int, pointer, pointer, pointer]
        self._cycle.restype = None
        self.forget()

    def forget(self) -> None:
        """Start afresh, from a plan that rests."""
        self._library.sf_init(ctypes.c_void_p(address(self._self)))

    @property
    def plan(self) -> Plan:
        """A copy of the plan."""
        parts = sizes(self._design)
        X, U = np.zeros((parts["N"] + 1, parts["NX"])), np.zeros((parts["N"], parts["NU"]))
        z = np.zeros(parts["ALL"])
        arrays = [ctypes.c_void_p(a.ctypes.data) for a in (self._self, X, U, z)]
        self._library.sf_plan(*arrays)
        return Plan(X, U, z)

    def cycle(self, measured: Array, given: Given, tolerance: float, iterations: int) -> Cycle:
        """One cycle; `given` has the reference of every node."""
        columns = [measured, given.R.T.ravel()]
        if self._timed:
            columns.append(given.t[:1])
        into = np.concatenate(columns)
        param = np.concatenate([given.p, given.b, [tolerance]])
        out, counts = np.zeros(self._doubles), np.zeros(3, dtype=np.int32)
        arguments: list[Any] = [address(self._self), address(param), iterations]
        arguments += [address(into), address(out), counts.ctypes.data]
        busy, began = thread_time(), perf_counter()
        self._cycle(*arguments)
        seconds, cpu = perf_counter() - began, thread_time() - busy
        residual, violation = out[-2:].tolist()
        iterations, program, status = counts.tolist()
        report = Report(CycleStatus(status), residual, violation, iterations, program)
        return Cycle(out[:-2], report, seconds, cpu)


Array = NDArray[np.float64]

BACKENDS = ("auto", "vm", "compiled")


@final
@dataclass(frozen=True, eq=False)
class Action:
    """What a controller does in one cycle.

    Attributes:
        controls: input -> value over the next interval.
        residual: of the conditions of optimality, of the plan that the controls are from, see
            `gauss_newton`.
        violation: largest of a soft bound, in units of its signal.
        iterations: quadratic programs.
        program_iterations: of the interior point, over all of them.
        status: how it ended.
        seconds, cpu: time it took on the clock, and of the processor [s].
    """

    controls: Mapping[str, float]
    residual: float
    violation: float
    iterations: int
    program_iterations: int
    status: CycleStatus
    seconds: float
    cpu: float

    @property
    def converged(self) -> bool:
        """Whether the plan is optimal within the tolerance."""
        return self.status is CycleStatus.CONVERGED


@final
class Session:
    """A controller that remembers its plan; made by `Controller.start`."""

    def __init__(self, design: Design, backend: str) -> None:
        checks.choice("start: backend", backend, BACKENDS)
        if backend == "auto":
            backend = "vm" if find_compiler() is None else "compiled"
        self._design = design
        self._engine: InVm | InC = InVm(design) if backend == "vm" else InC(design)
        self.backend = backend

    def step(
        self,
        x: ArrayLike | Mapping[str, float],
        references: Mapping[str, ArrayLike] | None = None,
        *,
        t: float = 0.0,
        p: Mapping[str, float] | None = None,
        bounds: Mapping[str, float] | None = None,
        tolerance: float | None = None,
        iterations: int | None = None,
    ) -> Action:
        """One cycle: what to do until the next one.

        Measured numbers that are not finite are no error here: the plan of the last cycle goes on,
        and the status says so, as in C.

        Args:
            x: measured states by name or in their order.
            references: name -> value, or values now and after each interval, shape (N+1,).
            t: time now [s], for costs and bounds that depend on it.
            p: parameters of the model by name.
            bounds: other bounds by their names in C, such as "force_upper".
            tolerance, iterations: in place of those of the controller.

        Raises:
            ValueError: unknown names, other shapes.
        """
        design = self._design
        given = self.given(references, t, p, bounds)
        settings = design.settings
        cycle = self._engine.cycle(
            self._measured(x),
            given,
            settings.tolerance if tolerance is None else float(tolerance),
            settings.iterations
            if iterations is None
            else checks.count("step: iterations", iterations, most=settings.iterations),
        )
        report = cycle.report
        names = (control.name for control in design.controls)
        return Action(
            controls=dict(zip(names, cycle.u.tolist(), strict=True)),
            residual=report.residual,
            violation=report.violation,
            iterations=report.iterations,
            program_iterations=report.program,
            status=report.status,
            seconds=cycle.seconds,
            cpu=cycle.cpu,
        )

    def forget(self) -> None:
        """Start afresh, without a plan."""
        self._engine.forget()

    @property
    def plan(self) -> Plan:
        """Planned states (N+1, nx), inputs (N, nu) and multipliers; the first row is now."""
        return self._engine.plan

    def _measured(self, x: ArrayLike | Mapping[str, float]) -> Array:
        design = self._design
        names = design.measured_names
        if isinstance(x, Mapping):
            values = checks.named("step: x", x, names)
            missing = [name for name in names if name not in values]
            if missing:
                raise ValueError(f"step: x: expected all of {', '.join(names)}, got none for "
                                 f"{', '.join(missing)}")  # fmt: skip
            x = [values[name] for name in names]
        found = np.asarray(x, dtype=float).ravel()
        if found.size != len(names):
            raise ValueError(
                f"step: x: expected {len(names)} numbers ({', '.join(names)}), got {found.size}"
            )
        return np.ascontiguousarray(found)

    def given(
        self,
        references: Mapping[str, ArrayLike] | None,
        t: float,
        p: Mapping[str, float] | None,
        bounds: Mapping[str, float] | None,
    ) -> Given:
        """Arguments of `step` over the whole horizon."""
        design = self._design
        h = design.horizon
        R = np.tile(design.r0, (h.count + 1, 1))
        for name, value in checks.named("step: references", references, h.references).items():
            values = np.asarray(value, dtype=float).ravel()
            if values.size not in (1, h.count + 1):
                raise ValueError(
                    f"step: {name}: expected 1 number or {h.count + 1}, now and after each "
                    f"interval, got {values.size}"
                )
            R[:, h.references.index(name)] = values
        numbers = design.p0.copy()
        for name, value in checks.named("step: p", p, h.parameters).items():
            numbers[h.parameters.index(name)] = value
        b, names = design.bounds, design.bound_names
        for name, value in checks.named("step: bounds", bounds, names).items():
            b[names.index(name)] = value
        return Given(R, t + h.step * np.arange(h.count + 1.0), numbers, b)
