"""Findings of the checks of data, and the checked view of a record."""

import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, partialmethod
from pathlib import Path
from typing import Any, Literal, final

import numpy as np

from identification.data.record import Array, Record, blocks, first_of
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
        """Longest piece of the record without gaps, at equal intervals; () if it is too short.

        A long piece is represented by evenly spaced blocks.
        """
        record = self.record
        if record.t is None or record.size < 20:
            return ()
        longest = max(record.pieces, key=lambda part: part.stop - part.start)
        size, first = longest.stop - longest.start, longest.start
        if size < 20:
            return ()
        each = (slice(first + part.start, first + part.stop) for part in blocks(size))
        return tuple(_even(record.at(part)) for part in each)

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


def _even(piece: Record) -> Record:
    """Return a record at equal intervals, interpolated if its intervals differ by more than 5 %."""
    step = (piece.time[-1] - piece.time[0]) / (piece.size - 1)
    grid = piece.time[0] + step * np.arange(piece.size)
    if np.abs(grid - piece.time).max() < 0.05 * step:
        return piece
    signals = {key: np.interp(grid, piece.time, y) for key, y in piece.signals.items()}
    return Record(piece.name, grid, signals, piece.units, first_row=piece.first_row)
