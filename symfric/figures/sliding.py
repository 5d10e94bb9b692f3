"""Figures of a contact whose velocity is given: hysteresis, lag, reversals, jumps, dwell."""

from collections.abc import Sequence
from math import isfinite

import casadi as ca
import numpy as np

from symfric.figures.data import Curve, FigureData
from symfric.figures.magnitudes import NORMAL_FORCE, Scales, require, scales
from symfric.figures.motion import UNITS, Slide, slides, through
from symfric.foundation.parameters import parameters
from symfric.laws import AnyLaw, law_name, steady_force

ROUTE = (0.0, 2.0, -2.0, 1.0, -1.0, 1.0, -2.0, 2.0)
"""Turning points in pre-sliding distances: a loop from -1 to 1 within one from -2 to 2."""


def hysteresis(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    speeds: Sequence[float] = (1.0, 5.0, 20.0),
    duration: float = 8.0,
    route: Sequence[float] | None = None,
) -> FigureData:
    """Force over position along nested loops at several `speeds` (Lampaert et al. 2003).

    Columns t [s], x [m], v [m/s], F [N]. The loops turn at 1 and 2 pre-sliding distances, or at
    the positions `route` [m], and take `duration` [s] at speed 1. A law with non-local memory
    returns to the force of each turning point it comes back to (the second arrival at 1 and at -2);
    a rate-independent one draws the same curve at every speed.

    Raises:
        ValueError: a law without pre-sliding displacement, or one that needs the applied force.
    """
    require("hysteresis", law, "P")
    if route is None:
        stretch = (given or scales(law, N)).stretch
        route = [point * stretch for point in ROUTE]
    elif len(route) < 2:
        raise ValueError(f"hysteresis: route: expected at least two turning points, got {route!r}")
    leg = duration / (len(route) - 1)
    slide = slides(law, N, through(route, leg))
    curves = [
        slide(f"{speed:g}x", np.linspace(0.0, duration / speed, 1401), speed) for speed in speeds
    ]
    return FigureData(
        "hysteresis",
        f"pre-sliding hysteresis, {duration:g} s at 1x, N = {N:g} N",
        UNITS,
        (("x", "F"),),
        tuple(curves),
    )


def lag(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    frequencies: Sequence[float] = (2.0, 5.0, 10.0),
    periods: int = 3,
) -> FigureData:
    """Force over a velocity that rises and falls without reversal (Lampaert et al. 2003, fig. 6).

        v = V [2.5 + 2 sin(2 pi f t)],   V the Stribeck velocity

    Columns t [s], x [m], v [m/s], F [N] of the last of `periods`, for each f of `frequencies` [Hz];
    the curve "steady" is F in steady sliding. With lag the force is higher while v rises than
    while it falls. A memory much longer than the periods has not settled by then: rate-and-state
    renews its contacts over D_c, here within seconds, and shows its direct effect; give it a
    larger velocity by `given`.

    Raises:
        ValueError: a law without frictional lag.
    """
    require("lag", law, "L")
    V = (given or scales(law, N)).velocity

    def velocity(t: ca.SX, pace: ca.SX) -> ca.SX:
        return V * (2.5 + 2 * ca.sin(2 * ca.pi * pace * t))

    slide = slides(law, N, velocity)
    curves = last_period(slide, frequencies, periods, 401)
    v = V * np.linspace(0.5, 4.5, 401)
    steady = Curve(law_name(law), "steady", {"v": v, "F": steady_force(law, v, N)}, reference=True)
    return FigureData(
        "lag",
        f"frictional lag, v = {V:.3g} m/s (2.5 + 2 sin(2πft)), N = {N:g} N",
        UNITS,
        (("v", "F"),),
        (*curves, steady),
    )


def transition(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    frequencies: Sequence[float] = (2.0, 10.0),
    periods: int = 2,
) -> FigureData:
    """Force over a sinusoidal velocity of 5 Stribeck velocities (Lampaert et al. 2003).

    Columns t [s], x [m], v [m/s], F [N] of the last of `periods`, for each of `frequencies` [Hz].
    The contact goes from pre-sliding to sliding and back twice a period.

    Raises:
        ValueError: a law without pre-sliding displacement, or one that needs the applied force.
    """
    require("transition", law, "P")
    V = 5 * (given or scales(law, N)).velocity

    def velocity(t: ca.SX, pace: ca.SX) -> ca.SX:
        return V * ca.sin(2 * ca.pi * pace * t)

    slide = slides(law, N, velocity)
    curves = last_period(slide, frequencies, periods, 1201)
    return FigureData(
        "transition",
        f"from pre-sliding to sliding, v = {V:.3g} m/s sin(2πft), N = {N:g} N",
        UNITS,
        (("v", "F"), ("x", "F")),
        curves,
    )


def last_period(
    slide: Slide, frequencies: Sequence[float], periods: int, samples: int
) -> tuple[Curve, ...]:
    """The last of `periods` at each of `frequencies` [Hz]."""
    return tuple(
        slide(f"{f:g} Hz", np.linspace((periods - 1) / f, periods / f, samples), f)
        for f in frequencies
    )


LEG = 20.0
"""Way at each velocity, in ways that renew the contacts."""


def velocity_step(
    law: AnyLaw, N: float = NORMAL_FORCE, given: Scales | None = None, factor: float = 10.0
) -> FigureData:
    """Force along the way while the velocity jumps from V to `factor` V and back.

    V is the Stribeck velocity, that of `RateAndState` its reference velocity. Columns t [s], x [m],
    v [m/s], F [N]. The way at each velocity is 20 times that which renews the contacts, D_c or the
    pre-sliding distance. Rate-and-state friction jumps by a ln(factor) N and falls by
    b ln(factor) N behind it.

    Raises:
        ValueError: a law without frictional lag.
    """
    require("velocity_step", law, "L")
    magnitudes = given or scales(law, N)
    V = magnitudes.velocity
    slow = LEG * memory(law, magnitudes) / V
    ends = np.cumsum([0.5 * slow, slow / factor, slow])

    def velocity(t: ca.SX, pace: ca.SX) -> ca.SX:
        fast = ca.logic_and(t >= ends[0], t < ends[1])
        return pace * V * ca.if_else(fast, factor, 1.0)

    legs = zip((0.0, *ends[:-1]), ends, strict=True)
    times = np.concatenate([a + (b - a) * np.linspace(0.0, 1.0, 301) ** 3 for a, b in legs])
    curve = slides(law, N, velocity)("", np.unique(times), 1.0, jumps=ends[:-1].tolist())
    return FigureData(
        "velocity_step",
        f"v from {V:.3g} to {factor * V:.3g} m/s and back, N = {N:g} N",
        UNITS,
        (("x", "F"),),
        (Curve(law_name(law), "", curve.columns),),
    )


def dwell(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    holds: Sequence[float] = (0.01, 0.1, 1.0, 10.0, 100.0, 1000.0),
) -> FigureData:
    """Peak of the force when sliding starts again after a time at rest (slide, hold, slide).

    The contact slides at the Stribeck velocity until it is steady, rests for each of `holds` [s],
    and slides again. Columns hold [s], F [N], the greatest force from then on.

    Raises:
        ValueError: a law whose static friction does not depend on the dwell time.
    """
    require("dwell", law, "T")
    magnitudes = given or scales(law, N)
    V, way = magnitudes.velocity, 20 * memory(law, magnitudes)
    slide_for = max(1.0, way / V)

    def velocity(t: ca.SX, hold: ca.SX) -> ca.SX:
        resting = ca.logic_and(t >= slide_for, t < slide_for + hold)
        return ca.if_else(resting, 0.0, V)

    slide = slides(law, N, velocity)
    again = np.concatenate([[0.0], slide_for * np.geomspace(1e-5, 1.0, 801)])
    peaks = [
        slide("", slide_for + hold + again, hold, jumps=(slide_for, slide_for + hold))["F"].max()
        for hold in holds
    ]
    return FigureData(
        "dwell",
        f"slide, hold, slide at {V:.3g} m/s, N = {N:g} N",
        {"hold": "s", "F": "N"},
        (("hold", "F"),),
        (Curve(law_name(law), "", {"hold": np.array(holds), "F": np.array(peaks)}),),
        log=("hold",),
        dots=True,
    )


def memory(law: AnyLaw, magnitudes: Scales) -> float:
    """The way that renews the contacts [m]: D_c, else the pre-sliding distance, else 1e-5."""
    known = parameters(law)
    if "D_c" in known:
        return float(known["D_c"].value)
    return magnitudes.stretch if isfinite(magnitudes.stretch) else 1e-5
