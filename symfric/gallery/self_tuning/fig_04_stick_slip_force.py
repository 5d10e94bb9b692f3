"""Friction force on the block.

Compared: the self-tuning law with Brown-McPhee at equal velocity of the peak, and both with exact
dry friction in closed form; over time, and over the slip velocity.

Distance: root mean square difference of the forces of both laws, relative to mu_s N.

Reproduced: both laws perform alike, as forces: over the slip velocity they lie within 10 % of mu_s
N, as in figure 1. Over time they differ by the instants of break-away.

Refuted: that a law of the velocity alone captures stiction. It does not jump to its static level at
rest: its force is that of the spring, with a creep that grows with it.

Undecided: the errors of both, since the paper's table of them is lost.
"""

import numpy as np

from symfric import Trajectory
from symfric.foundation.panels import grid
from symfric.foundation.style import line
from symfric.gallery.drawing import REFERENCE, legend_below
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.self_tuning._runs_belt import BLOCK, LAWS, MU, V_T, exact, run
from symfric.gallery.signals import largest, rms


def plate(quick: bool = False) -> Plate:
    """30 s of stick-slip, some four periods."""
    t_end = 18.0 if quick else 30.0
    runs = {name: run(name, V_T, t_end) for name in LAWS}
    t = runs["Brown-McPhee"].t
    dry = exact()
    motion = dry.motion(t)

    figure, [[over_time, over_slip]] = grid(1, 2, height=3.4, sharey=True, width_ratios=[3, 2])
    over_time.plot(t, -motion["friction"], label="exact dry friction", **REFERENCE)
    over_slip.plot(1e3 * motion["v_rel"], -motion["friction"], **REFERENCE)
    for k, (name, one) in enumerate(runs.items()):
        over_time.plot(t, -one["friction"], label=name, **line(k))
        over_slip.plot(1e3 * one["v_rel"], -one["friction"], **line(k))
    over_time.set_xlabel("time [s]")
    over_time.set_ylabel("friction on the block [N]")
    over_slip.set_xlabel("slip velocity [mm/s]")
    legend_below(figure, over_time)

    tuned, brown = (one["friction"] for one in runs.values())
    level = MU["mu_s"] * BLOCK["m"] * BLOCK["g"]
    numbers = {
        "greatest friction / mu_s N, exact dry friction [1]": -motion["friction"].min() / level,
        "first break-away, exact dry friction [s]": dry.leaves[0],
    }
    for name, one in runs.items():
        numbers[f"greatest friction / mu_s N, {name} [1]"] = -one["friction"].min() / level
        crest = t[one["friction"][t < 12.0].argmin()]
        numbers[f"first instant of the greatest friction, {name} [s]"] = float(crest)
    slips = np.linspace(-0.45, 0.0, 2001)
    one, other = (over(slips, run) for run in runs.values())
    numbers["largest difference at equal slip / mu_s N [1]"] = largest(one - other) / level
    claims = {
        "at equal slip the forces lie within 10 % of mu_s N": largest(one - other) < 0.1 * level,
        "the spring gives the force in stick, so that the greatest comes late": all(
            numbers[f"first instant of the greatest friction, {name} [s]"] > dry.leaves[0] + 0.1
            for name in runs
        ),
    }
    far, within = rms(tuned - brown) / level, 0.06 if quick else 0.085
    return plate_of(__name__, figure, far, "1", numbers, claims, within=within, quick=quick)


def over(slips: np.ndarray, run: Trajectory) -> np.ndarray:
    """Friction [N] of a law without states at slip velocities [m/s], from a run with it."""
    order = np.argsort(run["v_rel"])
    return np.interp(slips, run["v_rel"][order], run["friction"][order])
