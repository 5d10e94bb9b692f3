"""What a re-simulation says about a solution: by how much it misses what, and when."""

from dataclasses import dataclass
from math import isfinite
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.shown import brief
from symfric.foundation.status import Status
from symfric.foundation.storable import agree
from symfric.results.trajectory import Trajectory

Array = NDArray[np.float64]


@final
@dataclass(frozen=True)
class Miss:
    """One thing that was asked for, and what the re-simulated motion makes of it.

    Attributes:
        what: "start", "end", "via", "joint", "period": something to meet; "bound" or "path":
            something to keep, where it is kept worst; "motion": a state at the end of a phase
            against its optimised value; "cost"; "local error": of the worst interval.
        name: of the signal, or of the condition.
        time: when [s].
        value: what it is there.
        wanted: the nearest value that would do.
        size: magnitude that the difference is relative to.
        unit: of the values.
    """

    what: str
    name: str
    time: float
    value: float
    wanted: float
    size: float
    unit: str = ""

    @property
    def miss(self) -> float:
        """The difference; zero where all is well."""
        return self.value - self.wanted

    @property
    def relative(self) -> float:
        """The difference in multiples of `size`; inf for what is no number."""
        found = abs(self.miss) / self.size if self.size > 0 else abs(self.miss)
        return found if isfinite(found) else float("inf")

    @property
    def sentence(self) -> str:
        """What is missed, when and by how much."""
        unit = f" {self.unit}" if self.unit not in ("", "1") else ""
        if self.what == "local error":
            return f"the interval at {self.time:.4g} s errs by {self.relative:.2g} by itself"
        if self.what == "cost":
            return f"the cost is {self.value:.6g}, not {self.wanted:.6g}"
        amount = f"{abs(self.miss):.3g}{unit}"
        if self.what == "motion":
            return f"{self.name} is {amount} away from its optimised value at {self.time:.4g} s"
        if self.what in ("bound", "path"):
            return f"{self.name} is left by {amount} at {self.time:.4g} s"
        return f"{self.name} misses {self.wanted:.4g}{unit} at {self.time:.4g} s by {amount}"


@final
@dataclass(frozen=True, eq=False)
class Verification:
    """A solution against a tight simulation of the user's model under its control.

    Attributes:
        tolerance: relative miss that is allowed.
        rtol: of the simulation.
        checked: everything that was looked at, the worst first.
        local_errors: of each span, of each interval, shape (N,).
        trajectories: the simulated motion of each span, in order.
        cost: J of the simulated motion; NaN where it did not come to its end.
        failed: why a simulation did not come to its end; empty if all did.
        failure: its status.
        restarted: for a motion on which errors grow until a simulation from the start says
            nothing: the same from node to node in `restarts`.
        restarts: times of a solution that was started again at its own nodes [s].
        growth: by what factor local errors have grown at the end; NaN where nobody looked.
    """

    tolerance: float
    rtol: float
    checked: tuple[Miss, ...]
    local_errors: tuple[Array, ...]
    trajectories: tuple[Trajectory, ...]
    cost: float
    failed: str = ""
    failure: Status = Status.SUCCESS
    restarted: "Verification | None" = None
    restarts: tuple[float, ...] = ()
    growth: float = float("nan")

    __repr__ = brief

    def check_fields(self) -> None:
        """Refuse local errors that are not one number an interval; for files."""
        agree("Verification", all(errors.ndim == 1 for errors in self.local_errors))

    @property
    def misses(self) -> tuple[Miss, ...]:
        """What misses by more than the tolerance, the worst first."""
        return tuple(miss for miss in self.checked if not miss.relative <= self.tolerance)

    @property
    def ok(self) -> bool:
        """Whether the model under this control does all that was asked for."""
        return not self.failed and not self.misses

    @property
    def worst(self) -> Miss | None:
        """What is missed most; None where nothing was asked for."""
        return self.checked[0] if self.checked else None

    @property
    def largest(self) -> float:
        """The largest relative miss; inf where the simulation did not come to its end."""
        if self.failed:
            return float("inf")
        return self.checked[0].relative if self.checked else 0.0

    @property
    def unstable(self) -> bool:
        """Whether it fails only because errors grow: from node to node all is well."""
        return not self.ok and self.restarted is not None and self.restarted.ok

    @property
    def status(self) -> Status:
        """How a solution ends that the solver calls solved."""
        if self.ok:
            return Status.SUCCESS
        if self.unstable:
            return Status.UNSTABLE
        if self.failed:
            return self.failure
        kept = all(miss.what in ("bound", "path") for miss in self.misses)
        return Status.BOUND_MISS if kept else Status.TERMINAL_MISS

    @property
    def sentence(self) -> str:
        """What is wrong, when, by how much, and what to try; empty where all is well."""
        if self.ok:
            return ""
        if self.failed:
            return f"Its control could not be re-simulated: {self.failed}"
        told = "; ".join(miss.sentence for miss in self.misses[:3])
        more = len(self.misses) - 3
        told += f"; and {more} more" if more > 0 else ""
        if self.unstable:
            return (
                f"{self.status.value} Errors grow by a factor of {self.growth:.1g}, so that under "
                f"the control alone {told}. Started again at {_times(self.restarts)} it keeps to "
                f"everything within {_relative(self.restarted)}."
            )
        return f"{self.status.value} In the simulation {told}."

    @property
    def table(self) -> str:
        """All that was looked at, a line each."""
        head = f"{'what':<12}{'name':<28}{'t [s]':>9}{'value':>13}{'wanted':>13}{'relative':>10}"
        rows = [
            f"{m.what:<12}{m.name:<28}{m.time:>9.4g}{m.value:>13.6g}{m.wanted:>13.6g}"
            f"{m.relative:>10.1e}"
            for m in self.checked
        ]
        return "\n".join([head, *rows])

    def __str__(self) -> str:
        verdict = "verified" if self.ok else "not verified"
        said = f"{verdict} within {self.tolerance:g}: largest miss {self.largest:.1e}"
        return "\n".join([said, *([self.sentence] if self.sentence else []), self.table])

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain data; a number that is not finite is None."""
        return {
            "ok": self.ok,
            "tolerance": self.tolerance,
            "rtol": self.rtol,
            "sentence": self.sentence,
            "cost": _plain(self.cost),
            "growth": _plain(self.growth),
            "restarts": list(self.restarts),
            "checked": [
                {
                    "what": m.what,
                    "name": m.name,
                    "time": m.time,
                    "value": _plain(m.value),
                    "wanted": _plain(m.wanted),
                    "relative": _plain(m.relative),
                }
                for m in self.checked
            ],
            "local_errors": [[_plain(e) for e in errors.tolist()] for errors in self.local_errors],
            "restarted": None if self.restarted is None else self.restarted.to_dict(),
        }


def _plain(value: float) -> float | None:
    return float(value) if isfinite(value) else None


def _times(times: tuple[float, ...]) -> str:
    shown = ", ".join(f"{t:.4g}" for t in times[:4])
    return f"{shown}{', ...' if len(times) > 4 else ''} s"


def _relative(verification: "Verification | None") -> str:
    return "?" if verification is None else f"{verification.largest:.1g}"
