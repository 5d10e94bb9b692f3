"""Simulate a model with an integrator of others, as a second opinion."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from time import perf_counter

from numpy.typing import ArrayLike

from symfric.foundation import checks
from symfric.foundation.status import SolveError
from symfric.integrator.arguments import (
    check_flags,
    check_model,
    check_span,
    chosen,
    result_times,
    tolerances,
)
from symfric.integrator.equations.initial import first_guess
from symfric.integrator.equations.inputs import Input, input_data
from symfric.integrator.outcome import trajectory_of
from symfric.integrator.peers.casadi_integrators import PEERS, integrate_by_peer
from symfric.integrator.running.built import built
from symfric.integrator.running.doubts import doubts
from symfric.model import Model
from symfric.results.statistics import Statistics
from symfric.results.trajectory import Trajectory


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

    For comparisons: the constraints of mechanisms drift under them, they pass through friction that
    jams without a sign of it, leap over friction peaks and pulses of inputs, and know no events.

    Args:
        model: the equations; the mass matrix must be diagonal.
        t_end: last time [s].
        peer: "sundials" is cvodes, or idas where there are algebraic variables; "rosenbrock" is
            CasADi's Rosenbrock 5(4); "ggl" is idas with the constraints of a mechanism on positions
            and velocities (`symfric.integrator.peers.ggl`).
        t_start, x0, u, p, rtol, atol, t_eval, samples, max_steps, throw: as in `simulate`.

    Returns:
        The trajectory. A failure keeps what came before it.

    Raises:
        ValueError: bad input; events; coupled rates; "ggl" for what is no mechanism.
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
    trajectory = trajectory_of(integrator, inputs, run, values, count)
    if throw and not trajectory.status.ok:
        raise SolveError(trajectory.message, trajectory.status, trajectory)
    return trajectory
