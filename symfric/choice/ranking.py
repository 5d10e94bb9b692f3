"""Measurements of laws, and their ranks."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from math import inf, isfinite
from typing import Any, final

from symfric.foundation.checks import check_names

RANKED, INACCURATE, LACKING, REFUSED, FAILED = (
    "ranked", "inaccurate", "lacks", "cannot run", "failed",
)  # fmt: skip
"""Standings: meets all requirements; is less accurate, because it moves otherwise or for reasons
that are not decided; lacks a needed phenomenon; cannot run on the machine; its run fails."""
ORDER = (RANKED, INACCURATE, LACKING, FAILED, REFUSED)
ALIKE = 1.1
"""Work within this ratio is the same: attempts differ by so much with a digit of a tolerance."""


@final
@dataclass(frozen=True)
class Row:
    """One law.

    Attributes:
        law: its name.
        form: the form that it has in place of the one that it comes in, such as "event"; "" for
            that one.
        standing: one of `ORDER`; `reason` says why it is not the first of these.
        rank: place among all that run, 1 for the best; the same for ties; 0 for one that does not.
        phenomena: codes of `symfric.laws.PHENOMENA`.
        error: largest difference from the reference relative to the motion; NaN without a run.
        own_error: that from the finest run of the law itself: the integrator's part.
        smoothing: factor of widths and bristles of the law that was timed.
        values: what to give the law: all parameters that it does not come with, of several places
            that rub those of the first.
        rtol, method, attempts, instructions: of the run at equal error: relative tolerance, method,
            attempts of a step, CasADi instructions of one (`continuation.counted`). Equal are
            errors from the reference where the law is ranked, and its own where it is not.
        time_s: processor time of that run [s] in CasADi's virtual machine, the shortest of several.
        fixed_step: largest step [s] at which the plant in fixed steps of backward Euler stays
            within `control` of the motion; `fixed_why` says what is known where there is none.
        explicit_step: likewise of an explicit Runge-Kutta method of order 5.
        steepness: largest slope of the force over velocity of the law at equal error, relative to
            its level [s/m]: the slope that an optimiser meets; NaN where the force jumps.
        smoothness: class in the velocity, with the widths that it has.
        parameters, hard: how many parameters have a physical meaning, and which of these need more
            than a pull and steady sliding.
        c_operations: of the law's step in C, all parameters constants, single precision;
            `c_why` where there is none.
        core: instructions of that step on a Cortex-M4F, in the mean over a day of a drive; NaN, and
            `core_why`, where it was not measured.
        spent: its runs used up all that they may cost.
        states: how many internal ones.
        curve: (error, work) of the runs on the way, softest first.
    """

    law: str
    standing: str
    reason: str = ""
    phenomena: tuple[str, ...] = ()
    error: float = float("nan")
    values: dict[str, float] | None = None
    rtol: float = float("nan")
    method: str = ""
    attempts: int = 0
    instructions: int = 0
    time_s: float = float("nan")
    fixed_step: float | None = None
    fixed_why: str = ""
    explicit_step: float | None = None
    explicit_why: str = ""
    steepness: float = float("nan")
    smoothness: str = ""
    parameters: int = 0
    hard: tuple[str, ...] = ()
    c_operations: int | None = None
    c_why: str = ""
    states: int = 0
    curve: tuple[tuple[float, float], ...] = ()
    form: str = ""
    rank: int = 0
    own_error: float = float("nan")
    smoothing: float = float("nan")
    core: float = float("nan")
    core_why: str = ""
    spent: bool = False

    @property
    def ranked(self) -> bool:
        """True if the law shows what is needed and keeps the accuracy."""
        return self.standing == RANKED

    @property
    def called(self) -> str:
        """Law with its form."""
        return f"{self.law} (form = {self.form})" if self.form else self.law

    @property
    def work(self) -> int:
        """Instructions of the whole run: what its time is made of, on any machine."""
        return self.attempts * self.instructions

    def to_dict(self) -> dict[str, Any]:
        """Plain data; numbers that are none are null."""
        found = asdict(self) | {"work": self.work, "curve": [list(pair) for pair in self.curve]}
        return {
            n: None if isinstance(v, float) and not isfinite(v) else v for n, v in found.items()
        }


def ordered(rows: Iterable[Row]) -> list[Row]:
    """Return the best first, with their ranks: by work what does all that is asked, others by their
    error.

    Nothing that a clock says decides: the same rows come in the same order on every run.
    """
    found = list[Row]()
    head, rank = None, 0
    for row in sorted(rows, key=place):
        if not row.attempts:
            found.append(replace(row, rank=0))
            continue
        if head is None or not _tied(head, row):
            head, rank = row, len(found) + 1
        found.append(replace(row, rank=rank))
    return found


def best_of(rows: Sequence[Row]) -> Row:
    """Return the first of them, were they ordered."""
    return min(rows, key=place)


def place(row: Row) -> tuple[int, float, float, str]:
    """Key by which rows are ordered: errors to a digit, work to the last."""
    error = float(f"{row.error:.0e}") if isfinite(row.error) else inf
    return ORDER.index(row.standing), 0.0 if row.ranked else error, row.work or inf, row.law


def _tied(head: Row, row: Row) -> bool:
    """Test for a `row` as good as the first of its rank."""
    return place(head)[:2] == place(row)[:2] and row.work <= ALIKE * head.work


@dataclass(frozen=True, eq=False)
class Ranking:
    """Laws on a machine, the best first, and what was asked of them.

    Attributes:
        machine: its name.
        needs: what the law has to show, words of `NEEDS`.
        accuracy: largest error relative to the motion.
        friction: that all laws describe.
        reference, uncertain: what errors are measured from, and how far that may be off itself.
        control: largest error of fixed steps.
        t_end: length of the motion [s].
        rows: one for each candidate.
        wall_s: how long it took [s].
        unmeasured: laws without a row, because it was interrupted.
    """

    machine: str
    needs: tuple[str, ...]
    accuracy: float
    friction: str
    reference: str
    uncertain: float
    control: float
    t_end: float
    rows: tuple[Row, ...]
    wall_s: float
    unmeasured: tuple[str, ...] = ()

    def __getitem__(self, law: str) -> Row:
        """Return the row of a law."""
        found = {row.law: row for row in self.rows}
        check_names("choice", [law], found)
        return found[law]

    def __iter__(self) -> Iterator[Row]:
        return iter(self.rows)

    @property
    def interrupted(self) -> bool:
        """True if an interrupt came before all laws were measured."""
        return bool(self.unmeasured)

    @property
    def placed(self) -> tuple[Row, ...]:
        """Rows of all laws that run here, by their rank."""
        return tuple(row for row in self.rows if row.rank)

    @property
    def ranked(self) -> tuple[Row, ...]:
        """Rows of laws that show what is needed and keep the accuracy, least work first."""
        return tuple(row for row in self.rows if row.ranked)

    @property
    def best(self) -> Row | None:
        """First of them; None where there is none."""
        return next(iter(self.ranked), None)

    @property
    def title(self) -> str:
        """Question in a line."""
        asked = f"laws that show {' and '.join(self.needs)}" if self.needs else "all laws"
        return f"{self.machine}: {asked}, {self.accuracy:g} off at most"
