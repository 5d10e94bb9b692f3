"""Friction force of the belt on the block, by the law.

Four laws are drawn in a smooth form and, dotted, as they were published.

Compared: the greatest force of each law with the static level mu_s N = 1.177 N that table 3 gives,
after the first stop on the belt; the force in slip with mu_d N = 0.785 N.

Distance: largest deviation of the greatest force from the static level, relative, over all laws
and forms with a static level.

Reproduced: Coulomb, Threlfall and Dahl show dynamic friction alone, and alike: mu_d N to 0.1 %, and
0.95 mu_d N for Threlfall as published, which never reaches its level.

Refuted: that these data let one choose a law by its Stribeck effect, as table 5 does: it falls over
1 mm/s beside a belt of 100 mm/s, and in slip all laws and forms but that one are at mu_d N to 0.1
%. That laws with states are the smooth ones: the undamped bristles of Dahl and Stick-slip ring.
"""

import numpy as np

from symfric import Trajectory
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.selection._laws import SLIDING, chosen, forms, law_of, small_multiples
from symfric.gallery.selection._runs_belt import F_C, F_S, T_END, exact, run

LEVEL = {"Threlfall, original": 0.95}
"""Share of mu_d N at which a law slides, where it is not all of it."""


def plate(quick: bool = False) -> Plate:
    """20 s from rest, tables 2 and 3."""
    names, t_end = chosen(quick), 14.0 if quick else T_END
    _, dry = exact(t_end)
    runs = {name: run(name, t_end) for name in forms(names)}

    t = runs[names[0]].t
    curves = {name: (one.t, -one["friction"]) for name, one in runs.items()}
    label, reference = "friction on the block [N]", (t, -dry["friction"])
    figure = small_multiples(curves, reference, label, (-0.15, 1.35))

    after = t > 2.0
    numbers = {"static level [N]": F_S, "dynamic level [N]": F_C}
    off: list[float] = []
    rings, slips = dict[str, float](), dict[str, float]()
    for name, one in runs.items():
        greatest = float(np.abs(one["friction"][after]).max())
        numbers[f"greatest force, {name} [N]"] = greatest
        fast = one["v_rel"] < -0.05
        if (after & fast).any():
            slides = float(np.abs(one["friction"][after & fast]).mean())
            numbers[f"mean force in slip beyond 50 mm/s, {name} [N]"] = slides
            slips[name] = slides / LEVEL.get(name, 1.0) / F_C
        rings[name] = numbers[f"ringing in the first stick, {name} [N]"] = ringing(one)
        if law_of(name) not in SLIDING:
            off.append(abs(greatest / F_S - 1))
    claims = {
        "in slip all are at mu_d N, Threlfall as published at 0.95 of it, to 0.1 %": np.allclose(
            [*slips.values()], 1, atol=1e-3
        ),
        "Coulomb, Threlfall and Dahl show that level alone": all(
            abs(numbers[f"greatest force, {name} [N]"] / F_C - LEVEL.get(name, 1.0)) < 1.1e-3
            for name in runs
            if law_of(name) in SLIDING
        ),
        "Dahl and Stick-slip ring, the others do not": all(
            (ring > 1.0) == (law_of(name) in ("Dahl", "Stick-slip")) for name, ring in rings.items()
        ),
    }
    return plate_of(__name__, figure, max(off), "1", numbers, claims, within=0.017, quick=quick)


def ringing(one: Trajectory) -> float:
    """Total variation of the force between 0.3 and 3 s, beyond its fall with the spring [N]."""
    force = one["friction"][(one.t > 0.3) & (one.t < 3.0)]
    return float(np.abs(np.diff(force)).sum() - abs(force[-1] - force[0]))
