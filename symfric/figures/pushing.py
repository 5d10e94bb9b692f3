"""Figures of a block under a prescribed force: stiction, drift, break-away."""

from collections.abc import Sequence
from math import cbrt, isfinite, sqrt

import casadi as ca
import numpy as np

from symfric.figures.data import Array, Content, Curve, FigureData, behaviour, check_any
from symfric.figures.motion import MASS, NORMAL_FORCE, Scales, fine, pushed, scales
from symfric.foundation import checks
from symfric.integrator import Input, Linear
from symfric.laws import AnyLaw, law_name


def push(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    *,
    force: Input,
    t_end: float,
    mass: float = MASS,
    samples: int = 2001,
) -> FigureData:
    """Show the motion of a block with friction `law`, from rest under `force` [N].

    Columns t [s], F_e [N], x [m], v [m/s], F [N]. For a law, `simulate` with the scene `Drive`
    gives the same motion with more signals. A population of contacts, which has no scene, is
    integrated by explicit steps.

    Args:
        law: any law of a scene, or a population.
        N: normal force [N].
        force: a number, a function of time, or samples (`Linear`, `Hold`).
        t_end: end of the motion [s].
        mass: mass of the block [kg].
        samples: number of rows.

    Raises:
        ValueError: `law` is not a law, or a number is not positive.
        SolveError: the simulation failed.
    """
    check_any("push", law)
    checks.number("push: t_end", t_end, unit="s", above=0.0)
    checks.number("push: mass", mass, unit="kg", above=0.0)
    t = np.linspace(0.0, t_end, checks.count("push: samples", samples, least=2))
    seen = pushed(law, N, mass, force, t_end).at(t)
    names = {"F_e": "force", "x": "x", "v": "v", "F": "friction"}
    columns = {"t": t} | {name: seen[signal] for name, signal in names.items()}
    return FigureData(
        "push",
        f"block of {mass:g} kg under a force, N = {N:g} N",
        {"t": "s", "F_e": "N", "x": "m", "v": "m/s", "F": "N"},
        (("t", "F_e"), ("t", "F"), ("t", "x")),
        (Curve(law_name(law), "", columns),),
    )


@behaviour(
    ("D", "S"), {"t": "s", "F_e": "N", "F": "N", "v": "m/s"}, ("F_e", "F"), ("t", "v")
)  # fmt: skip
def stiction(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    excess: float = 1.3,
    period: float = 1.0,
) -> Content:
    """Show friction and velocity of a block under F_e = excess F_S sin(2 pi t/period).

    F_S is the static level; the mass is 0.8 kg, or 1 kg per 1.5 N of F_S if that is larger.
    Columns t [s], F_e, F [N], v [m/s] over one and a half periods, starting at rest. At rest the
    friction equals F_e, the diagonal of the first panel. While the block slides, it is the kinetic
    force with the sign of the velocity.

    Raises:
        ValueError: a law with neither dynamic nor static friction.
    """
    magnitudes = given or scales(law, N)

    def force(t: ca.SX) -> ca.SX:
        return excess * magnitudes.static * ca.sin(2 * ca.pi / period * t)

    run = pushed(law, N, magnitudes.mass, force, 1.5 * period)
    found = run.at(t := np.union1d(fine(run), np.linspace(0.0, 1.5 * period, 601)))
    columns = {"t": t, "F_e": found["force"], "F": found["friction"], "v": found["v"]}
    title = f"pulled by F_e = {excess:g} F_S sin(2πt/{period:g} s), N = {N:g} N"
    return title, [Curve(law_name(law), "", columns)]


RELEASED, REST, HOLD = 1.05, 0.45, 0.5
"""End of the push, shortest time without load after it, and duration of the constant load [s]."""


def time_to_rest(law: AnyLaw, N: float, magnitudes: Scales) -> float:
    """Return the time without load [s] in which a block comes to rest after break-away.

    It is `REST`, doubled until the block moves by no more than the pre-sliding distance, or a
    thousandth of its path, during the last quarter. It is doubled at most five times, since some
    laws continue to creep.
    """

    def push(t: ca.SX) -> ca.SX:
        return ca.if_else(t < RELEASED, 1.05 * magnitudes.static * ca.fmin(t, 1.0), 0.0)

    rest = REST
    for _ in range(5):
        end = RELEASED + rest
        run = pushed(law, N, magnitudes.mass, push, end)
        x = run.at(np.linspace(0.0, end, 1001))["x"]
        late = run.at(np.linspace(end - rest / 4, end, 101))["x"]
        still = magnitudes.stretch if isfinite(magnitudes.stretch) else 0.0
        if np.ptp(late) <= max(still, 1e-3 * np.ptp(x)):
            break
        rest *= 2
    return rest


@behaviour(
    ("S", "P"), {"t": "s", "F_e": "N", "x": "m", "F": "N", "x_mean": "m"}, ("t", "x_mean")
)  # fmt: skip
def drift(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    frequency: float = 10.0,
    t_end: float = 8.0,
) -> Content:
    """Show the displacement of a block under a vibrating force (Lampaert et al. 2003, figs. 8, 9).

        F_e = 1.05 F_S t                      up to 1 s, constant until 1.05 s (break-away)
        F_e = 0                               up to 1.5 s, or until the block rests
        F_e = 0.5 F_b                         for 0.5 s
        F_e = F_b [0.5 + 0.3 sin(2 pi f t)]   afterwards

    F_S is the static level. F_b is the kinetic level, or sigma_0 z_ba for `ElastoPlastic`, which is
    drift-free below that force only. The mass is 0.8 kg, or 1 kg per 1.5 N of F_S if that is
    larger. Columns t [s], F_e, F [N]; x [m], the displacement since the start of the vibration; and
    x_mean [m], the mean of x over two periods, which is drawn and constant for a block that only
    oscillates. The vibration lasts until `t_end`, plus the time by which the block rests later than
    1.5 s. A law without drift stays in place after the first periods, LuGre moves on with every
    period, and a law without states creeps.

    Raises:
        ValueError: a law with neither static friction nor pre-sliding.
    """
    magnitudes = given or scales(law, N)
    peak, base = 1.05 * magnitudes.static, magnitudes.elastic
    hold_from = RELEASED + time_to_rest(law, N, magnitudes)
    vibrate_from = hold_from + HOLD
    t_end += hold_from - (RELEASED + REST)

    def force(t: ca.SX) -> ca.SX:
        shaken = base * (0.5 + 0.3 * ca.sin(2 * ca.pi * frequency * (t - vibrate_from)))
        held = ca.if_else(t < vibrate_from, 0.5 * base, shaken)
        loaded = ca.if_else(t < hold_from, 0.0, held)
        return ca.if_else(t < RELEASED, peak * ca.fmin(t, 1.0), loaded)

    last = t_end + 1 / frequency  # the mean around t_end needs later values
    run = pushed(law, N, magnitudes.mass, force, last)
    t = np.linspace(RELEASED, last, 1 + round(400 * (last - RELEASED)))
    found = run.at(t)
    rest = float(run.at(vibrate_from)["x"][0])
    columns = {"t": t, "F_e": found["force"], "x": found["x"] - rest, "F": found["friction"]}
    keep = (t >= vibrate_from - 0.2) & (t <= t_end + 1e-9)
    once = over_period(t, columns["x"], 1 / frequency)
    columns["x_mean"] = over_period(t, once, 1 / frequency)  # twice, to remove elastic oscillation
    title = f"drift under {frequency:g} Hz below break-away, mean over two periods, N = {N:g} N"
    return title, [Curve(law_name(law), "", {name: c[keep] for name, c in columns.items()})]


def over_period(t: Array, x: Array, period: float) -> Array:
    """Return the mean of `x` over the `period` [s] around each of the times `t`, shape (n,).

    Near the ends it is the mean over the first or the last full period.
    """
    way = np.concatenate([[0.0], np.cumsum((x[1:] + x[:-1]) / 2 * np.diff(t))])
    middle = np.clip(t, t[0] + period / 2, t[-1] - period / 2)
    before, after = (np.interp(middle + side * period / 2, t, way) for side in (-1, 1))
    return np.asarray((after - before) / period)


SLID = 10.0
"""Number of pre-sliding distances after which bristles are in steady sliding."""


@behaviour(("S", "P"), {"rate": "N/s", "F": "N"}, ("rate", "F"), log=("rate",), dots=True)
def break_away(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    rates: Sequence[float] = (0.1, 0.3, 1.0, 3.0, 10.0, 30.0),
) -> Content:
    """Show the largest friction force of a block under a load that increases at a constant rate.

    Columns rate [N/s], F [N]. F is the largest friction until the block has slid by ten times the
    pre-sliding distance and is faster than twice the sum of the Stribeck velocity and the velocity
    of elastic motion, rate over stiffness. These scales are those of `law`; `given` determines only
    the mass, which is 0.8 kg or 1 kg per 1.5 N. For laws like LuGre the force decreases with the
    rate down to the kinetic level; laws that depend on the velocity or the path alone reach
    approximately the static level at any rate.

    Raises:
        ValueError: the law has neither static friction nor pre-sliding, or a rate is not positive.
    """
    if not all(rate > 0 for rate in rates):
        raise ValueError(f"break_away: rates: expected numbers above 0 N/s, got {tuple(rates)}")
    own = scales(law, N)
    mass = (given or own).mass
    levels = np.array([_peak(law, N, rate, own, mass) for rate in rates])
    columns = {"rate": np.array(rates, dtype=float), "F": levels}
    return f"break-away force, N = {N:g} N", [Curve(law_name(law), "", columns)]


def _peak(law: AnyLaw, N: float, rate: float, own: Scales, mass: float) -> float:
    """Return the largest friction force [N] until the block has broken away."""
    stretch = own.stretch if isfinite(own.stretch) else 0.0
    until, way = 2 * (own.velocity + rate * stretch / own.static), SLID * stretch
    t_end = 2 * own.static / rate + 4 * sqrt(2 * mass * until / rate) + 4 * cbrt(way * mass / rate)
    ramp = Linear([0.0, t_end], [0.0, rate * t_end])
    run = pushed(law, N, mass, ramp, t_end, until, way)
    return float(np.max(run.at(fine(run))["friction"]))
