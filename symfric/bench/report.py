"""Results of a benchmark: tables that are printed, stored and drawn, goals, and timing."""

import os
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from itertools import chain
from math import inf, isfinite, nan
from pathlib import Path
from time import perf_counter, process_time
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Self, TypeVar, final

from symfric.choice.work_precision import time_at as interpolated
from symfric.foundation.files import write_table
from symfric.foundation.programs import find_compiler, needed_compiler
from symfric.foundation.status import SolveError, Status
from symfric.integrator.compiled.compiler import FLAGS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

T = TypeVar("T")
Cell = str | float
"""Value of a cell: a text, or a number (NaN if not measured)."""
Row = Mapping[str, Cell]
"""Column title with its unit -> value, at full precision."""
Found = tuple[str, Row] | str
"""Row with the title of its table, or a note."""
Progress = Callable[[str, float, str], None] | None
"""Function called with the name of the current item, the fraction done, and each new row."""
Draw = Callable[[Sequence[Row]], "Figure"]
DIGITS = 3
"""Significant digits of printed numbers that are not integers."""


class PrintedTable(NamedTuple):
    """Table to print."""

    title: str
    head: list[str]
    rows: list[list[Cell]]


@final
@dataclass(eq=False)
class Report:
    """Results of a benchmark.

    Attributes:
        draw: title of a table, and the function that draws its rows; None if there is no picture.
        tables: title -> rows; the rows of a table may have different columns.
        notes: sentences, for example about tools that are not installed.
        interrupted: True after Ctrl-C.
        failed: names of the tasks that failed.
    """

    draw: tuple[str, Draw] | None = None
    tables: dict[str, list[Row]] = field(default_factory=dict[str, list[Row]])
    notes: list[str] = field(default_factory=list[str])
    interrupted: bool = False
    failed: tuple[str, ...] = ()

    def add(self, found: Iterable[Found]) -> None:
        """Append rows and notes."""
        for item in found:
            if isinstance(item, str):
                self.notes.append(item)
            else:
                self.tables.setdefault(item[0], []).append(item[1])

    def collect(
        self, tasks: Mapping[str, Callable[[], Iterable[Found]]], progress: Progress = None
    ) -> Self:
        """Run tasks and append their results; Ctrl-C ends the loop and keeps the rows so far.

        A task that fails keeps its rows so far, and the others are run.

        Raises:
            KeyboardInterrupt: Ctrl-C before the first row.
        """
        try:
            for k, (name, task) in enumerate(tasks.items()):
                if progress is not None:
                    progress(name, k / len(tasks), "")
                try:
                    for found in task():
                        self.add([found])
                        if progress is not None:
                            progress(name, (k + 1) / len(tasks), line(found))
                except Exception as error:  # noqa: BLE001  (any failure of a measured tool)
                    if isinstance(error, SolveError) and error.status is Status.INTERRUPTED:
                        raise KeyboardInterrupt from None
                    self.failed = (*self.failed, name)
                    first = (str(error).strip().splitlines() or [""])[0]
                    self.notes.append(f"{name} failed: {type(error).__name__}: {first}")
        except KeyboardInterrupt:
            if not self.tables:
                raise
            self.interrupted = True
            self.notes.append("Interrupted: the other measurements were not made.")
        return self

    def shown(self) -> Iterator[PrintedTable | str]:
        """Yield the tables and sentences to print, with numbers rounded to 3 digits."""
        for title, rows in self.tables.items():
            head = list(dict.fromkeys(chain.from_iterable(rows)))
            yield PrintedTable(
                title, head, [[_short(row.get(c, "")) for c in head] for row in rows]
            )
        yield from self.notes

    def to_dict(self) -> dict[str, Any]:
        """Return the rows by table, and the notes."""
        return {"tables": self.tables, "notes": self.notes}

    def write_csv(self, path: str | Path) -> None:
        """Write the rows of the first table, one per line."""
        rows = next(iter(self.tables.values()), [])
        head = list(dict.fromkeys(chain.from_iterable(rows)))
        write_table(path, head, ([row.get(c, "") for c in head] for row in rows))

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Draw the result; save the picture if `path` is given.

        Raises:
            ValueError: a benchmark without a picture.
        """
        from symfric.foundation.panels import save  # noqa: PLC0415  (slow to import)

        if self.draw is None:
            raise ValueError("plot: expected a benchmark with a picture, got one of tables only")
        title, draw = self.draw
        return save(draw(self.tables.get(title, [])), path)


def line(found: Found) -> str:
    """Return a row as one line of its cells, or a note."""
    if isinstance(found, str):
        return found
    cells = (
        c if isinstance(c, str) else f"{c:.{DIGITS}g}" if c == c else "-" for c in found[1].values()
    )
    return "  ".join(cell for cell in cells if cell)


def _short(cell: Cell) -> Cell:
    """Return a number rounded to significant digits; integers and NaN are unchanged."""
    return float(f"{cell:.{DIGITS}g}") if isinstance(cell, float) else cell


# ---- goals ----

GOALS = "Measured numbers and their goals"


def goal(
    quantity: str,
    measured: float,
    limit: float,
    side: Literal["<=", ">="] = "<=",
    seconds: float = 0.0,
    note: str = "",
) -> tuple[str, Row]:
    """Return a number with its goal as a row of the table of goals; NaN never meets a goal.

    Args:
        quantity: measured quantity, with its unit.
        measured, limit: measured number, and the number to reach.
        side: relation of the measured number to the limit at which the goal is met.
        seconds: processor time of the measurement [s].
        note: remark for the user, for example that data are absent.
    """
    met = measured <= limit if side == "<=" else measured >= limit
    return GOALS, {
        "quantity": quantity, "measured": measured, "goal": f"{side} {limit:g}",
        "met": "yes" if met else "no", "processor time [s]": seconds, "note": note,
    }  # fmt: skip


# ---- times at equal error ----

RATIOS = "Time at equal error"


def ratios(rows: Sequence[Row], reference: str, errors: Sequence[float]) -> Iterator[Found]:
    """Yield times relative to `reference` at errors that both integrators reach."""
    for case in dict.fromkeys(r["case"] for r in rows):
        own = [r for r in rows if r["case"] == case]
        for error in errors:
            times = {
                name: time_at([r for r in own if r["integrator"] == name], error)
                for name in dict.fromkeys(r["integrator"] for r in own)
            }
            for name, time_ms in times.items():
                ratio = time_ms / times.get(reference, nan)
                if ratio == ratio:
                    yield RATIOS, {
                        "case": case, "relative error": error, "integrator": name,
                        "time per run [ms]": time_ms, f"ratio to {reference}": ratio,
                    }  # fmt: skip


def time_at(rows: Sequence[Row], error: float) -> float:
    """Return the time [ms] to reach `error`, interpolated log-log; NaN if no row reaches it."""
    points = ((float(r["relative error"]), float(r["time per run [ms]"])) for r in rows)
    return interpolated(points, error)


# ---- curves ----

ABREAST = 6
"""Largest number of panels in a row."""
LEAST = 1e-14
"""Smallest value that is drawn."""
DECADE = 10.0
"""Ratio of the largest to the smallest ordinate below which their axis is linear."""


def curves(panel: str, lines: Sequence[str], x: str, *ys: str) -> Draw:
    """Return a function that draws some columns over another column, with logarithmic axes.

    The axis of ordinates within a decade is linear. The panels of a case are one below the other.

    Args:
        panel: column with a panel for each value.
        lines: columns with a curve for each combination of values.
        x: column of the abscissae; the axis is inverted if they decrease from row to row.
        ys: columns of the ordinates, each in separate panels.
    """
    return partial(_draw_curves, panel, lines, x, ys)


def _draw_curves(
    panel: str, lines: Sequence[str], x: str, ys: Sequence[str], rows: Sequence[Row]
) -> "Figure":
    from symfric.foundation.panels import grid, legend_below  # noqa: PLC0415  (slow to import)
    from symfric.foundation.style import COLOURS, MARKERS, colour  # noqa: PLC0415  (slow to import)

    def label(row: Row) -> str:
        return ", ".join(c if isinstance(c := row[k], str) else f"{k} = {c:g}" for k in lines)

    cases = list(dict.fromkeys(row[panel] for row in rows))
    labels = list(dict.fromkeys(map(label, rows)))
    points: dict[tuple[str, Cell | None, str], list[tuple[float, float]]] = {}
    for y in ys:
        for row in rows:
            at, value = float(row[x]), float(row.get(y, "nan"))
            if isfinite(at) and isfinite(value):
                points.setdefault((y, row[panel], label(row)), []).append((at, max(value, LEAST)))
    blocks = -(-len(cases) // ABREAST) or 1
    columns = -(-len(cases) // blocks) or 1
    height = blocks * len(ys)
    figure, grid_axes = grid(height, columns, 1.4 + 2.4 * max(columns, 3), 1.6 + 2.8 * height)
    axes = list(chain(*grid_axes))
    padded = [*cases, *[None] * (blocks * columns - len(cases))]
    starts = range(0, len(padded), columns)
    tiles = [(y, case) for k in starts for y in ys for case in padded[k : k + columns]]
    for axis, (y, case) in zip(axes, tiles, strict=True):
        drawn = [b for key, line in points.items() if key[:2] == (y, case) for _, b in line]
        if max(drawn, default=LEAST) <= LEAST:
            axis.set_axis_off()
            continue
        for k, name in enumerate(labels):
            line = points.get((y, case, name), [])
            bold = name.startswith("symfric")
            axis.loglog(
                [a for a, _ in line], [b for _, b in line], label=name, color=colour(k),
                marker=MARKERS[k % len(MARKERS)], markersize=4,
                linestyle="-" if bold else "--", linewidth=2.0 if bold else 1.0,
                markerfacecolor="none" if k // len(COLOURS) % 2 else None,
            )  # fmt: skip
            if len(line) > 1 and line[0][0] > line[-1][0] and not axis.xaxis_inverted():
                axis.invert_xaxis()
        if max(drawn) < DECADE * min(drawn):
            axis.set_yscale("linear")
        axis.set_title(str(case).replace("_", " "), fontsize="small")
        axis.set_xlabel(x)
        axis.set_ylabel(y)
        axis.tick_params(which="both", labelsize="small")
        axis.xaxis.set_minor_formatter("")
    legend_below(figure, axes[0], 4, fontsize="small", frameon=True)
    return figure


# ---- timing ----

FASTEST = (*(f for f in FLAGS if f != "-ffp-contract=off"), "-freciprocal-math")
"""Compiler flags for other tools, which may round differently from CasADi's virtual machine."""


def backend() -> str:
    """Return "compiled", or "vm" without a C compiler."""
    return "compiled" if find_compiler() else "vm"


@contextmanager
def unwarned() -> Generator[None]:
    """Suppress warnings, since loose tolerances are measured deliberately."""
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

    The shortest time is the cost of the code; longer times include other load of the machine. For
    calls without threads, processor time (`time.process_time`) is the better clock.
    """
    best, spent, result = inf, 0.0, None
    for _ in range(most):
        begin = clock()
        result = call()
        elapsed = clock() - begin
        best, spent = min(best, elapsed), spent + elapsed
        if spent > budget:
            break
    return best, result  # pyright: ignore[reportReturnType]  (called at least once)


def timed(call: Callable[[], T]) -> tuple[float, T]:
    """Return the processor time [s] of one call, and its result."""
    return best_time(call, most=1, clock=process_time)


def interleaved(calls: Mapping[str, Callable[[], object]], rounds: int = 7) -> dict[str, float]:
    """Return the shortest processor time [s] of each of the `calls`, which alternate.

    A temporary load of the machine affects all calls equally, so that ratios are meaningful. The
    first call of each is not measured.
    """
    best = dict.fromkeys(calls, inf)
    for call in calls.values():
        call()
    for _ in range(rounds):
        for name, call in calls.items():
            best[name] = min(best[name], timed(call)[0])
    return best


def compile_time(source: str, target: str | os.PathLike[str] = os.devnull) -> float:
    """Return the processor time [s] of the C compiler on `source`, with the fastest flags.

    Raises:
        CompileError: no compiler.
    """
    compiler = needed_compiler()
    before = os.times()
    compiler.run(*FASTEST, "-x", "c", "-", "-o", str(target), "-lm", code=source)
    after = os.times()
    user = after.children_user - before.children_user
    return user + after.children_system - before.children_system
