"""Choice in words: what to take and why, and a table of eighty columns."""

from collections.abc import Iterable, Iterator, Sequence
from math import isfinite
from textwrap import wrap

from symfric.choice.nature import EVENT, is_smooth
from symfric.choice.ranking import FAILED, INACCURATE, LACKING, RANKED, REFUSED, Ranking, Row

FASTER = 1.25
"""Clock contradicts the work beyond this ratio."""


def verdict(
    rows: Sequence[Row], needs: Sequence[str], accuracy: float, control: float
) -> tuple[str, ...]:
    """Sentences: for simulation, for optimal control, for a controller, and what fell out."""
    if not rows:
        return ("Nothing was measured.",)
    ranked = [row for row in rows if row.ranked]
    asked = " and ".join(needs) or "friction"
    found: list[str] = []
    if not ranked:
        near = [row for row in rows if row.standing == INACCURATE]
        best = min(near, key=lambda row: row.error, default=None)
        found.append(
            f"No law shows {asked} and keeps {accuracy:g}"
            + (f"; {best.called} comes nearest, {best.reason}." if best else ".")
        )
    else:
        found += [_fastest(ranked, asked), _smooth(ranked), _fixed(ranked, control)]
    return tuple([*found, _others(rows)])


def _fastest(ranked: Sequence[Row], asked: str) -> str:
    """Return the law of the least work, who is as good, and what the clock says against it."""
    best = ranked[0]
    text = (
        f"Simulation: take {best.called}, the least work of {len(ranked)} that show {asked} and "
        f"keep the accuracy: {1e3 * best.time_s:.3g} ms in {best.attempts} attempts by "
        f"{best.method}, {best.error:.1e} off"
    )
    near = [row.called for row in ranked[1:] if row.rank == best.rank]
    if near:
        text += f"; {_listed(near)} {'are' if len(near) > 1 else 'is'} as good"
    elif len(ranked) > 1:
        text += f"; {ranked[1].called} takes {ranked[1].work / best.work:.2g} times the work"
    fastest = min(ranked, key=lambda row: row.time_s)
    if fastest.rank != best.rank and FASTER * fastest.time_s < best.time_s:
        text += f". By the clock {fastest.called} is faster, {1e3 * fastest.time_s:.3g} ms"
    return f"{text}."


def _smooth(ranked: Sequence[Row]) -> str:
    """Return the one with second derivatives that is least steep; bristles where there is no
    other.
    """
    smooth = [row for row in ranked if is_smooth(row.smoothness)]
    if not smooth:
        first = ranked[0]
        kind = "switches by events" if first.form == EVENT else f"is {first.smoothness}"
        return f"Optimal control: none of them has second derivatives; {first.called} {kind}."
    flat = [row for row in smooth if row.steepness == row.steepness]
    if flat:
        take = min(flat, key=lambda row: row.steepness)
        return (
            f"Optimal control: take {take.called} ({take.smoothness}): of those with second "
            f"derivatives its force is the least steep, {take.steepness:.2g} of its level per m/s."
        )
    take = smooth[0]
    return f"Optimal control: take {take.called} ({take.smoothness}), with {_states(take)}."


def _fixed(ranked: Sequence[Row], control: float) -> str:
    if not any(row.fixed_step or row.fixed_why for row in ranked):
        return "Controller: fixed steps were not measured."
    able = [row for row in ranked if row.fixed_step is not None and row.c_operations is not None]
    counted = all(isfinite(row.core) for row in able)
    if not able:
        return (
            f"Controller: none of them follows within {control:g} in fixed steps that were tried."
        )
    take = min(able, key=lambda row: _in_c(row, counted) / (row.fixed_step or 1.0))
    what = "instructions on a Cortex-M4F" if counted else "operations"
    return (
        f"Controller: take {take.called}: its C takes {_in_c(take, counted):.0f} {what}, and with "
        f"it the plant stays within {control:g} in steps of {take.fixed_step:g} s (backward "
        "Euler): the least for a second of motion."
    )


def _in_c(row: Row, counted: bool) -> float:
    """Cost of a step of the law in C."""
    return row.core if counted else float(row.c_operations or 0)


def _states(row: Row) -> str:
    return f"{row.states} state{'s' if row.states != 1 else ''}"


def _others(rows: Sequence[Row]) -> str:
    """Number of laws left out, by the reason."""
    what = {
        LACKING: "for what they show",
        INACCURATE: "that do not keep the accuracy",
        FAILED: "whose run fails",
        REFUSED: "that do not fit into this machine",
    }
    counts = {text: sum(row.standing == name for row in rows) for name, text in what.items()}
    said = [f"{count} {text}" for text, count in counts.items() if count]
    return f"Left out of {len(rows)}: {_listed(said)}." if said else "None is left out."


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


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
STANDING_TEXTS = {
    RANKED: "show what is needed and keep the accuracy, by work:",
    INACCURATE: "do not keep the accuracy, by their error, timed where their own error does:",
    LACKING: "do not show what is needed, by their error, timed likewise:",
}
"""Standing -> what its laws do; those of other standings did not run."""


def lines(choice: Ranking, most: int | None = None) -> Iterator[str]:
    """Title, reference, table, reasons, verdict; of the rows at most so many are ranked ones."""
    yield choice.title
    yield from wrap(
        f"{choice.friction}; from {choice.reference}, itself known to {choice.uncertain:.0e}", WIDTH
    )
    yield ""
    cores = any(isfinite(row.core) for row in choice.rows)
    yield HEAD if cores else HEAD.replace("M4F", "  C")
    shown = choice.rows if most is None else choice.ranked[:most]
    for standing, text in STANDING_TEXTS.items():
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
    for sentence in verdict(choice.rows, choice.needs, choice.accuracy, choice.control):
        yield from wrap(sentence, WIDTH)
    if choice.interrupted:
        yield from wrap(interrupted(choice), WIDTH)


def interrupted(choice: Ranking) -> str:
    """Return a sentence on the laws without a row because the ranking was interrupted."""
    count = len(choice.unmeasured)
    return f"Interrupted: {count} of {count + len(choice.rows)} laws were not measured: " + (
        f"{', '.join(choice.unmeasured)}."
    )


def _left_out(rows: Iterable[Row]) -> dict[str, list[str]]:
    """Return reason for not being ranked -> laws that it applies to, in the order of the rows."""
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
    """Return a number >= 0 in five places; a dash for none."""
    if not isfinite(value):
        return "-"
    if value >= 10 ** (digits - 1):
        return f"{value:.0f}"
    return f"{value:.{digits}g}" if value >= 0.1 else f"{value:.2f}"


def short(value: float | None) -> str:
    """Return a power of ten with one digit; a dash for none."""
    if value is None or not isfinite(value):
        return "-"
    return f"{value:.0e}".replace("e-0", "e-").replace("e+00", "")
