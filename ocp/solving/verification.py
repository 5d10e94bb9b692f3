"""Result of a re-simulation: the deviation from each condition, and when."""

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
    """A condition, and its value in the re-simulated motion.

    Attributes:
        what: "start", "end", "via", "joint", "period": a value to meet; "bound" or "path": a range,
            at its worst violation; "motion": a state at the end of a phase
            against its optimised value; "cost"; "local error": of the worst interval.
        name: of the signal, or of the condition.
        time: time [s].
        value: its value there.
        wanted: the nearest admissible value.
        size: reference magnitude of the difference.
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
        """Difference of `value` and `wanted`."""
        return self.value - self.wanted

    @property
    def relative(self) -> float:
        """Difference in multiples of `size`; inf for NaN."""
        found = abs(self.miss) / self.size if self.size > 0 else abs(self.miss)
        return found if isfinite(found) else float("inf")

    @property
    def sentence(self) -> str:
        """Message: what is missed, when and by how much."""
        unit = f" {self.unit}" if self.unit not in ("", "1") else ""
        if self.what == "local error":
            return f"the interval at {self.time:.4g} s has a local error of {self.relative:.2g}"
        if self.what == "cost":
            return f"the cost is {self.value:.6g}, not {self.wanted:.6g}"
        amount = f"{abs(self.miss):.3g}{unit}"
        if self.what == "motion":
            return f"{self.name} is {amount} away from its optimised value at {self.time:.4g} s"
        if self.what in ("bound", "path"):
            return f"{self.name} is violated by {amount} at {self.time:.4g} s"
        return f"{self.name} misses {self.wanted:.4g}{unit} at {self.time:.4g} s by {amount}"


@final
@dataclass(frozen=True, eq=False)
class Verification:
    """Comparison of a solution with a tight simulation of the user's model under its control.

    Attributes:
        tolerance: largest permitted relative miss.
        rtol: of the simulation.
        checked: all checked conditions, the worst first.
        local_errors: of each interval, for each phase of shape (N,).
        trajectories: the simulated motion of each phase, in order.
        cost: J of the simulated motion; NaN if it did not reach its end.
        failed: message of a simulation that did not reach its end; empty if all did.
        failure: its status.
        restarted: for a motion with error growth that makes a simulation from the start
            meaningless: the same from node to node in `restarts`.
        restarts: times of restarts at the nodes of the solution [s].
        growth: growth factor of local errors up to the end; NaN if not evaluated.
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
        """Raise an error for local errors without one number per interval; for files."""
        agree("Verification", all(errors.ndim == 1 for errors in self.local_errors))

    @property
    def misses(self) -> tuple[Miss, ...]:
        """Conditions that miss by more than the tolerance, the worst first."""
        return tuple(miss for miss in self.checked if not miss.relative <= self.tolerance)

    @property
    def ok(self) -> bool:
        """True if the model under this control meets all conditions."""
        return not self.failed and not self.misses

    @property
    def worst(self) -> Miss | None:
        """The largest miss; None without conditions."""
        return self.checked[0] if self.checked else None

    @property
    def largest(self) -> float:
        """The largest relative miss; inf if the simulation did not reach its end."""
        if self.failed:
            return float("inf")
        return self.checked[0].relative if self.checked else 0.0

    @property
    def unstable(self) -> bool:
        """True if it fails only because of error growth; all is met from node to node."""
        return not self.ok and self.restarted is not None and self.restarted.ok

    @property
    def status(self) -> Status:
        """Status of a solution that the solver reports as solved."""
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
        """Message: what is missed, when, by how much, and what to try; empty if nothing is."""
        if self.ok:
            return ""
        if self.failed:
            return f"Its control could not be re-simulated: {self.failed}"
        missed = "; ".join(miss.sentence for miss in self.misses[:3])
        more = len(self.misses) - 3
        missed += f"; and {more} more" if more > 0 else ""
        if self.unstable and self.restarted is not None:
            shown = ", ".join(f"{t:.4g}" for t in self.restarts[:4])
            return (
                f"{self.status.value} Errors grow by a factor of {self.growth:.1g}, so under "
                f"the control alone {missed}. Restarted at {shown}"
                f"{', ...' if len(self.restarts) > 4 else ''} s it meets all conditions within "
                f"{self.restarted.largest:.1g}."
            )
        return f"{self.status.value} In the simulation {missed}."

    @property
    def table(self) -> str:
        """Table of all checked conditions."""
        head = f"{'what':<12}{'name':<28}{'t [s]':>9}{'value':>13}{'wanted':>13}{'relative':>10}"
        rows = [
            f"{m.what:<12}{m.name:<28}{m.time:>9.4g}{m.value:>13.6g}{m.wanted:>13.6g}"
            f"{m.relative:>10.1e}"
            for m in self.checked
        ]
        return "\n".join([head, *rows])

    def __str__(self) -> str:
        verdict = "verified" if self.ok else "not verified"
        text = f"{verdict} within {self.tolerance:g}: largest miss {self.largest:.1e}"
        return "\n".join([text, *([self.sentence] if self.sentence else []), self.table])

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data, with None for non-finite numbers."""
        return {
            "ok": self.ok,
            "tolerance": self.tolerance,
            "rtol": self.rtol,
            "sentence": self.sentence,
            "cost": _plain(self.cost),
            "growth": _plain(self.growth),
            "restarts": list(self.restarts),
            "checked": [
                {"what": m.what, "name": m.name}
                | {n: _plain(getattr(m, n)) for n in ("time", "value", "wanted", "relative")}
                for m in self.checked
            ],
            "local_errors": [[_plain(e) for e in errors.tolist()] for errors in self.local_errors],
            "restarted": None if self.restarted is None else self.restarted.to_dict(),
        }


def _plain(value: float) -> float | None:
    return float(value) if isfinite(value) else None
