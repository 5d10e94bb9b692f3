"""Velocities of the four masses.

Compared: both laws, each with the same machine in two coordinates, written by hand and solved by
SUNDIALS; and with each other, for two velocities of the peak.

Distance: largest difference of a velocity from that by hand, both laws.

Reproduced: with Brown-McPhee the motion depends on its transition velocity: between peaks at 10 and
at 1 mm/s the velocities change by 0.06 m/s.

Refuted: that the self-tuning law depends on no velocity. Its B is one, inverse (figure 1): between
the same peaks the velocities change by 0.10 m/s with it. It is chosen by a function of load and
friction coefficients instead of by the user.

Undecided: how much that function leaves to choose, since it is lost; over the B of figure 8, 0.1
... 1 s/mm, the velocities change by 0.18 m/s.
"""

from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.self_tuning._runs_four_mass import (
    B_RANGE,
    LAWS,
    PEAK,
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
    change = {law: changed(law, V_T, V_T / 10, t_end) for law in LAWS}
    for law, most in change.items():
        numbers[f"largest change from 10 to 1 mm/s, {law} [m/s]"] = most
    swept = changed(LAWS[0], PEAK / B_RANGE[0], PEAK / B_RANGE[-1], t_end)
    numbers["largest change from B = 0.1 to 1 s/mm [m/s]"] = swept
    claims = {"the self-tuning law changes by more": change[LAWS[0]] > change[LAWS[1]]}
    if not quick:
        claims["the velocities change by 0.10 and 0.06 m/s"] = (
            0.095 < change[LAWS[0]] < 0.105 and 0.06 < change[LAWS[1]] < 0.07
        )
        claims["over the B of figure 8 by 0.18 m/s"] = 0.175 < swept < 0.185
    figure = picture("'", "velocity [m/s]", t_end)
    far = distance("'", t_end)
    return plate_of(__name__, figure, far, "m/s", numbers, claims, within=2e-8, quick=quick)


def changed(law: str, one: float, other: float, t_end: float) -> float:
    """Largest change of a velocity from a peak at `one` to a peak at `other` [m/s]."""
    wide, narrow = run(law, one, t_end), run(law, other, t_end)
    return max(largest(wide[f"{s}'"] - narrow[f"{s}'"]) for s in SLIDERS)
