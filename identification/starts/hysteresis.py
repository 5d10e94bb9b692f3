"""Pre-sliding stiffness from reversals: how far the body goes until its friction has turned."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import log
from typing import final

import numpy as np
from numpy.typing import NDArray

from identification.starts.measured import Measured

Array = NDArray[np.float64]

DEAD = 2e-3
"""Share of the travel by which the position must come back to count as a reversal."""
PART = 0.3
"""Share of the typical force that a branch must start from, and reach on the other side."""


@final
@dataclass(frozen=True, eq=False)
class Branch:
    """Force against path after one reversal, up to the next one.

    Attributes:
        first, last: samples of the reversal and of the branch's end.
        side: direction of motion, 1 or -1.
        level: force [N] before the reversal, positive.
        half: path [m] from the reversal until the force is zero.
        slope: least-squares slope of the force over this path [N/m].
        damping: least-squares coefficient of velocity beside it [N s/m], >= 0.
    """

    first: int
    last: int
    side: int
    level: float
    half: float
    slope: float
    damping: float


@final
@dataclass(frozen=True, eq=False)
class Hysteresis:
    """What all branches say together: medians over `branches`.

    Attributes:
        branches: those on which the force changes its sign.
        half: path [m] from a reversal until the force is zero.
        level: force [N] from which it falls.
        damping: coefficient of velocity on this path [N s/m].
        scatter: median absolute deviation of `half` over its median.
    """

    branches: tuple[Branch, ...]
    half: float
    level: float
    damping: float
    scatter: float

    @property
    def elastic(self) -> float:
        """Stiffness level/half [N/m] of elements that unload elastically (Maxwell, Bouc-Wen)."""
        return self.level / self.half

    @property
    def bristle(self) -> float:
        """Stiffness level ln(2)/half [N/m] of a bristle (LuGre, Dahl).

        From z = -g/sigma_0 it comes back as z = g/sigma_0 (1 - 2 exp(-sigma_0 x/g)), so that its
        slope is 2 sigma_0 at the reversal and sigma_0 where the force is zero.
        """
        return self.level * log(2) / self.half


def turning_points(x: Array, dead: float) -> list[int]:
    """Samples at which a position turns back by more than `dead`, in order."""
    found = list[int]()
    side, extreme = 0, 0
    for i in range(1, x.size):
        moved = x[i] - x[extreme]
        if side * moved >= 0 and moved:
            if side == 0 and abs(moved) <= dead:
                continue
            side = side or int(np.sign(moved))
            extreme = i
        elif abs(moved) > dead:
            found.append(extreme)
            side, extreme = -side, i
    return found


def travelled(measured: Measured) -> Array:
    """Path [m] since the last reversal at each sample; inf before the first one."""
    found = np.full(measured.v.size, np.inf)
    if measured.x is None:
        return found
    for record in measured.records:
        x, path = measured.x[record], found[record]
        ends = turning_points(x, DEAD * float(np.ptp(x)))
        for first, last in pairwise([*ends, x.size]):
            path[first:last] = np.abs(x[first:last] - x[first])
    return found


def hysteresis(measured: Measured, *, offset: float = 0.0, dead: float = DEAD) -> Hysteresis | None:
    """Stiffness and damping of pre-sliding from the branches after each reversal.

    Args:
        measured: with positions or times; the force without what accelerates a mass.
        offset: constant force [N] beside friction.
        dead: share of the travel by which the position must come back to count as a reversal.

    Returns:
        None where there is no path, or no reversal after which the force changes sign.
    """
    if measured.x is None:
        return None
    branches = list[Branch]()
    for record in measured.records:
        x, F, v = measured.x[record], measured.F[record] - offset, measured.v[record]
        typical = float(np.quantile(np.abs(F), 0.75))
        ends = turning_points(x, dead * float(np.ptp(x)))
        shift = record.start
        branches += _branches(x, F, v, [*ends, x.size - 1], typical, shift)
    if not branches:
        return None
    halves = np.array([b.half for b in branches])
    half = float(np.median(halves))
    return Hysteresis(
        tuple(branches),
        half,
        float(np.median([b.level for b in branches])),
        float(np.median([b.damping for b in branches])),
        float(np.median(np.abs(halves - half))) / half,
    )


def _branches(
    x: Array, F: Array, v: Array, ends: list[int], typical: float, shift: int
) -> Iterator[Branch]:
    smooth = _median_of_three(F)
    for first, last in pairwise(ends):
        side = 1 if x[last] > x[first] else -1
        along, force = side * (x[first : last + 1] - x[first]), side * smooth[first : last + 1]
        level = -float(force[: max(2, force.size // 50)].mean())
        crossed = np.flatnonzero(force > 0)
        if level < PART * typical or not crossed.size or force.max() < PART * typical:
            continue
        k = int(crossed[0])
        if k < 1 or along[k] <= 0:
            continue
        share = -force[k - 1] / (force[k] - force[k - 1])
        half = float(along[k - 1] + share * (along[k] - along[k - 1]))
        if half <= 0:
            continue
        speed = side * v[first : first + k + 1]
        slope, damping = _slopes(along[: k + 1], speed, force[: k + 1])
        yield Branch(
            first=first + shift,
            last=last + shift,
            side=side,
            level=level,
            half=half,
            slope=slope,
            damping=damping,
        )


def _median_of_three(F: Array) -> Array:
    """Against single spikes."""
    inner = np.median([F[:-2], F[1:-1], F[2:]], axis=0)
    return np.concatenate([F[:1], inner, F[-1:]])


def _slopes(along: Array, speed: Array, force: Array) -> tuple[float, float]:
    """Slopes of the force over path and speed; over the path alone where the speed says nothing."""
    one = np.ones(along.size)
    if along.size > 4 and np.ptp(speed) > 0:
        scale = np.array([1.0, along.max(), np.abs(speed).max()])
        X = np.column_stack([one, along, speed]) / scale
        w = np.linalg.lstsq(X, force, rcond=1e-9)[0] / scale
        if w[1] > 0 and w[2] >= 0:
            return float(w[1]), float(w[2])
    return float((force[-1] - force[0]) / along[-1]), 0.0
