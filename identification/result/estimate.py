"""One parameter of a fit with its uncertainty, and what a fit leaves of one signal."""

from dataclasses import dataclass
from math import nan
from typing import final

from symfric.foundation.status import Status


@final
@dataclass(frozen=True)
class Estimate:
    """One parameter, start value or dead time.

    Attributes:
        value, unit: the estimate, in the unit of the user.
        standard_error: right for the colour that the residuals have; None where the parameter is
            held, stands at a bound or cannot be told from others.
        low, high: 95 % interval; of what is fitted by its logarithm it is symmetric there, so that
            a stiffness stays positive. None with `standard_error`.
        white_error: what the standard error would be if residuals were white: much less than
            `standard_error` where neighbouring samples say the same.
        fixed: not fitted.
        note: why it is held or has no interval; or what it is tied to.
        nuisance: fitted, but not what is asked for: a start value, a dead time.
    """

    value: float
    unit: str
    standard_error: float | None = None
    low: float | None = None
    high: float | None = None
    white_error: float | None = None
    fixed: bool = False
    note: str = ""
    nuisance: bool = False

    @property
    def relative_error(self) -> float | None:
        """Standard error over the magnitude of the value [%]; None at zero or without an error."""
        if self.standard_error is None or self.value == 0.0:
            return None
        return 100.0 * self.standard_error / abs(self.value)


@final
@dataclass(frozen=True)
class Error:
    """What a fit leaves of one signal of one record.

    Attributes:
        unit: of the signal.
        rms: root mean square of predicted - measured.
        relative: norm of the difference over the norm of the signal [%], as the EMPS benchmark
            has it; it says little of a signal far from zero, such as a position with an offset.
        largest: largest magnitude of the difference.
        rows: number of differences.
        effective: how many independent ones they count as, by their colour; NaN where unknown.
    """

    unit: str
    rms: float
    relative: float
    largest: float
    rows: int
    effective: float = nan


@final
@dataclass(frozen=True)
class Tried:
    """One start and where it ended.

    Attributes:
        number: of the start.
        above: minus twice the logarithm of its likelihood over that of the best one; below 1 the
            two are the same minimum.
        cost: sum of weighted squares, or of the robust losses.
        status, message: how it ended.
        evaluations: of the residuals.
        values: where it ended.
    """

    number: int
    above: float
    cost: float
    status: Status
    message: str
    evaluations: int
    values: dict[str, float]


Errors = dict[tuple[str, str], Error]
"""(record, signal) -> what is left of it."""
