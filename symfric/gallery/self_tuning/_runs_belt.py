"""The belt of figures 3 and 4: both laws, and exact dry friction.

The paper's table of data is lost. Taken are the numbers of the LuGre paper (1 kg, 2 N/m, 0.1 m/s,
mu_s = 0.15, mu_d = 0.1 under 10 N) and, as the text has it without a unit, v_t = 15 mm/s.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root_scalar

from symfric import BrownMcPhee, Law, SelfTuning, Trajectory, simulate
from symfric.gallery.belt import Belt
from symfric.gallery.signals import rms
from symfric.scenes import Rabinowicz

Array = NDArray[np.float64]
V_T = 0.015
MU = {"mu_s": 0.15, "mu_d": 0.1}
LAWS = ("self-tuning, equal peak", "Brown-McPhee")
BLOCK = {"m": 1.0, "k": 2.0, "v_belt": 0.1, "g": 10.0}


def law(label: str, v_t: float) -> Law:
    """One of LAWS with its peak at `v_t` [m/s]."""
    if label.startswith("self"):
        return SelfTuning.from_peak_velocity(v_t, **MU)
    return BrownMcPhee(v_t=v_t, **MU)


@cache
def run(label: str, v_t: float, t_end: float) -> Trajectory:
    """One of LAWS on the belt."""
    return moved(law(label, v_t), t_end)


def moved(law: Law, t_end: float) -> Trajectory:
    """A law on the belt."""
    model = Rabinowicz(law, **BLOCK).model()
    return simulate(model, t_end, rtol=1e-8, t_eval=np.linspace(0, t_end, 6001))


def nearest(t_end: float) -> float:
    """The least rms difference of positions [m] from Brown-McPhee for B from 30 to 300 s/m."""
    brown = run("Brown-McPhee", V_T, t_end)["x"]
    laws = (SelfTuning(B=B, **MU) for B in np.geomspace(30.0, 300.0, 40).tolist())
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


def creeps(one: Law) -> float:
    """The least sliding velocity at which a law without states is mu_d N [m/s]."""

    def above(v: float) -> float:
        return float(one.force(v, 1.0)) - MU["mu_d"]

    return float(root_scalar(above, bracket=[0.0, 0.9 * V_T]).root)


def creeping(one: Trajectory, v: float) -> bool:
    """Whether the block passes this creep with a force of mu_d N."""
    near = np.abs(one["v_rel"] + v) < 0.02 * v
    level = MU["mu_d"] * BLOCK["m"] * BLOCK["g"]
    return bool(near.any()) and np.allclose(-one["friction"][near], level, rtol=0.02)
