"""Angular acceleration of the pendulum, eleven laws.

Compared: the smooth Coulomb law with the same machine by equations written by hand; all laws with
exact dry friction, over 15 s and over the last two.

Distance: largest difference from that by hand over 15 s, smooth Coulomb law.

Evidence: that LuGre and Elasto-plastic err visibly at the end of the motion is confirmed. That this
is an error of theirs is refuted: Dahl errs by as much, Smooth and Threlfall by two thirds to three
quarters of it, and Karnopp by twice as much (figures 7 and 10). Bengisu and Gonthier are nearest.
With the box held dry friction leaves a pendulum on a fixed hinge, whose acceleration is its angle
times its frequency squared.
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
    figure = picture("phi''", "angular acceleration of the pendulum [rad/s²]", names, t_end)
    numbers = departures("phi''", "rad/s^2", names, t_end)
    claims = end_of_motion("phi''", numbers, t_end)
    return plate_of(__name__, figure, distance("phi''", t_end), "rad/s^2", numbers, claims)
