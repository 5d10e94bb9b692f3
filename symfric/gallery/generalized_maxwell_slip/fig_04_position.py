"""The position signal of the pre-sliding test.

The paper gives a curve without numbers: up to 1.5 um in 8 s, with a loop inside a loop. We go
through eight turning points, at rest in each.

Compared: the position that the figure `hysteresis` integrates with the cosines in closed form.

Distance: largest difference.

Undecided: the speed of the signal, which matters in figure 5: 20 times faster ours is half the
Stribeck velocity of table 1.
"""

import numpy as np

from symfric.figures import hysteresis
from symfric.foundation.panels import NARROW, panels
from symfric.gallery.generalized_maxwell_slip._by_hand import stribeck
from symfric.gallery.generalized_maxwell_slip._laws import (
    DELTA,
    DELTA_L,
    F_C,
    F_S,
    PATH,
    SIGMA_0,
    SIGMA_1,
    V_S,
    Z_BA,
    C,
    laws,
)
from symfric.gallery.looks import look
from symfric.gallery.plate import Plate, plate_of

TABLE_1 = (1.05, 0.2, 98e-6, 0.78, 0.16e6, 0.08, 0.61e-6, 7.0, 24.0)
"""F_s, F_c, V_s, delta, sigma_0, sigma_1, z_ba, delta_l, C as printed, in SI."""


def plate(quick: bool = False) -> Plate:
    """Draw the path that a contact makes."""
    run = hysteresis(laws(count=1)["Dahl"], 1.0, speeds=(1.0,), route=PATH)
    t, x = run.curves[0]["t"], run.curves[0]["x"]

    figure, (axis,) = panels(1, NARROW, 2.4)
    axis.plot(t, 1e6 * x, **look("generic_asperity"))
    turns = np.linspace(0.0, t[-1], len(PATH))
    axis.plot(
        turns,
        1e6 * np.array(PATH),
        "o",
        color=look("leuven")["color"],
        label="turning points, at rest",
    )
    axis.set_xlabel("time [s]")
    axis.set_ylabel("position [µm]")
    axis.legend()

    leg = np.minimum((t / t[-1] * (len(PATH) - 1)).astype(int), len(PATH) - 2)
    share = (1 - np.cos(np.pi * (t / t[-1] * (len(PATH) - 1) - leg))) / 2
    begin, end = np.array(PATH[:-1])[leg], np.array(PATH[1:])[leg]
    far = np.abs(begin + (end - begin) * share - x).max()
    fastest = np.array([1.0, 5.0, 20.0]) * np.abs(run.curves[0]["v"]).max()
    numbers: dict[str, float] = {}
    for case, v, s in zip(("1x", "5x", "20x"), fastest, stribeck(fastest), strict=True):
        numbers[f"fastest, {case}, over V_s [1]"] = v / V_S
        numbers[f"Stribeck curve at the fastest, {case} [N]"] = s
    table = laws(count=1)
    given = [getattr(table["LuGre"], name) for name in ("mu_s", "mu_d", "v_s", "delta", "sigma_0")]
    given += [table["LuGre"].sigma_1, table["elasto-plastic"].z_ba, table["Leuven"].delta_l]  # pyright: ignore
    numbers_of = (F_S, F_C, V_S, DELTA, SIGMA_0, SIGMA_1, Z_BA, DELTA_L, C)
    claims = {
        "the laws have the numbers of table 1": [*map(float, given)] == [*TABLE_1[:-1]],
        "so have the equations by hand": numbers_of == TABLE_1,
        "20 times faster it is half of V_s": 0.45 < fastest[-1] / V_S < 0.5,
    }
    return plate_of(__name__, figure, far, "m", numbers, claims, within=3e-11, quick=quick)
