"""Acceleration of the block on the belt, by the law.

Four laws are drawn in a smooth form and, dotted, as they were published.

Compared: the greatest acceleration in slip with that of exact dry friction in closed form, k/m
times the amplitude; how fast the block stops on the belt.

Distance: largest deviation of the greatest acceleration while it slips, relative, over all laws
and forms with a static level.

Reproduced: laws with a static level stick and slip, visibly.

Refuted: that states make an acceleration accurate. The peaks where the block stops are of the laws,
not of the motion: exact dry friction jumps from 0.52 m/s^2 to rest. Laws that pass their static
level again in stopping, Stick-slip with states and Bengisu, Velocity-based and Awrejcewicz without,
peak at 1.3 ... 1.9 times that for some ms, in both forms; Karnopp without states and the other
bristle laws do not.
"""

import numpy as np

from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.selection._laws import SLIDING, chosen, forms, law_of, small_multiples
from symfric.gallery.selection._runs_belt import T_END, acceleration, exact, run

PEAKED = ("Bengisu", "Velocity-based", "Awrejcewicz", "Stick-slip")
"""Who passes the static level again in stopping."""


def plate(quick: bool = False) -> Plate:
    """20 s from rest, tables 2 and 3."""
    names, t_end = chosen(quick), 14.0 if quick else T_END
    _, dry = exact(t_end)
    runs = {name: run(name, t_end) for name in forms(names)}

    t = runs[names[0]].t
    curves = {name: (one.t, acceleration(one)) for name, one in runs.items()}
    figure = small_multiples(curves, (t, dry["a"]), "acceleration of the block [m/s²]", (-0.8, 1.6))

    after = t > 2.0
    slips = after & (dry["v_rel"] < -0.02)
    greatest = float(np.abs(dry["a"][slips]).max())
    numbers = {"greatest in slip, exact dry friction [m/s^2]": greatest}
    off: list[float] = []
    peaks: dict[str, float] = {}
    for name, one in runs.items():
        a, slips = acceleration(one), after & (one["v_rel"] < -0.02)
        numbers[f"greatest, {name} [m/s^2]"] = float(np.abs(a[after]).max())
        if law_of(name) not in SLIDING:
            own = float(np.abs(a[slips]).max())
            numbers[f"greatest in slip, {name} [m/s^2]"] = own
            off.append(abs(own / greatest - 1))
            peaks[name] = numbers[f"greatest, {name} [m/s^2]"] / greatest
    claims = {
        "the others do not peak": all(peaks[n] < 1.1 for n in peaks if law_of(n) not in PEAKED),
    }
    if not quick:
        claims[
            "Bengisu, Velocity-based, Awrejcewicz and Stick-slip peak at 1.3 ... 1.9 times it"
        ] = all(1.3 < peaks[name] < 1.95 for name in peaks if law_of(name) in PEAKED)
    return plate_of(
        __name__,
        figure,
        max(off),
        "1",
        numbers,
        claims,
        within=0.043 if quick else 0.049,
        quick=quick,
    )
