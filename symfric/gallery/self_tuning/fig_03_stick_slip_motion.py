"""Position, velocity and acceleration of the block on the belt.

Compared: the self-tuning law with Brown-McPhee at equal velocity of the peak, and both with exact
dry friction in closed form.

Distance: root mean square difference of the positions of both laws over 30 s.

Evidence: that both curves almost overlap is refuted for v_t = 15 mm/s with these data: the periods
differ by 3 %, and no B brings them nearer than 39 mm. They do so at 1 mm/s. That sudden drops of
the acceleration show stiction is refuted, too: both laws creep on the belt while they "stick".
Their common distance from exact dry friction is larger than that from each other.
"""

import numpy as np

from symfric.foundation.panels import panels
from symfric.foundation.style import line
from symfric.gallery.drawing import REFERENCE, legend_below
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.self_tuning._runs_belt import (
    LAWS,
    V_T,
    acceleration,
    exact,
    nearest,
    period,
    run,
)
from symfric.gallery.signals import rms


def plate(quick: bool = False) -> Plate:
    """30 s of stick-slip, some four periods."""
    t_end = 18.0 if quick else 30.0
    runs = {name: run(name, V_T, t_end) for name in LAWS}
    t = runs["Brown-McPhee"].t
    dry = exact()
    motion = dry.motion(t)

    figure, axes = panels(3, height=1.8)
    shown = (("x", "position [m]"), ("v_rel", "slip velocity\n[m/s]"))
    for axis, (signal, label) in zip(axes, shown, strict=False):
        axis.plot(t, motion[signal], label="exact dry friction", **REFERENCE)
        for k, (name, one) in enumerate(runs.items()):
            axis.plot(t, one[signal], label=name, **line(k))
        axis.set_ylabel(label)
    axes[2].plot(t, motion["a"], **REFERENCE)
    for k, one in enumerate(runs.values()):
        axes[2].plot(t, acceleration(one), **line(k))
    axes[2].set_ylabel("acceleration\n[m/s²]")
    axes[2].set_xlabel("time [s]")
    figure.align_ylabels(axes)
    legend_below(figure, axes[0])

    tuned, brown = runs.values()
    # halfway through a stick the spring pulls with mu_d N; what slips then is creep
    stop = next(s for s in dry.stops if s > 5.0)
    stick = stop + 0.5 * (dry.leaves[dry.stops.index(stop)] - stop)
    numbers = {
        "difference of velocities, rms [m/s]": rms(tuned["v"] - brown["v"]),
        "difference of accelerations, rms [m/s^2]": rms(acceleration(tuned) - acceleration(brown)),
        "Brown-McPhee from exact dry friction, rms [m]": rms(brown["x"] - motion["x"]),
        "self-tuning from exact dry friction, rms [m]": rms(tuned["x"] - motion["x"]),
        "period, exact dry friction [s]": float(np.diff(dry.leaves)[-1]),
        "creep of Brown-McPhee at mu_d N, in stick [m/s]": -float(brown.at(stick)["v_rel"][0]),
    } | {f"period, {name} [s]": period(one) for name, one in runs.items()}
    apart = rms(tuned["x"] - brown["x"])
    dry_off = [rms(one["x"] - motion["x"]) for one in runs.values()]
    claims = {
        "periods differ by 3 %": 0.025 < abs(period(brown) / period(tuned) - 1) < 0.035,
        "both creep on the belt": all(one.at(stick)["v_rel"][0] < -1e-3 for one in runs.values()),
        "both are farther from dry friction than from each other": min(dry_off) > apart,
    }
    if not quick:
        numbers["least difference of positions over all B, rms [m]"] = least = nearest(t_end)
        for v_t in (5e-3, 1e-3):
            one, other = (run(name, v_t, t_end)["x"] for name in LAWS)
            near = rms(one - other)
            numbers[f"difference of positions at {1e3 * v_t:g} mm/s, rms [m]"] = near
        claims["no B brings them nearer than 39 mm"] = 0.0385 < least < 0.0399
        claims["they overlap at 1 mm/s, within 7 mm"] = near < 0.007
    return plate_of(__name__, figure, apart, "m", numbers, claims)
