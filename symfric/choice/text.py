"""The choice as a table of eighty columns."""

from collections.abc import Iterable, Iterator
from math import isfinite
from textwrap import wrap
from typing import TYPE_CHECKING

from symfric.choice.row import INACCURATE, LACKING, RANKED, Row

if TYPE_CHECKING:
    from symfric.choice.result import Choice

WIDTH = 80
HEAD = (
    f"{'':>4}{'law':<19}{'work':>6}{'ms':>6}{'error':>7}{'own':>6}{'h':>6}{'M4F':>5}"
    f"{'par':>6} {'class':<5} shows"
)
LEGEND = (
    "The first column is the rank; laws with = are alike. work: millions of instructions at equal "
    "error, which ranks; ms: processor time of the same run. error: from the reference; own: the "
    "integrator's part. h [s]: largest fixed step; M4F: instructions of the law's step on a "
    "Cortex-M4F (C: operations, where there are no tools to count); par: parameters / hard to "
    "measure; class: smoothness, or event: a form whose modes switch by events"
)
GROUPS = {
    RANKED: "show what is needed and keep the accuracy, by work:",
    INACCURATE: "do not keep the accuracy, by their error, timed where their own error does:",
    LACKING: "do not show what is needed, by their error, timed likewise:",
}
"""Standing -> what its laws do; those of other standings did not run."""


def lines(choice: "Choice", most: int | None = None) -> Iterator[str]:
    """Title, reference, table, reasons, verdict; of the rows at most so many are ranked ones."""
    yield choice.title
    yield from wrap(
        f"{choice.friction}; from {choice.reference}, itself known to {choice.uncertain:.0e}", WIDTH
    )
    yield ""
    cores = any(isfinite(row.core) for row in choice.rows)
    yield HEAD if cores else HEAD.replace("M4F", "  C")
    shown = choice.rows if most is None else choice.ranked[:most]
    for standing, text in GROUPS.items():
        group = [row for row in shown if row.standing == standing and row.rank]
        if group and most is None:
            yield f"-- {text}"
        for row in group:
            yield _line(row, _tied(row, choice.rows), cores)
    if most is not None and most < len(choice.placed):
        yield f"... and {len(choice.placed) - len(shown)} more that ran"
    yield ""
    if most is None:
        for reason, names in _left_out(choice.rows).items():
            text = f"{reason}: {', '.join(names)}"
            yield from wrap(text, WIDTH, subsequent_indent="    ", break_on_hyphens=False)
        yield ""
    for sentence in choice.verdict:
        yield from wrap(sentence, WIDTH)
    if choice.interrupted:
        yield from wrap(interrupted(choice), WIDTH)


def interrupted(choice: "Choice") -> str:
    """Which laws have no row since somebody stopped it."""
    count = len(choice.unmeasured)
    return f"Interrupted: {count} of {count + len(choice.rows)} laws were not measured: " + (
        f"{', '.join(choice.unmeasured)}."
    )


def _left_out(rows: Iterable[Row]) -> dict[str, list[str]]:
    """Why laws are not among the first -> those of which this is said, in the order of the rows."""
    found: dict[str, list[str]] = {}
    for row in rows:
        if not row.ranked:
            reason = row.reason.removeprefix(f"{row.law} ").removeprefix(f"{row.error:.1e} off: ")
            found.setdefault(f"{row.standing}, {reason}", []).append(row.called)
    return found


def _tied(row: Row, rows: Iterable[Row]) -> bool:
    return sum(other.rank == row.rank for other in rows) > 1


def _line(row: Row, tied: bool, cores: bool) -> str:
    counts = f"{row.core:.0f}" if isfinite(row.core) else "-"
    if not cores:
        counts = "-" if row.c_operations is None else str(row.c_operations)
    return (
        f"{row.rank:>2}{'=' if tied else ' '} {row.law:<19}{number(1e-6 * row.work):>6}"
        f"{number(1e3 * row.time_s):>6}{short(row.error):>7}{short(row.own_error):>6}"
        f"{short(row.fixed_step):>6}{counts:>5}{f'{row.parameters}/{len(row.hard)}':>6} "
        f"{row.smoothness:<5} {''.join(row.phenomena)}"
    )


def number(value: float, digits: int = 3) -> str:
    """A number >= 0 in five places; a dash for none."""
    if not isfinite(value):
        return "-"
    if value >= 10 ** (digits - 1):
        return f"{value:.0f}"
    return f"{value:.{digits}g}" if value >= 0.1 else f"{value:.2f}"


def short(value: float | None) -> str:
    """A power of ten with one digit; a dash for none."""
    if value is None or not isfinite(value):
        return "-"
    return f"{value:.0e}".replace("e-0", "e-").replace("e+00", "")
