"""Four-mass system of figures 13 to 16: both laws, and the same machine computed in another way.

Haug's example has the numbers of the paper, 22 constraints and two degrees of freedom. Its data are
used, since the paper's table is lost. `LAWS` have their peaks at the same velocity.
"""

from functools import cache, partial

import numpy as np
from matplotlib.figure import Figure

from symfric.foundation.numeric import Array
from symfric.foundation.panels import grid, legend_below, panels
from symfric.foundation.style import QUIET, colour, line
from symfric.gallery.plate import Drawn, plate
from symfric.gallery.self_tuning import both_laws, machines
from symfric.gallery.self_tuning.both_laws import LAWS, TUNED, Both, Signals
from symfric.gallery.self_tuning.machines import fastest, fixed_steps
from symfric.gallery.shared import REFERENCE, largest
from symfric.scenes import FourMass

MU = {"mu_s": 0.12, "mu_d": 0.1}
V_T = 0.01
"""Velocity of the peak [m/s], of Haug's example."""
SLIDERS = ("x1", "y2", "z3", "x4")
B_RANGE = (0.1e3, 0.2e3, 0.3e3, 0.5e3, 0.7e3, 1e3)
"""Values of B [s/m] in the sweep of figure 8, whose range contains B for any function."""
PEAK = float(np.tan(np.pi / 2 / (2 - 2 / np.pi * np.arcsin(MU["mu_d"] / MU["mu_s"]))))
"""B times the velocity of the peak [1]."""
CONSTRAINTS = {
    "constraint_position": "m", "constraint_velocity": "m/s", "constraint_acceleration": "m/s^2",
}  # fmt: skip
"""Norms of the constraint violations of joints and rods, with their units."""
BOTH = Both(FourMass, machines.four_mass, MU, V_T, 1000, SLIDERS, ("energy", *CONSTRAINTS))
run, oracle = partial(both_laws.run, BOTH), partial(both_laws.oracle, BOTH)


@cache
def stepped(label: str, v_t: float, t_end: float, h: float = 1e-3) -> Signals:
    """Return the signals by fixed explicit steps of `h` [s]."""
    return fixed_steps(BOTH.machine(label, v_t), h, t_end)


def fastest_at(label: str, v_t: float, t_end: float, t: float) -> float:
    """Return the largest eigenvalue [1/s] of the machine by hand, at the time `t` of the run."""
    at = {name: values[round(1000 * t)] for name, values in run(label, v_t, t_end).items()}
    w = (at["x1"] * at["y2'"] - at["y2"] * at["x1'"]) / 25
    y = np.array([np.arctan2(at["y2"], at["x1"]), at["x4"], w, at["x4'"]])
    return fastest(BOTH.machine(label, v_t), y)


def variation(signal: Array) -> float:
    """Return the total variation, which jitter increases."""
    return float(np.abs(np.diff(signal)).sum())


def distance(ending: str, t_end: float) -> float:
    """Return the largest difference of a signal from the oracle, over all sliders and laws."""
    return BOTH.distance([slider + ending for slider in SLIDERS], t_end)


def apart(ending: str, t_end: float) -> dict[str, float]:
    """Return the largest difference between both laws for each slider."""
    return {slider: largest(BOTH.apart(slider + ending, t_end)) for slider in SLIDERS}


def picture(ending: str, label: str, t_end: float) -> Figure:
    """Return a picture with a panel per slider: both laws on the oracle, and their difference."""
    figure, axes = grid(3, 2, height=6.4, sharex=True)
    t = run("Brown-McPhee", V_T, t_end)["t"]
    for axis, pair in zip(axes[2], (("x1", "x4"), ("y2", "z3")), strict=True):
        for k, slider in enumerate(pair, start=2):
            axis.plot(t, BOTH.apart(slider + ending, t_end), **line(k), label=f"mass {slider[1]}")
        axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncols=2, frameon=False)
        axis.set_xlabel("time [s]")
    axes[2][0].set_ylabel(f"self-tuning minus\nBrown-McPhee {label[label.index('[') :]}")
    for axis, slider in zip((a for row in axes[:2] for a in row), SLIDERS, strict=True):
        reference = oracle("Brown-McPhee", V_T, t_end)[slider + ending]
        axis.plot(t, reference, label="Brown-McPhee, by hand", **REFERENCE)
        for k, one in enumerate(LAWS):
            axis.plot(t, run(one, V_T, t_end)[slider + ending], label=one, **line(k))
        axis.set_title(f"mass {slider[1]}, along {slider[0]}", fontsize="medium")
    for row in axes[:2]:
        row[0].set_ylabel(label)
    legend_below(figure, axes[0][0])
    return figure


SMALL, STABLE = 0.001, 2.785
"""Velocity of a peak [m/s], and largest stable |h L| of Runge-Kutta 4 for negative real L."""


@plate("1", within=(0.15, 0.03))
def fig_13_jitter(quick: bool) -> Drawn:
    """Acceleration of the first mass with Brown-McPhee at a small transition velocity.

    The self-tuning law has the reconstructed B, which grows with load and mu_s - mu_d in the range
    of figure 8, 0.1 ... 1 s/mm; its peak lies at 22 ... 2.2 mm/s. The text does not state the
    integration method of the paper.

    Compared: fixed explicit steps of 1 ms and steps with error control: Brown-McPhee with its peak
    at 1 mm/s, the self-tuning law with its own B, and the same law with its peak at 1 mm/s.

    Distance: largest relative difference of the total variation with error control from that of
    Brown-McPhee.

    Reproduced: in steps of 1 ms Brown-McPhee jitters, with more than five times the total variation
    of the smooth signal, and the self-tuning law does not: 1.1 times with its own B, at most 1.5
    times with any B of figure 8.

    Refuted: that the law causes the difference, and not its width. In steps of 1 ms the self-tuning
    law with its peak at 1 mm/s jitters as well, and Brown-McPhee with its peak at 10 mm/s does not.
    With error control neither jitters. With fixed steps h both jitter where h L exceeds 2.8, with
    the fastest eigenvalue L of the sticking machine: there the method becomes unstable. h L is 12
    and 15 for 1 ms and 1 mm/s; steps of 0.1 ms remove the jitter.

    Undecided: B itself, whose function is lost.
    """
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
    return figure, max(abs(one / smooth[LAWS[1]] - 1) for one in smooth.values()), numbers, claims


def jitter(
    rough: dict[str, float], smooth: dict[str, float], numbers: dict[str, float]
) -> dict[str, bool]:
    """Return claims on the laws and steps that jitter; add their numbers to `numbers`."""
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


@plate("m", within=1e-8)
def fig_14_four_mass_positions(quick: bool) -> Drawn:
    """Positions of the four masses.

    Compared: both laws, each with the same machine in two coordinates, written by hand and solved
    by SUNDIALS; and with each other.

    Distance: largest difference of a position from that by hand, both laws.

    Reproduced: the motions of the masses agree within 18 mm in a system of 7 m. Energy falls
    monotonically with both laws, as it must, and the joints are not violated, as the paper states:
    the norms of their constraints are those of rounding.

    Undecided: the data of the machine, which are Haug's here.
    """
    t_end = 0.4 if quick else 4.0
    numbers = {f"laws apart, {slider} [m]": d for slider, d in apart("", t_end).items()}
    for law in LAWS:
        energy = run(law, V_T, t_end)["energy"]
        numbers[f"energy lost, {law} [J]"] = float(energy[0] - energy[-1])
        numbers[f"largest rise of energy in 1 ms, {law} [J]"] = float(
            (energy[1:] - energy[:-1]).max()
        )
    for name, unit in CONSTRAINTS.items():
        worst = max(largest(run(law, V_T, t_end)[name]) for law in LAWS)
        numbers[f"largest {name} [{unit}]"] = worst
    rises = [value for name, value in numbers.items() if name.startswith("largest rise")]
    most = max(apart("", t_end).values())
    claims = {
        "energy falls monotonically": max(rises) < 0,
        "constraints hold": all(
            numbers[f"largest {n} [{u}]"] < 1e-7 for n, u in CONSTRAINTS.items()
        ),
        "laws are within 18 mm": most < 0.0185,
    }
    figure = picture("", "position [m]", t_end)
    return figure, distance("", t_end), numbers, claims


@plate("m/s", within=2e-8)
def fig_15_four_mass_velocities(quick: bool) -> Drawn:
    """Velocities of the four masses.

    Compared: both laws, each with the same machine in two coordinates, written by hand and solved
    by SUNDIALS; and with each other, for two velocities of the peak.

    Distance: largest difference of a velocity from that by hand, both laws.

    Reproduced: with Brown-McPhee the motion depends on its transition velocity: between peaks at 10
    and at 1 mm/s the velocities change by 0.06 m/s.

    Refuted: that the self-tuning law depends on no velocity. Its B is an inverse velocity (figure
    1): between the same peaks the velocities change by 0.10 m/s with it. A function of load and
    friction coefficients determines it instead of the user.

    Undecided: how far that function determines the motion, since it is lost; over the B of figure
    8, 0.1 ... 1 s/mm, the velocities change by 0.18 m/s.
    """
    t_end = 0.4 if quick else 4.0
    numbers = {f"laws apart, {slider} [m/s]": d for slider, d in apart("'", t_end).items()}
    change = {law: changed(law, V_T, V_T / 10, t_end) for law in LAWS}
    for law, most in change.items():
        numbers[f"largest change from 10 to 1 mm/s, {law} [m/s]"] = most
    swept = changed(LAWS[0], PEAK / B_RANGE[0], PEAK / B_RANGE[-1], t_end)
    numbers["largest change from B = 0.1 to 1 s/mm [m/s]"] = swept
    claims = {"the self-tuning law changes by more": change[LAWS[0]] > change[LAWS[1]]}
    if not quick:
        claims["the velocities change by 0.10 and 0.06 m/s"] = (
            0.095 < change[LAWS[0]] < 0.105 and 0.06 < change[LAWS[1]] < 0.07
        )
        claims["over the B of figure 8 by 0.18 m/s"] = 0.175 < swept < 0.185
    figure = picture("'", "velocity [m/s]", t_end)
    return figure, distance("'", t_end), numbers, claims


def changed(law: str, one: float, other: float, t_end: float) -> float:
    """Return the largest change [m/s] of a velocity between peaks at `one` and at `other` [m/s]."""
    wide, narrow = run(law, one, t_end), run(law, other, t_end)
    return max(largest(wide[f"{s}'"] - narrow[f"{s}'"]) for s in SLIDERS)


@plate("m/s^2", within=(4e-8, 4e-5))
def fig_16_four_mass_accelerations(quick: bool) -> Drawn:
    """Accelerations of the four masses.

    Compared: both laws, each with the same machine in two coordinates, written by hand and solved
    by SUNDIALS; and by their total variation, which jitter increases, for peaks from 20 to 1 mm/s.

    Distance: largest difference of an acceleration from that by hand, both laws.

    Reproduced: the self-tuning law gives smooth signals for any B from 0.1 to 1 s/mm, including its
    own B.

    Refuted: that Brown-McPhee itself causes jitter: with error control the total variation of both
    is the same within 3 %, and between peaks at 20 and 1 mm/s it changes by less than 5 %. Figure
    13 shows the cause of the jitter.
    """
    t_end = 0.4 if quick else 4.0
    numbers = {f"laws apart, {slider} [m/s^2]": d for slider, d in apart("''", t_end).items()}
    totals: dict[str, list[float]] = {law: [] for law in LAWS}
    for v_t in (0.01,) if quick else (0.02, 0.01, 0.005, 0.002, 0.001):
        for law in LAWS:
            total = variation(run(law, v_t, t_end)["x1''"])
            numbers[f"total variation of x1'', {law}, {1e3 * v_t:g} mm/s [m/s^2]"] = total
            totals[law].append(total)
    own = variation(run(TUNED, 0.01, t_end)["x1''"])
    numbers[f"total variation of x1'', {TUNED} [m/s^2]"] = own
    claims = {
        "the total variations of both laws are the same within 3 %": all(
            abs(one / other - 1) < 0.03 for one, other in zip(*totals.values(), strict=True)
        ),
        "each changes by less than 5 % with the velocity of the peak": all(
            max(each) / min(each) < 1.05 for each in totals.values()
        ),
    }
    if not quick:
        swept = [variation(run(LAWS[0], PEAK / B, t_end)["x1''"]) for B in B_RANGE]
        claims["so it is with every B of figure 8, and with its own"] = all(
            abs(total / totals[LAWS[1]][1] - 1) < 0.05 for total in (*swept, own)
        )
    figure = picture("''", "acceleration [m/s²]", t_end)
    return figure, distance("''", t_end), numbers, claims
