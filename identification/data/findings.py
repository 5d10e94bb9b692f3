"""Findings of the checks, each with its place, and the view of a record that the checks share."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, partialmethod
from typing import Any, Literal, final

import numpy as np
from numpy.typing import NDArray

from identification.data.record import Record
from symfric.foundation import checks

Array = NDArray[np.float64]
Severity = Literal["error", "warning"]
ROLES = ("x", "v", "a", "force")


@final
@dataclass(frozen=True)
class Finding:
    """A warning or error in the data.

    Attributes:
        kind: one word, such as "clipping".
        record: number of the record.
        signal: affected signal; "" for the record as a whole.
        sentence: description, place and remedy.
        begin, end: first and last time [s]; for points their indices.
        severity: "error" if no fit of these data can be physically meaningful, else "warning".
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
        name: of the data.
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
        """Findings that a fit reports before it continues."""
        return tuple(f for f in self.items if f.severity == "warning")

    @property
    def kinds(self) -> tuple[str, ...]:
        """Types of the findings, each once."""
        return tuple(dict.fromkeys(f.kind for f in self.items))

    def __str__(self) -> str:
        if not self.items:
            return f"{self.name}: no problems found"
        of = [f"{name}: " if len(self.records) > 1 else "" for name in self.records]
        lines = [f"  {f.severity}: {of[f.record]}{f.sentence}" for f in self.items]
        return "\n".join([f"{self.name}:", *lines])


@final
@dataclass(frozen=True, eq=False)
class View:
    """A record under check.

    Attributes:
        record: the record.
        number: its index in the data.
        roles: part in the drive ("x", "v", "a", "force") -> name of its signal.
    """

    record: Record
    number: int
    roles: Mapping[str, str]

    @classmethod
    def of(cls, record: Record, number: int, roles: Mapping[str, str]) -> "View":
        """Return the view of a record; `roles` names signals whose names differ from their part."""
        named = checks.named("check", roles, ROLES)
        given = {role: name for role, name in named.items() if role != name or name in record}
        found = {role: role for role in ROLES if role in record.signals}
        return cls(record, number, found | {r: record.channel(n) for r, n in given.items()})

    def signal(self, role: str) -> Array | None:
        """Return the signal of a part, if there is one."""
        return self.record.signals[self.roles[role]] if role in self.roles else None

    def known(self) -> Iterator[tuple[str, Array, str]]:
        """Yield name, values and unit of the long signals that vary and have a part or a unit.

        Others may be predictions of a model.
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
    def steady(self) -> Record | None:
        """Longest piece without a gap, at equal intervals; None if it is too short."""
        record = self.record
        if record.t is None or record.size < 20:
            return None
        piece = record.at(max(record.pieces, key=lambda part: part.stop - part.start))
        if piece.size < 20:
            return None
        step = (piece.time[-1] - piece.time[0]) / (piece.size - 1)
        grid = piece.time[0] + step * np.arange(piece.size)
        if np.abs(grid - piece.time).max() < 0.05 * step:
            return piece
        signals = {key: np.interp(grid, piece.time, y) for key, y in piece.signals.items()}
        return Record(piece.name, grid, signals, piece.units, first_row=piece.first_row)

    def finding(
        self, severity: Severity, kind: str, signal: str, sentence: str,
        begin: int | None = None, end: int | None = None,
    ) -> Finding:  # fmt: skip
        """Return a finding at the samples `begin` to `end`, by default the whole record."""
        last = self.record.size - 1 if begin is None else begin
        samples = (begin or 0, last if end is None else end)
        first, last = samples if self.record.t is None else self.record.t[[*samples]]
        return Finding(kind, self.number, signal, sentence, float(first), float(last), severity)

    error = partialmethod(finding, "error")
    warning = partialmethod(finding, "warning")

    def at(self, sample: int) -> str:
        """Return a place as text: its time and its row."""
        t = self.record.t
        place = self.record.place(sample)
        return place if t is None else f"t = {t[sample]:.6g} s ({place})"


def constant_runs(y: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return first samples and lengths of the runs of equal values of a signal."""
    first = np.concatenate([[0], np.flatnonzero(np.diff(y) != 0) + 1])
    return first, np.diff(np.concatenate([first, [y.size]]))


def count_of(y: Array) -> float:
    """Return the smallest step between values of a signal; 0 if they are not on a coarse grid."""
    levels = np.unique(y)
    if levels.size < 2 or levels.size > 0.5 * y.size:
        return 0.0
    steps = np.diff(levels)
    smallest = float(np.quantile(steps, 0.05))
    off = np.abs(steps / smallest - np.rint(steps / smallest)) if smallest > 0 else np.ones(1)
    return smallest if np.median(off) < 0.02 and smallest > 1e-12 * np.ptp(y) else 0.0
