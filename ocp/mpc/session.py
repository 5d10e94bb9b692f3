"""A controller at work: from cycle to cycle, with the plan of the last one as the start."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ocp.mpc.design import Design
from ocp.mpc.engines import Engine, InC, InVm
from ocp.mpc.gauss_newton import CycleStatus, Plan
from ocp.mpc.sweeps import Given
from symfric.foundation import checks
from symfric.foundation.compiler import find_compiler

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
        self._engine: Engine = InVm(design) if backend == "vm" else InC(design)
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
