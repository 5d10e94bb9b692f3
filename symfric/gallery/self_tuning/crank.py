"""Slider-crank of figures 17 to 21: both laws, and the same machine computed in another way.

Haug's example has the numbers of the paper, 11 constraints and one degree of freedom. Its data are
used, since the paper's table is lost: 120 rad/s at the start, friction in the bearing of the crank,
both laws with their peak at 10 mm/s.
"""

import numpy as np

from symfric import BrownMcPhee
from symfric.foundation.numeric import Array
from symfric.foundation.panels import legend_below, panels
from symfric.foundation.style import line
from symfric.gallery.plate import Drawn, plate
from symfric.gallery.self_tuning import both_laws, machines
from symfric.gallery.self_tuning.both_laws import LAWS, Both
from symfric.gallery.shared import REFERENCE, largest
from symfric.scenes import SliderCrank

MU = {"mu_s": 0.1, "mu_d": 0.08}
V_T = 0.01  # m/s
MORE = ("energy", "constraint_position")
BOTH = Both(SliderCrank, machines.slider_crank, MU, V_T, 4000, ("crank", "slider"), MORE)
apart = BOTH.apart


def run(law: str, t_end: float) -> dict[str, Array]:
    """Return the signals with a law."""
    return both_laws.run(BOTH, law, V_T, t_end)


def drawn(
    signal: str, unit: str, t_end: float, numbers: dict[str, float], claims: dict[str, bool]
) -> Drawn:
    """Draw both laws on the oracle, and their difference below.

    Compared: both laws, each with the same machine in the angle of the crank, written by hand and
    solved by SUNDIALS; and with each other.

    Distance: largest difference from that by hand, both laws.
    """
    order, small = signal.count("'"), {"m": "µ", "m/s": "m", "rad/s": "m"}.get(unit, "")
    what = signal.rstrip("'") + (" position", " velocity", " acceleration")[order]
    figure, (above, below) = panels(2, height=2.0)
    t, unit = run("Brown-McPhee", t_end)["t"], unit.replace("^2", "²")
    reference = both_laws.oracle(BOTH, "Brown-McPhee", V_T, t_end)[signal]
    above.plot(t, reference, label="Brown-McPhee, by hand", **REFERENCE)
    for k, law in enumerate(LAWS):
        above.plot(t, run(law, t_end)[signal], label=law, **line(k))
    below.plot(t, {"": 1.0, "m": 1e3, "µ": 1e6}[small] * apart(signal, t_end), **line(0))
    above.set_ylabel(f"{what}\n[{unit}]")
    below.set(xlabel="time [s]", ylabel=f"self-tuning minus\nBrown-McPhee [{small}{unit}]")
    figure.align_ylabels([above, below])
    legend_below(figure, above)
    return figure, BOTH.distance([signal], t_end), numbers, claims


@plate("rad/s^2", within=(6e-6, 1.5e-4), like=drawn)
def fig_17_crank_acceleration(quick: bool) -> Drawn:
    """Acceleration of the crank.

    Reproduced: the profiles are smooth and overlap within 0.2 % of the greatest acceleration, and
    the joints are not violated. There is no jitter here for the reason given in figure 13: the
    bearing slides at 8 m/s and more, eight hundred times the velocity of the peak, where both laws
    are flat.

    Undecided: the data of the machine, which are Haug's here.
    """
    t_end = 0.05 if quick else 0.25
    numbers = {"laws apart [rad/s^2]": largest(apart("crank''", t_end))}
    slowest = min(float(run(law, t_end)["crank'"].min()) for law in LAWS)
    numbers["slowest slip in the bearing / velocity of the peak [1]"] = 0.1 * slowest / V_T
    numbers["largest norm of the constraints [m]"] = max(
        largest(run(law, t_end)["constraint_position"]) for law in LAWS
    )
    greatest = largest(run("Brown-McPhee", t_end)["crank''"])
    numbers["greatest acceleration [rad/s^2]"] = greatest
    claims = {
        "the bearing slides at 800 times the velocity of the peak": 0.1 * slowest > 800 * V_T,
        "the laws overlap within 0.2 %": largest(apart("crank''", t_end)) < 2e-3 * greatest,
        "constraints hold": numbers["largest norm of the constraints [m]"] < 1e-7,
    }
    return drawn("crank''", "rad/s^2", t_end, numbers, claims)


@plate("m/s^2", within=(4e-6, 1e-4), like=drawn)
def fig_18_slider_acceleration(quick: bool) -> Drawn:
    """Acceleration of the slider.

    Reproduced: both laws overlap within 0.2 % of the greatest acceleration, as the text states.
    """
    t_end = 0.05 if quick else 0.25
    numbers = {"laws apart [m/s^2]": largest(apart("slider''", t_end))}
    numbers["largest acceleration [m/s^2]"] = largest(run("Brown-McPhee", t_end)["slider''"])
    apart_by, greatest = numbers.values()
    claims = {"the laws overlap within 0.2 %": apart_by < 2e-3 * greatest}
    return drawn("slider''", "m/s^2", t_end, numbers, claims)


@plate("m/s", within=(4e-8, 1.5e-6), like=drawn)
def fig_19_slider_velocity(quick: bool) -> Drawn:
    """Velocity of the slider.

    Reproduced: both laws overlap and drift apart after some time, as the text states: the
    difference grows over the run.

    Undecided: the instant at which they drift apart, which is lost.
    """
    t_end = 0.05 if quick else 0.25
    numbers = {"laws apart [m/s]": largest(apart("slider'", t_end))}
    differences = apart("slider'", t_end)
    half = differences.size // 2
    numbers["laws apart in the first half [m/s]"] = largest(differences[:half])
    numbers["laws apart in the second half [m/s]"] = largest(differences[half:])
    _, early, late = numbers.values()
    claims = {"they drift apart": late > 2 * early}
    return drawn("slider'", "m/s", t_end, numbers, claims)


@plate("rad/s", within=(3e-7, 4e-6), like=drawn)
def fig_20_crank_velocity(quick: bool) -> Drawn:
    """Velocity of the crank.

    Reproduced: both laws overlap. In sliding both are mu_d N except for their tails, so they
    overlap for any velocity of the peak; this machine does not show the transition to rest.
    """
    t_end = 0.05 if quick else 0.25
    numbers = {"laws apart [rad/s]": largest(apart("crank'", t_end))}
    for law in LAWS:
        one = run(law, t_end)
        numbers[f"velocity at the end, {law} [rad/s]"] = float(one["crank'"][-1])
        numbers[f"energy lost, {law} [J]"] = float(one["energy"][0] - one["energy"][-1])
    lost = [value for name, value in numbers.items() if name.startswith("energy")]
    bearing = SliderCrank.presets["haug"].friction["law"]
    claims = {
        "the bearing has the data of Haug's example": (
            {**bearing.common, **bearing.laws[BrownMcPhee]} == {**MU, "v_t": V_T}
        ),
        "the laws overlap within 0.02 %": largest(apart("crank'", t_end)) < 2e-4 * 120,
        "they take the same energy within 0.1 %": abs(lost[0] / lost[1] - 1) < 1e-3,
    }
    return drawn("crank'", "rad/s", t_end, numbers, claims)


@plate("m", within=(4e-10, 1.2e-8), like=drawn)
def fig_21_slider_position(quick: bool) -> Drawn:
    """Position of the slider.

    Reproduced: both laws overlap. The position is a weak check: it follows from the angle of the
    crank and the lengths alone, and no law can move it out of its stroke.
    """
    t_end = 0.05 if quick else 0.25
    numbers = {"laws apart [m]": largest(apart("slider", t_end))}
    one = run("Brown-McPhee", t_end)
    y, z = 0.1 - 0.08 * np.sin(one["crank"]), 0.1 + 0.08 * np.cos(one["crank"])
    x = np.sqrt(0.3**2 - y**2 - z**2)
    numbers["largest violation of the closed form by the angle [m]"] = largest(one["slider"] - x)
    numbers["stroke [m]"] = float(np.ptp(one["slider"]))
    claims = {
        "the position follows from the angle by the lengths": largest(one["slider"] - x) < 1e-12,
        "the laws overlap within 0.1 % of the stroke": (
            numbers["laws apart [m]"] < 1e-3 * numbers["stroke [m]"]
        ),
    }
    return drawn("slider", "m", t_end, numbers, claims)
