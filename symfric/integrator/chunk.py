"""A part of an ensemble as plain data, so that it can be sent to any worker."""

from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.integrator.compiler import find_compiler
from symfric.integrator.dense import from_records
from symfric.integrator.engine import CompiledEngine, Stop, VmEngine, c_source
from symfric.integrator.inputs import Drivers
from symfric.integrator.integrator import Integrator
from symfric.integrator.step import MEMORY

Array = NDArray[np.float64]
ROWS, ATTEMPTS = 2048, 2000


@final
@dataclass(frozen=True, eq=False)
class Chunk:
    """Start columns S (members, MEMORY + n) and run data R (members, size)."""

    S: Array
    R: Array


@final
@dataclass(frozen=True, eq=False)
class Solved:
    """Solutions y (members, times, n), stop reasons, attempts, times reached, run data d."""

    y: Array
    reason: NDArray[np.int64]
    made: NDArray[np.int64]
    reached: Array
    p: Array


@final
@dataclass(frozen=True, eq=False)
class Job:
    """What all chunks of an ensemble share; picklable.

    Attributes:
        code: C source of the step and its loop, or the serialised step for the virtual machine.
        compiled: which of the two.
        nx, n, dense_rows: differential and all unknowns, rows of dense output.
        breaks, data: input intervals and the data on them.
        times: times of the results [s].
    """

    code: str
    compiled: bool
    nx: int
    n: int
    dense_rows: int
    breaks: Array
    data: Array
    times: Array
    max_steps: int

    @classmethod
    def of(
        cls, integrator: Integrator, inputs: Drivers, times: Array, backend: str, max_steps: int
    ) -> "Job":
        """The job of an integrator; the virtual machine takes over where no compiler is."""
        rows = integrator.tableau.H.shape[0]
        compiled = backend == "compiled" and find_compiler() is not None
        code = c_source(integrator.step, rows) if compiled else str(integrator.step.serialize())
        s = integrator.system
        return cls(code, compiled, s.nx, s.n, rows, inputs.breaks, inputs.values, times, max_steps)

    def digest(self) -> str:
        """Hash of everything in it."""
        arrays = self.breaks.tobytes() + self.data.tobytes() + self.times.tobytes()
        return sha256(self.code.encode() + arrays).hexdigest()

    @property
    def h_min(self) -> float:
        """Smallest step [s]."""
        return 1e-15 * max(float(np.abs(self.breaks).max()), 1e-3)


@cache
def _compiled(code: str, n: int, dense_rows: int) -> CompiledEngine:
    return CompiledEngine.of_source(code, n, dense_rows)


@cache
def _vm(code: str) -> VmEngine:
    return VmEngine.of(ca.Function.deserialize(code))


def solve_chunk(job: Job, chunk: Chunk) -> Solved:
    """Integrate the members of a chunk one after another."""
    S, R = np.ascontiguousarray(chunk.S), np.ascontiguousarray(chunk.R)
    return _solve_compiled(job, S, R) if job.compiled else _solve_vm(job, S, R)


def _solve_compiled(job: Job, S: Array, R: Array) -> Solved:
    members = S.shape[0]
    y = np.empty((members, job.times.size, job.n))
    reason, made = np.zeros(members, dtype=np.int64), np.zeros(members, dtype=np.int64)
    data = np.ascontiguousarray(job.data)
    _compiled(job.code, job.n, job.dense_rows).library.symfric_many(
        S.ctypes.data,
        R.ctypes.data,
        R.shape[1],
        members,
        job.breaks.ctypes.data,
        data.ctypes.data,
        data.shape[1],
        data.shape[0],
        job.times.ctypes.data,
        job.times.size,
        job.max_steps,
        job.h_min,
        y.ctypes.data,
        reason.ctypes.data,
        made.ctypes.data,
    )
    return Solved(y, reason, made, S[:, 0].copy(), R[:, 2 + job.nx :])


def _solve_vm(job: Job, S: Array, R: Array) -> Solved:
    members, engine = S.shape[0], _vm(job.code)
    y = np.full((members, job.times.size, job.n), np.nan)
    reason, made = np.zeros(members, dtype=np.int64), np.zeros(members, dtype=np.int64)
    for m in range(members):
        state, run = S[m].copy(), R[m].copy()
        y[m, job.times <= state[0]] = state[MEMORY:]
        for k in range(job.breaks.size - 1):
            run[0] = job.breaks[k + 1]
            run[run.size - job.data.shape[0] :] = job.data[:, k]
            stop = Stop.FULL
            while stop in (Stop.FULL, Stop.ATTEMPTS) and made[m] < job.max_steps:
                records, count, stop = engine.run(state, run, ROWS, ATTEMPTS, job.h_min)
                made[m] += count
                if records.shape[0]:
                    dense = from_records(records, job.n)
                    inside = (job.times > dense.t0[0]) & (job.times <= dense.t1[-1])
                    y[m, inside] = dense(job.times[inside]).T
            reason[m] = stop
            if stop is not Stop.END:
                break
        S[m, 0] = state[0]
    return Solved(y, reason, made, S[:, 0].copy(), R[:, 2 + job.nx :])
