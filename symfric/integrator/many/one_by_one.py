"""Members of an ensemble one by one, for models with events."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation import packed
from symfric.foundation.status import Status
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.many.chunk import Solved
from symfric.integrator.many.given import input_of
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.running.built import built
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.run import Tolerances, integrate
from symfric.model import Model

Array = NDArray[np.float64]
Points = Sequence[tuple[Array, Array]]


@final
@dataclass(frozen=True, eq=False)
class Recipe:
    """How another process builds the integrator of an ensemble; `packed.dumps` takes it.

    Attributes:
        model, inputs: what is integrated.
        method: a key of `METHODS`.
        points: see `suited`.
        tolerances, backend, times: see `solve_one_by_one`.
    """

    model: Model
    inputs: InputData
    method: str
    points: tuple[tuple[Array, Array], ...]
    tolerances: Tolerances
    backend: str
    times: Array

    def integrator(self) -> Integrator:
        """Build the integrator, with the pivots that the calling process has."""
        plain, _ = built(self.model, self.inputs, METHODS[self.method])
        return suited(plain, self.points, self.inputs)


def suited(integrator: Integrator, points: Points, inputs: InputData) -> Integrator:
    """Return the integrator with pivots that are sound where members start, at (y, d) each."""
    begin, end = inputs.span
    known = list[tuple[Array, Array]]()
    for y, d in points:
        with suppress(ValueError):  # no consistent start: that member is reported by its number
            known.append((integrator.start(y, d), d))
            integrator = integrator.suited(known, end - begin)
    return integrator


@lru_cache(4)
def _followed(recipe: bytes) -> tuple[Recipe, Integrator]:
    """The recipe and its integrator; built once in a process."""
    loaded: Recipe = packed.loads(recipe)
    return loaded, loaded.integrator()


def solve_elsewhere(recipe: bytes, given: tuple[Array, Array, Array, Array]) -> Solved:
    """Integrate members as `solve_one_by_one`, from the pack of a `Recipe` alone."""
    known, integrator = _followed(recipe)
    return solve_one_by_one(
        integrator, known.inputs, known.tolerances, known.backend, known.times, given
    )


def solve_one_by_one(
    integrator: Integrator,
    inputs: InputData,
    tolerances: Tolerances,
    backend: str,
    times: Array,
    given: tuple[Array, Array, Array, Array],
) -> Solved:
    """Integrate members as `simulate` does; signals are NaN after a terminal event.

    Args:
        integrator, inputs, tolerances, backend: common to all members, but for their input data.
        times: of the results [s]; none for the end of each member alone.
        given: start values of the unknowns (members, n), parameters (members, n_p), input data
            (members or 1, n_data, intervals) and ends (members,).

    Raises:
        KeyboardInterrupt: Ctrl-C; the members of the chunk are lost.
    """
    y0, p, data, ends = (np.ascontiguousarray(numbers) for numbers in given)
    count, names = y0.shape[0], integrator.signals.numel_out(0)
    signals = np.full((count, max(1, times.size), names), np.nan)
    attempts, reached = np.zeros(count, dtype=np.int64), np.zeros(count)
    failed, reach = dict[int, str](), np.full((count, 2, len(integrator.model.x)), np.nan)
    for m in range(count):
        own = input_of(inputs, data[m if data.shape[0] > 1 else 0], ends[m])
        looks = times[times <= ends[m]] if times.size else ends[m : m + 1]
        try:
            run = integrate(integrator, own, y0[m], p[m], tolerances, backend, None, looks)
        except ValueError as error:  # no consistent start
            failed[m], reached[m] = str(error), inputs.breaks[0]
            continue
        if run.status is Status.INTERRUPTED:
            raise KeyboardInterrupt
        if not run.status.ok:
            failed[m] = run.message
        attempts[m], reached[m] = run.attempts, run.reached
        reach[m] = run.reach[:, : reach.shape[2]]
        y = run.outputs.reached
        at = looks[: y.shape[1]]
        d = np.hstack([np.tile(p[m], (at.size, 1)), own.values[:, own.interval(at)].T])
        (signals[m, : at.size],) = integrator.signal_columns([at, y.T, d])
    return Solved(signals, attempts, reached, failed, reach)
