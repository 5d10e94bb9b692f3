"""Runs as data: in files that last, and in pickles."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation import checks, packed
from symfric.foundation.status import Status
from symfric.integrator.compiled.columns import Columns
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.running.built import built
from symfric.integrator.running.dense import Dense
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.outputs import Outputs
from symfric.integrator.running.record import Run
from symfric.model import Model
from symfric.results.statistics import Statistics
from symfric.results.trajectory import FORMAT, KIND, Trajectory

Array = NDArray[np.float64]
Slopes = dict[str, dict[str, Array]]


@final
class Later:
    """The integrator of a stored run, built when something is asked that the file does not hold."""

    def __init__(self, model: Model, inputs: InputData, method: str) -> None:
        self.model = model
        self._how = inputs, METHODS[method]

    @cached_property
    def now(self) -> Integrator:
        """It, built."""
        inputs, method = self._how
        return built(self.model, inputs, method)[0]

    @property
    def states(self) -> Columns | None:
        """See `Integrator.states`."""
        return self.now.states

    @property
    def signal_columns(self) -> Columns:
        """See `Integrator.signal_columns`."""
        return self.now.signal_columns

    @property
    def plain_signal_columns(self) -> Columns:
        """See `Integrator.plain_signal_columns`."""
        return self.now.plain_signal_columns

    def refined(self, expression: ca.SX) -> ca.Function:
        """See `Integrator.refined`."""
        return self.now.refined(expression)

    def of_time(self, name: str, expression: ca.SX) -> ca.Function:
        """See `Integrator.of_time`."""
        return self.now.of_time(name, expression)


@final
@dataclass(frozen=True, eq=False)
class Stored:
    """A run as data.

    Attributes:
        model, inputs, p: what was run.
        method: by which formula, a key of `METHODS`.
        backend, engine: what evaluates signals, and what ran the steps.
        steps: all accepted ones.
        times, reached: of the result, and the unknowns there.
        signals: at `times`, in the order of `Model.signals`.
        happened: (time [s], name) of every event.
        status, message, statistics: how it ended, and what it took.
        slopes, delays: derivatives at `times` and of the events, where they were asked for.
        unable: why there are none although they were.
    """

    model: Model
    inputs: InputData
    p: Array
    method: str
    backend: str
    engine: str
    steps: Dense
    times: Array
    reached: Array
    signals: Array
    happened: tuple[tuple[float, str], ...]
    status: Status
    message: str
    statistics: Statistics
    slopes: Slopes | None = None
    delays: dict[str, Array] | None = None
    unable: str = ""

    @classmethod
    def of(
        cls, integrator: "Integrator | Later", inputs: InputData, run: Run, p: Array, backend: str,
        trajectory: Trajectory,
    ) -> "Stored":  # fmt: skip
        """A run and its trajectory, with steps that are found again where there were too many."""
        method = (integrator.now if isinstance(integrator, Later) else integrator).tableau
        stored = cls(
            integrator.model,
            inputs,
            p,
            next(key for key, known in METHODS.items() if known.name == method.name),
            backend,
            run.engine,
            run.dense,
            trajectory.t,
            run.outputs.reached,
            np.array(list(trajectory.signals.values())),
            trajectory.happened,
            trajectory.status,
            trajectory.message,
            trajectory.statistics,
        )
        return stored if trajectory.differentiate is None else stored._with_slopes(trajectory)

    def _with_slopes(self, trajectory: Trajectory) -> "Stored":
        try:
            delays = trajectory.event_sensitivities
            return replace(self, slopes=trajectory.sensitivities, delays=delays)
        except ValueError as error:
            return replace(self, unable=str(error))

    def trajectory(self) -> Trajectory:
        """The run again."""
        from symfric.integrator.outcome import trajectory_of  # noqa: PLC0415  (which knows this)

        found = self.reached.shape[1]
        run = Run(
            float(self.steps.t0[0]),
            self.steps.y0[0],
            Outputs(self.times, self.reached, found),
            happened=list(self.happened),
            steps=self.statistics.steps,
            engine=self.engine,
            status=self.status,
            message=self.message,
            most=np.inf,
        )
        run.keep_all(self.steps)
        later = Later(self.model, self.inputs, self.method)
        made = trajectory_of(later, self.inputs, run, self.p, lambda: self.statistics, self.backend)
        names, known = list(self.model.signals), self.signals
        by_name = dict(zip(names, known, strict=True))

        def evaluate(at: Array) -> dict[str, Array]:
            return dict(by_name) if at is made.t else made.evaluate(at)

        def states(at: Array) -> dict[str, Array]:
            if at is made.t:
                return {v.name: by_name[v.name] for v in self.model.x}
            return made.states(at)

        return replace(made, evaluate=evaluate, states=states, **self._derivatives(made.t))

    def _derivatives(self, t: Array) -> dict[str, Any]:
        """What gives the derivatives that were stored."""
        if self.slopes is None and not self.unable:
            return {}

        def known() -> Slopes:
            if self.slopes is None:
                raise ValueError(self.unable)
            return self.slopes

        def differentiate(at: Array) -> Slopes:
            if at is not t:
                raise ValueError(
                    f"trajectory of '{self.model.name}': expected derivatives at `t`, which are "
                    "those that a file holds, got other times; simulate again for more"
                )
            return known()

        def pull_back(weights: Mapping[str, Array]) -> dict[str, float]:
            return {
                name: float(sum(w @ rows[s] for s, w in weights.items()))
                for name, rows in known().items()
            }

        def delays() -> dict[str, Array]:
            known()
            return self.delays or {}

        return {"differentiate": differentiate, "pull_back": pull_back, "delays": delays}


def load_run(path: str | Path, own: Iterable[type] = ()) -> Trajectory:
    """The run that `run.save(path)` wrote, to the bit.

    Nothing in the file is run: classes of symfric get their fields.

    Args:
        path: the file.
        own: your classes in it, such as a law of yours.

    Raises:
        ValueError: no such file, one that something else wrote, a damaged one, one of another
            format, or classes that are not known.
    """
    place = checks.path("load_run", path)
    try:
        with place.open("rb") as file:
            stored = packed.load(file, KIND, FORMAT, own)
    except OSError as error:
        reason = "a folder" if isinstance(error, IsADirectoryError) else "an unreadable file"
        reason = "no such file" if isinstance(error, FileNotFoundError) else reason
        raise ValueError(f"load_run '{path}': expected a saved run, got {reason}") from None
    except ValueError as error:
        raise ValueError(f"load_run '{path}': {error}") from None
    return checks.kind(f"load_run '{path}'", stored, Stored, "a saved run").trajectory()
