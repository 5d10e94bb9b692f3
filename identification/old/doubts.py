"""What makes a record or a fit implausible, as sentences.

A least-squares fit ends at a minimum whatever it is given. These are mistakes that happen when
records are taken and that leave a trace in them: a force that the amplifier could not give, single
samples far off, force and position of opposite sign, columns that have nothing to do with each
other. Nothing is repaired.

Limits: a force that is clipped for less than `CLIPPED` of the time, drift, dead time and noise in
the loop leave no trace that is looked for here.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import final

import numpy as np

from identification.old.data import Array, Dataset
from identification.old.errors import Errors
from identification.old.regress import LinearFit
from identification.old.result import Estimate
from symfric.foundation.status import Status

CLIPPED, RUN = 0.01, 10
"""Share of the samples at one and the same extreme value, in runs of so many, that is clipping."""
FAR = 10.0
"""Distance of a sample from its neighbours, over the usual range or step, that is a spike."""
MOVING = 0.02
"""Share of the largest speed that is motion."""
UNEXPLAINED = 70.0
"""Force error [%] from which on the law says next to nothing."""


@final
@dataclass(frozen=True, eq=False)
class Verdict:
    """How a fit ended in view of what it found.

    Attributes:
        status: of the solver, or that the result cannot be meant.
        message: the status and everything else there is to say.
        record: what is doubtful about the record itself.
    """

    status: Status
    message: str
    record: tuple[str, ...]


def of_record(data: Dataset) -> Iterator[str]:
    """What in a record is no measurement of a moving drive."""
    for side, top in (("largest", data.force.max()), ("smallest", data.force.min())):
        share = _held(data.force == top)
        if share >= CLIPPED:
            yield (
                f"The force stays at its {side} value {top:g} N in {share:.0%} of the samples: the "
                "amplifier or the sensor was at its limit there."
            )
    usual = np.ptp(np.quantile(data.force, (0.01, 0.99)))
    jumps = np.abs(data.force - _median_of_five(data.force))
    far = np.flatnonzero(jumps > FAR * usual / 2)
    if far.size:
        k = int(far[np.argmax(jumps[far])])
        yield (
            f"The force is far off its neighbours in {far.size} samples, most in sample {k} with "
            f"{data.force[k]:g} N: take them out."
        )
    steps = np.abs(np.diff(data.x))
    moved = steps[steps > 0]  # of an encoder the smallest one is its count
    far = np.flatnonzero(steps > FAR * max(float(np.quantile(steps, 0.99)), float(moved.min())))
    if far.size:
        k = int(far[np.argmax(steps[far])])
        yield (
            f"The position jumps {far.size} times, at most by {steps[k]:g} m after sample {k}: a "
            "sensor that was lost, stood still or started again."
        )


def of_motion(v: Array) -> Iterator[str]:
    """What in the velocity [m/s] keeps friction from being told."""
    ways = [float((side * v > MOVING * np.abs(v).max()).mean()) for side in (-1, 1)]
    if min(ways) < CLIPPED:
        yield "The drive moves one way only: friction cannot be told from a constant force."


def verdict(
    status: Status,
    data: Dataset,
    v: Array,
    linear: LinearFit,
    estimates: Mapping[str, Estimate],
    errors: Errors,
) -> Verdict:
    """The end of a fit: a mass of nothing and a force not explained are no results."""
    mass, record = estimates["m"], (*of_record(data), *of_motion(v))
    against = list[str]()
    if not mass.fixed and mass.note == "at its bound":
        hint = (
            f"the force accelerates against the motion ({linear.values['m']:.3g} kg by "
            "regression), so the sign of force or position is wrong"
            if linear.values["m"] < 0
            else "the force has nothing to do with the acceleration"
        )
        against.append(f"The mass is at its bound, {mass.value:.3g} kg: {hint}.")
    if errors.force_relative > UNEXPLAINED:
        against.append(
            f"The law leaves {errors.force_relative:.0f} % of the force unexplained: another law, "
            "another column or another unit is needed."
        )
    bounds = [n for n, e in estimates.items() if n != "m" and e.note == "at its bound"]
    notes = [f"At its bound: {', '.join(bounds)}."] if bounds else []
    ended = Status.IMPLAUSIBLE if status.ok and against else status
    return Verdict(ended, " ".join([ended.value, *against, *notes, *record]), record)


def _held(at: Array) -> float:
    """Share of the samples that lie in long runs of true ones."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], at.astype(int), [0]])))
    lengths = edges[1::2] - edges[::2]
    return float(lengths[lengths >= RUN].sum()) / at.size


def _median_of_five(signal: Array) -> Array:
    """The running median, which single samples and pairs do not move."""
    padded = np.pad(signal, 2, mode="edge")
    return np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1)
