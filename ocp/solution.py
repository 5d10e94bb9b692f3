"""The result of an optimal control problem: named signals that plot and write themselves."""

import csv
import json
from dataclasses import asdict, dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import NDArray

from ocp.ipopt import Iterate, SolverStatistics
from ocp.layout import Points
from ocp.problem import Problem
from symfric.foundation.files import write_text, written
from symfric.foundation.parameters import check_names
from symfric.foundation.status import Status
from symfric.integrator import Trajectory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Solution:
    """Optimal motion, and what the model really does under its control.

    `solution["v"]` is a signal at the times `solution.t`: 0 and all collocation points.

    Attributes:
        problem: what was solved.
        status: how it ended; `message` says it in a sentence.
        T: duration [s].
        cost: J.
        t: times [s], shape (N d + 1,).
        signals: name -> values, shape (N d + 1,): states, algebraic variables, inputs, outputs. An
            input is the value from this time on. Algebraic variables are not unknowns at 0 and
            repeat their first value there.
        units: name -> unit.
        t_control: start of each interval [s], shape (N,).
        controls: input -> value held from there to the next one, shape (N,).
        trajectory: the re-simulated motion under `controls`, or None where it was not asked for.
        terminal_miss: state -> end of the re-simulated motion less end of the optimised one.
        relative_miss: the same in multiples of the nominal values.
        statistics: size, iterations, times.
        mesh, points, iterate: what a warm start needs.
    """

    problem: Problem
    status: Status
    message: str
    T: float
    cost: float
    t: Array
    signals: dict[str, Array]
    units: dict[str, str]
    t_control: Array
    controls: dict[str, Array]
    trajectory: Trajectory | None
    terminal_miss: dict[str, float]
    statistics: SolverStatistics
    mesh: Array
    points: Points
    iterate: Iterate

    def __getitem__(self, name: str) -> Array:
        if name == "t":
            return self.t
        check_names(f"solution of '{self.problem.model.name}'", [name], self.signals)
        return self.signals[name]

    @property
    def ok(self) -> bool:
        """Whether it can be used as it is."""
        return self.status.ok

    @property
    def iterations(self) -> int:
        """Iterations of the solver."""
        return self.statistics.iterations

    @property
    def states(self) -> dict[str, Array]:
        """The states among the signals."""
        return {v.name: self.signals[v.name] for v in self.problem.model.x}

    @property
    def inputs(self) -> dict[str, Array]:
        """The inputs among the signals."""
        return {v.name: self.signals[v.name] for v in self.problem.model.u}

    @property
    def relative_miss(self) -> dict[str, float]:
        """`terminal_miss` in multiples of the nominal values of the states."""
        nominal = {v.name: v.nominal for v in self.problem.model.x}
        return {name: miss / nominal[name] for name, miss in self.terminal_miss.items()}

    def plot(self, *names: str, path: str | Path | None = None) -> "Figure":
        """One panel per signal over time; collocation points against the re-simulated line.

        Args:
            names: signals to show; all of them if none is given.
            path: image file, its format taken from the ending.
        """
        from ocp.picture import plot_solutions  # noqa: PLC0415  (matplotlib is slow to import)

        return plot_solutions({self.problem.model.name: self}, names, path)

    def to_csv(self, path: str | Path) -> None:
        """Write all signals as columns with units in the header, such as `v [m/s]`.

        The inputs hold from each row to the next, so `Hold(t, force)` gives the control again.
        """
        header = ["t [s]", *(f"{name} [{self.units[name]}]" for name in self.signals)]
        with written(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(header)
            writer.writerows(np.column_stack([self.t, *self.signals.values()]).tolist())

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain data; a number that is not finite is None."""
        return {
            "scene": self.problem.model.name,
            "status": self.status.name,
            "message": self.message,
            "T": self.T,
            "cost": self.cost if isfinite(self.cost) else None,
            "terminal_miss": dict(self.terminal_miss),
            "relative_miss": self.relative_miss,
            "statistics": asdict(self.statistics),
            "units": {"t": "s", **self.units},
            "t": self.t.tolist(),
            "signals": {name: values.tolist() for name, values in self.signals.items()},
        }

    def to_json(self, path: str | Path) -> None:
        """Write `to_dict` as JSON."""
        write_text(path, json.dumps(self.to_dict()))
