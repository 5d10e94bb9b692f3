"""Simulate a model with CasADi's own implicit integrators, as an independent check.

The integrators are rosenbrock, and cvodes and idas of SUNDIALS.

Mechanisms are integrated in the form of index 1, whose constraints drift, or with idas in the
stabilised form of index 2 ("ggl"). No result is projected; the results contain the norms of the
constraints, which show the drift.

The stabilised form enforces the constraints on positions and velocities:

    q' = q_rate + phi_q' eta,   M a + phi_q' lam = Q,   phi(q) = 0,   phi_q q_rate = 0

The accelerations a, the multipliers lam and eta and the normal forces are algebraic unknowns; eta
is zero along the exact solution. The form of index 1 enforces only phi_q a + gamma = 0, so the
constraints drift.

Limits: the methods of this package require index 1 and do not apply to the stabilised form.
Source: Gear, Leimkuhler, Gupta, J. Comput. Appl. Math. 12-13, 1985.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from re import sub
from time import perf_counter
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symfric.foundation import checks
from symfric.foundation.numeric import Array
from symfric.foundation.status import SolveError, Status
from symfric.integrator.equations.initial import consistent, first_guess, first_step
from symfric.integrator.equations.inputs import Input, InputData, input_data
from symfric.integrator.equations.system import System
from symfric.integrator.methods.tableaux import chosen
from symfric.integrator.prepared import check_flags, check_span, result_times, tolerances
from symfric.integrator.running.doubts import doubts
from symfric.integrator.running.integrator import built
from symfric.integrator.running.record import Dense, Outputs, RunRecord, hermite
from symfric.integrator.running.run import Tolerances
from symfric.integrator.stored import trajectory_of
from symfric.model import Model, check_model
from symfric.results.stored import Statistics
from symfric.results.trajectory import Trajectory


def stabilised(system: System) -> System:
    """Return `system` with constraints on positions and velocities and multipliers eta, put last.

    Raises:
        ValueError: the system is not a mechanism.
    """
    manifold = system.manifold
    if manifold is None:
        raise ValueError(
            "simulate_by_peer: expected rosenbrock or sundials for a model that is not a "
            "mechanism, got ggl"
        )
    n, m = manifold.n, manifold.m
    eta = ca.SX.sym("eta", m)
    both = ca.densify(manifold.defect(system.y, system.d))
    phi, phi_dot = both[:m], both[m:]
    f = ca.SX(system.f)
    f[:n] += ca.jacobian(phi, system.y[:n]).T @ eta
    f[list(system.pivots[1])] = phi
    return replace(
        system,
        y=ca.vertcat(system.y, eta),
        f=ca.vertcat(f, phi_dot),
        mass=ca.diagcat(system.mass, ca.SX(m, m)),
        timed=False,
        names=(*system.names, *(f"{system.names[i]}_eta" for i in system.pivots[1])),
    )


PEERS = ("sundials", "rosenbrock", "ggl")
CHUNKS = 32
COUNTS = {
    "steps": ("n_steps", "nsteps"),
    "rejections": ("n_reject", "netfails"),
    "evaluations": ("n_rhs", "nfevals"),
    "jacobians": ("n_jac", "nlinsetups"),
    "factorisations": ("n_jac", "nlinsetups"),
}
"""Entry of the statistics -> its names in CasADi's integrators; the first available one is used."""
STEPS_PER_INTERVAL = 100_000
"""Step limit of SUNDIALS, which would otherwise spend minutes in front of a singularity."""
HINTS = {
    1: "look for a discontinuity or a NaN there, or loosen rtol",
    2: "its corrector seldom converges below rtol = 1e-8 in this form of index 2, loosen rtol; "
    "or look for a discontinuity there",
}
"""Index of the equations -> advice if CasADi's integrator stops."""


@final
@dataclass(frozen=True, eq=False)
class Peer:
    """System for `casadi.integrator`, with differential states scaled by their nominal values."""

    system: System
    inputs: InputData
    p: Array
    plugin: str
    dae: dict[str, ca.SX]
    options: dict[str, Any]
    index: int = 1

    def over(self, grid: Array, y: Array | None = None) -> tuple[ca.Function, Array]:
        """Return the integrator from grid[0] with results at grid[1:], and its input data.

        Args:
            grid: times [s].
            y: consistent unknowns at grid[0]; required for index 2.
        """
        first, options = self.inputs.interval((grid[:-1] + grid[1:]) / 2), dict(self.options)
        if self.plugin == "rosenbrock":
            first, counts = np.unique(first, return_counts=True)
            options["control_group_size"] = counts.tolist()
        data = self.inputs.values[:, first]
        if self.index == 2 and y is not None:
            # idas cannot compute rates of index 2, and its default first step is too long
            rates, nominal = rates_of(self.system)
            f = ca.Function("f", [self.system.y, self.system.d], [self.system.f])
            slope = f(y, np.concatenate([self.p, data[:, 0]])).full().ravel()[rates] / nominal
            options["init_xdot"] = slope.tolist()
            options["step0"] = first_step(float(grid[-1] - grid[0]))
        times = float(grid[0]), grid[1:].tolist()
        return ca.integrator("solver", self.plugin, self.dae, *times, options), data


def rates_of(system: System) -> tuple[list[int], Array]:
    """Return the rows of the differential states and their nominal values."""
    still = {*system.algebraic[1], *(system.manifold.basis if system.manifold else ())}
    rates = [i for i in range(system.n) if i not in still]
    nominal = np.ones(system.n)
    nominal[: system.nx] = system.nominal
    return rates, nominal[rates]


def peer(system: System, inputs: InputData, p: Array, tolerances: Tolerances, name: str) -> Peer:
    """Return the semi-explicit DAE of `system` for CasADi.

    Args:
        system, inputs, p, tolerances: equations and data of the run.
        name: "sundials" (cvodes, or idas if there are algebraic unknowns), "rosenbrock" or "ggl",
            which is idas applied to the stabilised form of index 2.

    Raises:
        ValueError: a mass matrix that is not diagonal, which CasADi does not accept, or "ggl" for
            a model that is not a mechanism.
    """
    if name == "ggl":
        system = stabilised(system)
    rows, columns = system.algebraic
    rates, nominal = rates_of(system)
    mass = ca.DM(system.mass)[rates, rates]
    if rows != columns or mass.nnz() != len(rates):
        raise ValueError(
            "simulate_by_peer: expected a diagonal mass matrix, got coupled rates; use simulate"
        )
    scale = ca.DM(nominal)
    scaled = ca.SX.sym("x", len(rates))
    f = ca.substitute(system.f, system.y[rates], scale * scaled)
    n_p = p.size
    plugin = "rosenbrock" if name == "rosenbrock" else ("idas" if columns else "cvodes")
    options: dict[str, Any] = {
        "reltol": tolerances.rtol,
        "abstol": float(np.min(tolerances.atol / system.nominal)),
        "max_num_steps": min(tolerances.max_steps, STEPS_PER_INTERVAL),
    }
    if plugin != "rosenbrock":
        # without this option, adjoints for several parameters are silently wrong (casadi#4383)
        options["quad_err_con"] = True
    if name == "ggl":
        # multipliers of index 2 have errors of order 1 / h, which smaller steps do not reduce
        options |= {"suppress_algebraic": True, "calc_ic": False}
    ode = f[rates] / (scale * ca.diag(mass))
    dae = {
        "x": scaled,
        "z": system.y[columns],
        "p": system.d[:n_p],
        "u": system.d[n_p:],
        "ode": ca.densify(ode),
        "alg": f[rows],
    }
    return Peer(system, inputs, p, plugin, dae, options, 2 if name == "ggl" else 1)


def integrate_by_peer(
    system: System,
    inputs: InputData,
    y0: Array,
    p: Array,
    times: Array,
    tolerances: Tolerances,
    name: str,
) -> tuple[RunRecord, dict[str, int]]:
    """Integrate with CasADi over `times`; after a failure, return the results before it."""
    problem = peer(system, inputs, p, tolerances, name)
    (rates, nominal), columns = rates_of(problem.system), problem.system.algebraic[1]
    y = consistent(system, "simulate_by_peer", y0, np.concatenate([p, inputs.values[:, 0]]))
    y = np.concatenate([y, np.zeros(problem.system.n - system.n)])
    grid = np.unique(np.concatenate([inputs.breaks, times]))
    outputs = Outputs.at(times, system.n)
    run = RunRecord(float(grid[0]), y[: system.n], outputs, engine=f"casadi {problem.plugin}")
    found, counts = y[:, None], dict.fromkeys(COUNTS, 0)
    pieces = [np.arange(1, grid.size)]
    while pieces:
        piece = pieces.pop(0)
        solver, data = problem.over(grid[[piece[0] - 1, *piece]], found[:, -1])
        try:
            result = solver(x0=found[rates, -1] / nominal, z0=found[columns, -1], p=p, u=data)
        except RuntimeError as error:
            if piece.size == grid.size - 1 > 1:
                # repeat in pieces to keep the results before the failure
                pieces = np.array_split(piece, min(CHUNKS, piece.size))
                continue
            last = [line for line in str(error).splitlines() if line.strip()][-1]
            last = sub(r"^.*\.cpp:\d+: |\. Consult .*$", "", last.strip())
            run.stop(
                Status.SOLVER_FAILED,
                f"simulate_by_peer: {problem.plugin} stopped after "
                f"t = {grid[piece[0] - 1]:g} s ({last}); {HINTS[problem.index]}",
            )
            break
        part = np.zeros((problem.system.n, piece.size))
        part[rates] = result["xf"].full() * nominal[:, None]
        part[columns] = result["zf"].full()
        found = np.hstack([found, part])
        stats = solver.stats()
        for name, keys in COUNTS.items():
            counts[name] += next((int(stats[key]) for key in keys if key in stats), 0)
    dense = _dense(system, inputs, p, grid[: found.shape[1]], found[: system.n])
    known = found[: system.n]
    run.ends = np.array([known.min(axis=1), known.max(axis=1)])
    run.keep(dense.rows)
    outputs.fill(dense, last=True)
    return run, counts


def _dense(system: System, inputs: InputData, p: Array, grid: Array, y: Array) -> Dense:
    """Return the cubic Hermite interpolation of the unknowns on the grid.

    Algebraic unknowns have no rates; their slopes are finite differences.
    """
    if grid.size < 2:
        return Dense(grid, np.nextafter(grid, np.inf), y.T, y.T, np.zeros((1, 2, system.n)))
    d = np.vstack([np.tile(p[:, None], (1, grid.size)), inputs.values[:, inputs.interval(grid)]])
    f = ca.Function("f", [system.y, system.d], [system.f])
    slope = f.map(grid.size)(y, d).full()
    columns = system.algebraic[1]
    slope[columns] = np.gradient(y[columns], grid, axis=1) if columns else slope[columns]
    return hermite(grid, y, slope)


def simulate_by_peer(
    model: Model,
    t_end: float,
    peer: str = "sundials",
    *,
    t_start: float = 0.0,
    x0: Mapping[str, float] | None = None,
    u: Mapping[str, Input] | None = None,
    p: Mapping[str, float] | None = None,
    rtol: float = 1e-6,
    atol: float | None = None,
    t_eval: ArrayLike | None = None,
    samples: int = 2001,
    max_steps: int = 10_000_000,
    throw: bool = True,
) -> Trajectory:
    """Integrate `model` as `simulate` does, with one of CasADi's own integrators.

    The function is intended for comparisons: the constraints of mechanisms drift, jamming friction
    is not detected, friction peaks and input pulses may be missed, and events are not supported.

    Args:
        model: the equations; the mass matrix must be diagonal.
        t_end: last time [s].
        peer: "sundials" is cvodes, or idas if there are algebraic variables; "rosenbrock" is
            CasADi's Rosenbrock 5(4); "ggl" is idas with the constraints of a mechanism on positions
            and velocities (`stabilised`).
        t_start, x0, u, p, rtol, atol, t_eval, samples, max_steps, throw: as in `simulate`.

    Returns:
        The trajectory; after a failure, the part before it.

    Raises:
        ValueError: bad input, a model with events or coupled rates, or "ggl" for a model that is
            not a mechanism.
        SolveError: the integration failed; its `partial` is the trajectory so far.
    """
    where = "simulate_by_peer"
    check_model(where, model)
    check_flags(where, throw=throw)
    t_start, t_end, rtol = check_span(where, model, t_start, t_end, rtol)
    checks.choice(f"{where}: peer", peer, PEERS)
    if model.events:
        raise ValueError(
            f"{where}: expected a model without events, got {len(model.events)} in "
            f"'{model.name}'; use simulate"
        )
    times = result_times(where, t_start, t_end, t_eval, samples)
    begin = perf_counter()
    inputs = input_data(model, u, t_start, t_end)
    integrator, fresh = built(model, inputs, chosen(where, "auto", rtol))
    built_at, system = perf_counter(), integrator.system
    allowed = tolerances(where, rtol, atol, system.nominal, 1e-10, max_steps)
    y0 = first_guess(system, model, model.initial_state(x0, p, t_start), t_start)
    values = model.values("p", p)
    run, counts = integrate_by_peer(system, inputs, y0, values, times, allowed, peer)
    run_time = perf_counter() - built_at

    def count() -> Statistics:
        return Statistics(
            backend=run.engine,
            method="Rosenbrock 5(4)" if peer == "rosenbrock" else "BDF",
            events=0,
            smallest_step=run.extent.shortest,
            build_time=built_at - begin if fresh else 0.0,
            compile_time=0.0,
            run_time=run_time,
            sensitivity_errors={},
            **counts,
        )

    for said in doubts(integrator, inputs, run, values):
        run.message += f" {said}"
        warnings.warn(type(said)(f"simulate_by_peer '{model.name}': {said}"), stacklevel=2)
    trajectory = trajectory_of(model, lambda: integrator, inputs, run, values, count)
    if throw and not trajectory.status.ok:
        raise SolveError(trajectory.message, trajectory.status, trajectory)
    return trajectory
