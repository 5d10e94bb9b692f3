"""Break-away force against the loading rate."""

from collections.abc import Sequence
from math import cbrt, isfinite, sqrt

import numpy as np

from symfric.figures.data import Curve, FigureData
from symfric.figures.motion import fine, pushed
from symfric.figures.requirements import require
from symfric.figures.scales import NORMAL_FORCE, Scales, scales
from symfric.integrator import Linear
from symfric.laws import AnyLaw, law_name

SLID = 10.0
"""Pre-sliding distances after which bristles carry what they do in steady sliding."""


def break_away(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    rates: Sequence[float] = (0.1, 0.3, 1.0, 3.0, 10.0, 30.0),
) -> FigureData:
    """Greatest friction force of a block whose load grows at a constant rate.

    Columns rate [N/s], F [N]: the largest friction until the block, of 0.8 kg or 1 kg per 1.5 N,
    has slid by ten times the pre-sliding distance of its law and is faster than twice the sum of
    the Stribeck velocity and that of its elastic motion, rate over stiffness. Those are scales of
    the law itself; `given` ones are of the mass alone. The force falls with the rate for LuGre-like
    laws, to the kinetic level at least, and is the static level, or what of it they reach, for laws
    of the velocity or the path alone.

    Raises:
        ValueError: a law with neither static friction nor pre-sliding, a rate that is not positive.
    """
    require("break_away", law, "S", "P")
    if not all(rate > 0 for rate in rates):
        raise ValueError(f"break_away: rates: expected numbers above 0 N/s, got {tuple(rates)}")
    own = scales(law, N)
    mass = (given or own).mass
    levels = np.array([_peak(law, N, rate, own, mass) for rate in rates])
    return FigureData(
        "break_away",
        f"break-away force, N = {N:g} N",
        {"rate": "N/s", "F": "N"},
        (("rate", "F"),),
        (Curve(law_name(law), "", {"rate": np.array(rates, dtype=float), "F": levels}),),
        log=("rate",),
        dots=True,
    )


def _peak(law: AnyLaw, N: float, rate: float, own: Scales, mass: float) -> float:
    """The greatest friction force [N] until the block has broken away."""
    stretch = own.stretch if isfinite(own.stretch) else 0.0
    until, way = 2 * (own.velocity + rate * stretch / own.static), SLID * stretch
    t_end = 2 * own.static / rate + 4 * sqrt(2 * mass * until / rate) + 4 * cbrt(way * mass / rate)
    ramp = Linear([0.0, t_end], [0.0, rate * t_end])
    run = pushed(law, N, mass, ramp, t_end, until, way)
    return float(np.max(run.at(fine(run))["friction"]))
