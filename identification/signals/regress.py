"""Linear least squares of mass, viscous and Coulomb friction and offset (IDIM-LS).

    force = m a + F_v v + F_c sign(v) + offset

Source: Janot, Gautier and Brunot, Data set and reference models of EMPS, 2019.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from identification.signals.differentiate import MotionSignals

Array = NDArray[np.float64]

RANK = 1e-7
"""Smallest singular value of the scaled regressors, over the largest, that counts."""


@final
@dataclass(frozen=True, eq=False)
class LinearFit:
    """Estimates by name with standard errors, and the force error they leave.

    Attributes:
        values: m [kg], F_v [N s/m], F_c [N], offset [N]; with directions F_v_pos, F_v_neg, ...
        standard_errors: of the same names, for residuals that are white after decimation; None
            where the data cannot tell the value.
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
    """Least squares on the decimated equations of one record or of several.

    Args:
        signals: differentiated records.
        directions: separate F_v and F_c for the two directions, and no offset.

    A drive that moves one way only cannot tell Coulomb friction from an offset: the smallest values
    that fit are returned, without standard errors.
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
    columns: dict[str, Array] = {"m": signals.a}
    if directions:
        for side, mask in (("pos", v > 0), ("neg", v < 0)):
            columns |= {f"F_v_{side}": v * mask, f"F_c_{side}": sign * mask}
    else:
        columns |= {"F_v": v, "F_c": sign, "offset": np.ones_like(v)}
    return {name: signals.equations(column) for name, column in columns.items()}


def _standard_errors(X: Array, error: Array) -> list[float | None]:
    """Of the columns that the others do not make up."""
    size = np.linalg.norm(X, axis=0)
    scale = np.where(size > 0, size, 1.0)
    _, s, Vt = np.linalg.svd(X / scale, full_matrices=False)
    kept = s > RANK * max(s[0], 1e-300)
    lost = np.sqrt(np.sum(Vt[~kept] ** 2, axis=0)) > 1e-3
    spread = np.sqrt(np.sum((Vt[kept] / s[kept, None]) ** 2, axis=0)) / scale
    noise = np.sqrt(error @ error / max(1, error.size - X.shape[1]))
    return [None if gone else float(noise * e) for gone, e in zip(lost, spread, strict=True)]
