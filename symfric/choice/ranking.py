"""Measurements and ranks of laws, with the recommendations and the table in text form."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from math import inf, isfinite, nan
from textwrap import wrap
from typing import Any, final

from symfric.choice.nature import EVENT
from symfric.foundation.checks import check_names
from symfric.foundation.files import json_data

RANKED, INACCURATE, LACKING, REFUSED, FAILED = (
    "ranked", "inaccurate", "lacks", "cannot run", "failed",
)  # fmt: skip
"""Standings of a law: it meets all requirements; it does not satisfy the accuracy; it lacks a
required phenomenon; the machine rejects it; its run fails."""
ORDER = (RANKED, INACCURATE, LACKING, FAILED, REFUSED)
ALIKE = 1.1
"""Ratio of work up to which laws share a rank; small changes of tolerances have this effect."""
FASTER = 1.25
"""Ratio of times above which the verdict mentions a law that is faster but takes more work."""


@final
@dataclass(frozen=True)
class RankedLaw:
    """Measurements of one law.

    Attributes:
        law: name of the law.
        form: form of the law if it is not the default form, such as "event".
        standing: one of `ORDER`; `reason` explains all but the first.
        rank: rank among all laws that run, starting at 1; equal for ties; 0 for a law without run.
        phenomena: codes of `symfric.laws.PHENOMENA`.
        error: largest difference from the reference relative to the motion; NaN without a run.
        own_error: largest difference from the finest run of the law itself, which is the error of
            the integrator.
        smoothing: factor by which widths and bristles of the law were scaled.
        values: parameters that differ from the defaults of the law; those of the first contact if
            there are several.
        rtol, method, attempts, instructions: properties of the run at equal error: relative
            tolerance, method, attempted steps, and CasADi instructions per attempt
            (`continuation.counted`). For ranked laws the equal error is `error`, for all others
            `own_error`.
        time_s: processor time of that run [s] in CasADi's virtual machine, the shortest of several.
        fixed_step: largest fixed step [s] of backward Euler with which the plant stays within
            `control` of the motion; `fixed_why` explains None.
        explicit_step, explicit_why: the same for an explicit Runge-Kutta method of order 5.
        steepness: largest slope of the force over velocity, relative to the force [s/m], of the law
            at equal error; NaN if the force jumps.
        smoothness: class of smoothness in the velocity with the scaled widths.
        parameters, hard: number of physical parameters, and names of those that cannot be measured
            in a pull test and in steady sliding.
        c_operations: operations of a step of the law in C, with constant parameters, in single
            precision; `c_why` explains None.
        core: instructions of that step on a Cortex-M4F, averaged over a typical drive; `core_why`
            explains NaN.
        spent: True if the runs exhausted their budget.
        states: number of internal states.
        curve: (error, work) of the runs of the continuation, starting with the smoothest.
    """

    law: str
    standing: str
    reason: str = ""
    phenomena: tuple[str, ...] = ()
    error: float = nan
    values: dict[str, float] | None = None
    rtol: float = nan
    method: str = ""
    attempts: int = 0
    instructions: int = 0
    time_s: float = nan
    fixed_step: float | None = None
    fixed_why: str = ""
    explicit_step: float | None = None
    explicit_why: str = ""
    steepness: float = nan
    smoothness: str = ""
    parameters: int = 0
    hard: tuple[str, ...] = ()
    c_operations: int | None = None
    c_why: str = ""
    states: int = 0
    curve: tuple[tuple[float, float], ...] = ()
    form: str = ""
    rank: int = 0
    own_error: float = nan
    smoothing: float = nan
    core: float = nan
    core_why: str = ""
    spent: bool = False

    @property
    def ranked(self) -> bool:
        """True if the law shows the required phenomena and satisfies the accuracy."""
        return self.standing == RANKED

    @property
    def called(self) -> str:
        """Name of the law, followed by its form if that is not the default."""
        return f"{self.law} (form = {self.form})" if self.form else self.law

    @property
    def work(self) -> int:
        """Number of instructions of the whole run, which does not depend on the computer."""
        return self.attempts * self.instructions

    def to_dict(self) -> dict[str, Any]:
        """Return plain data; NaN and infinity are None."""
        return json_data(asdict(self) | {"work": self.work})


def ordered(rows: Iterable[RankedLaw]) -> list[RankedLaw]:
    """Return the rows with ranks, sorted from best to worst: ranked laws by work, others by error.

    The order does not depend on measured times and is therefore reproducible.
    """
    result = list[RankedLaw]()
    head, rank = None, 0
    for row in sorted(rows, key=place):
        alike = head is not None and place(head)[:2] == place(row)[:2]
        if row.attempts and not (head and alike and row.work <= ALIKE * head.work):
            head, rank = row, len(result) + 1
        result.append(replace(row, rank=rank if row.attempts else 0))
    return result


def place(row: RankedLaw) -> tuple[int, float, float, str]:
    """Return the key by which rows are sorted, with errors rounded to one digit."""
    error = float(f"{row.error:.0e}") if isfinite(row.error) else inf
    return ORDER.index(row.standing), 0.0 if row.ranked else error, row.work or inf, row.law


@dataclass(frozen=True, eq=False)
class Ranking:
    """Laws in a machine, sorted from best to worst, and the requirements.

    Attributes:
        machine: name of the machine.
        needs: required phenomena, words of `NEEDS`.
        accuracy: largest allowed error relative to the motion.
        friction: description of the friction that all laws describe.
        reference, uncertain: description of the reference motion, and its uncertainty.
        control: largest allowed error of fixed steps.
        t_end: length of the motion [s].
        rows: row of each candidate.
        wall_s: duration of the measurements [s].
        unmeasured: laws that were not measured because of an interrupt.
    """

    machine: str
    needs: tuple[str, ...]
    accuracy: float
    friction: str
    reference: str
    uncertain: float
    control: float
    t_end: float
    rows: tuple[RankedLaw, ...]
    wall_s: float
    unmeasured: tuple[str, ...] = ()

    def __getitem__(self, law: str) -> RankedLaw:
        """Return the row of a law."""
        rows = {row.law: row for row in self.rows}
        check_names("choice", [law], rows)
        return rows[law]

    def __iter__(self) -> Iterator[RankedLaw]:
        return iter(self.rows)

    @property
    def interrupted(self) -> bool:
        """True if an interrupt occurred before all laws were measured."""
        return bool(self.unmeasured)

    @property
    def placed(self) -> tuple[RankedLaw, ...]:
        """Rows of all laws that run, by rank."""
        return tuple(row for row in self.rows if row.rank)

    @property
    def ranked(self) -> tuple[RankedLaw, ...]:
        """Rows of laws that meet all requirements, sorted by work."""
        return tuple(row for row in self.rows if row.ranked)

    @property
    def best(self) -> RankedLaw | None:
        """Row of the first ranked law; None if no law is ranked."""
        return next(iter(self.ranked), None)

    @property
    def title(self) -> str:
        """Machine and requirements in one line."""
        laws = f"laws that show {' and '.join(self.needs)}" if self.needs else "all laws"
        return f"{self.machine}: {laws}, {self.accuracy:g} off at most"

    @property
    def verdict(self) -> tuple[str, ...]:
        """Recommendations for simulation, optimal control and controllers, and the omitted laws."""
        if not self.rows:
            return ("Nothing was measured.",)
        shown = " and ".join(self.needs) or "friction"
        if ranked := self.ranked:
            uses = _simulation(ranked, shown), _smooth(ranked), _controller(ranked, self.control)
        else:
            near = [row for row in self.rows if row.standing == INACCURATE]
            best = min(near, key=lambda row: row.error, default=None)
            nearest = f"; {best.called} comes nearest, {best.reason}" if best else ""
            uses = (f"No law shows {shown} and keeps {self.accuracy:g}{nearest}.",)
        standings = [row.standing for row in self.rows]
        left = [f"{standings.count(name)} {text}" for name, text in LEFT_OUT if name in standings]
        out = f"Left out of {len(self.rows)}: {_listed(left)}." if left else "None is left out."
        return *uses, out


LEFT_OUT = (
    (LACKING, "for what they show"),
    (INACCURATE, "that do not keep the accuracy"),
    (FAILED, "whose run fails"),
    (REFUSED, "that do not fit into this machine"),
)
"""Standings of laws that are not ranked, and their description in the verdict."""


def _simulation(ranked: Sequence[RankedLaw], shown: str) -> str:
    """Recommend the law with the least work; mention ties and a law that takes less time."""
    best = ranked[0]
    text = (
        f"Simulation: take {best.called}, the least work of {len(ranked)} that show {shown} and "
        f"keep the accuracy: {1e3 * best.time_s:.3g} ms in {best.attempts} attempts by "
        f"{best.method}, {best.error:.1e} off"
    )
    ties = [row.called for row in ranked[1:] if row.rank == best.rank]
    if ties:
        text += f"; {_listed(ties)} {'are' if len(ties) > 1 else 'is'} as good"
    elif len(ranked) > 1:
        text += f"; {ranked[1].called} takes {ranked[1].work / best.work:.2g} times the work"
    fastest = min(ranked, key=lambda row: row.time_s)
    if fastest.rank != best.rank and FASTER * fastest.time_s < best.time_s:
        text += f". By the clock {fastest.called} is faster, {1e3 * fastest.time_s:.3g} ms"
    return f"{text}."


def _smooth(ranked: Sequence[RankedLaw]) -> str:
    """Recommend the least steep law with second derivatives, or the first one with states."""
    smooth = [row for row in ranked if row.smoothness in ("C2", "C∞")]
    if not smooth:
        first = ranked[0]
        kind = "switches by events" if first.form == EVENT else f"is {first.smoothness}"
        return f"Optimal control: none of them has second derivatives; {first.called} {kind}."
    steep = [row for row in smooth if isfinite(row.steepness)]
    take = min(steep, key=lambda row: row.steepness, default=smooth[0])
    text = f"Optimal control: take {take.called} ({take.smoothness})"
    if not steep:
        return f"{text}, with {take.states} state{'s' if take.states != 1 else ''}."
    return (
        f"{text}: of those with second derivatives its force is the least steep, "
        f"{take.steepness:.2g} of its level per m/s."
    )


def _controller(ranked: Sequence[RankedLaw], control: float) -> str:
    """Recommend the law with the fewest operations per second of motion in fixed steps."""
    if not any(row.fixed_step or row.fixed_why for row in ranked):
        return "Controller: fixed steps were not measured."
    able = [row for row in ranked if row.fixed_step is not None and row.c_operations is not None]
    if not able:
        return (
            f"Controller: none of them follows within {control:g} in fixed steps that were tried."
        )
    counted = all(isfinite(row.core) for row in able)
    costs = {row.law: row.core if counted else float(row.c_operations or 0) for row in able}
    take = min(able, key=lambda row: costs[row.law] / (row.fixed_step or 1.0))
    unit = "instructions on a Cortex-M4F" if counted else "operations"
    return (
        f"Controller: take {take.called}: its C takes {costs[take.law]:.0f} {unit}, and with "
        f"it the plant stays within {control:g} in steps of {take.fixed_step:g} s (backward "
        "Euler): the least for a second of motion."
    )


def _listed(names: Sequence[str]) -> str:
    return " and ".join(part for part in (", ".join(names[:-1]), *names[-1:]) if part)


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
"""Headings of the groups of laws by standing; laws of other standings did not run."""


def lines(choice: Ranking, most: int | None = None) -> Iterator[str]:
    """Yield the lines of title, reference, table, reasons and verdict.

    With `most` the table has at most that many rows, all of ranked laws, and reasons are omitted.
    """
    yield choice.title
    yield from wrap(
        f"{choice.friction}; from {choice.reference}, itself known to {choice.uncertain:.0e}", WIDTH
    )
    yield ""
    cores = any(isfinite(row.core) for row in choice.rows)
    yield HEAD if cores else HEAD.replace("M4F", "  C")
    shown = choice.rows if most is None else choice.ranked[:most]
    ranks = [row.rank for row in choice.rows]
    for standing, text in STANDING_TEXTS.items():
        group = [row for row in shown if row.standing == standing and row.rank]
        if group and most is None:
            yield f"-- {text}"
        for row in group:
            yield _line(row, "=" if ranks.count(row.rank) > 1 else " ", cores)
    if most is not None and most < len(choice.placed):
        yield f"... and {len(choice.placed) - len(shown)} more that ran"
    yield ""
    if most is None:
        reasons = defaultdict[str, list[str]](list)
        for row in (row for row in choice.rows if not row.ranked):
            why = row.reason.removeprefix(f"{row.law} ").removeprefix(f"{row.error:.1e} off: ")
            reasons[f"{row.standing}, {why}"].append(row.called)
        for reason, names in reasons.items():
            text = f"{reason}: {', '.join(names)}"
            yield from wrap(text, WIDTH, subsequent_indent="    ", break_on_hyphens=False)
        yield ""
    for sentence in (*choice.verdict, *interruption(choice)):
        yield from wrap(sentence, WIDTH)


def interruption(choice: Ranking) -> list[str]:
    """Return a sentence on the laws that were not measured; empty without an interrupt."""
    count, names = len(choice.unmeasured), ", ".join(choice.unmeasured)
    text = f"Interrupted: {count} of {count + len(choice.rows)} laws were not measured: {names}."
    return [text] if choice.interrupted else []


def _line(row: RankedLaw, tie: str, cores: bool) -> str:
    counts = f"{row.core:.0f}" if isfinite(row.core) else "-"
    if not cores:
        counts = "-" if row.c_operations is None else str(row.c_operations)
    return (
        f"{row.rank:>2}{tie} {row.law:<19}{number(1e-6 * row.work):>6}"
        f"{number(1e3 * row.time_s):>6}{short(row.error):>7}{short(row.own_error):>6}"
        f"{short(row.fixed_step):>6}{counts:>5}{f'{row.parameters}/{len(row.hard)}':>6} "
        f"{row.smoothness:<5} {''.join(row.phenomena)}"
    )


def number(value: float, digits: int = 3) -> str:
    """Return a number >= 0 as text with about three digits; a dash for NaN and inf."""
    if not isfinite(value):
        return "-"
    if value >= 10 ** (digits - 1):
        return f"{value:.0f}"
    return f"{value:.{digits}g}" if value >= 0.1 else f"{value:.2f}"


def short(value: float | None) -> str:
    """Return a number in exponential notation with one digit; a dash for None, NaN and inf."""
    if value is None or not isfinite(value):
        return "-"
    return f"{value:.0e}".replace("e-0", "e-").replace("e+00", "")
