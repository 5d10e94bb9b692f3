"""Drift: whether a vibrating force below break-away moves the block on."""

import casadi as ca
import numpy as np

from symfric.figures.data import Curve, FigureData
from symfric.figures.motion import pushed
from symfric.figures.requirements import require
from symfric.figures.scales import NORMAL_FORCE, Scales, scales
from symfric.laws import AnyLaw, law_name

RELEASED, HOLD_FROM, VIBRATE_FROM = 1.05, 1.5, 2.0
"""End of the push, and start of the constant load and of the vibration [s]."""


def drift(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    frequency: float = 10.0,
    t_end: float = 8.0,
) -> FigureData:
    """Displacement of a block under a vibrating force (seed 3, figs. 8 and 9).

        F_e = 1.05 F_S t           up to 1 s, held until 1.05 s: it breaks away
        F_e = 0                    up to 1.5 s: it comes to rest
        F_e = 0.5 F_b              up to 2 s
        F_e = F_b [0.5 + 0.3 sin(2 pi f t)]   beyond: does it move on?

    F_S is the static level and F_b the kinetic one, or sigma_0 z_ba for `ElastoPlastic`, which
    claims no drift below that only. The block has 0.8 kg, or 1 kg per 1.5 N of F_S where that is
    more. Columns t [s], F_e, F [N] and x [m], the way since 2 s. A law without drift stays where
    the first strokes put it; LuGre goes on with every period, and a law without states creeps.

    Raises:
        ValueError: a law with neither static friction nor pre-sliding.
    """
    require("drift", law, "S", "P")
    magnitudes = given or scales(law, N)
    peak, base = 1.05 * magnitudes.static, magnitudes.elastic

    def force(t: ca.SX) -> ca.SX:
        shaken = base * (0.5 + 0.3 * ca.sin(2 * ca.pi * frequency * (t - VIBRATE_FROM)))
        held = ca.if_else(t < VIBRATE_FROM, 0.5 * base, shaken)
        loaded = ca.if_else(t < HOLD_FROM, 0.0, held)
        return ca.if_else(t < RELEASED, peak * ca.fmin(t, 1.0), loaded)

    run = pushed(law, N, magnitudes.mass, force, t_end)
    t = np.linspace(RELEASED, t_end, 2781)
    found = run.at(t)
    rest = float(run.at(VIBRATE_FROM)["x"][0])
    columns = {"t": t, "F_e": found["force"], "x": found["x"] - rest, "F": found["friction"]}
    keep = t >= VIBRATE_FROM - 0.2
    return FigureData(
        "drift",
        f"drift under {frequency:g} Hz below break-away, N = {N:g} N",
        {"t": "s", "F_e": "N", "x": "m", "F": "N"},
        (("t", "F_e"), ("t", "x")),
        (Curve(law_name(law), "", {name: c[keep] for name, c in columns.items()}),),
    )
