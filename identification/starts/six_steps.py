"""Six-step procedure for the static parameters of LuGre.

    F = F_C + (F_S - F_C) exp(-(v/v_s)^delta) + sigma_2 v

    1  F_S                    largest force of the curve
    2  F_C + sigma_2 v        smallest force, at v_min
    3  m^2 = 1/v_s^2          exponential part, up to v_min, with delta = 2
    4  sigma_2                linear part, from v_min on
    5  F_C                    force of step 2 minus sigma_2 v_min of step 4
    6  delta, v_s             exponential part again, with a free exponent

Each step uses only a part of the curve; a fit of all points at once (`identification.Fit`) has a
smaller error. `doubts` lists the values that the points do not determine.
Source: A Friction Model for Laminator Nips, MSc thesis TFRT-5968, Lund 2015, section 4.2; after
Olsson, Control Systems with Friction, PhD thesis, Lund 1996.
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from identification.starts.stribeck import Array, Curve, StribeckCurve, binned, samples
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
class Step:
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

    steps: tuple[Step, ...]
    values: dict[str, float]
    errors: dict[str, float]
    rms: float
    curve: Curve
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
    numbered = tuple(Step(number, *step) for number, step in enumerate(steps, start=1))
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
    curve: Curve, top: int, low: int, F_S: float, F_C: float, sigma_2: float
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


def _doubts(found: StribeckCurve, curve: Curve, low: int, count: int, unstable: float) -> list[str]:
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


def _of_line(curve: Curve, low: int) -> list[str]:
    """Return messages on the linear part, which begins at the smallest force."""
    if low == curve.v.size - 1:
        return ["the force falls up to the fastest point: no linear part, sigma_2 is set to 0"]
    if curve.v.size - low < LEAST:
        return [f"the linear part has {curve.v.size - low} points: sigma_2 is uncertain"]
    return []


def _no_fall(curve: Curve, top: int, low: int) -> str:
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
