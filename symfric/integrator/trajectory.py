"""The result of a simulation: named signals over time that plot and write themselves."""

import csv
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symfric.files import write_text, written
from symfric.parameters import check_names
from symfric.status import Status

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Statistics:
    """What a simulation cost.

    Attributes:
        backend: what ran it.
        method: integration method.
        steps, rejections: accepted and rejected steps.
        evaluations, jacobians: calls of the right-hand side and of its Jacobian.
        build_time, run_time: wall time [s] for making and for running the integrator.
    """

    backend: str
    method: str
    steps: int
    rejections: int
    evaluations: int
    jacobians: int
    build_time: float
    run_time: float

    def to_dict(self) -> dict[str, Any]:
        """The fields by name."""
        return asdict(self)


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Named signals of a simulated model.

    `trajectory["v"]` is a signal at the times `trajectory.t`; `trajectory.at(times)` evaluates
    all signals between them.

    Attributes:
        scene: name of the model.
        t: times [s], shape (n,).
        signals: name -> values, shape (n,): states, algebraic variables, inputs, outputs.
        units: name -> unit.
        status: how it ended; `message` says it in a sentence.
        statistics: steps, evaluations, times.
    """

    scene: str
    t: Array
    signals: dict[str, Array]
    units: dict[str, str]
    status: Status
    message: str
    statistics: Statistics
    dense: Callable[[Array], dict[str, Array]]

    def __getitem__(self, name: str) -> Array:
        if name == "t":
            return self.t
        check_names(f"trajectory of '{self.scene}'", [name], self.signals)
        return self.signals[name]

    def at(self, times: ArrayLike) -> dict[str, Array]:
        """All signals at `times` [s] inside the simulated span, by dense output.

        Raises:
            ValueError: a time outside the span.
        """
        at = np.atleast_1d(np.asarray(times, dtype=float))
        if at.size and not (self.t[0] <= at.min() and at.max() <= self.t[-1]):
            raise ValueError(
                f"trajectory of '{self.scene}': expected times in "
                f"[{self.t[0]:g}, {self.t[-1]:g}] s, got {at.min():g} ... {at.max():g} s"
            )
        return self.dense(at)

    @property
    def final(self) -> dict[str, float]:
        """All signals at the last time."""
        return {name: float(values[-1]) for name, values in self.signals.items()}

    def plot(self, *names: str, path: str | Path | None = None, label: str = "") -> "Figure":
        """One panel per signal over time, labelled with units; saved to `path` if given.

        Args:
            names: signals to show; all of them if none is given.
            path: image file, its format taken from the ending.
            label: legend entry of this trajectory.
        """
        from symfric.plotting import plot_trajectories  # noqa: PLC0415  (matplotlib is slow to import)

        return plot_trajectories({label or self.scene: self}, names, path)

    def to_csv(self, path: str | Path) -> None:
        """Write all signals as columns with units in the header, such as `v [m/s]`."""
        header = ["t [s]", *(f"{name} [{self.units[name]}]" for name in self.signals)]
        with written(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(header)
            writer.writerows(np.column_stack([self.t, *self.signals.values()]).tolist())

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain data: scene, status, statistics, units, times and signals."""
        return {
            "scene": self.scene,
            "status": self.status.name,
            "message": self.message,
            "statistics": self.statistics.to_dict(),
            "units": {"t": "s", **self.units},
            "t": self.t.tolist(),
            "signals": {name: values.tolist() for name, values in self.signals.items()},
        }

    def to_json(self, path: str | Path) -> None:
        """Write `to_dict` as JSON."""
        write_text(path, json.dumps(self.to_dict()))
