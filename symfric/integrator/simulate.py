"""Simulate a model: one call for every backend."""

import warnings
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from symfric.integrator.casadi_backend import integrate
from symfric.integrator.inputs import Input
from symfric.integrator.trajectory import Trajectory
from symfric.model import Model, finite
from symfric.status import SolveError

LOOSE = 1e-5
"""Above this relative tolerance whole stick phases are lost without a sign of it."""


def simulate(
    model: Model,
    t_end: float,
    *,
    t_start: float = 0.0,
    x0: Mapping[str, float] | None = None,
    u: Mapping[str, Input] | None = None,
    p: Mapping[str, float] | None = None,
    rtol: float = 1e-6,
    atol: float | None = None,
    t_eval: ArrayLike | None = None,
    samples: int = 2001,
    backend: str = "auto",
    throw: bool = True,
) -> Trajectory:
    """Integrate `model` from `t_start` to `t_end` [s].

    Args:
        model: the equations.
        t_end: last time [s].
        t_start: first time [s].
        x0: start values of states by name; the others start where the model says.
        u: inputs by name: a number, `Hold` or `Linear` samples, or a function of symbolic time.
        p: values of the model's parameters by name.
        rtol: relative tolerance of each step.
        atol: absolute tolerance in multiples of each state's nominal value; default 0.1 rtol.
        t_eval: times of the result [s]; default `samples` equal intervals. They force no steps.
        samples: number of equally spaced times.
        backend: "rosenbrock" or "sundials", both CasADi's; "auto" takes rosenbrock for explicit
            models and sundials (idas) for implicit ones.
        throw: raise `SolveError` on failure; with False the partial trajectory is returned.

    Returns:
        The trajectory. Its dense output between the result times is cubic.

    Raises:
        ValueError: bad input.
        SolveError: the integration failed; its `partial` is the trajectory so far.

    Warns:
        UserWarning: rtol above 1e-5, where stick phases get lost.
    """
    t_start, t_end = finite("simulate: t_start", t_start), finite("simulate: t_end", t_end)
    if t_end <= t_start:
        raise ValueError(f"simulate: expected t_end > t_start = {t_start:g} s, got {t_end:g} s")
    if not 1e-13 <= rtol <= 0.1:
        raise ValueError(f"simulate: expected 1e-13 <= rtol <= 0.1, got {rtol:g}")
    if rtol > LOOSE:
        warnings.warn(
            f"simulate: rtol = {rtol:g} is above {LOOSE:g}; whole stick phases may be lost "
            "without a sign of it, compare with a tighter run",
            UserWarning,
            stacklevel=2,
        )
    if t_eval is None:
        times = np.linspace(t_start, t_end, samples)
    else:
        times = np.asarray(t_eval, dtype=float)
        inside = times.size and t_start <= times[0] and times[-1] <= t_end
        if times.ndim != 1 or not inside or not (np.diff(times) > 0).all():
            raise ValueError(
                f"simulate: t_eval: expected increasing times in [{t_start:g}, {t_end:g}] s, "
                f"got an array of shape {times.shape}"
            )
    trajectory = integrate(
        model,
        t_start,
        t_end,
        times,
        model.initial_state(x0, p),
        u,
        model.values("p", p),
        rtol,
        0.1 * rtol if atol is None else atol,
        backend,
    )
    if throw and not trajectory.status.ok:
        raise SolveError(trajectory.message, trajectory.status, trajectory)
    return trajectory
