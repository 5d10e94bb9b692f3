"""Members of an ensemble one by one, for models with events."""

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.status import Status
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.many.chunk import Solved
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.run import Tolerances, integrate

Array = NDArray[np.float64]


def solve_one_by_one(
    integrator: Integrator,
    inputs: InputData,
    tolerances: Tolerances,
    backend: str,
    times: Array,
    starts: tuple[Array, Array],
) -> Solved:
    """Integrate members as `simulate` does; signals are NaN after a terminal event.

    Args:
        integrator, inputs, tolerances, backend, times: common to all members.
        starts: start values of the unknowns (members, n) and parameters (members, n_p).

    Raises:
        KeyboardInterrupt: Ctrl-C; the members of the chunk are lost.
    """
    y0, p = starts
    count, names = y0.shape[0], integrator.signals.numel_out(0)
    signals, reached = np.full((count, times.size, names), np.nan), np.zeros(count)
    attempts, failed = np.zeros(count, dtype=np.int64), dict[int, str]()
    for m in range(count):
        try:
            run = integrate(integrator, inputs, y0[m], p[m], tolerances, backend, None, times)
        except ValueError as error:  # no consistent start
            failed[m], reached[m] = str(error), inputs.breaks[0]
            continue
        if run.status is Status.INTERRUPTED:
            raise KeyboardInterrupt
        if not run.status.ok:
            failed[m] = run.message
        attempts[m], reached[m] = run.attempts, run.reached
        y = run.outputs.reached
        at = times[: y.shape[1]]
        d = np.hstack([np.tile(p[m], (at.size, 1)), inputs.values[:, inputs.interval(at)].T])
        (signals[m, : at.size],) = integrator.signal_columns([at, y.T, d])
    return Solved(signals, attempts, reached, failed)
