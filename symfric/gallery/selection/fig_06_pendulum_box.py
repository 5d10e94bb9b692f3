"""The pendulum on the box, and what its table says.

The machine which is simulated, at its start and after the first half swing, and the way of the mass
between them. The hinge is 0.4 m above the ground; the width of the box is of the picture only.

Compared: the accelerations at the start, where nothing rubs yet, with a linear system written by
hand; the two readings of table 6 with the standard deviations that table 8 prints.

Distance: largest relative difference of an acceleration from that by hand.

Refuted: that the tables describe the machine. They give a moment of the box, 0.1 kg m^2, and a
height h, which stand in no equation since the box does not turn, and no radius of the hinge, over
which its friction acts.

Undecided: whether the pendulum is a point mass, as its 1.8 kg m^2 = m L^2 suggests, or has 1.8 kg
m^2 about the mass. Table 8 has S = 5.9 cm with the smooth Coulomb law. Every ms it is 3.0 cm for
the point mass and 5.8 cm for the other; but table 8 does not say where it takes the positions. At
the steps of our solver the point mass has 4.7 ... 5.7 cm, the other 5.8 ... 6.2 cm, by tolerances
of 1e-5 to 1e-7. Figures 7 to 12 draw the second reading, and what they say of the paper holds for
both, with radii of 3 to 100 mm.
"""

import numpy as np

from symfric.foundation.panels import NARROW, grid
from symfric.foundation.style import EDGE, QUIET, colour, line
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.selection import _machine as machine
from symfric.gallery.selection._laws import TABLE_8
from symfric.gallery.selection._runs_box import T_END, run
from symfric.gallery.signals import acceleration, spread

TOP, HALF = 0.4, 0.2
"""Height of the hinge and half the width of the box [m]."""
READINGS = {"point mass": 1e-9, "1.8 kg m^2 about the mass": machine.J}


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
    S: dict[str, float] = {}
    at_steps: dict[str, list[float]] = {}
    for reading, J in READINGS.items():
        S[reading] = spread(run("Smooth", t_end, (J, machine.R))["x"])
        runs = [run("Smooth", t_end, (J, machine.R), rtol) for rtol in (1e-5, 1e-6, 1e-7)]
        at_steps[reading] = [spread(one.at(one.step_times)["x"]) for one in runs]
    numbers = {
        "acceleration of the box at the start [m/s^2]": found[0],
        "acceleration of the pendulum at the start [rad/s^2]": found[1],
        "the same by hand, box [m/s^2]": by_hand[0],
        "the same by hand, pendulum [rad/s^2]": by_hand[1],
        "m L^2 [kg m^2]": machine.M * machine.L**2,
        "S x 100 in table 8, Smooth [m]": TABLE_8["Smooth"],
    }
    for reading, steps in at_steps.items():
        numbers[f"S x 100 every ms, {reading} [m]"] = S[reading]
        numbers[f"S x 100 at the steps of the solver, {reading}, least [m]"] = min(steps)
        numbers[f"S x 100 at the steps of the solver, {reading}, greatest [m]"] = max(steps)
    claims = {"1.8 kg m^2 is m L^2": abs(machine.M * machine.L**2 - machine.J) < 1e-12}
    if not quick:
        point, about = S.values()
        steps, other = at_steps.values()
        claims |= {
            "every ms S is 3.0 cm for a point mass, 5.8 cm with 1.8 kg m^2 about the mass": (
                abs(point - 3.0) < 0.05 and abs(about - 5.8) < 0.05
            ),
            "at the steps of the solver the point mass comes within 5 % of table 8, too": (
                4.7 < min(steps) < max(steps) < 5.7 and max(steps) > 0.95 * TABLE_8["Smooth"]
            ),
            "and the other has 5.8 ... 6.2 cm": 5.8 < min(other) < max(other) < 6.2,
        }
    far = max(abs(a / b - 1) for a, b in zip(found, by_hand, strict=True))
    return plate_of(__name__, figure, far, "1", numbers, claims, within=1e-12, quick=quick)
