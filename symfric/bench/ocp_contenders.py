"""symfric and tools on CasADi in the benchmark of optimal control, with recommended settings.

A contender maps a `MoveCase` to an `Attempt`. Tools without dry friction solve the problem with the
smooth friction of `MoveCase.smooth`, from a linear guess, with Ipopt; nosnoc solves it with Coulomb
friction (no static level above the sliding one).
"""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from itertools import pairwise
from typing import Any, final

import casadi as ca
import numpy as np

from ocp import Problem, Solution, solve
from symfric.bench.ocp_cases import UNBOUNDED, MoveCase
from symfric.foundation.numeric import Array
from symfric.foundation.status import Status


@final
@dataclass(frozen=True, eq=False)
class Attempt:
    """Result of a contender.

    Attributes:
        claimed: cost J reported by the contender.
        status: status reported by the contender, in its words.
        edges: limits of the intervals of the control [s], shape (N + 1,).
        controls: values of the input, shape (N,).
    """

    claimed: float
    status: str
    edges: Array
    controls: Array


Contender = Callable[[MoveCase, float], Attempt]
"""Function (case, limit of time [s]) -> attempt."""


def _ipopt(limit: float) -> dict[str, Any]:
    return {
        "print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.max_iter": 2000,
        "ipopt.max_cpu_time": limit,
    }  # fmt: skip


def even(case: MoveCase, claimed: float, status: object, controls: Any) -> Attempt:
    """Return an attempt on the grid of the case."""
    edges = np.linspace(0.0, case.T, case.intervals + 1)
    return Attempt(float(claimed), str(status), edges, np.ravel(controls).astype(float))


def _sides(case: MoveCase) -> list[Any]:
    """Return the bounds of the states, as two arrays."""
    boxes = [case.bounds.get(i, UNBOUNDED) for i in range(len(case.states))]
    return list(np.array(boxes).T)


def guesses_of(case: MoveCase, count: int) -> Array:
    """Return the guess of the states at equal times, shape (count, states)."""
    return np.array([case.guess(s) for s in np.linspace(0, 1, count)])


def equations(case: MoveCase, width: float) -> ca.Function:
    """Return the Function (x, u) -> (x', running cost) with smooth friction."""
    x, u = ca.SX.sym("x", len(case.states)), ca.SX.sym("u")
    rate = case.smooth(ca, ca.vertsplit(x), u, width)
    return ca.Function("f", [x, u], [ca.vertcat(*rate), case.running(ca, ca.vertsplit(x), u)])


def _final(case: MoveCase, x: Any) -> Any:
    return case.final(ca, ca.vertsplit(x), 0.0)


PATIENCE = 4.0
"""Ratio of wall time, which limits symfric, to the processor time that limits Ipopt."""


def symfric(case: MoveCase, limit: float) -> Attempt:
    """Return the solution of `ocp.solve` with its default settings, on intervals of its own."""
    found = solved(case.problem(), max_time=PATIENCE * limit)
    status = "verified" if found.verified else found.status.name
    return Attempt(found.cost, status, *held(found))


def solved(problem: Problem, **options: Any) -> Solution:
    """Return the result of `ocp.solve`, also of a failure.

    Raises:
        KeyboardInterrupt: Ctrl-C, which `ocp.solve` turns into a status.
    """
    found = solve(problem, throw=False, **options)
    if found.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    return found


def held(solution: Solution) -> tuple[Array, Array]:
    """Return the limits of the intervals [s] of a control of one input, and its values."""
    (controls,) = solution.motions[0].controls.values()
    return np.append(solution.t_control, solution.motions[0].phases[-1].end), np.asarray(controls)


def opti(case: MoveCase, limit: float, width: float) -> Attempt:
    """Return the solution by Radau collocation of degree 3 in CasADi's Opti, as in its examples."""
    o, f, N, n = ca.Opti(), equations(case, width), case.intervals, len(case.states)
    slopes, ends, weights = ca.collocation_coeff(ca.collocation_points(3, "radau"))
    x, u, cost, h = o.variable(n, N + 1), o.variable(1, N), ca.MX(0), case.T / N
    guess = guesses_of(case, 3 * N + 1).T
    o.set_initial(x, guess[:, ::3])
    for k in range(N):
        inner = o.variable(n, 3)
        o.set_initial(inner, guess[:, 3 * k + 1 : 3 * k + 4])
        both = ca.horzcat(x[:, k], inner)
        rate, running = f(inner, u[:, k])
        o.subject_to(both @ slopes == h * rate)
        o.subject_to(x[:, k + 1] == both @ ends)
        cost += h * running @ weights
    o.subject_to(x[:, 0] == ca.DM(case.start))
    for s, values in case.ends.items():
        for i, value in values.items():
            o.subject_to(x[i, round(s * N)] == value)
    for i, (low, high) in case.bounds.items():
        o.subject_to(o.bounded(low, x[i, :], high))
    o.subject_to(o.bounded(-case.limit, u, case.limit))
    cost += _final(case, x[:, N])
    o.minimize(cost)
    o.solver("ipopt", _ipopt(limit))
    try:
        value = o.solve().value
    except RuntimeError:  # without convergence, the last iterate is used
        value = o.debug.value
    return even(case, value(cost), o.stats()["return_status"], value(u))


def rockit(case: MoveCase, limit: float, width: float) -> Attempt:
    """Return the solution by collocation with rockit; stages end where states are prescribed."""
    tool: Any = import_module("rockit")
    master, f, stages = tool.Ocp(), equations(case, width), list[tuple[Any, Any, Any, int]]()
    for a, b in pairwise([0.0, *sorted(case.ends)]):
        stage = master.stage(t0=a * case.T, T=(b - a) * case.T)
        x, u = stage.state(len(case.states)), stage.control()
        rate, running = f(x, u)
        stage.set_der(x, rate)
        stage.add_objective(stage.integral(running))
        stage.subject_to(-case.limit <= (u <= case.limit))
        for i, (low, high) in case.bounds.items():
            stage.subject_to(low <= (x[i] <= high))
        N = round((b - a) * case.intervals)
        grid = np.linspace(a, b, N + 1)
        samples = np.array([case.guess(s) for s in grid])
        line = ca.interpolant("line", "linear", [grid * case.T], samples.ravel(), {})
        stage.set_initial(x, line(stage.t))
        stage.method(tool.DirectCollocation(N=N))
        old = stages[-1] if stages else None
        before = old[0].at_tf(old[1]) if old else ca.DM(case.start)
        master.subject_to(before == stage.at_t0(x))
        for i, value in case.ends[b].items():
            master.subject_to(stage.at_tf(x)[i] == value)
        if b == 1.0:
            stage.add_objective(_final(case, stage.at_tf(x)))
        stages.append((stage, x, u, N))
    master.solver("ipopt", _ipopt(limit))
    try:
        found = master.solve_limited()
    except RuntimeError:
        found = master.non_converged_solution
    controls = [np.ravel(found(s).sample(u, grid="control")[1])[:N] for s, _, u, N in stages]
    claimed = sum(float(found(stage).value(stage.objective)) for stage, *_ in stages)
    return even(case, claimed, found.stats["return_status"], np.concatenate(controls))


def nosnoc(case: MoveCase, limit: float) -> Attempt:
    """Return the solution by finite elements with switch detection, as in the examples of nosnoc.

    The settings are those of its cart-pole with friction: Radau IIA with 2 stages, 2 elements in
    each interval. A prescribed state at a middle time is a path constraint with a switch.
    """
    tool: Any = import_module("nosnoc")
    options = tool.NosnocOpts()
    options.irk_scheme, options.n_s, options.print_level = tool.IrkSchemes.RADAU_IIA, 2, 0
    options.N_stages, options.N_finite_elements = case.intervals, 2
    options.terminal_time = case.T
    options.opts_casadi_nlp["ipopt"]["max_cpu_time"] = limit
    n, count = len(case.states), len(case.slips)
    x, u, on = ca.SX.sym("x", n), ca.SX.sym("u"), ca.SX.sym("on")
    xs = ca.vertsplit(x)
    loads = case.normal(ca, xs, u)

    def rate(forces: Sequence[Any]) -> ca.SX:
        return ca.vertcat(*case.rate(ca, xs, u, forces))

    free, pushed = rate([0.0] * count), list[ca.SX]()
    for i, (_, sliding) in enumerate(case.levels):
        unit = [0.0] * count
        unit[i] = sliding * loads[i]
        pushed.append(rate(unit) - free)
    branches = [ca.horzcat(share, -share) for share in pushed]
    branches[0] += ca.horzcat(free, free)
    middle = {i: value for s, ends in case.ends.items() if s < 1 for i, value in ends.items()}
    active = np.array([[(k + 1) / case.intervals in case.ends] for k in range(case.intervals)])
    active[-1] = False
    model = tool.NosnocModel(
        x=x, F=branches, S=[np.array([[1.0], [-1.0]])] * count, c=[x[i] for i in case.slips],
        x0=np.array(case.start), u=u, p_time_var=on, p_time_var_val=active.astype(float),
    )  # fmt: skip
    low, high = _sides(case)
    problem = tool.NosnocOcp(
        lbu=np.array([-case.limit]), ubu=np.array([case.limit]), lbx=low, ubx=high,
        f_q=case.running(ca, xs, u), f_terminal=ca.SX(_final(case, x)),
        g_terminal=ca.vertcat(ca.SX(0, 1), *(x[i] - v for i, v in case.ends[1.0].items())),
        g_path=ca.vertcat(ca.SX(0, 1), *(on * (x[i] - v) for i, v in middle.items())),
    )  # fmt: skip
    found = tool.NosnocSolver(options, model, problem).solve()
    return even(case, found["cost_val"], found["status"].name, found["u_traj"])


def do_mpc(case: MoveCase, limit: float, width: float) -> Attempt:
    """Return the solution by do-mpc, the first plan of a controller over the whole problem."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # do-mpc warns about each missing optional package
        tool: Any = import_module("do_mpc")
    n, N = len(case.states), case.intervals
    plant = tool.model.Model("continuous", "SX")
    x, u = plant.set_variable("_x", "x", (n, 1)), plant.set_variable("_u", "u")
    plant.set_variable("_tvp", "on")
    plant.set_rhs("x", equations(case, width)(x, u)[0])
    plant.setup()
    x, u, on = plant.x["x"], plant.u["u"], plant.tvp["on"]
    running = equations(case, width)(x, u)[1]
    control = tool.controller.MPC(plant)
    control.settings.n_horizon, control.settings.t_step = N, case.T / N
    control.settings.nlpsol_opts = _ipopt(limit)
    control.set_objective(mterm=ca.SX(_final(case, x)) + 0.0 * x[0], lterm=running * case.T / N)
    control.set_rterm(u=0.0)
    control.bounds["lower", "_u", "u"], control.bounds["upper", "_u", "u"] = -case.limit, case.limit
    low, high = (side.reshape(n, 1).copy() for side in _sides(case))
    control.bounds["lower", "_x", "x"], control.bounds["upper", "_x", "x"] = low, high
    for i, value in case.ends[1.0].items():
        low[i], high[i] = value - 1e-9, value + 1e-9
    control.terminal_bounds["lower", "x"], control.terminal_bounds["upper", "x"] = low, high
    plan, middle = control.get_tvp_template(), [s for s in case.ends if s < 1]
    for s in middle:
        plan["_tvp", round(s * N), "on"] = 1.0
        for i, value in case.ends[s].items():
            control.set_nl_cons(f"over_{i}", on * (x[i] - value), 0.0)
            control.set_nl_cons(f"under_{i}", on * (value - x[i]), 0.0)

    def planned(t: float) -> Any:
        return plan

    control.set_tvp_fun(planned)
    control.setup()
    control.x0 = np.array(case.start).reshape(n, 1)
    control.set_initial_guess()
    for k, guess in enumerate(guesses_of(case, N + 1)):
        control.opt_x_num["_x", k] = guess
    control.make_step(control.x0)
    controls = [float(control.opt_x_num["_u", k, 0][0]) for k in range(N)]
    cost = ca.Function("J", [control.opt_x, control.opt_p], [control.nlp_obj])
    claimed = cost(control.opt_x_num, control.opt_p_num)
    return even(case, float(claimed), control.solver_stats["return_status"], controls)
