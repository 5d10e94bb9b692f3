"""The stiffness factor B as a function of load and brittleness.

The paper's function is lost. `BrittleSelfTuning` holds a candidate with the trends that the text
gives, in the range of figure 8, 0.1 ... 1 s/mm.

Compared: the candidate with what the text says: B grows with mu_s - mu_d, since brittle bristles
break faster, and with the normal force; it lies in the range of the sweep, and never is 0.

Distance: how many of these statements do not hold.

Refuted: that this removes the velocity that the user has to choose. The levels mu_s N and mu_d N
are the same whatever B is, so the function is a scale of velocity, with constants of its own.

Undecided: the function. The candidate has the trends by construction; any growing one would do.
"""

import numpy as np

from symfric import BrittleSelfTuning
from symfric.foundation.panels import grid
from symfric.gallery.drawing import shade
from symfric.gallery.plate import Plate, plate_of
from symfric.laws.static.self_tuning import brittleness

LOADS = (5.0, 10.0, 20.0, 50.0, 100.0, 200.0)  # N


def plate(quick: bool = False) -> Plate:
    """B and the force over mu_s - mu_d and over the slip velocity, for loads of 5 to 200 N."""
    difference = np.linspace(0.0, 0.1, 51 if quick else 501)
    v = np.linspace(0.0, 0.02, 51 if quick else 501)
    law = BrittleSelfTuning(mu_s=0.15, mu_d=0.1)
    stiffness = {N: 1e-3 * np.array([float(brittleness(N, d)) for d in difference]) for N in LOADS}

    figure, [[left, right]] = grid(1, 2, height=3.4)
    for k, N in enumerate(LOADS):
        left.plot(difference, stiffness[N], label=f"{N:g}", color=shade(k / 5))
        right.plot(1e3 * v, [float(law.force(one, N)) / N for one in v], color=shade(k / 5))
    left.set_xlabel("$\\mu_s - \\mu_d$ [1]")
    left.set_ylabel("stiffness factor B [s/mm]")
    right.set_xlabel("slip velocity [mm/s]")
    right.set_ylabel("friction force / N [1]")
    figure.legend(loc="outside right center", title="N [N]", frameon=False)

    table = np.array([*stiffness.values()])
    holds = {
        "grows with mu_s - mu_d": bool(np.all(np.diff(table, axis=1) > 0)),
        "grows with the normal force": bool(np.all(np.diff(table[:, 1:], axis=0) > 0)),
        "within 0.1 ... 1 s/mm": bool(np.all((table >= 0.1) & (table <= 1.0))),
    }
    wrong = len(holds) - sum(holds.values())
    numbers = {f"B at N = {N:g} N, mu_s - mu_d = 0.05 [s/mm]": at(N) for N in LOADS}
    peaks = [max(float(law.force(one, N)) / N for one in np.linspace(0, 0.1, 2001)) for N in LOADS]
    numbers["largest deviation of the peaks from mu_s N / mu_s N [1]"] = float(
        np.abs(np.array(peaks) / 0.15 - 1).max()
    )
    claims = {
        "none of the paper's statements is refuted": wrong == 0,
        "the level is mu_s N whatever B is": max(abs(p / 0.15 - 1) for p in peaks) < 1e-4,
    }
    unit = f"of {len(holds)} statements"
    return plate_of(__name__, figure, wrong, unit, numbers, claims, within=0, quick=quick)


def at(N: float) -> float:
    """B [s/mm] where mu_s - mu_d = 0.05."""
    return 1e-3 * float(brittleness(N, 0.05))
