"""How soft a law may be: its widths and bristles scaled together, until it keeps a wanted error.

    static laws      widths and velocities s
    bristles         stiffness 1/s, paths s, damping and velocities 1/sqrt(s) and sqrt(s)

and dry friction at s = 0: bristles break away at mu_s N only where the load grows slowly beside
sigma_0 v_s.
Limits: where a load turns bristles within their own period they swing past it and break away,
however stiff they are, unless sigma_1 damps them: that motion is theirs, not that of dry friction.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from math import inf, log
from typing import final

from symfric.choice.friction import Friction, fall_of, peaked
from symfric.foundation.parameters import Parameter, parameters, with_values
from symfric.laws import Law, LeineSwitch, RateAndState
from symfric.laws.base.sticking import Sticking

NEGLIGIBLE = 1e-7
"""Widths below this only round off a modulus; they are not what makes a law smooth."""
RELATIVE = ("u_eps",)
"""Widths that are shares of another."""
LEVEL_LIKE: dict[type[Law], tuple[str, ...]] = {LeineSwitch: ("delta", "c"), RateAndState: ("v_0",)}
"""Velocities that say how high friction is, and no width."""
OF_BRISTLES = 0.5
"""Power of the velocities of laws with states."""
DIGITS = 12
"""Of scaled parameters: what is behind is rounding."""


@final
@dataclass(frozen=True, eq=False)
class Softness:
    """What makes `law` smooth, scaled together by a factor s.

    Attributes:
        powers: parameter -> power of s.
        mu_s, load: the peak that static laws are to keep at every s, and the normal force [N].
    """

    law: Law
    powers: dict[str, float]
    mu_s: float
    load: float | None

    def at(self, s: float) -> Law:
        """The law at the factor `s`.

        Raises:
            ValueError: beyond a bound of the law.
        """
        if not self.powers:
            return self.law
        known = parameters(self.law)
        scaled = {n: float(known[n].value) * s**power for n, power in self.powers.items()}
        scaled = {n: _within(known[n], x) for n, x in scaled.items()}
        law = with_values(self.law, {n: float(f"{x:.{DIGITS}g}") for n, x in scaled.items()})
        return peaked(law, self.mu_s, self.load)


def _within(p: Parameter, value: float) -> float:
    """A width that is at its bound stays there: it only rounds off."""
    return min(max(value, p.lower), p.upper) if p.role == "width" else value


def softness(law: Law, friction: Friction, load: float | None) -> Softness:
    """What may be scaled of `law`; nothing of one that rests exactly or has no widths."""
    known = parameters(law)
    exact = isinstance(law, Sticking) and law.has_mode
    fixed = fall_of(law) if friction.v_s is not None else None
    powers = {} if exact else {n: _power(law, p) for n, p in known.items() if n != fixed}
    found = {name: power for name, power in powers.items() if power}
    return Softness(law, found, friction.mu_s, load)


def _power(law: Law, p: Parameter) -> float:
    """The power of s for a parameter; 0 for one that makes nothing smooth."""
    value = float(p.value)  # pyright: ignore[reportArgumentType]  (numbers only)
    if p.name in RELATIVE or p.field in LEVEL_LIKE.get(type(law), ()):
        return 0.0
    inverse = -1.0 if p.unit in ("s/m", "s/rad") else 1.0
    if p.role == "velocity scale":
        return inverse * (OF_BRISTLES if law.states else 1.0)
    if p.role == "width" and value > NEGLIGIBLE:
        return 1.0 if law.states or p.unit != "1" else 0.0
    if not law.states or value == 0.0:
        return 0.0
    of_bristles = {"stiffness": -1.0, "damping": -0.5, "length": 1.0}
    return -1.0 if p.unit == "N/s" else of_bristles.get(p.role, 0.0)


RATIO, SHORTER = 4.0, 2.0
"""From one softness of the ladder to the next; towards dry friction after a run that failed."""
LEAP = 4
"""Rungs that are left out once where errors stay the same."""
LEAST_ORDER, SAME_ORDER, LONGEST, WITHIN = 0.2, 0.2, 3, 0.8
"""Errors follow a power of the softness if it is so large, and changes by no more than this share;
then so many rungs at most are made in one, to this share of the wanted error."""
ANOTHER = "it tends to another motion"
DRIEST, SOFTEST = 16, 5
"""Rungs on either side of the law as it comes."""
MARGIN = 0.7
"""Part of the wanted error that is left to the law; the rest is the integrator's."""
ROUNDING = 5e-3
"""An error that falls by less than this share of it over three rungs is the law's own."""


@final
@dataclass(frozen=True)
class Rung:
    """A run of the ladder: factor of the widths, error, attempts and tolerance."""

    s: float
    error: float
    attempts: int
    rtol: float = 0.0


@final
@dataclass(frozen=True)
class Ladder:
    """Error against softness.

    Attributes:
        rungs: softest first.
        stopped: why it went no further towards dry friction; "" where the wanted error is kept.
    """

    rungs: tuple[Rung, ...]
    stopped: str

    def softest(self, wanted: float) -> float | None:
        """The softest factor below which every run keeps the error; None where none does."""
        kept = len(self.rungs)
        while kept and self.rungs[kept - 1].error <= wanted:
            kept -= 1
        if kept == len(self.rungs):
            return None
        good = self.rungs[kept]
        if kept == 0 or not good.error > 0.0:
            return good.s
        bad = self.rungs[kept - 1]
        if not bad.error < inf:
            return good.s
        order = log(bad.error / good.error) / log(bad.s / good.s)
        return min(good.s * (wanted / good.error) ** (1 / order), 0.999 * bad.s)


Run = Callable[[float], Rung]
"""s -> the run; raises what a run raises, see `ladder`."""


def ladder(
    run: Run,
    wanted: float,
    softest: float,
    scalable: bool,
    failures: tuple[type[Exception], ...],
    said: Callable[[Exception], str] = str,
) -> Ladder:
    """Runs towards dry friction until two keep the error `wanted`, and away from it to `softest`.

    Args:
        run: one run.
        wanted, softest: errors of the driest and of the softest law that are of interest.
        scalable: there is something to scale.
        failures: what a run may raise, which ends the ladder on its side.
        said: such a failure in words.

    Raises:
        one of `failures`: the law as it comes, s = 1, does not run.
    """
    rungs, stopped = [run(1.0)], ""
    ratio, leapt = RATIO, False
    while scalable and not stopped and not _kept(rungs, wanted):
        step = ratio if ratio < RATIO else _stride(rungs, wanted)
        if _settled(rungs):  # a law whose widths are far from the machine's speeds looks so, too
            step, stopped = ratio**LEAP, ANOTHER if leapt else ""
            leapt = True
        elif len(rungs) > DRIEST:
            stopped = "its error falls too slowly"
        try:
            rungs += [] if stopped else [run(rungs[-1].s / step)]
        except failures as problem:
            stopped = said(problem) if ratio < RATIO else ""
            ratio = SHORTER
    with suppress(*failures):  # softer than the law allows
        while scalable and rungs[0].error <= softest and rungs[0].s < RATIO**SOFTEST:
            rungs.insert(0, run(rungs[0].s * RATIO))
    return Ladder(tuple(rungs), "" if rungs[-1].error <= wanted else stopped)


def _kept(rungs: list[Rung], wanted: float) -> bool:
    """Whether two runs in a row keep the error."""
    return len(rungs) > 1 and max(rung.error for rung in rungs[-2:]) <= wanted


def _stride(rungs: list[Rung], wanted: float) -> float:
    """Ratio to the next run: to where errors that follow a power are at `wanted`."""
    if len(rungs) < 3 or not all(0.0 < rung.error < inf for rung in rungs[-3:]):
        return RATIO
    e = [log(rung.error) for rung in rungs[-3:]]
    s = [log(rung.s) for rung in rungs[-3:]]
    before, order = ((e[k] - e[k + 1]) / (s[k] - s[k + 1]) for k in (0, 1))
    if order < LEAST_ORDER or abs(order - before) > SAME_ORDER * order:
        return RATIO
    return min(max((rungs[-1].error / (WITHIN * wanted)) ** (1 / order), RATIO), RATIO**LONGEST)


def _settled(rungs: list[Rung]) -> bool:
    """Whether the last four errors are the same, or grow."""
    last = [rung.error for rung in rungs[-4:]]
    return len(last) == 4 and min(last[1:]) >= (1 - ROUNDING) * last[0]
