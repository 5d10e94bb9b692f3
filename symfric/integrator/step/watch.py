"""What error control watches beside the states: sliding velocities, and algebraic unknowns.

A sliding velocity s is the difference of two velocities that may be a thousand times larger, so
its error is measured on the velocity scale w of the law instead. And a step must not carry it
across that scale without a look: friction that acts near rest only, a peak without a Coulomb level
behind it, leaves no trace in a step that leaps over it. No stage falls on the peak, no error is
estimated, and a block that should have been caught goes on. Whatever the estimate says,

    travel <= REACH (w + nearest) / finer

holds for every step, `nearest` being its least |s|, or 0 where s changes sign: steps shrink
geometrically on the way to rest and cross it in steps of a few w. The parabola through both ends
and the middle of the dense output serves for s. A method whose steps are differentiated is
`finer`: the derivative of friction, a peak of width w, has to be seen by several stages, while the
state only asks for its integral. A model without monitors has none of this.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, final

import casadi as ca

from symfric.integrator.equations.system import System
from symfric.integrator.methods.method import Trial

REACH = 4.0
"""Friction that rises over w and falls behind it is seen by the stages of a step this long."""

FINEST = 1e-14
"""A step this short, relative to the end time, is about to end the run: neither it nor the one
behind it is asked for."""


@final
@dataclass(frozen=True, eq=False)
class Watch:
    """The watched expressions of a system over one trial.

    Attributes:
        before, half, after: their values at the start, in the middle and at the end.
        nominal: their typical magnitudes.
        change: (y, direction, d) -> what a change of y does to them, to first order.
        slips: how many of them, the first ones, are sliding velocities.
        finer: how many times shorter their ways near rest are than usual.
    """

    before: Any
    half: Any
    after: Any
    nominal: Any
    change: ca.Function
    slips: int
    finer: float = 1.0

    def error(self, y: Any, error: Any, d: Any, rtol: Any) -> Any:
        """Mean square sum of what an error of y makes of them, in units of rtol.

        A value is scaled by rtol (nominal + min|value|): where a contact sticks, its sliding
        velocity is resolved relative to the velocity scale of the law instead of the velocity of
        the body, or breaking away comes too late or not at all.
        """
        smallest = ca.fmin(ca.fabs(self.before), ca.fabs(self.after))
        return ca.sumsqr(self.change(y, error, d) / (rtol * (self.nominal + smallest)))

    def leap(self) -> Any:
        """Largest travel of a sliding velocity, in units of what is allowed."""
        here = range(self.slips)
        before, half, after, scale = (
            x[here] for x in (self.before, self.half, self.after, self.nominal)
        )
        bow = ca.fabs(half - (before + after) / 2)
        nearest = ca.fmax(0, ca.fmax(ca.fmin(before, after), -ca.fmax(before, after)) - bow)
        return ca.mmax((ca.fabs(after - before) + bow) / (REACH / self.finer * (scale + nearest)))


def watching(system: System, finer: float = 1.0) -> Callable[[Any, Trial, Any], Watch] | None:
    """(y, trial, d) -> what is watched over it, so many times `finer`; None where nothing is."""
    if not system.monitors.numel():
        return None
    direction = ca.SX.sym("direction", system.n)
    along = ca.jtimes(system.monitors, system.y, direction)
    value = ca.Function("monitor", [system.y, system.d], [system.monitors])
    change = ca.Function("monitor_error", [system.y, direction, system.d], [along])
    nominal = ca.Function("monitor_nominal", [system.d], [ca.densify(system.monitor_nominal)])

    def watch(y: Any, trial: Trial, d: Any) -> Watch:
        bend = sum((0.5**k * row for k, row in enumerate(trial.dense)), start=type(y)(0))
        half = value((y + trial.end) / 2 + bend / 4, d) if system.slips else type(y)(0)
        ends = value(y, d), half, value(trial.end, d)
        return Watch(*ends, nominal(d), change, system.slips, finer)

    return watch
