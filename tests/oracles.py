"""Answers from elsewhere: closed forms and right-hand sides written out in plain Python.

Nothing here imports symfric, so that a mistake cannot stand on both sides of a comparison.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import acos, atan, atan2, cos, exp, hypot, inf, pi, sin, sqrt


@dataclass(frozen=True)
class StickSlip:
    """Periodic stick-slip of a block on a belt."""

    period: float
    stick_time: float
    slip_time: float
    x_max: float
    x_min: float
    x_centre: float


def rabinowicz_coulomb(
    mu_s: float, mu_d: float, m: float, k: float, v_belt: float, g: float
) -> StickSlip:
    """Stick-slip under Coulomb friction with a static level, in closed form.

    The block sticks until the spring force reaches mu_s m g, then swings freely about the
    elongation mu_d m g / k; it leaves and returns to the belt with the belt's velocity, so that
    the elongations at both ends of the slip lie symmetrically about the centre.
    """
    centre, excess = mu_d * m * g / k, (mu_s - mu_d) * m * g / k
    w = sqrt(k / m)
    amplitude = hypot(excess, v_belt / w)
    stick, slip = 2 * excess / v_belt, 2 / w * (pi - atan(excess * w / v_belt))
    return StickSlip(stick + slip, stick, slip, centre + amplitude, centre - amplitude, centre)


def rabinowicz_karnopp(
    mu_s: float, mu_d: float, m: float, k: float, v_belt: float, g: float, D_v: float
) -> StickSlip:
    """Stick-slip under Karnopp friction in closed form; sticking counts as rest in the band.

    From break-away the static level acts until the block lags the belt by D_v; then it swings
    freely about mu_d m g / k until it lags by D_v again, and stops on the belt.
    """
    w = sqrt(k / m)
    leaves, centre = mu_s * m * g / k, mu_d * m * g / k
    in_band = acos(1 - D_v / v_belt) / w
    off, v = leaves + v_belt / w * sin(w * in_band) - centre, v_belt - D_v
    free = 2 / w * (pi - atan(off * w / v))
    stick, amplitude = (leaves - (centre - off)) / v_belt, hypot(off, v / w)
    slip = in_band + free
    return StickSlip(stick + slip, stick, slip, centre + amplitude, centre - amplitude, centre)


Rates = Callable[[float, list[float]], list[float]]


def rabinowicz_lugre() -> Rates:
    """Right-hand side of (x, v, z) for the block on a belt with LuGre friction, with a true |v|."""

    def rates(t: float, y: list[float]) -> list[float]:
        x, v, z = y
        sliding = v - 0.1
        level = 0.8 * 9.81 * (0.1 + (0.15 - 0.1) * exp(-((sliding / 1e-3) ** 2)))
        z_dot = sliding - abs(sliding) * 1e5 * z / level
        return [v, -(2.1 * x + 1e5 * z + 190.0 * z_dot) / 0.8, z_dot]

    return rates


def dahl_virgin(n: float, x: float, sigma_0: float, F_C: float) -> float:
    """Force after sliding the distance `x` from rest, of Dahl's law with exponent n."""
    s = sigma_0 * x / F_C
    if n == 0.0:
        return min(s, 1.0) * F_C
    if n == 0.5:
        return F_C * (1 - max(1 - s / 2, 0.0) ** 2)
    if n == 1.0:
        return F_C * (1 - exp(-s))
    if n == 2.0:
        return F_C * s / (1 + s)
    raise NotImplementedError(n)


def viscous_ramp(t: float, m: float, c: float, v_0: float, u_0: float, slope: float) -> float:
    """Velocity of m v' = u_0 + slope t - c v from v(0) = v_0."""
    tau = m / c
    steady = (u_0 + slope * (t - tau)) / c
    return steady + (v_0 - (u_0 - slope * tau) / c) * exp(-t / tau)


def viscous_sine(t: float, m: float, c: float, amplitude: float, w: float) -> float:
    """Velocity of m v' = amplitude sin(w t) - c v from rest."""
    tau = m / c
    gain = amplitude / c / (1 + (w * tau) ** 2)
    return gain * (sin(w * t) - w * tau * cos(w * t) + w * tau * exp(-t / tau))


def stribeck_curve(
    v: float, N: float, mu_s: float, mu_d: float, v_s: float, delta: float, sigma_2: float = 0.0
) -> float:
    """Steady-state force of the bristle laws at v != 0, after the tables of the thesis form."""
    direction = 1.0 if v > 0 else -1.0
    speed = abs(v)
    weight = 0.0 if speed == inf else exp(-((speed / v_s) ** delta))
    return direction * N * (mu_s * weight + mu_d * (1 - weight)) + sigma_2 * v


def rabinowicz_motion(v_0: float, t_end: float, block: tuple[float, ...]) -> tuple[float, int]:
    """Elongation of the block at t_end and number of break-aways before, phase by phase.

    It starts at x = 0 with v_0; sliding is an arc about +-mu_d N/k, sticking a straight line.
    """
    mu_s, mu_d, m, k, belt, g = block
    N, w = m * g, sqrt(k / m)
    t, x, v, breaks = 0.0, 0.0, v_0, 0
    mode = (v > belt) - (v < belt)
    while True:
        if mode == 0:
            free = (mu_s * N / k - x) / belt
            if t + free >= t_end:
                return x + belt * (t_end - t), breaks
            t, x, v, mode, breaks = t + free, mu_s * N / k, belt, -1, breaks + 1
        c = -mode * mu_d * N / k
        A, B = x - c, v / w  # x = c + A cos(w s) + B sin(w s); v is that of the belt again at w s
        angle = 2 * atan(-A * w / belt) if v == belt else _back_at(A * w, B * w, belt, mode)
        s = angle % (2 * pi) / w
        if t + s >= t_end:
            return c + A * cos(w * (t_end - t)) + B * sin(w * (t_end - t)), breaks
        t, x, v = t + s, c + A * cos(w * s) + B * sin(w * s), belt
        mode = 0 if k * abs(x) <= mu_s * N else (-1 if x > 0 else 1)


def _back_at(a: float, b: float, level: float, mode: int) -> float:
    """The first angle at which b cos - a sin, beyond `level` on the side `mode`, comes back."""
    size, phase = hypot(a, b), atan2(a, b)  # b cos(q) - a sin(q) = size cos(q + phase)
    turns = (sign * acos(level / size) - phase for sign in (1.0, -1.0))
    return min(turn % (2 * pi) for turn in turns)


def damped_block_events(
    v_belt: float, t_end: float, *, m: float, k: float, g: float, mu_s: float, mu_d: float,
    sigma_2: float,
) -> list[float]:  # fmt: skip
    """Times at which a block on a belt, with viscous friction, too, sticks and slips in turn.

    It starts at x = 0 at rest. Slower than the belt it swings about a centre with damping, and
    sticks before the first maximum of its velocity that reaches the belt's.
    """
    decay, centre = sigma_2 / (2 * m), (mu_d * m * g + sigma_2 * v_belt) / k
    w = sqrt(k / m - decay**2)
    found: list[float] = []
    t, x, v = 0.0, 0.0, 0.0
    while True:
        a, b = x - centre, (v + decay * (x - centre)) / w

        def swing(s: float, a: float = a, b: float = b) -> tuple[float, float]:
            c, d = (b * cos(w * s), a * cos(w * s)), (b * sin(w * s), a * sin(w * s))
            fade = exp(-decay * s)
            return fade * (c[1] + d[0]), fade * (w * (c[0] - d[1]) - decay * (c[1] + d[0]))

        # extremes of v: v' is a sinusoid that fades, of which this is the phase
        rise = -k / m * a - 2 * decay * v
        slope = (-k / m * v - 2 * decay * rise + decay * rise) / w
        first = atan2(-rise, slope) % pi / w
        peaks = [first + j * pi / w for j in range(int((t_end - t) * w / pi) + 2)]
        low = 0.0
        for peak in peaks:
            if swing(peak)[1] >= v_belt and swing(low)[1] < v_belt:
                break
            low = peak
        else:
            return found
        high = peak
        for _ in range(80):
            middle = (low + high) / 2
            low, high = (low, middle) if swing(middle)[1] >= v_belt else (middle, high)
        t, x, v = t + high, centre + swing(high)[0], v_belt
        held = max(0.0, (mu_s * m * g / k - x) / v_belt)
        for event in (t, t + held):
            if event > t_end:
                return found
            found.append(event)
        t, x = t + held, x + held * v_belt
