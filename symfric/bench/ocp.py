"""Optimal control with dry friction: symfric and other tools, judged by a neutral referee.

Every contender solves the same problems (`ocp_cases`) with the settings that it recommends. The
referee (`ocp_referee`) simulates each control with exact Coulomb friction and stiction, and returns
its cost and its miss at the prescribed states. Times are processor times of a whole call, including
building, compilers and, for symfric, verification.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from math import nan

import numpy as np

from ocp.formulation.expressions import at_end, effort, track
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.problems import guide
from symfric.bench.ocp_cases import CASES, QUICK, Case
from symfric.bench.ocp_contenders import Attempt, Contender
from symfric.bench.ocp_others import attempted, contenders
from symfric.bench.ocp_referee import Verdict, judged
from symfric.bench.report import Found, Progress, Report, Row, curves
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import check_names
from symfric.foundation.programs import find_compiler
from symfric.laws import BrownMcPhee, ExactCoulomb, Law, LuGre
from symfric.model import Model
from symfric.scenes.blocks import drive

LIMIT, QUICK_LIMIT = 20.0, 3.0
"""Time limits of one solve [s]."""
TITLE = (
    "Optimal control with dry friction; the referee simulates every control with exact Coulomb "
    "friction and stiction"
)
TIME, COST, MISS = "processor time [s]", "cost by the referee", "relative miss by the referee"


def bench(
    quick: bool = False, cases: Sequence[str] | None = None, progress: Progress = None
) -> Report:
    """Compare the contenders in 10 to 15 minutes on one core, or in one minute with `quick`.

    Args:
        quick: fewer problems, one width of smooth friction, no controllers.
        cases: names of problems; by default all of them, and controllers.
        progress: called with the current item, the fraction done and each row.
    """
    known = {case.name: case for case in CASES}
    check_names("bench ocp", cases or (), known)
    tasks: dict[str, Callable[[], Iterator[Found]]] = {
        f"{name}, {who}": partial(_found, known[name], who, contender, quick)
        for name in cases or (QUICK if quick else known)
        for who, contender in contenders(quick).items()
    }
    if not cases and not quick:
        tasks["controllers"] = controllers
    draw = curves("problem", ("contender",), TIME, COST, MISS)
    return Report((TITLE, draw)).collect(tasks, progress)


def _found(case: Case, who: str, contender: Contender, quick: bool) -> Iterator[Found]:
    attempt, seconds = attempted(contender, case, QUICK_LIMIT if quick else LIMIT)
    yield TITLE, row_of(case, who, attempt, seconds)


def row_of(case: Case, who: str, attempt: Attempt | str, seconds: float) -> Row:
    """Return the row of an attempt; a text is the reason why there is none."""
    verdict, claimed, intervals, status = Verdict(nan, nan), nan, nan, attempt
    if isinstance(attempt, Attempt):
        verdict = judged(case, attempt.edges, attempt.controls)
        claimed, status, intervals = attempt.claimed, attempt.status, attempt.controls.size
    return {
        "problem": case.name, "contender": who, TIME: seconds, COST: verdict.cost,
        MISS: verdict.miss, "claimed cost": claimed, "intervals": intervals,
        "status": str(status).replace("_", " ").lower(),
    }  # fmt: skip


# ---- a model predictive controller on plants whose friction differs from its model ----

MPC = "Model predictive controller of a drive"
STEP, HORIZON = 0.01, 20
GOAL = 0.1
"""Distance between the positions of the controller [m]."""
LOOK = 0.75
"""Time [s] at which the distance from the goal is measured; the controller anticipates the return
at 1 s."""
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
    """Return the problem of a drive that moves to a position and stays, with 20 steps of 10 ms."""
    cost = track("x", "goal", 900.0) + track("v", 0.0, 1.0) + effort("force", 1e-3)
    cost += at_end(lambda s: 100.0 * (s.x - s.goal) ** 2 + s.v**2)
    stage = _drive(guide(1e-2))
    return Problem(
        Phase(stage, T=STEP * HORIZON), cost, bounds={"force": (-20.0, 20.0)}, p={"goal": 0.0}
    )


def controllers(cycles: int = CYCLES) -> Iterator[Found]:
    """Measure a controller that moves each plant between two positions.

    Unreported failures are cycles that report convergence although they did not converge.
    """
    controller = receding().to_mpc(step=STEP)

    def goal(times: Array) -> Array:
        """Return `GOAL` in every other second, and 0 otherwise."""
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
