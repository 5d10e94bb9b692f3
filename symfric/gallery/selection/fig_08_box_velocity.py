"""Velocity of the box, eleven laws.

Compared: the smooth Coulomb law with the same machine by equations written by hand; all laws with
exact dry friction.

Distance: largest difference of the velocity from that by hand over 15 s, smooth Coulomb law.

Evidence: that the law has little influence on position and velocity of the box is confirmed, but
for Karnopp's band in the hinge (figure 7): root mean square 12 mm/s at most, of 0.6 m/s. The most
of it is left by bristles: Dahl, LuGre and Elasto-plastic, whose box rolls on them by 1 mm.
"""

from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.selection._laws import chosen
from symfric.gallery.selection._runs_box import EXACT, T_END, distance, last_swing, picture, signal
from symfric.gallery.signals import largest, rms


def plate(quick: bool = False) -> Plate:
    """15 s from 30 degrees, tables 6 and 7."""
    names, t_end = chosen(quick), 1.0 if quick else T_END
    figure = picture("x'", "velocity of the box [m/s]", names, t_end)
    exact = signal(EXACT, "x'", t_end)
    numbers = {"greatest velocity, exact dry friction [m/s]": largest(exact)}
    for name in names:
        one = signal(name, "x'", t_end)
        numbers[f"rms distance from exact dry friction, {name} [m/s]"] = rms(one - exact)
        if not quick:
            still = last_swing(name, "x'", t_end)
            numbers[f"swing in the last 2 s, {name} [m/s]"] = still
    return plate_of(__name__, figure, distance("x'", t_end), "m/s", numbers)
