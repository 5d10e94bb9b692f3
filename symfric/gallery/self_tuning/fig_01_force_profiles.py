"""Friction force against slip velocity: self-tuning law and Brown-McPhee.

The force on the body under a constant load. The paper's range and load are lost; here are the
friction coefficients and the 15 mm/s of its stick-slip test.

Compared: the self-tuning law with Brown-McPhee, at equal velocity of the peak and at equal slope at
rest.

Distance: the largest difference at equal velocity of the peak, relative to the static level.

Reproduced: the law behaves like Brown-McPhee, within 10 % of mu_s N, if its peak is where that of
Brown-McPhee is. Its peak is mu_s N exactly, which Brown-McPhee never reaches; and it comes down to
mu_d N like 1/v, so that at ten times the velocity of the peak it is still 10 % above, Brown-McPhee
0.8 %.

Refuted: that the law needs no transition velocity. B is an inverse velocity: half of B at twice the
speed gives the same force, and the peak lies at tan(pi/2C)/B.
"""

import casadi as ca
import numpy as np

from symfric import BrownMcPhee, Law, SelfTuning
from symfric.foundation.panels import panels
from symfric.foundation.style import line
from symfric.gallery.drawing import legend_below
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.signals import largest

MU = {"mu_s": 0.15, "mu_d": 0.1}
V_T = 0.015  # m/s


def plate(quick: bool = False) -> Plate:
    """Both laws from -0.15 to 0.15 m/s."""
    v = np.linspace(-0.15, 0.15, 301 if quick else 6001)
    brown = BrownMcPhee(v_t=V_T, **MU)
    slope = 4 * MU["mu_d"] / V_T + 16 / 9 * (MU["mu_s"] - MU["mu_d"]) / V_T
    tuned = SelfTuning.from_peak_velocity(V_T, **MU)
    laws: dict[str, Law] = {
        "self-tuning, equal peak": tuned,
        "Brown-McPhee": brown,
        "self-tuning, equal slope": SelfTuning.from_slope(slope, 1.0, **MU),
    }
    forces = {name: on_curve(law, v) for name, law in laws.items()}

    figure, (above, below) = panels(2, height=2.4)
    for k, (name, F) in enumerate(forces.items()):
        above.plot(1e3 * v, -F, label=name, **line(k))
        below.plot(1e3 * v, -(F - forces["Brown-McPhee"]) / MU["mu_s"], **line(k))
    above.set_ylabel("friction on the body / N [1]")
    below.set_ylabel("difference from\nBrown-McPhee / $\\mu_s N$ [1]")
    below.set_xlabel("slip velocity [mm/s]")
    legend_below(figure, above)

    peak = forces["self-tuning, equal peak"]
    slower = SelfTuning(B=float(tuned.B) / 2, **MU)
    difference = {n: largest(F - forces["Brown-McPhee"]) / MU["mu_s"] for n, F in forces.items()}
    numbers = {
        "difference at equal slope / mu_s N [1]": difference["self-tuning, equal slope"],
        "peak of the self-tuning law / mu_s N [1]": peak.max() / MU["mu_s"],
        "peak of Brown-McPhee / mu_s N [1]": forces["Brown-McPhee"].max() / MU["mu_s"],
        "excess of Brown-McPhee over mu_d N at 10 v_t [1]": tail(brown),
        "excess of the self-tuning law over mu_d N at 10 v_t [1]": tail(tuned),
        "B at equal peak [s/mm]": 1e-3 * float(tuned.B),
        "change of F by half of B at twice the speed [1]": largest(on_curve(slower, 2 * v) - peak),
    }
    claims = {
        "half of B at twice the speed gives the same force": largest(on_curve(slower, 2 * v) - peak)
        < 1e-12,
        "the peak is mu_s N, that of Brown-McPhee below": (
            forces["Brown-McPhee"].max() < 0.9997 * MU["mu_s"] < 0.9999 * MU["mu_s"] < peak.max()
        ),
        "at ten times its velocity 10 % above mu_d N, Brown-McPhee 0.8 %": (
            abs(tail(tuned) - 0.10) < 0.005 and abs(tail(brown) - 0.008) < 5e-4
        ),
    }
    far = difference["self-tuning, equal peak"]
    return plate_of(__name__, figure, far, "1", numbers, claims, within=0.1, quick=quick)


def on_curve(law: Law, v: np.ndarray) -> np.ndarray:
    """F/N of a law without states at the velocities v [m/s]."""
    speed = ca.SX.sym("v")
    return ca.Function("F", [speed], [law.force(speed, 1.0)])(v[None]).full()[0]


def tail(law: Law) -> float:
    """How far the force at 10 v_t is above its limit, relative to it."""
    return float(on_curve(law, np.array([10 * V_T]))[0] / MU["mu_d"] - 1)
