"""A move with friction by users of Opti, rockit and do-mpc; a block under CasADi's integrators.

    min  integral of u^2,   0.1 m in 1 s from rest to rest,   |u| <= 20 N,   50 intervals

of a drive of 1 kg pressed by 10 N. The law goes in as the right-hand side of the model
("collocation") or inside `flow` as a discrete step ("flow"). The referee is `simulate` with the
very law under the control that was found: `miss` is how far from rest at the goal that ends.
"""

import contextlib
import io
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from math import hypot
from time import process_time
from typing import Any, NamedTuple, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.bench import table
from symfric.integrator import Hold, flow, simulate
from symfric.laws import GMS, BrownMcPhee, ElastoPlastic, Law, LuGre
from symfric.model import Model
from symfric.scenes import drive, rabinowicz

Array = NDArray[np.float64]
GOAL, T, N, LIMIT, LOAD = 0.1, 1.0, 50, 20.0, 10.0
STEPS = 10
"""Of the flow, in each interval: 2 ms, which resolves the bristles."""
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


class Move(NamedTuple):
    """The move as one tool solved it.

    Attributes:
        tool, route, law: who, how, with what.
        answer: the word of Ipopt, or why there is none.
        iterations: of Ipopt.
        cost: integral of u^2 [N^2 s].
        miss: distance from the goal [m] and speed there times 1 s [m], together, in `simulate`.
        time_s: processor time [s] of building and solving.
    """

    tool: str
    route: str
    law: str
    answer: str
    iterations: int
    cost: float
    miss: float
    time_s: float


@final
@dataclass(frozen=True)
class Run:
    """One integrator of CasADi on 20 s of stick-slip, compared with `simulate` at rtol 1e-10.

    Attributes:
        integrator: of `casadi.integrator`, or "symfric".
        law: what rubs.
        error: of the elongation [m], the largest at 401 times.
        ratio: processor time of the call over that of symfric's in its virtual machine.
        answer: "" or why there is none.
    """

    integrator: str
    law: str
    error: float
    ratio: float
    answer: str = ""


@final
@dataclass(frozen=True, eq=False)
class InteropBenchmark(table.Report):
    """Moves, integrators and what is not installed."""

    moves: tuple[Move, ...]
    runs: tuple[Run, ...]
    absent: tuple[str, ...]

    def shown(self) -> Iterator[table.Table | str]:
        """Moves by tool, route and law; CasADi's integrators; what is absent."""
        yield table.of(
            "Move of 0.1 m in 1 s with friction; the miss is that of `simulate` with the law",
            self.moves,
            {"tool": "tool", "route": "route", "law": "law",
             "cost J [N^2 s]": lambda m: f"{m.cost:.3f}", "miss [m]": table.shortened("miss"),
             "iterations": "iterations", "processor time [s]": lambda m: f"{m.time_s:.1f}",
             "status": lambda m: _word(m.answer)},
        )  # fmt: skip
        yield table.of(
            "20 s of stick-slip with CasADi's integrators and with symfric without a compiler",
            self.runs,
            {"integrator": "integrator", "law": "law",
             "largest error [m]": table.shortened("error"),
             "ratio of time to symfric": table.shortened("ratio"), "status": "answer"},
        )  # fmt: skip
        yield from (f"{tool} is not installed: no rows" for tool in self.absent)


def _word(answer: str) -> str:
    """The words of Ipopt, shorter; nothing where it solved the problem."""
    known = {
        "Solve_Succeeded": "",
        "Maximum_CpuTime_Exceeded": "out of time",
        "Search_Direction_Becomes_Too_Small": "gave up",
    }
    return known.get(answer, answer.replace("_", " ").lower())


def bench_interop(*, quick: bool = False, progress: table.Progress = None) -> InteropBenchmark:
    """Measure all tools that are installed; `quick`: two laws. Ctrl-C returns the rows so far."""
    absent = tuple(tool for tool in ("rockit", "do_mpc") if find_spec(tool) is None)
    tasks = [
        (tool, route, law)
        for law in (QUICK if quick else LAWS)
        for tool, route in ROUTES
        if tool not in absent
    ]

    def measured() -> Iterator[Move | Run]:
        for task in table.each(tasks, progress, ", ".join):
            yield move(*task)
        for law in QUICK:
            yield from integrators(law)

    found = table.until_stopped(measured())
    moves = tuple(row for row in found if isinstance(row, Move))
    return InteropBenchmark(moves, tuple(row for row in found if isinstance(row, Run)), absent)


def move(tool: str, route: str, law: str) -> Move:
    """The move with one law, by one tool on one route."""
    begin = process_time()
    model = drive(LAWS[law](), m=1.0, N=LOAD)
    start = np.array([GOAL / 2, GOAL / T, *_steady(model)])
    try:
        with contextlib.redirect_stderr(io.StringIO()):
            controls, answer, iterations = ROUTES[tool, route](model, start)
    except (RuntimeError, ValueError) as error:
        answer = " ".join(str(error).split())[:60]
        return Move(tool, route, law, answer, 0, np.nan, np.nan, process_time() - begin)
    spent = process_time() - begin
    cost = float(np.sum(controls**2) * T / N)
    return Move(tool, route, law, answer, iterations, cost, miss(model, controls), spent)


def miss(model: Model, controls: Array) -> float:
    """Distance of the model's end from rest at the goal under `controls`."""
    held = Hold(np.linspace(0.0, T, N + 1)[:-1], controls)
    rest = {v.name: 0.0 for v in model.x}
    run = simulate(model, T, u={"force": held}, x0=rest, rtol=1e-8, throw=False)
    return hypot(run.final["x"] - GOAL, run.final["v"] * T) if run.status.ok else np.nan


def _steady(model: Model) -> list[float]:
    """States of the law in steady sliding, where the solvers start."""
    return [float(z) for c in model.contacts for z in ca.DM(c.law.steady_state(GOAL / T, LOAD)).nz]


def right_hand_side(model: Model) -> ca.Function:
    """(x, u) -> dx/dt: all that other tools want of an explicit model."""
    if model.ode is None:
        raise ValueError(f"bench interop: expected an explicit model, got '{model.name}'")
    return ca.Function("f", [model.vector("x"), model.vector("u")], [model.ode])


def step(model: Model) -> ca.Function:
    """(x, u, p, h) -> x after an interval, by fixed steps of `flow`."""
    return flow(model, steps=STEPS)


def opti_flow(model: Model, start: Array) -> tuple[Array, str, int]:
    """Multiple shooting with `flow`."""
    o, advance, nx = ca.Opti(), step(model), len(model.x)
    x, u = o.variable(nx, N + 1), o.variable(1, N)
    o.subject_to(x[:, 0] == 0)
    for k in range(N):
        o.subject_to(x[:, k + 1] == advance(x[:, k], u[:, k], [], T / N))
    o.set_initial(x, np.tile(start[:, None], N + 1))
    return _solved(o, x[:, N], u)


def opti_collocation(model: Model, start: Array) -> tuple[Array, str, int]:
    """Radau collocation of degree 3, as in CasADi's own example."""
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
    """Solve with rockit: `set_next` takes `flow`, `set_der` the right-hand side."""
    rockit: Any = import_module("rockit")
    o = rockit.Ocp(T=T)
    x, u = o.state(len(model.x)), o.control()
    if by_flow:
        o.set_next(x, step(model)(x, u, [], T / N))
        o.method(rockit.MultipleShooting(N=N))
        o.add_objective(o.sum(u**2) * T / N)
    else:
        o.set_der(x, right_hand_side(model)(x, u))
        o.method(rockit.DirectCollocation(N=N, degree=3))
        o.add_objective(o.integral(u**2))
    o.subject_to(o.at_t0(x) == 0)
    o.subject_to(o.at_tf(x)[:2] == ca.DM([GOAL, 0.0]))
    o.subject_to(-LIMIT <= (u <= LIMIT))  # noqa: SIM300  (how rockit writes it)
    o.set_initial(x, start)
    o.solver("ipopt", IPOPT)
    try:
        found = o.solve()
    except RuntimeError:
        found = o.non_converged_solution
    controls = found.sample(u, grid="control")[1]
    return controls[:N], str(found.stats["return_status"]), int(found.stats["iter_count"])


def do_mpc_move(model: Model, start: Array, by_flow: bool) -> tuple[Array, str, int]:
    """Solve with do-mpc: the first plan of a controller whose horizon is the whole move."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it tells at once of all extras that are not installed
        do_mpc: Any = import_module("do_mpc")
    nx = len(model.x)
    plant = do_mpc.model.Model("discrete" if by_flow else "continuous", "MX")
    x, u = plant.set_variable("_x", "x", (nx, 1)), plant.set_variable("_u", "u")
    rate = step(model)(x, u, [], T / N) if by_flow else right_hand_side(model)(x, u)
    plant.set_rhs("x", rate)
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
    said = control.solver_stats
    return plan, str(said["return_status"]), int(said["iter_count"])


ROUTES: dict[tuple[str, str], Callable[[Model, Array], tuple[Array, str, int]]] = {
    ("opti", "flow"): opti_flow,
    ("opti", "collocation"): opti_collocation,
    ("rockit", "flow"): lambda model, start: rockit_move(model, start, by_flow=True),
    ("rockit", "collocation"): lambda model, start: rockit_move(model, start, by_flow=False),
    ("do_mpc", "flow"): lambda model, start: do_mpc_move(model, start, by_flow=True),
    ("do_mpc", "collocation"): lambda model, start: do_mpc_move(model, start, by_flow=False),
}
"""(tool, route) -> what its user writes."""

INTEGRATORS: dict[str, dict[str, Any]] = {
    "cvodes": {"reltol": 1e-8, "abstol": 1e-10, "max_num_steps": 100_000},
    "idas": {"reltol": 1e-8, "abstol": 1e-10, "max_num_steps": 100_000},
    "collocation": {"number_of_finite_elements": 100},
    "rk": {"number_of_finite_elements": 100},
}
"""Options that a user gives who wants 1e-5; of the last two, steps between two results."""


def integrators(law: str) -> Iterator[Run]:
    """CasADi's integrators on the block on a belt with `law`."""
    model = rabinowicz(LAWS[law]())
    times = np.linspace(0.0, 20.0, 401)
    exact = simulate(model, 20.0, samples=401, rtol=1e-10)
    start = {v.name: exact[v.name][0] for v in model.x}
    simulate(model, 20.0, samples=401, backend="vm")  # builds, as `ca.integrator` does below
    begin = process_time()
    ours = simulate(model, 20.0, samples=401, backend="vm")
    spent = process_time() - begin
    yield Run("symfric", law, float(np.abs(ours["x"] - exact["x"]).max()), 1.0)
    x = model.vector("x")
    dae = {"x": x, "ode": ca.SX(right_hand_side(model)(x, []))}
    for name, options in INTEGRATORS.items():
        made = ca.integrator("I", name, dae, 0.0, times, options)
        begin = process_time()
        try:
            with contextlib.redirect_stderr(io.StringIO()):
                found: Any = made(x0=[start[v.name] for v in model.x])["xf"].toarray()
        except RuntimeError as error:
            why = str(error).splitlines()[-1].partition(": ")[2]
            yield Run(name, law, np.nan, np.nan, why)
            continue
        error = float(np.abs(found[0] - exact["x"]).max())
        yield Run(name, law, error, (process_time() - begin) / spent)
