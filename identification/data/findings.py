"""Findings of the checks of data, the checked view of a record, and its rough model.

    force = m a + level sgn(v) + viscous v + stiffness x + offset

For a rotary drive, sin x and cos x are added. The model is a robust linear regression on signals
smoothed by a Gaussian window, whose width depends on the noise of the position. Its signs and its
explained variance reveal wrong signs, exchanged columns, delay and drift; it is not an estimate.
"""

import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, partialmethod
from pathlib import Path
from typing import Any, Literal, final

import numpy as np
from numpy.typing import NDArray

from identification.data.filters import gaussian, white_part
from identification.data.record import Array, Record, count_of, even_blocks, first_of, joined
from symfric.foundation import checks

Severity = Literal["error", "warning"]
ROLES = ("x", "v", "a", "force")


@final
@dataclass(frozen=True)
class Finding:
    """A warning or error in the data.

    Attributes:
        kind: one word, such as "clipping".
        record: index of the record in the data.
        signal: affected signal; "" for the record as a whole.
        sentence: description, location and remedy.
        begin, end: first and last time [s]; for points, their indices.
        severity: "error" if no fit of these data is physically meaningful, otherwise "warning".
    """

    kind: str
    record: int
    signal: str
    sentence: str
    begin: float
    end: float
    severity: Severity

    def to_dict(self) -> dict[str, Any]:
        """Return the fields by name, ready for JSON."""
        return dict(self.__dict__)


@final
@dataclass(frozen=True)
class Findings:
    """Findings of a data set, errors first.

    Attributes:
        items: the findings.
        name: name of the data.
        records: names of the records.
    """

    items: tuple[Finding, ...]
    name: str = "data"
    records: tuple[str, ...] = ()

    def __iter__(self) -> Iterator[Finding]:
        return iter(self.items)

    def __len__(self) -> int:
        return len(self.items)

    def __getitem__(self, index: int) -> Finding:
        return self.items[index]

    @property
    def errors(self) -> tuple[Finding, ...]:
        """Findings that make a physically meaningful fit impossible."""
        return tuple(f for f in self.items if f.severity == "error")

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """Findings that do not prevent a fit."""
        return tuple(f for f in self.items if f.severity == "warning")

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of the findings, without repetition."""
        return tuple(dict.fromkeys(f.kind for f in self.items))

    def __str__(self) -> str:
        if not self.items:
            return f"{self.name}: no problems found"
        return "\n".join([f"{self.name}:", *(f"  {text}" for text in texts(self, self.records))])


def grouped(
    items: Iterable[Finding], records: Sequence[str]
) -> Iterator[tuple[tuple[str, ...], Finding]]:
    """Yield the names of all records with the same finding, and that finding."""
    alike = dict[tuple[str, str, str], list[Finding]]()
    for f in items:
        alike.setdefault((f.severity, f.signal, f.sentence), []).append(f)
    for some in alike.values():
        yield tuple(dict.fromkeys(records[f.record] for f in some)), some[0]


def texts(items: Iterable[Finding], records: Sequence[str]) -> Iterator[str]:
    """Yield severity, records and sentence of each finding, once for records that share it."""
    for names, f in grouped(items, records):
        where = f"{first_of(names)}: " if len(records) > 1 else ""
        yield f"{f.severity}: {where}{f.sentence}"


@cache
def sentences() -> dict[str, str]:
    """Return the sentences of findings by kind or case."""
    return tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))


@final
@dataclass(frozen=True, eq=False)
class View:
    """A record to be checked.

    Attributes:
        record: the record.
        number: index of the record in the data.
        roles: part in the drive ("x", "v", "a", "force") -> name of its signal.
    """

    record: Record
    number: int
    roles: Mapping[str, str]

    @classmethod
    def of(cls, record: Record, number: int, roles: Mapping[str, str]) -> "View":
        """Return the view of a record; `roles` maps parts to signals with other names."""
        named = checks.named("check", roles, ROLES)
        given = {role: name for role, name in named.items() if role != name or name in record}
        found = {role: role for role in ROLES if role in record.signals}
        return cls(record, number, found | {r: record.channel(n) for r, n in given.items()})

    def signal(self, role: str) -> Array | None:
        """Return the signal of a part; None if it is missing."""
        return self.record.signals[self.roles[role]] if role in self.roles else None

    def known(self) -> Iterator[tuple[str, Array, str]]:
        """Yield name, values and unit of long, varying signals that have a part or a unit.

        Signals without part and unit may be predictions of a model.
        """
        for name, y in self.record.signals.items():
            unit = self.record.units[name]
            if (unit or name in self.roles.values()) and y.size >= 50 and np.ptp(y) != 0:
                yield name, y, unit

    def name(self, role: str) -> str:
        """Return the name of the signal of a part."""
        return self.roles.get(role, role)

    def unit(self, role: str) -> str:
        """Return the unit of the signal of a part."""
        return self.record.units[self.name(role)]

    @cached_property
    def steady(self) -> tuple[Record, ...]:
        """Even blocks of the record."""
        return even_blocks(self.record)

    def finding(
        self, serious: bool, kind: str, signal: str, case: str = "",
        begin: int | None = None, end: int | None = None, /, **values: object,
    ) -> Finding:  # fmt: skip
        """Return a finding at the samples `begin` to `end`; by default for the whole record.

        Args:
            serious: True for an error.
            kind, signal: see `Finding`.
            case: key of the sentence in `findings.toml`, if it differs from `kind`.
            begin, end: first and last sample.
            values: values of the fields in the sentence.
        """
        last = self.record.size - 1 if begin is None else begin
        samples = (begin or 0, last if end is None else end)
        names = {"signal": signal, "x": self.name("x"), "force": self.name("force")}
        values |= {"unit": self.record.units.get(signal, ""), "at": self.at(samples[0])}
        sentence = sentences()[case or kind].format(**names, **values)
        start, stop = samples if self.record.t is None else self.record.t[[*samples]]
        severity = "error" if serious else "warning"
        return Finding(kind, self.number, signal, sentence, float(start), float(stop), severity)

    error = partialmethod(finding, True)
    warning = partialmethod(finding, False)

    def at(self, sample: int) -> str:
        """Return the location of a sample as text, with time and row."""
        t = self.record.t
        place = self.record.place(sample)
        return place if t is None else f"t = {t[sample]:.6g} s ({place})"


WIDTHS = (2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 35.0, 60.0, 100.0)
"""Standard deviations of the smoothing window, in samples."""
CLEAN = 0.1
"""Largest acceptable ratio of the noise of the acceleration to the acceleration."""
TURNED = 0.3
"""Range of an angle [rad] above which gravity may be visible."""
KNOTS = np.array([0.0, 0.05, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9, 1.0])
"""Quantiles of the speed at the knots of a free friction curve."""
HUBER = 2.5
ROUNDS = 5
ENOUGH = 10_000
"""Number of rows of a regression, which are evenly spaced."""
MOVING = 0.02
"""Share of the largest speed above which the drive is moving."""


@final
class Rough:
    """Rough model of one record.

    Attributes:
        t, v, a, force: times [s] and smoothed signals of the rows.
        width, step: standard deviation of the smoothing window [samples], sample interval [s].
        blocks: number of blocks of equal length that contain the rows.
        columns: regressors of the values.
        clean: True if the acceleration exceeds its noise.
        values, errors: m, level, viscous, stiffness, offset (and coefficients of sin x, cos x),
            and their standard errors.
        root: roots of the weights of every `every`-th row in the regression.
        explained: share of the variance of the force explained by the model, robust to outliers.
    """

    def __init__(
        self, t: Array, v: Array, a: Array, force: Array, columns: Array, width: float,
        step: float, clean: bool, blocks: int,
    ) -> None:  # fmt: skip
        self.t, self.v, self.a, self.force, self.columns = t, v, a, force, columns
        self.width, self.step, self.clean, self.blocks = width, step, clean, blocks
        self.every = max(1, int(2 * width), force.size // ENOUGH)
        A, b = columns[:: self.every], force[:: self.every]
        self.values, self.errors, self.root = robust(A, b)
        self.explained = _explained(A, b, self.values)

    def unexplained_when_late(self, late: float) -> float:
        """Return the unexplained share of the force after correcting a delay of `late` [s].

        The rows keep their weights.
        """
        A = self.columns[:: self.every]
        b = np.interp(self.t[:: self.every] + late, self.t, self.force)
        return 1 - _explained(A, b, self.inverse @ (self.root * b))

    @cached_property
    def inverse(self) -> Array:
        """Pseudo-inverse of the weighted columns."""
        weighted: Array = self.columns[:: self.every] * self.root[:, None]
        return np.asarray(np.linalg.pinv(weighted, rcond=1e-10), np.float64)

    def with_column(self, column: Array) -> tuple[float, float]:
        """Return value and standard error of an additional regressor, shape (rows,)."""
        A = np.column_stack([self.columns[:: self.every], column[:: self.every]])
        values, errors, _ = robust(A, self.force[:: self.every])
        return float(values[-1]), float(errors[-1])

    @cached_property
    def residual(self) -> Array:
        """Difference of the force and its prediction by the model."""
        return self.force - self.columns @ self.values

    @property
    def moving(self) -> NDArray[np.bool_]:
        """Mask of the rows in which the drive moves."""
        return np.abs(self.v) > MOVING * np.abs(self.v).max()

    @property
    def spread(self) -> float:
        """Range of the middle half of the forces."""
        return float(np.ptp(np.quantile(self.force, (0.25, 0.75))))

    def sure(self, k: int) -> float:
        """Return the ratio of value k to its standard error."""
        return float(self.values[k] / self.errors[k]) if self.errors[k] > 0 else 0.0

    def one_way(self, share: float = 0.1) -> bool:
        """Return True if motion in one direction is at most `share` of that in the other."""
        path = [float(np.sum(np.maximum(side * self.v, 0.0))) for side in (1, -1)]
        return min(path) <= share * max(path)


def rough_model(view: View, *, exchanged: bool = False, curve: bool = False) -> Rough | None:
    """Return the rough model of a record; None without position and force, or if it is too short.

    Args:
        view: record to model.
        exchanged: exchange force and position.
        curve: replace level and viscous part by any friction curve that is piecewise linear in
            each direction, and add a drift in time as the last column.
    """
    steady = view.steady
    if not {"x", "force"} <= view.roles.keys() or not steady or steady[0].size < 50:
        return None
    both = ("x", "force")[:: -1 if exchanged else 1]
    position, push = (joined(steady, view.roles[r]) for r in both)
    if np.ptp(position) == 0 or np.ptp(push) == 0:
        return None
    step, size = steady[0].step, steady[0].size
    width, clean = _width(position)
    edge = int(3 * width)
    rows = (slice(None), slice(edge, size - edge))
    if size - 2 * edge < 30:
        return None
    xs = gaussian(position, width)
    v, a = gaussian(position, width, 1) / step, gaussian(position, width, 2) / step**2
    still = MOVING * float(np.abs(v[rows]).max())
    sign = gaussian(np.sign(v) * (np.abs(v) > still), width)
    columns = [a, sign, v, xs - xs.mean(), np.ones_like(v)]
    if view.unit("x") == "rad" and np.ptp(position) > TURNED:
        columns += [np.sin(xs), np.cos(xs)]
    if curve:
        columns[1:3] = _curve(v, still, rows)
        columns.append(np.linspace(-0.5, 0.5, v.size).reshape(v.shape))
    t, v, a, b, *columns = (
        y[rows].ravel() for y in (joined(steady, "t"), v, a, gaussian(push, width), *columns)
    )
    return Rough(t, v, a, b, np.column_stack(columns), width, step, clean, len(steady))


def _explained(A: Array, b: Array, values: Array) -> float:
    """Return the share of the variance of `b` explained by a regression, robust to outliers."""

    def mean(squares: Array) -> float:
        return float(np.mean(np.minimum(squares, 25 * np.quantile(squares, 0.9))))

    whole = mean((b - np.median(b)) ** 2)
    return 1 - mean((b - A @ values) ** 2) / whole if whole > 0 else 0.0


def _curve(v: Array, still: float, rows: tuple[slice, slice]) -> list[Array]:
    """Return hat functions of the speed in each direction, with knots at quantiles of the speed.

    Quantiles are those of the entries `rows` of v, shape (blocks, n).
    """
    found: list[Array] = []
    for side in (1.0, -1.0):
        speed = np.maximum(side * v, 0.0)
        there = speed[rows][speed[rows] > still]
        if there.size >= KNOTS.size * 10:
            knots = np.concatenate([[0.0], np.unique(np.quantile(there, KNOTS))])
            found += [np.interp(speed, knots, hat) * (speed > 0) for hat in np.eye(knots.size)[1:]]
    return found or [np.sign(v), v]


def _width(x: Array) -> tuple[float, bool]:
    """Return the narrowest sufficient window, and whether the acceleration exceeds its noise."""
    noise = max(white_part(x), count_of(x.ravel()) / np.sqrt(12))
    best = WIDTHS[0]
    for width in WIDTHS:
        if width > max(x.shape[1] / 40, WIDTHS[0]):
            break
        best = width
        of_noise = noise * np.sqrt(3 / (8 * np.sqrt(np.pi))) * width**-2.5
        if of_noise < CLEAN * float(np.std(gaussian(x, width, 2))):
            return width, True
    return best, False


def robust(A: Array, b: Array) -> tuple[Array, Array, Array]:
    """Return values, standard errors and roots of the weights of Huber's regression.

    It is computed by iterative reweighting.
    """
    scale = np.linalg.norm(A, axis=0)
    scale[scale == 0] = 1.0
    B = A / scale
    weight = np.ones(b.size)
    values = np.zeros(A.shape[1])
    for _ in range(ROUNDS):
        root = np.sqrt(weight)
        R = np.asarray(np.linalg.qr(np.column_stack([B, b]) * root[:, None], mode="r"))
        values, *_ = np.linalg.lstsq(R[:, :-1], R[:, -1], rcond=1e-10)  # SVD of few rows
        residual = b - B @ values
        least = 1e-12 * float(np.abs(b).max()) + 1e-200
        sigma = max(1.4826 * float(np.median(np.abs(residual))), least)
        weight = 1 / np.maximum(1.0, np.abs(residual) / (HUBER * sigma))
    root = np.sqrt(weight)
    X = B * root[:, None]
    inverse = np.linalg.pinv(X.T @ X, rcond=1e-10)
    rest = b - B @ values
    lag = float(np.corrcoef(rest[1:], rest[:-1])[0, 1]) if rest.size > 3 and rest.std() > 0 else 0.0
    lag = min(max(lag, 0.0), 0.98)
    variance = (1 + lag) / (1 - lag) * float(weight @ rest**2) / max(b.size - A.shape[1], 1)
    return values / scale, np.sqrt(np.maximum(variance * np.diag(inverse), 0.0)) / scale, root
