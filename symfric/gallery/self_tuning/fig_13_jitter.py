"""Acceleration of the first mass with Brown-McPhee at a small transition velocity.

The self-tuning law has the B that we reconstructed, which grows with load and mu_s - mu_d, in the
range of figure 8, 0.1 ... 1 s/mm; its peak lies at 22 ... 2.2 mm/s. The text does not say how the
paper stepped.

Compared: fixed explicit steps of 1 ms and steps with error control: Brown-McPhee with its peak at 1
mm/s, the self-tuning law with its own B, and the same law with its peak at 1 mm/s.

Distance: largest difference of the total variation with error control from that of Brown-McPhee,
relative.

Reproduced: in steps of 1 ms Brown-McPhee jitters, to more than five times the total variation of
the smooth signal, and the self-tuning law does not: 1.1 times with its own B, at most 1.5 times
with any B of figure 8.

Refuted: that the law makes the difference, and not its width. In steps of 1 ms the self-tuning law
with its peak at 1 mm/s jitters as well, and Brown-McPhee with its peak at 10 mm/s does not. With
error control neither jitters; with fixed steps h they do where the fastest eigenvalue L of the
sticking machine makes h L exceed 2.8, where the method loses its stability: it is 12 and 15 for 1
ms and 1 mm/s; steps of 0.1 ms remove the jitter.

Undecided: B itself, whose function is lost.
"""

import numpy as np

from symfric.foundation.panels import panels
from symfric.foundation.style import QUIET, colour
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.self_tuning._runs_four_mass import (
    B_RANGE,
    LAWS,
    PEAK,
    TUNED,
    V_T,
    fastest_at,
    run,
    stepped,
    variation,
)

SMALL, STABLE = 0.001, 2.785
"""Peak [m/s], and |h L| up to which Runge-Kutta 4 is stable on the negative real axis."""


def plate(quick: bool = False) -> Plate:
    """4 s of the four-mass system by three ways of stepping."""
    t_end = 0.4 if quick else 4.0
    figure, axes = panels(3, height=1.7)
    numbers, smooth, rough = dict[str, float](), dict[str, float](), dict[str, float]()
    shown = {LAWS[1]: "peak at 1 mm/s", TUNED: "", LAWS[0]: "peak at 1 mm/s"}
    for k, (axis, (law, width)) in enumerate(zip(axes, shown.items(), strict=True)):
        controlled, by_steps = run(law, SMALL, t_end), stepped(law, SMALL, t_end)["x1''"]
        axis.plot(controlled["t"], by_steps, color=QUIET, lw=0.7, label="steps of 1 ms, RK4")
        axis.plot(controlled["t"], controlled["x1''"], color=colour(k), label="with error control")
        axis.set_ylabel("acceleration of\nmass 1 [m/s²]")
        axis.set_ylim(-8.0, 8.0)
        axis.set_title(", ".join(filter(None, (law, width))), fontsize="medium", loc="left")
        axis.legend(loc="lower center", fontsize="small", ncols=2)
        smooth[law] = variation(controlled["x1''"])
        rough[law] = variation(by_steps) / smooth[law]
        numbers[f"total variation with error control, {law} [m/s^2]"] = smooth[law]
        numbers[f"total variation in steps of 1 ms over it, {law} [1]"] = rough[law]
    axes[-1].set_xlim(0.4 * t_end, t_end)
    axes[-1].set_xlabel("time [s]")
    claims = {"in steps of 1 ms the law with its own B does not jitter": rough[TUNED] < 1.1}
    if not quick:
        claims |= jitter(rough, smooth, numbers)
    far = max(abs(one / smooth[LAWS[1]] - 1) for one in smooth.values())
    within = 0.15 if quick else 0.03
    return plate_of(__name__, figure, far, "1", numbers, claims, within=within, quick=quick)


def jitter(
    rough: dict[str, float], smooth: dict[str, float], numbers: dict[str, float]
) -> dict[str, bool]:
    """Who jitters in which steps, and why."""
    any_B = [variation(stepped(LAWS[0], PEAK / B, 4.0)["x1''"]) for B in B_RANGE]
    numbers["the same, any B from 0.1 to 1 s/mm, at most [1]"] = most = max(any_B) / smooth[TUNED]
    wide = variation(stepped(LAWS[1], V_T, 4.0)["x1''"]) / smooth[LAWS[1]]
    numbers["the same, Brown-McPhee, peak at 10 mm/s [1]"] = wide
    claims = {
        "Brown-McPhee jitters to more than five times the smooth signal": rough[LAWS[1]] > 5,
        "any B of figure 8 to 1.5 times at most": most < 1.5,
        "the self-tuning law jitters with its peak at 1 mm/s": rough[LAWS[0]] > 5,
        "Brown-McPhee does not with its peak at 10 mm/s": wide < 1.1,
    }
    for law in LAWS:
        slides, sticks = (1e-3 * fastest_at(law, SMALL, 4.0, t) for t in (0.3, 2.2))
        numbers[f"h L in sliding, 1 ms, {law} [1]"] = slides
        numbers[f"h L in stick at 2.2 s, 1 ms, {law} [1]"] = sticks
        fine = variation(stepped(law, SMALL, 4.0, 1e-4)["x1''"][::10])
        numbers[f"total variation in steps of 0.1 ms, {law} [m/s^2]"] = fine
        claims[f"h L of {law} says so"] = slides < STABLE < sticks < 10 * STABLE
        claims[f"{law} does not jitter in steps of 0.1 ms"] = abs(fine / smooth[law] - 1) < 0.01
    sticks = [numbers[f"h L in stick at 2.2 s, 1 ms, {law} [1]"] for law in LAWS]
    claims["h L is 12 and 15"] = np.allclose(sorted(sticks), [12, 15], atol=0.6)
    return claims
