"""Exact dry friction on Rabinowicz's belt, phase by phase in closed form: sticking lines and arcs.

It stands beside the laws as what they approximate, and knows nothing of the library.
"""

from dataclasses import dataclass, field
from math import atan2, hypot, pi, sqrt
from typing import final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@final
@dataclass(frozen=True)
class Belt:
    """A block of mass m on a belt of velocity v_belt, held by a spring k, with F_S and F_C.

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
        """Elongation, velocity relative to the belt, acceleration and friction at `times` [s].

        From rest at x = 0; friction opposes the relative velocity, so F < 0 while the belt pulls.
        """
        w, centre = sqrt(self.k / self.m), self.F_C / self.k
        x, v, F = (np.empty_like(times) for _ in range(3))
        begin, at, rate, sticks = 0.0, 0.0, 0.0, False
        while begin <= times[-1]:
            if sticks:
                lasts = (self.F_S / self.k - at) / self.v_belt
            else:  # until the velocity is that of the belt from below: a phase behind the crest
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
        """Time until the velocity of the arc reaches the belt's again."""
        b, size = rate / w, hypot(a, rate / w)
        # v = w size cos(w s + phase); it rises through v_belt where the cosine does
        phase = atan2(a, b)
        angle = (-np.arccos(min(self.v_belt / (w * size), 1.0)) - phase) % (2 * pi)
        return float(angle / w) if angle > 1e-9 else 2 * pi / w

    def _where_it_stops(self, a: float, rate: float, w: float) -> float:
        s = w * self._until_it_stops(a, rate, w)
        return float(self.F_C / self.k + a * np.cos(s) + rate / w * np.sin(s))
