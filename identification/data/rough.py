"""A rough model of any drive, used to check the plausibility of a record.

    force = m a + level sgn(v) + viscous v + stiffness x + offset

and sin x, cos x for a rotary drive, by robust linear regression on signals smoothed by a Gaussian
window, whose width depends on the noise of the position. Its signs and its explained variance
reveal wrong signs, exchanged columns, dead time and drift; its values are not estimates.
"""

from dataclasses import dataclass
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
@dataclass(frozen=True, eq=False)
class Rough:
    """The rough model of one record.

    Attributes:
        t: times of the rows [s].
        x, v, a, force: smoothed by the window.
        width: of the window, in samples.
        step: sample interval [s].
        values, errors: m, level, viscous, stiffness, offset (and coefficients of sin x, cos x),
            and their standard errors.
        columns: regressors of the values.
        explained: share of the variance of the force that the model explains, robust.
        residual: force minus model.
        independent: number of independent rows.
        clean: whether the acceleration exceeds its noise.
    """

    t: Array
    x: Array
    v: Array
    a: Array
    force: Array
    width: float
    step: float
    values: Array
    errors: Array
    columns: Array
    explained: float
    residual: Array
    independent: float
    clean: bool

    @property
    def moving(self) -> NDArray[np.bool_]:
        """Mask of rows in which the drive moves."""
        return np.abs(self.v) > MOVING * np.abs(self.v).max()

    def sure(self, k: int) -> float:
        """Return a value over its standard error."""
        return float(self.values[k] / self.errors[k]) if self.errors[k] > 0 else 0.0


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
    record, x, force = view.steady, view.roles.get("x"), view.roles.get("force")
    if record is None or x is None or force is None or record.size < 50:
        return None
    position, push = record[x], record[force]
    if exchanged:
        position, push = push, position
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
    if record.units[x] == "rad" and np.ptp(position) > TURNED:
        columns += [np.sin(xs), np.cos(xs)]
    if curve:
        columns[1:3] = _curve(v, still, rows)
        columns.append(np.linspace(-0.5, 0.5, v.size))
    A, b = np.column_stack(columns)[rows], smoothed(push, width)[rows]
    every = max(1, int(2 * width))
    values, errors = _robust(A[::every], b[::every])
    explained = _explained(A[::every], b[::every], values)
    return Rough(
        t=record.time[rows],
        x=xs[rows],
        v=v[rows],
        a=a[rows],
        force=b,
        width=width,
        step=step,
        values=values,
        errors=errors,
        columns=A,
        explained=explained,
        residual=b - A @ values,
        independent=b.size / every,
        clean=clean,
    )


def explained_when_late(model: Rough, late: float) -> float:
    """Return the explained share of the force if it were late by a time [s]."""
    every = max(1, int(2 * model.width))
    A = model.columns[::every]
    b = np.interp(model.t[::every] + late, model.t, model.force)
    values, _ = _robust(A, b)
    return _explained(A, b, values)


def with_column(model: Rough, column: Array) -> tuple[float, float]:
    """Return value and standard error of an additional column, shape (rows,)."""
    every = max(1, int(2 * model.width))
    A = np.column_stack([model.columns, column])[::every]
    values, errors = _robust(A, model.force[::every])
    return float(values[-1]), float(errors[-1])


def one_way(model: Rough, share: float = 0.1) -> bool:
    """Return True if the drive moves back by less than a share of its path."""
    path = [float(np.sum(np.maximum(side * model.v, 0.0))) for side in (1, -1)]
    return min(path) <= share * max(path)


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
        if there.size < KNOTS.size * 10:
            continue
        knots = np.unique(np.quantile(there, KNOTS))
        rest = np.concatenate([[0.0], knots])
        hats = np.eye(rest.size)[1:]
        found += [np.interp(speed, rest, hat) * (speed > 0) for hat in hats]
    return found or [np.sign(v), v]


def _width(x: Array) -> tuple[float, bool]:
    """Return the narrowest window that lets the acceleration exceed its noise; False if none."""
    third = np.diff(x, 3)
    noise = max(float(np.std(third)) / np.sqrt(20), count_of(x) / np.sqrt(12))
    widest = x.size / 40
    best = WIDTHS[0]
    for width in WIDTHS:
        if width > max(widest, WIDTHS[0]):
            break
        best = width
        of_noise = noise * np.sqrt(3 / (8 * np.sqrt(np.pi))) * width**-2.5
        if of_noise < CLEAN * float(np.std(smoothed(x, width, 2))):
            return width, True
    return best, False


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
    root = np.sqrt(weight)
    inverse = np.linalg.pinv((B * root[:, None]).T @ (B * root[:, None]), rcond=1e-10)
    rest = b - B @ values
    lag = float(np.corrcoef(rest[1:], rest[:-1])[0, 1]) if rest.size > 3 and rest.std() > 0 else 0.0
    inflation = (1 + min(max(lag, 0.0), 0.98)) / (1 - min(max(lag, 0.0), 0.98))
    variance = inflation * float(weight @ rest**2) / max(b.size - A.shape[1], 1)
    return values / scale, np.sqrt(np.maximum(variance * np.diag(inverse), 0.0)) / scale
