"""Figures of a contact with a prescribed velocity: steady curves, hysteresis, lag, jumps, dwell."""

from collections.abc import Sequence
from math import isfinite

import casadi as ca
import numpy as np

from symfric.figures.data import Content, Curve, behaviour, finite
from symfric.figures.motion import NORMAL_FORCE, UNITS, Scales, Slide, scales, slides, through
from symfric.foundation.parameters import parameters, with_values
from symfric.laws import AnyLaw, Law, RuiWang, SelfTuning, law_name, steady_force, steady_inputs

over_velocity = behaviour((), {"v": "m/s", "F": "N"}, ("v", "F"))


@over_velocity
def profile(law: AnyLaw, N: float = NORMAL_FORCE, given: Scales | None = None) -> Content:
    """Show the force-velocity profile over +-5 Stribeck velocities, for any law.

    Columns v [m/s], F [N]. Further inputs of a law, such as the applied force, have the values
    stated in the title, with the sign of v.

    Args:
        law: law with numerical parameters.
        N: normal force [N].
        given: magnitudes that determine the range; by default those of the law.
    """
    V = (given or scales(law, N)).velocity
    fine = np.geomspace(1e-4 * V, 5 * V, 600)
    v = np.concatenate([-fine[::-1], [0.0], fine])
    F = finite("profile", law, steady_force(law, v, N))
    title = f"force in steady sliding, N = {N:g} N{steady_inputs(law)}"
    return title, [Curve(law_name(law), "", {"v": v, "F": F})]


SHAPES = (0.0, 0.5, 1.0, 1.2, 1.4, 1.6, 1.8, 2.0)
STIFFNESSES = (0.05, 0.1, 0.2, 0.3, 0.5, 1.0)
CURVATURES = (-1.0, 0.0, 0.25, 0.5, 0.75, 0.95)

SWEPT = {
    "B": ("stiffness factor", "sets how steeply the force rises at rest, not how high the peak is"),
    "C": ("shape factor", "up to 1 gives a plateau, above 1 a peak from which the force falls"),
    "E": ("curvature factor", "moves the peak to another velocity and leaves height and slope"),
}
"""Name and effect of each factor."""


@over_velocity
def sweep_b(
    law: AnyLaw, N: float = NORMAL_FORCE, given: Scales | None = None,
    values: Sequence[float] = STIFFNESSES,
) -> Content:  # fmt: skip
    """Show profiles for the stiffness factors `values` as shares of B.

    Columns v [m/s], F [N]. B scales the velocity and does not change the height of the peak (doi
    10.1177/14644193231169325, fig. 8).

    Raises:
        ValueError: the law is neither `SelfTuning` nor `RuiWang`.
    """
    return _sweep("B", law, N, given, values)


@over_velocity
def sweep_c(
    law: AnyLaw, N: float = NORMAL_FORCE, given: Scales | None = None,
    values: Sequence[float] = SHAPES,
) -> Content:  # fmt: skip
    """Show profiles for the shape factors `values` in [0, 2] (same source, fig. 7).

    Columns v [m/s], F [N]. `SelfTuning` computes C >= 1 from mu_d / mu_s; this figure sets C, as
    in `RuiWang` with D = mu_s N. C = 0 gives no friction, C <= 1 is monotone, C > 1 has a peak.

    Raises:
        ValueError: the law is neither `SelfTuning` nor `RuiWang`.
    """
    return _sweep("C", law, N, given, values)


@over_velocity
def sweep_e(
    law: AnyLaw, N: float = NORMAL_FORCE, given: Scales | None = None,
    values: Sequence[float] = CURVATURES,
) -> Content:  # fmt: skip
    """Show profiles for the curvature factors `values` below 1 (same source, fig. 9).

    Columns v [m/s], F [N]. E moves the peak but changes neither its height nor the slope at rest.

    Raises:
        ValueError: the law is neither `SelfTuning` nor `RuiWang`.
    """
    return _sweep("E", law, N, given, values)


def _sweep(
    factor: str, law: AnyLaw, N: float, given: Scales | None, values: Sequence[float]
) -> Content:
    """Return profiles of the magic formula of `law` for `values` of one factor."""
    if isinstance(law, RuiWang):
        base = law
    elif isinstance(law, SelfTuning):
        base = RuiWang(D=law.mu_s * N, C=law.C, B=law.B, E=law.E)
    else:
        raise ValueError(
            f"sweep_{factor.lower()} of {law_name(law)}: expected a law with the factors B, C and "
            "E, self_tuning or rui_wang, got one without them"
        )
    v = np.linspace(-2.0, 2.0, 1201) * (given or scales(law, N)).velocity
    curves: list[Curve] = []
    for value in [x * float(base.B) for x in values] if factor == "B" else values:
        factors = {"B": base.B, "C": base.C, "E": base.E} | {factor: value}
        case = f"{factor} = {value:g}" + (" s/m" if factor == "B" else "")
        F = steady_force(RuiWang(D=base.D, **factors), v, N)
        curves.append(Curve(law_name(law), case, {"v": v, "F": F}))
    name, effect = SWEPT[factor]
    title = f"profiles for values of the {name} {factor}, N = {N:g} N"
    return title, curves, f"{factor} {effect}"


ROUTE = (0.0, 2.0, -2.0, 1.0, -1.0, 1.0, -2.0, 2.0)
"""Turning points in pre-sliding distances: a loop from -1 to 1 inside a loop from -2 to 2."""


@behaviour(("P",), UNITS, ("x", "F"))
def hysteresis(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    speeds: Sequence[float] = (1.0, 5.0, 20.0),
    duration: float = 8.0,
    route: Sequence[float] | None = None,
) -> Content:
    """Show the force over position along nested loops at several `speeds` (Lampaert et al. 2003).

    Columns t [s], x [m], v [m/s], F [N]. The turning points of the loops are +-1 and +-2
    pre-sliding distances, or the positions `route` [m]. The motion takes `duration` [s] at speed 1.
    A law with non-local memory returns to the force of a turning point that is reached again (the
    second arrival at 1 and at -2). A rate-independent law has the same curve at every speed.

    Raises:
        ValueError: the law has no pre-sliding displacement, or needs the applied force.
    """
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
    return f"pre-sliding hysteresis, {duration:g} s at 1x, N = {N:g} N", curves


@behaviour(("L",), UNITS, ("v", "F"))
def lag(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    frequencies: Sequence[float] = (2.0, 5.0, 10.0),
    periods: int = 3,
) -> Content:
    """Show the force over an oscillating velocity without reversal (Lampaert et al. 2003, fig. 6).

        v = V [2.5 + 2 sin(2 pi f t)],   V the Stribeck velocity

    Columns t [s], x [m], v [m/s], F [N] of the last of `periods`, for each f of `frequencies` [Hz].
    The curve "steady" is F in steady sliding. With lag the force is larger while v rises than while
    it falls. Periods that are much shorter than the memory of the law do not reach a periodic
    state: rate-and-state friction renews its contacts over D_c, which takes seconds, and shows only
    its direct effect; a larger velocity in `given` avoids this.

    Raises:
        ValueError: the law has no frictional lag.
    """
    V = (given or scales(law, N)).velocity

    slide = slides(law, N, lambda t, pace: V * (2.5 + 2 * ca.sin(2 * ca.pi * pace * t)))
    curves = last_period(slide, frequencies, periods, 401)
    v = V * np.linspace(0.5, 4.5, 401)
    steady = Curve(law_name(law), "steady", {"v": v, "F": steady_force(law, v, N)}, reference=True)
    title = f"frictional lag, v = {V:.3g} m/s (2.5 + 2 sin(2πft)), N = {N:g} N"
    return title, [*curves, steady]


@behaviour(("P",), UNITS, ("v", "F"), ("x", "F"))
def transition(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    frequencies: Sequence[float] = (2.0, 10.0),
    periods: int = 2,
) -> Content:
    """Show the force over a sinusoidal velocity of 5 Stribeck velocities (Lampaert et al. 2003).

    Columns t [s], x [m], v [m/s], F [N] of the last of `periods`, for each of `frequencies` [Hz].
    The contact changes from pre-sliding to sliding and back twice per period.

    Raises:
        ValueError: the law has no pre-sliding displacement, or needs the applied force.
    """
    V = 5 * (given or scales(law, N)).velocity

    slide = slides(law, N, lambda t, pace: V * ca.sin(2 * ca.pi * pace * t))
    title = f"from pre-sliding to sliding, v = {V:.3g} m/s sin(2πft), N = {N:g} N"
    return title, last_period(slide, frequencies, periods, 1201)


def last_period(
    slide: Slide, frequencies: Sequence[float], periods: int, samples: int
) -> tuple[Curve, ...]:
    """Return the curve of the last of `periods` at each of `frequencies` [Hz]."""
    return tuple(
        slide(f"{f:g} Hz", np.linspace((periods - 1) / f, periods / f, samples), f)
        for f in frequencies
    )


LEG = 20.0
"""Ratio of the path at each velocity to the path that renews the contacts."""


@behaviour(("L",), UNITS, ("x", "F"))
def velocity_step(
    law: AnyLaw, N: float = NORMAL_FORCE, given: Scales | None = None, factor: float = 10.0
) -> Content:
    """Show the force along a path on which the velocity jumps from V to `factor` V and back.

    V is the Stribeck velocity, or the reference velocity of `RateAndState`. Columns t [s], x [m],
    v [m/s], F [N]. The path at each velocity is 20 times the path that renews the contacts, D_c or
    the pre-sliding distance. Rate-and-state friction jumps by a ln(factor) N, then falls by
    b ln(factor) N.

    Raises:
        ValueError: the law has no frictional lag.
    """
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
    return f"v from {V:.3g} to {factor * V:.3g} m/s and back, N = {N:g} N", [curve]


@behaviour(("T",), {"hold": "s", "F": "N"}, ("hold", "F"), log=("hold",), dots=True)
def dwell(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    holds: Sequence[float] = (0.01, 0.1, 1.0, 10.0, 100.0, 1000.0),
) -> Content:
    """Show the peak of the force when sliding starts again after a rest (slide, hold, slide).

    The contact slides at the Stribeck velocity until it is steady, rests for each of `holds` [s],
    and slides again. Columns hold [s], F [N], the largest force after the rest.

    Raises:
        ValueError: the static friction of the law does not depend on the dwell time.
    """
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
    columns = {"hold": np.array(holds), "F": np.array(peaks)}
    return f"slide, hold, slide at {V:.3g} m/s, N = {N:g} N", [Curve(law_name(law), "", columns)]


@over_velocity
def steady_state(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    shares: Sequence[float] = (0.0, 0.25, 0.5, 1.0),
) -> Content:
    """Show the force in steady sliding up to 10 Stribeck velocities V (thesis, Lund 2015).

    Columns v [m/s], F [N]. A law with the viscous coefficient sigma_2 is shown with its own value
    and, dashed, with values for which viscous friction at 10 V is each of `shares` of the kinetic
    level. The share 0 is the dry part of the law.
    """
    magnitudes = given or scales(law, N)
    v = np.geomspace(1e-3, 10.0, 601) * magnitudes.velocity
    F = finite("steady_state", law, steady_force(law, v, N))
    curves = [Curve(law_name(law), "", {"v": v, "F": F})]
    if isinstance(law, Law) and "sigma_2" in parameters(law):
        unit = parameters(law)["sigma_2"].unit
        load = N if unit == "s/m" else 1.0
        for share in shares:
            sigma_2 = share * magnitudes.kinetic / (10 * magnitudes.velocity * load)
            other = with_values(law, {"sigma_2": sigma_2})
            columns = {"v": v, "F": steady_force(other, v, N)}
            case = f"sigma_2 = {sigma_2:.4g} {unit}"
            curves.append(Curve(law_name(law), case, columns, reference=True))
    return f"steady sliding, N = {N:g} N{steady_inputs(law)}", curves


def memory(law: AnyLaw, magnitudes: Scales) -> float:
    """Return the path [m] that renews the contacts: D_c, the pre-sliding distance, or 1e-5 m."""
    known = parameters(law)
    if "D_c" in known:
        return float(known["D_c"].value)
    return magnitudes.stretch if isfinite(magnitudes.stretch) else 1e-5
