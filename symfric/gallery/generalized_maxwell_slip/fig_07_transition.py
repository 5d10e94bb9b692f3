"""From pre-sliding to sliding and back: a sinusoidal velocity at 2 and 10 Hz.

v = 500 um/s sin(2 pi f t): the amplitude is read off the axes, which end at 500 um/s.

Compared: the force over the velocity in the second period with the equations written again by hand.

Distance: largest difference from them, over the force at break-away.

Reproduced: GMS and the generic model have their peak while the velocity rises, by 9 % or more,
LuGre and Leuven while it falls, by a quarter or more, as the paper says. The elasto-plastic law,
which the paper leaves out here, goes with LuGre. All of them stay within the 0.8 N at which the
axes of the paper end; Maxwell slip, which knows no velocity, does not.
"""

import numpy as np

from symfric.figures import Curve, transition
from symfric.gallery.generalized_maxwell_slip import _by_hand
from symfric.gallery.generalized_maxwell_slip._grid import law_grid
from symfric.gallery.generalized_maxwell_slip._laws import F_S, SIGNALS, laws
from symfric.gallery.plate import Plate, plate_of

FREQUENCIES = (2.0, 10.0)
PERIODS = 2


def plate(quick: bool = False) -> Plate:
    """Slide all laws with the velocity."""
    chosen = laws(count=100 if quick else 2000)
    runs = {
        name: transition(law, 1.0, SIGNALS, FREQUENCIES, PERIODS).curves
        for name, law in chosen.items()
    }
    loops = {name: {c.case: (1e6 * c["v"], c["F"]) for c in each} for name, each in runs.items()}
    figure = law_grid(chosen, loops, ("velocity [µm/s]", "friction force [N]"))

    steps = 1000 if quick else 10_000  # a period
    far = {
        f"difference from the equations by hand, {name} [N]": max(
            by_hand(name, c, f, steps) for c, f in zip(runs[name], FREQUENCIES, strict=True)
        )
        for name in (("GMS", "LuGre") if quick else _by_hand.LAWS)
    }
    numbers, ratios, tops = dict(far), dict[str, list[float]](), dict[str, float]()
    for name, each in runs.items():
        for c in each:
            up, down = peaks(c)
            case = f"{name}, {c.case}"
            numbers[f"peak in speeding up over that in slowing down, {case} [1]"] = up / down
            ratios.setdefault(name, []).append(up / down)
        numbers[f"greatest force, {name}, 0.8 where the paper's axes end [N]"] = tops[name] = max(
            float(np.abs(c["F"]).max()) for c in each
        )
    moving = [name for name in tops if name != "Maxwell slip"]
    claims = {
        "GMS and the generic model peak in speeding up": (
            min(*ratios["GMS"], *ratios["generic model"]) > 1.085
        ),
        "LuGre, Leuven and the elasto-plastic law in slowing down": (
            max(*ratios["LuGre"], *ratios["Leuven"], *ratios["elasto-plastic"]) < 0.75
        ),
        "within 0.8 N but for Maxwell slip": max(tops[n] for n in moving) < 0.81 < F_S,
    }
    worst, within = max(far.values()) / F_S, 4.5e-3 if quick else 7e-3
    return plate_of(__name__, figure, worst, "1", numbers, claims, within=within, quick=quick)


def peaks(curve: Curve) -> tuple[float, float]:
    """Largest force [N] at positive velocity while it rises, and while it falls."""
    v, F = curve["v"], curve["F"]
    top = int(np.argmax(v))
    half = slice(top, (v.size - 1) // 2)
    return float(F[:top].max()), float(F[half].max())


def by_hand(name: str, curve: Curve, frequency: float, steps: int) -> float:
    """Largest difference of a curve from the equations by hand [N]."""
    t = np.linspace(0.0, PERIODS / frequency, PERIODS * steps + 1)
    v = 500e-6 * np.sin(2 * np.pi * frequency * t)
    return _by_hand.difference(name, curve.columns, t, v)
