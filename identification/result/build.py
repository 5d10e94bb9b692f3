"""Assembly of the result of a fit from its problem, its starts and its verdict."""

import platform
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass, replace
from itertools import pairwise
from math import inf, isfinite, nan
from typing import Any

import casadi as ca
import numpy as np

from identification.data.dataset import Dataset
from identification.data.differentiate import differentiated
from identification.data.findings import Finding
from identification.data.record import Record
from identification.residuals.evaluation import Array
from identification.result.fitted import Fitted
from identification.result.outcome import sides_of
from identification.result.parts import (
    Asked,
    Estimate,
    FrictionCurve,
    Kind,
    Line,
    Live,
    Series,
    Tried,
    errors_of,
    labels,
)
from identification.solving.descent import Start
from identification.solving.task import Task
from identification.unknowns.roles import is_coefficient
from identification.unknowns.spec import Above, Range, Tied
from identification.verdict.judge import Verdict
from symfric import __version__
from symfric.foundation.parameters import Parametric, parameters
from symfric.foundation.status import Status
from symfric.foundation.units import turned
from symfric.laws import Law
from symfric.laws.base.law import FORCE
from symfric.laws.composed.populations import steady_force
from symfric.model import Model
from symfric.scenes import Drive, Scene

SHOWN = 6
"""Size of the longest array that is written out."""
PLAIN = (str, int, float, tuple)
"""Types of values that are compared with defaults."""


def written(value: object) -> str:
    """Return Python code for `value`, without defaults.

    Data and models are represented by a name, long arrays by three dots. Fields without a default
    precede the others and have no names.
    """
    if isinstance(value, Dataset):
        return "data"
    if isinstance(value, Model):
        return value.name
    if isinstance(value, Range | Above | Tied):
        return _rule(value)
    if isinstance(value, np.ndarray) and value.size > SHOWN:
        return "..."
    if isinstance(value, Mapping):
        items: Mapping[Any, Any] = value  # pyright: ignore[reportUnknownVariableType]
        return f"{{{', '.join(f'{k!r}: {written(v)}' for k, v in items.items())}}}"
    if callable(value) and not is_dataclass(value):
        return getattr(value, "__name__", "function")
    if not is_dataclass(value) or isinstance(value, Parametric):
        return repr(value)
    given: list[str] = []
    for item in fields(value):
        own, default = getattr(value, item.name), item.default
        if default is MISSING:
            given.append(written(own))
        elif own is not default and not (isinstance(own, PLAIN) and own == default):
            given.append(f"{item.name}={written(own)}")
    return f"{type(value).__name__}({', '.join(given)})"


def _rule(rule: Range | Above | Tied) -> str:
    """Return the call of `log`, `linear`, `above` or `tied` that created the rule."""
    if isinstance(rule, Tied):
        name, factor = (getattr(rule.rule, n, None) for n in ("name", "factor"))
        return f"tied({name!r}, {factor!r})" if name else f"tied({written(rule.rule)})"
    start = [] if rule.start is None else [f"start={rule.start!r}"]
    if isinstance(rule, Above):
        upper = [repr(rule.upper)] if rule.upper < inf else []
        return f"above({', '.join([repr(rule.name), *upper, *start])})"
    if rule.logarithmic is None and rule.start is not None and rule.lower == -inf:
        return repr(rule.start)
    kind = {True: "log", False: "linear", None: ""}[rule.logarithmic]
    return f"{kind}({', '.join([repr(rule.lower), repr(rule.upper), *start])})"


STEP = 1e-2
"""Step of the differences for the band of a curve, in standard errors."""
MOST = 40
"""Number of values above which correlations with start values of records are left out."""
POINTS = 2000
"""Largest number of points of a line, about two for each column of pixels."""
GAP = 3.0
"""Smallest gap in time, relative to the usual step."""
TOGETHER, LEAST = 24_000, 300
"""Number of points of all lines of one type, which many channels share, and least for each."""
SIDE = 300
"""Number of points of a curve in each direction, down to a millionth of the largest speed."""
DOTS = 4000
"""Largest number of measured points that are drawn, over all records."""
REST = 1e-3
"""Share of the largest speed above which a point has a direction."""


def fitted(
    live: Live,
    starts: Sequence[Tried],
    verdict: Verdict,
    findings: Sequence[Finding] = (),
    *,
    status: Status,
    message: str = "",
    seconds: float = 0.0,
    call: str = "",
    kind: Kind | None = None,
    asked: Asked | None = None,
) -> Fitted:
    """Return the result of a fit.

    Args:
        live: problem with the final noise levels, and the end of the best start.
        starts: ends of all starts, best first.
        verdict: assessment of the residuals at the best end.
        findings: warnings on the data.
        status: status of the fit, including the verdict.
        message: details of the end; the sentence of `status` precedes it.
        seconds: duration of all starts.
        call: Python code of the call.
        kind: residuals of the first fit; None: those of `live`.
        asked: arguments that restore the problem, also from a file.
    """
    task, certain, by = live.task, live.covariance, written(kind or live.kind)
    records = tuple(r.name for r in live.data)
    left_out = set(task.unknowns.nuisance) if len(certain.names) > MOST else set[str]()
    shown = [i for i, name in enumerate(certain.names) if name not in left_out]
    estimates = _estimates(live)
    return Fitted(
        name=live.subject.name,
        kind=by,
        records=records,
        parameters=estimates,
        names=tuple(certain.names[i] for i in shown),
        correlation=certain.correlation[np.ix_(shown, shown)],
        undetermined=certain.undetermined,
        directions=certain.sentences,
        status=status,
        message=" ".join(part for part in (status.value, message) if part),
        verdict=verdict,
        errors=errors_of(task.residuals, records, live.point.evaluation.r, verdict.effective),
        validation=None,
        noise=dict(task.noise),
        starts=tuple(starts),
        findings=tuple(findings),
        series=_series(live, records, verdict),
        curve=_curve(live),
        law=live.closed.law,
        machine=live.closed.scene,
        seconds=seconds,
        evaluations=sum(s.evaluations for s in starts),
        made=_made(call, by),
        live=live,
        asked=asked,
        sides=() if live.data[0].drive is None else tuple(sides_of(live.data, estimates)),
    )


def _estimates(live: Live) -> dict[str, Estimate]:
    """Return the estimates of all parameters in the order of the subject, then of the records."""
    subject, task, made, found = live.subject, live.task, live.covariance, live.values
    own = {u.name: u for u in (*task.unknowns.unknowns, *task.residuals.own)}
    notes = dict(made.notes) | dict.fromkeys(made.at_bound, "at its bound")
    for group in made.undetermined:
        for name in group:
            others = ", ".join(n for n in group if n != name)
            notes[name] = f"not separable from {others}" if others else "without influence"
    columns = (made.standard_errors, made.low, made.high, made.white_errors)
    whole, unit_load = subject.scene or subject.law, subject.load == 1.0
    known = {} if whole is None else parameters(whole)
    estimates: dict[str, Estimate] = {}
    for name in dict.fromkeys([*subject.variables, *task.residuals.names]):
        unknown = own.get(name)
        unit = unknown.unit if unknown else subject.variables[name].unit
        if unit_load and name in known and is_coefficient(known[name]):  # a force under 1 N
            unit = turned("N") if live.data.rotary else "N"
        if name not in found:
            held, note = float(subject.held[name]), subject.reasons.get(name, "")
            estimates[name] = Estimate(held, unit, fixed=True, note=note)
            continue
        i = made.names.index(name)
        numbers = (float(column[i]) for column in columns)
        error, low, high, white = (x if isfinite(x) else None for x in numbers)
        other = "tied" if name in subject.ties else "not identifiable" * (error is None)
        note, nuisance = notes.get(name, other), unknown is not None and unknown.nuisance
        value = found[name]
        estimates[name] = Estimate(value, unit, error, low, high, white, False, note, nuisance)
    return estimates


def tried(task: Task, starts: Sequence[Start]) -> tuple[Tried, ...]:
    """Return the ends of the starts, best first."""
    best = min([s.objective for s in starts if isfinite(s.objective)], default=0.0)
    return tuple(
        Tried(s.number, s.objective - best, s.cost, s.status, s.message, s.evaluations,
              task.unknowns.named(s.w))
        for s in sorted(starts, key=lambda s: (s.objective, s.number))
    )  # fmt: skip


def envelope(t: Array, y: Array, most: int = POINTS) -> Line:
    """Return a line of at most `most` points that covers the same area as the signal.

    The ends and the extreme values in each of most / 2 equal intervals are kept, so that no spike
    is lost. Non-finite values are left out.
    """
    finite = np.isfinite(y)
    t, y = t[finite], y[finite]
    if y.size <= most:
        return Line(t, y)
    edges = np.linspace(0, y.size, max(1, (most - 2) // 2) + 1).astype(int)
    spans = list(pairwise(edges.tolist()))
    low = [a + int(np.argmin(y[a:b])) for a, b in spans]
    high = [a + int(np.argmax(y[a:b])) for a, b in spans]
    kept = np.unique([0, *low, *high, y.size - 1])
    return Line(t[kept], y[kept])


def cut_envelope(t: Array, y: Array, most: int = POINTS) -> Line:
    """Return the envelope of a signal over time, with a NaN in every gap to interrupt the line."""
    steps = np.diff(t)
    gaps = np.flatnonzero(steps > GAP * np.median(steps)) + 1 if steps.size else steps.astype(int)
    if not 0 < gaps.size <= most // 10:
        return envelope(t, y, most)
    lines: list[Line] = []
    for a, b in pairwise([0, *gaps.tolist(), t.size]):
        lines.append(envelope(t[a:b], y[a:b], max(4, most * (b - a) // t.size)))
        lines.append(Line(t[b - 1 : b], np.array([nan])))
    return Line(
        *(np.concatenate(part[:-1]) for part in ([x.t for x in lines], [x.y for x in lines]))
    )


def _series(live: Live, records: Sequence[str], verdict: Verdict) -> tuple[Series, ...]:
    """Return the signals of all channels for plots, with fewer points each of many channels."""
    residuals, data = live.task.residuals, live.data
    timed = all(record.t is not None for record in data)
    abscissa = "t [s]" if timed else ("v [rad/s]" if data.rotary else "v [m/s]")
    most = int(np.clip(TOGETHER // max(1, len(residuals.channels)), LEAST, POINTS))
    found = list[Series]()
    for c, label in zip(residuals.channels, labels(residuals), strict=True):
        order = slice(None) if c.ordered else np.argsort(c.t, kind="stable")
        r = live.point.evaluation.r[c.rows]
        t, measured, left = (y[order] for y in (c.t, c.measured, r))
        line = cut_envelope if c.ordered else envelope
        seen, predicted, residual = (line(t, y, most) for y in (measured, measured + left, left))
        white = verdict.whiteness[label]
        found.append(
            Series(
                records[c.record], c.signal, c.unit, abscissa, c.ordered, left.size, seen,
                predicted, residual, c.t[list(c.breaks)], white.lags, white.correlation,
                white.low, white.high,
            )
        )  # fmt: skip
    return tuple(found)


def _curve(live: Live) -> FrictionCurve | None:
    """Return friction over velocity of a law in a drive or fitted to points; None for others."""
    law, machine, data = live.closed.law, live.closed.scene, live.data
    if isinstance(machine, Drive):
        return _banded(live, _of_drive(machine, data.records), float(machine.N))
    load = live.subject.load
    if law is None or load is None:
        return None
    points = {
        data[c.record].name: (c.regressors.get("v", c.t), c.measured)
        for c in live.task.residuals.channels
    }
    return _banded(live, _of_points(law, load, points, data.rotary), load)


def _of_points(
    law: Law, N: float, points: dict[str, tuple[Array, Array]], turning: bool
) -> FrictionCurve:
    """Return the curve of a law with measured points (v, F) of each record."""
    lines = {name: Line(v, F) for name, (v, F) in points.items()}
    inputs = [f"{i.name} = {i.steady:g} {i.unit}" for i in law.inputs if i.name != FORCE]
    says = ", ".join(["measured points", *(f"line at {one}" for one in inputs)])
    return _over_velocity(law, N, lines, turning, says)


def _of_drive(drive: Drive, records: Sequence[Record]) -> FrictionCurve:
    """Return the curve of the law of a drive, with force - m a - offset of the records.

    Records without position, force or equal intervals have no points.
    """
    lines = dict[str, Line]()
    for record in records:
        if record.t is None or "force" not in record or "x" not in record:
            continue
        try:
            found = differentiated(record, None)
        except ValueError:  # no acceleration: unequal intervals, or too short
            continue
        m, offset = float(drive.m), float(drive.offset)
        parts = [(s.equations(s.v), s.equations(s.force - m * s.a - offset)) for s in found]
        lines[record.name] = Line(*map(np.concatenate, zip(*parts, strict=True)))
    says = "measured: force - m a - offset" if lines else "no record has force and position"
    return _over_velocity(drive.law, float(drive.N), lines, drive.turning, says)


def _over_velocity(
    law: Law, N: float, lines: dict[str, Line], turning: bool, says: str
) -> FrictionCurve:
    """Return the curve with every n-th point of the lines, at most about `DOTS` in total."""
    every = max(1, -(-sum(line.t.size for line in lines.values()) // DOTS))
    measured = {name: Line(line.t[::every], line.y[::every]) for name, line in lines.items()}
    top = max([float(np.abs(line.t).max(initial=0.0)) for line in measured.values()], default=0.0)
    if top == 0.0:
        scale = law.velocity_scale
        top = 10.0 * float(scale) if np.isfinite(float(scale)) else 1.0
    side = np.geomspace(1e-6 * top, top, SIDE)
    seen = [np.sign(line.t[np.abs(line.t) > REST * top]) for line in measured.values()]
    ways = np.unique(np.concatenate(seen)) if seen else np.zeros(0)
    v = np.concatenate([-side[::-1], [0.0], side])
    if ways.size == 1:  # the data do not show the other direction
        v = np.sort(ways[0] * side)
    unit = turned if turning else str
    return FrictionCurve(unit("m/s"), unit("N"), Line(v, steady_force(law, v, N)), measured, says)


def _banded(live: Live, curve: FrictionCurve, N: float) -> FrictionCurve:
    """Return a curve with its 95 % band, without it if a value of the law has no interval.

    half width t sqrt(g' C g),   g = dF/dp by central differences of part of a standard error
    """
    from scipy.special import stdtrit  # noqa: PLC0415  (slow to import)

    found = live.covariance
    errors = dict(zip(found.names, found.standard_errors, strict=True))
    values = {name: live.values[name] for name in live.subject.names}
    moving = [n for n in found.names if n in values and n not in found.at_bound]

    def force(name: str, step: float) -> Array:
        law = live.subject.guard(values | {name: values[name] + step})
        law = law.law if isinstance(law, Scene) else law
        return curve.law.y if law is None else steady_force(law, curve.law.t, N)

    slopes = dict[str, Array]()
    try:
        for name in moving:
            step = STEP * (errors[name] if errors[name] > 0 else abs(values[name]) or 1.0)
            slope = (force(name, step) - force(name, -step)) / (2 * step)
            if slope.any():
                slopes[name] = slope
    except ValueError:  # a limit of the law is nearer than a step
        return curve
    if not slopes:
        return curve
    at = [found.names.index(name) for name in slopes]
    G, C = np.column_stack([*slopes.values()]), found.matrix[np.ix_(at, at)]
    half = stdtrit(found.freedom[at].min(), 0.975) * np.sqrt(np.einsum("ij,jk,ik->i", G, C, G))
    return replace(curve, half=half) if np.isfinite(half).all() else curve


def _made(call: str, kind: str) -> dict[str, str]:
    """Return the versions and the call of the fit."""
    import scipy  # noqa: PLC0415  (slow to import)

    return {
        "call": call,
        "residuals": kind,
        "symfric": __version__,
        "CasADi": ca.CasadiMeta.version(),
        "NumPy": np.__version__,
        "SciPy": scipy.__version__,
        "Python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}",
    }
