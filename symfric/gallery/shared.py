"""Quantities, line styles, and the exact belt that several figures of the gallery share.

Laws, references and sweeps have the same style in all pictures; legends are below the panels.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import atan2, hypot, pi, sqrt
from typing import Any, final

import numpy as np
from matplotlib import colormaps

from symfric import Trajectory
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import check_names
from symfric.foundation.style import QUIET, Line, line


def acceleration(run: Trajectory, rate: str) -> Array:
    """Return the derivative of the state `rate`, computed from the equations of the model."""
    model = run.model
    if model.ode is None:
        raise ValueError(f"acceleration: expected explicit equations, got '{model.name}'")
    return run.of(model.ode[[v.name for v in model.x].index(rate)])


def rms(difference: Array) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(np.square(difference))))


def largest(difference: Array) -> float:
    """Return the largest magnitude."""
    return float(np.abs(difference).max())


def spread(x: Array) -> float:
    """Return S x 100 [m] of Jing and Mi: 100 times the standard deviation of positions."""
    return 100 * float(np.std(x, ddof=1))


REFERENCE: Mapping[str, Any] = {"color": QUIET, "linewidth": 3.2, "solid_capstyle": "butt"}
"""Keywords of a reference curve: wide and grey, behind the other curves."""


def shade(part: float) -> Any:
    """Return the colour of a parameter value, from the first (0, violet) to the last (1, green)."""
    return colormaps["viridis"](0.9 * part)


LOOKS = {
    "lugre": 0, "dahl": 1, "elasto_plastic": 2, "gonthier": 3, "generic_asperity": 4,
    "exact_coulomb": 4, "leuven": 5, "maxwell_slip": 6, "bengisu_akay": 7, "karnopp": 8,
    "velocity_based": 9, "stick_slip": 10, "threlfall": 11, "brown_mcphee": 12, "awrejcewicz": 13,
    "bliman_sorine": 15, "self_tuning": 16, "gms": 24, "quarter_car_general": 0,
    "quarter_car_simple": 1, "viscous": 5, "steady_state_lugre": 0,
}  # fmt: skip
"""Name in the catalogue -> number in `style.CYCLE`; laws of different figures may share one."""


def look(law: str) -> Line:
    """Return the colour and line style of a law by its name, as keywords of `Axes.plot`."""
    check_names("gallery", [law], LOOKS)
    return line(LOOKS[law])


@final
@dataclass(frozen=True)
class Belt:
    """Block of mass m on a belt of velocity v_belt, held by a spring k, with F_S and F_C.

    The motion with exact dry friction is in closed form, phase by phase: lines while the block
    sticks, and arcs. It is the reference of the laws and uses no code of the library.

    Attributes:
        stops: instants [s] at which the block joins the belt.
        leaves: instants [s] at which it breaks away.
    """

    m: float
    k: float
    v_belt: float
    F_S: float
    F_C: float
    stops: list[float] = field(default_factory=list[float])
    leaves: list[float] = field(default_factory=list[float])

    def motion(self, times: Array) -> dict[str, Array]:
        """Return elongation, relative velocity, acceleration and friction at `times` [s].

        The block starts from rest at x = 0. Friction opposes the velocity relative to the belt, so
        F < 0 while the belt pulls.
        """
        w, centre = sqrt(self.k / self.m), self.F_C / self.k
        x, v, F = (np.empty_like(times) for _ in range(3))
        begin, at, rate, sticks = 0.0, 0.0, 0.0, False
        while begin <= times[-1]:
            if sticks:
                lasts = (self.F_S / self.k - at) / self.v_belt
            else:  # until the velocity rises to that of the belt, after the crest
                lasts = self._until_it_stops(at - centre, rate, w)
            s = times - begin
            here = (s >= 0) & (s <= lasts)
            if sticks:
                x[here], v[here] = at + rate * s[here], rate
                F[here] = -self.k * x[here]
            else:
                a, b = at - centre, rate / w
                x[here] = centre + a * np.cos(w * s[here]) + b * np.sin(w * s[here])
                v[here] = w * (b * np.cos(w * s[here]) - a * np.sin(w * s[here]))
                F[here] = -self.F_C
            begin += lasts
            (self.leaves if sticks else self.stops).append(begin)
            at = self.F_S / self.k if sticks else self._where_it_stops(at - centre, rate, w)
            rate, sticks = self.v_belt, not sticks
        return {"x": x, "v_rel": v - self.v_belt, "a": -(self.k * x + F) / self.m, "friction": F}

    def _until_it_stops(self, a: float, rate: float, w: float) -> float:
        """Return the time until the velocity on the arc reaches that of the belt again."""
        b, size = rate / w, hypot(a, rate / w)
        # v = w size cos(w s + phase) rises through v_belt where the cosine rises
        phase = atan2(a, b)
        angle = (-np.arccos(min(self.v_belt / (w * size), 1.0)) - phase) % (2 * pi)
        return float(angle / w) if angle > 1e-9 else 2 * pi / w

    def _where_it_stops(self, a: float, rate: float, w: float) -> float:
        s = w * self._until_it_stops(a, rate, w)
        return float(self.F_C / self.k + a * np.cos(s) + rate / w * np.sin(s))
