"""Rows of measurements: they print as tables, turn into JSON, and have goals; honest timing."""

import os
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, is_dataclass
from math import isfinite, log10
from pathlib import Path
from time import perf_counter, process_time
from typing import TYPE_CHECKING, Any, Literal, TypeVar, final

from symfric.foundation.files import write_table
from symfric.foundation.programs import find_compiler, no_compiler
from symfric.integrator.compiled.compiler import FLAGS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
        """True if the goal is met; NaN meets none."""
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

    def drawn(self) -> tuple[Any, ...]:
        """A picture: the end of its function's name in `symfric.bench.pictures`, and arguments."""
        raise NotImplementedError

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Draw it; save it to `path` if given."""
        from symfric.bench import pictures  # noqa: PLC0415  (matplotlib is slow to import)

        name, *given = self.drawn()
        return getattr(pictures, f"plot_{name}")(*given, path=path)

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


FASTEST = (*(f for f in FLAGS if f != "-ffp-contract=off"), "-freciprocal-math")
"""Flags for others, which need not round as CasADi's virtual machine does."""


@contextmanager
def unwarned() -> Generator[None]:
    """No warnings: loose tolerances are measured on purpose."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def best_time(
    call: Callable[[], T],
    budget: float = 0.05,
    most: int = 30,
    clock: Callable[[], float] = perf_counter,
) -> tuple[float, T]:
    """Shortest time [s] of `call` over repeats within `budget` seconds, and its result.

    The shortest one is what the code costs; the rest is what else the machine does. Of a
    call that has no threads the processor time (`time.process_time`) is the better clock.
    """
    best, spent, result = float("inf"), 0.0, None
    for _ in range(most):
        begin = clock()
        result = call()
        elapsed = clock() - begin
        best, spent = min(best, elapsed), spent + elapsed
        if spent > budget:
            break
    return best, result  # pyright: ignore[reportReturnType]  (called at least once)


def interleaved(
    calls: Mapping[str, Callable[[], object]], rounds: int = 7, budget: float = 0.0
) -> dict[str, float]:
    """Shortest processor time [s] of each of the `calls`, which take turns.

    What disturbs the machine for a while disturbs all of them alike, so that ratios hold.

    Args:
        calls: by name; the first call of each is not measured.
        rounds: how often each is measured at least.
        budget: time [s] in all up to which further rounds are made.
    """
    best = dict.fromkeys(calls, float("inf"))
    for call in calls.values():
        call()
    began, made = perf_counter(), 0
    while made < rounds or perf_counter() - began < budget:
        for name, call in calls.items():
            begin = process_time()
            call()
            best[name] = min(best[name], process_time() - begin)
        made += 1
    return best


def compile_time(source: str, target: str | os.PathLike[str] = os.devnull) -> float:
    """Processor time [s] of the C compiler on `source`, with the fastest flags.

    Raises:
        CompileError: no compiler.
    """
    compiler = find_compiler()
    if compiler is None:
        raise no_compiler()
    before = os.times()
    compiler.run(*FASTEST, "-x", "c", "-", "-o", str(target), "-lm", code=source)
    after = os.times()
    user = after.children_user - before.children_user
    return user + after.children_system - before.children_system
