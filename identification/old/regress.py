"""Linear least squares of mass, viscous and Coulomb friction and offset (IDIM-LS).

    force = m a + F_v v + F_c sign(v) + offset

Source: Janot, Gautier and Brunot, Data set and reference models of EMPS, 2019.
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from identification.old.data import Array
from identification.old.precision import precision
from identification.old.signals import MotionSignals


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


def linear_regression(signals: MotionSignals, directions: bool = False) -> LinearFit:
    """Least squares on the decimated equations.

    Args:
        signals: differentiated record.
        directions: separate F_v and F_c for the two directions, and no offset.

    A drive that moves one way only cannot tell Coulomb friction from an offset: the smallest values
    that fit are returned, without standard errors.
    """
    v, a = signals.v, signals.a
    sign = np.sign(v)
    columns: dict[str, Array] = {"m": a}
    if directions:
        for side, mask in (("pos", v > 0), ("neg", v < 0)):
            columns |= {f"F_v_{side}": v * mask, f"F_c_{side}": sign * mask}
    else:
        columns |= {"F_v": v, "F_c": sign, "offset": np.ones_like(v)}
    X = np.column_stack([signals.equations(column) for column in columns.values()])
    y = signals.equations(signals.force)
    values = np.linalg.lstsq(X, y, rcond=None)[0]
    error = y - X @ values
    spread = precision(X, error, np.zeros(len(columns), dtype=bool)).standard_errors
    return LinearFit(
        dict(zip(columns, values.tolist(), strict=True)),
        {n: float(e) if np.isfinite(e) else None for n, e in zip(columns, spread, strict=True)},
        100 * float(np.linalg.norm(error) / np.linalg.norm(y)),
        float(np.sqrt(np.mean(error**2))),
    )
