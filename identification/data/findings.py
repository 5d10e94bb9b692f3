"""What is doubtful about data: findings, each with its place."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal, final

Severity = Literal["error", "warning"]


@final
@dataclass(frozen=True)
class Finding:
    """One thing that is doubtful, or that no physics can come of.

    Attributes:
        kind: one word, such as "clipping".
        record: number of the record.
        signal: where it is seen; "" for the record as a whole.
        sentence: what it is, where, and what to do.
        begin, end: first and last time [s]; of points their numbers.
        severity: "error" where no fit of these data can be physics, else "warning".
    """

    kind: str
    record: int
    signal: str
    sentence: str
    begin: float
    end: float
    severity: Severity

    def to_dict(self) -> dict[str, Any]:
        """The fields by name, ready for JSON."""
        return dict(self.__dict__)


@final
@dataclass(frozen=True)
class Findings:
    """All findings of some data, errors first.

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
        """Those that no physics can come of."""
        return tuple(f for f in self.items if f.severity == "error")

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """Doubtful ones, which a fit says and goes on."""
        return tuple(f for f in self.items if f.severity == "warning")

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds that occur, each once."""
        return tuple(dict.fromkeys(f.kind for f in self.items))

    @property
    def text(self) -> str:
        """A line a finding, errors first."""
        if not self.items:
            return f"{self.name}: nothing doubtful found"
        lines = [f"  {f.severity}: {self._record(f)}{f.sentence}" for f in self.items]
        return "\n".join([f"{self.name}:", *lines])

    def _record(self, finding: Finding) -> str:
        """The record of a finding, where there are several."""
        several = len(self.records) > 1
        return f"{self.records[finding.record]}: " if several else ""

    def __str__(self) -> str:
        return self.text
