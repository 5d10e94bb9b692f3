"""What a run becomes: a trajectory that is evaluated when somebody asks for a signal."""

from collections.abc import Callable
from functools import partial

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.integrator.compiled.columns import Columns
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.record import Run
from symfric.integrator.stored import Later, Stored
from symfric.model.kinds import in_results
from symfric.results.statistics import Statistics
from symfric.results.trajectory import Trajectory

Array = NDArray[np.float64]


def trajectory_of(
    integrator: Integrator | Later,
    inputs: InputData,
    run: Run,
    p: Array,
    count: Callable[[], Statistics],
    backend: str = "vm",
) -> Trajectory:
    """The trajectory of a run.

    Args:
        integrator, inputs, p: what was run.
        run: what came of it; of the times of its outputs those that were reached.
        count: what it took.
        backend: what evaluates signals: "vm", else whatever is predicted to be fastest.

    Foreign integrators let the constraints of mechanisms drift, and their results show it; ours
    hold them to the tolerance between steps, and exactly at results.
    """
    model, outputs = integrator.model, run.outputs
    names, drifts = model.signals, run.engine.startswith("casadi")
    times, engine = outputs.times, "vm" if backend == "vm" else "auto"
    if outputs.found < times.size:
        times = times[: outputs.found]

    def unknowns(at: Array) -> Array:
        return outputs.reached.copy() if at is times else run.at(at)

    def states(at: Array) -> dict[str, Array]:
        y, columns = unknowns(at), None if drifts else integrator.states
        if columns is not None:
            y = columns([y.T, data(at)], backend=engine)[0].T
        return {v.name: in_results(v.kind, row) for v, row in zip(model.x, y, strict=False)}

    def data(at: Array) -> Array:
        return np.hstack([np.tile(p, (at.size, 1)), inputs.values[:, inputs.interval(at)].T])

    def rows(columns: Columns, at: Array) -> Array:
        (values,) = columns([at, unknowns(at).T, data(at)], backend=engine)
        return np.ascontiguousarray(values.T)

    def evaluate(at: Array) -> dict[str, Array]:
        columns = integrator.plain_signal_columns if drifts else integrator.signal_columns
        return dict(zip(names, rows(columns, at), strict=True))

    def express(expression: ca.SX, at: Array) -> Array:
        plain = partial(integrator.of_time, "signals")
        return rows(Columns((plain if drifts else integrator.refined)(expression)), at)

    return Trajectory(
        model.name,
        times,
        dict(names),
        run.status,
        run.message,
        count,
        (run.t, run.reached),
        lambda: np.append(run.dense.t0, run.dense.t1[-1]),
        states,
        evaluate,
        express,
        model,
        tuple(run.happened),
        keep=None
        if isinstance(integrator, Later)  # it is stored already
        else partial(Stored.of, integrator, inputs, run, p, backend),
    )
