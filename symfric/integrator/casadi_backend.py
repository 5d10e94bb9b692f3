"""CasADi's own implicit integrators as a second opinion: rosenbrock, SUNDIALS' cvodes and idas."""

from dataclasses import dataclass
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.integrator.dense import Dense, hermite
from symfric.integrator.initial import consistent
from symfric.integrator.inputs import Drivers
from symfric.integrator.run import Run, Tolerances
from symfric.integrator.system import System
from symfric.status import Status

Array = NDArray[np.float64]
CHUNKS = 32
COUNTS: tuple[str, ...] = ("steps", "rejections", "evaluations", "jacobians", "factorisations")
STEPS_PER_INTERVAL = 100_000
"""SUNDIALS would otherwise spend minutes in front of a singularity."""


@final
@dataclass(frozen=True, eq=False)
class Peer:
    """A system for `casadi.integrator`, its differential states scaled by nominal values."""

    system: System
    inputs: Drivers
    p: Array
    plugin: str
    dae: dict[str, ca.SX]
    options: dict[str, Any]

    def over(self, grid: Array) -> tuple[ca.Function, Array]:
        """Integrator from grid[0] over grid[1:], and the input data for it."""
        first = self.inputs.interval((grid[:-1] + grid[1:]) / 2)
        extra: dict[str, Any] = {}
        if self.plugin == "rosenbrock":
            first, counts = np.unique(first, return_counts=True)
            extra["control_group_size"] = counts.tolist()
        solver = ca.integrator(
            "solver",
            self.plugin,
            self.dae,
            float(grid[0]),
            grid[1:].tolist(),
            {**self.options, **extra},
        )
        return solver, self.inputs.values[:, first]


def peer(system: System, inputs: Drivers, p: Array, tolerances: Tolerances, backend: str) -> Peer:
    """Semi-explicit DAE of `system` for CasADi, with time as its own variable.

    Raises:
        ValueError: a mass matrix that is not diagonal, which CasADi does not take.
    """
    rows, columns = system.algebraic
    rates = [i for i in range(system.n) if i not in columns]
    mass = ca.DM(system.mass)
    if rows != columns or mass.nnz() != len(rates):
        raise ValueError(
            "simulate: expected a diagonal mass matrix for this backend, got coupled rates; "
            "use backend='auto'"
        )
    nominal = np.ones(system.n)
    nominal[: system.nx] = system.nominal
    scale = ca.DM(nominal[rates])
    scaled = ca.SX.sym("x", len(rates))
    f = ca.substitute(system.f, system.y[rates], scale * scaled)
    n_p = p.size
    plugin = "rosenbrock" if backend == "rosenbrock" else ("idas" if columns else "cvodes")
    options: dict[str, Any] = {
        "reltol": tolerances.rtol,
        "abstol": float(np.min(tolerances.atol / system.nominal)),
        "max_num_steps": min(tolerances.max_steps, STEPS_PER_INTERVAL),
    }
    if plugin != "rosenbrock":
        # without it SUNDIALS adjoints of several parameters are silently wrong (casadi#4383)
        options["quad_err_con"] = True
    ode = f[rates] / (scale * ca.diag(mass)[rates])
    dae = {
        "x": scaled,
        "z": system.y[columns],
        "p": system.d[:n_p],
        "u": system.d[n_p:],
        "ode": ca.densify(ode),
        "alg": f[rows],
    }
    return Peer(system, inputs, p, plugin, dae, options)


def integrate_by_peer(
    system: System,
    inputs: Drivers,
    y0: Array,
    p: Array,
    times: Array,
    tolerances: Tolerances,
    backend: str,
) -> tuple[Run, Dense, dict[str, int]]:
    """Integrate with CasADi over `times`; a failure keeps what came before it."""
    problem = peer(system, inputs, p, tolerances, backend)
    rates = [i for i in range(system.n) if i not in system.algebraic[1]]
    columns = system.algebraic[1]
    nominal = np.ones(system.n)
    nominal[: system.nx] = system.nominal
    y = consistent(system, "simulate", y0, np.concatenate([p, inputs.values[:, 0]]))
    grid = np.unique(np.concatenate([inputs.breaks, times]))
    run = Run(engine=f"casadi {problem.plugin}")
    found, counts = y[:, None], dict.fromkeys(COUNTS, 0)
    pieces = [np.arange(1, grid.size)]
    while pieces:
        piece = pieces.pop(0)
        solver, data = problem.over(grid[[piece[0] - 1, *piece]])
        try:
            result = solver(
                x0=found[rates, -1] / nominal[rates], z0=found[columns, -1], p=p, u=data
            )
        except RuntimeError as error:
            if piece.size == grid.size - 1 > 1:
                # again in pieces, so that everything before the failure is kept
                pieces = np.array_split(piece, min(CHUNKS, piece.size))
                continue
            last = [line for line in str(error).splitlines() if line.strip()][-1].strip()
            run.stop(
                Status.SOLVER_FAILED,
                f"simulate: {problem.plugin} stopped after t = {grid[piece[0] - 1]:g} s ({last}); "
                "look for a discontinuity or a NaN there, or loosen rtol",
            )
            break
        part = np.zeros((system.n, piece.size))
        part[rates] = result["xf"].full() * nominal[rates, None]
        part[columns] = result["zf"].full()
        found = np.hstack([found, part])
        for name, value in _counts(solver).items():
            counts[name] += value
    return run, _dense(system, inputs, p, grid[: found.shape[1]], found), counts


def _counts(solver: ca.Function) -> dict[str, int]:
    stats = solver.stats()
    jacobians = int(stats.get("n_jac", stats.get("nlinsetups", 0)))
    return {
        "steps": int(stats.get("n_steps", stats.get("nsteps", 0))),
        "rejections": int(stats.get("n_reject", stats.get("netfails", 0))),
        "evaluations": int(stats.get("n_rhs", stats.get("nfevals", 0))),
        "jacobians": jacobians,
        "factorisations": jacobians,
    }


def _dense(system: System, inputs: Drivers, p: Array, grid: Array, y: Array) -> Dense:
    """Cubic interpolation of the rates' columns on the grid, linear of the algebraic ones."""
    if grid.size < 2:
        return Dense(grid, grid + 1e-300, y.T, y.T, np.zeros((1, 2, system.n)))
    d = np.vstack([np.tile(p[:, None], (1, grid.size)), inputs.values[:, inputs.interval(grid)]])
    f = ca.Function("f", [system.y, system.d], [system.f])
    slope = f.map(grid.size)(y, d).full()
    columns = system.algebraic[1]
    slope[columns] = np.gradient(y[columns], grid, axis=1) if columns else slope[columns]
    return hermite(grid, y, slope)
