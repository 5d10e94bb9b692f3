"""Compensating force in the making: the terms of a law, and the stages that the force passes.

A stage adds its states, inputs and parameters to the parts of the block, and returns the force or
velocity that it lets through; it is in the C only where it is chosen.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf
from typing import final

import casadi as ca
import numpy as np

from symfric.codegen import Block
from symfric.foundation.numeric import is_symbolic
from symfric.foundation.parameters import Variable, parameters, with_values
from symfric.laws import GMS, Law
from symfric.laws.base import smooth
from symfric.laws.composed.wrap import Wrapper
from symfric.laws.dynamic.lugre import Bristle
from symfric.model import Variables

TERMS = {
    "coulomb": "dry friction; of a law with a Stribeck effect its level in fast sliding",
    "stribeck": "by how much dry friction is larger in slow sliding than in fast",
    "viscous": "what the viscous coefficients make",
    "bristle": "what the states make beyond steady sliding: 0 is the steady curve",
    "force": "the whole force, of a law whose terms cannot be separated",
}
"""Terms of friction that have a scale of their own."""


LEAST = 1e-9
"""Load [N] that is seen where there is none: laws with states divide by it."""


@final
@dataclass(frozen=True, eq=False)
class Terms:
    """Friction force of the block of a law in terms.

        F = dry(coulomb, stribeck, bristle) + viscous

    Attributes:
        law: with the symbols of the block as parameters.
        v, N: symbols of its inputs.
        force: all of it [N].
        dry: force [N] without viscous coefficients.
        viscous: the rest; None where there is none, or it cannot be separated.
        levels: dry levels among the parameters; empty where they cannot be separated.
        peaks: level of break-away -> the level in fast sliding.
    """

    law: Law
    v: ca.SX
    N: ca.SX
    force: ca.SX
    dry: ca.SX
    viscous: ca.SX | None
    levels: Variables
    peaks: Mapping[str, str]

    @property
    def names(self) -> tuple[str, ...]:
        """Terms that this law has, of `TERMS`."""
        viscous = () if self.viscous is None else ("viscous",)
        if self.dry.is_zero():
            return viscous
        if not self.levels:
            return ("force", *viscous)
        found = ["coulomb"]
        if self.peaks:
            found.append("stribeck")
        found += viscous
        if self.law.states:
            found.append("bristle")
        return tuple(found)

    def scaled(self, scales: Mapping[str, ca.SX | float]) -> ca.SX:
        """Return the force [N] with its terms scaled; terms that are not named are whole.

        A law without states gets scaled levels. One with states keeps them, and so the motion of
        its states: its dry force is scaled by the ratio of the Stribeck curves,

            F_dry g'(v)/g(v),   g' = N [s_c mu_d + s_s (mu_s - mu_d) fall(v)]
        """
        if not scales:
            return self.force
        dry = self.dry
        if "bristle" in scales:
            share = scales["bristle"]
            dry = share * dry + (1 - share) * self._steady()
        coulomb = scales.get("coulomb", 1.0)
        stribeck = scales.get("stribeck", coulomb if not self.peaks else 1.0)
        if "force" in scales:
            dry = scales["force"] * dry
        elif "coulomb" in scales or "stribeck" in scales:
            level = level_of(self.law, self.v) if self.law.states else None
            if level is not None and self.peaks:
                dry = dry * self._with_levels(level, coulomb, stribeck) / level
            elif self.law.states:
                dry = coulomb * dry
            else:
                dry = self._with_levels(dry, coulomb, stribeck)
        if self.viscous is None:
            return dry
        return dry + scales.get("viscous", 1.0) * self.viscous

    def one_sided(self, built: ca.SX) -> "Terms":
        """Return the terms with `built` times the sliding force of either side as dry friction.

        Raises:
            ValueError: a law that has no sliding force on one side of rest.
        """
        speed = ca.fabs(self.v)
        one = ca.SX(self.law.sliding(speed, self.N, 1))
        other = -ca.SX(self.law.sliding(-speed, self.N, -1))
        dry = built * (one if _same(one, other) else ca.if_else(built < 0, other, one))
        dry = _without_viscous(self.law, dry)
        force = dry if self.viscous is None else dry + self.viscous
        return replace(self, dry=dry, force=force)

    def _with_levels(
        self, expression: ca.SX, coulomb: ca.SX | float, stribeck: ca.SX | float
    ) -> ca.SX:
        symbols = {v.name: v.symbol for v in self.levels}
        values: list[ca.SX] = []
        for name, symbol in symbols.items():
            base = symbols[self.peaks[name]] if name in self.peaks else symbol
            rise = symbol - base if name in self.peaks else 0
            values.append(coulomb * base + stribeck * rise)
        return ca.substitute(expression, ca.vertcat(*symbols.values()), ca.vertcat(*values))

    def _steady(self) -> ca.SX:
        """Return the dry force after long sliding at the velocity [N]."""
        N = ca.fmax(self.N, LEAST)
        z = ca.SX(self.law.steady_state(self.v, N))
        return _without_viscous(self.law, ca.SX(self.law.force(self.v, N, z)))


def level_of(law: Law, v: ca.SX) -> ca.SX | None:
    """Return the Stribeck curve g(v) > 0 under 1 N that a law with states tends to, if it has one.

    Only ratios of it count, which do not depend on the load.
    """
    if isinstance(law, Wrapper):
        return level_of(law.inner_at(v), v)
    return ca.SX(law.level(v, 1.0)) if isinstance(law, Bristle | GMS) else None


def terms(law: Law, block: Block) -> Terms:
    """Return the terms of the `F` of `block`, the block of `law`."""
    known = parameters(law)
    own = {v.name: v for v in block.parameters if v.name in known}
    v, N = (x.symbol for x in block.inputs[:2])
    force = ca.SX(block.outputs["F"].expression)
    viscous, dry = None, force
    sigma = ca.veccat(*(own[n].symbol for n in own if known[n].role == "viscous"))
    if sigma.numel() and ca.depends_on(force, sigma):
        slope = ca.jacobian(force, sigma)
        if not ca.depends_on(slope, sigma):
            viscous = slope @ sigma
            dry = ca.substitute(force, sigma, ca.DM.zeros(sigma.numel()))
    levels = tuple(own[n] for n in own if known[n].role == "level")
    peaks = _peaks({v.name for v in levels})
    symbolic = with_values(law, {name: variable.symbol for name, variable in own.items()})
    if law.states:
        if peaks and level_of(symbolic, v) is None:
            peaks = {}
    elif not _made_of(dry, levels, block):
        levels, peaks = (), {}
    return Terms(
        law=symbolic, v=v, N=N, force=force, dry=dry, viscous=viscous, levels=levels, peaks=peaks
    )


def _without_viscous(law: Law, force: ca.SX) -> ca.SX:
    """Return the force with viscous coefficients of zero, where they are symbols."""
    values = [p.value for p in parameters(law).values() if p.role == "viscous"]
    symbols = ca.veccat(*(ca.SX(value) for value in values if is_symbolic(value)))
    return ca.substitute(force, symbols, ca.DM.zeros(symbols.numel())) if values else force


def _same(a: ca.SX, b: ca.SX) -> bool:
    """Return True if both are the same function, by values for random symbols."""
    symbols = ca.symvar(ca.vertcat(a, b))
    look = ca.Function("both", [ca.vertcat(*symbols)], [a, b])
    points = np.random.default_rng(0).uniform(0.1, 2.0, (4, len(symbols)))
    pairs = [[float(value) for value in look(point)] for point in points]
    return all(abs(x - y) <= 1e-12 * abs(x) for x, y in pairs)


def _peaks(names: set[str]) -> dict[str, str]:
    """Levels of break-away and the levels in fast sliding that they fall to."""
    pairs = {name: name.replace("mu_s", "mu_d", 1) for name in names if "mu_s" in name}
    return {peak: base for peak, base in pairs.items() if base in names}


def _made_of(dry: ca.SX, levels: Variables, block: Block) -> bool:
    """Return True if the dry force is a sum of levels, each times a function of the velocity."""
    if not levels:
        return False
    symbols = ca.vertcat(*(v.symbol for v in levels))
    slope = ca.jacobian(dry, symbols)
    if ca.depends_on(slope, symbols):
        return False
    rest = ca.substitute(dry, symbols, ca.DM.zeros(symbols.numel()))
    others = (*block.inputs, *(v for v in block.parameters if v not in levels))
    look = ca.Function("rest", [ca.vertcat(*(v.symbol for v in others))], [rest])
    random = np.random.default_rng(0)
    scale = np.array([v.nominal for v in block.inputs])
    fixed = np.array([float(v.start) for v in others[len(block.inputs) :]])
    points = [np.append(scale * random.uniform(0.01, 2.0, scale.size), fixed) for _ in range(8)]
    return all(float(look(point)) == 0.0 for point in points)


@final
class Parts:
    """Variables of a block that stages have brought so far.

    Attributes:
        states, inputs, parameters: as in `Block`.
        next: the states after the step.
    """

    def __init__(
        self, states: Variables = (), inputs: Variables = (), parameters: Variables = ()
    ) -> None:
        self.states, self.inputs, self.parameters = [*states], [*inputs], [*parameters]
        self.next: list[ca.SX] = []

    def state(self, name: str, unit: str, doc: str, nominal: float = 1.0) -> ca.SX:
        """Add a state; the caller appends its next value to `next`."""
        variable = Variable(self._free(name), unit, nominal=nominal, doc=doc)
        self.states.append(variable)
        return variable.symbol

    def given(
        self,
        name: str,
        unit: str,
        doc: str,
        nominal: float = 1.0,
        lower: float = -inf,
        upper: float = inf,
    ) -> ca.SX:
        """Return the input of that name, added if there is none."""
        for known in self.inputs:
            if known.name == name:
                return known.symbol
        variable = Variable(name, unit, nominal=nominal, doc=doc, lower=lower, upper=upper)
        self.inputs.append(variable)
        return variable.symbol

    def parameter(self, name: str, start: float, unit: str, doc: str, lower: float = 0.0) -> ca.SX:
        """Add a parameter; one whose name a law has gets a number."""
        variable = Variable(
            self._free(name), unit, start=start, nominal=abs(start) or 1.0, lower=lower, doc=doc
        )
        self.parameters.append(variable)
        return variable.symbol

    def _free(self, name: str) -> str:
        taken = {v.name for v in (*self.states, *self.inputs, *self.parameters)}
        return next(n for n in (name, *(f"{name}_{k}" for k in range(2, 100))) if n not in taken)


def blended(parts: Parts, wanted: ca.SX, v: ca.SX, v_blend: float) -> ca.SX:
    """Return the desired velocity near zero of the measured one, beyond 2 v_blend the measured
    one, C2.
    """
    width = parts.parameter(
        "v_blend", v_blend, "m/s", "up to here the desired velocity, beyond twice it the measured",
        lower=1e-12,
    )  # fmt: skip
    share = smooth.step5(ca.fabs(v) / width - 1)
    # each exactly at its end, whatever the other is
    return ca.SX(share * v + (1 - share) * wanted)


def beyond_dead_zone(parts: Parts, v: ca.SX, dead_zone: float) -> ca.SX:
    """Return the velocity less what lies within +-dead_zone, continuous: 0 inside."""
    width = parts.parameter("v_dead", dead_zone, "m/s", "velocities up to here count as rest")
    return ca.SX(v - smooth.clip(v, -width, width))


def built_up(
    parts: Parts, v: ca.SX, h: ca.SX | float, distance: float, table: Sequence[tuple[float, float]]
) -> ca.SX:
    """Return the share b in [-1, 1] of sliding friction that has built up, its mean over the step.

    b+ = b + 2 v h / distance, held within +-1: linear in the way since the reversal, and by the
    table, if there is one, bent. What a shorter way back leaves stays, as in a Maxwell element.
    """
    way = parts.parameter(
        "d_build", distance, "m", "way after a reversal until friction has built up", lower=1e-15
    )
    b = parts.state("built", "1", "share of friction that has built up, -1 to 1")
    end = ca.SX(smooth.clip(b + 2 * v * h / way, -1.0, 1.0))
    mean = (b + end) / 2
    if table:
        mean = 2 * _interpolated(table, (1 + mean) / 2) - 1
    parts.next.append(end)
    return mean


def _interpolated(table: Sequence[tuple[float, float]], s: ca.SX) -> ca.SX:
    """Straight lines through the points."""
    f = ca.SX(table[0][1])
    for (a, low), (b, high) in pairwise(table):
        f += (high - low) * smooth.clip((s - a) / (b - a), 0.0, 1.0)
    return f


def freed(
    parts: Parts, wanted: ca.SX, v: ca.SX, h: ca.SX | float, force: float, time: float, rest: float
) -> ca.SX:
    """Return a further force that grows while the desired velocity moves and the axis does not.

    Its share q in [-1, 1] goes with the pace 1/t_stick towards sign(v_ref) while |v| is below
    v_stick and |v_ref| beyond 2 v_stick, and towards 0 where |v| is beyond 2 v_stick or |v_ref|
    below v_stick, with straight lines in between.
    """
    most = parts.parameter("F_stick", force, "N", "further force while the axis sticks")
    pace = parts.parameter(
        "t_stick", time, "s", "time over which that force comes and goes", lower=1e-9
    )
    slow = parts.parameter(
        "v_stick", rest, "m/s", "slower than this is rest, twice as fast is motion", lower=1e-12
    )
    q = parts.state("stuck", "1", "share of the further force, -1 to 1")
    rests = smooth.clip(2 - ca.fabs(v) / slow, 0.0, 1.0)
    moves = smooth.clip(ca.fabs(wanted) / slow - 1, 0.0, 1.0)
    goal = ca.sign(wanted) * moves * rests
    end = q + smooth.clip(goal - q, -h / pace, h / pace)
    parts.next.append(ca.SX(end))
    return ca.SX(most * end)


def dithered(parts: Parts, h: ca.SX | float, force: float, frequency: float) -> ca.SX:
    """Return a sine of a force and frequency of its own."""
    amplitude = parts.parameter("F_dither", force, "N", "amplitude of the dither")
    pace = parts.parameter("f_dither", frequency, "Hz", "frequency of the dither")
    phase = parts.state("phase", "1", "turns of the dither, 0 to 1")
    end = smooth.fraction(phase + pace * h)
    parts.next.append(ca.SX(end))
    return ca.SX(amplitude * ca.sin(2 * ca.pi * end))


def ramped(parts: Parts, F: ca.SX, h: ca.SX | float, time: float) -> ca.SX:
    """F in and out without a bump: over t_ramp, C1, while `enable` is above and below 1/2."""
    on = parts.given("enable", "1", "above 0.5: on", lower=0.0, upper=1.0)
    duration = parts.parameter("t_ramp", time, "s", "time of fading in or out", lower=1e-9)
    e = parts.state("faded_in", "1", "0: off, 1: on")
    end = ca.SX(smooth.clip(e + ca.if_else(on > 0.5, h, -h) / duration, 0.0, 1.0))
    parts.next.append(end)
    return F * smooth.step3(end)


def limited(parts: Parts, F: ca.SX, limit: float) -> ca.SX:
    """F within +-F_max."""
    most = parts.parameter("F_max", limit, "N", "largest force that is added")
    return ca.SX(smooth.clip(F, -most, most))


def slowed(parts: Parts, F: ca.SX, h: ca.SX | float, slew: float) -> ca.SX:
    """F that changes by no more than F_rate h a step."""
    rate = parts.parameter("F_rate", slew, "N/s", "fastest change of the force")
    last = parts.state("F_last", "N", "force of the step before")
    end = ca.SX(last + smooth.clip(F - last, -rate * h, rate * h))
    parts.next.append(end)
    return end
