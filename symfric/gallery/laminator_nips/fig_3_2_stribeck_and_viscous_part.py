"""Steady LuGre friction: the Stribeck part, the viscous part, and their sum.

The parameters of the figure are not given; these are those of the pilot study.

Compared: the force of the dynamic LuGre law after a while at a constant speed, simulated, with
equation 3.5.

Distance: largest difference over the speeds, over F_s.

Reproduced: the viscous part raises the level and is the linear tail.

Refuted: that friction keeps a stable value beyond a plateau, which the thesis sees from 6.5 mm/s
on. In its law the tail of the pilot study rises from there by a tenth, reaches F_s again, within
half a percent, at 500 mm/min, the end of the data, and is above it at the 650 mm/min of the
machine.
"""

import numpy as np

from symfric import LuGre, simulate
from symfric.foundation.panels import NARROW, panels
from symfric.foundation.style import line
from symfric.gallery.drawing import legend_below
from symfric.gallery.laminator_nips._studies import PRINTED, curve
from symfric.gallery.plate import Plate, plate_of
from symfric.scenes import Prescribed


def plate(quick: bool = False) -> Plate:
    """Draw the parts, and slide a LuGre contact at a few speeds."""
    law = PRINTED["pilot"]
    v = np.linspace(1e-6, 650 / 60e3, 400)
    viscous = float(law.sigma_2) * v
    figure, (axis,) = panels(1, NARROW, 2.8)
    total = curve(law, v)
    parts = {"Stribeck part": total - viscous, "viscous part": viscous, "sum": total}
    for k, (name, force) in enumerate(parts.items()):
        axis.plot(v, force, **line(k), label=name)

    speeds = np.array([30.0, 300.0] if quick else [10.0, 30.0, 60.0, 130.0, 300.0, 500.0]) / 60e3
    steady = np.array([after_a_while(speed) for speed in speeds.tolist()])
    axis.plot(speeds, steady, "o", color="k", label="dynamic LuGre law")
    axis.set_xlabel("velocity [m/s]")
    axis.set_ylabel("friction force [N]")
    legend_below(figure, axis, 2)

    far = float(np.abs(steady - curve(law, speeds)).max()) / float(law.F_S)
    plateau, end, machine = curve(law, np.array([6.5e-3, 500 / 60e3, 650 / 60e3])).tolist()
    numbers = {
        "static force F_s [N]": float(law.F_S),
        "force at 6.5 mm/s, where the thesis sees a plateau [N]": plateau,
        "force at 500 mm/min, the end of the data [N]": end,
        "force at 650 mm/min, the end of the machine's range [N]": machine,
    }
    static = float(law.F_S)
    claims = {
        "the tail reaches F_s at the end of the data": abs(end / static - 1) < 0.005,
        "and is above it at the end of the machine's range": machine > 1.1 * static,
        "it rises by a tenth from the plateau to the end of the data": end > 1.1 * plateau,
    }
    return plate_of(__name__, figure, far, "1", numbers, claims, within=2e-9, quick=quick)


def after_a_while(speed: float) -> float:
    """Force [N] of the dynamic law with the parameters of the pilot study, slid by 1 mm."""
    sled = Prescribed.preset("laminator_pilot", LuGre(sigma_0=1e5, sigma_1=30.0))
    run = simulate(sled.model(), 1e-3 / speed, u={"v": speed}, samples=2)
    return float(run["friction"][-1])
