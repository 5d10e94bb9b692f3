"""Friction samples for start values, and the stiffness after reversals."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import log
from typing import final

import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.differentiate import differentiated
from identification.residuals.points import Points
from identification.unknowns.roles import Natural
from symfric.foundation import checks

Array = NDArray[np.float64]

LEAST = 3
"""Smallest number of samples for an estimate."""
FEW = 0.01
"""Share of points whose speed may be arbitrarily small, such as noise about rest."""


@final
@dataclass(frozen=True, eq=False)
class Measured:
    """Samples of friction in SI units; for a rotary axis in rad/s, N m and rad.

    Attributes:
        v: sliding velocity [m/s], shape (n,).
        F: force that moves the body, or friction itself if no mass is moved [N], shape (n,).
        x: position [m], shape (n,); integrated from v and t if omitted.
        t: increasing times [s], shape (n,); None for points without time.
        a: acceleration [m/s^2], shape (n,), if F also moves a mass.
        N: normal force [N]; with 1 N the coefficients of a law are forces.
        breaks: first samples of the second and later records.

    Raises:
        ValueError: arrays of different shapes, numbers that are not finite, fewer than 3 samples,
            or times that do not increase.
    """

    v: Array
    F: Array
    x: Array | None = None
    t: Array | None = None
    a: Array | None = None
    N: float = 1.0
    breaks: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        for name in ("v", "F", "x", "t", "a"):
            if (given := getattr(self, name)) is not None:
                object.__setattr__(self, name, _samples(name, given, np.size(self.v)))
        checks.number("Measured: N", self.N, unit="N", above=0.0)
        for record in self.records:
            if self.t is not None and not (np.diff(self.t[record]) > 0).all():
                raise checks.refused("Measured: t", "increasing times", self.t)
        if self.x is None and self.t is not None:
            x = np.zeros(self.t.size)
            for record in self.records:
                t, v = self.t[record], self.v[record]
                x[record][1:] = np.cumsum(np.diff(t) * (v[1:] + v[:-1]) / 2)
            object.__setattr__(self, "x", x)

    @property
    def records(self) -> tuple[slice, ...]:
        """Slices of the samples of each record."""
        edges = (0, *self.breaks, np.size(self.v))
        return tuple(slice(a, b) for a, b in pairwise(edges))

    def at(self, rows: Sequence[NDArray[np.intp]], F: Array | None = None) -> "Measured":
        """Return the samples `rows` of each record, with other forces `F`, shape (n,), if given."""
        taken = np.concatenate(rows)
        x, t = (None if y is None else y[taken] for y in (self.x, self.t))
        breaks = tuple(np.cumsum([r.size for r in rows])[:-1].tolist())
        force = self.F if F is None else F
        return Measured(self.v[taken], force[taken], x=x, t=t, N=self.N, breaks=breaks)

    @property
    def fastest(self) -> float:
        """Largest speed [m/s]."""
        return float(np.abs(self.v).max())

    @property
    def slowest(self) -> float:
        """Speed [m/s] above which nearly all samples not at rest lie; 0 if all are at rest."""
        speeds = np.abs(self.v[self.v != 0])
        return float(np.quantile(speeds, FEW)) if speeds.size else 0.0

    def strongest(self, mass: float | None) -> float:
        """Return the largest force on the friction [N]: F at rest, F - m a in sliding."""
        moving = self.F if self.a is None or mass is None else self.F - mass * self.a
        return float(max(np.abs(self.F).max(), np.abs(moving).max()))

    @property
    def natural(self) -> Natural:
        """Natural units: root mean square of F, N, and travel in the time at the largest speed."""
        force, speed = float(np.sqrt(np.mean(self.F**2))) or 1.0, self.fastest or 1.0
        length = speed if self.x is None else float(np.ptp(self.x)) or speed
        return Natural(force, self.N, length, length / speed)

    def rescaled(self, units: Natural) -> "Measured":
        """Return the samples in natural units."""
        speed = units.length / units.time
        parts = {"v": speed, "F": units.force, "x": units.length, "t": units.time}
        parts["a"] = speed / units.time
        scaled = {n: None if (y := getattr(self, n)) is None else y / s for n, s in parts.items()}
        return Measured(**scaled, N=self.N / units.load, breaks=self.breaks)  # pyright: ignore[reportArgumentType]


def _samples(name: str, given: object, size: int) -> Array:
    """Return `given` as finite floats, shape (size,)."""
    found = np.asarray(given, dtype=float)
    if found.ndim != 1 or found.size != size or size < LEAST:
        what = f"at least {LEAST} samples in one dimension, as many as v"
        raise checks.refused(f"Measured: {name}", what, found)
    if not np.isfinite(found).all():
        place = int(np.flatnonzero(~np.isfinite(found))[0])
        raise ValueError(
            f"Measured: {name}: expected finite numbers, got {found[place]} at sample {place}; "
            "remove such rows"
        )
    return found


def measured(kind: object, data: Dataset, load: float) -> Measured | None:
    """Return velocity and force of all points or of a drive; None if unavailable.

    Blocks represent a long record of a drive.
    """
    try:
        if isinstance(kind, Points):
            timed = all(r.t is not None for r in data)
            names = {"v": kind.v, "F": kind.F} | ({"t": "t"} if timed else {})
            each = [{p: r[n] if n in r else kind.path(r).v for p, n in names.items()} for r in data]
        else:
            called, chosen = roles(kind), getattr(kind, "filter", None)
            motions = [m for r in data for m in differentiated(r, chosen, **called)]
            each = [{"v": m.v, "F": m.force, "x": m.x, "t": m.t, "a": m.a} for m in motions]
        signals = {part: np.concatenate([one[part] for one in each]) for part in each[0]}
        breaks = tuple(np.cumsum([one["v"].size for one in each])[:-1].tolist())
        return Measured(**signals, N=load, breaks=breaks)
    except ValueError:  # preparing the residuals reports missing channels
        return None


def roles(kind: object) -> dict[str, str]:
    """Return the names of the channels of position and force of a drive."""
    names = {name: getattr(kind, name, name) for name in ("x", "force")}
    return {name: given if isinstance(given, str) else name for name, given in names.items()}


DEAD = 2e-3
"""Backward displacement that counts as a reversal, relative to the travel."""
PART = 0.3
"""Least force at both ends of a branch, relative to the typical force."""


@final
@dataclass(frozen=True, eq=False)
class Branch:
    """Force as a function of path between two consecutive reversals.

    Attributes:
        first, last: samples at the beginning and the end of the branch.
        side: direction of motion, 1 or -1.
        level: magnitude of the force [N] before the reversal.
        half: path [m] from the reversal to zero force.
        slope: least-squares slope of the force over this path [N/m].
        damping: least-squares coefficient of the velocity, fitted together with it [N s/m], >= 0.
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
    """Pre-sliding stiffness and damping, medians over all `branches`.

    Attributes:
        branches: branches on which the force changes its sign.
        half: path [m] from a reversal to zero force.
        level: magnitude of the force [N] at the reversal.
        damping: coefficient of the velocity on this path [N s/m].
        scatter: median absolute deviation of `half`, relative to its median.
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

        After a reversal at z = -g/sigma_0, z = g/sigma_0 (1 - 2 exp(-sigma_0 x/g)); the slope of
        the force is 2 sigma_0 at the reversal and sigma_0 at zero force.
        """
        return self.level * log(2) / self.half


def turning_points(x: Array, dead: float) -> list[int]:
    """Return the samples at which a position turns back by more than `dead`, in order."""
    found = list[int]()
    side, extreme = 0, 0
    moving = np.flatnonzero(np.diff(x))  # local extremes and the end suffice
    turns = moving[:-1][np.diff(np.sign(x[moving + 1] - x[moving])) != 0] + 1
    for i in [*turns.tolist(), *(moving[-1:] + 1).tolist()]:
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
    """Return the path [m] since the last reversal at each sample; inf before the first reversal."""
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
    """Estimate stiffness and damping of pre-sliding from the branches after each reversal.

    Args:
        measured: samples with positions or times; the force excludes inertia.
        offset: constant force [N] in addition to friction.
        dead: backward displacement that counts as a reversal, relative to the travel.

    Returns:
        The estimates; None without a path, or without a reversal after which the force changes
        sign.
    """
    if measured.x is None:
        return None
    branches = tuple(
        b for r in measured.records
        for b in _branches(measured.x[r], measured.F[r] - offset, measured.v[r], dead, r.start)
    )  # fmt: skip
    if not branches:
        return None
    half, level, damping = (
        float(np.median([getattr(b, n) for b in branches])) for n in ("half", "level", "damping")
    )
    scatter = float(np.median([abs(b.half - half) for b in branches])) / half
    return Hysteresis(branches, half, level, damping, scatter)


def _branches(x: Array, F: Array, v: Array, dead: float, shift: int) -> Iterator[Branch]:
    typical = float(np.quantile(np.abs(F), 0.75))
    low, high = np.minimum(F[:-1], F[1:]), np.maximum(F[:-1], F[1:])
    middle = np.maximum(low[:-1], np.minimum(high[:-1], F[2:]))  # median of three, against spikes
    smooth = np.concatenate([F[:1], middle, F[-1:]])
    for first, last in pairwise([*turning_points(x, dead * float(np.ptp(x))), x.size - 1]):
        side = 1 if x[last] > x[first] else -1
        along, force = side * (x[first : last + 1] - x[first]), side * smooth[first : last + 1]
        level = -float(force[: max(2, force.size // 50)].mean())
        crossed = np.flatnonzero(force > 0)
        k = int(crossed[0]) if crossed.size else 0
        if min(level, force.max()) < PART * typical or k < 1 or along[k] <= 0:
            continue
        share = -force[k - 1] / (force[k] - force[k - 1])
        half = float(along[k - 1] + share * (along[k] - along[k - 1]))
        if half > 0:
            speed = side * v[first : first + k + 1]
            slopes = _slopes(along[: k + 1], speed, force[: k + 1])
            yield Branch(first + shift, last + shift, side, level, half, *slopes)


def _slopes(along: Array, speed: Array, force: Array) -> tuple[float, float]:
    """Return the slopes of the force over path and speed; 0 over speed if it is not usable."""
    one = np.ones(along.size)
    if along.size > 4 and np.ptp(speed) > 0:
        scale = np.array([1.0, along.max(), np.abs(speed).max()])
        X = np.column_stack([one, along, speed]) / scale
        w = np.linalg.lstsq(X, force, rcond=1e-9)[0] / scale
        if w[1] > 0 and w[2] >= 0:
            return float(w[1]), float(w[2])
    return float((force[-1] - force[0]) / along[-1]), 0.0
