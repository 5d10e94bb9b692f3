"""Terms of the friction force of a law, and variables of blocks that are built in stages.

A stage adds its states, inputs and parameters to the `Parts` of the block, and returns the
modified force or velocity; the C contains only the chosen stages.
"""

import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple, final

import casadi as ca
import numpy as np

from symfric.codegen import Block
from symfric.foundation import checks
from symfric.foundation.numeric import is_symbolic
from symfric.foundation.parameters import Variable, parameters, with_values
from symfric.foundation.variable import stacked, symbols_of
from symfric.laws import GMS, Law
from symfric.laws.base import smooth
from symfric.laws.composed.wrap import Wrapper
from symfric.laws.dynamic.lugre import Bristle
from symfric.model import Variables

TABLES: dict[str, dict[str, Any]] = tomllib.loads(
    Path(__file__).with_name("variables.toml").read_text(encoding="utf-8")
)
"""Terms, variables and settings of compensators and observers."""

TERMS: dict[str, str] = TABLES["terms"]
"""Terms of friction that can be scaled separately."""

LIMITED = (
    "F is within +-F_max for all bits of states, inputs and parameters, also while it fades and at "
    "once after F_max is lowered. F_max outside its range is replaced by its default."
)
LEAST = 1e-9
"""Smallest load [N] of laws with states, which divide by the load."""


class Terms(NamedTuple):
    """Friction force of the block of a law, divided into terms.

        F = dry(coulomb, stribeck, bristle) + viscous

    Attributes:
        law: the law with the symbols of the block as parameters.
        v, N: symbols of the inputs.
        force: total force [N].
        dry: force without viscous coefficients [N].
        viscous: viscous force [N]; None if absent or inseparable.
        levels: dry levels among the parameters; empty if inseparable.
        peaks: level of break-away -> level in fast sliding.
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
        """Names of the terms of this law, a subset of `TERMS`."""
        viscous = ("viscous",) * (self.viscous is not None)
        if self.dry.is_zero():
            return viscous
        if not self.levels:
            return ("force", *viscous)
        stribeck, bristle = bool(self.peaks), bool(self.law.states)
        return ("coulomb", *("stribeck",) * stribeck, *viscous, *("bristle",) * bristle)

    def scaled(self, scales: Mapping[str, ca.SX | float]) -> ca.SX:
        """Return the force [N] with scaled terms; the scale of other terms is 1.

        In a law without states, the levels are scaled. In a law with states they are not, to keep
        the motion of the states; the ratio of the Stribeck curves scales the dry force,

            F_dry g'(v)/g(v),   g' = N [s_c mu_d + s_s (mu_s - mu_d) fall(v)]
        """
        if not scales:
            return self.force
        dry = self.dry
        if "bristle" in scales:
            share = scales["bristle"]
            dry = share * dry + (1 - share) * self._steady()
        coulomb = scales.get("coulomb", 1.0)
        stribeck = scales.get("stribeck", 1.0 if self.peaks else coulomb)
        level = level_of(self.law, self.v) if self.law.states else None
        if "force" in scales:
            dry = scales["force"] * dry
        elif not {"coulomb", "stribeck"} & {*scales}:
            pass
        elif level is not None and self.peaks:
            dry = dry * self._with_levels(level, coulomb, stribeck) / level
        elif self.law.states:
            dry = coulomb * dry
        else:
            dry = self._with_levels(dry, coulomb, stribeck)
        if self.viscous is None:
            return dry
        return dry + scales.get("viscous", 1.0) * self.viscous

    def one_sided(self, built: ca.SX) -> "Terms":
        """Return the terms with `built` times the sliding force of its direction as dry friction.

        Raises:
            ValueError: the law has no sliding force on one side of rest.
        """
        speed = ca.fabs(self.v)
        one = ca.SX(self.law.sliding(speed, self.N, 1))
        other = -ca.SX(self.law.sliding(-speed, self.N, -1))
        dry = built * (one if _same(one, other) else ca.if_else(built < 0, other, one))
        dry = _without_viscous(self.law, dry)
        force = dry if self.viscous is None else dry + self.viscous
        return self._replace(dry=dry, force=force)

    def _with_levels(
        self, expression: ca.SX, coulomb: ca.SX | float, stribeck: ca.SX | float
    ) -> ca.SX:
        symbols = {v.name: v.symbol for v in self.levels}
        values: list[ca.SX] = []
        for name, symbol in symbols.items():
            base = symbols[self.peaks.get(name, name)]
            values.append(coulomb * base + stribeck * (symbol - base if name in self.peaks else 0))
        return ca.substitute(expression, stacked(symbols.values()), stacked(values))

    def _steady(self) -> ca.SX:
        """Return the dry force [N] after long sliding at the velocity v."""
        N = ca.fmax(self.N, LEAST)
        z = ca.SX(self.law.steady_state(self.v, N))
        return _without_viscous(self.law, ca.SX(self.law.force(self.v, N, z)))


def level_of(law: Law, v: ca.SX) -> ca.SX | None:
    """Return the Stribeck curve g(v) > 0 of a law with states under 1 N; None if it has none.

    Only ratios of the curve are used, which do not depend on the load.
    """
    if isinstance(law, Wrapper):
        return level_of(law.inner_at(v), v)
    return ca.SX(law.level(v, 1.0)) if isinstance(law, Bristle | GMS) else None


def terms(law: Law, block: Block) -> Terms:
    """Return the terms of the output `F` of `block`, the block of `law`."""
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
    names = [v.name for v in levels]
    peaks = {name: name.replace("mu_s", "mu_d", 1) for name in names if "mu_s" in name}
    peaks = {peak: base for peak, base in peaks.items() if base in names}
    symbolic = with_values(law, {name: variable.symbol for name, variable in own.items()})
    if law.states:
        if peaks and level_of(symbolic, v) is None:
            peaks = {}
    elif not _made_of(dry, levels, block):
        levels, peaks = (), {}
    return Terms(symbolic, v, N, force, dry, viscous, levels, peaks)


def _without_viscous(law: Law, force: ca.SX) -> ca.SX:
    """Return the force with the viscous coefficients that are symbols set to zero."""
    values = [p.value for p in parameters(law).values() if p.role == "viscous"]
    symbols = ca.veccat(*(ca.SX(value) for value in values if is_symbolic(value)))
    return ca.substitute(force, symbols, ca.DM.zeros(symbols.numel())) if values else force


def _same(a: ca.SX, b: ca.SX) -> bool:
    """Return True if both expressions have the same values at random points."""
    symbols = ca.symvar(ca.vertcat(a, b))
    look = ca.Function("both", [ca.vertcat(*symbols)], [a, b])
    points = np.random.default_rng(0).uniform(0.1, 2.0, (4, len(symbols)))
    pairs = [[float(value) for value in look(point)] for point in points]
    return all(abs(x - y) <= 1e-12 * abs(x) for x, y in pairs)


def _made_of(dry: ca.SX, levels: Variables, block: Block) -> bool:
    """Return True if the dry force is a sum of levels times functions of the velocity."""
    if not levels:
        return False
    symbols = symbols_of(levels)
    if ca.depends_on(ca.jacobian(dry, symbols), symbols):
        return False
    rest = ca.substitute(dry, symbols, ca.DM.zeros(symbols.numel()))
    others = (*block.inputs, *(v for v in block.parameters if v not in levels))
    look = ca.Function("rest", [symbols_of(others)], [rest])
    random = np.random.default_rng(0)
    scale = np.array([v.nominal for v in block.inputs])
    fixed = np.array([float(v.start) for v in others[len(block.inputs) :]])
    points = [np.append(scale * random.uniform(0.01, 2.0, scale.size), fixed) for _ in range(8)]
    return all(float(look(point)) == 0.0 for point in points)


PARAMETERS: dict[str, Any] = TABLES["parameters"] | {
    f"scale_{term}": {"unit": "1", "doc": f"scale: {doc}"} for term, doc in TERMS.items()
}


@final
class Parts:
    """Variables of a block, to which each stage adds its own variables.

    Attributes:
        states, inputs, parameters: variables as in `Block`.
        next: states after the step.
        derived: expressions of signals that are not inputs, by name.
    """

    def __init__(self, inner: Block | None = None, v: Variable | None = None) -> None:
        """Begin with the states and parameters of the block of a law, and with an input `v`."""
        self.states = [*inner.states] if inner else []
        self.parameters = [p for p in inner.parameters if p.name != "h"] if inner else []
        self.inputs, self.next = [v] if v else [], list[ca.SX]()
        self.derived = dict[str, ca.SX]()

    def state(self, name: str) -> ca.SX:
        """Add a state and return its symbol; the caller appends its next value to `next`."""
        return self._added(self.states, Variable(self._free(name), **TABLES["states"][name]))

    def given(self, name: str) -> ca.SX:
        """Return the symbol of an input, or its expression; add the input at its first use."""
        if name in self.derived:
            return self.derived[name]
        if name not in [v.name for v in self.inputs]:
            self.inputs.append(Variable(name, **TABLES["inputs"][name]))
        return next(v.symbol for v in self.inputs if v.name == name)

    def parameter(self, name: str, start: float) -> ca.SX:
        """Add a parameter and return its symbol; a number is appended to a name in use."""
        row = {"lower": 0.0, "nominal": abs(start) or 1.0} | PARAMETERS[name]
        return self._added(self.parameters, Variable(self._free(name), start=start, **row))

    def _added(self, group: list[Variable], variable: Variable) -> ca.SX:
        group.append(variable)
        return variable.symbol

    def _free(self, name: str) -> str:
        taken = {v.name for v in (*self.states, *self.inputs, *self.parameters)}
        return next(n for n in (name, *(f"{name}_{k}" for k in range(2, 100))) if n not in taken)

    def variables(self, sizes: Variables) -> dict[str, Any]:
        """Return the variables as fields of a `Block`, with the parameters `sizes` at the end."""
        return {
            "states": tuple(self.states),
            "inputs": tuple(self.inputs),
            "parameters": (*self.parameters, *sizes),
            "next": stacked(self.next),
        }


def finished(
    parts: Parts,
    force: ca.SX,
    ramp: float | None,
    limit: float | None,
    h: ca.SX | float,
    where: str,
    slew: float | None = None,
    amperes: Callable[[ca.SX], ca.SX] | None = None,
) -> ca.SX:
    """Return the force with fading by `enable`, a limit of its rate, and last a limit.

    The force fades in (C1) over t_ramp while `enable` is above 1/2. It changes by at most F_rate h
    per step, and stays within +-F_max for all values of states, inputs and other parameters.

    Args:
        ramp, limit, slew: time [s], largest force [N] and rate [N/s]; None if not chosen.
        amperes: function of the force to the current that is then limited, by i_max [A] and i_rate
            [A/s]; `limit` and `slew` are in these units.
    """
    letter = "F" if amperes is None else "i"
    if ramp is not None:
        checks.number(f"{where}: ramp", ramp, unit="s", above=0.0)
        on = parts.given("enable")
        duration, e = parts.parameter("t_ramp", ramp), parts.state("faded_in")
        end = ca.SX(smooth.clip(e + ca.if_else(on > 0.5, h, -h) / duration, 0.0, 1.0))
        parts.next.append(end)
        force = force * smooth.step3(end)
    if amperes is not None:
        force = amperes(force)
    if slew is not None:
        rate, last = parts.parameter(f"{letter}_rate", slew), parts.state(f"{letter}_last")
        force = ca.SX(last + smooth.clip(force - last, -rate * h, rate * h))
    if limit is not None:
        checks.number(f"{where}: limit", limit, unit="N", lower=0.0)
        most = parts.parameter(f"{letter}_max", limit)
        force = ca.SX(smooth.clip(force, -most, most))
    if slew is not None:
        parts.next.append(force)
    return force


def within_load(law: Law, z: ca.SX, N: ca.SX) -> ca.SX:
    """Return the states z, limited to deflections that the load N can hold.

        |z_i| <= 1.001 most_held(N) / |dF/dz_i|   at v = 0

    The margin leaves rounding errors of states at the limit unchanged. After a memory error or a
    fall of the load, each state then causes at most the force of stiction. A state is not limited
    if its slope depends on the states or is zero, or if the law has no known level.
    """
    v = ca.SX(0)
    slopes = ca.densify(ca.jacobian(law.force(v, N, z), z))
    try:
        most = 1.001 * ca.SX(law.most_held(N))
    except ValueError:
        return z
    limited = list[ca.SX]()
    for i, slope in enumerate(ca.horzsplit(slopes)):
        if slope.is_zero() or ca.depends_on(slope, z):
            limited.append(z[i])
        else:
            limited.append(ca.SX(smooth.clip(z[i], -most / slope, most / slope)))
    return ca.vertcat(*limited)
