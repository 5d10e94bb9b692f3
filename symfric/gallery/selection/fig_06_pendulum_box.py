"""The pendulum on the box, and what its table says.

The machine which is simulated, at its start and after the first half swing, and the way of the mass
between them. The hinge is 0.4 m above the ground; the width of the box is of the picture only.

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
from symfric.foundation.panels import NARROW, grid
from symfric.foundation.style import EDGE, QUIET, colour, line
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.selection import _machine as machine
from symfric.gallery.selection._laws import TABLE_8
from symfric.gallery.selection._runs_box import T_END, box, run
from symfric.gallery.signals import acceleration, spread

TOP, HALF = 0.4, 0.2
"""Height of the hinge and half the width of the box [m]."""


def plate(quick: bool = False) -> Plate:
    """The machine at its start, and S of both readings of its inertia."""
    t_end = 1.0 if quick else T_END
    table = run("Smooth", t_end)
    figure, [[axis]] = grid(1, 1, width=NARROW, height=3.4)
    swing = np.flatnonzero(np.diff(np.sign(table["phi_rate"][1:])))[0] + 1
    x, phi = table["x"][: swing + 1], table["phi"][: swing + 1]
    axis.plot(x + machine.L * np.sin(phi), TOP - machine.L * np.cos(phi), ":", color=QUIET)
    for k, at in enumerate((0, swing)):
        corners = x[at] + HALF * np.array([-1, 1, 1, -1, -1])
        axis.plot(corners, [0.0, 0.0, TOP, TOP, 0.0], **line(k), label=f"t = {table.t[at]:.2f} s")
        rod = ([0.0, machine.L * np.sin(phi[at])], [0.0, -machine.L * np.cos(phi[at])])
        axis.plot(x[at] + rod[0], TOP + np.array(rod[1]), "o-", color=colour(k), markersize=7)
    axis.axhline(0.0, color=EDGE, linewidth=2.5, zorder=0)
    axis.set_aspect("equal")
    axis.set_xlabel("x [m]")
    axis.set_ylabel("height [m]")
    figure.legend(loc="outside lower center", ncols=2, frameon=False)
    by_hand = machine.at_start()
    found = [float(acceleration(table, rate)[0]) for rate in ("x_rate", "phi_rate")]
    point = simulate(box(Coulomb(), J=1e-9).model(), t_end, t_eval=table.t)
    S, S_point = spread(table["x"]), spread(point["x"])
    claims = {"1.8 kg m^2 is m L^2": abs(machine.M * machine.L**2 - machine.J) < 1e-12}
    if not quick:
        claims |= {
            "S is 3.0 cm for a point mass": abs(S_point - 3.0) < 0.05,
            "and 5.8 cm with 1.8 kg m^2 about the mass": abs(S - 5.8) < 0.05,
        }
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
            "S x 100 in table 8, Smooth [m]": TABLE_8["Smooth"],
            "S x 100 with 1.8 kg m^2 about the mass [m]": S,
            "S x 100 with a point mass [m]": S_point,
        },
        claims,
    )
