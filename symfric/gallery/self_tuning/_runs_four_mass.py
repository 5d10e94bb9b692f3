"""The four-mass system of figures 13 to 16: both laws, and the same machine by other means.

Haug's example has the counts of the paper, 22 constraints and two degrees of freedom; its data are
taken, since the paper's table is lost. `TUNED` is the law as the paper has it, whose B follows from
load and mu_s - mu_d, by the function that we reconstructed; `LAWS` have their peak at one velocity.
"""

from functools import cache

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from symfric import BrittleSelfTuning, BrownMcPhee, Law, SelfTuning, simulate
from symfric.foundation.panels import grid
from symfric.foundation.style import line
from symfric.gallery.drawing import REFERENCE, legend_below
from symfric.gallery.self_tuning import _machines as machines
from symfric.gallery.self_tuning._oracle import fastest, fixed_steps, solve
from symfric.gallery.signals import acceleration, largest
from symfric.scenes import FourMass

Array = NDArray[np.float64]
Signals = dict[str, Array]
MU = {"mu_s": 0.12, "mu_d": 0.1}
V_T = 0.01
"""Velocity of the peak [m/s], of Haug's example."""
SLIDERS = ("x1", "y2", "z3", "x4")
LAWS = ("self-tuning", "Brown-McPhee")
TUNED = "self-tuning, own B"
B_RANGE = (0.1e3, 0.2e3, 0.3e3, 0.5e3, 0.7e3, 1e3)
"""Of the sweep of figure 8, in which B [s/m] lies whatever its function is."""
PEAK = float(np.tan(np.pi / 2 / (2 - 2 / np.pi * np.arcsin(MU["mu_d"] / MU["mu_s"]))))
"""B times the velocity of the peak [1]."""
CONSTRAINTS = {
    "constraint_position": "m", "constraint_velocity": "m/s", "constraint_acceleration": "m/s^2",
}  # fmt: skip
"""Norms of what joints and rods violate, with their units."""
COEFFICIENTS = {
    "self-tuning": machines.self_tuning,
    "Brown-McPhee": machines.brown_mcphee,
    TUNED: machines.own_stiffness,
}


def law(label: str, v_t: float) -> Law:
    """One of LAWS with its peak at `v_t` [m/s], or `TUNED`, which has its own."""
    if label == TUNED:
        return BrittleSelfTuning(**MU)
    if label == "self-tuning":
        return SelfTuning.from_peak_velocity(v_t, **MU)
    return BrownMcPhee(v_t=v_t, **MU)


@cache
def run(label: str, v_t: float, t_end: float) -> Signals:
    """Time, positions x1, rates x1' and accelerations x1'' of the sliders with one of LAWS."""
    model = FourMass(law(label, v_t)).model()
    times = np.linspace(0.0, t_end, round(1000 * t_end) + 1)
    found = simulate(model, t_end, rtol=1e-8, t_eval=times)
    signals: Signals = {"t": times, "energy": found["energy"]}
    signals |= {name: found[name] for name in CONSTRAINTS}
    for slider in SLIDERS:
        signals[slider], signals[f"{slider}'"] = found[slider], found[f"{slider}_rate"]
        signals[f"{slider}''"] = acceleration(found, f"{slider}_rate")
    return signals


@cache
def oracle(label: str, v_t: float, t_end: float) -> Signals:
    """The same by equations in two coordinates, written by hand, and SUNDIALS."""
    machine = machines.four_mass(COEFFICIENTS[label](**MU, v_t=v_t))
    return solve(machine, run(label, v_t, t_end)["t"])


@cache
def stepped(label: str, v_t: float, t_end: float, h: float = 1e-3) -> Signals:
    """The same by fixed explicit steps of `h` [s]."""
    return fixed_steps(machines.four_mass(COEFFICIENTS[label](**MU, v_t=v_t)), h, t_end)


def fastest_at(label: str, v_t: float, t_end: float, t: float) -> float:
    """Largest eigenvalue of the machine by hand where the run is at time `t` [1/s]."""
    at = {name: values[round(1000 * t)] for name, values in run(label, v_t, t_end).items()}
    w = (at["x1"] * at["y2'"] - at["y2"] * at["x1'"]) / 25
    y = np.array([np.arctan2(at["y2"], at["x1"]), at["x4"], w, at["x4'"]])
    return fastest(machines.four_mass(COEFFICIENTS[label](**MU, v_t=v_t)), y)


def variation(signal: Array) -> float:
    """Total variation: what jitter adds to."""
    return float(np.abs(np.diff(signal)).sum())


def distance(ending: str, t_end: float) -> float:
    """Largest difference of a signal of all sliders from the oracle, over both laws."""
    names = [slider + ending for slider in SLIDERS]
    return max(
        largest(run(one, V_T, t_end)[n] - oracle(one, V_T, t_end)[n]) for one in LAWS for n in names
    )


def apart(ending: str, t_end: float) -> dict[str, float]:
    """Largest difference between both laws by slider."""
    first, other = (run(one, V_T, t_end) for one in LAWS)
    return {slider: largest(first[slider + ending] - other[slider + ending]) for slider in SLIDERS}


def picture(ending: str, label: str, t_end: float) -> Figure:
    """A panel per slider, both laws on the oracle; below how far the laws are apart."""
    figure, axes = grid(3, 2, height=6.4, sharex=True)
    first, other = (run(one, V_T, t_end) for one in LAWS)
    for axis, pair in zip(axes[2], (("x1", "x4"), ("y2", "z3")), strict=True):
        for k, slider in enumerate(pair, start=2):
            apart_by = first[slider + ending] - other[slider + ending]
            axis.plot(first["t"], apart_by, **line(k), label=f"mass {slider[1]}")
        axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncols=2, frameon=False)
        axis.set_xlabel("time [s]")
    axes[2][0].set_ylabel(f"self-tuning minus\nBrown-McPhee {label[label.index('[') :]}")
    for axis, slider in zip((a for row in axes[:2] for a in row), SLIDERS, strict=True):
        t = run("Brown-McPhee", V_T, t_end)["t"]
        reference = oracle("Brown-McPhee", V_T, t_end)[slider + ending]
        axis.plot(t, reference, label="Brown-McPhee, by hand", **REFERENCE)
        for k, one in enumerate(LAWS):
            axis.plot(t, run(one, V_T, t_end)[slider + ending], label=one, **line(k))
        axis.set_title(f"mass {slider[1]}, along {slider[0]}", fontsize="medium")
    for row in axes[:2]:
        row[0].set_ylabel(label)
    legend_below(figure, axes[0][0])
    return figure
