"""Identify mass, offset and the friction law of a drive from force and position."""

import warnings
from collections.abc import Callable, Iterable, Mapping

import numpy as np

from identification.old.choice import Choice, choose, is_coefficient
from identification.old.coordinates import coordinates
from identification.old.data import Array, Dataset
from identification.old.doubts import verdict
from identification.old.errors import evaluate
from identification.old.filters import Filter
from identification.old.precision import precision
from identification.old.problem import Fit, Problem, problem
from identification.old.regress import linear_regression
from identification.old.result import Estimate, Identification
from identification.old.signals import MotionSignals, differentiate
from identification.old.start import start_values
from symfric.foundation import checks
from symfric.foundation.parameters import parameters, with_values
from symfric.foundation.status import SolveError
from symfric.laws import Law, law_from_text
from symfric.laws.base.law import check_law
from symfric.laws.names import law_name
from symfric.scenes import Drive

Progress = Callable[[str, float], None]
"""Called with what is being done and the fraction done."""

AT_BOUND = 1e-5
"""Distance to a bound, in coordinates of the fit, below which a parameter stands at it."""


def identify(
    data: Dataset,
    law: Law | str,
    *,
    validate: Dataset | None = None,
    normal_force: float = 1.0,
    free: Iterable[str] = (),
    fixed: Mapping[str, float] | None = None,
    filter: Filter | None = None,
    folds: int = 0,
    throw: bool = True,
    progress: Progress | None = None,
) -> Identification:
    """Fit a static friction law to a record of the scene `drive`.

        minimise sum (D [force - m a - F(v, N) - offset])^2

    with v, a by zero-phase filtering and differences and D a common low pass and decimation.
    Linear regression and a scan over the velocity scale give the start; Ipopt with the exact
    Hessian does the fit, parameters scaled or logarithmic inside the bounds of their metadata.

    Args:
        data: equally spaced samples of position and force.
        law: any static law, or its name such as "coulomb+viscous" or "asymmetric(stribeck)".
        validate: second record, for errors only.
        normal_force: N [N]. With the default 1 N the coefficients mu read as newtons.
        free: parameters to fit beside the default ones (see `identification.old.choice.choose`).
        fixed: parameters held at given values.
        filter: cut-off and decimation; from the data if none is given.
        folds: number of pieces (>= 2) for cross-validation inside the record; 0 leaves it out.
        throw: raise `SolveError` if the solver fails; its `partial` is the result so far.
        progress: called with a text and the fraction done.

    Returns:
        Estimates with uncertainty, errors on both records, the fitted drive.

    Raises:
        ValueError: a law with states, unknown names, data that cannot be used.
        SolveError: the fit failed, or found what cannot be (a mass of nothing, a force that the
            law does not explain).

    Warns:
        UserWarning: of a record that is clipped, has spikes or moves one way; so does `message`.

    Limits: force is taken at the sample instants; a command that is held for a sample leads by
    half of it, which lowers the viscous coefficient by about m w^2 h / 2 for motion at w [rad/s].
    Filtering blurs the switch of friction at standstill, which raises the mass by some tenths of a
    per cent; `Filter(v_min=...)` leaves those equations out. Noise in v biases the slope of a law
    near rest, since v is taken as known. A Stribeck part needs motion at speeds around its velocity
    scale, or its standard errors say so.
    """
    _check(data, validate, filter, progress)
    throw, folds = checks.flag("identify: throw", throw), _folds(folds)
    tell = progress or _silent
    law = law_from_text(law) if isinstance(law, str) else law
    check_law("identify: law", law)
    signals = differentiate(data, filter)
    v_max = float(np.abs(signals.v).max())
    load = checks.number("identify: normal_force", normal_force, unit="N", above=0.0)
    folds = _fewer_than(folds, signals.kept.size)
    choice = choose(law, v_max, load, checks.names("identify: free", free), _numbers(fixed))
    if not choice.free:
        raise ValueError("identify: expected at least one free parameter, got all fixed")
    if signals.kept.size < 3 * len(choice.free):
        raise ValueError(
            f"data '{data.name}': expected at least {3 * len(choice.free)} equations for "
            f"{len(choice.free)} parameters, got {signals.kept.size}; lower the decimation"
        )
    tell("start values", 0.1)
    linear = linear_regression(signals)
    level = max(abs(linear.values["F_c"]), linear.force_rms)
    at = coordinates(choice, level, float(signals.v.std()), abs(linear.values["m"]))
    task = problem(at, signals, max(linear.force_rms, 1e-9 * level))
    start = start_values(choice, linear, task)
    tell("fit", 0.4)
    fit = task.solve(start)
    drive = with_values(choice.drive, _values(task, fit.w))
    tell("cross-validation", 0.6)
    crossed = _cross_validation(task, fit, signals, folds) if folds else {}
    tell("simulation", 0.8)
    estimates, correlation, undetermined = _estimates(drive, choice, task, fit)
    errors = evaluate(drive, data, signals.filter)
    end = verdict(fit.status, data, signals.v, linear, estimates, errors)
    result = Identification(
        law=law_name(law),
        drive=drive,
        parameters=estimates,
        levels=_levels(drive, estimates),
        names=choice.free,
        correlation=correlation,
        undetermined=undetermined,
        status=end.status,
        message=end.message,
        errors=errors,
        validation=None if validate is None else evaluate(drive, validate, signals.filter),
        cross_validation=crossed,
        linear=linear,
        filter=signals.filter,
        iterations=fit.iterations,
        benchmark=data.benchmark,
        signals=signals,
    )
    tell("done", 1.0)
    if throw and not end.status.ok:
        raise SolveError(f"identify {result.law}: {result.message}", end.status, result)
    if end.record:
        warnings.warn(f"data '{data.name}': {' '.join(end.record)}", stacklevel=2)
    return result


def _check(data: object, validate: object, filter: object, progress: object) -> None:
    """Refuse what is of the wrong kind."""
    record = "a record, such as read_data('record.csv')"
    checks.kind("identify: data", data, Dataset, record)
    if validate is not None:
        checks.kind("identify: validate", validate, Dataset, record)
    if filter is not None:
        checks.kind("identify: filter", filter, Filter, "a filter, such as Filter(...)")
    if progress is not None:
        checks.function("identify: progress", progress, "a function of a text and a fraction")


def _folds(folds: object) -> int:
    found = checks.count("identify: folds", folds, least=0)
    if found == 1:
        raise ValueError("identify: folds: expected 0 or at least 2, got 1")
    return found


def _fewer_than(folds: int, equations: int) -> int:
    if folds > equations:
        raise ValueError(
            f"identify: folds: expected at most {equations}, the number of equations, got {folds}"
        )
    return folds


def _numbers(fixed: object) -> dict[str, float]:
    given = checks.named("identify: fixed", fixed)
    return {name: checks.number(f"identify: fixed {name}", x) for name, x in given.items()}


def _silent(text: str, fraction: float) -> None:
    """Shows no progress: the default of callers that are no terminal."""
    del text, fraction


def _levels(drive: Drive, estimates: Mapping[str, Estimate]) -> dict[str, Estimate]:
    """The force levels mu N [N] of the friction coefficients."""
    coefficients = [n for n, p in parameters(drive).items() if is_coefficient(p)]
    return {name: estimates[name].times(float(drive.N), "N") for name in coefficients}


def _values(task: Problem, w: Array) -> dict[str, float]:
    values = task.coordinates.values(w).tolist()
    return dict(zip(task.coordinates.names, values, strict=True))


def _estimates(
    drive: Drive, choice: Choice, task: Problem, fit: Fit
) -> tuple[dict[str, Estimate], Array, tuple[tuple[str, ...], ...]]:
    """Estimates by name, correlation of the fitted ones, groups the data cannot tell apart."""
    at = task.coordinates
    held = (fit.w - at.lower < AT_BOUND) | (at.upper - fit.w < AT_BOUND)
    J = task.sensitivities(fit.w) @ np.linalg.inv(at.slope(fit.w))
    found = precision(J, task.residuals(fit.w), held)
    groups = tuple(tuple(at.names[i] for i in group) for group in found.undetermined)
    notes = {at.names[i]: "at its bound" for i in np.flatnonzero(held)}
    for group in groups:
        for name in group:
            others = ", ".join(n for n in group if n != name)
            notes[name] = f"cannot be told from {others}" if others else "without influence"
    estimates: dict[str, Estimate] = {}
    for name, parameter in parameters(drive).items():
        value, unit = float(parameter.value), parameter.unit
        if name in choice.reasons:
            estimates[name] = Estimate(value, unit, fixed=True, note=choice.reasons[name])
            continue
        i = at.names.index(name)
        errors = found.standard_errors[i], found.block_errors[i]
        known = [float(e) if np.isfinite(e) else None for e in errors]
        estimates[name] = Estimate(value, unit, known[0], known[1], note=notes.get(name, ""))
    return estimates, found.correlation, groups


def _cross_validation(
    task: Problem, fit: Fit, signals: MotionSignals, folds: int
) -> dict[str, float]:
    """Force errors on each of `folds` pieces with parameters fitted to the others."""
    force = signals.equations(signals.force)
    if folds > task.rows:
        raise ValueError(
            f"identify: folds: expected at most {task.rows} pieces (equations), got {folds}"
        )
    pieces = np.array_split(np.arange(task.rows), folds)
    error = np.zeros(task.rows)
    for piece in pieces:
        weights = np.ones(task.rows)
        weights[piece] = 0.0
        error[piece] = task.residuals(task.solve(task.coordinates.inside(fit.w), weights).w)[piece]
    each = [np.linalg.norm(error[p]) / np.linalg.norm(force[p]) for p in pieces]
    return {
        "folds": float(folds),
        "force_relative": 100 * float(np.linalg.norm(error) / np.linalg.norm(force)),
        "worst": 100 * float(max(each)),
    }
