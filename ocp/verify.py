"""What the model really does under an optimised control."""

from dataclasses import replace
from time import perf_counter

import numpy as np

from ocp.solution import Solution
from symfric.foundation.status import Status
from symfric.integrator import Hold, simulate

RTOL = 1e-9
"""Relative tolerance of the re-simulation."""


def verified(solution: Solution, tolerance: float) -> Solution:
    """`solution` with the motion of the model under its control, and by how much that misses."""
    problem, begin = solution.problem, perf_counter()
    trajectory = simulate(
        problem.model,
        solution.T,
        x0={name: float(values[0]) for name, values in solution.states.items()},
        u={name: Hold(solution.t_control, values) for name, values in solution.controls.items()},
        p=problem.p,
        rtol=RTOL,
        throw=False,
    )
    statistics = replace(solution.statistics, verify_time=perf_counter() - begin)
    checked = replace(solution, trajectory=trajectory, terminal_miss={}, statistics=statistics)
    if not trajectory.status.ok:
        return replace(
            checked,
            status=trajectory.status,
            message=f"{solution.message} But its control could not be re-simulated: "
            f"{trajectory.message}",
        )
    states = solution.states
    miss = {name: float(trajectory[name][-1] - x[-1]) for name, x in states.items()}
    checked = replace(checked, terminal_miss=miss)
    size = {v.name: max(v.nominal, np.abs(states[v.name]).max()) for v in problem.model.x}
    far = [name for name in miss if not abs(miss[name]) <= tolerance * size[name]]
    if not far:
        return checked
    units = solution.units
    by = ", ".join(f"{name} by {miss[name]:.3g} {units[name]}" for name in far)
    return replace(
        checked,
        status=Status.TERMINAL_MISS,
        message=f"ocp '{problem.model.name}': {Status.TERMINAL_MISS.value} It misses {by}.",
    )
