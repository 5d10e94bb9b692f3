"""Estimators of friction that changes with wear and temperature, as blocks.

An estimator compares the force of a drive with its motion, and writes parameters of a compensator:
its outputs have the names and units of these parameters.

Covariances are stored as P = W W', with W upper triangular. The factor keeps P positive for any
rounding, and its elements are at most 1 if P is relative to the variances at the start.
Sources: Carlson, AIAA Journal 11, 1973 (measurement); Gram-Schmidt for the step as in Bierman,
Factorization Methods for Discrete Sequential Estimation, 1977.
"""

from typing import Any, NamedTuple

import casadi as ca

from symfric.codegen import Block
from symfric.compensation.adapted import Adapted
from symfric.compensation.settings import Adaptation
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import symbols_of
from symfric.laws import Law
from symfric.laws.base import smooth
from symfric.model import Output, Variables
from symfric.scenes import Drive

WORST = 100.0
"""Largest ratio of a squared residual to its variance that `excess` counts."""
GATE = 25.0
"""Ratio of a squared residual to its usual value, beyond which an impulse acts on the mass."""
FARTHEST = 500.0
"""Largest residual over its deviation; more would lose the digits of single precision."""
FASTEST = 1e6
"""Largest velocity over its deviation of samples that are used, for the same reason."""


def recursive_estimator(
    law: Law | Drive,
    settings: Adaptation | None = None,
    *,
    h: float | None = None,
    name: str = "friction_estimator",
    turning: bool = False,
    **chosen: Any,
) -> Block:
    """Return an estimator of friction by recursive least squares with forgetting.

        y   = mean force - inertia (v - v_first) / T - known friction     over a window T
        e   = y - phi' theta,   phi = d friction / d theta
        P+^-1   = k P^-1 + (1 - k) S^-2 + phi phi' / R,   k = exp(-T / t_memory)
        theta+  = theta + P+ phi e / R,   R = noise_F^2 + 2 (inertia noise_v / T)^2

    S are the spreads. Information is forgotten towards that of the spreads: without excitation P
    approaches S^2, and the estimates keep their values. P is stored as its square root. A window
    with a sample that is slow, reversed, overloaded or excluded by `learn` is not used. Friction is
    that of the law at the measured velocity, with its states, as in `compensator`.

        X_sd^2 = P_ii max(1, excess) + (X_spread t_memory / t_change)^2

    The second term is the lag of a parameter that changes by its spread within t_change; excess is
    the mean ratio of e^2 to its variance.

    Args:
        law: a law of v and N with numbers as parameters; or a drive, which defines law, mass, load,
            offset and units.
        settings: physical scales; keywords name fields of `Adaptation` and replace those in it.
        h: sample time [s] as a constant; without it h is a parameter, by default 1 ms.
        name: C identifier.
        turning: True for units rad/s and N m.

    Raises:
        ValueError: bad input; a force that is not linear in an estimated parameter.

    Limits: one memory for all parameters; it must be longer than the time in which the motion shows
    them. The velocity must be late by less than the window.

    Source: Carlson, AIAA Journal 11, 1973, for the square root.
    """
    f = Adapted("recursive_estimator", law, settings, chosen, h, turning)
    theta, n = symbols_of(f.theta), len(f.theta)
    phi = ca.densify(ca.jacobian(f.force, theta)).T
    _require_linear(f, ca.vertcat(phi, f.after))
    before, first = ends = f.states("v_before", "v_first")
    count, unfit, total = sample = f.states("samples", "unfit", "total")
    sums = f.add(*(Variable(f"{x}_sum", "", doc="sum of its regressor") for x in f.names))
    states, now, spread = f.estimates()
    stored, W = factor(n)
    kept = f.add(*stored)
    last, excess = _last(f)
    noise_v, noise_F, t_window = f.noises()

    bad = ca.logic_not(ca.logic_and(f.usable(), f.v * before > 0))
    count = smooth.clip(count, 0.0, 1e9) + 1
    T = count * f.h
    ended = t_window - f.h / 2 < T
    total = total + f.parts.given("force") - ca.substitute(f.force, theta, ca.DM.zeros(n))
    summed = ca.vertcat(count, ca.if_else(bad, 1, unfit), total, sums + phi)
    f.follow(ca.vertcat(*sample, sums), ca.if_else(ended, 0, summed))
    f.follow(ca.vertcat(*ends), ca.vertcat(f.v, ca.if_else(ended, f.v, first)))

    rate, row, y, mass = (f.v - first) / T, summed[3:] / count, total / count, f.mass
    if "inertia" in f.names:
        place = f.names.index("inertia")
        mass, row[place] = now[place], row[place] + rate
    else:
        y = y - mass * rate
    lost = _lost(T / f.memory)
    faded = W / ca.sqrt(1 - lost)
    for axis in ca.horzsplit(ca.SX.eye(n)):
        faded = measured(faded, axis, 1 / lost).W
    R = noise_F**2 + 2 * (mass * noise_v / T) ** 2
    learnt, e = measured(faded, row * spread, R), y - ca.dot(row, now)
    ratio = smooth.clip(e**2 / learnt.variance, 0.0, WORST)
    new = f.within(now + spread * learnt.gain * e)
    new = ca.vertcat(new, packed(learnt.W), 1, e, excess + lost * (ratio - excess))
    old = ca.vertcat(now, packed(faded), 0, last[1:])
    good = ca.if_else(summed[1] < 0.5, new, old)
    result = ca.if_else(ended, good, ca.vertcat(now, packed(W), last))
    f.follow(ca.vertcat(states, kept, last), result)
    lag = f.memory / f.change
    return _block(f, name, "recursive", result, 0, lag)


def kalman_estimator(
    law: Law | Drive,
    settings: Adaptation | None = None,
    *,
    h: float | None = None,
    name: str = "friction_filter",
    turning: bool = False,
    **chosen: Any,
) -> Block:
    """Return an extended Kalman filter of velocity, states of the law, and changing parameters.

        v+  = v + h (force - F(v)) / M,   M = inertia + h max(F'(v), 0)
        z+  = step of the law at v+,   theta+ = theta,   measured: v
        P+  = A P A' + Q,   A = d(z+, v+, theta+) / d(z, v, theta) at M held

    F is the friction at the end of the step, see `law_block`; the step is implicit in v, and stable
    for any stiffness of bristles. The variance of theta approaches S^2 (S are the spreads) with the
    time constant t_change, as if theta changed randomly by S within it; its mean is kept. Errors of
    the law are noise of v with deviation noise_F, correlated over t_window; the states of the law
    have none, since their corrections would make scale and offset look different in steady sliding.
    While the axis is slow, overloaded or excluded by `learn`, v is the measured velocity, the law
    makes its step at this velocity, and theta is not changed. The part of a residual beyond five
    deviations is attributed to an impulse.

        X_sd^2 = P_ii max(1, excess)

    excess is the mean ratio of squared residuals to their variance, over t_memory.

    Args:
        law, settings, h, turning, chosen: as for `recursive_estimator`.
        name: C identifier.

    Raises:
        ValueError: bad input.

    Limits: linearised; valid near the true parameters and where the law is smooth over the noise of
    the velocity. The velocity is unfiltered, or late by less than t_window. Samples faster than
    1e6 noise_v are not used.

    Source: Carlson, AIAA Journal 11, 1973, for the square root of P.
    """
    f = Adapted("kalman_estimator", law, settings, chosen, h, turning, end=True)
    n, nz = len(f.theta), f.z.numel()
    known = 1 + nz
    (seen,) = f.states("v_seen")
    states, now, spread = f.estimates()
    stored, W = factor(known + n)
    kept = f.add(*stored)
    last, excess = _last(f)
    noise_v, noise_F, t_window = f.noises()
    lost, fastest = _lost(f.h / f.change), FASTEST * noise_v
    used = ca.logic_and(f.usable(), ca.fmax(ca.fabs(f.v), ca.fabs(seen)) < fastest)

    ahead, slopes, M = prediction(f, seen, now)
    scale = ca.vertcat(ca.DM(f.reach), noise_v, spread)
    fading = (1 - lost) * ca.SX.eye(n)
    moving = slopes / scale[:known] * ca.repmat(scale.T, known, 1)
    A = ca.vertcat(moving, ca.horzcat(ca.SX(n, known), fading))
    walk = ca.repmat(ca.sqrt(1 - (1 - lost) ** 2), n)
    jump = noise_F**2 * ca.fmax(t_window, f.h) * f.h / (M * noise_v) ** 2
    e = smooth.clip((f.v - ahead[nz]) / noise_v, -FARTHEST, FARTHEST)
    variance = ca.sumsqr(moving[nz, :] @ W) + jump + 1
    impulse = ca.fmax(e**2 / (GATE * ca.fmax(excess, 1.0)) - variance, 0.0)
    noise = ca.vertcat(ca.SX.zeros(nz), ca.sqrt(jump + impulse), walk)
    after = measured(moved(W, A, noise), ca.SX.eye(known + n)[:, nz], 1.0)
    move = scale * after.gain * e
    ratio = smooth.clip(e**2 / variance, 0.0, WORST)
    new = ca.vertcat(
        f.within(now + move[known:]), packed(after.W), 1, M * e * noise_v / f.h,
        excess + _lost(f.h / f.memory) * (ratio - excess),
        (ahead + move[:known])[:nz, 0], f.v - noise_v * e / after.variance,
    )  # fmt: skip
    apart = ca.diagcat(ca.SX.eye(known), moved(W[known:, known:], fading, walk))
    held = ca.vertcat(ca.substitute(f.after, symbols_of(f.theta), now), f.v)
    rest = ca.vertcat(now, packed(apart), 0, last[1:], held)
    result = ca.if_else(used, new, rest)
    f.follow(ca.vertcat(states, kept, last, f.z, seen), result)
    return _block(f, name, "kalman", result, known, 0.0)


def prediction(f: Adapted, seen: ca.SX, now: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return states of the law and velocity after a step, their derivatives, and M.

    The derivatives with respect to states, velocity and estimates are exact at M held: the
    derivative of M is a peak of the height 1 / v_eps at v = 0.

    Args:
        seen: velocity before the step.
        now: estimates.
    """
    theta = symbols_of(f.theta)
    mass = theta[f.names.index("inertia")] if "inertia" in f.names else f.mass
    m, M = ca.SX.sym("M"), mass + f.h * ca.fmax(ca.jacobian(f.force, f.v), 0.0)
    v = f.v + f.h * (f.parts.given("force") - f.force) / m
    ahead = ca.vertcat(ca.substitute(f.after, f.v, v), v)
    slopes = ca.jacobian(ahead, ca.vertcat(f.z, f.v, theta))
    ahead, slopes = ca.substitute([ahead, slopes], [m], [M])
    old, new = ca.vertcat(f.v, theta), ca.vertcat(seen, now)
    found = ca.substitute([ahead, slopes, M], [old], [new])
    return found[0], found[1], found[2]


def _last(f: Adapted) -> tuple[ca.SX, ca.SX]:
    """Add the states of the last sample that was used; return their symbols, and the excess."""
    last = ca.vertcat(*f.states("last_used", "last_residual", "mean_excess"))
    return last, ca.SX(smooth.clip(last[2], 0.0, WORST))


def _lost(ratio: ca.SX) -> ca.SX:
    """Return 1 - exp(-ratio), within numbers whose inverse and complement are finite."""
    return ca.SX(smooth.clip(-ca.expm1(-ratio), 1e-12, 1 - 1e-6))


def _block(
    f: Adapted, name: str, kind: str, result: ca.SX, known: int, lag: ca.SX | float
) -> Block:
    """Return the block whose states after the step are `result`, `known` of which are no estimates.

    Args:
        result: estimates, covariance, and the last sample.
        known: number of variables before the estimates in the covariance.
        lag: additional deviation over the spread.
    """
    n = len(f.theta)
    last = result[-3:] if not known else result[-3 - known : -known]
    W = unpacked(result[n : result.numel() - known - 3], known + n)
    variance = variances(W)[known:]
    deviation = f.spread * ca.sqrt(variance * ca.fmax(last[2], 1.0) + lag**2)
    return f.block(
        name, kind, result[:n], deviation, variance,
        residual=Output(last[1], "N", "measured minus predicted force"),
        excess=Output(last[2], "1", "mean square of residuals over their variance"),
        used=Output(last[0], "1", "1: the last data changed the estimates"),
    )  # fmt: skip


def _require_linear(f: Adapted, rows: ca.SX) -> None:
    """Raise an error that names the parameters that the regressor or the states depend on."""
    wrong = [p.name for p in f.theta if ca.depends_on(rows, p.symbol)]
    if wrong:
        raise ValueError(
            f"{f.where}: free: expected parameters in which the force is linear, got "
            f"{', '.join(wrong)}; take scales, or kalman_estimator"
        )


LEAST = 1e-10
"""Smallest diagonal element, relative to the deviation at the start."""


class MeasurementUpdate(NamedTuple):
    """Factor after a measurement, its gain (n, 1), and the variance of its residual."""

    W: ca.SX
    gain: ca.SX
    variance: ca.SX


def factor(n: int) -> tuple[Variables, ca.SX]:
    """Return states of a block for the factor of n variables, and the factor within its bounds."""
    rows = [(i, j) for i in range(n) for j in range(i, n)]
    states = tuple(
        Variable(f"W_{i + 1}{j + 1}", "1", start=float(i == j), doc="factor of the covariance")
        for i, j in rows
    )
    return states, unpacked(symbols_of(states), n)


def packed(W: ca.SX) -> ca.SX:
    """Return the rows of a factor from the diagonal on, one below the other."""
    n = W.shape[0]
    return ca.vertcat(*(W[i, j] for i in range(n) for j in range(i, n)))


def unpacked(column: ca.SX, n: int) -> ca.SX:
    """Return the factor whose rows are in `column`, with elements within -1 and 1.

    These bounds hold for every P whose diagonal is at most 1, so that they only change numbers from
    a damaged memory, and variances above those at the start.
    """
    W, elements = ca.SX(n, n), iter(ca.vertsplit(column))
    for i in range(n):
        for j in range(i, n):
            W[i, j] = smooth.clip(next(elements), LEAST if i == j else -1.0, 1.0)
    return W


def variances(W: ca.SX) -> ca.SX:
    """Return the diagonal of P, (n, 1)."""
    return ca.SX(ca.sum2(W * W))


def measured(W: ca.SX, row: ca.SX, variance: ca.SX | float) -> MeasurementUpdate:
    """Return the update by one measurement `row` x + noise.

    Args:
        row: row or column of n coefficients.
        variance: variance of the noise, above 0.
    """
    n, after = W.shape[0], ca.SX(W)
    f, gain, total = W.T @ ca.vec(row), ca.SX.zeros(W.shape[0]), ca.SX(variance)
    for j in range(n):
        before, total = total, total + f[j] * f[j]
        keep = ca.sqrt(before / total)
        share = f[j] * keep / before
        for i in range(j + 1):
            after[i, j] = keep * W[i, j] - share * gain[i]
            gain[i] += f[j] * W[i, j]
    return MeasurementUpdate(after, gain / total, total)


def moved(W: ca.SX, A: ca.SX, noise: ca.SX) -> ca.SX:
    """Return the factor of A P A' + diag(noise^2)."""
    n = W.shape[0]
    rows, after = ca.vertsplit(ca.horzcat(A @ W, ca.diag(noise))), ca.SX(n, n)
    for j in reversed(range(n)):
        after[j, j] = ca.fmax(ca.norm_2(rows[j]), LEAST)
        unit = rows[j] / after[j, j]
        for i in range(j):
            after[i, j] = ca.dot(rows[i], unit)
            rows[i] = rows[i] - after[i, j] * unit
    return after
