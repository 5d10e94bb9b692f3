"""Evaluation of experiments: break-away forces, and six steps to the static parameters of LuGre.

    F = F_C + (F_S - F_C) exp(-(v/v_s)^delta) + sigma_2 v

    1  F_S                    largest force of the curve
    2  F_C + sigma_2 v        smallest force, at v_min
    3  m^2 = 1/v_s^2          exponential part, up to v_min, with delta = 2
    4  sigma_2                linear part, from v_min on
    5  F_C                    force of step 2 minus sigma_2 v_min of step 4
    6  delta, v_s             exponential part again, with a free exponent

Each of the six steps uses only a part of the curve; a fit of all points at once
(`identification.Fit`) has a smaller error. `doubts` lists the values that the points do not
determine.
Source: A Friction Model for Laminator Nips, MSc thesis TFRT-5968, Lund 2015, section 4.2; after
Olsson, Control Systems with Friction, PhD thesis, Lund 1996.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import final

import numpy as np

from identification.data.record import runs
from identification.starts.measured import Measured
from identification.starts.stribeck import Array, BinnedForce, StribeckCurve, binned, samples
from symfric.foundation import checks
from symfric.laws.static.exponential import SteadyStateLuGre

NAMES = ("F_S", "F_C", "v_s", "sigma_2", "delta")
SHARE = (0.02, 0.98)
"""Shares of F_S - F_C between which a force belongs to the exponential part."""
EXPONENTS = (0.3, 10.0)
"""Bounds of the exponent."""
LOOSE = 0.3
"""Relative standard error above which a parameter is not determined."""
LEAST = 4
"""Least number of speeds in one direction for a curve."""


@final
@dataclass(frozen=True)
class ProcedureStep:
    """Step of the procedure with number, meaning, number of points used, and values."""

    number: int
    what: str
    points: int
    values: dict[str, float]

    def __str__(self) -> str:
        shown = ", ".join(f"{name} = {value:.4g}" for name, value in self.values.items())
        return f"{self.number}  {self.what:<44} {self.points:4d} points   {shown}"


@final
@dataclass(frozen=True, eq=False)
class SixSteps:
    """Result of the six-step procedure.

    Attributes:
        steps: steps in order of their numbers.
        values: F_S, F_C [N], v_s [m/s], sigma_2 [N s/m], delta; v_s and delta are NaN if no
            falling part was found.
        errors: relative standard errors of a simultaneous fit of all points around these values,
            from the scatter around the curve; inf if the points do not determine a value.
        rms: root mean square error relative to the mean force [%]; without a falling part, that of
            F_C + sigma_2 v.
        curve: mean force at each speed.
        doubts: messages on undetermined values, one sentence each.
    """

    steps: tuple[ProcedureStep, ...]
    values: dict[str, float]
    errors: dict[str, float]
    rms: float
    curve: BinnedForce
    doubts: tuple[str, ...]

    @property
    def law(self) -> SteadyStateLuGre:
        """Law with these values.

        Raises:
            ValueError: no falling part was found, and v_s is unknown.
        """
        if not np.isfinite(self.values["v_s"]):
            such = "six_steps: law: expected points that determine v_s"
            raise ValueError(f"{such}, got none; {self.doubts[0]}")
        return SteadyStateLuGre(**self.values, v_eps=1e-3 * float(self.curve.v.min()))

    def __str__(self) -> str:
        lines = [str(step) for step in self.steps]
        lines.append(f"error {self.rms:.2f} % of the mean force (rms)")
        for name in NAMES:
            error = self.errors[name]
            shown = f"{100 * error:.3g} %" if error < 100 else "not determined"
            lines.append(f"  {name:<8} {self.values[name]:<12.5g} standard error {shown}")
        return "\n".join([*lines, *(f"doubt: {sentence}" for sentence in self.doubts)])


def six_steps(v: Array, F: Array, *, unstable: float = 0.0) -> SixSteps:
    """Estimate the static parameters of LuGre from points in sliding at constant speeds.

    Both directions have equal weight: points of negative velocity are mirrored.

    Args:
        v: sliding velocities [m/s], shape (n,).
        F: friction forces with the sign of v [N], shape (n,).
        unstable: speed [m/s] up to which the measured motion was stick-slip, if any; the points
            are used, and values that depend on them are listed in `doubts`.

    Raises:
        ValueError: fewer than four speeds, or forces of the sign opposite to the velocity.
    """
    velocity, friction = samples("six_steps", v, F)
    unstable = checks.number("six_steps: unstable", unstable, unit="m/s", lower=0.0)
    curve = binned(np.abs(velocity), np.sign(velocity) * friction)
    if curve.v.size < LEAST or curve.F.min() <= 0:
        raise ValueError(
            f"six_steps: expected at least {LEAST} speeds and forces with the sign of the velocity,"
            f" got {curve.v.size} speeds and a smallest force of {curve.F.min():.3g}"
        )
    speed, force = curve.v, curve.F
    low = int(np.argmin(force))
    top = int(np.argmax(force[: low + 1]))
    F_S, F_min, v_min = float(force[top]), float(force[low]), float(speed[low])
    sigma_2 = 0.0  # one point has no slope
    if speed.size - low > 1:
        sigma_2 = max(float(np.polyfit(speed[low:], force[low:], 1)[0]), 0.0)
    F_C = max(F_min - sigma_2 * v_min, 0.0)
    part = _exponential(curve, top, low, F_S, F_C, sigma_2)
    gaussian, v_s, delta = _exponents(*part)
    values = {"F_S": F_S, "F_C": F_C, "v_s": v_s, "sigma_2": sigma_2, "delta": delta}
    count = part[0].size
    steps = [
        ("F_S: largest force", 1, {"F_S": F_S, "v": float(speed[top])}),
        ("F_C + sigma_2 v: smallest force", 1, {"F_min": F_min, "v_min": v_min}),
        ("m^2 = 1/v_s^2: exponential part, delta = 2", count, {"v_s": gaussian}),
        ("sigma_2: linear part", force.size - low, {"sigma_2": sigma_2}),
        ("F_C: step 2 less sigma_2 v_min", 1, {"F_C": F_C}),
        ("delta: exponential part again", count, {"delta": delta, "v_s": v_s}),
    ]
    if count:
        found = StribeckCurve(F_S, F_C, v_s, delta, sigma_2, offset=0.0, rms=0.0)
        error = found.force(speed) - force
        noise = float(np.sqrt(np.sum(error**2) / max(error.size - len(NAMES), 1)))
        errors = standard_errors(found, speed, noise)
        doubts = [
            *_doubts(found, curve, low, count, unstable),
            *(
                f"{name} is not determined by these points: standard error "
                + (f"{100 * error:.0f} %" if error < 100 else "larger than any value")
                for name, error in errors.items()
                if error > LOOSE
            ),
        ]
    else:
        error, errors = F_C + sigma_2 * speed - force, {name: np.inf for name in NAMES}
        doubts = [_no_fall(curve, top, low), *_of_line(curve, low)]
    rms = 100 * float(np.sqrt(np.mean(error**2)) / force.mean())
    numbered = tuple(ProcedureStep(number, *step) for number, step in enumerate(steps, start=1))
    return SixSteps(numbered, values, errors, rms, curve, tuple(doubts))


def standard_errors(curve: StribeckCurve, speed: Array, noise: float) -> dict[str, float]:
    """Return relative standard errors of a least-squares fit of all five parameters (Cramer-Rao).

    No unbiased method has smaller errors for white noise of standard deviation `noise` [N] in each
    point. Errors are inf for values of 0 and for undetermined values.
    """
    F_S, F_C, v_s, delta = curve.F_S, curve.F_C, curve.v_s, curve.delta
    power = (speed / v_s) ** delta
    falling = np.exp(-power)
    bend = (F_S - F_C) * falling * power
    columns = falling, 1 - falling, bend * delta / v_s, speed, -bend * np.log(speed / v_s)
    J = np.column_stack(columns)
    scale = np.linalg.norm(J, axis=0)
    known = scale > 0
    error = np.full(len(NAMES), np.inf)
    covariance = np.linalg.pinv((X := J[:, known] / scale[known]).T @ X, rcond=1e-14)
    error[known] = noise * np.sqrt(np.maximum(np.diag(covariance), 0.0)) / scale[known]
    size = np.abs([F_S, F_C, v_s, curve.sigma_2, delta])
    found = np.divide(error, size, out=np.full(size.size, np.inf), where=size > 0)
    return dict(zip(NAMES, found.tolist(), strict=True))


def _exponential(
    curve: BinnedForce, top: int, low: int, F_S: float, F_C: float, sigma_2: float
) -> tuple[Array, Array]:
    """Return speeds and -log of the remaining share of F_S - F_C, where this is significant."""
    speed = curve.v[top : low + 1]
    share = (curve.F[top : low + 1] - F_C - sigma_2 * speed) / max(F_S - F_C, 1e-300)
    inside = (share > SHARE[0]) & (share < SHARE[1])
    return speed[inside], -np.log(share[inside])


def _exponents(speed: Array, power: Array) -> tuple[float, float, float]:
    """Return v_s for delta = 2, and v_s and delta, from lines through power = (v/v_s)^delta.

    With a free exponent, the line passes through the logarithms. The weight of a point is the
    inverse effect of a force error: share = exp(-power), d log(power) = d share / (share power).
    Without points, all values are NaN.
    """
    if speed.size < 2:
        scale = float(speed[0] / np.sqrt(power[0])) if speed.size else float("nan")
        return scale, scale, 2.0 if speed.size else float("nan")
    weight = np.exp(-power)
    gaussian = np.sqrt(np.sum((weight * speed**2) ** 2) / np.sum(weight**2 * speed**2 * power))
    slope = np.polyfit(np.log(speed), np.log(power), 1, w=weight * power)[0]
    delta = float(np.clip(slope, *EXPONENTS))
    middle = np.average(np.log(power) - delta * np.log(speed), weights=(weight * power) ** 2)
    return float(gaussian), float(np.exp(-middle / delta)), delta


def _doubts(
    found: StribeckCurve, curve: BinnedForce, low: int, count: int, unstable: float
) -> list[str]:
    """Return messages on values that the shape of the curve does not determine."""
    messages = list[str]()
    v_s, slowest, fastest = found.v_s, float(curve.v[0]), float(curve.v[-1])
    lost = (found.F_S - found.F_C) * -np.expm1(-((slowest / v_s) ** found.delta))
    if lost > 0.005 * found.F_S:
        messages.append(
            f"at the slowest point, {slowest:.3g} m/s, the force has already fallen: F_S is the "
            "largest force measured, a lower bound of the static one"
        )
    if v_s <= unstable:
        messages.append(
            f"v_s = {v_s:.3g} m/s is among speeds of stick-slip (up to {unstable:.3g} m/s): "
            "F_S, v_s and delta are averages over an unsteady force"
        )
    messages += _of_line(curve, low)
    if count < LEAST:
        messages.append(f"the exponential part has {count} points: v_s and delta are uncertain")
    if not slowest < v_s < fastest:
        messages.append(f"v_s = {v_s:.3g} m/s is outside the measured speeds")
    return messages


def _of_line(curve: BinnedForce, low: int) -> list[str]:
    """Return messages on the linear part, which begins at the smallest force."""
    if low == curve.v.size - 1:
        return ["the force falls up to the fastest point: no linear part, sigma_2 is set to 0"]
    if curve.v.size - low < LEAST:
        return [f"the linear part has {curve.v.size - low} points: sigma_2 is uncertain"]
    return []


def _no_fall(curve: BinnedForce, top: int, low: int) -> str:
    """Return the message that no point shows the fall of friction, so v_s and delta are unknown."""
    F, v = curve.F, curve.v
    if top == low:
        return (
            f"no falling part was found: the force is smallest, {F[low]:.3g} N, at the slowest "
            "point; it rises, as with coulomb+viscous, or falls at lower speeds"
        )
    return (
        f"no falling part was found: no point between the largest force, {F[top]:.3g} N at "
        f"{v[top]:.3g} m/s, and the smallest, {F[low]:.3g} N at {v[low]:.3g} m/s, shows how it "
        "falls; scatter may hide it: add points at these speeds, or use Fit with all points"
    )


REST = 0.02
"""Share of the largest speed below which a body counts as at rest."""
SHORTEST = 5
"""Smallest number of samples of a rest."""
RISE = (0.3, 0.9)
"""Shares of the break-away force between which the loading rate is evaluated."""
APART = 2.0
"""Smallest ratio of loading rates for which their effect is evaluated."""


@final
@dataclass(frozen=True)
class BreakAway:
    """A break-away event.

    Attributes:
        t: time of the largest force [s].
        force: largest force, in the direction of the subsequent motion [N].
        rate: loading rate before that time [N/s].
        side: direction of the motion, 1 or -1.
    """

    t: float
    force: float
    rate: float
    side: int


@final
@dataclass(frozen=True, eq=False)
class BreakAways:
    """Break-away events of a data set.

    Attributes:
        events: events in order of time.
        level: median force of both directions [N].
        scatter: median absolute deviation of the force, relative to its median.
        per_decade: change of the force per decade of the loading rate [N], by linear regression on
            the logarithm of the rate; None if the rates differ by less than a factor of 2.
        error: standard error of `per_decade` [N].
    """

    events: tuple[BreakAway, ...]
    level: float
    scatter: float
    per_decade: float | None
    error: float

    @property
    def note(self) -> str:
        """Message about the effect of the loading rate."""
        rates = [event.rate for event in self.events]
        span = f"{min(rates):.3g} to {max(rates):.3g} N/s"
        if self.per_decade is None:
            return f"all loading rates are similar ({span}): their effect on the force is unknown"
        if abs(self.per_decade) < 2 * self.error:
            return f"no effect of the loading rate is visible ({span})"
        word = "decreases" if self.per_decade < 0 else "increases"
        return (
            f"the force {word} by {abs(self.per_decade):.3g} +- {self.error:.2g} N for each factor "
            f"of ten of the loading rate ({span}): use the slowest ramps for the static level"
        )


def break_away(measured: Measured, *, rest: float = REST, offset: float = 0.0) -> BreakAways:
    """Find the break-away forces of all ramps in a record.

    A rest is an interval of at least 5 samples below `rest` times the largest speed that ends in
    motion. The break-away force is the largest force in the direction of that motion during the
    rest. The samples must resolve the rise of the force; otherwise the maximum is missed.

    Args:
        measured: samples with times; the force excludes inertia, or the ramps are slow.
        rest: share of the largest speed.
        offset: constant force [N] in addition to friction.

    Raises:
        ValueError: no times, or no rest that ends in motion.
    """
    rest = checks.number("break_away: rest", rest, above=0.0, upper=0.9)
    if measured.t is None:
        raise ValueError("break_away: expected a record with times, got points; pass t=")
    events = tuple(e for r in measured.records for e in _events(measured, r, rest, offset))
    if not events:
        raise ValueError(
            f"break_away: expected a rest of at least {SHORTEST} samples below {rest:g} of the "
            "largest speed that ends in motion, got none"
        )
    forces = np.array([event.force for event in events])
    level = float(np.median(forces))
    scatter = float(np.median(np.abs(forces - level))) / abs(level)
    decades = np.log10([event.rate for event in events])
    if len(events) < 3 or np.ptp(decades) < np.log10(APART):
        return BreakAways(events, level, scatter, None, 0.0)
    X = np.column_stack([np.ones(decades.size), decades])
    w, *_ = np.linalg.lstsq(X, forces, rcond=None)
    spread = float(np.sum((forces - X @ w) ** 2)) / (decades.size - 2)
    error = float(np.sqrt(spread * np.linalg.inv(X.T @ X)[1, 1]))
    return BreakAways(events, level, scatter, float(w[1]), error)


def _events(measured: Measured, record: slice, rest: float, offset: float) -> Iterator[BreakAway]:
    t, v, F = np.asarray(measured.t)[record], measured.v[record], measured.F[record] - offset
    for begin, end in runs(np.abs(v) < rest * measured.fastest):
        if end - begin < SHORTEST or end >= v.size:
            continue
        side = int(np.sign(v[end]))
        ramp = side * F[begin : end + 1]
        top = int(np.argmax(ramp))
        if top == 0 or ramp[top] <= 0:
            continue
        low, high = (share * ramp[top] for share in RISE)
        below = np.flatnonzero(ramp[:top] <= low)
        rise = slice(below[-1] + 1 if below.size else 0, top)  # the last rise
        times, force = t[begin : begin + top][rise], ramp[rise]
        rising = force < high
        rate = float(np.polyfit(times[rising], force[rising], 1)[0]) if rising.sum() > 1 else 0.0
        if rate > 0:
            yield BreakAway(float(t[begin + top]), float(ramp[top]), rate, side)
