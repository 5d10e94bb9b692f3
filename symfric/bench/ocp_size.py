"""What derivatives of large programs take: a cart-pendulum on more and more intervals."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from math import log, nan
from time import process_time
from typing import final

import casadi as ca

from ocp.problems.friction import cart_pendulum
from ocp.solvers.methods import Ipopt
from ocp.transcription.grid import make_meshes
from ocp.transcription.schemes import Radau
from ocp.transcription.transcribe import discretise
from symfric.bench.timing import interleaved

INTERVALS = (50, 200, 1000, 5000)


@final
@dataclass(frozen=True)
class SizeRow:
    """A program of so many intervals.

    Attributes:
        intervals, unknowns, rows: its size.
        nonzeros: of Jacobian and Hessian.
        build_s: processor time [s] of writing it and its derivatives for the solver.
        jacobian_ms, hessian_ms: of one evaluation in CasADi's virtual machine [ms].
        exponent: growth of both together over the row before.
    """

    intervals: int
    unknowns: int
    rows: int
    nonzeros: int
    build_s: float
    jacobian_ms: float
    hessian_ms: float
    exponent: float


def size_rows(quick: bool) -> Iterator[SizeRow]:
    """Build and evaluate the derivatives of ever larger programs."""
    before: SizeRow | None = None
    for N in INTERVALS[: 3 if quick else None]:
        problem = cart_pendulum(v_t=0.1)
        begin = process_time()
        transcription = discretise(problem, Radau()).on(make_meshes(problem, N))
        program = transcription.program
        Ipopt().prepared(program)
        build = process_time() - begin
        n, m = program.w.numel(), program.g.numel()
        w = [0.1] * n
        at, lam = ca.DM(w), ca.DM([0.1] * m)
        best = interleaved(
            {
                "jacobian": partial(program.jacobian, at, program.values),
                "hessian": partial(program.hessian, at, program.values, 1.0, lam),
            },
            budget=0.3,
        )
        jacobian, hessian = best["jacobian"], best["hessian"]
        both = jacobian + hessian
        exponent = nan
        if before is not None:
            old = 1e-3 * (before.jacobian_ms + before.hessian_ms)
            exponent = log(both / old) / log(N / before.intervals)
        nonzeros = program.jacobian.nnz_out(1) + program.hessian.nnz_out(0)
        before = SizeRow(N, n, m, nonzeros, build, 1e3 * jacobian, 1e3 * hessian, exponent)
        yield before
