"""Costs of optimal control: derivatives of large programs; a model predictive controller on plants
whose friction is not the one it believes.
"""

from collections.abc import Callable, Iterator
from functools import partial
from math import log, nan
from time import process_time
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.formulation.expressions import at_end, effort, track
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.problems import cart_pendulum, guide
from ocp.solving.methods import Ipopt
from ocp.transcription.schemes import Radau, make_meshes
from ocp.transcription.transcribe import discretise
from symfric.bench.table import interleaved
from symfric.foundation.programs import find_compiler
from symfric.laws import BrownMcPhee, ExactCoulomb, LuGre
from symfric.model import Model
from symfric.scenes.blocks import drive

INTERVALS = (50, 200, 1000, 5000)


class SizeRow(NamedTuple):
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


Array = NDArray[np.float64]
STEP, HORIZON = 0.01, 20
GOAL = 0.1
LOOK = 0.75
"""When it should be there [s]: it knows that it will go back at 1 s."""
CYCLES = 1000


class MpcRow(NamedTuple):
    """A controller on a plant.

    Attributes:
        plant: its friction.
        cycles: number of control steps.
        median_ms, worst_ms: of a cycle on the clock [ms].
        worst_cpu_ms: of the processor [ms].
        iterations: most quadratic programs in a cycle.
        unconverged: cycles that say that they did not converge.
        unreported: cycles that say they did, and did not.
        off_mm: distance from the goal at 0.75 s [mm].
        compiled: whether the controller ran as C.
    """

    plant: str
    cycles: int
    median_ms: float
    worst_ms: float
    worst_cpu_ms: float
    iterations: int
    unconverged: int
    unreported: int
    off_mm: float
    compiled: bool


def _drive(law: BrownMcPhee | LuGre | ExactCoulomb) -> Model:
    return drive(law, m=1.0, N=1.0)


PLANTS: dict[str, Callable[[], Model]] = {
    "brown_mcphee 1e-2": lambda: _drive(BrownMcPhee(mu_s=6.0, mu_d=4.0, v_t=1e-2)),
    "brown_mcphee 1e-4": lambda: _drive(BrownMcPhee(mu_s=6.0, mu_d=4.0, v_t=1e-4)),
    "lugre 1e5 N/m": lambda: _drive(
        LuGre(mu_s=6.0, mu_d=4.0, v_s=1e-2, sigma_0=1e5, sigma_1=300.0, sigma_2=0.0)
    ),
    "exact_coulomb": lambda: _drive(ExactCoulomb(mu_s=6.0, mu_d=4.0)),
}


def receding() -> Problem:
    """A drive goes to a place and stays: 20 intervals of 10 ms."""
    cost = track("x", "goal", 900.0) + track("v", 0.0, 1.0) + effort("force", 1e-3)
    cost += at_end(lambda s: 100.0 * (s.x - s.goal) ** 2 + s.v**2)
    stage = drive(guide(1e-2), m=1.0, N=1.0)
    return Problem(
        Phase(stage, T=STEP * HORIZON), cost, bounds={"force": (-20.0, 20.0)}, p={"goal": 0.0}
    )


def mpc_rows(quick: bool) -> Iterator[MpcRow]:
    """The controller on every plant, to and fro between two places."""
    controller = receding().to_mpc(step=STEP)
    cycles = CYCLES // 10 if quick else CYCLES
    for name, plant in PLANTS.items():
        found = controller.simulate(plant(), cycles * STEP, {"goal": _there_and_back})
        moved = int(np.searchsorted(found.t, LOOK))
        yield MpcRow(
            plant=name,
            cycles=found.t.size,
            median_ms=1e3 * found.median,
            worst_ms=1e3 * found.worst,
            worst_cpu_ms=1e3 * found.worst_cpu,
            iterations=int(found.iterations.max()),
            unconverged=found.unconverged,
            unreported=found.unreported,
            off_mm=1e3 * abs(float(found["x"][min(moved, found.t.size - 1)]) - GOAL),
            compiled=find_compiler() is not None,
        )


def _there_and_back(times: Array) -> Array:
    """GOAL in every other second."""
    return GOAL * (np.floor(times + 1e-9) % 2 == 0)
