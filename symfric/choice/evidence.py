"""The paper's tables beside ours in eighty columns, and what cannot be reproduced, with numbers."""

from collections.abc import Iterator
from math import isfinite
from textwrap import wrap
from typing import TYPE_CHECKING

from symfric.choice.text import WIDTH

if TYPE_CHECKING:
    from symfric.choice.jing_mi import PaperComparison, PaperRow

PAPER = "Jing and Mi, Investigation of Selection Mechanism of Friction Models in Multibody Systems"
STEP = 1e-6
"""Printed step size [s]."""
HEAD = (
    f"{'':<15}{'T [s]':>8}{'time [ms]':>11}{'tries':>8} |"
    f"{'S [cm]':>8}{'equal':>8}{'steps':>8}{'BDF':>8}"
)


def lines(found: "PaperComparison") -> list[str]:
    """All of it."""
    lacking = [f"{row.name}: {row.reason}" for row in found.rows if not isfinite(row.time_s)]
    texts = [
        [LEGEND, *lacking],
        [f"{found.ranks}: laws by printed and by our numbers, the smallest first"],
        reasons(found),
    ]
    first, ranks, last = ([line for t in text for line in wrap(t, WIDTH)] for text in texts)
    title = f"{PAPER}: {found.scene}, {found.times}"
    rows = map(_line, found.rows)
    return [
        *wrap(title, WIDTH), "", HEAD, *rows, "", *first, "", *ranks, *_orders(found), "", *last,
    ]  # fmt: skip


LEGEND = (
    "T, S: printed. time, tries: processor time and attempts of our run whose integrator is 1e-4 "
    "off. equal, steps, BDF: S over equal times, over our steps, and over those of SciPy's BDF, "
    "the relative of ode15s, with the paper's absolute tolerance; explicit equations only."
)


def _line(row: "PaperRow") -> str:
    T = "> 100" if row.T > 1e300 else f"{row.T:.2f}"
    spread = (row.S_uniform, row.S_steps, row.S_peer)
    time = f"{1e3 * row.time_s:.2f}" if isfinite(row.time_s) else "-"
    shown = "".join(f"{100 * s:>8.2f}" if isfinite(s) else f"{'-':>8}" for s in spread)
    tries = row.attempts or "-"
    return f"{row.name:<15}{T:>8}{time:>11}{tries:>8} |{100 * row.S:>8.2f}{shown}"


def _orders(found: "PaperComparison") -> Iterator[str]:
    for column, orders in found.orders().items():
        for by, names in orders.items():
            text = f"{column:<6}{by:<10} {' < '.join(names)}"
            yield from wrap(text, WIDTH, subsequent_indent=17 * " ")


def reasons(found: "PaperComparison") -> list[str]:
    """Why printed numbers cannot be had again: sentences with what was measured."""
    return [text for text in (_of_times(found), _of_spread(found), _of_ranks(found), OPEN) if text]


def _of_times(found: "PaperComparison") -> str:
    printed = [row.T for row in found.rows if isfinite(row.T)]
    ours = [row.time_s for row in found.rows if isfinite(row.time_s)]
    if not ours:
        return ""
    count = found.t_end / STEP
    steps = [row.explicit_step for row in found.rows if row.explicit_step]
    able = "; no explicit method takes this machine, whose reactions are unknowns of its equations"
    if steps:
        able = (
            f"; explicit steps of {min(steps):g} to {max(steps):g} s follow within 5 % for "
            f"{len(steps)} of {len(found.rows)} laws"
        )
    return (
        f"T: the table of the machine says Runge-Kutta with steps of {STEP:g} s, which are "
        f"{count:.2g} steps, {1e9 * min(printed) / count:.0f} ns each in the fastest run; the text "
        f"says ode15s, which chooses its steps{able}. Printed times span a factor "
        f"of {max(printed) / min(printed):.0f}, ours at equal error "
        f"{max(ours) / min(ours):.0f}. Processor and program are not named."
    )


def _of_spread(found: "PaperComparison") -> str:
    known = [row for row in found.rows if isfinite(row.S_uniform) and isfinite(row.S_steps)]
    if not known:
        return ""
    most = max(known, key=lambda row: abs(row.S_steps / row.S_uniform - 1))
    off = {
        "equal times": [abs(row.S_uniform / row.S - 1) for row in known],
        "our steps": [abs(row.S_steps / row.S - 1) for row in known],
    }
    said = ", ".join(
        f"{100 * min(each):.0f} to {100 * max(each):.0f} % over {what}"
        for what, each in off.items()
    )
    return (
        "S is the standard deviation of x over the points that a solver returns, an amplitude and "
        f"no measure of stability: one motion of {most.name} has {100 * most.S_uniform:.1f} cm "
        f"over equal times and {100 * most.S_steps:.1f} cm over our steps. What is printed is "
        f"{said} away."
    )


def _of_ranks(found: "PaperComparison") -> str:
    orders = found.orders().items()
    same = {
        by: [column for column, each in orders if each[f"printed {by}"] == each[ours]]
        for by, ours in (("T", "our time"), ("S", "S steps"))
    }
    said = [
        f"the order by {by} is ours in {', '.join(columns) or 'no column'}"
        for by, columns in same.items()
    ]
    return f"Ranks: {'; '.join(said)}."


OPEN = (
    "Not printed: who takes which velocity of tables 3 and 7 (the presets say how they are read "
    "here), Gonthier's v_d, the radius of the hinge in which table 7's N/m and m/s act, relative "
    "tolerances, initial conditions beyond positions. z_max = z_ba in table 7 leaves the "
    "elasto-plastic law of that form 0/0; here z_ss follows from sigma_0. The text contradicts its "
    "tables: for pre-sliding by S it chooses Elasto-plastic in both machines, table 5 has Dahl "
    "first; and it compares three machines, of which one, with its tables, is missing."
)
