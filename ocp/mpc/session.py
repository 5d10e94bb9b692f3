"""Running controllers, which call the compiled C code in each cycle."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter, thread_time
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from ocp.formulation.phase import Array
from ocp.mpc.design import CycleData, CycleStatus, Design, Plan
from ocp.mpc.source import header, sizes, source, timed, typed
from symfric.emitter.c99 import DOUBLE, Real
from symfric.foundation import checks
from symfric.foundation.numeric import address
from symfric.integrator.compiled.compiler import FLAGS, library, opened

SCALAR = (*FLAGS, "-fno-tree-vectorize")
"""Compiler flags. A few AVX vector instructions between calls of libm, whose tanh uses SSE, would
make a cycle seven times longer (measured: 1.1 -> 7.9 ms)."""

WRAPPER = Path(__file__).with_name("wrapper.c").read_text(encoding="utf-8")
"""C code between ctypes and a controller with the name NAME."""


@final
@dataclass(frozen=True, eq=False)
class Action:
    """Result of a controller in one cycle.

    Attributes:
        controls: input -> value over the next interval.
        residual: residual of the optimality conditions of the plan; see `ocp.mpc.source`.
        violation: largest violation of a soft bound, in units of its signal.
        iterations: number of quadratic programs.
        program_iterations: total number of interior-point iterations.
        status: status of the cycle.
        seconds, cpu: wall time and processor time [s].
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
        """True if the plan is optimal within the tolerance."""
        return self.status is CycleStatus.CONVERGED


@final
class Session:
    """Running controller with its current plan, created by `Controller.start`."""

    def __init__(self, design: Design, head: str = "", body: str = "", real: Real = DOUBLE) -> None:
        """Compile the C code of `design`, or that of the header `head` and the source `body`.

        `real` is the type of the numbers in C.

        Raises:
            CompileError: there is no compiler, or it failed.
        """
        self.design = design
        parts = sizes(design)
        self._numbers = len(design.controls) + 2
        text = (body or source(design, real)).replace(
            f'#include "{design.name}.h"', head or header(design, real)
        )
        text += "#include <string.h>\n"
        text += f"#define SF_PARAM {parts['NPAR'] + parts['NB'] + 1}\n"
        text += f"#define SF_OUT {self._numbers}\n\n"
        text += typed(WRAPPER.replace("NAME", design.name), real)
        names = ("sf_cycle", "sf_init", "sf_bytes", "sf_plan")
        self._library = opened(library(text, *names, flags=SCALAR), names)
        self.bytes: int = int(self._library.sf_bytes())
        """Size of the struct with plan and work space."""
        self._kind = real.kind
        self._self = np.zeros(self.bytes // 8 + 1)
        self._timed = timed(design)
        self._cycle = self._library.sf_cycle
        pointer = ctypes.c_void_p
        self._cycle.argtypes = [pointer, pointer, ctypes.c_int, pointer, pointer, pointer]
        self._cycle.restype = None
        self.forget()

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
        """Compute the controls until the next cycle.

        Measurements that are not finite raise no exception: as in C, the plan of the previous cycle
        continues, and the status reports it.

        Args:
            x: measured states, by name or in the order of the controller.
            references: name -> value, or values now and after each interval, shape (N+1,).
            t: current time [s], for costs and bounds that depend on time.
            p: parameters of the model by name.
            bounds: changed bounds by their names in C, such as "force_upper".
            tolerance, iterations: replace those of the controller.

        Raises:
            ValueError: unknown names or wrong shapes.
        """
        settings = self.design.settings
        if iterations is not None:
            iterations = checks.count("step: iterations", iterations, most=settings.iterations)
        measured, data = self._measured(x), self.data(references, t, p, bounds)
        tolerance = settings.tolerance if tolerance is None else float(tolerance)
        return self.cycle(measured, data, tolerance, iterations or settings.iterations)

    def cycle(self, measured: Array, data: CycleData, tolerance: float, iterations: int) -> Action:
        """Compute one cycle from arrays; see `step`."""
        with np.errstate(over="ignore"):
            param = self.given(measured, data, tolerance).astype(self._kind)
        into = param[data.p.size + data.b.size + 1 :]
        out, counts = np.zeros(self._numbers, self._kind), np.zeros(3, dtype=np.int32)
        places = [address(self._self), param.ctypes.data, iterations]
        places += [into.ctypes.data, out.ctypes.data, counts.ctypes.data]
        busy, began = thread_time(), perf_counter()
        self._cycle(*places)
        seconds, cpu = perf_counter() - began, thread_time() - busy
        *controls, residual, violation = out.tolist()
        programs, steps, status = counts.tolist()
        names = (control.name for control in self.design.controls)
        return Action(
            dict(zip(names, controls, strict=True)), residual, violation, programs, steps,
            CycleStatus(status), seconds, cpu,
        )  # fmt: skip

    def given(self, measured: Array, data: CycleData, tolerance: float) -> Array:
        """Return the members of the structs of parameters (without `iterations`) and inputs."""
        into = [measured, data.R.T.ravel(), data.t[: int(self._timed)]]
        return np.concatenate([data.p, data.b, [tolerance], *into])

    def forget(self) -> None:
        """Discard the plan, and restart from a plan at the start values of the model."""
        self._library.sf_init(ctypes.c_void_p(address(self._self)))

    @property
    def plan(self) -> Plan:
        """Current plan, whose first row is the current time."""
        parts = sizes(self.design)
        shapes = (parts["N"] + 1, parts["NX"]), (parts["N"], parts["NU"]), (parts["ALL"],)
        arrays = [np.zeros(shape, self._kind) for shape in shapes]
        self._library.sf_plan(*(ctypes.c_void_p(a.ctypes.data) for a in (self._self, *arrays)))
        return Plan(*(a.astype(float) for a in arrays))

    def _measured(self, x: ArrayLike | Mapping[str, float]) -> Array:
        names = self.design.measured_names
        if isinstance(x, Mapping):
            values = checks.named("step: x", x, names)
            missing = [name for name in names if name not in values]
            if missing:
                raise ValueError(f"step: x: expected all of {', '.join(names)}, got none for "
                                 f"{', '.join(missing)}")  # fmt: skip
            x = [values[name] for name in names]
        array = np.asarray(x, dtype=float).ravel()
        if array.size != len(names):
            raise ValueError(
                f"step: x: expected {len(names)} numbers ({', '.join(names)}), got {array.size}"
            )
        return np.ascontiguousarray(array)

    def data(
        self,
        references: Mapping[str, ArrayLike] | None,
        t: float,
        p: Mapping[str, float] | None,
        bounds: Mapping[str, float] | None,
    ) -> CycleData:
        """Return the arguments of `step` over the whole horizon."""
        design, h = self.design, self.design.horizon
        R = np.tile(design.r0, (h.count + 1, 1))
        for name, value in checks.named("step: references", references, h.references).items():
            values = np.asarray(value, dtype=float).ravel()
            if values.size not in (1, h.count + 1):
                raise ValueError(
                    f"step: {name}: expected 1 number or {h.count + 1}, now and after each "
                    f"interval, got {values.size}"
                )
            R[:, h.references.index(name)] = values
        parameters = design.p0.copy()
        for name, value in checks.named("step: p", p, h.parameters).items():
            parameters[h.parameters.index(name)] = value
        b, names = design.bounds, design.bound_names
        for name, value in checks.named("step: bounds", bounds, names).items():
            b[names.index(name)] = value
        return CycleData(R, t + h.step * np.arange(h.count + 1.0), parameters, b)
