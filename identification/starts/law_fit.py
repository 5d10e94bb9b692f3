"""Levels and velocity scales of any law from binned points: a grid search, then least squares."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.starts.stribeck import Curve
from identification.unknowns.roles import parts
from symfric.foundation.parameters import Parameter, Variable, parameters, symbolise
from symfric.laws.base import smooth
from symfric.laws.base.law import Law

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class LawCurve:
    """Force of a law in steady sliding, as a function of its relevant parameters.

    Attributes:
        parameters: in the order of p.
        force: function of p: forces (points,), slopes (points, p).
        floors: (high, low, value): p[high] >= p[low], or >= value if low is -1.
        strict: (high, low): velocities p[high] > p[low].
    """

    parameters: tuple[Parameter, ...]
    force: ca.Function
    floors: tuple[tuple[int, int, float], ...]
    strict: tuple[tuple[int, int], ...]

    def at(self, p: Array) -> tuple[Array, Array]:
        """Return forces and their derivatives; not finite where the law is undefined."""
        F, J = self.force(p)
        return F.full().ravel(), J.full()


def law_curve(law: Law, names: Sequence[str], v: Array, N: float) -> LawCurve | None:
    """Return the steady curve of `law` at velocities `v` [m/s] and normal force N [N].

    Only the parameters in `names` on which it depends are kept; None if there are none. Further
    inputs of the law have their steady values.
    """
    kept = _relevant(law, names, N)
    if not kept:
        return None
    known = parameters(law)
    model, variables = symbolise(law, *kept)
    speed, p = ca.SX.sym("v"), ca.vertcat(*(x.symbol for x in variables))
    F = _steady(model, speed, N)
    one = ca.Function("curve", [speed, p], [F, ca.jacobian(F, p)])
    at = ca.MX.sym("p", len(kept))
    forces, slopes = one.map(v.size)(ca.DM(v).T, at)
    slopes = ca.reshape(slopes, len(kept), v.size).T
    force = ca.Function("curves", [at], [forces.T, slopes])
    return LawCurve(tuple(known[n] for n in kept), force, *_orders(model, variables))


def _steady(law: Law, v: ca.SX, N: float) -> ca.SX:
    ahead = smooth.sign(v, 0.0) if law.facts.odd else 1.0
    given = {i.name: i.steady * ahead for i in law.inputs}
    return ca.SX(law.force(v, N, law.steady_state(v, N), **given))


def _relevant(law: Law, names: Sequence[str], N: float) -> list[str]:
    """Return those of `names` that the steady force depends on."""
    if not names:
        return []
    model, variables = symbolise(law, *names)
    p = ca.vertcat(*(x.symbol for x in variables))
    relevant = ca.which_depends(_steady(model, ca.SX.sym("v"), N), p, 1, False)
    return [name for name, depends in zip(names, relevant, strict=True) if depends]


def _orders(
    law: Law, variables: Sequence[Variable]
) -> tuple[tuple[tuple[int, int, float], ...], tuple[tuple[int, int], ...]]:
    """Return ordered pairs of values (or a value and a number), and strictly ordered pairs."""

    def place(value: object) -> int:
        return next((i for i, x in enumerate(variables) if x.symbol is value), -1)

    floors = list[tuple[int, int, float]]()
    strict = list[tuple[int, int]]()
    for part in parts(law):
        for low, high in type(part).ordered:
            i, j = place(getattr(part, high)), place(getattr(part, low))
            if i >= 0:
                floors.append((i, j, 0.0 if j >= 0 else float(getattr(part, low))))
        for low, high in type(part).strictly_ordered:
            i, j = place(getattr(part, high)), place(getattr(part, low))
            if i >= 0 and j >= 0:
                strict.append((i, j))
    return tuple(floors), tuple(strict)


SCALES = {0: 1, 1: 16, 2: 8}
"""Number of values tried for each velocity scale, by the number of scales; 5 for more scales."""
STEPS = 2
"""Linear least-squares steps at each; one is exact if a law is linear in its levels."""
POLISHED = 3
"""Number of best trials refined by nonlinear least squares."""
PULL = 1e-3
"""Weight of the guess against the points; it fixes undetermined parameters."""
HIGHEST = 3.0
"""Factor by which levels may exceed the guess; a static one exceeds the dynamic one by at most its
guess, however steeply a curve fits the slowest bins.
"""
WIDE = 10.0
"""Factor by which velocity scales may exceed the range of speeds of the data."""


@final
@dataclass(frozen=True, eq=False)
class Coordinates:
    """p = exp(w) for velocity scales, scale w for the others, p_low + scale w for ordered ones."""

    curve: LawCurve
    scale: Array
    logarithmic: NDArray[np.bool_]
    lower: Array
    upper: Array

    def p(self, w: Array) -> tuple[Array, Array]:
        """Return the parameters and their derivatives dp/dw."""
        p = np.where(self.logarithmic, np.exp(np.where(self.logarithmic, w, 0)), self.scale * w)
        slope = np.diag(np.where(self.logarithmic, p, self.scale))
        for high, low, value in self.curve.floors:
            p[high] += p[low] if low >= 0 else value
            slope[high] += slope[low] if low >= 0 else 0.0
        return p, slope

    def w(self, p: Array) -> Array:
        """Return the coordinates of parameters, moved inside the bounds."""
        p = p.copy()
        for high, low, value in self.curve.floors:
            p[high] -= p[low] if low >= 0 else value
        safe = np.log(np.where(self.logarithmic, np.maximum(p, 1e-300), 1.0))
        return np.clip(np.where(self.logarithmic, safe, p / self.scale), self.lower, self.upper)


def is_scale(parameter: Parameter) -> bool:
    """Return True if a parameter is a positive velocity scale, or the inverse of one."""
    return parameter.role == "velocity scale" and parameter.lower >= 0


def velocity(parameter: Parameter, scale: float) -> float:
    """Return a velocity scale in the unit of the parameter: itself, or its inverse."""
    return scale if parameter.unit in ("m/s", "rad/s") else 1 / scale


def coordinates(curve: LawCurve, guess: Array, speeds: tuple[float, float]) -> Coordinates:
    """Return coordinates around `guess` for data between the slowest and fastest of `speeds`."""
    known = curve.parameters
    logarithmic = np.array([is_scale(p) for p in known])
    scale = np.where(guess == 0, 1.0, np.abs(guess))
    lower = np.array([p.lower for p in known]) / scale
    upper = np.array([p.upper for p in known]) / scale
    for i in np.flatnonzero(logarithmic):
        ends = sorted(velocity(known[i], s) for s in (speeds[0] / WIDE, speeds[1] * WIDE))
        lower[i], upper[i] = np.log([max(ends[0], known[i].lower), min(ends[1], known[i].upper)])
    for i in np.flatnonzero([p.role == "level" for p in known]):
        upper[i] = min(upper[i], HIGHEST)
    for high, _, _ in curve.floors:
        lower[high], upper[high] = (lower[high], upper[high]) if logarithmic[high] else (0, 1)
    return Coordinates(curve, scale, logarithmic, lower, upper)


def fit_law(curve: LawCurve, points: Curve, guess: Mapping[str, float]) -> dict[str, float]:
    """Return the parameters with the smallest sum of squares over the bins.

    At each combination of velocity scales between the slowest and the fastest bin the levels come
    from linear least squares within their bounds; the best combinations are refined in all
    parameters together. Parameters that the points do not determine stay at `guess`.
    """
    known, speed = curve.parameters, np.abs(points.v)
    ends = float(max(speed.min() / 2, 1e-3 * speed.max())), float(speed.max())
    start = np.array([guess[p.name] for p in known])
    at = coordinates(curve, start, ends)
    size = float(np.abs(points.F).max()) or 1.0
    tried: list[tuple[float, int, Array]] = []
    for number, p in enumerate(_scales(curve, start, ends)):
        w = _levels(at, at.w(p), points.F, size)
        tried.append((_cost(at, w, points.F, size), number, w))
    best = min(tried, key=lambda trial: trial[:2])
    for trial in sorted(tried, key=lambda trial: trial[:2])[:POLISHED]:
        w = _polished(at, trial[2], points.F, size)
        cost = _cost(at, w, points.F, size)
        if cost < best[0] and _apart(curve, at.p(w)[0]):
            best = cost, 0, w
    return dict(zip([p.name for p in known], at.p(best[2])[0].tolist(), strict=True))


def _scales(curve: LawCurve, start: Array, ends: tuple[float, float]) -> Iterator[Array]:
    """Yield starts at all combinations of velocity scales; scales of one field move together."""
    fields = sorted({p.field for p in curve.parameters if is_scale(p)})
    values = np.geomspace(*ends, SCALES.get(len(fields), 5))
    for chosen in product(values, repeat=len(fields)):
        by_field, p = dict(zip(fields, chosen, strict=True)), start.copy()
        for i, parameter in enumerate(curve.parameters):
            if is_scale(parameter):
                p[i] = velocity(parameter, by_field[parameter.field])
        if _apart(curve, p):
            yield p
    if _apart(curve, start):
        yield start
    own = np.array([float(p.value) for p in curve.parameters])
    if _apart(curve, own):
        yield own  # for laws whose levels are not forces, such as a rope


def _apart(curve: LawCurve, p: Array) -> bool:
    """Return True if strictly ordered velocities differ by at least a twentieth."""
    return all(p[high] > 1.05 * p[low] for high, low in curve.strict)


def _levels(at: Coordinates, w: Array, F: Array, size: float) -> Array:
    """Return the coordinates after bounded linear least squares in all but the velocity scales."""
    from scipy.optimize import lsq_linear  # noqa: PLC0415 (slow to import)

    linear = ~at.logarithmic
    if not linear.any():
        return w
    pull = PULL * np.sqrt(F.size)
    lower, upper = at.lower[linear], at.upper[linear]
    begin = w[linear]
    for _ in range(STEPS):
        p, slope = at.p(w)
        force, J = at.curve.at(p)
        X = (J @ slope)[:, linear] / size
        if not (np.isfinite(X).all() and np.isfinite(force).all()):
            return w
        rows = np.vstack([X, pull * np.eye(begin.size)])
        goal = np.concatenate([(F - force) / size + X @ w[linear], pull * begin])
        wide = upper > lower
        found = w[linear].copy()
        within, rest = (lower[wide], upper[wide]), goal - rows[:, ~wide] @ found[~wide]
        found[wide] = lsq_linear(rows[:, wide], rest, within, method="bvls").x
        trial = w.copy()
        trial[linear] = found
        if _cost(at, trial, F, size) > _cost(at, w, F, size):
            return w
        w = trial
    return w


def _cost(at: Coordinates, w: Array, F: Array, size: float) -> float:
    force = at.curve.at(at.p(w)[0])[0]
    return float(np.sum(((force - F) / size) ** 2)) if np.isfinite(force).all() else np.inf


def _polished(at: Coordinates, w: Array, F: Array, size: float) -> Array:
    """Return all coordinates after trust-region steps."""
    from scipy.optimize import least_squares  # noqa: PLC0415 (slow to import)

    pull, begin = PULL * np.sqrt(F.size), w.copy()

    def residuals(w: Array) -> Array:
        found = np.concatenate([(at.curve.at(at.p(w)[0])[0] - F) / size, pull * (w - begin)])
        return np.where(np.isfinite(found), found, 1e3)

    def slopes(w: Array) -> Array:
        p, slope = at.p(w)
        found = np.vstack([at.curve.at(p)[1] @ slope / size, pull * np.eye(w.size)])
        return np.where(np.isfinite(found), found, 0.0)

    wide = np.maximum(at.upper, at.lower + 1e-6)
    return least_squares(
        residuals,
        np.clip(w, at.lower + 1e-9, wide - 1e-9),
        jac=slopes,  # pyright: ignore[reportArgumentType]
        bounds=(at.lower, wide),
        max_nfev=30,
    ).x
