"""Velocities of the four masses.

Compared: both laws, each with the same machine in two coordinates, written by hand and solved by
SUNDIALS; and with each other, for two velocities of the peak.

Distance: largest difference of a velocity from that by hand over 4 s, both laws.

Evidence: that one law depends on its transition velocity and the other on nothing is refuted:
between peaks at 10 and at 1 mm/s the velocities change by 0.10 m/s with the self-tuning law, by
0.06 m/s with Brown-McPhee.
"""

from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.self_tuning._runs_four_mass import (
    LAWS,
    SLIDERS,
    V_T,
    apart,
    distance,
    picture,
    run,
)
from symfric.gallery.signals import largest


def plate(quick: bool = False) -> Plate:
    """4 s from the start of Haug's example."""
    t_end = 0.4 if quick else 4.0
    numbers = {f"laws apart, {slider} [m/s]": d for slider, d in apart("'", t_end).items()}
    change: dict[str, float] = {}
    for law in LAWS:
        wide, narrow = run(law, V_T, t_end), run(law, V_T / 10, t_end)
        changes = [largest(wide[f"{s}'"] - narrow[f"{s}'"]) for s in SLIDERS]
        numbers[f"largest change from 10 to 1 mm/s, {law} [m/s]"] = change[law] = max(changes)
    claims = {"the self-tuning law changes by more": change[LAWS[0]] > change[LAWS[1]]}
    if not quick:
        claims["the velocities change by 0.10 and 0.06 m/s"] = (
            0.095 < change[LAWS[0]] < 0.105 and 0.06 < change[LAWS[1]] < 0.07
        )
    figure = picture("'", "velocity [m/s]", t_end)
    return plate_of(__name__, figure, distance("'", t_end), "m/s", numbers, claims)
