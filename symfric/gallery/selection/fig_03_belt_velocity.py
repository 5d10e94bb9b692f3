"""Velocity of the block relative to the belt, by the law.

Four laws are drawn in a smooth form and, dotted, as they were published.

Compared: the period from one break-away to the next with that of exact dry friction in closed form,
for the laws with a static level; the greatest slip.

Distance: largest deviation of a period, over all laws and forms with a static level.

Reproduced: the differences of the motions grow with time, since the periods differ: by 4 % among
the laws with a static level, through the widths of their laws and forms.

Refuted: that the kind of law matters little on a slide, as the conclusions have it. The three laws
without a static level never stick, in either form, and swing with the period of the free block, 3.9
s instead of 6.1 s.
"""

import numpy as np

from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.selection._laws import SLIDING, chosen, forms, law_of, small_multiples
from symfric.gallery.selection._runs_belt import T_END, K, M, exact, leaving, run


def plate(quick: bool = False) -> Plate:
    """20 s from rest, tables 2 and 3."""
    names, t_end = chosen(quick), 14.0 if quick else T_END
    belt, dry = exact(t_end)
    runs = {name: run(name, t_end) for name in forms(names)}

    t = runs[names[0]].t
    curves = {name: (one.t, one["v_rel"]) for name, one in runs.items()}
    figure = small_multiples(curves, (t, dry["v_rel"]), "velocity relative to the belt [m/s]")

    period = float(np.diff(belt.leaves)[0])
    numbers = {
        "period, exact dry friction [s]": period,
        "period of the free block [s]": 2 * np.pi * np.sqrt(M / K),
        "greatest slip, exact dry friction [m/s]": -float(dry["v_rel"].min()),
    }
    off: list[float] = []
    periods: dict[str, float] = {}
    for name, one in runs.items():
        leaves = leaving(one)
        numbers[f"greatest slip, {name} [m/s]"] = -float(one["v_rel"].min())
        numbers[f"break-aways, {name} [1]"] = leaves.size
        periods[name] = numbers[f"period, {name} [s]"] = float(np.diff(leaves)[0])
        if law_of(name) not in SLIDING:
            off.append(abs(periods[name] - period))
    held = [p for name, p in periods.items() if law_of(name) not in SLIDING]
    free = np.array([p for p in periods.values() if p not in held])
    free /= numbers["period of the free block [s]"]
    claims = {
        "without a static level: the period of the free block": np.allclose(free, 1, atol=0.01),
        "with one: that of stick and slip, within 3 %": np.allclose(held, period, rtol=0.03),
    }
    if not quick:
        claims["they differ by 4 %"] = 0.035 < (max(held) - min(held)) / period < 0.045
    return plate_of(
        __name__,
        figure,
        max(off),
        "s",
        numbers,
        claims,
        within=0.16 if quick else 0.18,
        quick=quick,
    )
