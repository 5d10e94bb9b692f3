"""The stages that a compensating force goes through, each in the C only where it is chosen."""

from collections.abc import Sequence
from itertools import pairwise

import casadi as ca

from symfric.compensation.parts import Parts
from symfric.laws.base import smooth

Through = tuple[Parts, ca.SX]
"""What a stage returns: the parts with its own, and the force or velocity that it lets through."""


def blended(parts: Parts, wanted: ca.SX, v: ca.SX, v_blend: float) -> Through:
    """The desired velocity near zero of the measured one, beyond 2 v_blend the measured one, C2."""
    parts, width = parts.parameter(
        "v_blend", v_blend, "m/s", "up to here the desired velocity, beyond twice it the measured",
        lower=1e-12,
    )  # fmt: skip
    share = smooth.step5(ca.fabs(v) / width - 1)
    # each exactly at its end, whatever the other is
    return parts, ca.SX(share * v + (1 - share) * wanted)


def beyond_dead_zone(parts: Parts, v: ca.SX, dead_zone: float) -> Through:
    """The velocity less what lies within +-dead_zone, continuous: 0 inside."""
    parts, width = parts.parameter(
        "v_dead", dead_zone, "m/s", "velocities up to here count as rest"
    )
    return parts, ca.SX(v - smooth.clip(v, -width, width))


def built_up(
    parts: Parts, v: ca.SX, h: ca.SX | float, distance: float, table: Sequence[tuple[float, float]]
) -> Through:
    """The share b in [-1, 1] of sliding friction that has built up, its mean over the step.

    b+ = b + 2 v h / distance, held within +-1: linear in the way since the reversal, and by the
    table, if there is one, bent. What a shorter way back leaves stays, as in a Maxwell element.
    """
    parts, way = parts.parameter(
        "d_build", distance, "m", "way after a reversal until friction has built up", lower=1e-15
    )
    parts, b = parts.state("built", "1", "share of friction that has built up, -1 to 1")
    end = ca.SX(smooth.clip(b + 2 * v * h / way, -1.0, 1.0))
    mean = (b + end) / 2
    if table:
        mean = 2 * _interpolated(table, (1 + mean) / 2) - 1
    return parts.following(end), mean


def _interpolated(table: Sequence[tuple[float, float]], s: ca.SX) -> ca.SX:
    """Straight lines through the points."""
    f = ca.SX(table[0][1])
    for (a, low), (b, high) in pairwise(table):
        f += (high - low) * smooth.clip((s - a) / (b - a), 0.0, 1.0)
    return f


def freed(
    parts: Parts, wanted: ca.SX, v: ca.SX, h: ca.SX | float, force: float, time: float, rest: float
) -> Through:
    """A further force that grows while the desired velocity moves and the axis does not.

    Its share q in [-1, 1] goes with the pace 1/t_stick towards sign(v_ref) while |v| is below
    v_stick and |v_ref| beyond 2 v_stick, and towards 0 where |v| is beyond 2 v_stick or |v_ref|
    below v_stick, with straight lines in between.
    """
    parts, most = parts.parameter("F_stick", force, "N", "further force while the axis sticks")
    parts, pace = parts.parameter(
        "t_stick", time, "s", "time over which that force comes and goes", lower=1e-9
    )
    parts, slow = parts.parameter(
        "v_stick", rest, "m/s", "slower than this is rest, twice as fast is motion", lower=1e-12
    )
    parts, q = parts.state("stuck", "1", "share of the further force, -1 to 1")
    rests = smooth.clip(2 - ca.fabs(v) / slow, 0.0, 1.0)
    moves = smooth.clip(ca.fabs(wanted) / slow - 1, 0.0, 1.0)
    goal = ca.sign(wanted) * moves * rests
    end = q + smooth.clip(goal - q, -h / pace, h / pace)
    return parts.following(ca.SX(end)), ca.SX(most * end)


def dithered(parts: Parts, h: ca.SX | float, force: float, frequency: float) -> Through:
    """A sine of a force and frequency of its own."""
    parts, amplitude = parts.parameter("F_dither", force, "N", "amplitude of the dither")
    parts, pace = parts.parameter("f_dither", frequency, "Hz", "frequency of the dither")
    parts, phase = parts.state("phase", "1", "turns of the dither, 0 to 1")
    end = smooth.fraction(phase + pace * h)
    return parts.following(ca.SX(end)), ca.SX(amplitude * ca.sin(2 * ca.pi * end))


def ramped(parts: Parts, F: ca.SX, h: ca.SX | float, time: float) -> Through:
    """F in and out without a bump: over t_ramp, C1, while `enable` is above and below 1/2."""
    parts, on = parts.given("enable", "1", "above 0.5: on", lower=0.0, upper=1.0)
    parts, duration = parts.parameter("t_ramp", time, "s", "time of fading in or out", lower=1e-9)
    parts, e = parts.state("faded_in", "1", "0: off, 1: on")
    end = ca.SX(smooth.clip(e + ca.if_else(on > 0.5, h, -h) / duration, 0.0, 1.0))
    return parts.following(end), F * smooth.step3(end)


def limited(parts: Parts, F: ca.SX, limit: float) -> Through:
    """F within +-F_max."""
    parts, most = parts.parameter("F_max", limit, "N", "largest force that is added")
    return parts, ca.SX(smooth.clip(F, -most, most))


def slowed(parts: Parts, F: ca.SX, h: ca.SX | float, slew: float) -> Through:
    """F that changes by no more than F_rate h a step."""
    parts, rate = parts.parameter("F_rate", slew, "N/s", "fastest change of the force")
    parts, last = parts.state("F_last", "N", "force of the step before")
    end = ca.SX(last + smooth.clip(F - last, -rate * h, rate * h))
    return parts.following(end), end
