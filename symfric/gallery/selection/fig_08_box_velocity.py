"""Velocity of the box, eleven laws.

Compared: the smooth Coulomb law with the same machine by equations written by hand; all laws with
exact dry friction.

Distance: largest difference of the velocity from that by hand over 15 s, smooth Coulomb law.

Evidence: that the law has little influence on position and velocity of the box is confirmed, but
for Karnopp's band in the hinge (figure 7): root mean square 12 mm/s at most, of 0.6 m/s. The most
of it is left by bristles: with Dahl, LuGre and Elasto-plastic the box still rolls on them at the
end, by a quarter of a millimetre to either side, where dry friction holds it.
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
    off, rolls = dict[str, float](), dict[str, float]()
    for name in names:
        off[name] = rms(signal(name, "x'", t_end) - exact)
        rolls[name] = last_swing(name, "x", t_end)
        numbers[f"rms distance from exact dry friction, {name} [m/s]"] = off[name]
        if not quick:
            numbers[f"swing in the last 2 s, {name} [m/s]"] = last_swing(name, "x'", t_end)
            numbers[f"swing of the place in the last 2 s, {name} [m]"] = rolls[name]
    off.pop("Karnopp")
    claims = {"all but Karnopp are within 12 mm/s": max(off.values()) < 0.0125}
    if not quick:
        bristly = ("Dahl", "LuGre", "Elasto-plastic")
        claims |= {
            "Dahl, LuGre and Elasto-plastic are the farthest of them": (
                {*sorted(off, key=lambda name: off[name])[-3:]} == {*bristly}
            ),
            "their boxes roll by a quarter of a millimetre": all(
                2e-4 < rolls[name] < 8e-4 for name in bristly
            ),
        }
    return plate_of(__name__, figure, distance("x'", t_end), "m/s", numbers, claims)
