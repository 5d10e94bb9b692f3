"""The result of a simulation: named signals over time that plot and write themselves."""

import csv
import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
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
        evaluations, jacobians, factorisations: calls of the right-hand side, of its Jacobian, and
            LU factorisations.
        events: events that happened.
        smallest_step: smallest accepted step [s].
        build_time, compile_time, run_time: wall time [s] for making the integrator (0 where it is
            reused), compiling it, and running it.
        error: measured error relative to each state's magnitude, the largest; NaN if not asked for.
    """

    backend: str
    method: str
    steps: int
    rejections: int
    evaluations: int
    jacobians: int
    factorisations: int
    events: int
    smallest_step: float
    build_time: float
    compile_time: float
    run_time: float
    error: float = float("nan")

    def to_dict(self) -> dict[str, Any]:
        """The fields by name; an error that was not measured is left out."""
        return {k: v for k, v in asdict(self).items() if v == v}


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Named signals of a simulated model.

    `trajectory["v"]` is a signal at the times `trajectory.t`; `trajectory.at(times)` evaluates
    all signals anywhere in the span by the dense output of the method. Signals are evaluated when
    they are first asked for.

    Attributes:
        scene: name of the model.
        t: times of the result [s], shape (n,).
        units: name -> unit of every signal.
        status: how it ended; `message` says it in a sentence.
        statistics: steps, evaluations, times.
        happened: (time [s], name) of every event.
        steps: ends of the accepted steps [s], shape (steps + 1,).
        states: the states alone, at any times; cheaper than all signals.
        evaluate: all signals at any times.
        differentiate: derivatives of all signals at any times, where they were asked for.
        pull_back: gradient of a weighted sum of signals at `t`, likewise.
    """

    scene: str
    t: Array
    units: dict[str, str]
    status: Status
    message: str
    statistics: Statistics
    steps: Array
    states: Callable[[Array], dict[str, Array]]
    evaluate: Callable[[Array], dict[str, Array]]
    happened: tuple[tuple[float, str], ...] = ()
    differentiate: Callable[[Array], dict[str, dict[str, Array]]] | None = None
    pull_back: Callable[[Mapping[str, Array]], dict[str, float]] | None = None

    @cached_property
    def signals(self) -> dict[str, Array]:
        """Name -> values at `t`, shape (n,): states, algebraic variables, inputs, outputs."""
        return self.evaluate(self.t)

    @cached_property
    def _own_states(self) -> dict[str, Array]:
        return self.states(self.t)

    @cached_property
    def sensitivities(self) -> dict[str, dict[str, Array]]:
        """Derivatives at `t`: name as given to `simulate` -> signal -> values, shape (n,).

        Raises:
            ValueError: none were asked for.
        """
        if self.differentiate is None:
            raise self._without_derivatives
        return self.differentiate(self.t)

    def gradient(self, weights: Mapping[str, ArrayLike]) -> dict[str, float]:
        """Derivatives of the sum over signals s and times t_i of weights[s][i] s(t_i).

        One sweep backwards over the steps, at a cost that does not grow with the number of names
        given to `simulate`. For a cost J of the signals at `t`, the weights are dJ/ds(t_i).

        Args:
            weights: signal -> a number for every time of `t`, or one for all.

        Returns:
            Name as given to `simulate` -> derivative.

        Raises:
            ValueError: no sensitivities were asked for, an unknown signal, another length.
        """
        if self.pull_back is None:
            raise self._without_derivatives
        where = f"trajectory of '{self.scene}'"
        check_names(f"{where}: gradient", weights, self.units)
        given = {name: np.asarray(w, dtype=float) for name, w in weights.items()}
        odd = {name: w.shape for name, w in given.items() if w.shape not in ((), self.t.shape)}
        if odd:
            raise ValueError(
                f"{where}: gradient: expected numbers or arrays of {self.t.size} weights, got "
                + ", ".join(f"{name} of shape {shape}" for name, shape in odd.items())
            )
        return self.pull_back({n: np.broadcast_to(w, self.t.shape) for n, w in given.items()})

    @property
    def _without_derivatives(self) -> ValueError:
        return ValueError(
            f"trajectory of '{self.scene}': expected sensitivities, got none; ask for them by "
            "simulate(..., sensitivities=[...])"
        )

    def __getitem__(self, name: str) -> Array:
        if name == "t":
            return self.t
        check_names(f"trajectory of '{self.scene}'", [name], self.units)
        states = self._own_states
        return states[name] if name in states else self.signals[name]

    def at(self, times: ArrayLike) -> dict[str, Array]:
        """All signals at `times` [s] inside the simulated span, by dense output.

        Raises:
            ValueError: a time outside the span.
        """
        at = np.atleast_1d(np.asarray(times, dtype=float))
        first, last = self.steps[0], self.steps[-1]
        if at.size and not (first <= at.min() and at.max() <= last):
            raise ValueError(
                f"trajectory of '{self.scene}': expected times in [{first:g}, {last:g}] s, "
                f"got {at.min():g} ... {at.max():g} s"
            )
        return self.evaluate(at)

    @cached_property
    def final(self) -> dict[str, float]:
        """All signals at the last time reached."""
        return {k: float(v[0]) for k, v in self.evaluate(self.steps[-1:]).items()}

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
