"""Optimal control with dry friction: symfric and other tools, judged by a neutral referee.

Every contender solves the same problems (`ocp_cases`) with the settings that it recommends. The
referee (`ocp_referee`) simulates each control with exact Coulomb friction and stiction, and returns
its cost and its miss at the prescribed states. Times are processor times of a whole call, including
building, compilers and, for symfric, verification.
"""

import contextlib
import io
import os
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from importlib import import_module
from itertools import pairwise
from math import nan
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ocp import Phase, Problem, at_end, effort, track
from ocp.problems import guide
from symfric import BrownMcPhee, ExactCoulomb, Law, LuGre, Model, drive
from symfric.bench import ocp_contenders as others
from symfric.bench.ocp_cases import CASES, QUICK, MoveCase
from symfric.bench.ocp_contenders import Attempt, Contender, even, guesses_of
from symfric.bench.ocp_referee import ControlVerdict, judged
from symfric.bench.report import Found, Progress, Report, Row, curves
from symfric.foundation.numeric import Array
from symfric.foundation.programs import find_compiler

LIMIT, QUICK_LIMIT = 20.0, 3.0
"""Time limits of one solve [s]."""
TITLE = (
    "Optimal control with dry friction; the referee simulates every control with exact Coulomb "
    "friction and stiction"
)
TIME, COST, MISS = "processor time [s]", "cost by the referee", "relative miss by the referee"


def bench(quick: bool = False, progress: Progress = None) -> Report:
    """Compare the contenders in 10 to 15 minutes on one core, or in one minute with `quick`.

    Args:
        quick: fewer problems, one width of smooth friction, no controllers.
        progress: called with the current item, the fraction done and each row.
    """
    tasks: dict[str, Callable[[], Iterator[Found]]] = {
        f"{case.name}, {who}": partial(_found, case, who, contender, quick)
        for case in CASES
        if case.name in QUICK or not quick
        for who, contender in contenders(quick).items()
    }
    if not quick:
        tasks["controllers"] = controllers
    draw = curves("problem", ("contender",), TIME, COST, MISS)
    return Report((TITLE, draw)).collect(tasks, progress)


def _found(case: MoveCase, who: str, contender: Contender, quick: bool) -> Iterator[Found]:
    attempt, seconds = attempted(contender, case, QUICK_LIMIT if quick else LIMIT)
    yield TITLE, row_of(case, who, attempt, seconds)


def row_of(case: MoveCase, who: str, attempt: Attempt | str, seconds: float) -> Row:
    """Return the row of an attempt; a text is the reason why there is none."""
    verdict, claimed, intervals, status = ControlVerdict(nan, nan), nan, nan, attempt
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


def receding(law: Law) -> Problem:
    """Return the problem of a drive that moves to a position and stays, with 20 steps of 10 ms."""
    cost = track("x", "goal", 900.0) + track("v", 0.0, 1.0) + effort("force", 1e-3)
    cost += at_end(lambda s: 100.0 * (s.x - s.goal) ** 2 + s.v**2)
    bounds = {"force": (-20.0, 20.0)}
    return Problem(Phase(_drive(law), T=STEP * HORIZON), cost, bounds=bounds, p={"goal": 0.0})


def controllers(cycles: int = CYCLES) -> Iterator[Found]:
    """Measure a controller that moves each plant between two positions.

    Unreported failures are cycles that report convergence although they did not converge.
    """
    controller = receding(guide(1e-2)).to_mpc(step=STEP)

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


# ---- opty and Dymos, which do not use CasADi, and the list of all contenders ----


def opty(case: MoveCase, limit: float, width: float) -> Attempt:
    """Return the solution by the midpoint rule with opty, in SymPy and compiled C."""
    tool: Any = import_module("opty")
    sm: Any = import_module("sympy")
    N, t = case.intervals, sm.Symbol("t")
    x = [sm.Function(name)(t) for name in case.states]
    u = sm.Function("u")(t)
    eom = sm.Matrix([a.diff(t) for a in x]) - sm.Matrix(case.smooth(sm, x, u, width))
    h = case.T / N
    last = sm.sympify(case.final(sm, x, u))
    end = sm.lambdify([x], [last, *(last.diff(a) for a in x)], "numpy")
    fixed = {0.0: dict(enumerate(case.start)), **case.ends}
    instance = [
        x[i].func(round(s * N) * h) - v for s, ends in fixed.items() for i, v in ends.items()
    ]
    running, slope = tool.create_objective_function(
        sm.Integral(case.running(sm, x, u), t), x, [u], [], N + 1, h,
        integration_method="midpoint", time_symbol=t,
    )  # fmt: skip
    ends = slice(N, len(x) * (N + 1), N + 1)

    def objective(free: Array) -> float:
        return running(free) + end(free[ends])[0]

    def gradient(free: Array) -> Array:
        found = slope(free)
        found[ends] += end(free[ends])[1:]
        return found

    bounds = {u: (-case.limit, case.limit), **{x[i]: box for i, box in case.bounds.items()}}
    problem = tool.Problem(
        objective, gradient, eom, x, N + 1, h, instance_constraints=instance, time_symbol=t,
        bounds=bounds, integration_method="midpoint",
    )  # fmt: skip
    for name, value in {"max_iter": 2000, "max_cpu_time": limit, "print_level": 0}.items():
        problem.add_option(name, value)
    guess = np.concatenate([guesses_of(case, N + 1).T.ravel(), np.zeros(N + 1)])
    solution, info = problem.solve(guess)
    nodes = solution[len(x) * (N + 1) :]
    status = OPTY.get(info["status"], info["status"])
    return even(case, info["obj_val"], status, 0.5 * (nodes[1:] + nodes[:-1]))


OPTY = {
    0: "Solve_Succeeded", 1: "Solved_To_Acceptable_Level", 2: "Infeasible_Problem_Detected",
    5: "User_Requested_Stop", -1: "Maximum_Iterations_Exceeded", -2: "Restoration_Failed",
    -4: "Maximum_CpuTime_Exceeded",
}  # fmt: skip
"""Number of a status of Ipopt -> its name."""


SAMPLES = 40
"""Number of samples of the control in each segment of Dymos."""


def _dynamics(om: Any, case: MoveCase, width: float) -> Any:
    """Return the component of OpenMDAO with the equations; the cost is a state J."""

    class Dynamics(om.ExplicitComponent):
        def initialize(self) -> None:
            self.options.declare("num_nodes", types=int)

        def setup(self) -> None:
            shape = (self.options["num_nodes"],)
            for name in (*_names(case), "u"):
                self.add_input(name, shape=shape)
            for name in (*(f"d_{name}" for name in _names(case)), "total"):
                self.add_output(name, shape=shape)
            self.declare_coloring(wrt="*", method="cs", show_summary=False)

        def compute(self, inputs: Any, outputs: Any) -> None:
            *x, J = (inputs[name] for name in _names(case))
            u = inputs["u"]
            rates = [*case.smooth(np, x, u, width), case.running(np, x, u)]
            for name, rate in zip(_names(case), rates, strict=True):
                outputs[f"d_{name}"] = rate
            outputs["total"] = J + case.final(np, x, u)

    return Dynamics


def _names(case: MoveCase) -> list[str]:
    return [*(f"x_{name}" for name in case.states), "J"]


def _phase(tool: Any, case: MoveCase, equations: Any, a: float, b: float) -> Any:
    """Return the phase between two fractions of T."""
    scheme = tool.Radau(num_segments=round((b - a) * case.intervals / 3), order=3)
    phase = tool.Phase(ode_class=equations, transcription=scheme)
    phase.set_time_options(fix_initial=True, fix_duration=True)
    sizes = [*(case.size.get(i, 1.0) for i in range(len(case.states))), 10.0]
    for i, (name, size) in enumerate(zip(_names(case), sizes, strict=True)):
        low, high = case.bounds.get(i, (None, None))
        phase.add_state(
            name, rate_source=f"d_{name}", targets=[name], fix_initial=a == 0.0, lower=low,
            upper=high, ref=size, defect_ref=size,
        )  # fmt: skip
    phase.add_control(
        "u", targets=["u"], lower=-case.limit, upper=case.limit, ref=case.limit,
        continuity=False, rate_continuity=False,
    )  # fmt: skip
    for i, value in case.ends[b].items():
        phase.add_boundary_constraint(_names(case)[i], loc="final", equals=value, ref=sizes[i])
    phase.add_timeseries_output("total")
    return phase


def dymos(case: MoveCase, limit: float, width: float) -> Attempt:
    """Return the solution by Radau pseudospectral collocation of order 3 in Dymos, with SLSQP.

    Each segment has a cubic control, so a third of the intervals gives about as many unknowns of
    the control; it is sampled for the referee. SLSQP has no limit of time, but 200 iterations.
    """
    om: Any = import_module("openmdao.api")
    tool: Any = import_module("dymos")
    problem = om.Problem(reports=False)
    driver = problem.driver = om.ScipyOptimizeDriver(optimizer="SLSQP", maxiter=200, disp=False)
    driver.declare_coloring(show_summary=False)
    trajectory = problem.model.add_subsystem("traj", tool.Trajectory())
    spans, equations = list(pairwise([0.0, *sorted(case.ends)])), _dynamics(om, case, width)
    phases = {f"p{k}": _phase(tool, case, equations, *span) for k, span in enumerate(spans)}
    for name, phase in phases.items():
        trajectory.add_phase(name, phase)
    phases[f"p{len(spans) - 1}"].add_objective("total", loc="final", ref=10.0)
    if len(phases) > 1:
        trajectory.link_phases([*phases], _names(case))
    problem.setup(force_alloc_complex=True)
    for (name, phase), (a, b) in zip(phases.items(), spans, strict=True):
        problem.set_val(f"traj.{name}.t_initial", a * case.T)
        problem.set_val(f"traj.{name}.t_duration", (b - a) * case.T)
        guess = np.array([[*case.guess(a), 0.0], [*case.guess(b), 0.0]])
        for state, ends in zip(_names(case), guess.T, strict=True):
            phase.set_state_val(state, ends)
        phase.set_control_val("u", [0.0, 0.0])
    tool.run_problem(problem, simulate=False, make_plots=False)
    edges, controls, claimed = [0.0], list[float](), 0.0
    for name in phases:
        t, u, total = (problem.get_val(f"traj.{name}.timeseries.{v}") for v in SERIES)
        claimed = float(total[-1, 0])
        for nodes, values in zip(t.reshape(-1, 4), u.reshape(-1, 4), strict=True):
            cubic = np.polyfit(nodes - nodes[0], values, 3)
            fine = np.linspace(nodes[0], nodes[-1], SAMPLES + 1)
            edges += fine[1:].tolist()
            controls += np.polyval(cubic, 0.5 * (fine[1:] + fine[:-1]) - nodes[0]).tolist()
    status = {"SUCCESS": "Solve_Succeeded"}.get(driver.result.exit_status, "Failed")
    return Attempt(claimed, status, np.array(edges), np.array(controls))


SERIES = ("time", "u", "total")


PACKAGES = {"rockit": "rockit-meco", "nosnoc": "nosnoc", "do_mpc": "do-mpc"}
"""Module -> distribution of the optional extra `peers`."""
WIDE, NARROW = 0.1, 0.01
"""Widths of smooth friction, in units of the sliding speed of each case."""


def contenders(quick: bool) -> dict[str, Contender]:
    """Return the contenders by name; tools with smooth friction appear once for each width.

    Tools that compile or build for long run with the narrow width only, and not with `quick`.
    """
    tools: dict[str, Callable[..., Attempt]] = {
        "Opti": others.opti, "rockit": others.rockit, "do-mpc": others.do_mpc
    }  # fmt: skip
    slow: dict[str, Callable[..., Attempt]] = {"opty": opty, "Dymos": dymos}
    found: dict[str, Contender] = {"symfric": others.symfric, "nosnoc": others.nosnoc}
    for width in (NARROW,) if quick else (WIDE, NARROW):
        found |= {f"{name} {width:g}": partial(f, width=width) for name, f in tools.items()}
    if not quick:
        found |= {f"{name} {NARROW:g}": partial(f, width=NARROW) for name, f in slow.items()}
    return found


def cpu() -> float:
    """Return the processor time [s] of this process and of the compilers that it called."""
    return sum(os.times()[:4])


def attempted(contender: Contender, case: MoveCase, limit: float) -> tuple[Attempt | str, float]:
    """Return the attempt, or the reason why there is none, and its processor time [s].

    Raises:
        KeyboardInterrupt: Ctrl-C, also within a solver.
    """
    begin, quiet = cpu(), io.StringIO()
    try:
        with (
            TemporaryDirectory() as folder, contextlib.chdir(folder), warnings.catch_warnings(),
            contextlib.redirect_stdout(quiet), contextlib.redirect_stderr(quiet),
        ):  # fmt: skip
            warnings.simplefilter("ignore")
            found: Attempt | str = contender(case, limit)
    except ModuleNotFoundError as error:
        found = f"not installed: {PACKAGES.get(error.name or '', error.name)}"
    except Exception as error:  # noqa: BLE001  (a failing tool is a row of the table)
        found = " ".join(f"{type(error).__name__}: {error}".split())[:80]
    if isinstance(found, Attempt) and found.status == "User_Requested_Stop":
        raise KeyboardInterrupt
    return found, cpu() - begin
