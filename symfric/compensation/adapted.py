"""Friction as a function of its estimated parameters, and the common parts of estimators."""

from collections.abc import Mapping
from dataclasses import replace
from math import isfinite
from typing import Any, final

import casadi as ca
import numpy as np

from symfric.codegen import Block, law_block
from symfric.codegen.blocks.from_law import in_turning
from symfric.codegen.blocks.variables import arranged, step_size
from symfric.compensation.force import TABLES, Parts, terms, within_load
from symfric.compensation.settings import (
    FALLEN,
    SAMPLES,
    SHARES,
    SLIDING,
    Adaptation,
    chosen_adaptation,
    estimated,
    scale_parameters,
)
from symfric.foundation import checks
from symfric.foundation.parameters import Variable, parameters
from symfric.foundation.variable import starts_of, symbols_of
from symfric.laws import Law, law_name
from symfric.laws.base import smooth
from symfric.laws.base.law import require_law
from symfric.model import Output
from symfric.scenes import Drive

TEXTS: dict[str, Any] = TABLES["estimators"]
"""Texts of the headers of estimators."""
SEEN = 0.25
"""Variance relative to that of the spread, below which the data determine a parameter."""
FAR = 1e29
"""Size of a state without a bound in a test with 1e30."""
BOUNDLESS = 1e3
"""Default limit of valid forces, relative to the level of the law."""


@final
class Adapted:
    """Friction with estimated parameters, to which an estimator adds its states.

    Attributes:
        where: beginning of messages.
        parts: variables of the block.
        v: symbol of the measured velocity.
        z: symbols of the states of the law; `block` replaces them by their values within bounds.
        theta: estimated parameters; `nominal` is the spread.
        names: names of `theta`.
        force: friction plus offset [N], an expression of v, z and the symbols of `theta`.
        after: states of the law after the step.
        level: force of the law at rest [N].
        h: step size [s].
        mass: moving mass [kg], a parameter; not used if it is estimated.
        memory, change: parameters t_memory and t_change [s].
        reach: largest states of the law under the load, else their nominal values.
    """

    def __init__(
        self,
        where: str,
        law: Law | Drive,
        settings: Adaptation | None,
        chosen: Mapping[str, Any],
        h: float | None,
        turning: bool,
        end: bool = False,
    ) -> None:
        """Take the force of the law with the scales of a compensator.

        Args:
            end: True for the force at the end of the step, False for its mean.
        """
        self._s = s = chosen_adaptation(where, settings, chosen)
        normal, mass, offset = 1.0, s.mass, 0.0
        if isinstance(law, Drive):
            normal, offset, turning = float(law.N), float(law.offset), turning or law.turning
            law, mass = law.law, float(law.m) if mass is None else mass
        require_law(where, law)
        self.where, self._turning = f"{where} '{law_name(law)}'", turning
        if mass is None:
            raise checks.refused(f"{self.where}: mass", "the moving mass [kg]", None, "or a Drive")
        inner = law_block(law, h=h if law.states else None)
        if len(inner.inputs) > 2:
            names = ", ".join(v.name for v in inner.inputs[2:])
            raise ValueError(f"{self.where}: expected a law of v and N, got one with {names}")
        if end and "F_end" in inner.outputs:
            inner = replace(inner, outputs={"F": inner.outputs["F_end"]})
        self._inner, size, self.parts = inner, step_size(where, h, inner), Parts(inner)
        self.h, self._sizes, found = size.h, size.parameters, terms(law, inner)
        own = {p.name: p for p in self.parts.parameters}
        self.level, scale = _level(law, normal), float(law.velocity_scale)
        self._slow = scale if isfinite(scale) else 0.0
        scales = scale_parameters([n for n in found.names if n != "bristle"], offset, mass)
        self.theta = estimated(self.where, s, scales | own, self.level, _idle(law, inner))
        self.names = [p.name for p in self.theta]
        symbols = {p.name: p.symbol for p in self.theta}
        used = {n: symbols[f"scale_{n}"] for n in found.names if f"scale_{n}" in symbols}
        if "coulomb" in used and "stribeck" in found.names:
            used.setdefault("stribeck", used["coulomb"])
        self.parts.parameters = [p for p in self.parts.parameters if p.name not in symbols]
        self.v, self.z = found.v, symbols_of(inner.states)
        load = self.parts.parameter("N", normal)
        self._held = within_load(found.law, self.z, load) if inner.states else self.z
        given = [n for n in own if n in symbols]
        old = ca.vertcat(found.N, *(own[n].symbol for n in given))
        new = ca.vertcat(load, *(symbols[n] for n in given))
        force, self.after = ca.substitute([found.scaled(used), ca.SX(inner.next)], [old], [new])
        every = (*self.parts.parameters, *self.theta)
        most = ca.vertcat(1e30 * ca.DM.ones(self.z.shape), starts_of(every))
        most = ca.evalf(ca.substitute(self._held, ca.vertcat(self.z, symbols_of(every)), most))
        usual = [v.nominal for v in inner.states]
        self.reach = [x if x < FAR else y for x, y in zip(most.nonzeros(), usual, strict=True)]
        self.force = force + symbols.get("offset", self.parts.parameter("offset", offset))
        self.mass, self._mass = self.parts.parameter("inertia", mass), mass
        memory = SHARES["memory"] * s.change if s.memory is None else s.memory
        self.memory = self.parts.parameter("t_memory", memory)
        self.change = self.parts.parameter("t_change", s.change)
        self._next = dict[str, ca.SX]()
        seen: dict[str, Any] = {"nominal": 0.1, "doc": "measured velocity"}
        self.parts.inputs = [replace(v, **seen) for v in inner.inputs[:1]]
        self.follow(self.z, self.after)

    def states(self, *names: str) -> list[ca.SX]:
        """Add states of `variables.toml` and return their symbols."""
        return [self.parts.state(name) for name in names]

    def add(self, *variables: Variable) -> ca.SX:
        """Add states and return their symbols as a column."""
        self.parts.states += variables
        return symbols_of(variables)

    def follow(self, states: ca.SX, values: ca.SX) -> None:
        """Set the values of states after the step."""
        pairs = zip(ca.vertsplit(states), ca.vertsplit(ca.densify(values)), strict=True)
        self._next |= {state.name(): value for state, value in pairs if state.numel()}

    def estimates(self) -> tuple[ca.SX, ca.SX, ca.SX]:
        """Add the estimates; return their symbols, their values within bounds, and spreads."""
        columns: list[list[ca.SX]] = []
        for p in self.theta:
            unit, scale = p.unit, p.nominal
            least = 0.0 if p.lower >= 0.0 else -np.inf
            own = (
                Variable(f"{p.name}_spread", unit, start=scale, nominal=scale,
                         lower=1e-6 * scale, doc="standard deviation of changes"),
                Variable(f"{p.name}_low", unit, start=p.lower, nominal=scale, lower=least,
                         doc="lowest estimate"),
                Variable(f"{p.name}_high", unit, start=p.upper, nominal=scale, lower=least,
                         doc="highest estimate"),
            )  # fmt: skip
            self.parts.parameters += own
            columns.append([v.symbol for v in own])
        spread, low, high = (ca.vertcat(*column) for column in zip(*columns, strict=True))
        states = self.add(
            *(Variable(f"{p.name}_now", p.unit, start=p.start, nominal=p.nominal, doc="estimate")
              for p in self.theta)
        )  # fmt: skip
        self._bounds, self.spread = (low, high), spread
        return states, self.within(states), spread

    def within(self, theta: ca.SX) -> ca.SX:
        """Return values within the bounds of the estimates."""
        return ca.SX(smooth.clip(theta, *self._bounds))

    def noises(self) -> tuple[ca.SX, ca.SX, ca.SX]:
        """Add parameters, and return noise_v [m/s], noise_F [N] and t_window [s]."""
        s, noise = self._s, self._s.noise or 0.0
        accuracy = SHARES["accuracy"] * self.level if s.accuracy is None else s.accuracy
        step = float(next((v.start for v in self._sizes), self.h))
        usual = max(SAMPLES * step, 2 * self._mass * noise / accuracy)
        window = self.parts.parameter("t_window", usual if s.window is None else s.window)
        return (
            self.parts.parameter("noise_v", noise),
            self.parts.parameter("noise_F", accuracy),
            window,
        )

    def usable(self) -> ca.SX:
        """Return the condition that the present sample may change the estimates."""
        s = self._s
        least = max(SLIDING * (s.noise or 0.0), FALLEN * self._slow)
        least = least if s.slowest is None else s.slowest
        most = BOUNDLESS * self.level if s.valid is None else s.valid
        slides = ca.fabs(self.v) >= self.parts.parameter("v_least", least)
        valid = ca.fabs(self.parts.given("force")) < self.parts.parameter("F_valid", most)
        return ca.SX(ca.logic_and(ca.logic_and(slides, valid), self.parts.given("learn") > 0.5))

    def block(
        self, name: str, kind: str, now: ca.SX, deviation: ca.SX, variance: ca.SX,
        **more: Output,
    ) -> Block:  # fmt: skip
        """Return the finished block.

        Args:
            kind: "recursive" or "kalman", for the texts.
            now, deviation: estimates and their deviations.
            variance: variances relative to the squares of the spreads.
            more: further outputs.
        """
        found = {p.name: Output(now[i], p.unit, p.doc) for i, p in enumerate(self.theta)}
        for i, p in enumerate(self.theta):
            found[f"{p.name}_sd"] = Output(deviation[i], p.unit, f"deviation of {p.name}")
        unseen = ca.dot(variance > SEEN, ca.DM([2.0**i for i in range(len(self.theta))]))
        found |= {"unseen": Output(unseen, "1", "sum of 2^k of undetermined estimates"), **more}
        parts, inner = self.parts, self._inner
        parts.inputs.sort(key=lambda v: [*TABLES["inputs"]].index(v.name))
        results = [self._next[v.name] for v in parts.states]
        results += [ca.SX(o.expression) for o in found.values()]
        everything = ca.substitute(ca.vertcat(*results), self.z, self._held)
        results = ca.vertsplit(everything)
        parts.next = results[: len(parts.states)]
        pairs = zip(found.items(), results[len(parts.states) :], strict=True)
        found = {n: replace(o, expression=e) for (n, o), e in pairs}
        parts.parameters = [p for p in parts.parameters if ca.depends_on(everything, p.symbol)]
        block = Block(
            checks.identifier(f"{self.where}: name", name),
            doc=f"{TEXTS[kind]['doc']} {inner.doc}",
            equations=f"{TEXTS[kind]['equations'].strip()}\n\n{inner.equations}",
            sources=(TEXTS["source"], *inner.sources), use=(*TEXTS["use"],),
            limits=(*TEXTS["limits"], *inner.limits),
            constants=dict(inner.constants) | ({} if self._sizes else {"h": float(self.h)}),
            about=inner.about, outputs=found, **parts.variables(self._sizes),
        )  # fmt: skip
        return in_turning(arranged(block)) if self._turning else arranged(block)


def _idle(law: Law, inner: Block) -> list[str]:
    """Return the parameters that have no effect: those of absent terms, and scales of zero."""
    own = [p for p in inner.parameters if not ca.depends_on(inner.everything, p.symbol)]
    viscous = [float(p.value) for p in parameters(law).values() if p.role == "viscous"]
    return [p.name for p in own] + ["scale_viscous"] * (not any(viscous))


def _level(law: Law, N: float) -> float:
    """Return the force of the law at rest, or in sliding at 0.1 m/s [N]."""
    try:
        found = float(law.static_level(N))
    except ValueError:
        found = float(ca.DM(ca.SX(law.force(0.1, N, law.steady_state(0.1, N)))))
    return abs(found) or 1.0
