"""Simulate a model: one call for every method and backend."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from time import perf_counter
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from symfric.foundation import checks
from symfric.foundation.status import SolveError, Status
from symfric.integrator.arguments import check_model, check_span, check_times, chosen
from symfric.integrator.compiled.columns import Columns
from symfric.integrator.derivatives.adjoint import gradient
from symfric.integrator.derivatives.sensitivity import Path, Seeds, forward, of_signals, seeds
from symfric.integrator.equations.inputs import Drivers, Input, drivers
from symfric.integrator.methods.method import Method
from symfric.integrator.peers.casadi_integrators import integrate_by_peer
from symfric.integrator.running.dense import Dense
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.run import Run, Tolerances, integrate
from symfric.model import Model
from symfric.results.trajectory import Statistics, Trajectory

Array = NDArray[np.float64]
PEERS = ("rosenbrock", "sundials", "ggl")
BACKENDS = ("auto", "vm", "compiled", *PEERS)
MOST_SAMPLES = 10**8
"""Beyond these the times alone need gigabytes."""
REMEMBERED = 16
"""Integrators kept per model; the oldest goes first."""
_BUILT: WeakKeyDictionary[Model, dict[object, Integrator]] = WeakKeyDictionary()


def simulate(
    model: Model,
    t_end: float,
    *,
    t_start: float = 0.0,
    x0: Mapping[str, float] | None = None,
    u: Mapping[str, Input] | None = None,
    p: Mapping[str, float] | None = None,
    rtol: float = 1e-6,
    atol: float | None = None,
    t_eval: ArrayLike | None = None,
    samples: int = 2001,
    method: str = "auto",
    backend: str = "auto",
    event_tolerance: float = 1e-10,
    max_steps: int = 10_000_000,
    sensitivities: Sequence[str] = (),
    measure_error: bool = False,
    progress: Callable[[float], None] | None = None,
    throw: bool = True,
) -> Trajectory:
    """Integrate `model` from `t_start` to `t_end` [s].

    Args:
        model: the equations; its events and monitored expressions are respected.
        t_end: last time [s].
        t_start: first time [s].
        x0: start values of states by name; the others start where the model says (bristles in
            steady sliding).
        u: inputs by name: a number, `Hold` or `Linear` samples, or a function of symbolic time.
        p: values of the model's parameters by name.
        rtol: relative tolerance of each step.
        atol: absolute tolerance in multiples of each state's nominal value; default 0.1 rtol.
        t_eval: times of the result [s]; default `samples` equal intervals. They force no steps.
        samples: number of equally spaced times.
        method: which formula; the numbers are of Rabinowicz's stick-slip over 20 s.
            "auto": rodas5p, and radau5 where rtol > 1e-5.
            "rodas5p": order 5, the fewest steps at 1e-6 and below; error about rtol.
            "rodas4p": order 4; steps cost 2/3, and grow more in number with tighter rtol.
            "rodas3": order 3; for comparisons with plants in fixed steps.
            "radau5": order 5, the most careful one: its iteration fails where a contact changes
            within a step, so that no slip is lost even at rtol = 1e-3; error a tenth of rtol, for
            1.5 to 2 times the steps. Between steps of order 4.
            "dopri5": order 5, explicit, for ODEs that are not stiff: orbits, pendulums, contacts
            that only slide. Bristles and sticking cost it 20 to 100 times the steps. No cheap
            criterion proves an equation not to be stiff, so it is never chosen by itself.
        backend: "vm" needs no compiler; "compiled" compiles the step once and keeps it in the
            user's cache; "auto" starts in the former and goes over to the latter when that is
            predicted to pay; "rosenbrock" and "sundials" are CasADi's own integrators, under
            which the constraints of mechanisms drift, "ggl" is idas with constraints on positions
            and velocities (`symfric.integrator.peers.ggl`), for comparisons: they pass through
            friction that jams without a sign of it.
        event_tolerance: how sharply events are located [s].
        max_steps: attempts allowed.
        sensitivities: free parameters by name and start values as "x0.v"; the trajectory then
            gives the derivatives of all signals (`Trajectory.sensitivities`) and gradients of
            sums of them (`Trajectory.gradient`), exact for the steps that were taken.
        measure_error: run again at rtol/100 and report the difference in the statistics.
        progress: called with the fraction done every few tens of milliseconds.
        throw: raise `SolveError` on failure; with False the partial trajectory is returned.

    Returns:
        The trajectory. An interrupt (Ctrl-C) returns it, too, with status INTERRUPTED.

    Raises:
        ValueError: bad input.
        SolveError: the integration failed; its `partial` is the trajectory so far.

    Warns:
        UserWarning: rtol above 1e-5, where stick phases may get lost.
    """
    check_model("simulate", model)
    t_start, t_end, rtol = check_span("simulate", t_start, t_end, rtol)
    formula = chosen("simulate", method, rtol)
    checks.choice("simulate: backend", backend, BACKENDS)
    max_steps = checks.count("simulate: max_steps", max_steps)
    sensitivities = checks.names("simulate: sensitivities", sensitivities)
    _check_flags(progress, measure_error=measure_error, throw=throw)
    if sensitivities and backend in PEERS:
        raise ValueError(
            f"simulate: sensitivities: expected backend auto, vm or compiled, got {backend}"
        )
    times = _times(t_start, t_end, t_eval, samples)
    begin = perf_counter()
    inputs = drivers(model, u, t_start, t_end)
    integrator, fresh = _integrator(model, inputs, formula)
    build_time = perf_counter() - begin if fresh else 0.0
    which = seeds(model, sensitivities, x0, p) if sensitivities else None
    relative = 0.1 * rtol if atol is None else atol
    tolerances = Tolerances(rtol, relative * integrator.system.nominal, event_tolerance, max_steps)
    y0, values = _start(integrator, model, x0, p, t_start), model.values("p", p)
    at_start = (y0, np.concatenate([values, inputs.values[:, 0]]))
    if backend not in PEERS:
        integrator = integrator.suited([at_start], float(t_end) - float(t_start))
    run, dense, statistics = _solve(
        integrator, inputs, y0, values, times, tolerances, backend, progress
    )
    trajectory = _trajectory(
        integrator, inputs, run, dense, values, times, replace(statistics, build_time=build_time)
    )
    if throw and not trajectory.status.ok and trajectory.status is not Status.INTERRUPTED:
        raise SolveError(trajectory.message, trajectory.status, trajectory)
    if which is not None and run.steps:
        path = Path(run.integrator or integrator, dense, inputs, values, backend)
        trajectory = _differentiated(trajectory, path, which)
    if measure_error and trajectory.status.ok:
        finer = simulate(
            model, t_end, t_start=t_start, x0=x0, u=u, p=p, rtol=max(rtol / 100, 1e-13),
            t_eval=trajectory.t, method=method, backend=backend,
        )  # fmt: skip
        error = _difference(model, trajectory, finer)
        trajectory = replace(trajectory, statistics=replace(trajectory.statistics, error=error))
    return trajectory


def _solve(
    integrator: Integrator,
    inputs: Drivers,
    y0: Array,
    p: Array,
    times: Array,
    tolerances: Tolerances,
    backend: str,
    progress: Callable[[float], None] | None,
) -> tuple[Run, Dense, Statistics]:
    """Run the chosen backend."""
    compiled_before, begin = integrator.compile_time, perf_counter()
    if backend in PEERS:
        if integrator.model.events:
            raise ValueError(
                f"simulate: backend: expected auto, vm or compiled for a model with events, "
                f"got {backend}"
            )
        run, dense, counts = integrate_by_peer(
            integrator.system, inputs, y0, p, times, tolerances, backend
        )
        method = "Rosenbrock 5(4)" if backend == "rosenbrock" else "BDF"
    else:
        run, dense = integrate(integrator, inputs, y0, p, tolerances, backend, progress)
        method = integrator.tableau.name
        evaluations, jacobians, factorisations = integrator.tableau.work(integrator.system)
        counts = {
            "steps": run.steps,
            "rejections": run.attempts - run.steps,
            "evaluations": run.attempts * evaluations,
            "jacobians": run.attempts * jacobians,
            "factorisations": run.attempts * factorisations,
        }
    compile_time = integrator.compile_time - compiled_before
    statistics = Statistics(
        backend=run.engine,
        method=method,
        events=len(run.happened),
        smallest_step=run.smallest if run.steps else float(np.min(dense.t1 - dense.t0)),
        build_time=0.0,
        compile_time=compile_time,
        run_time=perf_counter() - begin - compile_time,
        **counts,
    )
    return run, dense, statistics


def _check_flags(progress: object, **flags: object) -> None:
    for name, value in flags.items():
        checks.flag(f"simulate: {name}", value)
    if progress is not None:
        checks.function("simulate: progress", progress, "a function of the fraction done")


def _times(t_start: float, t_end: float, t_eval: ArrayLike | None, samples: int) -> Array:
    samples = checks.count("simulate: samples", samples, least=2, most=MOST_SAMPLES)
    if t_eval is None:
        return np.linspace(t_start, t_end, samples)
    return check_times("simulate", t_start, t_end, t_eval)


def _integrator(model: Model, inputs: Drivers, method: Method) -> tuple[Integrator, bool]:
    """The integrator of this model and input structure, built on first use."""
    known = _BUILT.setdefault(model, {})
    key = (method.name, inputs.key)
    fresh = key not in known
    if fresh:
        while len(known) >= REMEMBERED:
            del known[next(iter(known))]
        known[key] = Integrator(model, inputs, method)
    return known[key], fresh


def _start(
    integrator: Integrator,
    model: Model,
    x0: Mapping[str, float] | None,
    p: Mapping[str, float] | None,
    t_start: float,
) -> Array:
    """Start column of the unknowns: states, guesses of the algebraic ones, time."""
    system = integrator.system
    y = np.zeros(system.n)
    y[: system.nx] = model.initial_state(x0, p)
    guesses = {v.name: float(v.start) for v in model.z}
    for i, name in enumerate(system.names):
        y[i] = guesses.get(name, y[i])
    if system.timed:
        y[-1] = t_start
    return y


def _trajectory(
    integrator: Integrator,
    inputs: Drivers,
    run: Run,
    dense: Dense,
    p: Array,
    times: Array,
    statistics: Statistics,
) -> Trajectory:
    model = integrator.model
    names = list(model.signals)
    drifts = run.engine.startswith("casadi")
    signals = integrator.plain_signal_columns if drifts else integrator.signal_columns

    def states(at: Array) -> dict[str, Array]:
        y, columns = dense(at), None if drifts else integrator.states
        if columns is not None:
            y = columns([y.T, data(at)])[0].T
        return dict(zip(names, y[: len(model.x)], strict=False))

    def data(at: Array) -> Array:
        return np.hstack([np.tile(p, (at.size, 1)), inputs.values[:, inputs.interval(at)].T])

    def rows(columns: Columns, at: Array) -> Array:
        (values,) = columns([at, dense(at).T, data(at)])
        return np.ascontiguousarray(values.T)

    def evaluate(at: Array) -> dict[str, Array]:
        return dict(zip(names, rows(signals, at), strict=True))

    def express(expression: ca.SX, at: Array) -> Array:
        plain = partial(integrator.of_time, "signals")
        return rows(Columns((plain if drifts else integrator.refined)(expression)), at)

    reached = times[(times >= dense.t0[0]) & (times <= dense.t1[-1])]
    return Trajectory(
        model.name,
        reached,
        dict(model.signals),
        run.status,
        run.message,
        statistics,
        np.append(dense.t0, dense.t1[-1]),
        states,
        evaluate,
        express,
        model,
        tuple(run.happened),
    )


def _differentiated(trajectory: Trajectory, path: Path, which: Seeds) -> Trajectory:
    """The trajectory with the derivatives of its signals, computed when asked for."""
    names = list(trajectory.units)

    @cache
    def solution() -> Dense:
        return forward(path, which)

    def differentiate(at: Array) -> dict[str, dict[str, Array]]:
        values = of_signals(path, which, solution(), at)
        return {
            seed: dict(zip(names, rows, strict=True))
            for seed, rows in zip(which.names, values, strict=True)
        }

    def pull_back(weights: Mapping[str, Array]) -> dict[str, float]:
        zero = np.zeros(trajectory.t.size)
        every = np.vstack([weights.get(name, zero) for name in names])
        return gradient(path, which, trajectory.t, every)

    return replace(trajectory, differentiate=differentiate, pull_back=pull_back)


def _difference(model: Model, one: Trajectory, other: Trajectory) -> float:
    """Largest difference of a state over both runs, relative to its magnitude."""
    n = min(one.t.size, other.t.size)
    worst = 0.0
    for v in model.x:
        a, b = one[v.name][:n], other[v.name][:n]
        worst = max(worst, float(np.max(np.abs(a - b)) / max(np.max(np.abs(b)), v.nominal)))
    return worst
