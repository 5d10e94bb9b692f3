"""Acceleration of the box, eleven laws.

Compared: the smooth Coulomb law with the same machine by equations written by hand; all laws with
exact dry friction.

Distance: largest difference of the acceleration from that by hand over 15 s, smooth Coulomb law.

Evidence: that accelerations differ visibly is confirmed, but not as an effect of states: at every
turn of the box friction jumps by twice mu_d N, and laws jump there as they are made, for some ms.
The greatest differences are those of Velocity-based and of Stick-slip, one static and one dynamic,
which share their curve; root mean square they are those of Karnopp and of the bristle laws.
"""

from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.selection._laws import chosen
from symfric.gallery.selection._runs_box import EXACT, T_END, distance, picture, signal
from symfric.gallery.signals import largest, rms


def plate(quick: bool = False) -> Plate:
    """15 s from 30 degrees, tables 6 and 7."""
    names, t_end = chosen(quick), 1.0 if quick else T_END
    figure = picture("x''", "acceleration of the box [m/s²]", names, t_end)
    exact = signal(EXACT, "x''", t_end)
    numbers = {"greatest acceleration, exact dry friction [m/s^2]": largest(exact)}
    peaks, means = dict[str, float](), dict[str, float]()
    for name in names:
        off = signal(name, "x''", t_end) - exact
        peaks[name], means[name] = largest(off), rms(off)
        numbers[f"largest distance from exact dry friction, {name} [m/s^2]"] = peaks[name]
        numbers[f"rms distance from exact dry friction, {name} [m/s^2]"] = means[name]
    by_peak, by_mean = (sorted(one, key=lambda n, one=one: -one[n]) for one in (peaks, means))
    claims = {"accelerations differ visibly": max(peaks.values()) > 0.1 * largest(exact)}
    if not quick:
        claims |= {
            "most those of Velocity-based and Stick-slip": (
                {*by_peak[:2]} == {"Velocity-based", "Stick-slip"}
            ),
            "root mean square those of Karnopp and the bristles": (
                {*by_mean[:4]} == {"Karnopp", "Dahl", "LuGre", "Elasto-plastic"}
            ),
        }
    return plate_of(__name__, figure, distance("x''", t_end), "m/s^2", numbers, claims)
