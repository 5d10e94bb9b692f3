"""Velocity and acceleration of a record, points of constant velocity, linear least squares.

    force = m a + F_v v + F_c sign(v) + offset

Source: Janot, Gautier and Brunot, Data set and reference models of EMPS, 2019.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import ceil
from typing import final

import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.filters import (
    Decimation,
    Filter,
    Velocity,
    central_difference,
    choose_filter,
    lowpass,
)  # fmt: skip
from identification.data.record import Record, runs
from symfric.foundation import checks
from symfric.foundation.shown import brief

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

CERTAIN = 4.0
"""Standard deviations of the velocity's noise within which the velocity may be zero."""


@final
@dataclass(frozen=True, eq=False)
class MotionSignals:
    """A record differentiated without phase shift, its disturbed ends cut off.

    Attributes:
        name: of the record.
        t, x, v, a: time [s], filtered position [m], velocity [m/s], acceleration [m/s^2].
        force: measured force [N], as measured.
        filter: the filter used.
        slow: samples with an uncertain direction of motion.
    """

    name: str
    t: Array
    x: Array
    v: Array
    a: Array
    force: Array
    filter: Filter
    slow: Mask

    __repr__ = brief

    @cached_property
    def decimation(self) -> Decimation:
        """Low-pass filter and decimation from samples to equations."""
        return Decimation(self.t.size, self.filter.decimation)

    @cached_property
    def kept(self) -> NDArray[np.int64]:
        """Rows of the decimation without a slow sample in their window."""
        return np.flatnonzero(~self.decimation.touched(self.slow))

    def equations(self, signal: Array) -> Array:
        """Return `signal` decimated to the equations in use, shape (rows,)."""
        return self.decimation(signal)[self.kept]

    @property
    def times(self) -> Array:
        """Times of the equations [s]."""
        return self.decimation.centres(self.t)[self.kept]


def derivatives(
    x: Array | None, v: Array | None, step: float, filter: Filter, mixer: Velocity
) -> tuple[Array, Array, Array]:
    """Return filtered position, velocity and acceleration, each shape (n,).

    Central differences of the filtered position; the acceleration is its second difference over
    two steps, whose gain falls short of one by (w h)^2 / 12 only. A measured velocity is filtered
    and differentiated once. Of two, velocity and acceleration are combined by `mixer`.

    Args:
        x: position, samples; None: not measured (zeros are returned).
        v: measured velocity, or None.
        step: sample interval [s].
        filter: cut-off and order.
        mixer: `Velocity.of(x, v, step)`.
    """
    by_x: list[Array] = []
    by_v: list[Array] = []
    if x is not None:
        x = lowpass(x, filter.cutoff, step, filter.order)
        inner = (x[2:] - 2 * x[1:-1] + x[:-2]) / step**2
        by_x = [central_difference(x, step), np.pad(inner, 1, mode="edge")]
    if v is not None:
        v = lowpass(v, filter.cutoff, step, filter.order)
        by_v = [v, central_difference(v, step)]
    both = [*map(mixer.mixed, by_x, by_v)] if by_x and by_v else by_x or by_v
    return np.zeros_like(both[0]) if x is None else x, both[0], both[1]


def uncertain(v: Array, noise: float, step: float, filter: Filter) -> Mask:
    """Return a mask of samples with an undetermined force of a static law, shape (n,).

    These are samples where the velocity changes sign or is not distinguishable from rest (four
    standard deviations of its `noise`), and those that the low-pass filter mixes with them: half of
    1 / cutoff around. With `filter.v_min`, samples slower than it.
    """
    if filter.v_min is not None:
        return np.abs(v) < filter.v_min
    slow = np.abs(v) <= CERTAIN * noise
    turns = np.signbit(v[1:]) != np.signbit(v[:-1])
    slow[1:] |= turns
    slow[:-1] |= turns
    around = ceil(0.5 / (filter.cutoff * step))
    return np.convolve(slow, np.ones(2 * around + 1), mode="same") > 0.5


def differentiate(
    record: Record,
    filter: Filter | None = None,
    *,
    force: str = "force",
    x: str = "x",
    v: str | None = None,
) -> MotionSignals:
    """Return filtered position, velocity and acceleration of a record of a drive.

    Args:
        record: equally spaced samples.
        filter: cut-off and decimation; by `choose_filter` if none is given.
        force, x: names of the channels.
        v: channel of a measured velocity, combined with that of the position by `Velocity`;
            None: "v" if the record has it.

    Raises:
        ValueError: unequal intervals, a cut-off above the Nyquist frequency, too short a record.
    """
    step = record.uniform().step
    rate = v or ("v" if "v" in record else None)
    measured = record[x], None if rate is None else record[rate]
    mixer = Velocity.of(*measured, step)
    chosen = filter or choose_filter(record[force], step, [mixer.band(*measured, step)])
    motion = derivatives(*measured, step, chosen, mixer)
    slow = uncertain(motion[1], mixer.deviation(chosen, step), step, chosen)
    inside = chosen.inside(record.size, step)
    cut = (y[inside] for y in (record.time, *motion, record[force]))
    signals = MotionSignals(record.name, *cut, filter=chosen, slow=slow[inside])
    if signals.decimation.rows == 0 or signals.kept.size < 10:
        raise ValueError(
            f"data '{record.name}': expected enough samples for the filter ({chosen}), got "
            f"{record.size}; raise the cut-off, lower the decimation or v_min"
        )
    return signals


SMOOTHINGS = 2.0
"""Cut-off of the evaluated velocity, over 1 / (shortest plateau)."""
REST = 1e-3
"""Speed over the largest one below which an interval is rest and not a point of a curve."""


def plateaus(
    data: Dataset,
    *,
    force: str = "force",
    v: str | None = None,
    x: str = "x",
    shortest: float = 0.2,
    change: float = 0.05,
    settle: float = 0.2,
) -> Dataset:
    """Return means of velocity and force over intervals of constant velocity, for `Points`.

    Suitable records are a staircase of speeds or a triangle of positions. A plateau is an interval
    of at least `shortest` in which the smoothed velocity changes by less than the share `change`
    in that time. Its first part, of the share `settle`, is left out; rest is excluded. There the
    acceleration is zero, so the mean force is friction plus constant forces such as weight.

    Args:
        data: equally spaced records; each gives a record of points.
        force: channel of the driving force or torque.
        v: channel of the velocity; None: "v" if there is one, else the slope of `x`.
        x: channel of the position.
        shortest: duration [s].
        change: largest relative change of velocity.
        settle: share of a plateau, 0 <= settle < 1.

    Returns:
        Channels v, F, `n` (samples per mean, for `Points(weight="n")`) and `spread` (standard
        deviation of the force); mean times as `t_mean`.

    Raises:
        ValueError: no record has a plateau; unequal intervals; arguments out of range.
    """
    shortest = checks.number("plateaus: shortest", shortest, unit="s", above=0.0)
    change = checks.number("plateaus: change", change, above=0.0)
    settle = checks.number("plateaus: settle", settle, lower=0.0, upper=0.9)
    found: list[Record] = []
    for record in data:
        name = v or ("v" if "v" in record else x)
        step, F = record.uniform().step, record[force]
        velocity = record[name] if v or name != x else central_difference(record[x], step)
        smooth = lowpass(velocity, min(SMOOTHINGS / shortest, 0.45 / step), step)
        steady = np.abs(central_difference(smooth, step)) * shortest < change * np.abs(smooth)
        steady &= np.abs(smooth) > REST * np.abs(smooth).max()
        long = [(b, e) for b, e in runs(steady) if (e - b) * step >= shortest]
        cut = [slice(b + ceil(settle * (e - b)), e) for b, e in long]
        if len(cut) < 2:
            continue
        unit = record.unit(force) or "N"
        columns = {
            "v": ("rad/s" if record.unit(name).startswith("rad") else "m/s", velocity, np.mean),
            "F": (unit, F, np.mean),
            "n": ("1", F, np.size),
            "spread": (unit, F, np.std),
            "t_mean": ("s", record.time, np.mean),
        }
        signals = {n: np.array([of(y[s]) for s in cut], float) for n, (_, y, of) in columns.items()}
        units = {n: unit for n, (unit, *_) in columns.items()}
        found.append(Record(f"plateaus of {record.name}", None, signals, units))
    if not found:
        raise ValueError(
            f"data '{data.name}': plateaus: expected at least two stretches of {shortest:g} s with "
            f"a velocity constant to {change:.0%}, got none; lower shortest= or raise change="
        )
    return Dataset(tuple(found), f"plateaus of {data.name}")


RANK = 1e-7
"""Smallest singular value of the scaled regressors that counts, relative to the largest."""


@final
@dataclass(frozen=True, eq=False)
class LinearFit:
    """Estimates by name with standard errors, and the remaining force error.

    Attributes:
        values: m [kg], F_v [N s/m], F_c [N], offset [N]; with directions F_v_pos, F_v_neg, ...
        standard_errors: of the same names, for white residuals after decimation; None for values
            that are not identifiable.
        force_relative: norm of the force error over norm of the force [%].
        force_rms: root mean square force error [N].
    """

    values: dict[str, float]
    standard_errors: dict[str, float | None]
    force_relative: float
    force_rms: float


def linear_regression(
    signals: MotionSignals | Sequence[MotionSignals], directions: bool = False
) -> LinearFit:
    """Fit by least squares on the decimated equations of one record or of several.

    Args:
        signals: differentiated records.
        directions: separate F_v and F_c for the two directions, and no offset.

    A drive that moves in one direction only does not separate Coulomb friction from an offset: the
    minimum-norm values are returned, without standard errors.
    """
    records = [signals] if isinstance(signals, MotionSignals) else list(signals)
    parts = [_regressors(record, directions) for record in records]
    X = np.vstack([np.column_stack([*part.values()]) for part in parts])
    y = np.concatenate([record.equations(record.force) for record in records])
    values = np.linalg.lstsq(X, y, rcond=None)[0]
    error = y - X @ values
    names = list(parts[0])
    return LinearFit(
        dict(zip(names, values.tolist(), strict=True)),
        dict(zip(names, _standard_errors(X, error), strict=True)),
        100 * float(np.linalg.norm(error) / max(np.linalg.norm(y), 1e-300)),
        float(np.sqrt(np.mean(error**2))),
    )


def _regressors(signals: MotionSignals, directions: bool) -> dict[str, Array]:
    v, sign = signals.v, np.sign(signals.v)
    columns: dict[str, Array] = {"F_v": v, "F_c": sign, "offset": np.ones_like(v)}
    if directions:
        sides = {"pos": v > 0, "neg": v < 0}.items()
        columns = {f"F_{k}_{s}": y * on for s, on in sides for k, y in (("v", v), ("c", sign))}
    return {name: signals.equations(y) for name, y in {"m": signals.a, **columns}.items()}


def _standard_errors(X: Array, error: Array) -> list[float | None]:
    """Return standard errors; None for columns that are linear combinations of others."""
    size = np.linalg.norm(X, axis=0)
    scale = np.where(size > 0, size, 1.0)
    _, s, Vt = np.linalg.svd(X / scale, full_matrices=False)
    kept = s > RANK * max(s[0], 1e-300)
    undetermined = np.sqrt(np.sum(Vt[~kept] ** 2, axis=0)) > 1e-3
    spread = np.sqrt(np.sum((Vt[kept] / s[kept, None]) ** 2, axis=0)) / scale
    noise = np.sqrt(error @ error / max(1, error.size - X.shape[1]))
    return [None if u else float(noise * e) for u, e in zip(undetermined, spread, strict=True)]
