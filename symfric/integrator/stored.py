"""Results of a run: its trajectory, and its data for files and pickles."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from os import PathLike
from typing import Any, final

import casadi as ca
import numpy as np

from symfric.foundation.numeric import Array
from symfric.foundation.status import Status
from symfric.foundation.storable import agree
from symfric.integrator.compiled.columns import BACKENDS, Columns
from symfric.integrator.derivatives.path import RunPath, Seeds
from symfric.integrator.derivatives.sensitivity import Differentiated
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.methods.tableaux import METHODS, key_of
from symfric.integrator.running.integrator import Integrator, built, in_results
from symfric.integrator.running.record import Dense, Jumps, Outputs, RunRecord
from symfric.model import Model
from symfric.model.kinds import MODE
from symfric.results.stored import Format, Statistics
from symfric.results.trajectory import Trajectory

Slopes = dict[str, dict[str, Array]]


@final
@dataclass(frozen=True, eq=False)
class Basis:
    """Additional data for derivatives along stored steps.

    Attributes:
        which: parameters and start values to differentiate with respect to.
        guess: initial guess of the consistent start values.
        jumps: events of the run, with their resets.
        tolerance: tolerance of event times [s].
    """

    which: Seeds
    guess: Array
    jumps: tuple[Jumps, ...]
    tolerance: float


@final
@dataclass(frozen=True, eq=False)
class Stored:
    """Run as data for files and pickles.

    Attributes:
        model, inputs, p: equations, inputs and parameters of the run.
        method: key of `METHODS`.
        backend: engine of the signals.
        engine: engine of the steps.
        steps: all accepted steps.
        times, reached: times of the result [s], and the unknowns at these times.
        signals: signals at `times`, in the order of `Model.signals`.
        happened: (time [s], name) of every event.
        status, message, statistics: outcome and cost of the run.
        slopes, delays: derivatives of signals at `times` and of event times, if requested.
        unable: reason why requested derivatives do not exist.
        basis: data for derivatives at other times; None in files of the first format.
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
    basis: Basis | None = None

    @classmethod
    def of(
        cls, integrator: Integrator, inputs: InputData, run: RunRecord, p: Array, backend: str,
        trajectory: Trajectory, basis: Basis | None = None,
    ) -> "Stored":  # fmt: skip
        """Return the data of a run and its trajectory; recompute steps that were not kept."""
        stored = cls(
            integrator.model,
            inputs,
            p,
            key_of(integrator.tableau),
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
            basis=basis,
        )
        return stored if trajectory.differentiate is None else stored._with_slopes(trajectory)

    def check_fields(self) -> None:
        """Check that the arrays of a file match, since compiled code does not check them."""
        steps, inputs, model = self.steps, self.inputs, self.model
        (k, n), m = steps.y0.shape, self.times.size
        agree(
            "run",
            self.method in METHODS and self.backend in BACKENDS,
            k > 0 and steps.t0.shape == steps.t1.shape == (k,),
            steps.y1.shape == (k, n) and steps.D.shape == (k, steps.D.shape[1], n),
            n >= len(model.x) + len(model.z) and self.p.shape == (len(model.p),),
            self.times.shape == (m,) and self.reached.shape == (n, m),
            self.signals.shape == (len(model.signals), m),
            inputs.expression.numel() == len(model.u),
            inputs.values.shape == (inputs.data.numel(), inputs.breaks.size - 1),
            bool((np.diff(inputs.breaks) > 0).all()),
            all(bool(np.isfinite(a).all()) for a in (*vars(steps).values(), self.times, self.p)),
        )

    def _with_slopes(self, trajectory: Trajectory) -> "Stored":
        try:
            delays = trajectory.event_sensitivities
            return replace(self, slopes=trajectory.sensitivities, delays=delays)
        except ValueError as error:
            return replace(self, unable=str(error))

    def unpacked(self) -> Trajectory:
        """Return the trajectory of the stored run."""
        found = self.reached.shape[1]
        run = RunRecord(
            float(self.steps.t0[0]),
            self.steps.y0[0],
            Outputs(self.times, self.reached, found),
            happened=list(self.happened),
            steps=self.statistics.steps,
            engine=self.engine,
            status=self.status,
            message=self.message,
            kept=[self.steps.rows],
        )

        @cache
        def integrator() -> Integrator:
            return built(self.model, self.inputs, METHODS[self.method])[0]

        made = trajectory_of(
            self.model, integrator, self.inputs, run, self.p, lambda: self.statistics, self.backend,
            dict(zip(self.model.signals, self.signals, strict=True)),
        )  # fmt: skip

        def keep(_: Trajectory) -> Stored:
            return self

        return replace(made, keep=keep, **self._derivatives(integrator, made.t))

    def _derivatives(self, integrator: Callable[[], Integrator], t: Array) -> dict[str, Any]:
        """Return the derivative functions: values at `t` are stored, others use the steps."""
        if self.slopes is None and not self.unable:
            return {}

        names = tuple(self.model.signals)

        @cache
        def between(basis: Basis) -> Differentiated:
            return Differentiated(lambda: self._path(basis, integrator()), basis.which, names, t)

        def known() -> Slopes:
            if self.slopes is None:
                raise ValueError(self.unable)
            return self.slopes

        def differentiate(at: Array) -> Slopes:
            if at is t or self.slopes is None:
                return known()
            if self.basis is None:
                raise ValueError(
                    f"trajectory of '{self.model.name}': expected derivatives at `t`, since a file "
                    "of the first format has no others, got other times; simulate again"
                )
            return between(self.basis).at(at)

        def pull_back(weights: Mapping[str, Array]) -> dict[str, float]:
            return {
                name: float(sum(w @ rows[s] for s, w in weights.items()))
                for name, rows in known().items()
            }

        def delays() -> dict[str, Array]:
            known()
            return self.delays or {}

        return {"differentiate": differentiate, "pull_back": pull_back, "delays": delays}

    def _path(self, basis: Basis, integrator: Integrator) -> RunPath:
        """Return the path of the run, with pivots that are stable at its start and end."""
        if integrator.system.has_pivots:
            d = [np.concatenate([self.p, self.inputs.values[:, k]]) for k in (0, -1)]
            ends = [(basis.guess, d[0]), (self.steps.y1[-1], d[1])]
            integrator = integrator.suited(ends, float(self.steps.t1[-1] - self.steps.t0[0]))
        return RunPath(
            integrator, self.steps, self.inputs, self.p, self.backend,
            basis.guess, basis.jumps, basis.tolerance, (self.times, self.reached),
        )  # fmt: skip

    def save(self, path: str | PathLike[str]) -> None:
        """Write the run to a file."""
        RUN.save(path, self)


RUN = Format("symfric run", 3, "load_run", "a saved run", Stored)


def load_run(
    path: str | PathLike[str], own: Iterable[type | Callable[..., Any]] = ()
) -> Trajectory:
    """Return the run that `run.save(path)` wrote, equal bit for bit.

    No code from the file is executed. The file contains arrays, lists of elementary operations and
    fields of known classes, which are checked before use.

    Args:
        path: the file.
        own: the user's own classes in the file, such as laws.

    Raises:
        ValueError: a file that does not exist, is damaged, or has another origin or format, or
            that contains unknown classes.
    """
    return RUN.load(path, own).unpacked()


def statistics_of(
    integrator: Integrator, run: RunRecord, build_time: float, compile_time: float, run_time: float
) -> Statistics:
    """Return the statistics of a run; the arguments are times [s]."""
    evaluations, jacobians, factorisations = integrator.tableau.work(integrator.system)
    return Statistics(
        backend=run.engine,
        method=integrator.tableau.name,
        steps=run.steps,
        rejections=run.attempts - run.steps,
        evaluations=run.attempts * evaluations,
        jacobians=run.attempts * jacobians,
        factorisations=run.attempts * factorisations,
        events=len(run.happened),
        smallest_step=run.extent.shortest,
        build_time=build_time,
        compile_time=compile_time,
        run_time=run_time,
    )


def trajectory_of(
    model: Model,
    integrator: Callable[[], Integrator],
    inputs: InputData,
    run: RunRecord,
    p: Array,
    count: Callable[[], Statistics],
    backend: str = "vm",
    known: Mapping[str, Array] | None = None,
) -> Trajectory:
    """Return the trajectory of a run.

    Args:
        model, inputs, p: equations, inputs and parameters of the run.
        integrator: returns the integrator of the run; a stored run builds it on first use.
        run: results; only output times that were reached are used.
        count: returns the statistics.
        backend: engine of the signals: "vm", otherwise the engine expected to be fastest.
        known: signals at the output times, if they are stored.

    With third-party integrators the constraints of mechanisms drift, and the results show the
    drift. The methods of symfric satisfy them to the tolerance between steps, exactly in results.
    """
    outputs, names, drifts = run.outputs, model.signals, run.engine.startswith("casadi")
    times, engine = outputs.times, "vm" if backend == "vm" else "auto"
    if outputs.found < times.size:
        times = times[: outputs.found]

    def unknowns(at: Array) -> Array:
        return outputs.reached.copy() if at is times else run.at(at)

    def states(at: Array) -> dict[str, Array]:
        if known is not None and at is times:
            return {v.name: known[v.name] for v in model.x}
        y, columns = unknowns(at), None if drifts else integrator().states
        if columns is not None:
            y = columns([y.T, data(at)], backend=engine)[0].T
        pairs = zip(model.x, y, strict=False)
        return {v.name: row if v.kind != MODE else in_results(MODE, row) for v, row in pairs}

    def data(at: Array) -> Array:
        return np.hstack([np.tile(p, (at.size, 1)), inputs.values[:, inputs.interval(at)].T])

    def rows(columns: Columns, at: Array) -> Array:
        (values,) = columns([at, unknowns(at).T, data(at)], backend=engine)
        return np.ascontiguousarray(values.T)

    def evaluate(at: Array) -> dict[str, Array]:
        if known is not None and at is times:
            return dict(known)
        own = integrator()
        columns = own.plain_signal_columns if drifts else own.signal_columns
        return dict(zip(names, rows(columns, at), strict=True))

    def express(expression: ca.SX, at: Array) -> Array:
        own = integrator()
        made = own.of_time("signals", expression) if drifts else own.refined(expression)
        return rows(Columns(made), at)

    return Trajectory(
        model.name,
        times,
        dict(names),
        run.status,
        run.message,
        count,
        (run.t, run.reached),
        lambda: np.append(run.dense.t0, run.dense.t1[-1]),
        states,
        evaluate,
        express,
        model,
        tuple(run.happened),
        keep=lambda made: Stored.of(integrator(), inputs, run, p, backend, made),
    )
