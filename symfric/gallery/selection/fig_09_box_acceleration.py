"""Acceleration of the box, by the law.

Four laws are drawn in a smooth form and, dotted, as they were published.

Compared: the smooth Coulomb law with the same machine by equations written by hand; all laws with
exact dry friction.

Distance: largest difference of the acceleration from that by hand, smooth Coulomb law.

Reproduced: accelerations differ visibly, by 10 % of the greatest one or more, on all machines of
figure 7.

Refuted: that the states of a law make the difference. At every turn of the box friction jumps by
twice mu_d N, and laws jump there as they are made, for some ms: on every machine Velocity-based,
which has no state, is farther off than Gonthier, which has, and Stick-slip, which has states,
differs from dry friction as Velocity-based does within a quarter.
"""

from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.selection._laws import chosen, forms
from symfric.gallery.selection._runs_box import (
    EXACT,
    MACHINES,
    T_END,
    distance,
    off,
    picture,
    signal,
)
from symfric.gallery.signals import largest, rms


def plate(quick: bool = False) -> Plate:
    """15 s from 30 degrees, tables 6 and 7."""
    names, t_end = chosen(quick), 1.0 if quick else T_END
    figure = picture("x''", "acceleration of the box [m/s²]", names, t_end)
    greatest = largest(signal(EXACT, "x''", t_end))
    numbers = {"greatest acceleration, exact dry friction [m/s^2]": greatest}
    peaks: dict[str, float] = {}
    for name in forms(names):
        away = off(name, "x''", t_end)
        peaks[name] = largest(away)
        numbers[f"largest distance from exact dry friction, {name} [m/s^2]"] = peaks[name]
        numbers[f"rms distance from exact dry friction, {name} [m/s^2]"] = rms(away)
    claims = {"accelerations differ visibly": max(peaks.values()) > 0.1 * greatest}
    if not quick:
        apart = [
            {
                n: largest(off(n, "x''", T_END, at))
                for n in ("Velocity-based", "Stick-slip", "Gonthier")
            }
            for at in MACHINES
        ]
        parts = [
            max(one.values()) / largest(signal(EXACT, "x''", T_END, at))
            for one, at in zip(apart, MACHINES, strict=True)
        ]
        alike = [one["Stick-slip"] / one["Velocity-based"] for one in apart]
        numbers["largest distance over the greatest acceleration, least of all machines [1]"] = min(
            parts
        )
        numbers["Stick-slip over Velocity-based, least [1]"] = min(alike)
        numbers["Stick-slip over Velocity-based, greatest [1]"] = max(alike)
        claims |= {
            "and so on all machines": min(parts) > 0.1,
            "Velocity-based is farther off than Gonthier": all(
                one["Velocity-based"] > one["Gonthier"] for one in apart
            ),
            "and as far as Stick-slip within a quarter": 0.8 < min(alike) < max(alike) < 1.25,
        }
    far = distance("x''", t_end)
    return plate_of(__name__, figure, far, "m/s^2", numbers, claims, within=3e-6, quick=quick)
