"""Angle of the pendulum, eleven laws.

Compared: the smooth Coulomb law with the same machine by equations written by hand; all laws with
exact dry friction, over 15 s and over the last two.

Distance: largest difference of the angle from that by hand over 15 s, smooth Coulomb law.

Evidence: that LuGre and Elasto-plastic err visibly at the end of the motion is confirmed. That this
is an error of theirs is refuted: Dahl errs by as much, Smooth and Threlfall by two thirds to three
quarters of it, and Karnopp by twice as much, from its band in the hinge (figure 7). The others let
the box creep, or roll on its bristles (figure 8), where dry friction holds it, which takes energy
from the pendulum. Bengisu and Gonthier are nearest. With the box held the period is that of a
pendulum on a fixed hinge, in closed form.
"""

from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.selection._laws import chosen
from symfric.gallery.selection._runs_box import (
    T_END,
    departures,
    distance,
    end_of_motion,
    picture,
)


def plate(quick: bool = False) -> Plate:
    """15 s from 30 degrees, tables 6 and 7."""
    names, t_end = chosen(quick), 2.5 if quick else T_END
    figure = picture("phi", "angle of the pendulum [rad]", names, t_end)
    numbers = departures("phi", "rad", names, t_end)
    claims = end_of_motion("phi", numbers, t_end)
    return plate_of(__name__, figure, distance("phi", t_end), "rad", numbers, claims)
