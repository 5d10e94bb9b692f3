"""The drift test: break-away, and whether a vibration below it moves the block on.

The block of 1 kg is pushed with the force of figure 8; neither is given in the paper.

Compared: the way in one period of vibration that LuGre and Dahl make without end, with what their
equations give without inertia, where the force on the bristle is the applied one.

Distance: of the two, over the way.

Reproduced: LuGre and Dahl drift, GMS, Leuven, Maxwell slip and the generic model stay, the
elasto-plastic law stops after a while, as the paper says; and break-away falls with the rate of the
force, but for Maxwell slip and Dahl, of which the paper does not claim it, and never below F_c.

Undecided: how fast the block drifts. Nothing damps it on its spring with table 1, and while it
rings the drift of LuGre is more than three times that of the vibration alone.
"""

import numpy as np
from matplotlib.axes import Axes

from symfric.figures import break_away, push
from symfric.foundation.panels import WIDE, grid
from symfric.gallery.generalized_maxwell_slip import _drift as test
from symfric.gallery.generalized_maxwell_slip._by_hand import stribeck
from symfric.gallery.generalized_maxwell_slip._laws import F_C, SIGMA_0, SIGNALS, laws
from symfric.gallery.looks import look
from symfric.gallery.plate import Plate, plate_of
from symfric.laws import law_name

SHOWN, T_END = 8.0, 24.0  # s
RINGS = 501
"""Samples of 0.1 ms that the last panel averages over: ringing would hide the way."""
RATES = (0.3, 1.0, 3.0, 10.0, 30.0)  # N/s


def plate(quick: bool = False) -> Plate:
    """Push a block on all laws."""
    chosen = laws(count=1000)
    if quick:
        chosen = {name: chosen[name] for name in ("LuGre", "Dahl")}
    figure, ((away, rates, drift),) = grid(1, 3, WIDE, 3.6)
    numbers: dict[str, float] = {}
    for name, law in chosen.items():
        generic, mark = name == "generic model", look(law_name(law))
        t_end = SHOWN if generic else T_END
        run = push(
            law, 1.0, force=test.force, t_end=t_end, mass=test.MASS, samples=round(1e4 * t_end) + 1
        )
        t, x, F = (run.curves[0][column] for column in ("t", "x", "F"))
        first = t < 0.6
        away.plot(1e6 * x[first], F[first], **mark, label=name)
        later = (t >= test.SINCE) & (t <= SHOWN - 0.03)
        means = test.in_periods(t, x)
        slow = 1e6 * np.convolve(x, np.full(RINGS, 1 / RINGS), mode="same")
        drift.plot(t[later][::20], slow[later][::20] - slow[later][0], **mark)
        numbers[f"way in the first periods, {name} [m]"] = means[1] - means[0]
        numbers[f"way in the last periods, {name} [m]"] = means[-1] - means[-2]
        peaks = break_away(law, 1.0, SIGNALS, RATES[1:4:2] if quick else RATES).curves[0]
        rates.semilogx(peaks["rate"], peaks["F"], **mark, marker="o", markersize=3)
        numbers[f"least break-away, {name} [N]"] = float(peaks["F"].min())
        slowly, fast = np.interp((1.0, 10.0), peaks["rate"], peaks["F"])
        numbers[f"break-away at 1 N/s over that at 10 N/s, {name} [1]"] = slowly / fast
    away.set_xlim(-0.3, 8.5)
    drift.set_ylim(-0.3, 3.2)
    dress(away, rates, drift)
    figure.legend(loc="outside lower center", ncols=4, fontsize="small")

    alone = {
        "LuGre": test.drift_of(SIGMA_0, stribeck),
        "Dahl": test.drift_of(SIGMA_0, lambda v: F_C + 0 * v),
    }
    far = [abs(numbers[f"way in the last periods, {n} [m]"] / way - 1) for n, way in alone.items()]
    numbers |= {f"way in a period without inertia, {n} [m]": way for n, way in alone.items()}
    claims = test.said(numbers, [*chosen], quick)
    return plate_of(__name__, figure, max(far), "1", numbers, claims, within=5e-3, quick=quick)


def dress(away: Axes, rates: Axes, drift: Axes) -> None:
    """Say what the panels show."""
    away.set(xlabel="position [µm]", ylabel="friction force [N]", title="break-away")
    rates.set(xlabel="rate of the force [N/s]", ylabel="break-away force [N]", title="its rate")
    drift.set(xlabel="time [s]", ylabel="position from 4 s on [µm]", title="vibration")
    for axis in (away, rates, drift):
        axis.title.set_fontsize("medium")
