"""A rough model of any drive, used to check the plausibility of a record.

    force = m a + level sgn(v) + viscous v + stiffness x + offset

and sin x, cos x for a rotary drive, by robust linear regression on signals smoothed by a Gaussian
window, whose width depends on the noise of the position. Its signs and its explained variance
reveal wrong signs, exchanged columns, dead time and drift; its values are not estimates.
"""

from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import NDArray

from identification.data.findings import View, count_of

Array = NDArray[np.float64]

WIDTHS = (2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 35.0, 60.0, 100.0)
"""Standard deviations of the window, in samples."""
CLEAN = 0.1
"""Noise of the acceleration over the acceleration that is acceptable."""
TURNED = 0.3
"""Range of an angle [rad] above which gravity may be visible."""
KNOTS = np.array([0.0, 0.05, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9, 1.0])
"""Quantiles of the speed at which a free curve of friction has its knots."""
HUBER = 2.5
ROUNDS = 5
MOVING = 0.02
"""Share of the largest speed above which the drive moves."""


@final
class Rough:
    """The rough model of one record.

    Attributes:
        t, v, a, force: times [s] and smoothed signals of the rows.
        step: sample interval [s].
        columns: regressors of the values.
        clean: True if the acceleration exceeds its noise.
        values, errors: m, level, viscous, stiffness, offset (and coefficients of sin x, cos x),
            and their standard errors.
        explained: share of the variance of the force that the model explains, robust.
    """

    def __init__(
        self, t: Array, v: Array, a: Array, force: Array, columns: Array, width: float,
        step: float, clean: bool,
    ) -> None:  # fmt: skip
        self.t, self.v, self.a, self.force, self.columns = t, v, a, force, columns
        self.step, self.clean = step, clean
        self.every = max(1, int(2 * width))
        self.values, self.errors, self.explained = self.fit(columns, force)

    def fit(self, columns: Array, force: Array) -> tuple[Array, Array, float]:
        """Regress a force on columns; return values, standard errors and explained share."""
        A, b = columns[:: self.every], force[:: self.every]
        values, errors = _robust(A, b)
        return values, errors, _explained(A, b, values)

    def unexplained_when_late(self, late: float) -> float:
        """Return the unexplained share of the force if it were late by a time [s]."""
        return 1 - self.fit(self.columns, np.interp(self.t + late, self.t, self.force))[2]

    def with_column(self, column: Array) -> tuple[float, float]:
        """Return value and standard error of an additional column, shape (rows,)."""
        values, errors, _ = self.fit(np.column_stack([self.columns, column]), self.force)
        return float(values[-1]), float(errors[-1])

    @cached_property
    def residual(self) -> Array:
        """Force minus model."""
        return self.force - self.columns @ self.values

    @property
    def moving(self) -> NDArray[np.bool_]:
        """Mask of rows in which the drive moves."""
        return np.abs(self.v) > MOVING * np.abs(self.v).max()

    @property
    def spread(self) -> float:
        """Range of the middle half of the forces."""
        return float(np.ptp(np.quantile(self.force, (0.25, 0.75))))

    def sure(self, k: int) -> float:
        """Return a value over its standard error."""
        return float(self.values[k] / self.errors[k]) if self.errors[k] > 0 else 0.0

    def one_way(self, share: float = 0.1) -> bool:
        """Return True if the drive moves back by less than a share of its path."""
        path = [float(np.sum(np.maximum(side * self.v, 0.0))) for side in (1, -1)]
        return min(path) <= share * max(path)


def smoothed(y: Array, width: float, order: int = 0) -> Array:
    """Return a signal smoothed by a Gaussian window, or its central differences per sample."""
    from scipy.ndimage import gaussian_filter1d  # noqa: PLC0415  (slow to import)

    found = np.asarray(gaussian_filter1d(y, width, mode="nearest"), dtype=np.float64)
    for _ in range(order):  # SciPy's derivatives do not remove a constant exactly
        found = np.gradient(found)
    return found


def rough_model(view: View, *, exchanged: bool = False, curve: bool = False) -> Rough | None:
    """Return the rough model of a record; None without position and force, or if it is too short.

    Args:
        view: the record.
        exchanged: exchange force and position.
        curve: use any function of the velocity as friction, piecewise linear in each
            direction, instead of level and viscous part, and a drift with time as the last column.
    """
    record = view.steady
    if record is None or not {"x", "force"} <= view.roles.keys() or record.size < 50:
        return None
    position, push = (record[view.roles[r]] for r in ("x", "force")[:: -1 if exchanged else 1])
    if np.ptp(position) == 0 or np.ptp(push) == 0:
        return None
    step = record.step
    width, clean = _width(position)
    edge = int(3 * width)
    rows = slice(edge, record.size - edge)
    if record.size - 2 * edge < 30:
        return None
    xs = smoothed(position, width)
    v, a = smoothed(position, width, 1) / step, smoothed(position, width, 2) / step**2
    still = MOVING * float(np.abs(v[rows]).max())
    sign = smoothed(np.sign(v) * (np.abs(v) > still), width)
    columns = [a, sign, v, xs - xs.mean(), np.ones_like(v)]
    if view.unit("x") == "rad" and np.ptp(position) > TURNED:
        columns += [np.sin(xs), np.cos(xs)]
    if curve:
        columns[1:3] = _curve(v, still, rows)
        columns.append(np.linspace(-0.5, 0.5, v.size))
    A, b = np.column_stack(columns)[rows], smoothed(push, width)[rows]
    return Rough(record.time[rows], v[rows], a[rows], b, A, width, step, clean)


def _explained(A: Array, b: Array, values: Array) -> float:
    """Return the share of the variance of `b` that a regression explains; outliers count less."""

    def mean(squares: Array) -> float:
        return float(np.mean(np.minimum(squares, 25 * np.quantile(squares, 0.9))))

    whole = mean((b - np.median(b)) ** 2)
    return 1 - mean((b - A @ values) ** 2) / whole if whole > 0 else 0.0


def _curve(v: Array, still: float, rows: slice) -> list[Array]:
    """Return hat functions of the speed in each direction, with knots at its quantiles."""
    found: list[Array] = []
    for side in (1.0, -1.0):
        speed = np.maximum(side * v, 0.0)
        there = speed[rows][speed[rows] > still]
        if there.size >= KNOTS.size * 10:
            knots = np.concatenate([[0.0], np.unique(np.quantile(there, KNOTS))])
            found += [np.interp(speed, knots, hat) * (speed > 0) for hat in np.eye(knots.size)[1:]]
    return found or [np.sign(v), v]


def _width(x: Array) -> tuple[float, bool]:
    """Return the narrowest window that lets the acceleration exceed its noise; False if none."""
    noise = max(white_part(x), count_of(x) / np.sqrt(12))
    best = WIDTHS[0]
    for width in WIDTHS:
        if width > max(x.size / 40, WIDTHS[0]):
            break
        best = width
        of_noise = noise * np.sqrt(3 / (8 * np.sqrt(np.pi))) * width**-2.5
        if of_noise < CLEAN * float(np.std(smoothed(x, width, 2))):
            return width, True
    return best, False


def white_part(x: Array) -> float:
    """Return the standard deviation of the white part of a position."""
    return float(np.std(np.diff(x, 3))) / np.sqrt(20)


def _robust(A: Array, b: Array) -> tuple[Array, Array]:
    """Return values and standard errors of Huber's regression, by reweighting."""
    scale = np.linalg.norm(A, axis=0)
    scale[scale == 0] = 1.0
    B = A / scale
    weight = np.ones(b.size)
    values = np.zeros(A.shape[1])
    for _ in range(ROUNDS):
        root = np.sqrt(weight)
        values, *_ = np.linalg.lstsq(B * root[:, None], b * root, rcond=1e-10)
        residual = b - B @ values
        least = 1e-12 * float(np.abs(b).max()) + 1e-200
        sigma = max(1.4826 * float(np.median(np.abs(residual))), least)
        weight = 1 / np.maximum(1.0, np.abs(residual) / (HUBER * sigma))
    X = B * np.sqrt(weight)[:, None]
    inverse = np.linalg.pinv(X.T @ X, rcond=1e-10)
    rest = b - B @ values
    lag = float(np.corrcoef(rest[1:], rest[:-1])[0, 1]) if rest.size > 3 and rest.std() > 0 else 0.0
    lag = min(max(lag, 0.0), 0.98)
    variance = (1 + lag) / (1 - lag) * float(weight @ rest**2) / max(b.size - A.shape[1], 1)
    return values / scale, np.sqrt(np.maximum(variance * np.diag(inverse), 0.0)) / scale
