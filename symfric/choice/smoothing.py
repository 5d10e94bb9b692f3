"""Smoothing of a law, and its continuation towards dry friction up to a required error.

Widths and bristles of a law are scaled together by a factor s:

    static laws      widths and velocities s
    bristles         stiffness 1/s, paths and widths s, damping 1/sqrt(s), velocities s^p

s -> 0 is dry friction. Bristles relax only if their creep velocity, the loading rate over sigma_0,
exceeds v_eps, so no width is negligible. The error of their break-away force is of the order of
(loading rate / (sigma_0 v_s))^(2/3), and that of the subsequent fall of the order of v_s^(2/3). For
p = 1/2 both vanish as s^(1/3). Which one dominates depends on the machine, so a smaller p is tried
as well. The continuation ends where creep velocities are below the rounding errors of velocities.
Limits: if a load reverses within the period of the bristles, they overshoot and break away for any
stiffness, unless sigma_1 damps them. Then the law does not tend to dry friction.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import inf, log
from typing import final

import numpy as np
from scipy.optimize import brentq

from symfric.choice.friction import Friction, fall_of, peaked
from symfric.figures.regularisation import Regularisation, apart
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import Parameter, parameters, with_values
from symfric.laws import Law, LeineSwitch, RateAndState
from symfric.laws.base.families import WithModes

NEGLIGIBLE = 1e-7
"""Limit below which a width of a static law only rounds an absolute value."""
RELATIVE = ("u_eps",)
"""Widths that are relative to another width."""
LEVEL_LIKE: dict[type[Law], tuple[str, ...]] = {LeineSwitch: ("delta", "c"), RateAndState: ("v_0",)}
"""Parameters that determine the level of friction and are not widths, by law."""
OF_BRISTLES = 0.45, 0.5
"""Powers p of the velocities of laws with states, in the order in which they are tried."""


@final
@dataclass(frozen=True, eq=False)
class Smoothing(Regularisation):
    """Parameters that make `law` smooth, scaled together by a factor s.

    Attributes:
        mu_s, load: ratio F/N at the peak of static laws for every s, and the normal force [N].
        velocities: power of s for velocities; 0 if nothing is scaled.
    """

    mu_s: float
    load: float | None
    velocities: float = 0.0

    def at(self, s: float) -> Law:
        """Return the law at the factor `s`, with its widths limited to their bounds.

        Raises:
            ValueError: a parameter other than a width is out of bounds.
        """
        known, values = parameters(self.law), self.values(s)
        for name in values:
            if (p := known[name]).role == "width":
                values[name] = min(max(values[name], p.lower), p.upper)
        return peaked(with_values(self.law, values), self.mu_s, self.load) if values else self.law


def smoothing(
    law: Law, friction: Friction, load: float | None, bristles: float = OF_BRISTLES[0]
) -> Smoothing:
    """Return the scalable parameters of `law`; none for laws that stick exactly or have no widths.

    Args:
        law: the law.
        friction: the friction that the law describes.
        load: normal force [N]; None if it is not one number.
        bristles: power of the velocities of a law with states.
    """
    exact = isinstance(law, WithModes) and law.has_mode
    fixed = fall_of(law) if friction.v_s is not None else None
    of_speed = bristles if law.states else 1.0
    known = {n: p for n, p in parameters(law).items() if n != fixed and not exact}
    powers = {n: power for n, p in known.items() if (power := _power(law, p, of_speed))}
    return Smoothing(law, powers, friction.mu_s, load, of_speed if powers else 0.0)


def _power(law: Law, p: Parameter, of_speed: float) -> float:
    """Return the power of s for a parameter, or 0 for a parameter that does not smooth."""
    value = float(p.value)  # pyright: ignore[reportArgumentType]  (numbers only)
    if p.name in RELATIVE or p.field in LEVEL_LIKE.get(type(law), ()):
        return 0.0
    if p.role == "velocity scale":
        return -of_speed if p.unit in ("s/m", "s/rad") else of_speed
    if p.role == "width":
        return 1.0 if law.states or (value > NEGLIGIBLE and p.unit != "1") else 0.0
    if not law.states or value == 0.0:
        return 0.0
    of_bristles = {"stiffness": -1.0, "damping": -0.5, "length": 1.0}
    return -1.0 if p.unit == "N/s" else of_bristles.get(p.role, 0.0)


RATIO, SHORTER = 4.0, 2.0
"""Ratio of successive smoothings, and the smaller ratio that is used after a failed run."""
LEAP = 4
"""Number of such steps that are combined into one if errors do not change."""
LEAST_ORDER, SAME_ORDER, LONGEST, WITHIN = 0.2, 0.2, 3, 0.8
"""Errors follow a power of the smoothing if their order is at least `LEAST_ORDER` and changes by at
most the share `SAME_ORDER`. Then up to `LONGEST` steps are combined into one, towards the share
`WITHIN` of the required error."""
NARROW = 3e-5
"""Factor of the velocities of a law below which it counts as dry, except in very slow machines."""
ORDERS = 0.05, 4.0
"""Smallest and largest order of convergence that is accepted."""
CERTAIN = 0.25
"""Largest distance from the limit, relative to the error, at which this limit is accepted."""
MOST, SOFTEST = 24, 5
"""Largest number of steps towards dry friction, and of steps away from it."""
MARGIN = 0.7
"""Share of the required error for the law; the integrator may use the remainder."""
ROUNDING = 5e-3
"""Share by which an error must decrease over three levels; otherwise it counts as constant."""


@final
@dataclass(frozen=True)
class Smoothed:
    """Run of the continuation.

    Attributes:
        s: factor of the widths.
        error: difference from the reference.
        attempts: number of attempted steps.
        rtol: relative tolerance.
        motion: compared signals divided by their sizes, shape (signals, times).
    """

    s: float
    error: float
    attempts: int
    rtol: float = 0.0
    motion: Array | None = None


@final
@dataclass(frozen=True)
class SmoothingStudy:
    """Error against smoothing.

    Attributes:
        levels: runs, starting with the smoothest law.
        stopped: reason why the continuation ended; empty if the required error was reached.
        decided: True if other powers of the bristles cannot change the result.
    """

    levels: tuple[Smoothed, ...]
    stopped: str
    decided: bool = False

    def softest(self, wanted: float) -> float | None:
        """Return the largest factor below which all errors are at most `wanted`, or None."""
        kept = len(self.levels)
        while kept and self.levels[kept - 1].error <= wanted:
            kept -= 1
        if kept == len(self.levels):
            return None
        good = self.levels[kept]
        if kept == 0 or not good.error > 0.0 or not self.levels[kept - 1].error < inf:
            return good.s
        bad = self.levels[kept - 1]
        order = log(bad.error / good.error) / log(bad.s / good.s)
        return min(good.s * (wanted / good.error) ** (1 / order), 0.999 * bad.s)


FIXED = "nothing of it is scaled"
Run = Callable[[float], Smoothed]
"""Function s -> run, which may raise one of the `failures` of `study`."""


def study(
    run: Run,
    wanted: float,
    softest: float,
    powers: float,
    failures: tuple[type[Exception], ...],
    reason: Callable[[Exception], str] = str,
) -> SmoothingStudy:
    """Run towards dry friction until two errors are at most `wanted`, then away up to `softest`.

    A law tends to another motion if its runs converge to a limit that differs from the reference.
    Only runs with velocities scaled by `NARROW` or less are used for this conclusion, because laws
    with widths above the speeds of the machine appear to converge to something else.

    Args:
        run: function that computes a run for a factor s.
        wanted: required error towards dry friction.
        softest: largest error of interest away from dry friction.
        powers: smallest power of s with which velocities are scaled; 0 if nothing is scaled.
        failures: exceptions of `run` that end the continuation in the current direction.
        reason: function that describes such an exception.

    Raises:
        one of `failures`: the unscaled law, s = 1, does not run.
    """
    levels, stopped, decided = [run(1.0)], "" if powers else FIXED, not powers
    ratio, leap = RATIO, RATIO**LEAP
    while not stopped and not (len(levels) > 1 and max(x.error for x in levels[-2:]) <= wanted):
        settled = _settled(levels)
        step = ratio if ratio < RATIO else leap if settled else _stride(levels, wanted)
        order = limit_order(levels) if levels[-1].s ** powers <= NARROW else None
        if settled and order is not None:
            stopped, decided = f"it tends to another motion, with order {order:.2g}", True
        elif len(levels) > MOST:
            stopped = f"its error still changes at smoothing {levels[-1].s:.0e}"
        try:
            levels += [] if stopped else [run(levels[-1].s / step)]
        except failures as problem:
            stopped = reason(problem) if ratio < RATIO else ""
            ratio, leap = (SHORTER, SHORTER) if leap == RATIO else (RATIO, RATIO)
    with suppress(*failures):  # smoother than the law allows
        while powers and levels[0].error <= softest and levels[0].s < RATIO**SOFTEST:
            levels.insert(0, run(levels[0].s * RATIO))
    return SmoothingStudy(tuple(levels), "" if levels[-1].error <= wanted else stopped, decided)


def limit_order(levels: Sequence[Smoothed]) -> float | None:
    """Return the order in s of convergence to a limit other than the reference; None if unknown.

    The order q of x + c s^q follows from the last three runs x_0, x_1, x_2, and the distance of x_2
    from the limit is c s_2^q. The factors must differ by `LEAP` steps, because neighbouring runs
    are also similar near an extremum of the error.

        |x_0 - x_1| / |x_1 - x_2| = (s_0^q - s_1^q) / (s_1^q - s_2^q)
    """
    if len(levels) < 3:
        return None
    one, two, three = levels[-3:]
    before, after = _apart(one, two), _apart(two, three)
    a, b = one.s / two.s, two.s / three.s
    if not 0.0 < after < before < inf or min(a, b) < RATIO**LEAP:
        return None

    def excess(q: float) -> float:
        return (a**q - 1) / (1 - b**-q) - before / after

    low, high = ORDERS
    if not excess(low) < 0.0 < excess(high):
        return None
    order = float(brentq(excess, low, high))  # pyright: ignore[reportArgumentType]
    return order if after / (b**order - 1) <= CERTAIN * three.error else None


def _apart(one: Smoothed, other: Smoothed) -> float:
    """Return the largest difference of two motions relative to their size; inf if unknown."""
    a, b = one.motion, other.motion
    return inf if a is None or b is None else apart(a, b, np.ones(len(b)))


def _stride(levels: list[Smoothed], wanted: float) -> float:
    """Return the ratio to the next factor; larger if errors follow a power of s."""
    if len(levels) < 3 or not all(0.0 < level.error < inf for level in levels[-3:]):
        return RATIO
    e = [log(level.error) for level in levels[-3:]]
    s = [log(level.s) for level in levels[-3:]]
    before, order = ((e[k] - e[k + 1]) / (s[k] - s[k + 1]) for k in (0, 1))
    if order < LEAST_ORDER or abs(order - before) > SAME_ORDER * order:
        return RATIO
    return min(max((levels[-1].error / (WITHIN * wanted)) ** (1 / order), RATIO), RATIO**LONGEST)


def _settled(levels: list[Smoothed]) -> bool:
    """Return True if the last four errors are constant or increase."""
    last = [level.error for level in levels[-4:]]
    return len(last) == 4 and min(last[1:]) >= (1 - ROUNDING) * last[0]
