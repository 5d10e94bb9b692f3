"""Linear least squares of mass, viscous and Coulomb friction and offset (IDIM-LS).

    force = m a + F_v v + F_c sign(v) + offset

Source: Janot, Gautier and Brunot, Data set and reference models of EMPS, 2019.
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from identification.data import Array
from identification.signals import Signals


@final
@dataclass(frozen=True, eq=False)
class LinearFit:
    """Estimates by name with standard errors, and the force error they leave.

    Attributes:
        values: m [kg], F_v [N s/m], F_c [N], offset [N]; with directions F_v_pos, F_v_neg, ...
        standard_errors: of the same names; they assume residuals that are white after decimation.
        force_relative: norm of the force error over norm of the force [%].
        force_rms: root mean square force error [N].
    """

    values: dict[str, float]
    standard_errors: dict[str, float]
    force_relative: float
    force_rms: float


def linear_regression(signals: Signals, directions: bool = False) -> LinearFit:
    """Least squares on the decimated equations.

    Args:
        signals: differentiated record.
        directions: separate F_v and F_c for the two directions, and no offset.

    Raises:
        ValueError: columns that depend on each other, as when the drive moves one way only.
    """
    v, a = signals.v, signals.a
    sign = np.sign(v)
    columns: dict[str, Array] = {"m": a}
    if directions:
        for side, mask in (("pos", v > 0), ("neg", v < 0)):
            columns |= {f"F_v_{side}": v * mask, f"F_c_{side}": sign * mask}
    else:
        columns |= {"F_v": v, "F_c": sign, "offset": np.ones_like(v)}
    X = np.column_stack([signals.decimation(column) for column in columns.values()])
    y = signals.decimation(signals.force)
    scale = np.linalg.norm(X, axis=0)
    rank = np.linalg.matrix_rank(X / np.where(scale > 0, scale, 1.0), tol=1e-8)
    if rank < X.shape[1]:
        raise ValueError(
            f"data '{signals.name}': expected independent motion in both directions, got rank "
            f"{rank} for {', '.join(columns)}; the drive must accelerate and move both ways"
        )
    values = np.linalg.lstsq(X, y, rcond=None)[0]
    error = y - X @ values
    spread = error.std(ddof=X.shape[1]) * np.sqrt(np.diag(np.linalg.inv(X.T @ X)))
    return LinearFit(
        dict(zip(columns, values.tolist(), strict=True)),
        dict(zip(columns, spread.tolist(), strict=True)),
        100 * float(np.linalg.norm(error) / np.linalg.norm(y)),
        float(np.sqrt(np.mean(error**2))),
    )
