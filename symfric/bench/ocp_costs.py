"""Cost of optimal control: derivatives of large programs, and a model predictive controller on
plants with other friction than its model.
"""

from collections.abc import Callable, Iterator
from functools import partial
from math import log, nan

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.formulation.expressions import at_end, effort, track
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.problems import cart_pendulum, guide
from ocp.solving.methods import Ipopt
from ocp.transcription.program import Program
from ocp.transcription.schemes import Radau, make_meshes
from ocp.transcription.transcribe import discretise
from symfric.bench.report import Found, interleaved, timed
from symfric.foundation.programs import find_compiler
from symfric.laws import BrownMcPhee, ExactCoulomb, Law, LuGre
from symfric.model import Model
from symfric.scenes.blocks import drive

Array = NDArray[np.float64]
INTERVALS = (50, 200, 1000, 5000)
SIZES = "Derivatives of the program of a cart-pendulum in the virtual machine"
MPC = "Model predictive controller of a drive"


def program_sizes(quick: bool) -> Iterator[Found]:
    """Build programs of growing size with their derivatives, and evaluate these.

    The build time is processor time. The exponent is the growth of the time of both derivatives
    over the previous row.
    """
    before = (nan, nan)
    for N in INTERVALS[: 3 if quick else None]:
        build_s, program = timed(partial(_program, N))
        n, m = program.w.numel(), program.g.numel()
        at, lam = ca.DM([0.1] * n), ca.DM([0.1] * m)
        best = interleaved(
            {
                "jacobian": partial(program.jacobian, at, program.values),
                "hessian": partial(program.hessian, at, program.values, 1.0, lam),
            },
            budget=0.3,
        )
        both = sum(best.values())
        yield SIZES, {
            "intervals": N, "unknowns": n, "rows": m,
            "nonzeros": program.jacobian.nnz_out(1) + program.hessian.nnz_out(0),
            "build time [s]": build_s, "Jacobian [ms]": 1e3 * best["jacobian"],
            "Hessian [ms]": 1e3 * best["hessian"],
            "growth exponent": log(both / before[1]) / log(N / before[0]),
        }  # fmt: skip
        before = N, both


def _program(N: int) -> Program:
    problem = cart_pendulum(v_t=0.1)
    program = discretise(problem, Radau()).on(make_meshes(problem, N)).program
    Ipopt().prepared(program)
    return program


STEP, HORIZON = 0.01, 20
GOAL = 0.1
LOOK = 0.75
"""Time [s] at which the distance from the goal is measured; the controller knows that it will move
back at 1 s."""
CYCLES = 1000


def _drive(law: Law) -> Model:
    return drive(law, m=1.0, N=1.0)


LEVELS = {"mu_s": 6.0, "mu_d": 4.0}
PLANTS: dict[str, Callable[[], Law]] = {
    "brown_mcphee 1e-2": lambda: BrownMcPhee(v_t=1e-2, **LEVELS),
    "brown_mcphee 1e-4": lambda: BrownMcPhee(v_t=1e-4, **LEVELS),
    "lugre 1e5 N/m": lambda: LuGre(v_s=1e-2, sigma_0=1e5, sigma_1=300.0, sigma_2=0.0, **LEVELS),
    "exact_coulomb": lambda: ExactCoulomb(mu_s=6.0, mu_d=4.0),
}


def receding() -> Problem:
    """Return the problem of a drive that moves to a position and stays: 20 intervals of 10 ms."""
    cost = track("x", "goal", 900.0) + track("v", 0.0, 1.0) + effort("force", 1e-3)
    cost += at_end(lambda s: 100.0 * (s.x - s.goal) ** 2 + s.v**2)
    stage = _drive(guide(1e-2))
    return Problem(
        Phase(stage, T=STEP * HORIZON), cost, bounds={"force": (-20.0, 20.0)}, p={"goal": 0.0}
    )


def controllers(quick: bool) -> Iterator[Found]:
    """Move every plant between two positions.

    Unreported failures are cycles that report convergence but did not converge.
    """
    controller = receding().to_mpc(step=STEP)
    cycles = CYCLES // 10 if quick else CYCLES

    def goal(times: Array) -> Array:
        """GOAL in every other second."""
        return GOAL * (np.floor(times + 1e-9) % 2 == 0)

    for name, law in PLANTS.items():
        found = controller.simulate(_drive(law()), cycles * STEP, {"goal": goal})
        moved = min(int(np.searchsorted(found.t, LOOK)), found.t.size - 1)
        yield MPC, {
            "plant": name, "cycles": found.t.size, "median time per cycle [ms]": 1e3 * found.median,
            "largest time [ms]": 1e3 * found.worst,
            "largest processor time [ms]": 1e3 * found.worst_cpu,
            "most QPs per cycle": int(found.iterations.max()), "failed cycles": found.unconverged,
            "unreported failures": found.unreported,
            "distance from the goal [mm]": 1e3 * abs(float(found["x"][moved]) - GOAL),
            "controller": "C" if find_compiler() else "Python",
        }  # fmt: skip
