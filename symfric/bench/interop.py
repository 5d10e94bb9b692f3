"""Moves with friction in Opti, rockit and do-mpc, and a block in CasADi's integrators.

    min  integral of u^2,   0.1 m in 1 s from rest to rest,   |u| <= 20 N,   50 intervals

for a drive of 1 kg with a normal force of 10 N. The law is part of the right-hand side of the model
("collocation") or of a discrete step of `flow` ("flow"). `simulate` verifies all controls with the
original law: `miss` is the final distance from rest at the goal.
"""

import contextlib
import io
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from math import hypot
from time import process_time
from typing import Any

import casadi as ca
import numpy as np

from symfric import Hold, Model, drive, flow, rabinowicz, simulate
from symfric.bench.report import Found, Progress, Report, Row, timed
from symfric.foundation.numeric import Array
from symfric.laws import GMS, BrownMcPhee, ElastoPlastic, Law, LuGre

GOAL, T, N, LIMIT, LOAD = 0.1, 1.0, 50, 20.0, 10.0
STEPS = 10
"""Number of steps of `flow` in each interval; steps of 2 ms resolve the bristles."""
IPOPT = {
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.max_iter": 300,
    "ipopt.max_cpu_time": 5.0,
}
LAWS: dict[str, Callable[[], Law]] = {
    "brown_mcphee": BrownMcPhee,
    "lugre": LuGre,
    "elasto_plastic": ElastoPlastic,
    "gms": GMS,
}
QUICK = ("brown_mcphee", "lugre")
MOVES = "Move of 0.1 m in 1 s with friction; the miss is that of `simulate` with the law"
RUNS = "20 s of stick-slip with CasADi's integrators and with symfric without a compiler"


def bench(quick: bool = False, progress: Progress = None) -> Report:
    """Measure all installed tools; with `quick`, only two laws."""
    absent = [tool for tool in ("rockit", "do_mpc") if find_spec(tool) is None]
    tasks: dict[str, Callable[[], Iterator[Found]]] = {
        f"{tool}, {route}, {law}": lambda t=tool, r=route, k=law: iter([(MOVES, move(t, r, k))])
        for law in (QUICK if quick else LAWS)
        for tool, route in ROUTES
        if tool not in absent
    }
    tasks |= {f"integrators, {law}": partial(integrators, law) for law in QUICK}
    report = Report(notes=[f"{tool} is not installed: no rows" for tool in absent])
    return report.collect(tasks, progress)


STATUS = {
    "Solve_Succeeded": "",
    "Maximum_CpuTime_Exceeded": "out of time",
    "Search_Direction_Becomes_Too_Small": "gave up",
}
"""Status of Ipopt -> shorter text."""


def move(tool: str, route: str, law: str) -> Row:
    """Return the row of the move with one law, solved by one tool on one route.

    The miss combines the distance from the goal [m] and the final speed times 1 s [m]. The time
    includes building.
    """
    begin = process_time()
    model = drive(LAWS[law](), m=1.0, N=LOAD)
    sliding = model.contacts[0].law.steady_state(GOAL / T, LOAD)
    start = np.array([GOAL / 2, GOAL / T, *map(float, ca.DM(sliding).nz)])
    iterations, cost, miss = 0, np.nan, np.nan
    try:
        with contextlib.redirect_stderr(io.StringIO()):
            controls, status, iterations = ROUTES[tool, route](model, start)
    except (RuntimeError, ValueError) as error:
        status, spent = " ".join(str(error).split())[:60], process_time() - begin
    else:
        spent = process_time() - begin
        cost, miss = float(np.sum(controls**2) * T / N), missed(model, controls)
    return {
        "tool": tool, "route": route, "law": law, "cost J [N^2 s]": cost, "miss [m]": miss,
        "iterations": iterations, "processor time [s]": spent,
        "status": STATUS.get(status, status.replace("_", " ").lower()),
    }  # fmt: skip


def missed(model: Model, controls: Array) -> float:
    """Return the distance of the simulated end from rest at the goal; NaN if the run fails."""
    held = Hold(np.linspace(0.0, T, N + 1)[:-1], controls)
    rest = {v.name: 0.0 for v in model.x}
    run = simulate(model, T, u={"force": held}, x0=rest, rtol=1e-8, throw=False)
    return hypot(run.final["x"] - GOAL, run.final["v"] * T) if run.status.ok else np.nan


def right_hand_side(model: Model) -> ca.Function:
    """Return the Function (x, u) -> dx/dt, which other tools need of an explicit model."""
    if model.ode is None:
        raise ValueError(f"bench interop: expected an explicit model, got '{model.name}'")
    return ca.Function("f", [model.vector("x"), model.vector("u")], [model.ode])


def opti_flow(model: Model, start: Array) -> tuple[Array, str, int]:
    """Return the solution by multiple shooting with `flow` in Opti."""
    o, advance, nx = ca.Opti(), flow(model, steps=STEPS), len(model.x)
    x, u = o.variable(nx, N + 1), o.variable(1, N)
    o.subject_to(x[:, 0] == 0)
    for k in range(N):
        o.subject_to(x[:, k + 1] == advance(x[:, k], u[:, k], [], T / N))
    o.set_initial(x, np.tile(start[:, None], N + 1))
    return _solved(o, x[:, N], u)


def opti_collocation(model: Model, start: Array) -> tuple[Array, str, int]:
    """Return the solution by Radau collocation of degree 3 in Opti, as in CasADi's example."""
    o, f, nx, degree = ca.Opti(), right_hand_side(model), len(model.x), 3
    tau = ca.collocation_points(degree, "radau")
    slopes, ends, _ = ca.collocation_coeff(tau)
    u, x = o.variable(1, N), o.variable(nx)
    o.subject_to(x == 0)
    for k in range(N):
        inner = o.variable(nx, degree)
        o.set_initial(inner, np.tile(start[:, None], degree))
        both = ca.horzcat(x, inner)
        o.subject_to(both @ slopes == T / N * f(inner, u[:, k]))
        x = o.variable(nx)
        o.set_initial(x, start)
        o.subject_to(x == both @ ends)
    return _solved(o, x, u)


def _solved(o: ca.Opti, end: ca.MX, u: ca.MX) -> tuple[Array, str, int]:
    o.subject_to(end[:2] == ca.DM([GOAL, 0.0]))
    o.subject_to(o.bounded(-LIMIT, ca.vec(u), LIMIT))
    o.minimize(ca.sumsqr(u) * T / N)
    o.solver("ipopt", IPOPT)
    try:
        value = o.solve().value
    except RuntimeError:
        value = o.debug.value
    stats = o.stats()
    return np.ravel(value(u)), str(stats["return_status"]), int(stats["iter_count"])


def rockit_move(model: Model, start: Array, by_flow: bool) -> tuple[Array, str, int]:
    """Return the solution by rockit; `set_next` takes `flow`, `set_der` the right-hand side."""
    rockit: Any = import_module("rockit")
    o = rockit.Ocp(T=T)
    x, u = o.state(len(model.x)), o.control()
    if by_flow:
        o.set_next(x, flow(model, steps=STEPS)(x, u, [], T / N))
        o.method(rockit.MultipleShooting(N=N))
        o.add_objective(o.sum(u**2) * T / N)
    else:
        o.set_der(x, right_hand_side(model)(x, u))
        o.method(rockit.DirectCollocation(N=N, degree=3))
        o.add_objective(o.integral(u**2))
    o.subject_to(o.at_t0(x) == 0)
    o.subject_to(o.at_tf(x)[:2] == ca.DM([GOAL, 0.0]))
    o.subject_to(-LIMIT <= (u <= LIMIT))  # noqa: SIM300  (syntax of rockit)
    o.set_initial(x, start)
    o.solver("ipopt", IPOPT)
    try:
        found = o.solve()
    except RuntimeError:
        found = o.non_converged_solution
    controls = found.sample(u, grid="control")[1]
    return controls[:N], str(found.stats["return_status"]), int(found.stats["iter_count"])


def do_mpc_move(model: Model, start: Array, by_flow: bool) -> tuple[Array, str, int]:
    """Return the solution by do-mpc, the first plan of a controller over the whole move."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # do-mpc warns about each missing optional package
        do_mpc: Any = import_module("do_mpc")
    nx = len(model.x)
    plant = do_mpc.model.Model("discrete" if by_flow else "continuous", "MX")
    x, u = plant.set_variable("_x", "x", (nx, 1)), plant.set_variable("_u", "u")
    advance = flow(model, steps=STEPS)(x, u, [], T / N) if by_flow else None
    plant.set_rhs("x", right_hand_side(model)(x, u) if advance is None else advance)
    plant.setup()
    control = do_mpc.controller.MPC(plant)
    control.settings.n_horizon, control.settings.t_step = N, T / N
    control.settings.collocation_deg, control.settings.collocation_ni = 3, 1
    control.settings.nlpsol_opts = IPOPT
    control.set_objective(mterm=ca.MX(0) * x[0], lterm=u**2)
    control.set_rterm(u=0.0)
    control.bounds["lower", "_u", "u"], control.bounds["upper", "_u", "u"] = -LIMIT, LIMIT
    low, high = np.full((nx, 1), -1e6), np.full((nx, 1), 1e6)
    low[:2, 0], high[:2, 0] = [GOAL - 1e-9, -1e-9], [GOAL + 1e-9, 1e-9]
    control.terminal_bounds["lower", "x"], control.terminal_bounds["upper", "x"] = low, high
    control.setup()
    control.x0 = np.zeros((nx, 1))
    control.set_initial_guess()
    control.opt_x_num["_x"] = ca.DM(start)
    control.make_step(np.zeros((nx, 1)))
    plan = np.array([float(control.opt_x_num["_u", k, 0][0]) for k in range(N)])
    stats = control.solver_stats
    return plan, str(stats["return_status"]), int(stats["iter_count"])


ROUTES: dict[tuple[str, str], Callable[[Model, Array], tuple[Array, str, int]]] = {
    ("opti", "flow"): opti_flow,
    ("opti", "collocation"): opti_collocation,
    ("rockit", "flow"): partial(rockit_move, by_flow=True),
    ("rockit", "collocation"): partial(rockit_move, by_flow=False),
    ("do_mpc", "flow"): partial(do_mpc_move, by_flow=True),
    ("do_mpc", "collocation"): partial(do_mpc_move, by_flow=False),
}
"""(tool, route) -> function that solves the move with the tool; it maps model and start to
controls, status of Ipopt and number of iterations."""

SUNDIALS = {"reltol": 1e-8, "abstol": 1e-10, "max_num_steps": 100_000}
INTEGRATORS: dict[str, dict[str, Any]] = {
    "cvodes": SUNDIALS,
    "idas": SUNDIALS,
    "collocation": {"number_of_finite_elements": 100},
    "rk": {"number_of_finite_elements": 100},
}
"""Options for an accuracy of 1e-5; the number of elements is that between two results."""


def integrators(law: str) -> Iterator[Found]:
    """Compare CasADi's integrators on the block on a belt with `simulate` at rtol 1e-10.

    The error is the largest error of the elongation at 401 times; times are processor times
    relative to `simulate` in the virtual machine.
    """
    model = rabinowicz(LAWS[law]())
    times = np.linspace(0.0, 20.0, 401)
    exact = simulate(model, 20.0, samples=401, rtol=1e-10)
    start = [exact[v.name][0] for v in model.x]

    def row(name: str, x: Array | None, ratio: float, status: str = "") -> Found:
        error = np.nan if x is None else float(np.abs(x - exact["x"]).max())
        return RUNS, {"integrator": name, "law": law, "largest error [m]": error,
                      "ratio of time to symfric": ratio, "status": status}  # fmt: skip

    call = partial(simulate, model, 20.0, samples=401, backend="vm")
    call()  # the first call builds the integrator, as `ca.integrator` does below
    spent, ours = timed(call)
    yield row("symfric", ours["x"], 1.0)
    x = model.vector("x")
    dae = {"x": x, "ode": ca.SX(right_hand_side(model)(x, []))}
    for name, options in INTEGRATORS.items():
        made = ca.integrator("I", name, dae, 0.0, times, options)
        begin = process_time()
        try:
            with contextlib.redirect_stderr(io.StringIO()):
                found: Any = made(x0=start)["xf"].toarray()
        except RuntimeError as error:
            yield row(name, None, np.nan, str(error).splitlines()[-1].partition(": ")[2])
        else:
            yield row(name, found[0], (process_time() - begin) / spent)
