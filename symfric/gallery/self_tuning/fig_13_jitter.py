"""Acceleration of the first mass with Brown-McPhee at a small transition velocity.

Compared: fixed explicit steps of 1 ms, with which the acceleration jitters, and steps with error
control, on Brown-McPhee and on the self-tuning law, both with their peak at 1 mm/s.

Distance: by how much the total variation with error control differs between both laws, relative.

Evidence: that the jitter belongs to Brown-McPhee's transition velocity, and the self-tuning law is
free of it, is refuted. With error control neither jitters. With fixed steps h both do wherever the
fastest eigenvalue L of the sticking machine makes h L exceed 2.8, where the method loses its
stability: it is 12 and 15 for 1 ms, and a tenth of that for steps of 0.1 ms, which remove the
jitter from both. It is a matter of the step, not of the law.
"""

from symfric.foundation.panels import panels
from symfric.foundation.style import QUIET, colour
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.self_tuning._runs_four_mass import (
    LAWS,
    fastest_at,
    run,
    stepped,
    variation,
)

SMALL = 0.001  # m/s
STABLE = 2.785
"""|h L| up to which Runge-Kutta 4 is stable on the negative real axis."""


def plate(quick: bool = False) -> Plate:
    """4 s of the four-mass system by three ways of stepping."""
    t_end = 0.4 if quick else 4.0
    figure, axes = panels(2, height=2.0)
    numbers: dict[str, float] = {}
    smooth: list[float] = []
    claims: dict[str, bool] = {}
    for k, (axis, law) in enumerate(zip(axes, LAWS, strict=True)):
        controlled, jittering = run(law, SMALL, t_end), stepped(law, SMALL, t_end)
        t, a, by_steps = controlled["t"], controlled["x1''"], jittering["x1''"]
        axis.plot(t, by_steps, color=QUIET, linewidth=0.7, label="steps of 1 ms, Runge-Kutta 4")
        axis.plot(t, a, color=colour(k), linewidth=1.3, label="with error control")
        axis.set_ylabel("acceleration of\nmass 1 [m/s²]")
        axis.set_ylim(-8.0, 8.0)
        axis.set_title(law, fontsize="medium", loc="left")
        axis.legend(loc="lower center", fontsize="small", ncols=2)
        smooth.append(variation(a))
        numbers[f"total variation with error control, {law} [m/s^2]"] = smooth[-1]
        numbers[f"total variation in steps of 1 ms, {law} [m/s^2]"] = variation(by_steps)
        slides = 1e-3 * fastest_at(law, SMALL, t_end, 0.3)
        numbers[f"h L in sliding, 1 ms, {law} [1]"] = slides
        claims[f"{law} is stable in sliding"] = slides < STABLE
        if not quick:
            sticks = 1e-3 * fastest_at(law, SMALL, t_end, 2.2)
            numbers[f"h L in stick at 2.2 s, 1 ms, {law} [1]"] = sticks
            fine = variation(stepped(law, SMALL, t_end, 1e-4)["x1''"][::10])
            numbers[f"total variation in steps of 0.1 ms, {law} [m/s^2]"] = fine
            claims |= {
                f"{law} jitters in steps of 1 ms": variation(by_steps) > 5 * smooth[-1],
                f"{law} does not in steps of 0.1 ms": abs(fine / smooth[-1] - 1) < 0.01,
                f"h L of {law} says so": sticks > STABLE > 0.1 * sticks,
            }
    axes[-1].set_xlim(0.4 * t_end, t_end)
    axes[-1].set_xlabel("time [s]")
    far = abs(smooth[0] / smooth[1] - 1)
    return plate_of(__name__, figure, far, "1", numbers, claims)
