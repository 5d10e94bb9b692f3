"""Hysteresis in pre-sliding: loops within loops at three speeds.

The path of figure 4 takes 8 s, and a fifth and a twentieth of that. The elements of GMS, Leuven and
Maxwell slip are fitted to the loops of the generic model, as in the paper.

Compared: the force along the path with the paper's equations written again by hand.

Distance: largest difference from them, over the force at break-away.

Reproduced: GMS, Maxwell slip and the generic model close their inner loop, LuGre and Dahl miss it
by 6 and 10 % of their force, as the paper says; Leuven, with the delta_l = 7 of table 1, misses it
by 2 %, and the elasto-plastic law is a spring on this path.

Refuted: that pre-sliding does not depend on the velocity, at 20 times the speed of our path, where
it runs at half of V_s. Whatever slips there follows s(v), and GMS breaks away a quarter lower,
Leuven a seventh; the generic model hardly does. That the alternative state equation of section 4,
dz/dt = v sgn(1 - F_h/s) |1 - F_h/s|^delta_l, is as good: with these elements it misses the inner
loop by 15 % or more, for exponents of 1, 2 and 7.
"""

import numpy as np

from symfric.figures import Curve, hysteresis
from symfric.gallery.generalized_maxwell_slip import _by_hand
from symfric.gallery.generalized_maxwell_slip._elements import alternative, elements_again
from symfric.gallery.generalized_maxwell_slip._grid import law_grid
from symfric.gallery.generalized_maxwell_slip._laws import ELEMENTS, F_S, PATH, laws
from symfric.gallery.plate import Plate, plate_of

SPEEDS = (1.0, 5.0, 20.0)
ORDER = ("generic model", "GMS", "Leuven", "Maxwell slip", "LuGre", "elasto-plastic", "Dahl")
"""The stiffness of the first four is that of the generic model, of the others sigma_0."""


def plate(quick: bool = False) -> Plate:
    """Slide all laws along the path."""
    made = laws(count=200 if quick else 2000)
    chosen = {name: made[name] for name in ORDER}
    runs = {n: hysteresis(law, 1.0, route=PATH, speeds=SPEEDS) for n, law in chosen.items()}
    loops = {
        name: {c.case: (1e6 * c["x"], c["F"]) for c in run.curves} for name, run in runs.items()
    }
    figure = law_grid(chosen, loops, ("position [µm]", "friction force [N]"), behind=[0])

    far = {
        f"difference from the equations by hand, {name} [N]": max(
            by_hand(name, c, 1_000 if quick else 20_000) for c in runs[name].curves
        )
        for name in (("GMS", "LuGre") if quick else _by_hand.LAWS)
    }
    numbers, opens, slower = dict(far), dict[str, float](), dict[str, float]()
    tops: dict[str, float] = {}
    for name, run in runs.items():
        once, _, fast = (at_turns(c) for c in run.curves)
        numbers[f"inner loop closes to, {name} [N]"] = abs(once[5] - once[3])
        numbers[f"20x against 1x at 1.5 um, {name} [N]"] = abs(fast[7] - once[7])
        tops[name] = abs(once[7])
        opens[name], slower[name] = abs(once[5] - once[3]) / tops[name], 1 - fast[7] / once[7]
    claims = {
        "GMS, Maxwell slip and the generic model close their loops": all(
            opens[name] < 1e-3 for name in ("GMS", "Maxwell slip", "generic model")
        ),
        "LuGre and Dahl miss by 6 and 10 %, Leuven by 2 %": np.allclose(
            [opens[name] for name in ("LuGre", "Dahl", "Leuven")], [0.06, 0.1, 0.02], rtol=0.35
        ),
        "20 times faster GMS is a quarter lower, Leuven a seventh": (
            0.2 < slower["GMS"] < 0.28 and 0.12 < slower["Leuven"] < 0.17
        ),
        "LuGre and the elasto-plastic law carry a fifth, with sigma_0 as printed": all(
            0.13 < tops[name] / tops["generic model"] < 0.27 for name in ("LuGre", "elasto-plastic")
        ),
    }
    claims |= alternative(numbers)
    if not quick:
        again = elements_again(runs["generic model"].curves[0])
        numbers |= again
        found = [again[f"k_{i + 1} [N/m]"] for i in range(len(ELEMENTS))]
        claims |= {
            "the generic model hardly depends on the speed": slower["generic model"] < 0.08,
            "its loops give the elements again": np.allclose(
                found, [k for k, _ in ELEMENTS], rtol=0.1
            ),
        }
    worst, within = max(far.values()) / F_S, 4e-3 if quick else 2e-3
    return plate_of(__name__, figure, worst, "1", numbers, claims, within=within, quick=quick)


def at_turns(curve: Curve) -> np.ndarray:
    """Force at the turning points [N]."""
    return curve["F"][:: (curve["F"].size - 1) // (len(PATH) - 1)]


def by_hand(name: str, curve: Curve, steps: int) -> float:
    """Largest difference of a curve from the equations by hand [N]."""
    end = float(curve["t"][-1])
    t = np.linspace(0.0, end, steps + 1)
    legs, phase = np.diff(PATH), t / end * (len(PATH) - 1)
    v = legs[np.minimum(phase.astype(int), legs.size - 1)] * np.sin(np.pi * (phase % 1))
    return _by_hand.difference(name, curve.columns, t, v * np.pi / 2 * legs.size / end)
