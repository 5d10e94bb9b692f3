"""Parameters of any model from measured signals: the motion is simulated and compared.

    minimise 1/2 sum_s sum_i ((y_s(t_i; p) - measured_s(t_i)) / scale_s)^2

by Gauss-Newton steps in a region of trust (`descent`) with the derivatives of the
steps that the simulation took. It takes what `identify` does not: laws with states, several bodies,
friction from reactions. Parameters that cannot be negative are fitted by their logarithm, because
nobody knows their scale (a bristle's stiffness may be 1e3 or 1e8 N/m); the others by their value.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from identification.old.data import Array
from identification.old.descent import Descent, Point, descend
from identification.old.precision import precision
from identification.old.result import Estimate
from symfric.foundation import checks
from symfric.foundation.parameters import Variable
from symfric.foundation.status import SolveError, Status
from symfric.integrator import Input, Trajectory, simulate
from symfric.model import Model, check_model

AT_BOUND = 1e-9
"""Distance to a bound, relative to the parameter's start or nominal value, that is none."""
ROUNDING = 10.0
"""Error of a simulated signal over rtol times its size, for which the fit is prepared."""
CORRELATED = 0.5
"""Correlation of what is left from one sample to the next that is worth a sentence."""


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
        status, message: how the fit ended: at a minimum, and what the record does not tell there;
            or why not. A minimum need not be the lowest one: look at `errors`.
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
    def start(self) -> Array:
        """Start values of the fitted parameters."""
        values = self.model.values("p", self.p)
        return np.array([values[self.model.p.index(v)] for v in self.fitted])

    @property
    def units(self) -> Array:
        """What parameters are measured by: start value or nominal value."""
        return np.where(self.start, np.abs(self.start), [v.nominal for v in self.fitted])

    @property
    def logarithmic(self) -> NDArray[np.bool_]:
        """Which parameters are fitted by their logarithm: those that start and stay positive."""
        return np.array([v.lower >= 0 for v in self.fitted]) & (self.start > 0)

    def coordinates(self, p: Array) -> Array:
        """Coordinates of parameters."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.logarithmic, np.log(p / self.units), p / self.units)

    def values(self, w: Array) -> Array:
        """Parameters at coordinates."""
        return self.units * np.where(self.logarithmic, np.exp(w * self.logarithmic), w)

    @property
    def box(self) -> tuple[Array, Array]:
        """Bounds of the coordinates."""
        low, high = (np.array([getattr(v, s) for v in self.fitted]) for s in ("lower", "upper"))
        return self.coordinates(low), self.coordinates(high)

    @property
    def rounding(self) -> float:
        """Norm of what the tolerance of the simulation leaves in the residuals."""
        sizes = [float(np.abs(y).max()) / self.scales[s] for s, y in self.measured.items()]
        return ROUNDING * self.rtol * float(np.linalg.norm(sizes)) * float(np.sqrt(self.t.size))

    def run(self, p: Array, throw: bool = False) -> Trajectory:
        """The motion with the parameters `p`."""
        names = [v.name for v in self.fitted]
        return simulate(
            self.model, float(self.t[-1]), t_start=float(self.t[0]), x0=self.x0, u=self.u,
            p=dict(self.p) | dict(zip(names, p.tolist(), strict=True)), rtol=self.rtol,
            t_eval=self.t, sensitivities=names, throw=throw,
        )  # fmt: skip

    def point(self, w: Array, run: Trajectory) -> Point:
        """The residuals (y - measured) / scale of all signals, one after the other."""
        r = np.concatenate([(run[s] - y) / self.scales[s] for s, y in self.measured.items()])
        slope = np.where(self.logarithmic, self.values(w), self.units)
        return Point(w, r, self.slopes(run) * slope, run)

    def correlated(self, point: Point) -> Iterator[str]:
        """Signals whose residuals follow each other from sample to sample."""
        if np.sqrt(point.cost) <= ROUNDING * self.rounding:
            return
        for name, e in zip(self.measured, np.split(point.r, len(self.measured)), strict=True):
            e = e - e.mean()
            if e[1:] @ e[:-1] > max(CORRELATED, 4 / np.sqrt(e.size)) * (e @ e):
                yield name

    def slopes(self, run: Trajectory) -> Array:
        """Derivatives of the residuals by the parameters, a column for each."""
        columns = [
            np.concatenate([run.sensitivities[v.name][s] / self.scales[s] for s in self.measured])
            for v in self.fitted
        ]
        return np.column_stack(columns)

    def trial(self, w: Array) -> Point | str:
        """The point at `w`; why the motion cannot be simulated there."""
        p = self.values(w)
        there = ", ".join(f"{v.name} = {x:.5g}" for v, x in zip(self.fitted, p, strict=True))
        try:
            run = self.run(p)
        except ValueError as error:  # no consistent start with these parameters
            return f"with {there}: {error}"
        if not run.status.ok:
            return f"with {there}: {run.message}"
        found = self.point(w, run)
        if not (np.isfinite(found.r).all() and np.isfinite(found.J).all()):
            return f"with {there}: the motion or its derivatives are not finite"
        return found


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
    iterations: int = 200,
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
    w = task.coordinates(task.start)
    start = task.point(w, task.run(task.start, throw=True))
    result = _result(task, descend(task.trial, start, *task.box, task.rounding, iterations))
    if throw and not result.status.ok:
        raise SolveError(f"identify_motion: {result.message}", result.status, result)
    return result


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


def _result(task: _Task, end: Descent) -> MotionFit:
    run, values = end.point.run, task.values(end.point.w)
    low, high = (np.array([getattr(v, side) for v in task.fitted]) for side in ("lower", "upper"))
    near = AT_BOUND * task.units
    held = (values - low < near) | (high - values < near)
    found = precision(task.slopes(run), end.point.r, held)
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
        estimates[v.name] = Estimate(float(values[i]), v.unit, error, block, note=note)
    left = {s: float(np.sqrt(np.mean((run[s] - y) ** 2))) for s, y in task.measured.items()}
    message = _message(end, estimates, task.correlated(end.point))
    return MotionFit(
        estimates, found.correlation, groups, left, run, end.status, message, end.steps
    )


def _message(end: Descent, estimates: Mapping[str, Estimate], correlated: Iterable[str]) -> str:
    """How the fit ended, and what it does not tell."""
    notes = [f"{name} is {e.note}" for name, e in estimates.items() if e.note == "at its bound"]
    notes += [f"{n} {e.note}" for n, e in estimates.items() if e.note.startswith("cannot")]
    notes += [
        f"{n} is {e.note} there" for n, e in estimates.items() if e.note.startswith("without")
    ]
    notes += [
        f"what is left of {name} is no white noise: the model does not follow it, this is not the "
        "lowest minimum, or its noise is coloured and the errors given here are too small"
        for name in correlated
    ]
    more = [f"{text}." for text in (end.why, "; ".join(notes)) if text]
    return " ".join([end.status.value, *more])
