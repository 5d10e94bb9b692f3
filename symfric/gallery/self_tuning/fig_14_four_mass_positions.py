"""Positions of the four masses.

Compared: both laws, each with the same machine in two coordinates, written by hand and solved by
SUNDIALS; and with each other.

Distance: largest difference of a position from that by hand over 4 s, both laws.

Evidence: nothing is refuted: both laws move the masses alike, within 18 mm in a system of 7 m.
Energy falls monotonically with both, as it must.
"""

from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.self_tuning._runs_four_mass import LAWS, V_T, apart, distance, picture, run


def plate(quick: bool = False) -> Plate:
    """4 s from the start of Haug's example."""
    t_end = 0.4 if quick else 4.0
    numbers = {f"laws apart, {slider} [m]": d for slider, d in apart("", t_end).items()}
    for law in LAWS:
        energy = run(law, V_T, t_end)["energy"]
        numbers[f"energy lost, {law} [J]"] = float(energy[0] - energy[-1])
        numbers[f"largest rise of energy in 1 ms, {law} [J]"] = float(
            (energy[1:] - energy[:-1]).max()
        )
    figure = picture("", "position [m]", t_end)
    return plate_of(__name__, figure, distance("", t_end), "m", numbers)
