"""States, law states and unknown loads from measurements over a moving horizon.

At each sample the states x_s ... x_k of the last M samples minimise

    |x_s - m|^2_P + sum |x_i+1 - flow(x_i, u_i)|^2_Q + sum |y_i - h(x_i, u_i)|^2_R

with |e|^2_P = e' inv(P) e. Unknown loads are further states whose change per step is noise. Q
contains the noise of the model, and the errors of its integration and linearisation over the last
deviations. The arrival cost (m, P) is the prediction from the sample that left the horizon,
linearised at its last estimate. For linear models, every horizon gives the Kalman filter.

Bounds on states and loads: a value outside its bound is measured at the bound with a very small
deviation, which leaves it slightly outside as long as the data press it there. The covariances
ignore bounds.
Sources: Rao, Rawlings and Mayne, IEEE Trans. Autom. Control 48, 2003, 246-258 (arrival cost); Bell,
SIAM J. Optim. 4, 1994, 626-636 (smoother as Gauss-Newton step).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eigh, pinvh
from scipy.stats import chi2

from ocp.formulation.phase import Ranges, as_box, is_range
from ocp.horizon import HorizonFunctions, Window
from symfric.foundation import checks
from symfric.foundation.panels import panels, save
from symfric.foundation.parameters import Variable, check_names
from symfric.foundation.shown import brief, combination
from symfric.integrator import flow
from symfric.model import Model, check_model

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
INFORMED = 0.25
"""Ratio of variances with and without measurements below which a combination is observable."""
CHANCE = 0.01
"""Probability of innovations by chance below which the model does not agree with the data."""
UNSEEN = 1e12
"""Largest variance without measurements, in units of the squared spread."""
SMALLEST = 1e-100
"""Smallest deviation; the largest is its reciprocal. Their squares are finite and positive."""
KNOWN = 0.1
"""Deviation without measurements, in units of the spread, below which the model determines it."""


@final
@dataclass(frozen=True, eq=False)
class Estimate:
    """Estimated states and loads, of which `estimate["v"]` is one signal.

    Attributes:
        t: times of the samples [s], shape (n,).
        signals: state or load -> its estimate from the data up to each time, shape (n,).
        deviations: state or load -> standard deviation of this estimate.
        smooth: state or load -> its estimate over the last horizon from all data of the horizon.
        units: unit of each state and load.
        unobservable: combinations of states and loads, in units of their spread, that the
            measurements do not determine: without them the variance is at most 4 times as large.
        unconverged: number of samples at which the Gauss-Newton method did not converge.
        innovations: square of each innovation (measured minus predicted signals), relative to its
            covariance, shape (n,); on average the number of signals if the model holds.
        samples: number of measured samples of all signals, without missing ones.
        inconsistent: first and last time of the interval of one horizon whose innovations are least
            likely [s], shape (2,), if their p-value times the number of such intervals is below
            1 %; otherwise shape (0,).
        step_errors: state or load -> largest error of the integration and of the linearised model
            over one sampling interval; deviations contain it.
    """

    t: Array
    signals: Mapping[str, Array]
    deviations: Mapping[str, Array]
    smooth: Mapping[str, Array]
    units: Mapping[str, str]
    unobservable: tuple[str, ...]
    unconverged: int
    innovations: Array
    samples: int
    inconsistent: Array
    step_errors: Mapping[str, float]

    __repr__ = brief

    @property
    def verdict(self) -> str:
        """Sentence about the deviations: they hold only if the model agrees with the data."""
        if self.inconsistent.size:
            return (
                "The deviations do not hold: from t = {:.4g} to {:.4g} s the innovations exceed "
                "those of the noise; the model, `noise` or `spread` does not describe the data "
                "there".format(*self.inconsistent)
            )
        if not self.samples:
            return "There is no sample to compare with the model"
        said = f"The data do not determine {'; '.join(self.unobservable)}"
        if not self.unobservable:
            said = "The innovations do not exceed those of the noise"
        if self.unconverged:
            said += f"; at {self.unconverged} of {self.t.size} samples the method did not converge"
        return said

    def __getitem__(self, name: str) -> Array:
        check_names("estimate", [name], self.signals)
        return self.signals[name]

    def plot(self, *names: str, path: str | Path | None = None) -> Figure:
        """Plot estimates over time, one panel each, with bands of two standard deviations.

        Args:
            names: states and loads to show, by default all.
            path: image file; its extension selects the format.
        """
        check_names("plot of an estimate", names, self.signals)
        shown = list(names) or list(self.signals)
        figure, axes = panels(len(shown))
        for axis, name in zip(axes, shown, strict=True):
            value, deviation = self.signals[name], self.deviations[name]
            axis.fill_between(self.t, value - 2 * deviation, value + 2 * deviation, alpha=0.2)
            axis.plot(self.t, value, linewidth=1.2)
            axis.set_ylabel(f"{name} [{self.units[name]}]")
        axes[-1].set_xlabel("t [s]")
        for begin, end in self.inconsistent.reshape(-1, 2):
            for axis in axes:
                axis.axvspan(begin, end, color="tab:red", alpha=0.2, label="innovations too large")
            axes[0].legend()
        return save(figure, path)


def estimate(
    model: Model,
    data: Mapping[str, ArrayLike],
    *,
    step: float,
    horizon: int,
    noise: Mapping[str, float],
    unknown: Sequence[str] = (),
    start: Mapping[str, float] | None = None,
    spread: Mapping[str, float] | None = None,
    bounds: Ranges | None = None,
    p: Mapping[str, float] | None = None,
    steps: int = 4,
) -> Estimate:
    """Estimate states of `model`, including those of its laws, and unknown inputs and parameters.

    Args:
        model: explicit model without events and without algebraic variables; use a law that is
            smooth over the speeds of the noise, or a bristle law.
        data: input or signal -> samples at the times 0, step, ...; inputs are held over a step. A
            missing sample of a signal is NaN.
        step: sampling interval [s].
        horizon: number of samples M of the horizon.
        noise: measured signal -> standard deviation of a sample; state or unknown ->
            standard deviation of its random change in one second [unit/sqrt(s)], 0 by default.
        unknown: inputs that are not measured (loads), and parameters that drift (wear); they change
            by noise only.
        start, spread: state or unknown -> value at t = 0 and its standard deviation; by
            default the start of the variable (0 for states of laws) and its nominal value.
        bounds: state or unknown -> (lower, upper), None for no bound; they hold at all
            samples. Deviations ignore them, so they are too large near a bound.
        p: parameter -> value.
        steps: number of integration steps in each sampling interval. The difference from twice as
            many steps is an additional noise of the states.

    Raises:
        ValueError: bad input.
        SolveError: the motion becomes infinite.

    Limits: the method finds a local minimum; `unconverged` counts the samples at which it does not
    converge. Deviations contain the mean square of the error of the linearised model. Bristles
    that start to slip within a deviation have larger errors. In sliding, the deviation of z tends
    to zero, below integration errors: with LuGre (axis of the how-to guide), 83 to 87 % of the
    errors of z are within two deviations; single errors, below 1e-12 m, reach 5e4 deviations.
    """
    check_model("estimate", model)
    step = checks.number("estimate: step", step, above=0.0)
    horizon = checks.count("estimate: horizon", horizon, least=2)
    steps = checks.count("estimate: steps", steps)
    unknown = checks.names("estimate: unknown", unknown, [v.name for v in (*model.u, *model.p)])
    rows = _checked(model, data, unknown)
    measured = [name for name in rows if name not in {v.name for v in model.u}]
    values = dict(zip((v.name for v in model.p), model.values("p", p), strict=True))
    drifting = [replace(v, start=float(values[v.name])) for v in model.p if v.name in unknown]
    states = [*model.x, *(v for v in model.u if v.name in unknown), *drifting]
    names = [v.name for v in states]
    start, spread = _numbers("start", start, names), _numbers("spread", spread, names)
    noise = _numbers("noise", noise, [*names, *measured])
    wrong = [f"spread of '{n}' above 0" for n, x in spread.items() if not x > 0.0]
    wrong += [f"noise of '{n}' above 0" for n in measured if not noise.get(n, 0.0) > 0.0]
    wrong += [f"noise of '{n}' of at least 0" for n in names if noise.get(n, 0.0) < 0.0]
    for what, sizes in (("spread", spread), ("noise", noise)):
        far = [n for n, x in sizes.items() if x > 0.0 and not SMALLEST < x < 1.0 / SMALLEST]
        wrong += [f"{what} of '{n}' from {SMALLEST:g} to {1.0 / SMALLEST:g}" for n in far]
    boxes = checks.named("estimate: bounds", bounds, names)
    wrong += [f"bounds of '{n}' as (lower, upper)" for n, box in boxes.items() if not is_range(box)]
    if wrong:
        raise ValueError(f"estimate: expected {'; '.join(wrong)}")
    box = np.array([as_box(boxes.get(n, (None, None))) for n in names])
    scale = np.array([spread.get(v.name, v.nominal) for v in states], dtype=float)
    first = np.array([start.get(v.name, v.start) for v in states], dtype=float)
    first = np.nan_to_num(first) / scale  # states of laws have no start
    walk = np.array([noise.get(v.name, 0.0) for v in states]) / scale
    loads = states[len(model.x) :]
    functions = HorizonFunctions(
        *_functions(model, loads, measured, step, steps),
        fixed=(scale, np.array([*values.values()], dtype=float)),
        Q=np.diag(walk**2 * step),
        R=np.array([noise[name] ** 2 for name in measured]),
        lower=box[:, 0] / scale,
        upper=box[:, 1] / scale,
    )
    y = np.array([rows[name] for name in measured])
    u = np.array([rows[v.name] for v in model.u if v.name in rows]).reshape(-1, y.shape[1])
    return _moved(functions, y, u, first, horizon, states, scale, step)


def _numbers(
    what: str, given: Mapping[str, float] | None, known: Sequence[str]
) -> dict[str, float]:
    """Return finite numbers by name."""
    found = checks.named(f"estimate: {what}", given, known)
    return {n: checks.number(f"estimate: {what} of '{n}'", x) for n, x in found.items()}


def _checked(
    model: Model, data: Mapping[str, ArrayLike], unknown: Sequence[str]
) -> dict[str, Array]:
    """Return the data as rows of equal length."""
    inputs, wrong = [v.name for v in model.u], list[str]()
    given = checks.named("estimate: data", data, list(model.signals))
    rows = {
        n: checks.array(f"estimate: data of '{n}'", row, nan=n not in inputs)
        for n, row in given.items()
    }
    if model.ode is None or model.z or model.events or ca.depends_on(model.ode, model.t):
        wrong.append("an explicit model without events, algebraic variables and time")
    if not set(rows) - set(inputs):
        wrong.append("data of at least one signal that is not an input")
    wrong += [
        f"data of the input '{name}', or its name in `unknown`"
        for name in inputs
        if (name in rows) == (name in unknown)
    ]
    if len({row.size for row in rows.values()} | {0}) != 2:
        wrong.append("rows of equal length, not empty")
    wrong += [f"finite samples or NaN of '{n}'" for n in rows if np.isinf(rows[n]).any()]
    if wrong:
        raise ValueError(f"estimate: model '{model.name}': expected {'; '.join(wrong)}")
    return rows


def _functions(
    model: Model, loads: Sequence[Variable], measured: Sequence[str], step: float, steps: int
) -> tuple[ca.Function, ...]:
    """Return the first of `HorizonFunctions`, of (xi, u, scale, p); u are the measured inputs."""
    kept: dict[Any, tuple[ca.Function, ...]] = model.memory.setdefault("ocp estimate", {})
    key = tuple(v.name for v in loads), tuple(measured), step, steps
    if key in kept:
        return kept[key]
    names = [v.name for v in loads]
    nx, given = len(model.x), [v for v in model.u if v.name not in names]
    xi, u = ca.MX.sym("xi", nx + len(loads)), ca.MX.sym("u", len(given))
    scale, values = ca.MX.sym("scale", xi.shape[0]), ca.MX.sym("p", len(model.p))
    x = xi * scale
    places = {v.name: u[i] for i, v in enumerate(given)}
    own = {name: x[nx + i] for i, name in enumerate(names)}
    places |= own
    p = ca.vertcat(ca.MX(0, 1), *(own.get(v.name, values[i]) for i, v in enumerate(model.p)))
    inputs = ca.vertcat(ca.MX(0, 1), *(places[v.name] for v in model.u))
    coarse, fine = (flow(model, steps=n)(x[:nx], inputs, p, step) for n in (steps, 2 * steps))
    after, finer = (ca.vertcat(state, x[nx:, 0]) / scale for state in (coarse, fine))
    symbols = [model.vector("x"), model.vector("u"), model.vector("p")]
    seen = ca.vertcat(*(model.expression(name) for name in measured))
    y = ca.Function("seen", symbols, [seen])(x[:nx], inputs, p)
    arguments = [xi, u, scale, values]
    kept[key] = (
        ca.Function("next", arguments, [after, ca.jacobian(after, xi)]),
        *(ca.Function("ahead", arguments, [state]) for state in (after, finer)),
        ca.Function("measured", arguments, [y, ca.jacobian(y, xi)]),
    )
    return kept[key]


def _moved(
    functions: HorizonFunctions, y: Array, u: Array, first: Array, horizon: int,
    states: Sequence[Variable], scale: Array, step: float,
) -> Estimate:  # fmt: skip
    """Move the horizon over all samples."""
    count, names = y.shape[1], [v.name for v in states]
    prior, unconverged = (first, np.eye(first.size)), 0
    free = prior[1]  # covariance at the first sample of the horizon without measurements
    means, deviations = np.empty((first.size, count)), np.empty((first.size, count))
    errors, innovations = np.zeros((count, first.size, first.size)), np.empty(count)
    still = 0.0 * first[:, None]
    window = Window(functions, y[:, :1], u[:, :1], errors[:1], prior)
    found = window.solved(still)
    for k in range(count):
        if k:
            begin = max(0, k + 1 - horizon)
            weights = np.hstack([found.weights, still])
            if k >= horizon:
                prior, weights = found.predicted[1], weights[:, 1:]
                weights[:, 0] = pinvh(prior[1]) @ (found.smooth[:, 1] - prior[0])
                free = _grown(free, found.slopes[0], functions.Q)
            here = slice(begin, k + 1)
            window = Window(functions, y[:, here], u[:, here], errors[here], prior)
            found = window.solved(weights)
        unconverged += not found.converged
        means[:, k] = functions.inside(found.smooth)[:, -1]
        errors[k] = window.step_error(found)
        innovations[k] = found.innovations[-1]
        deviations[:, k] = np.sqrt(np.maximum(np.diag(found.filtered[-1]), 0.0))
    for slope in found.slopes[:-1]:
        free = _grown(free, slope, functions.Q)
    smooth = functions.inside(found.smooth) * scale[:, None]
    return Estimate(
        t=step * np.arange(count),
        signals=dict(zip(names, means * scale[:, None], strict=True)),
        deviations=dict(zip(names, deviations * scale[:, None], strict=True)),
        smooth=dict(zip(names, smooth, strict=True)),
        units={v.name: v.unit for v in states},
        unobservable=_unobservable(found.filtered[-1], free, names),
        unconverged=unconverged,
        innovations=innovations,
        samples=int(np.isfinite(y).sum()),
        inconsistent=_inconsistent(innovations, np.isfinite(y).sum(axis=0), horizon) * step,
        step_errors=dict(zip(names, np.sqrt(errors.max(axis=0).diagonal()) * scale, strict=True)),
    )


def _grown(P: Array, slope: Array, noise: Array) -> Array:
    """Return a covariance after a step, reduced to `UNSEEN`: unstable models let it overflow."""
    after = slope @ P @ slope.T + noise
    return after * min(1.0, UNSEEN / max(after.max(), 1.0))


def _inconsistent(innovations: Array, sizes: Array, horizon: int) -> Array:
    """Return first and last sample of the least likely interval, or nothing if it may be chance."""
    length = min(horizon, innovations.size)
    sums, degrees = (
        np.convolve(row, np.ones(length), mode="valid") for row in (innovations, sizes)
    )
    p = chi2.sf(sums, np.maximum(degrees, 1))
    worst = int(np.argmin(p))
    by_chance = p[worst] * innovations.size / length > CHANCE
    return np.array([] if by_chance else [worst, worst + length - 1], dtype=float)


def _unobservable(P: Array, free: Array, names: Sequence[str]) -> tuple[str, ...]:
    """Return combinations whose variance the measurements reduce by less than `INFORMED`."""
    ratios, vectors = eigh(P, free + 1e-12 * max(1.0, free.max()) * np.eye(len(names)))
    return tuple(
        combination(v, names)
        for ratio, v in zip(ratios, vectors.T, strict=True)
        if ratio > INFORMED and 1.0 / np.linalg.norm(v) > KNOWN
    )
