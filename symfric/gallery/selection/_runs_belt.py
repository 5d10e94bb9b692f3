"""The block on the belt of figures 2 to 5: the laws with the numbers of tables 2 and 3."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from symfric import Trajectory, simulate
from symfric.gallery.belt import Belt
from symfric.gallery.selection._laws import FORMS
from symfric.scenes import Rabinowicz

Array = NDArray[np.float64]
T_END = 20.0
M, K, V_BELT, F_S, F_C = 0.8, 2.1, 0.1, 0.15 * 0.8 * 9.81, 0.1 * 0.8 * 9.81


@cache
def run(name: str, t_end: float = T_END, rtol: float = 1e-7) -> Trajectory:
    """A law on the belt, seen every ms."""
    model = Rabinowicz.preset("jing_mi_table_3", FORMS[name]).model()
    return simulate(model, t_end, rtol=rtol, t_eval=np.linspace(0, t_end, round(1000 * t_end) + 1))


@cache
def exact(t_end: float = T_END) -> tuple[Belt, dict[str, Array]]:
    """Exact dry friction in closed form: the belt, and its motion every ms."""
    belt = Belt(M, K, V_BELT, F_S, F_C)
    return belt, belt.motion(np.linspace(0, t_end, round(1000 * t_end) + 1))


def acceleration(one: Trajectory) -> Array:
    """Of the block [m/s^2]."""
    return -(K * one["x"] + one["friction"]) / M


def leaving(one: Trajectory) -> Array:
    """Instants [s] at which the block falls behind the belt by a tenth of its velocity."""
    v = one["v_rel"]
    falls = np.flatnonzero((v[:-1] >= -0.1 * V_BELT) & (v[1:] < -0.1 * V_BELT))
    return one.t[falls]
