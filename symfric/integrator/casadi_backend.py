"""Integration by CasADi's own implicit integrators: rosenbrock, or SUNDIALS' idas."""

from collections.abc import Mapping
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.integrator.inputs import Drivers, Input, drivers
from symfric.integrator.trajectory import Statistics, Trajectory
from symfric.model import Model
from symfric.status import Status

Array = NDArray[np.float64]
CHUNKS = 32
MAX_STEPS = 1_000_000


@dataclass(frozen=True, eq=False)
class _Problem:
    """A model with its inputs put in, states scaled by their nominal values."""

    model: Model
    inputs: Drivers
    dae: dict[str, ca.SX]
    plugin: str
    options: dict[str, Any]

    @property
    def scale(self) -> Array:
        return self.model.nominal("x")

    def over(self, grid: Array) -> tuple[ca.Function, Array]:
        """Integrator from grid[0] over grid[1:], and the input data for it."""
        first = np.searchsorted(self.inputs.breaks, grid[:-1], side="right") - 1
        if self.plugin == "rosenbrock":
            interval, counts = np.unique(first, return_counts=True)
            extra = {"control_group_size": counts.tolist()} if interval.size > 1 else {}
            if interval.size == 1:
                extra = {"control_group_size": [int(counts[0])]}
        else:
            interval, extra = first, {}
        solver = ca.integrator(
            "solver",
            self.plugin,
            self.dae,
            float(grid[0]),
            grid[1:].tolist(),
            {**self.options, **extra},
        )
        return solver, self.inputs.values[:, interval]


def integrate(
    model: Model,
    t_start: float,
    t_end: float,
    times: Array,
    x0: Array,
    u: Mapping[str, Input] | None,
    p: Array,
    rtol: float,
    atol: float,
    backend: str,
) -> Trajectory:
    """Integrate with CasADi and collect the signals at `times`; never raises on a failed solve."""
    begin = perf_counter()
    if backend not in ("auto", "rosenbrock", "sundials"):
        raise ValueError(
            f"simulate: backend: expected auto, rosenbrock or sundials, got {backend!r}"
        )
    problem = _problem(model, drivers(model, u, t_start, t_end), rtol, atol, backend)
    grid = np.unique(np.concatenate([[t_start], problem.inputs.breaks, times]))
    grid = grid[grid <= max(times[-1], t_start)] if times[-1] < t_end else grid
    z0 = _consistent_algebraics(model, problem.inputs, t_start, x0, p)
    solver, data = problem.over(grid)
    built = perf_counter()
    x, z, error, counts = _run(problem, solver, data, grid, x0, z0, p)
    reached = np.isin(times, grid[: x.shape[1]])
    rows = np.searchsorted(grid, times[reached])
    status = Status.SUCCESS if error is None else Status.SOLVER_FAILED
    message = status.value if error is None else _explain(model, grid[x.shape[1] - 1], error)
    return _trajectory(
        problem,
        times[reached],
        x[:, rows],
        z[:, rows],
        p,
        status,
        message,
        Statistics(
            backend=f"casadi {problem.plugin}",
            method="Rosenbrock 5(4)" if problem.plugin == "rosenbrock" else "BDF",
            build_time=built - begin,
            run_time=perf_counter() - built,
            **counts,
        ),
    )


def _problem(
    model: Model, inputs: Drivers, rtol: float, atol: float, backend: str
) -> _Problem:
    scale = ca.DM(model.nominal("x"))
    scaled = ca.SX.sym("x", len(model.x))

    def put_in(expression: ca.SX) -> ca.SX:
        driven = ca.substitute(expression, model.vector("u"), inputs.expression)
        return ca.cse(ca.substitute(driven, model.vector("x"), scale * scaled))

    dae: dict[str, ca.SX] = {
        "t": model.t,
        "x": scaled,
        "p": model.vector("p"),
        "u": inputs.data,
    }
    if model.ode is not None:
        dae |= {"z": model.vector("z"), "ode": put_in(model.ode) / scale, "alg": put_in(model.alg)}
        plugin = "idas" if backend == "sundials" and len(model.z) else "cvodes"
        plugin = plugin if backend == "sundials" else "rosenbrock"
    else:
        rates = ca.SX.sym("rates", len(model.x))
        implicit = ca.substitute(put_in(model.residual), model.xdot, scale * rates)
        dae |= {"z": ca.vertcat(rates, model.vector("z")), "ode": rates, "alg": implicit}
        plugin = "idas"
    options: dict[str, Any] = {"reltol": rtol, "abstol": atol, "max_num_steps": MAX_STEPS}
    if plugin != "rosenbrock":
        # without it SUNDIALS adjoints of several parameters are silently wrong (casadi#4383)
        options["quad_err_con"] = True
    return _Problem(model, inputs, dae, plugin, options)


def _consistent_algebraics(
    model: Model, inputs: Drivers, t: float, x0: Array, p: Array
) -> Array:
    """Start values of everything the integrator treats as algebraic."""
    guess = np.array([float(v.start) for v in model.z])
    implicit = model.ode is None
    if not implicit and not len(model.z):
        return guess
    unknown = ca.vertcat(model.xdot, model.vector("z")) if implicit else model.vector("z")
    equations = model.residual if implicit else model.alg
    start = np.concatenate([np.zeros(len(model.x)), guess]) if implicit else guess
    known = ca.vertcat(model.t, model.vector("x"), inputs.data, model.vector("p"))
    equations = ca.substitute(equations, model.vector("u"), inputs.expression)
    solve = ca.rootfinder(
        "consistent", "newton", {"x": unknown, "p": known, "g": equations}, {"error_on_fail": True}
    )
    try:
        values = solve(start, np.concatenate([[t], x0, inputs.values[:, 0], p])).full().ravel()
    except RuntimeError:
        raise ValueError(
            f"model '{model.name}': expected consistent start values, found no solution of the "
            "algebraic equations near the start values of z; give better ones"
        ) from None
    if implicit:
        values[: len(model.x)] /= model.nominal("x")
    return values


def _run(
    problem: _Problem, solver: ca.Function, data: Array, grid: Array, x0: Array, z0: Array, p: Array
) -> tuple[Array, Array, str | None, dict[str, int]]:
    """States and algebraics on the grid as far as it goes, the error, and the counts."""
    nz = len(problem.model.z)
    try:
        result = solver(x0=x0 / problem.scale, z0=z0, p=p, u=data)
        counts = _counts(solver)
        x = np.column_stack([x0, result["xf"].full() * problem.scale[:, None]])
        z = np.column_stack([z0, result["zf"].full()])[z0.size - nz :]
        return x, z, None, counts
    except RuntimeError as failure:
        error = str(failure)
    # Again in pieces, so that everything before the failure is kept.
    pieces = np.array_split(np.arange(1, grid.size), min(CHUNKS, grid.size - 1))
    x, z, counts = x0[:, None], z0[:, None], dict.fromkeys(_counts(solver), 0)
    for piece in pieces:
        part = grid[[piece[0] - 1, *piece]]
        solver, data = problem.over(part)
        try:
            result = solver(x0=x[:, -1] / problem.scale, z0=z[:, -1], p=p, u=data)
        except RuntimeError as failure:
            error = str(failure)
            break
        counts = {name: counts[name] + n for name, n in _counts(solver).items()}
        x = np.column_stack([x, result["xf"].full() * problem.scale[:, None]])
        z = np.column_stack([z, result["zf"].full()])
    return x, z[z0.size - nz :], error, counts


def _counts(solver: ca.Function) -> dict[str, int]:
    stats = solver.stats()
    return {
        "steps": int(stats.get("n_steps", stats.get("nsteps", 0))),
        "rejections": int(stats.get("n_reject", stats.get("netfails", 0))),
        "evaluations": int(stats.get("n_rhs", stats.get("nfevals", 0))),
        "jacobians": int(stats.get("n_jac", stats.get("nlinsetups", 0))),
    }


def _explain(model: Model, t: float, error: str) -> str:
    last = [line for line in error.strip().splitlines() if line.strip()][-1].strip()
    return (
        f"simulate '{model.name}': stopped after t = {t:g} s ({last}); look for a discontinuity "
        "or a NaN there, or loosen rtol"
    )


def _trajectory(
    problem: _Problem,
    t: Array,
    x: Array,
    z: Array,
    p: Array,
    status: Status,
    message: str,
    statistics: Statistics,
) -> Trajectory:
    model, inputs = problem.model, problem.inputs
    signals = model.function("signals")
    names = list(model.signals)
    input_of = inputs.of_time(model.t)
    last = inputs.values.shape[1] - 1

    def evaluate(times: Array, states: Array, algebraics: Array) -> dict[str, Array]:
        interval = np.clip(np.searchsorted(inputs.breaks, times, side="right") - 1, 0, last)
        n = times.size
        u = input_of.map(n)(times[None, :], inputs.values[:, interval])
        columns = np.tile(p[:, None], (1, n))
        values = signals.map(n)(times[None, :], states, algebraics, u, columns).full()
        return dict(zip(names, values, strict=True))

    found = evaluate(t, x, z) if t.size else {name: np.zeros(0) for name in names}

    def dense(times: Array) -> dict[str, Array]:
        """Cubic Hermite interpolation of the states, linear of the algebraic variables."""
        k = np.clip(np.searchsorted(t, times, side="right") - 1, 0, t.size - 2)
        h = t[k + 1] - t[k]
        s = (times - t[k]) / h
        slopes = _slopes(model, inputs, input_of, t, x, z, p)
        states = (
            (1 + 2 * s) * (1 - s) ** 2 * x[:, k]
            + s**2 * (3 - 2 * s) * x[:, k + 1]
            + h * s * (1 - s) ** 2 * slopes[:, k]
            + h * s**2 * (s - 1) * slopes[:, k + 1]
        )
        return evaluate(times, states, (1 - s) * z[:, k] + s * z[:, k + 1])

    return Trajectory(
        model.name, t, found, dict(model.signals), status, message, statistics, dense
    )


def _slopes(
    model: Model,
    inputs: Drivers,
    input_of: ca.Function,
    t: Array,
    x: Array,
    z: Array,
    p: Array,
) -> Array:
    if model.ode is None:
        return np.gradient(x, t, axis=1)
    last = inputs.values.shape[1] - 1
    interval = np.clip(np.searchsorted(inputs.breaks, t, side="right") - 1, 0, last)
    u = input_of.map(t.size)(t[None, :], inputs.values[:, interval])
    columns = np.tile(p[:, None], (1, t.size))
    return model.function("ode").map(t.size)(t[None, :], x, z, u, columns).full()
