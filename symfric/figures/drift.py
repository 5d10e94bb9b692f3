"""Drift: whether a vibrating force below break-away moves the block on."""

from math import isfinite

import casadi as ca
import numpy as np

from symfric.figures.data import Array, Curve, FigureData
from symfric.figures.motion import pushed
from symfric.figures.requirements import require
from symfric.figures.scales import NORMAL_FORCE, Scales, scales
from symfric.laws import AnyLaw, law_name

RELEASED, REST, HOLD = 1.05, 0.45, 0.5
"""End of the push; after it the time without load, at least, and that of the constant load [s]."""


def time_to_rest(law: AnyLaw, N: float, magnitudes: Scales) -> float:
    """Time without load [s] after which the block, pushed beyond break-away, has come to rest.

    `REST`, doubled until the block stays within its pre-sliding distance, or a thousandth of its
    way, in the last quarter; five times at most, since some laws only creep to a halt.
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


def drift(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    frequency: float = 10.0,
    t_end: float = 8.0,
) -> FigureData:
    """Displacement of a block under a vibrating force (Lampaert et al. 2003, figs. 8, 9).

        F_e = 1.05 F_S t           up to 1 s, held until 1.05 s: it breaks away
        F_e = 0                    up to 1.5 s, or longer where it takes longer to come to rest
        F_e = 0.5 F_b              for 0.5 s
        F_e = F_b [0.5 + 0.3 sin(2 pi f t)]   beyond: does it move on?

    F_S is the static level and F_b the kinetic one, or sigma_0 z_ba for `ElastoPlastic`, which
    claims no drift below that only. The block has 0.8 kg, or 1 kg per 1.5 N of F_S where that is
    more. Columns t [s], F_e, F [N], x [m], the way since the vibration began, which lasts until
    `t_end`, or longer by as much as the block needs longer to rest, and x_mean [m], the mean of x
    over two periods, which is drawn: it stays for a block that only shakes. A law without drift
    stays where the first strokes put it; LuGre goes on with every period, and a law without states
    creeps.

    Raises:
        ValueError: a law with neither static friction nor pre-sliding.
    """
    require("drift", law, "S", "P")
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

    last = t_end + 1 / frequency  # the mean around the end needs what follows
    run = pushed(law, N, magnitudes.mass, force, last)
    t = np.linspace(RELEASED, last, 1 + round(400 * (last - RELEASED)))
    found = run.at(t)
    rest = float(run.at(vibrate_from)["x"][0])
    columns = {"t": t, "F_e": found["force"], "x": found["x"] - rest, "F": found["friction"]}
    keep = (t >= vibrate_from - 0.2) & (t <= t_end + 1e-9)
    once = over_period(t, columns["x"], 1 / frequency)
    columns["x_mean"] = over_period(
        t, once, 1 / frequency
    )  # twice, or elastic ringing shines through
    return FigureData(
        "drift",
        f"drift under {frequency:g} Hz below break-away, mean over two periods, N = {N:g} N",
        {"t": "s", "F_e": "N", "x": "m", "F": "N", "x_mean": "m"},
        (("t", "x_mean"),),
        (Curve(law_name(law), "", {name: c[keep] for name, c in columns.items()}),),
    )


def over_period(t: Array, x: Array, period: float) -> Array:
    """Mean of `x` over the `period` [s] around each of the equally spaced times `t`, shape (n,).

    At the ends it is that of the first and last full period.
    """
    way = np.concatenate([[0.0], np.cumsum((x[1:] + x[:-1]) / 2 * np.diff(t))])
    middle = np.clip(t, t[0] + period / 2, t[-1] - period / 2)
    before, after = (np.interp(middle + side * period / 2, t, way) for side in (-1, 1))
    return np.asarray((after - before) / period)
