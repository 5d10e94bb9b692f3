"""The pendulum on the box, and what its table says.

The picture is that of the machine which is simulated, at its start.

Compared: the accelerations at the start, where nothing rubs yet, with a linear system written by
hand; the two readings of table 6 with the standard deviations that table 8 prints.

Distance: largest relative difference of an acceleration from that by hand.

Evidence: that the pendulum is a point mass, as its 1.8 kg m^2 = m L^2 suggests, is refuted: with it
the position of the box has a standard deviation of 3.0 cm with the smooth Coulomb law, where table
8 has 5.9 cm. With 1.8 kg m^2 about the mass it is 5.8 cm. The box does not turn, so its 0.1 kg m^2
is in no equation, and the height h is in none either.
"""

import numpy as np

from symfric import Coulomb, simulate
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.selection import _machine as machine
from symfric.gallery.selection._laws import PRINTED
from symfric.gallery.selection._runs_belt import spread
from symfric.gallery.selection._runs_box import T_END, box, run
from symfric.gallery.signals import acceleration
from symfric.results.animation import picture


def plate(quick: bool = False) -> Plate:
    """The machine at its start, and S of both readings of its inertia."""
    t_end = 1.0 if quick else T_END
    table = run("Smooth", t_end)
    figure, show = picture(table, np.array([0.0]))
    show(0)
    by_hand = machine.at_start()
    found = [float(acceleration(table, rate)[0]) for rate in ("x_rate", "phi_rate")]
    point = simulate(box(Coulomb(), J=1e-9).model(), t_end, t_eval=table.t)
    return plate_of(
        __name__,
        figure,
        max(abs(a / b - 1) for a, b in zip(found, by_hand, strict=True)),
        "1",
        {
            "acceleration of the box at the start [m/s^2]": found[0],
            "acceleration of the pendulum at the start [rad/s^2]": found[1],
            "the same by hand, box [m/s^2]": by_hand[0],
            "the same by hand, pendulum [rad/s^2]": by_hand[1],
            "m L^2 [kg m^2]": machine.M * machine.L**2,
            "S x 100 in table 8, Smooth [m]": PRINTED["Smooth"][1],
            "S x 100 with 1.8 kg m^2 about the mass [m]": spread(table["x"]),
            "S x 100 with a point mass [m]": spread(point["x"]),
        },
    )
