"""What to take, and why, in sentences."""

from collections.abc import Sequence
from math import isfinite

from symfric.choice.nature import EVENT, is_smooth
from symfric.choice.row import FAILED, INACCURATE, LACKING, REFUSED, Row

FASTER = 1.25
"""The clock contradicts the work beyond this ratio."""


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
    """The law of the least work, who is as good, and what the clock says against it."""
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
    """The one with second derivatives that climbs least; bristles where there is no other."""
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
    """What a step of the law costs in C."""
    return row.core if counted else float(row.c_operations or 0)


def _states(row: Row) -> str:
    return f"{row.states} state{'s' if row.states != 1 else ''}"


def _others(rows: Sequence[Row]) -> str:
    """How many fell out, by the reason."""
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
