"""The slider-crank of figures 17 to 21: both laws, and the same machine by other means.

Haug's example has the counts of the paper, 11 constraints and one degree of freedom; its data are
taken, since the paper's table is lost: 120 rad/s at the start, friction in the crank's bearing,
both laws with their peak at 10 mm/s.
"""

from functools import cache

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from symfric import BrownMcPhee, SelfTuning, simulate
from symfric.foundation.panels import panels
from symfric.foundation.style import line
from symfric.gallery.drawing import REFERENCE, legend_below
from symfric.gallery.self_tuning._machines import brown_mcphee, self_tuning, slider_crank
from symfric.gallery.self_tuning._oracle import solve
from symfric.gallery.signals import acceleration, largest
from symfric.scenes import SliderCrank

Array = NDArray[np.float64]
MU = {"mu_s": 0.1, "mu_d": 0.08}
V_T = 0.01  # m/s
LAWS = {
    "self-tuning": SelfTuning.from_peak_velocity(V_T, **MU),
    "Brown-McPhee": BrownMcPhee(v_t=V_T, **MU),
}
MACHINES = {
    "self-tuning": slider_crank(self_tuning(**MU, v_t=V_T)),
    "Brown-McPhee": slider_crank(brown_mcphee(**MU, v_t=V_T)),
}


@cache
def run(law: str, t_end: float) -> dict[str, Array]:
    """Time, crank [rad], slider [m], rates and accelerations, energy [J], constraints' norm."""
    model = SliderCrank(LAWS[law]).model()
    times = np.linspace(0.0, t_end, round(4000 * t_end) + 1)
    found = simulate(model, t_end, rtol=1e-8, t_eval=times)
    signals = {"t": times, "energy": found["energy"], "constraint": found["constraint_position"]}
    for name in ("crank", "slider"):
        signals[name], signals[f"{name}'"] = found[name], found[f"{name}_rate"]
        signals[f"{name}''"] = acceleration(found, f"{name}_rate")
    return signals


@cache
def oracle(law: str, t_end: float) -> dict[str, Array]:
    """The same in the crank's angle, by equations written by hand and SUNDIALS."""
    return solve(MACHINES[law], run(law, t_end)["t"])


def distance(signal: str, t_end: float) -> float:
    """Largest difference of a signal from the oracle, both laws."""
    return max(largest(run(law, t_end)[signal] - oracle(law, t_end)[signal]) for law in LAWS)


def apart(signal: str, t_end: float) -> Array:
    """Difference of a signal between both laws over time."""
    return run("self-tuning", t_end)[signal] - run("Brown-McPhee", t_end)[signal]


def picture(signal: str, label: str, t_end: float, prefix: str = "") -> Figure:
    """Both laws on the oracle, and below how far they are apart, its unit with `prefix`."""
    scale = {"": 1.0, "m": 1e3, "µ": 1e6}[prefix]
    figure, (above, below) = panels(2, height=2.0)
    t, unit = run("Brown-McPhee", t_end)["t"], label[label.index("[") :]
    reference = oracle("Brown-McPhee", t_end)[signal]
    above.plot(t, reference, label="Brown-McPhee, by hand", **REFERENCE)
    for k, law in enumerate(LAWS):
        above.plot(t, run(law, t_end)[signal], label=law, **line(k))
    below.plot(t, scale * apart(signal, t_end), **line(0))
    above.set_ylabel(label)
    below.set_ylabel(f"self-tuning minus\nBrown-McPhee [{prefix}{unit[1:]}")
    below.set_xlabel("time [s]")
    figure.align_ylabels([above, below])
    legend_below(figure, above)
    return figure
