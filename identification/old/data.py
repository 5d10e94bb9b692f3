"""A measured record of a drive, checked when it is made."""

import csv
from dataclasses import dataclass, replace
from pathlib import Path
from typing import final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from identification.old.filters import Filter
from identification.old.loop import PositionLoop
from symfric.foundation import checks
from symfric.foundation.files import written

Array = NDArray[np.float64]

MINIMUM = 50
"""Fewest samples a record may have."""
JITTER = 0.01
"""Largest deviation of a sample interval from the mean one, relative, that counts as uniform."""

UNITS = {"t": "s", "x": "m", "v": "m/s", "force": "N"}
"""The signals of a record and their units."""


@final
@dataclass(frozen=True, eq=False)
class Dataset:
    """Force and position of a drive over time.

    Attributes:
        name: where it comes from; every message starts with it.
        t: increasing sample times [s], shape (n,).
        x: measured position [m], shape (n,).
        force: measured or commanded driving force [N], shape (n,).
        v: measured velocity [m/s], shape (n,), or None: it is then taken from the position.
        loop: the position controller of the experiment, where it is known.
        filter: the filter this record is best used with; None lets the data choose.
        benchmark: name of the public benchmark this is, or "".
        first_row: row of the first sample in its file, for messages; 0 counts samples instead.

    Raises:
        ValueError: unequal lengths, NaN, times that do not increase, too few samples, a position
            or force that never changes; all problems at once, each with its place.
    """

    name: str
    t: Array
    x: Array
    force: Array
    v: Array | None = None
    loop: PositionLoop | None = None
    filter: Filter | None = None
    benchmark: str = ""
    first_row: int = 0

    def __post_init__(self) -> None:
        for key, values in self.signals().items():
            what = f"a column of numbers [{UNITS[key]}]"
            column = checks.array(
                f"data '{self.name}': {key}", values, ndim=None, what=what, nan=True
            )
            object.__setattr__(self, key, column)
        problems = self._shape_problems() or self._value_problems()
        if problems:
            raise ValueError(f"data '{self.name}': " + "; ".join(problems))

    def signals(self) -> dict[str, Array]:
        """The signals there are, by name."""
        found = {"t": self.t, "x": self.x, "force": self.force}
        return found if self.v is None else {**found, "v": self.v}

    def _shape_problems(self) -> list[str]:
        sizes = {key: values.shape for key, values in self.signals().items()}
        if any(len(shape) != 1 for shape in sizes.values()) or len(set(sizes.values())) > 1:
            found = ", ".join(f"{key}: {shape}" for key, shape in sizes.items())
            return [f"expected columns of one length, got {found}"]
        if self.t.size < MINIMUM:
            return [f"expected at least {MINIMUM} samples, got {self.t.size}"]
        return []

    def _value_problems(self) -> list[str]:
        problems: list[str] = []
        for key, values in self.signals().items():
            bad = np.flatnonzero(~np.isfinite(values))
            if bad.size:
                problems.append(
                    f"column {key}, {self._place(bad[0])}: expected a finite number, "
                    f"got {values[bad[0]]} ({bad.size} such cells)"
                )
        back = np.flatnonzero(np.diff(self.t) <= 0)
        if back.size and not problems:
            k = int(back[0])
            problems.append(
                f"column t, {self._place(k + 1)}: expected increasing times, "
                f"got {self.t[k + 1]:g} s after {self.t[k]:g} s"
            )
        for key in ("x", "force"):
            values = self.signals()[key]
            if not problems and np.ptp(values) == 0:
                problems.append(
                    f"column {key}: expected a signal that changes, got {values[0]:g} {UNITS[key]} "
                    "throughout; nothing can be identified from it"
                )
        return problems

    def _place(self, sample: int) -> str:
        return f"row {sample + self.first_row}" if self.first_row else f"sample {sample}"

    @property
    def step(self) -> float:
        """Mean sample interval [s]."""
        return float(self.t[-1] - self.t[0]) / (self.t.size - 1)

    def uniform(self) -> "Dataset":
        """The record itself, if its samples are equally spaced to 1 % of the interval.

        Raises:
            ValueError: they are not. Filters and differences need equal intervals, and whether
                interpolated samples may stand for measured ones is the user's decision.
        """
        intervals = np.diff(self.t)
        k = int(np.argmax(np.abs(intervals - self.step)))
        if abs(intervals[k] - self.step) > JITTER * self.step:
            raise ValueError(
                f"data '{self.name}': column t, {self._place(k + 1)}: expected equal intervals of "
                f"{self.step:g} s to {JITTER:.0%}, got {intervals[k]:g} s; "
                "use Dataset.resampled() to interpolate"
            )
        return self

    def resampled(self, step: float | None = None) -> "Dataset":
        """The record at equal intervals of `step` [s] (default: the median interval).

        Position and velocity by cubic Hermite, force by linear interpolation. The controller is
        dropped: its reference belongs to the old samples.

        Raises:
            ValueError: a step that is not positive or leaves too few samples.
        """
        step = float(np.median(np.diff(self.t))) if step is None else step
        step = checks.number(f"data '{self.name}': resampled: step", step, unit="s", above=0.0)
        t = self.t[0] + step * np.arange(int((self.t[-1] - self.t[0]) / step * (1 + 1e-12)) + 1)
        return replace(
            self,
            t=t,
            x=_hermite(t, self.t, self.x),
            force=np.interp(t, self.t, self.force),
            v=None if self.v is None else _hermite(t, self.t, self.v),
            loop=None,
            filter=None,
            first_row=0,
        )

    def to_csv(self, path: str | Path) -> None:
        """Write t, x, force and v where there is one, with units in the header.

        `read_data` reads it back. The controller is not written.
        """
        signals = self.signals()
        with written(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(f"{key} [{UNITS[key]}]" for key in signals)
            writer.writerows(np.column_stack(list(signals.values())).tolist())


def _hermite(at: Array, t: Array, y: ArrayLike) -> Array:
    """Cubic Hermite interpolation with second-order slopes."""
    y = np.asarray(y, dtype=float)
    slope = np.gradient(y, t)
    k = np.clip(np.searchsorted(t, at, side="right") - 1, 0, t.size - 2)
    h = t[k + 1] - t[k]
    s = (at - t[k]) / h
    ends = y[k] * (1 + 2 * s) * (1 - s) ** 2 + y[k + 1] * s**2 * (3 - 2 * s)
    return ends + h * s * (1 - s) * (slope[k] * (1 - s) - slope[k + 1] * s)
