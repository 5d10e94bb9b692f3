"""Levels and velocity scales of any law from binned points: a grid search, then least squares."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import product

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.starts.stribeck import Curve
from identification.unknowns.roles import parts
from symfric.foundation.parameters import Parameter, parameters, symbolise
from symfric.laws.base import smooth
from symfric.laws.base.law import Law

Array = NDArray[np.float64]

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


def fit_law(
    law: Law, names: Sequence[str], points: Curve, N: float, guess: Mapping[str, float]
) -> dict[str, float]:
    """Return the parameters of the steady curve with the smallest sum of squares over the bins.

    At each combination of velocity scales between the slowest and the fastest bin the levels come
    from linear least squares within their bounds; the best combinations are refined in all
    parameters together. Parameters that the points do not determine stay at `guess`.

    Args:
        law: with numbers; its further inputs have their steady values.
        names: of parameters; those on which the steady curve does not depend are left out.
        points: bins of velocity [m/s] and force [N].
        N: normal force [N].
        guess: name -> value.
    """
    names = [*_relevant(law, names, N)]
    if not names:
        return {}
    at = _LawFit(law, names, points, N, np.array([guess[n] for n in names]))
    tried = [(at.cost(w), number, w) for number, w in enumerate(map(at.levels, at.trials()))]
    tried.sort(key=lambda trial: trial[:2])
    best, _, end = tried[0]
    for _, _, trial in tried[:POLISHED]:
        w = at.polished(trial)
        cost = at.cost(w)
        if cost < best and at.apart(at.p(w)[0]):
            best, end = cost, w
    return dict(zip(names, at.p(end)[0].tolist(), strict=True))


def _steady(law: Law, v: ca.SX, N: float) -> ca.SX:
    """Return the force in steady sliding."""
    ahead = smooth.sign(v, 0.0) if law.facts.odd else 1.0
    given = {i.name: i.steady * ahead for i in law.inputs}
    return ca.SX(law.force(v, N, law.steady_state(v, N), **given))


def _relevant(law: Law, names: Sequence[str], N: float) -> Iterator[str]:
    """Yield those of `names` that the steady force depends on."""
    if names:
        model, variables = symbolise(law, *names)
        p = ca.vertcat(*(x.symbol for x in variables))
        found = ca.which_depends(_steady(model, ca.SX.sym("v"), N), p, 1, False)
        yield from (name for name, depends in zip(names, found, strict=True) if depends)


class _LawFit:
    """Least squares of the steady curve of a law in coordinates w of its parameters p.

        p = exp(w) for velocity scales, scale w for the others, p_low + scale w for ordered ones

    Attributes:
        force: function of p: forces (points,), slopes (points, p).
        floors: (high, low, value): p[high] >= p[low], or >= value if low is -1.
        strict: (high, low): velocities p[high] > p[low].
    """

    def __init__(self, law: Law, names: Sequence[str], points: Curve, N: float, p: Array) -> None:
        known, speed = parameters(law), np.abs(points.v)
        self.known, self.start = [known[n] for n in names], p
        self.F, self.size = points.F, float(np.abs(points.F).max()) or 1.0
        self.ends = float(max(speed.min() / 2, 1e-3 * speed.max())), float(speed.max())
        self.pull = PULL * np.sqrt(self.F.size)
        model, variables = symbolise(law, *names)
        self.force = _curve(model, [x.symbol for x in variables], points.v, N)
        self.floors, self.strict = _orders(model, [x.symbol for x in variables])
        self.logarithmic = np.array([is_scale(p) for p in self.known])
        self.scale = np.where(p == 0, 1.0, np.abs(p))
        lower, upper = (np.array([getattr(p, side) for p in self.known]) / self.scale
                        for side in ("lower", "upper"))  # fmt: skip
        for i in np.flatnonzero(self.logarithmic):
            one, (slow, fast) = self.known[i], self.ends
            ends = sorted(velocity(one, s) for s in (slow / WIDE, fast * WIDE))
            lower[i], upper[i] = np.log([max(ends[0], one.lower), min(ends[1], one.upper)])
        for i in np.flatnonzero([p.role == "level" for p in self.known]):
            upper[i] = min(upper[i], HIGHEST)
        for high, _, _ in self.floors:
            if not self.logarithmic[high]:
                lower[high], upper[high] = 0, 1
        self.lower, self.upper = lower, upper

    def p(self, w: Array) -> tuple[Array, Array]:
        """Return the parameters and their derivatives dp/dw."""
        p = np.where(self.logarithmic, np.exp(np.where(self.logarithmic, w, 0)), self.scale * w)
        slope = np.diag(np.where(self.logarithmic, p, self.scale))
        for high, low, value in self.floors:
            p[high] += p[low] if low >= 0 else value
            slope[high] += slope[low] if low >= 0 else 0.0
        return p, slope

    def w(self, p: Array) -> Array:
        """Return the coordinates of parameters, moved inside the bounds."""
        p = p.copy()
        for high, low, value in self.floors:
            p[high] -= p[low] if low >= 0 else value
        safe = np.log(np.where(self.logarithmic, np.maximum(p, 1e-300), 1.0))
        return np.clip(np.where(self.logarithmic, safe, p / self.scale), self.lower, self.upper)

    def at(self, w: Array) -> tuple[Array, Array]:
        """Return errors of the force and their derivatives; not finite where it is undefined."""
        p, slope = self.p(w)
        F, J = self.force(p)
        return (F.full().ravel() - self.F) / self.size, J.full() @ slope / self.size

    def cost(self, w: Array) -> float:
        """Return the sum of squared errors; infinite where the law is undefined."""
        error = self.at(w)[0]
        return float(np.sum(error**2)) if np.isfinite(error).all() else np.inf

    def trials(self) -> Iterator[Array]:
        """Yield starts at all combinations of velocity scales; scales of one field move together.

        The guess and the values of the law come last: levels of a rope are not forces.
        """
        fields = sorted({p.field for p in self.known if is_scale(p)})
        values = np.geomspace(*self.ends, SCALES.get(len(fields), 5))
        trials = list[Array]()
        for chosen in product(values, repeat=len(fields)):
            by_field = dict(zip(fields, chosen, strict=True))
            trials.append(np.array([
                velocity(one, by_field[one.field]) if is_scale(one) else p
                for one, p in zip(self.known, self.start, strict=True)
            ]))  # fmt: skip
        trials += [self.start, np.array([float(p.value) for p in self.known])]
        yield from (self.w(p) for p in trials if self.apart(p))

    def apart(self, p: Array) -> bool:
        """Return True if strictly ordered velocities differ by at least a twentieth."""
        return all(p[high] > 1.05 * p[low] for high, low in self.strict)

    def levels(self, w: Array) -> Array:
        """Return the coordinates after linear least squares in all but the velocity scales."""
        from scipy.optimize import lsq_linear  # noqa: PLC0415 (slow to import)

        linear = ~self.logarithmic
        if not linear.any():
            return w
        lower, upper, begin = self.lower[linear], self.upper[linear], w[linear]
        wide = upper > lower
        for _ in range(STEPS):
            error, J = self.at(w)
            X = J[:, linear]
            if not (np.isfinite(X).all() and np.isfinite(error).all()):
                return w
            rows = np.vstack([X, self.pull * np.eye(begin.size)])
            goal = np.concatenate([X @ w[linear] - error, self.pull * begin])
            found = w[linear].copy()
            within, rest = (lower[wide], upper[wide]), goal - rows[:, ~wide] @ found[~wide]
            found[wide] = lsq_linear(rows[:, wide], rest, within, method="bvls").x
            trial = w.copy()
            trial[linear] = found
            if self.cost(trial) > self.cost(w):
                return w
            w = trial
        return w

    def polished(self, w: Array) -> Array:
        """Return all coordinates after trust-region steps."""
        from scipy.optimize import least_squares  # noqa: PLC0415 (slow to import)

        begin = w.copy()

        def residuals(w: Array) -> Array:
            found = np.concatenate([self.at(w)[0], self.pull * (w - begin)])
            return np.where(np.isfinite(found), found, 1e3)

        def slopes(w: Array) -> Array:
            found = np.vstack([self.at(w)[1], self.pull * np.eye(w.size)])
            return np.where(np.isfinite(found), found, 0.0)

        wide = np.maximum(self.upper, self.lower + 1e-6)
        return least_squares(
            residuals, np.clip(w, self.lower + 1e-9, wide - 1e-9),
            jac=slopes,  # pyright: ignore[reportArgumentType]
            bounds=(self.lower, wide), max_nfev=30,
        ).x  # fmt: skip


def _curve(law: Law, symbols: Sequence[ca.SX], v: Array, N: float) -> ca.Function:
    """Return a function of the parameters: forces at velocities `v`, and their derivatives."""
    speed, p = ca.SX.sym("v"), ca.vertcat(*symbols)
    F = _steady(law, speed, N)
    one = ca.Function("curve", [speed, p], [F, ca.jacobian(F, p)])
    at = ca.MX.sym("p", len(symbols))
    forces, slopes = one.map(v.size)(ca.DM(v).T, at)
    return ca.Function("curves", [at], [forces.T, ca.reshape(slopes, len(symbols), v.size).T])


def _orders(
    law: Law, symbols: Sequence[ca.SX]
) -> tuple[list[tuple[int, int, float]], list[tuple[int, int]]]:
    """Return ordered pairs of values (or a value and a number), and strictly ordered pairs."""

    def place(value: object) -> int:
        return next((i for i, symbol in enumerate(symbols) if symbol is value), -1)

    floors, strict = list[tuple[int, int, float]](), list[tuple[int, int]]()
    for part in parts(law):
        for low, high in type(part).ordered:
            i, j = place(getattr(part, high)), place(getattr(part, low))
            if i >= 0:
                floors.append((i, j, 0.0 if j >= 0 else float(getattr(part, low))))
        for low, high in type(part).strictly_ordered:
            i, j = place(getattr(part, high)), place(getattr(part, low))
            if i >= 0 and j >= 0:
                strict.append((i, j))
    return floors, strict


def is_scale(parameter: Parameter) -> bool:
    """Return True if a parameter is a positive velocity scale, or the inverse of one."""
    return parameter.role == "velocity scale" and parameter.lower >= 0


def velocity(parameter: Parameter, scale: float) -> float:
    """Return a velocity scale in the unit of the parameter: itself, or its inverse."""
    return scale if parameter.unit in ("m/s", "rad/s") else 1 / scale
