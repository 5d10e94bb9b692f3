"""Smoothing of a law: widths and bristles scaled together until it keeps a wanted error.

    static laws      widths and velocities s
    bristles         stiffness 1/s, paths and widths s, damping 1/sqrt(s), velocities s^p

and dry friction at s = 0: bristles relax only where they creep, with the loading rate over sigma_0,
faster than v_eps, so that no width is negligible. They break away at mu_s N but for a share of
(loading rate / (sigma_0 v_s))^(2/3), and their fall behind it takes v_s^(2/3). Both vanish alike
with p = 1/2, as s^(1/3); which is the larger one is a matter of the machine, so a smaller p is
tried, too. The end of all this is where they creep by less than velocities are rounded.
Limits: where a load turns bristles within their own period they swing past it and break away,
however stiff they are, unless sigma_1 damps them: that motion is theirs, not that of dry friction.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import inf, log
from typing import final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from symfric.choice.friction import Friction, fall_of, peaked
from symfric.figures.regularisation import Regularisation
from symfric.foundation.parameters import Parameter, parameters, with_values
from symfric.laws import Law, LeineSwitch, RateAndState
from symfric.laws.base.families import Sticking

Array = NDArray[np.float64]
NEGLIGIBLE = 1e-7
"""Widths of static laws below this only round off a modulus."""
RELATIVE = ("u_eps",)
"""Widths that are shares of another."""
LEVEL_LIKE: dict[type[Law], tuple[str, ...]] = {LeineSwitch: ("delta", "c"), RateAndState: ("v_0",)}
"""Velocities that say how high friction is, and no width."""
OF_BRISTLES = 0.45, 0.5
"""Powers of the velocities of laws with states, tried in this order."""


@final
@dataclass(frozen=True, eq=False)
class Smoothing(Regularisation):
    """Parameters that make `law` smooth, scaled together by a factor s.

    Attributes:
        mu_s, load: the peak that static laws are to keep at every s, and the normal force [N].
        velocities: the power of s for velocities; 0 where nothing is scaled.
    """

    mu_s: float
    load: float | None
    velocities: float = 0.0

    def at(self, s: float) -> Law:
        """Return the law at the factor `s`.

        Raises:
            ValueError: beyond a bound of the law.
        """
        if not self.powers:
            return self.law
        known = parameters(self.law)
        law = with_values(self.law, {n: _within(known[n], x) for n, x in self.values(s).items()})
        return peaked(law, self.mu_s, self.load)


def _within(p: Parameter, value: float) -> float:
    """Return a width that is at its bound stays there: it only rounds off."""
    return min(max(value, p.lower), p.upper) if p.role == "width" else value


def smoothing(
    law: Law, friction: Friction, load: float | None, bristles: float = OF_BRISTLES[0]
) -> Smoothing:
    """Return the scalable parameters of `law`; none of one that rests exactly or has no widths.

    Args:
        law, friction, load: what it describes, and under which load.
        bristles: the power of the velocities of a law with states.
    """
    known = parameters(law)
    exact = isinstance(law, Sticking) and law.has_mode
    fixed = fall_of(law) if friction.v_s is not None else None
    of_speed = bristles if law.states else 1.0
    powers = {} if exact else {n: _power(law, p, of_speed) for n, p in known.items() if n != fixed}
    found = {name: power for name, power in powers.items() if power}
    return Smoothing(law, found, friction.mu_s, load, of_speed if found else 0.0)


def _power(law: Law, p: Parameter, of_speed: float) -> float:
    """Return the power of s for a parameter; 0 for one that makes nothing smooth."""
    value = float(p.value)  # pyright: ignore[reportArgumentType]  (numbers only)
    if p.name in RELATIVE or p.field in LEVEL_LIKE.get(type(law), ()):
        return 0.0
    inverse = -1.0 if p.unit in ("s/m", "s/rad") else 1.0
    if p.role == "velocity scale":
        return inverse * of_speed
    if p.role == "width":
        return 1.0 if law.states or (value > NEGLIGIBLE and p.unit != "1") else 0.0
    if not law.states or value == 0.0:
        return 0.0
    of_bristles = {"stiffness": -1.0, "damping": -0.5, "length": 1.0}
    return -1.0 if p.unit == "N/s" else of_bristles.get(p.role, 0.0)


RATIO, SHORTER = 4.0, 2.0
"""From one smoothing of the ladder to the next; towards dry friction after a run that failed."""
LEAP = 4
"""Rungs that are left out where errors stay the same."""
LEAST_ORDER, SAME_ORDER, LONGEST, WITHIN = 0.2, 0.2, 3, 0.8
"""Errors follow a power of the smoothing if it is so large, and changes by no more than this share;
then so many levels at most are made in one, to this share of the wanted error."""
NARROW = 3e-5
"""Share of its own velocities at which a law is dry for machines that are not far slower."""
ORDERS = 0.05, 4.0
"""Orders that differences of runs may show; they tend to nothing yet if they fall otherwise."""
CERTAIN = 0.25
"""Part of its error that a law may still move by, by the order of its runs, to be another one."""
MOST, SOFTEST = 24, 5
"""Rungs in all, and those on the soft side of the law as it comes."""
MARGIN = 0.7
"""Part of the wanted error that is left to the law; the rest is the integrator's."""
ROUNDING = 5e-3
"""Error that falls by less than this share of it over three levels is the law's own."""


@final
@dataclass(frozen=True)
class Smoothed:
    """Run of the ladder: factor of the widths, error, attempts, tolerance, motion over size."""

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
        levels: softest first.
        stopped: why it went no further towards dry friction; "" where the wanted error is kept.
        decided: there is nothing to find out on another way there.
    """

    levels: tuple[Smoothed, ...]
    stopped: str
    decided: bool = False

    def softest(self, wanted: float) -> float | None:
        """Return the softest factor below which every run keeps the error; None where none does."""
        kept = len(self.levels)
        while kept and self.levels[kept - 1].error <= wanted:
            kept -= 1
        if kept == len(self.levels):
            return None
        good = self.levels[kept]
        if kept == 0 or not good.error > 0.0:
            return good.s
        bad = self.levels[kept - 1]
        if not bad.error < inf:
            return good.s
        order = log(bad.error / good.error) / log(bad.s / good.s)
        return min(good.s * (wanted / good.error) ** (1 / order), 0.999 * bad.s)


FIXED = "nothing of it is scaled"
Run = Callable[[float], Smoothed]
"""s -> the run; raises what a run raises, see `ladder`."""


def ladder(
    run: Run,
    wanted: float,
    softest: float,
    powers: float,
    failures: tuple[type[Exception], ...],
    said: Callable[[Exception], str] = str,
) -> SmoothingStudy:
    """Runs towards dry friction until two keep the error `wanted`, and away from it to `softest`.

    A law tends to another motion where its own runs converge, and their limit is off. That is said
    of runs at `NARROW` and below alone: a law whose widths are far from the speeds of a machine
    converges to something else first.

    Args:
        run: one run.
        wanted, softest: errors of the driest and of the softest law that are of interest.
        powers: the least power of s that its velocities have; 0 where nothing is scaled.
        failures: what a run may raise, which ends the ladder on its side.
        said: such a failure in words.

    Raises:
        one of `failures`: the law as it comes, s = 1, does not run.
    """
    levels, stopped, decided = [run(1.0)], "" if powers else FIXED, not powers
    ratio, leap = RATIO, RATIO**LEAP
    while not stopped and not _kept(levels, wanted):
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
            stopped = said(problem) if ratio < RATIO else ""
            ratio, leap = (SHORTER, SHORTER) if leap == RATIO else (RATIO, RATIO)
    with suppress(*failures):  # softer than the law allows
        while powers and levels[0].error <= softest and levels[0].s < RATIO**SOFTEST:
            levels.insert(0, run(levels[0].s * RATIO))
    return SmoothingStudy(tuple(levels), "" if levels[-1].error <= wanted else stopped, decided)


def limit_order(levels: Sequence[Smoothed]) -> float | None:
    """Return the order in s with which motions tend to one that is off; None where that is not
    shown.

    Three runs show the order q of x_0 + c s^q, whose c s_2^q the limit still is from the last one,
    if they are leaps apart: at an extremum of their error neighbours are alike, too.

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
    """Largest difference of two motions relative to their size; infinite where unknown."""
    a, b = one.motion, other.motion
    return inf if a is None or b is None or a.shape != b.shape else float(np.abs(a - b).max())


def _kept(levels: list[Smoothed], wanted: float) -> bool:
    """Test for two runs in a row that keep the error."""
    return len(levels) > 1 and max(level.error for level in levels[-2:]) <= wanted


def _stride(levels: list[Smoothed], wanted: float) -> float:
    """Ratio to the next run: to where errors that follow a power are at `wanted`."""
    if len(levels) < 3 or not all(0.0 < level.error < inf for level in levels[-3:]):
        return RATIO
    e = [log(level.error) for level in levels[-3:]]
    s = [log(level.s) for level in levels[-3:]]
    before, order = ((e[k] - e[k + 1]) / (s[k] - s[k + 1]) for k in (0, 1))
    if order < LEAST_ORDER or abs(order - before) > SAME_ORDER * order:
        return RATIO
    return min(max((levels[-1].error / (WITHIN * wanted)) ** (1 / order), RATIO), RATIO**LONGEST)


def _settled(levels: list[Smoothed]) -> bool:
    """Test for four last errors that are the same, or grow."""
    last = [level.error for level in levels[-4:]]
    return len(last) == 4 and min(last[1:]) >= (1 - ROUNDING) * last[0]
