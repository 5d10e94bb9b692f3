"""Pendulum and box of figures 6 to 12: eleven laws with the numbers of tables 6 and 7."""

from collections.abc import Iterable
from functools import cache

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from symfric import ExactCoulomb, Law, Trajectory, simulate
from symfric.gallery.selection import _machine as machine
from symfric.gallery.selection._laws import LAWS, small_multiples
from symfric.gallery.signals import acceleration, largest, rms
from symfric.scenes import PendulumBox

Array = NDArray[np.float64]
T_END = 15.0
EXACT = "exact dry friction"


def box(law: Law, J: float = machine.J) -> PendulumBox:
    """The scene of table 6; `J` [kg m^2] is the inertia of the pendulum about its mass."""
    return PendulumBox.preset("jing_mi_table_7", law, J=J)


@cache
def run(name: str, t_end: float = T_END, rtol: float = 1e-7) -> Trajectory:
    """A law, or exact dry friction, in floor and hinge; seen every ms."""
    law: Law = ExactCoulomb() if name == EXACT else LAWS[name]
    model = box(law).model()
    return simulate(model, t_end, rtol=rtol, t_eval=np.linspace(0, t_end, round(1000 * t_end) + 1))


@cache
def signal(name: str, what: str, t_end: float) -> Array:
    """x, x', x'' of the box or phi, phi', phi'' of the pendulum."""
    one, joint = run(name, t_end), what.rstrip("'")
    ending = what.removeprefix(joint)
    if ending == "''":
        return acceleration(one, f"{joint}_rate")
    return one[f"{joint}_rate"] if ending else one[joint]


@cache
def by_hand(t_end: float) -> dict[str, Array]:
    """The smooth Coulomb law in both joints, by equations written by hand."""
    return machine.smooth_coulomb(run("Smooth", t_end).t)


def distance(what: str, t_end: float) -> float:
    """Largest difference of a signal of the smooth Coulomb law from that by hand."""
    return largest(signal("Smooth", what, t_end) - by_hand(t_end)[what])


def picture(
    what: str, label: str, names: tuple[str, ...], t_end: float, limit: float = np.inf
) -> Figure:
    """A panel per law, exact dry friction behind."""
    t = run(EXACT, t_end).t
    curves = {name: (t, signal(name, what, t_end)) for name in names}
    return small_multiples(curves, (t, signal(EXACT, what, t_end)), label, (-limit, limit))


def last_swing(name: str, what: str, t_end: float) -> float:
    """Half the range of a signal in the last two seconds."""
    return float(np.ptp(signal(name, what, t_end)[-2000:])) / 2


def end_of_motion(what: str, numbers: dict[str, float], t_end: float) -> dict[str, bool]:
    """What holds of `signal` in the last two seconds, when dry friction holds the box."""
    names = [*LAWS] if t_end == T_END else ["Smooth", "Karnopp", "LuGre"]
    exact = signal(EXACT, what, t_end)
    off = {name: rms((signal(name, what, t_end) - exact)[-2000:]) for name in names}
    most = off["LuGre"]
    if t_end < T_END:  # the box still moves
        return {"Karnopp errs most": off["Karnopp"] > 2 * most > 2 * off["Smooth"]}
    stiffness = machine.M * machine.G * machine.L
    w = float(np.sqrt(stiffness / (machine.J + machine.M * machine.L**2)))
    swings = {one: last_swing(EXACT, one, t_end) for one in (what, "phi")}
    numbers["frequency of the pendulum on a fixed hinge [rad/s]"] = w
    phi = signal(EXACT, "phi", t_end)[-5000:]
    turns = np.flatnonzero((phi[:-1] < 0) & (phi[1:] >= 0)) * 1e-3
    numbers["frequency in the last 5 s, exact dry friction [rad/s]"] = found = float(
        2 * np.pi * (turns.size - 1) / (turns[-1] - turns[0])
    )
    order = what.count("'")
    return {
        "LuGre and Elasto-plastic err by a quarter of the swing or more": (
            min(most, off["Elasto-plastic"]) > 0.25 * swings[what]
        ),
        "Dahl errs by as much": abs(off["Dahl"] / most - 1) < 0.05,
        "Smooth and Threlfall by two thirds to three quarters of it": all(
            0.62 < off[name] / most < 0.77 for name in ("Smooth", "Threlfall")
        ),
        "Karnopp by twice as much": 1.8 < off["Karnopp"] / most < 2.1,
        "Bengisu and Gonthier are nearest": (
            {*sorted(off, key=lambda name: off[name])[:2]} == {"Bengisu", "Gonthier"}
        ),
        "dry friction leaves a pendulum on a fixed hinge": (
            abs(found / w - 1) < 2e-3 and abs(swings[what] / (w**order * swings["phi"]) - 1) < 2e-3
        ),
    }


def departures(what: str, unit: str, names: Iterable[str], t_end: float) -> dict[str, float]:
    """How far the laws are from dry friction, over the run and over its last two seconds."""
    exact = signal(EXACT, what, t_end)
    numbers = {f"swing in the last 2 s, {EXACT} [{unit}]": last_swing(EXACT, what, t_end)}
    for name in names:
        off = signal(name, what, t_end) - exact
        numbers[f"largest distance from dry friction, {name} [{unit}]"] = largest(off)
        numbers[f"rms distance in the last 2 s, {name} [{unit}]"] = rms(off[-2000:])
        numbers[f"swing in the last 2 s, {name} [{unit}]"] = last_swing(name, what, t_end)
    return numbers
