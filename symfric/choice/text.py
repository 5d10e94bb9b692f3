"""The choice as a table of eighty columns."""

from collections.abc import Iterable, Iterator
from math import isfinite
from textwrap import wrap
from typing import TYPE_CHECKING

from symfric.choice.row import INACCURATE, RANKED, Row

if TYPE_CHECKING:
    from symfric.choice.result import Choice

WIDTH = 80
HEAD = (
    f"{'law':<20}{'time':>8}{'tries':>7}{'error':>9}{'h':>7}{'C':>6}{'par':>6} {'class':<5} shows"
)
LEGEND = (
    "time [ms] and tries (attempts of a step) at equal error; h [s]: largest fixed step; C: "
    "operations of the law; par: parameters, of which hard to measure; class: smoothness, or "
    "event: a form whose modes switch by events"
)


def lines(choice: "Choice", most: int | None = None) -> Iterator[str]:
    """Title, reference, table, reasons, verdict; of the rows at most so many are ranked ones."""
    yield choice.title
    yield from wrap(
        f"{choice.friction}; from {choice.reference}, itself known to {choice.uncertain:.0e}", WIDTH
    )
    yield ""
    yield HEAD
    with_numbers = [row for row in choice.rows if row.standing in (RANKED, INACCURATE)]
    shown = choice.ranked if most is None else choice.ranked[:most]
    for row in shown:
        yield _line(row)
    if len(shown) < len(choice.ranked):
        yield f"... and {len(choice.ranked) - len(shown)} more that are ranked"
    if most is None:
        rest = [row for row in with_numbers if not row.ranked]
        for row in rest:
            yield _line(row)
    yield ""
    if most is None:
        for reason, names in _left_out(choice.rows).items():
            text = f"{reason}: {', '.join(names)}"
            yield from wrap(text, WIDTH, subsequent_indent="    ", break_on_hyphens=False)
        yield ""
    for sentence in choice.verdict:
        yield from wrap(sentence, WIDTH)
    if choice.interrupted:
        yield "Interrupted: laws without a row were not measured."


def _left_out(rows: Iterable[Row]) -> dict[str, list[str]]:
    """Why laws are not ranked -> those of which this is said, in the order of the rows."""
    found: dict[str, list[str]] = {}
    for row in rows:
        if not row.ranked:
            reason = row.reason.removeprefix(f"{row.law} ")
            found.setdefault(f"{row.standing}, {reason}", []).append(row.called)
    return found


def _line(row: Row) -> str:
    step = "-" if row.fixed_step is None else f"{row.fixed_step:.0e}".replace("e-0", "e-")
    operations = "-" if row.c_operations is None else str(row.c_operations)
    time = f"{1e3 * row.time_s:.2f}" if isfinite(row.time_s) else "-"
    mark = "" if row.ranked else "*"
    return (
        f"{mark + row.law:<20}{time:>8}{row.attempts:>7}{row.error:>9.1e}{step:>7}{operations:>6}"
        f"{f'{row.parameters}/{len(row.hard)}':>6} {row.smoothness:<5} {''.join(row.phenomena)}"
    )
