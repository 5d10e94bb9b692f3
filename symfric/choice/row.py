"""What was measured of one law, and where it stands."""

from dataclasses import asdict, dataclass
from math import isfinite
from typing import Any, final

RANKED, INACCURATE, LACKING, REFUSED, FAILED = (
    "ranked", "inaccurate", "lacks", "cannot run", "failed",
)  # fmt: skip
"""Standings: ranked by time; does not keep the accuracy; does not show what is needed; the machine
does not take it; its run fails."""
ORDER = (RANKED, INACCURATE, LACKING, FAILED, REFUSED)


@final
@dataclass(frozen=True)
class Row:
    """One law.

    Attributes:
        law: its name.
        form: the form that it has in place of the one that it comes in, such as "event"; "" for
            that one.
        standing: one of `ORDER`; `reason` says why it is not ranked.
        phenomena: codes of `symfric.laws.PHENOMENA`.
        error: largest difference from the reference relative to the motion; NaN without a run.
        values: what to give the law: all parameters that it does not come with, of several places
            that rub those of the first.
        rtol, method, attempts, instructions: of the run at equal error: relative tolerance, method,
            attempts of a step, CasADi instructions of one.
        time_s: processor time of that run [s] in CasADi's virtual machine, the shortest of several.
        fixed_step: largest step [s] at which the plant in fixed steps of backward Euler stays
            within `control` of the motion; `fixed_why` says what is known where there is none.
        explicit_step: likewise of an explicit Runge-Kutta method of order 5.
        steepness: largest slope of the force over velocity of the law at equal error, relative to
            its level [s/m]: what an optimiser has to climb; NaN where the force jumps.
        smoothness: class in the velocity, with the widths that it has.
        parameters, hard: how many parameters have a physical meaning, and which of these need more
            than a pull and steady sliding.
        c_operations: of the law's step in C, all parameters constants, single precision;
            `c_why` where there is none.
        states: how many internal ones.
        curve: (error, processor time [s]) of the runs on the way, softest first.
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

    @property
    def ranked(self) -> bool:
        """It shows what is needed and keeps the accuracy."""
        return self.standing == RANKED

    @property
    def called(self) -> str:
        """The law with its form."""
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


def ordered(rows: list[Row]) -> list[Row]:
    """The best first: those that are ranked by time, others by what they miss."""

    def key(row: Row) -> tuple[int, float, str]:
        value = row.time_s if row.ranked else row.error
        return ORDER.index(row.standing), value if isfinite(value) else 1e300, row.law

    return sorted(rows, key=key)
