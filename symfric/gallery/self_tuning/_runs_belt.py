"""The belt of figures 3 and 4: both laws, and exact dry friction.

The paper's table of data is lost. Taken are the numbers of the LuGre paper (1 kg, 2 N/m, 0.1 m/s,
mu_s = 0.15, mu_d = 0.1 under 10 N) and, as the text has it without a unit, v_t = 15 mm/s.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from symfric import BrownMcPhee, Law, SelfTuning, Trajectory, simulate
from symfric.gallery.belt import Belt
from symfric.gallery.signals import rms
from symfric.scenes import Rabinowicz

Array = NDArray[np.float64]
V_T = 0.015
MU = {"mu_s": 0.15, "mu_d": 0.1}
LAWS = ("self-tuning, equal peak", "Brown-McPhee")
BLOCK = {"m": 1.0, "k": 2.0, "v_belt": 0.1, "g": 10.0}


@cache
def run(label: str, v_t: float, t_end: float) -> Trajectory:
    """One of LAWS on the belt."""
    tuned = SelfTuning.from_peak_velocity(v_t, **MU)
    return moved(tuned if label.startswith("self") else BrownMcPhee(v_t=v_t, **MU), t_end)


def moved(law: Law, t_end: float) -> Trajectory:
    """A law on the belt."""
    model = Rabinowicz(law, **BLOCK).model()
    return simulate(model, t_end, rtol=1e-8, t_eval=np.linspace(0, t_end, 6001))


def nearest(t_end: float) -> float:
    """The least rms difference of positions [m] from Brown-McPhee for B from 60 to 140 s/m."""
    brown = run("Brown-McPhee", V_T, t_end)["x"]
    laws = (SelfTuning(B=B, **MU) for B in (60.0, 80.0, 90.0, 95.0, 100.0, 110.0, 140.0))
    return min(rms(moved(law, t_end)["x"] - brown) for law in laws)


def acceleration(run: Trajectory) -> Array:
    """Of the block [m/s^2]."""
    return -(BLOCK["k"] * run["x"] + run["friction"]) / BLOCK["m"]


def period(run: Trajectory) -> float:
    """Time between the last two crests of the elongation [s]."""
    x = run["x"]
    crests = np.flatnonzero((x[1:-1] > x[:-2]) & (x[1:-1] >= x[2:])) + 1
    return float(np.diff(run.t[crests])[-1]) if crests.size > 1 else 0.0


def exact() -> Belt:
    """Exact dry friction with the same levels."""
    N = BLOCK["m"] * BLOCK["g"]
    return Belt(BLOCK["m"], BLOCK["k"], BLOCK["v_belt"], MU["mu_s"] * N, MU["mu_d"] * N)
