"""Windows of records simulated by the sampled engine, in the place of `simulate`.

For one mass under friction without states it is some hundred times faster than a simulation with
error control, and as right as the samples of the inputs are; see `stepper`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import NDArray

from identification.residuals.delays import RATE
from identification.residuals.open_loop import means, refined, stepped
from identification.residuals.stepper import Motion, why_not_sampled
from symfric.foundation.numeric import is_number
from symfric.model import Model

if TYPE_CHECKING:
    from identification.residuals.shots import Drives, Shot

Array = NDArray[np.float64]
SUBSTEPS = (1, 2, 4, 8, 16, 32)
"""Steps a sample to choose from."""
SHARE = 1e-5
"""Error over the spread of a signal that is taken where the engine is asked for: laws err more."""


@final
@dataclass(frozen=True, eq=False)
class SampledRun:
    """A motion of one window at the times that are compared."""

    signals: Mapping[str, Array]
    sensitivities: Mapping[str, Mapping[str, Array]]

    def __getitem__(self, name: str) -> Array:
        return self.signals[name]


def why_not(model: Model, signals: Sequence[str], inputs: Mapping[str, object]) -> str:
    """Why the windows of a model are not for the sampled engine; "" where they are."""
    why = why_not_sampled(model)
    states = [v.name for v in model.x]
    others = [name for name in signals if name not in states]
    if not why and others:
        why = f"expected signals among the states {', '.join(states)}, got {', '.join(others)}"
    odd = [n for n, given in inputs.items() if not isinstance(given, str) and not is_number(given)]
    if not why and odd:
        why = f"expected inputs that are channels or numbers, got another one for {', '.join(odd)}"
    return why


def sampled_run(
    model: Model, shot: "Shot", x0: Mapping[str, float], p: Array, tau: float, substeps: int
) -> SampledRun | str:
    """The motion of one window from `x0`, with all its derivatives; why there is none.

    Args:
        model: one mass; plain, perhaps with a dead time.
        shot: the window.
        x0: start values that are known.
        p: values of `model.p`.
        tau: dead time of the inputs [s].
        substeps: steps a sample.
    """
    drives = shot.drives
    first, last = np.searchsorted(drives.t, [shot.t[0], shot.end])
    t = drives.t[first : last + 1]
    names = [v.name for v in model.x]
    known = dict(zip([v.name for v in model.p], p.tolist(), strict=True))
    start = x0 if len(x0) == 2 else dict(zip(names, model.initial_state(x0, known), strict=True))
    begin = np.array([start[name] for name in names], dtype=float)
    instants = refined(t, substeps)
    columns = [_mean(v.name, drives, instants - tau) for v in model.u]
    between = np.array(columns).reshape(len(columns), instants.size - 1).T
    motion = stepped(model, instants, between, p, begin)
    look = np.searchsorted(t, shot.t) * substeps
    return motion if isinstance(motion, str) else _run(model, motion, look)


def _mean(name: str, drives: "Drives", at: Array) -> Array:
    if name in drives.sampled:
        return means(drives.t, drives.sampled[name], at, drives.held)
    if name in drives.others:
        return np.full(at.size - 1, float(drives.others[name]))  # type: ignore[arg-type]
    values = np.interp(at, drives.t, drives.sampled[name.removesuffix(RATE)])
    return np.diff(values) / np.diff(at)


def _run(model: Model, motion: Motion, look: NDArray[np.intp]) -> SampledRun:
    states = [v.name for v in model.x]
    unknowns = [*(v.name for v in model.p), *(f"x0.{name}" for name in states)]
    slopes = motion.slopes[look]
    return SampledRun(
        {name: motion.states[look, k] for k, name in enumerate(states)},
        {
            unknown: {name: slopes[:, k, i] for k, name in enumerate(states)}
            for i, unknown in enumerate(unknowns)
        },
    )


def choose_substeps(
    predicted: Callable[[int], Array | str], tolerable: Sequence[tuple[slice, float]]
) -> int | None:
    """Steps a sample that are enough; None: the most are not, or there is no motion.

    Args:
        predicted: steps a sample -> simulated values of all rows.
        tolerable: rows of a channel and the root mean square error that it may have.
    """
    coarse = predicted(SUBSTEPS[0])
    for substeps in SUBSTEPS:
        fine = predicted(2 * substeps)
        if isinstance(coarse, str) or isinstance(fine, str):
            return None
        error = fine - coarse
        if all(np.sqrt(np.mean(error[rows] ** 2)) <= most for rows, most in tolerable):
            return substeps
        coarse = fine
    return None
