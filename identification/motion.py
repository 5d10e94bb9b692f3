"""Parameters of any model from measured signals: the motion is simulated and compared.

    minimise 1/2 sum_s sum_i ((y_s(t_i; p) - measured_s(t_i)) / scale_s)^2

by Levenberg's and Marquardt's method with the derivatives of the steps that the simulation took.
It takes what `identify` does not: laws with states, several bodies, friction from reactions.
Source: J. J. More, The Levenberg-Marquardt algorithm, Lecture Notes in Mathematics 630, 1978.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from identification.data import Array
from identification.precision import precision
from identification.result import Estimate
from symfric.foundation import checks
from symfric.foundation.parameters import Variable
from symfric.foundation.status import SolveError, Status
from symfric.integrator import Input, Trajectory, simulate
from symfric.model import Model, check_model

AT_BOUND = 1e-9
"""Distance to a bound, relative to the parameter's scale, below which it stands there."""
GAIN = 1e-10
"""Expected relative fall of the cost below which nothing is left to gain."""
STUCK = 1e12
"""Damping beyond which no step lowers the cost."""


@final
@dataclass(frozen=True, eq=False)
class MotionFit:
    """Parameters fitted to a motion.

    Attributes:
        parameters: every fitted parameter with its uncertainty.
        correlation: of the estimates, shape (n, n).
        undetermined: groups of parameters that the data cannot tell apart.
        errors: signal -> root mean square of what is left, in the signal's unit.
        trajectory: the motion with the fitted parameters, at the measured times.
        status, message: how the fit ended.
        iterations: accepted steps.
    """

    parameters: dict[str, Estimate]
    correlation: Array
    undetermined: tuple[tuple[str, ...], ...]
    errors: dict[str, float]
    trajectory: Trajectory
    status: Status
    message: str
    iterations: int


@final
@dataclass(frozen=True, eq=False)
class _Task:
    """Residuals of a model as a function of its parameters over their scale."""

    model: Model
    fitted: tuple[Variable, ...]
    t: Array
    measured: Mapping[str, Array]
    scales: Mapping[str, float]
    x0: Mapping[str, float]
    u: Mapping[str, Input]
    p: Mapping[str, float]
    rtol: float

    @property
    def units(self) -> Array:
        """What parameters are divided by: start value or nominal value."""
        return np.array([abs(float(v.start)) or v.nominal for v in self.fitted])

    def run(self, w: Array, throw: bool = False) -> Trajectory:
        """The motion at the parameters `w`."""
        names = [v.name for v in self.fitted]
        values = dict(zip(names, (w * self.units).tolist(), strict=True))
        return simulate(
            self.model, float(self.t[-1]), t_start=float(self.t[0]), x0=self.x0, u=self.u,
            p=dict(self.p) | values, rtol=self.rtol, t_eval=self.t, sensitivities=names,
            throw=throw,
        )  # fmt: skip

    def residuals(self, run: Trajectory) -> Array:
        """(y - measured) / scale of all signals, one after the other."""
        return np.concatenate([(run[s] - y) / self.scales[s] for s, y in self.measured.items()])

    def slopes(self, run: Trajectory) -> Array:
        """Derivatives of the residuals, a column for each parameter."""
        columns = [
            np.concatenate([run.sensitivities[v.name][s] / self.scales[s] for s in self.measured])
            for v in self.fitted
        ]
        return np.column_stack(columns) * self.units


def identify_motion(
    model: Model,
    t: ArrayLike,
    measured: Mapping[str, ArrayLike],
    *,
    free: Iterable[str] | None = None,
    p: Mapping[str, float] | None = None,
    x0: Mapping[str, float] | None = None,
    u: Mapping[str, Input] | None = None,
    rtol: float = 1e-8,
    iterations: int = 50,
    throw: bool = True,
) -> MotionFit:
    """Fit free parameters of a model to signals measured over a motion.

    Args:
        model: any model without events, say `scene.model(free=["mu_d", "v_t"])`.
        t: increasing sample times [s], shape (n,); the motion starts at the first.
        measured: signals of the model by name, shape (n,) each; each is weighted by its own
            standard deviation.
        free: parameters to fit, by default all of `model.p`; they stay inside their bounds.
        p: their start values, and values of the others.
        x0, u: start values and inputs, as `simulate` takes them.
        rtol: of the simulation.
        iterations: steps allowed.
        throw: raise `SolveError` if the fit fails; its `partial` is the result so far.

    Raises:
        ValueError: bad input.
        SolveError: the start values cannot be simulated, or the fit does not end.

    Limits: single shooting. Where motions from neighbouring starts part (chaos, an unstable
    equilibrium) or a contact sticks in the simulation but not in the record, a start far off leads
    to a local minimum; fit a shorter piece first. Bounds stop a step, they do not guide it.
    Standard errors take residuals as white; start values of the motion are taken as known.
    """
    check_model("identify_motion", model)
    throw = checks.flag("identify_motion: throw", throw)
    iterations = checks.count("identify_motion: iterations", iterations)
    p, x0 = model.named("p", p), model.named("x0", x0)
    u = model.named("u", u)
    task = _task(model, t, measured, free, p, x0, u, rtol)
    w = np.array([model.values("p", p)[model.p.index(v)] for v in task.fitted]) / task.units
    run = task.run(w, throw=True)
    r, damping, status, count = task.residuals(run), 1e-3, Status.MAX_ITERATIONS, 0
    for count in range(iterations):  # noqa: B007
        found = _better(task, w, r, task.slopes(run), damping)
        if found is None:
            status = Status.SOLVED
            break
        w, run, r, damping = found
    result = _result(task, w, run, r, status, count)
    if throw and not status.ok:
        raise SolveError(f"identify_motion: {result.message}", status, result)
    return result


def _better(
    task: _Task, w: Array, r: Array, J: Array, damping: float
) -> tuple[Array, Trajectory, Array, float] | None:
    """The next parameters with their motion, residuals and damping; None at the minimum."""
    low, high = (_limits(task, side) for side in ("lower", "upper"))
    g, normal = J.T @ r, J.T @ J
    held = ((w - low < AT_BOUND) & (g > 0)) | ((high - w < AT_BOUND) & (g < 0))
    size = np.where(np.diag(normal) > 0, np.diag(normal), 1.0)
    normal, g = np.where(held | held[:, None], 0.0, normal), np.where(held, 0.0, g)
    while damping < STUCK:
        step = -np.linalg.solve(normal + np.diag(np.where(held, 1.0, damping * size)), g)
        trial = np.clip(w + step, low, high)
        if -g @ step < GAIN * (r @ r):
            return None
        run = task.run(trial)
        if run.status.ok:
            left = task.residuals(run)
            if left @ left < r @ r:
                return trial, run, left, damping / 10
        damping *= 5
    return None


def _limits(task: _Task, side: str) -> Array:
    return np.array([getattr(v, side) for v in task.fitted]) / task.units


def _task(
    model: Model,
    t: ArrayLike,
    measured: Mapping[str, ArrayLike],
    free: Iterable[str] | None,
    p: Mapping[str, float] | None,
    x0: Mapping[str, float] | None,
    u: Mapping[str, Input] | None,
    rtol: float,
) -> _Task:
    """The task, its data checked."""
    where, names = "identify_motion", [v.name for v in model.p]
    chosen = names if free is None else list(checks.names(f"{where}: free", free, names))
    times = checks.times(f"{where}: t", t)
    records = {
        name: checks.array(f"{where}: {name}", y)
        for name, y in checks.named(f"{where}: measured", measured, model.signals).items()
    }
    problems = list(_problems(times, records, chosen))
    if problems:
        raise ValueError(f"identify_motion: {'; '.join(problems)}")
    scales = {name: float(np.std(y)) for name, y in records.items()}
    return _Task(
        model, tuple(v for v in model.p if v.name in chosen), times, records, scales,
        dict(x0 or {}), dict(u or {}), dict(p or {}), rtol,
    )  # fmt: skip


def _problems(t: Array, records: Mapping[str, Array], chosen: list[str]) -> Iterator[str]:
    if not chosen:
        yield "expected a model with free parameters, got none; scene.model(free=[...])"
    if not records:
        yield "expected measured signals, got none"
    if t.size < 2:
        yield f"expected at least two times, got {t.size}"
    for name, y in records.items():
        if y.shape != t.shape:
            yield f"{name}: expected shape {t.shape}, got {y.shape}"
        elif np.ptp(y) == 0:
            yield f"{name}: expected a signal that changes, got a constant"


def _result(
    task: _Task, w: Array, run: Trajectory, r: Array, status: Status, count: int
) -> MotionFit:
    low, high = (_limits(task, side) for side in ("lower", "upper"))
    held = (w - low < AT_BOUND) | (high - w < AT_BOUND)
    found = precision(task.slopes(run) / task.units, r, held)
    names = [v.name for v in task.fitted]
    groups = tuple(tuple(names[i] for i in group) for group in found.undetermined)
    lost = {name: group for group in groups for name in group}
    estimates: dict[str, Estimate] = {}
    for i, v in enumerate(task.fitted):
        both = (found.standard_errors[i], found.block_errors[i])
        error, block = (float(e) if np.isfinite(e) and not held[i] else None for e in both)
        note = "at its bound" if held[i] else ""
        if v.name in lost:
            others = ", ".join(n for n in lost[v.name] if n != v.name)
            note = f"cannot be told from {others}" if others else "without influence"
        estimates[v.name] = Estimate(float(w[i] * task.units[i]), v.unit, error, block, note=note)
    left = {s: float(np.sqrt(np.mean((run[s] - y) ** 2))) for s, y in task.measured.items()}
    return MotionFit(estimates, found.correlation, groups, left, run, status, status.value, count)
