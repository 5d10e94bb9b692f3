"""Frictional lag: a velocity that rises and falls without reversal, at 2, 5 and 10 Hz.

v = 250 um/s + 200 um/s sin(2 pi f t); the paper says a sine plus an offset, without numbers.

Compared: the force over the velocity in the third period with the equations written again by hand.

Distance: largest difference from them, over the force at break-away. For the elasto-plastic law it
is that of its step, a quintic here and a sine in the paper.

Reproduced: all laws with lag carry less while the velocity falls, and their loops grow with the
frequency, as the paper says.

Undecided: whether LuGre and Leuven are alike and GMS like the generic model. With the numbers of
table 1 and our elements Leuven has less than an eighteenth of the loop of LuGre, since its
hysteresis is that much stiffer than sigma_0, and LuGre is nearer to the generic model than GMS at 2
Hz, as near at 5 Hz, and farther away at 10 Hz; but elements, generic model and velocities are ours.
"""

import numpy as np

from symfric.figures import Curve, lag, phenomena
from symfric.gallery.generalized_maxwell_slip import _by_hand
from symfric.gallery.generalized_maxwell_slip._grid import law_grid
from symfric.gallery.generalized_maxwell_slip._laws import F_S, SIGNALS, laws
from symfric.gallery.plate import Plate, plate_of
from symfric.laws import AnyLaw, steady_force

FREQUENCIES = (2.0, 5.0, 10.0)
PERIODS = 3


def plate(quick: bool = False) -> Plate:
    """Slide all laws with the velocity."""
    chosen = laws(count=100 if quick else 2000)
    runs = {name: curves(law) for name, law in chosen.items()}
    loops = {name: {c.case: (1e6 * c["v"], c["F"]) for c in each} for name, each in runs.items()}
    figure = law_grid(chosen, loops, ("velocity [µm/s]", "friction force [N]"))

    written = ("GMS", "LuGre") if quick else _by_hand.LAWS
    lagging = [name for name in written if "L" in phenomena(chosen[name])]
    steps = 300 if quick else 3000  # a period
    far = {
        f"difference from the equations by hand, {name} [N]": max(
            by_hand(name, c, f, steps) for c, f in zip(runs[name], FREQUENCIES, strict=True)
        )
        for name in lagging
    }
    numbers, areas, off = dict(far), dict[str, list[float]](), dict[str, list[float]]()
    for name in ("generic model", *lagging):
        for c, same in zip(runs[name], runs["generic model"], strict=True):
            area = 1e6 * float(np.trapezoid(c["F"], c["v"]))  # positive: lower while v falls
            numbers[f"area of the loop, {name}, {c.case} [uN m/s]"] = area
            rms = float(np.sqrt(np.mean((c["F"] - same["F"]) ** 2)))
            numbers[f"rms difference from the generic model, {name}, {c.case} [N]"] = rms
            areas.setdefault(name, []).append(area)
            off.setdefault(name, []).append(rms)
    claims = {
        "all with lag carry less while the velocity falls, and more of it the faster it changes": (
            all(0 < a < b < c for a, b, c in areas.values())
        )
    }
    if not quick:
        claims["Leuven has less than an eighteenth of the loop of LuGre"] = all(
            18 * a < b for a, b in zip(areas["Leuven"], areas["LuGre"], strict=True)
        )
        nearer = np.array(off["LuGre"]) / np.array(off["GMS"])
        claims["LuGre is nearer to the generic model than GMS at 2 Hz, as near at 5, not at 10"] = (
            nearer[0] < 0.9 < nearer[1] < 1.1 < nearer[2]
        )
    worst, within = max(far.values()) / F_S, 1.1e-4 if quick else 0.0105
    return plate_of(__name__, figure, worst, "1", numbers, claims, within=within, quick=quick)


def curves(law: AnyLaw) -> tuple[Curve, ...]:
    """The last period at each frequency; a law without lag follows its steady force."""
    if "L" in phenomena(law):
        return lag(law, 1.0, SIGNALS, FREQUENCIES, PERIODS).curves[: len(FREQUENCIES)]
    v = 1e-6 * np.linspace(50.0, 450.0, 101)
    return (Curve("", "2 Hz", {"v": v, "F": steady_force(law, v, 1.0)}),)


def by_hand(name: str, curve: Curve, frequency: float, steps: int) -> float:
    """Largest difference of a curve from the equations by hand [N]."""
    t = np.linspace(0.0, PERIODS / frequency, PERIODS * steps + 1)
    v = 250e-6 + 200e-6 * np.sin(2 * np.pi * frequency * t)
    return _by_hand.difference(name, curve.columns, t, v)
