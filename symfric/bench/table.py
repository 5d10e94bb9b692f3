"""Tables of measurements, their conversion to JSON, goals, and timing."""

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
"""Cell of a table: a text, or a number (NaN if not measured)."""
Column = str | Callable[[Any], Cell]
"""Name of the field that a column shows, or a function that computes its cell from a row."""
Progress = Callable[[str, float], None] | None
"""Function called with the name of the current item and the fraction done."""


@final
@dataclass(frozen=True)
class Goal:
    """Measured number and its goal.

    Attributes:
        what: measured quantity, with its unit.
        value: measured number.
        goal: number to be reached.
        better: side of the goal on which it is met: at most ("<=") or at least (">=").
        seconds: processor time of the measurement [s].
        note: remark for the reader, for example that data are absent.
        case: name of the problem.
    """

    what: str
    value: float
    goal: float
    better: Literal["<=", ">="] = "<="
    seconds: float = 0.0
    note: str = ""
    case: str = ""

    @property
    def met(self) -> bool:
        """True if the goal is met; NaN never meets a goal."""
        return self.value <= self.goal if self.better == "<=" else self.value >= self.goal

    @property
    def decades(self) -> float:
        """Decades by which the number misses its goal; NaN if either is not positive."""
        if not (self.value > 0 and self.goal > 0):
            return float("nan")
        return (1.0 if self.better == "<=" else -1.0) * log10(self.value / self.goal)


@final
@dataclass(frozen=True, eq=False)
class Table:
    """Table to print, with goals and notes.

    Attributes:
        title: measured quantities, method and units.
        head: column titles.
        rows: cells, one row per measurement.
        keys: names of the columns in JSON; the titles by default.
        goals: numbers of the table that have a goal.
        notes: sentences below the table, for example about a missing tool.
    """

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    keys: Sequence[str] = ()
    goals: Sequence[Goal] = ()
    notes: Sequence[str] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return rows, goals and notes by name; numbers that are not finite are None."""
        rows = [dict(zip(self.keys or self.head, row, strict=True)) for row in self.rows]
        found = {"title": self.title, "rows": rows, "goals": self.goals, "notes": self.notes}
        return plain(found)


def of(title: str, rows: Iterable[Any], columns: Mapping[str, Column]) -> Table:
    """Return the table of `rows` with the given columns, title -> column."""
    cells = [
        [getattr(row, c) if isinstance(c, str) else c(row) for c in columns.values()]
        for row in rows
    ]
    return Table(title, list(columns), cells)


def short(value: float, digits: int = 3) -> float:
    """Round a number to significant digits; NaN stays."""
    return float(f"{value:.{digits}g}")


def shortened(field: str, factor: float = 1.0, digits: int = 3) -> Column:
    """Return a column that shows a field times a factor, rounded to significant digits."""
    return lambda row: short(factor * getattr(row, field), digits)


def rounded(field: str, places: int | None = None, factor: float = 1.0) -> Column:
    """Return a column that shows a field times a factor, rounded to decimal places."""
    return lambda row: round(factor * getattr(row, field), places)


def not_run(reasons: Mapping[str, str]) -> Iterator[str]:
    """Yield a sentence for each contender that was not measured."""
    yield from (f"{name}: not run, {why}" for name, why in reasons.items())


class Report:
    """Base class of benchmark results: frozen dataclasses with one field per type of rows."""

    def shown(self) -> Iterator[Table | str]:
        """Yield the tables and sentences to print."""
        raise NotImplementedError

    def drawn(self) -> tuple[Any, ...]:
        """Return X of the function `symfric.bench.pictures.plot_X`, and its arguments."""
        raise NotImplementedError

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Draw the result; save the picture if `path` is given."""
        from symfric.bench import pictures  # noqa: PLC0415  (matplotlib is slow to import)

        name, *given = self.drawn()
        return getattr(pictures, f"plot_{name}")(*given, path=path)

    def to_dict(self) -> dict[str, Any]:
        """Return all fields by name; numbers that are not finite are None."""
        return plain(self)

    def write_csv(self, path: str | Path) -> None:
        """Write the rows of the first field, one per line."""
        rows = getattr(self, fields(self)[0].name)  # pyright: ignore[reportArgumentType]
        write_table(path, rows[0]._fields if rows else (), rows)


def plain(value: Any) -> Any:
    """Return rows, numbers and texts as JSON data."""
    if is_dataclass(value):
        found = {field.name: plain(getattr(value, field.name)) for field in fields(value)}
        return found | {"met": value.met} if isinstance(value, Goal) else found
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
    """Yield the items; call `progress` with the name of each."""
    for k, item in enumerate(items):
        if progress is not None:
            progress(name(item), k / len(items))
        yield item


def until_stopped(rows: Iterable[T]) -> tuple[T, ...]:
    """Collect rows until Ctrl-C.

    Raises:
        KeyboardInterrupt: Ctrl-C before the first row.
    """
    found: list[T] = []
    try:
        for row in rows:
            found.append(row)
    except KeyboardInterrupt:
        if not found:
            raise
    return tuple(found)


FASTEST = (*(f for f in FLAGS if f != "-ffp-contract=off"), "-freciprocal-math")
"""Compiler flags for other tools, which may round differently from CasADi's virtual machine."""


@contextmanager
def unwarned() -> Generator[None]:
    """Suppress warnings: loose tolerances are measured on purpose."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def best_time(
    call: Callable[[], T],
    budget: float = 0.05,
    most: int = 30,
    clock: Callable[[], float] = perf_counter,
) -> tuple[float, T]:
    """Return the shortest time [s] of `call` over repeats within `budget` seconds, and its result.

    The shortest time is the cost of the code; longer ones include other load of the machine. For
    calls without threads, processor time (`time.process_time`) is the better clock.
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
    """Return the shortest processor time [s] of each of the `calls`, which take turns.

    A temporary load of the machine affects all of them equally, so that ratios hold.

    Args:
        calls: functions by name; the first call of each is not measured.
        rounds: least number of measurements of each.
        budget: total time [s] up to which further rounds are made.
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
    """Return the processor time [s] of the C compiler on `source`, with the fastest flags.

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
