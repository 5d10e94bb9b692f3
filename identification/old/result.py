"""The result of an identification: parameters with their uncertainty, errors, the fitted drive."""

import json
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

from identification.old.data import Array
from identification.old.errors import Errors
from identification.old.filters import Filter
from identification.old.regress import LinearFit
from identification.old.signals import MotionSignals
from symfric.foundation.files import write_text
from symfric.foundation.status import Status
from symfric.laws import Law
from symfric.scenes import Drive

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Z95 = 1.959964


@final
@dataclass(frozen=True)
class Estimate:
    """One parameter with its uncertainty.

    Attributes:
        value, unit: the estimate.
        standard_error: of the fit, for white residuals; None where the parameter is fixed, stands
            at a bound or cannot be told from others.
        block_error: the same from the scatter over blocks of the record, which holds for
            correlated residuals too.
        fixed: not fitted.
        note: why it is fixed or has no standard error.
    """

    value: float
    unit: str
    standard_error: float | None = None
    block_error: float | None = None
    fixed: bool = False
    note: str = ""

    @property
    def half_width(self) -> float | None:
        """Half the 95 % interval: 1.96 times the larger of the two errors."""
        if self.standard_error is None or self.block_error is None:
            return None
        return Z95 * max(self.standard_error, self.block_error)

    @property
    def lower95(self) -> float | None:
        """Lower end of the 95 % interval."""
        return None if self.half_width is None else self.value - self.half_width

    @property
    def upper95(self) -> float | None:
        """Upper end of the 95 % interval."""
        return None if self.half_width is None else self.value + self.half_width

    def times(self, factor: float, unit: str) -> "Estimate":
        """The estimate of `factor` times this quantity."""
        errors = [e if e is None else factor * e for e in (self.standard_error, self.block_error)]
        return Estimate(factor * self.value, unit, errors[0], errors[1], self.fixed, self.note)

    def to_dict(self) -> dict[str, Any]:
        """Everything by name; absent numbers are None."""
        return {
            "value": self.value,
            "standard_error": self.standard_error,
            "block_error": self.block_error,
            "unit": self.unit,
            "lower95": self.lower95,
            "upper95": self.upper95,
            "fixed": self.fixed,
            "note": self.note,
        }


@final
@dataclass(frozen=True, eq=False)
class Identification:
    """What `identify` found.

    Attributes:
        law: name of the law.
        drive: the scene with the identified law, mass and offset; `drive.model()` simulates.
        parameters: name -> estimate of every parameter of drive and law.
        levels: friction coefficient name -> force level mu N [N]. With the normal force N = 1 N
            of an unknown load only these mean something, and mu reads as newtons.
        names, correlation: fitted parameters and the correlation of their estimates, shape (n, n).
        undetermined: groups of parameters that the data cannot tell apart.
        status, message: how the solver ended.
        errors: on the estimation record.
        validation: on the second record, with the same parameters and filter; None without one.
        cross_validation: force errors [%] on pieces of the estimation record left out of the fit:
            "force_relative" over all pieces together and "worst"; empty if not asked for.
        linear: the linear least-squares fit (mass, Coulomb, viscous, offset) the fit started from.
        filter: cut-off and decimation used on both records.
        iterations: of the solver.
        benchmark: name of the public benchmark of the record, or "".
        signals: differentiated estimation record.
    """

    law: str
    drive: Drive
    parameters: dict[str, Estimate]
    levels: dict[str, Estimate]
    names: tuple[str, ...]
    correlation: Array
    undetermined: tuple[tuple[str, ...], ...]
    status: Status
    message: str
    errors: Errors
    validation: Errors | None
    cross_validation: dict[str, float]
    linear: LinearFit
    filter: Filter
    iterations: int
    benchmark: str
    signals: MotionSignals

    @property
    def fitted_law(self) -> Law:
        """The law with the identified parameters."""
        return self.drive.law

    def report(self) -> str:
        """Parameters, errors and limits as Markdown tables."""
        from identification.old.report import report  # noqa: PLC0415  (report.py knows this class)

        return report(self)

    def to_dict(self) -> dict[str, Any]:
        """Everything but the signals as plain data, ready for JSON."""
        return {
            "law": self.law,
            "status": self.status.name,
            "message": self.message,
            "iterations": self.iterations,
            "parameters": {name: e.to_dict() for name, e in self.parameters.items()},
            "levels": {name: e.to_dict() for name, e in self.levels.items()},
            "correlation": {
                "names": list(self.names),
                "matrix": [[c if isfinite(c) else None for c in row] for row in self.correlation],
            },
            "undetermined": [list(group) for group in self.undetermined],
            "errors": self.errors.to_dict(),
            "validation": None if self.validation is None else self.validation.to_dict(),
            "cross_validation": self.cross_validation,
            "linear": {
                "values": self.linear.values,
                "standard_errors": self.linear.standard_errors,
                "force_relative": self.linear.force_relative,
                "force_rms": self.linear.force_rms,
            },
            "filter": {"cutoff": self.filter.cutoff, "decimation": self.filter.decimation},
            "units": {"force_relative": "%", "force_rms": "N", "position_rms": "m", "cutoff": "Hz"},
            "benchmark": self.benchmark,
        }

    def to_json(self, path: str | Path) -> None:
        """Write `to_dict` as JSON."""
        write_text(path, json.dumps(self.to_dict(), allow_nan=False, indent=2))

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Friction over velocity, force over time and what the law leaves unexplained.

        Args:
            path: image file.
        """
        from identification.old.picture import picture  # noqa: PLC0415  (matplotlib is slow to import)

        return picture(self, path)
