"""What a run becomes: a trajectory that is evaluated when somebody asks for a signal."""

from functools import partial

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.integrator.compiled.columns import Columns
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.running.dense import Dense
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.run import Run
from symfric.results.trajectory import Statistics, Trajectory

Array = NDArray[np.float64]


def trajectory_of(
    integrator: Integrator,
    inputs: InputData,
    run: Run,
    dense: Dense,
    p: Array,
    times: Array,
    statistics: Statistics,
) -> Trajectory:
    """The trajectory of a run.

    Args:
        integrator, inputs, p: what was run.
        run, dense: what came of it.
        times: of the result [s]; those that were reached are kept.
        statistics: what it took.

    Foreign integrators let the constraints of mechanisms drift, and their results show it; ours
    hold them to the tolerance between steps, and exactly at results.
    """
    model = integrator.model
    names = list(model.signals)
    drifts = run.engine.startswith("casadi")
    signals = integrator.plain_signal_columns if drifts else integrator.signal_columns

    def states(at: Array) -> dict[str, Array]:
        y, columns = dense(at), None if drifts else integrator.states
        if columns is not None:
            y = columns([y.T, data(at)])[0].T
        return dict(zip(names, y[: len(model.x)], strict=False))

    def data(at: Array) -> Array:
        return np.hstack([np.tile(p, (at.size, 1)), inputs.values[:, inputs.interval(at)].T])

    def rows(columns: Columns, at: Array) -> Array:
        (values,) = columns([at, dense(at).T, data(at)])
        return np.ascontiguousarray(values.T)

    def evaluate(at: Array) -> dict[str, Array]:
        return dict(zip(names, rows(signals, at), strict=True))

    def express(expression: ca.SX, at: Array) -> Array:
        plain = partial(integrator.of_time, "signals")
        return rows(Columns((plain if drifts else integrator.refined)(expression)), at)

    first, last = dense.t0[0], dense.t1[-1]
    if times[0] < first or times[-1] > last:
        times = times[(times >= first) & (times <= last)]
    return Trajectory(
        model.name,
        times,
        dict(model.signals),
        run.status,
        run.message,
        statistics,
        np.append(dense.t0, dense.t1[-1]),
        states,
        evaluate,
        express,
        model,
        tuple(run.happened),
    )
