"""Rows of measurements: they print as tables, turn into JSON, and stand beside their goals."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from math import isfinite, log10
from pathlib import Path
from typing import Any, Literal, TypeVar, final

from symfric.foundation.files import write_table

T = TypeVar("T")
Cell = str | float
"""Of a table; text, or a number (NaN: not measured)."""
Column = str | Callable[[Any], Cell]
"""The field of a row that a column shows, or what computes its cell from a row."""
Progress = Callable[[str, float], None] | None
"""Called with what is measured and the fraction done."""


@final
@dataclass(frozen=True, eq=False)
class Table:
    """A table as it is printed."""

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]


def of(title: str, rows: Iterable[Any], columns: Mapping[str, Column]) -> Table:
    """The table of `rows` with these `columns` by their heads."""
    cells = [
        [getattr(row, c) if isinstance(c, str) else c(row) for c in columns.values()]
        for row in rows
    ]
    return Table(title, list(columns), cells)


def short(value: float, digits: int = 3) -> float:
    """A number of so many digits."""
    return float(f"{value:.{digits}g}")


def known(value: float, digits: int = 3) -> Cell:
    """A number of so many digits; empty where there is none."""
    return "" if value != value else short(value, digits)


def shortened(field: str, factor: float = 1.0) -> Column:
    """A column: a field times a factor, of three digits."""
    return lambda row: short(factor * getattr(row, field))


def known_only(field: str, digits: int = 3, factor: float = 1.0) -> Column:
    """A column: a field times a factor, of so many digits; empty where there is no number."""
    return lambda row: known(factor * getattr(row, field), digits)


def rounded(field: str, places: int | None = None, factor: float = 1.0) -> Column:
    """A column: a field times a factor, with so many decimal places."""
    return lambda row: round(factor * getattr(row, field), places)


def not_run(reasons: Mapping[str, str]) -> Iterator[str]:
    """A sentence on each contender that was not measured."""
    yield from (f"{name}: not run, {why}" for name, why in reasons.items())


class Judged:
    """Base of rows with a `value`, a `goal`, and the `better` side of it: at most or at least."""

    value: float
    goal: float
    better: Literal["<=", ">="]

    @property
    def met(self) -> bool:
        """Whether the goal is met; NaN meets none."""
        return self.value <= self.goal if self.better == "<=" else self.value >= self.goal

    @property
    def decades(self) -> float:
        """Decades by which the number is worse than its goal; NaN where either is not positive."""
        if not (self.value > 0 and self.goal > 0):
            return float("nan")
        return (1.0 if self.better == "<=" else -1.0) * log10(self.value / self.goal)


class Report:
    """Base of what `symfric bench` measures: a frozen dataclass, a field for each kind of rows."""

    def shown(self) -> Iterator[Table | str]:
        """Tables and sentences, as they are printed."""
        raise NotImplementedError

    def to_dict(self) -> dict[str, Any]:
        """Everything by name; numbers that are not finite are None."""
        return plain(self)

    def write_csv(self, path: str | Path) -> None:
        """Write the rows of the first field, a line each."""
        rows = getattr(self, fields(self)[0].name)  # pyright: ignore[reportArgumentType]
        write_table(path, rows[0]._fields if rows else (), rows)


def plain(value: Any) -> Any:
    """Rows, numbers and texts as JSON holds them."""
    if is_dataclass(value):
        found = {field.name: plain(getattr(value, field.name)) for field in fields(value)}
        return found | {"met": value.met} if isinstance(value, Judged) else found
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return plain(dict(zip(value._fields, value, strict=True)))  # pyright: ignore
    if isinstance(value, Mapping):
        return {str(name): plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float):
        return value if isfinite(value) else None
    return value


def each(items: Sequence[T], progress: Progress, name: Callable[[T], str]) -> Iterator[T]:
    """The items one after the other; `progress` is called with the name of each."""
    for k, item in enumerate(items):
        if progress is not None:
            progress(name(item), k / len(items))
        yield item


def until_stopped(rows: Iterable[T]) -> tuple[T, ...]:
    """The rows that are measured up to Ctrl-C.

    Raises:
        KeyboardInterrupt: before the first of them.
    """
    found: list[T] = []
    try:
        for row in rows:
            found.append(row)
    except KeyboardInterrupt:
        if not found:
            raise
    return tuple(found)


@final
@dataclass(frozen=True)
class Goal(Judged):
    """A measured number and its goal.

    Attributes:
        what: what was measured, with its unit.
        value, goal: the number, and what it should be.
        better: whether it should be at most ("<=") or at least (">=") the goal.
    """

    what: str
    value: float
    goal: float
    better: Literal["<=", ">="] = "<="


@final
@dataclass(frozen=True, eq=False)
class Section:
    """A table with goals.

    Attributes:
        title: what is measured, how and in which units.
        head: names of the columns.
        rows: cells, as many a row as there are columns.
        goals: the numbers among them that have one.
        notes: sentences below the table, such as which tool is absent.
    """

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    goals: Sequence[Goal] = ()
    notes: Sequence[str] = ()

    def to_dict(self) -> dict[str, Any]:
        """Everything by name; what was not measured is None."""
        rows = [dict(zip(self.head, row, strict=True)) for row in self.rows]
        found = {"title": self.title, "rows": rows, "goals": self.goals, "notes": self.notes}
        return plain(found)
