"""Friction force on the block, eleven laws.

Compared: the greatest force of each law with the static level mu_s N = 1.177 N that table 3 gives,
after the first stop on the belt; the force in slip with mu_d N = 0.785 N.

Distance: largest deviation of the greatest force from the static level, relative, over all laws
with a static level.

Evidence: that Coulomb, Threlfall and Dahl show dynamic friction alone, and alike, is confirmed.
That these data let one choose a law by its Stribeck effect, as table 5 does, is refuted: it falls
over 1 mm/s beside a belt of 100 mm/s, and all laws are at mu_d N to 0.1 % in slip. That laws with
states are the smooth ones is refuted as well: the undamped bristles of Dahl and Stick-slip ring.
"""

import numpy as np

from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.selection._laws import SLIDING, chosen, small_multiples
from symfric.gallery.selection._runs_belt import F_C, F_S, T_END, exact, run


def plate(quick: bool = False) -> Plate:
    """20 s from rest, tables 2 and 3."""
    names, t_end = chosen(quick), 14.0 if quick else T_END
    _, dry = exact(t_end)
    runs = {name: run(name, t_end) for name in names}

    t = runs[names[0]].t
    curves = {name: (one.t, one["friction"]) for name, one in runs.items()}
    figure = small_multiples(curves, (t, dry["friction"]), "friction force [N]", (-1.35, 0.15))

    after = t > 2.0
    numbers = {"static level [N]": F_S, "dynamic level [N]": F_C}
    off: list[float] = []
    for name, one in runs.items():
        greatest = float(np.abs(one["friction"][after]).max())
        numbers[f"greatest force, {name} [N]"] = greatest
        fast = one["v_rel"] < -0.05
        if (after & fast).any():
            slides = float(np.abs(one["friction"][after & fast]).mean())
            numbers[f"mean force in slip beyond 50 mm/s, {name} [N]"] = slides
        if name not in SLIDING:
            off.append(abs(greatest / F_S - 1))
    return plate_of(__name__, figure, max(off), "1", numbers)
