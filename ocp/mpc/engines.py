"""What goes through the cycles: the C itself, or the virtual machine with the same bits."""

import ctypes
from dataclasses import dataclass, replace
from math import inf
from time import perf_counter, thread_time
from typing import Any, Protocol, final

import numpy as np
from numpy.typing import NDArray

from ocp.mpc.design import Design
from ocp.mpc.gauss_newton import CycleStatus, Plan, Report, improved
from ocp.mpc.source import header, sizes, source, timed
from ocp.mpc.sweeps import Given
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


class Engine(Protocol):
    """Goes from cycle to cycle and remembers the plan."""

    def cycle(self, measured: Array, given: Given, tolerance: float, iterations: int) -> Cycle:
        """One cycle; `given` has the reference of every node."""
        ...

    def forget(self) -> None:
        """Start afresh, from a plan that rests."""
        ...

    @property
    def plan(self) -> Plan:
        """A copy of the plan."""
        ...


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

WRAPPER = """
int sf_bytes(void);
int sf_bytes(void) { return (int)sizeof(NAME_t); }
void sf_init(NAME_t *self);
void sf_init(NAME_t *self) { NAME_init(self); }
void sf_plan(const NAME_t *self, double *x, double *u, double *z);
void sf_plan(const NAME_t *self, double *x, double *u, double *z)
{
    int k, i;
    for (k = 0; k <= N; k++) {
        for (i = 0; i < NX; i++) {
            x[k * NX + i] = self->x[k][i];
        }
        for (i = 0; k < N && i < NU; i++) {
            u[k * NU + i] = self->u[k][i];
        }
    }
    for (k = 0; k < ALL; k++) {
        z[k] = self->z[k];
    }
}
/* All members of in and of param in order, all doubles of out and its counts. */
void sf_cycle(NAME_t *self, const double *param, int iterations, const double *in, double *out,
              int *counts);
void sf_cycle(NAME_t *self, const double *param, int iterations, const double *in, double *out,
              int *counts)
{
    NAME_param_t p;
    NAME_out_t o;
    memcpy(&p, param, SF_PARAM * sizeof(double));
    p.iterations = iterations;
    NAME_step(self, &p, (const NAME_in_t *)(const void *)in, &o);
    memcpy(out, &o, SF_OUT * sizeof(double));
    counts[0] = o.iterations;
    counts[1] = o.program_iterations;
    counts[2] = o.status;
}
"""
"""In and out are structs of doubles but for the counts at their ends."""


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
        text += WRAPPER.replace("NAME", design.name)
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
