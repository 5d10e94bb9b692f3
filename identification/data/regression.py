"""Means at constant velocity, and linear regression of a drive.

    force = m a + F_v v + F_c sign(v) + offset

Source: Janot, Gautier and Brunot, Data set and reference models of EMPS, 2019.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from typing import final

import numpy as np

from identification.data.dataset import Dataset
from identification.data.differentiate import MotionSignals
from identification.data.filters import central_difference, lowpass
from identification.data.record import Array, Record, runs
from symfric.foundation import checks

SMOOTHINGS = 2.0
"""Cut-off frequency of the evaluated velocity, relative to 1 / (shortest plateau)."""
REST = 1e-3
"""Speed relative to the largest one below which an interval is rest and not a point of a curve."""


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

    Suitable records have a staircase of speeds or triangles of positions. A plateau is an interval
    of at least `shortest` in which the smoothed velocity changes by less than the share `change`
    per `shortest`. The initial share `settle` of a plateau is left out, and rest is excluded. On a
    plateau the acceleration is zero: the mean force is friction plus constant forces like weight.

    Args:
        data: equally spaced records; each one is converted to a record of points.
        force: channel of the driving force or torque.
        v: channel of the velocity; None: "v" if there is one, otherwise the derivative of `x`.
        x: channel of the position.
        shortest: shortest duration of a plateau [s].
        change: largest relative change of the velocity.
        settle: share of a plateau that is left out, 0 <= settle <= 0.9.

    Returns:
        Records with the channels v, F, `n` (samples per mean, for `Points(weight="n")`), `spread`
        (standard deviation of the force) and `t_mean` (mean time).

    Records with one plateau each are one record of points.

    Raises:
        ValueError: fewer than two plateaus, intervals are unequal, or an argument is out of
            range.
    """
    shortest = checks.number("plateaus: shortest", shortest, unit="s", above=0.0)
    change = checks.number("plateaus: change", change, above=0.0)
    settle = checks.number("plateaus: settle", settle, lower=0.0, upper=0.9)
    found, single = list[Record](), list[Record]()
    for record in data:
        name = v or ("v" if "v" in record else x)
        step, F = record.uniform().step, record[force]
        velocity = record[name] if v or name != x else central_difference(record[x], step)
        smooth = lowpass(velocity, min(SMOOTHINGS / shortest, 0.45 / step), step)
        steady = np.abs(central_difference(smooth, step)) * shortest < change * np.abs(smooth)
        steady &= np.abs(smooth) > REST * np.abs(smooth).max()
        long = [(b, e) for b, e in runs(steady) if (e - b) * step >= shortest]
        cut = [slice(b + ceil(settle * (e - b)), e) for b, e in long]
        if not cut:
            continue
        unit = record.unit(force) or "N"
        columns = {
            "v": ("rad/s" if record.unit(name).startswith("rad") else "m/s", velocity, np.mean),
            "F": (unit, F, np.mean),
            "n": ("1", F, np.size),
            "spread": (unit, F, np.std),
            "t_mean": ("s", record.time, np.mean),
        }
        twice = cut if len(cut) > 1 else cut * 2  # a record has at least two rows
        signals = {
            n: np.array([of(y[s]) for s in twice], float) for n, (_, y, of) in columns.items()
        }
        units = {n: unit for n, (unit, *_) in columns.items()}
        one = Record(f"plateaus of {record.name}", None, signals, units)
        (found if len(cut) > 1 else single).append(one)
    if len(single) > 1:  # one record for each speed
        signals = {n: np.array([one[n][0] for one in single]) for n in single[0].signals}
        found.append(Record(f"plateaus of {len(single)} records", None, signals, single[0].units))
    if not found:
        raise ValueError(
            f"data '{data.name}': plateaus: expected at least two stretches of {shortest:g} s with "
            f"a velocity constant to {change:.0%}, got none; lower shortest= or raise change="
        )
    return Dataset(tuple(found), f"plateaus of {data.name}")


RANK = 1e-7
"""Smallest singular value of the scaled regressors taken as nonzero, relative to the largest."""


@final
@dataclass(frozen=True, eq=False)
class LinearFit:
    """Estimated parameters with standard errors, and the remaining force error.

    Attributes:
        values: m [kg], F_v [N s/m], F_c [N], offset [N]; by direction: F_v_pos, F_v_neg, ...
        standard_errors: standard errors of the values for white residuals after decimation; None
            for values that are not identifiable.
        force_relative: norm of the force error relative to the norm of the force [%].
        force_rms: root mean square force error [N].
    """

    values: dict[str, float]
    standard_errors: dict[str, float | None]
    force_relative: float
    force_rms: float


def linear_regression(
    signals: MotionSignals | Sequence[MotionSignals], directions: bool = False
) -> LinearFit:
    """Fit mass, friction and offset by least squares to the decimated equations of all records.

    Args:
        signals: differentiated records.
        directions: estimate F_v and F_c separately for the two directions, without an offset.

    If the drive moves in one direction only, Coulomb friction and offset are not separable. Then
    the minimum-norm values are returned, without standard errors.
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
    """Return standard errors; None for columns that are linear combinations of other columns."""
    size = np.linalg.norm(X, axis=0)
    scale = np.where(size > 0, size, 1.0)
    _, s, Vt = np.linalg.svd(X / scale, full_matrices=False)
    kept = s > RANK * max(s[0], 1e-300)
    undetermined = np.sqrt(np.sum(Vt[~kept] ** 2, axis=0)) > 1e-3
    spread = np.sqrt(np.sum((Vt[kept] / s[kept, None]) ** 2, axis=0)) / scale
    noise = np.sqrt(error @ error / max(1, error.size - X.shape[1]))
    return [None if u else float(noise * e) for u, e in zip(undetermined, spread, strict=True)]
