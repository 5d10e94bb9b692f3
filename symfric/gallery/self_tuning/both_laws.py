"""The self-tuning law and Brown-McPhee in one machine, by the library and by hand."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import final

import numpy as np

from symfric import BrittleSelfTuning, BrownMcPhee, Law, SelfTuning, simulate
from symfric.foundation.numeric import Array
from symfric.gallery.self_tuning import machines
from symfric.gallery.self_tuning.machines import Coefficient, PaperMachine, solve
from symfric.gallery.shared import acceleration, largest
from symfric.scenes import Scene

Signals = dict[str, Array]
LAWS = ("self-tuning", "Brown-McPhee")
TUNED = "self-tuning, own B"
"""Law of the paper, whose B depends on load and mu_s - mu_d by the reconstructed function."""
COEFFICIENTS = {
    "self-tuning": machines.self_tuning,
    "Brown-McPhee": machines.brown_mcphee,
    TUNED: machines.own_stiffness,
}


def law(label: str, v_t: float, mu: Mapping[str, float]) -> Law:
    """Return a law with its peak at `v_t` [m/s]; `TUNED` determines its peak itself."""
    if label == TUNED:
        return BrittleSelfTuning(**mu)
    if label.startswith("self"):
        return SelfTuning.from_peak_velocity(v_t, **mu)
    return BrownMcPhee(v_t=v_t, **mu)


@final
@dataclass(frozen=True, eq=False)
class Both:
    """Both laws in one machine.

    Attributes:
        scene, by_hand: machine of the library with a law, and by hand with a coefficient.
        mu, v_t: levels of the laws, and velocity of their peaks [m/s].
        rate: number of samples per second.
        names: coordinates, which are signals together with their rates and accelerations.
        more: further signals.
    """

    scene: Callable[[Law], Scene]
    by_hand: Callable[[Coefficient], PaperMachine]
    mu: Mapping[str, float]
    v_t: float
    rate: int
    names: tuple[str, ...]
    more: tuple[str, ...]

    def machine(self, label: str, v_t: float) -> PaperMachine:
        """Return the machine by hand with a law."""
        return self.by_hand(COEFFICIENTS[label](**self.mu, v_t=v_t))

    def apart(self, signal: str, t_end: float) -> Array:
        """Return the difference of a signal between both laws over time."""
        first, other = (run(self, one, self.v_t, t_end)[signal] for one in LAWS)
        return first - other

    def distance(self, signals: Iterable[str], t_end: float) -> float:
        """Return the largest difference of signals from those by hand, over both laws."""
        return max(
            largest(run(self, one, self.v_t, t_end)[n] - oracle(self, one, self.v_t, t_end)[n])
            for one in LAWS
            for n in signals
        )


@cache
def run(both: Both, label: str, v_t: float, t_end: float) -> Signals:
    """Return times, coordinates x, rates x', accelerations x'' and further signals with a law."""
    times = np.linspace(0.0, t_end, round(both.rate * t_end) + 1)
    model = both.scene(law(label, v_t, both.mu)).model()
    found = simulate(model, t_end, rtol=1e-8, t_eval=times)
    signals: Signals = {"t": times, **{name: found[name] for name in both.more}}
    for name in both.names:
        signals[name], signals[f"{name}'"] = found[name], found[f"{name}_rate"]
        signals[f"{name}''"] = acceleration(found, f"{name}_rate")
    return signals


@cache
def oracle(both: Both, label: str, v_t: float, t_end: float) -> Signals:
    """Return the signals by equations written by hand, integrated by SUNDIALS."""
    return solve(both.machine(label, v_t), run(both, label, v_t, t_end)["t"])
