"""An optimal control problem, and nominal values from its ends and bounds.

Solvers see unknowns and costs over their typical magnitudes. A `nominal` of 1 is what a variable
has that was given none: far from the wanted values it is taken from these, and so is one that is
far above them. States have that of their ends, of points on the way and of bounds; others follow by
the equations,

    |x_i| / T ~ |d x_i' / d x_j| |x_j|     |x_i| / T ~ |d x_i' / d u_j| |u_j|
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from importlib import import_module
from math import isfinite
from typing import Any, Literal, final

import casadi as ca
import numpy as np

from ocp.formulation.bounds import Free, Range, as_box
from ocp.formulation.expressions import arguments
from ocp.formulation.phase import Chain, Span
from ocp.formulation.resolve import function_problems, resolved
from ocp.formulation.statement import (
    Choice,
    Statement,
    chosen_of,
    rate_name,
    rebuilt,
    settings_of,
)
from ocp.formulation.validate import input_problems, kind_problems
from symfric.foundation.variable import Variable
from symfric.model import Model

FAR = 100.0
"""Factor between a size and 1 from which on it counts."""
UNSAID = 1.0
"""The nominal value of a variable that was given none."""

Sizes = Mapping[str, float]


@final
@dataclass(frozen=True, eq=False)
class Problem(Statement):
    """Minimise a cost over the motion of one or several phases.

        min J   subject to   x' = ode(t, x, z, u, p),  0 = alg(t, x, z, u, p)   in every phase,
                             ends, bounds, path conditions, links between phases

    `bounds`, `rates`, `path` and `p` hold in every phase that has the names; what a phase says
    itself wins. Everything is bound to names, so that one text serves several models.

    Attributes:
        phases: a `Phase`, or several: `out >> back`.
        cost: a sum of `integral(...)` over all phases, `at_end(...)` of the last one, `TIME`,
            `track(...)` and `effort(...)`; with scenarios their mean, or `worst(...)`.
        bounds, rates, path, p: as in `Phase`.
        choose: parameter -> (lower, upper) or (lower, upper, guess): chosen with the motion, the
            same in all phases and scenarios.
        periodic: states that end the last phase as they start the first; their start is free
            unless `start` names it.
        scenarios: name -> values of parameters; the motion is computed for each of them.
        shared: inputs that are the same in all scenarios; by default all. Free durations are, too.
        durations: ((0, 1), 2.0): the durations of these phases add up to 2 s; or to a `Free`.

    Raises:
        ValueError: all problems at once.
    """

    def __post_init__(self) -> None:
        # Each look asks only what the ones before have left in order.
        self._refuse(kind_problems(self))
        self._refuse((*input_problems(self), *function_problems(self)))
        self._refuse(self._resolved[1])

    def _refuse(self, texts: Iterable[str]) -> None:
        problems = [text for text in dict.fromkeys(texts) if text]
        if problems:
            raise ValueError(f"problem '{self.name}': " + "; ".join(problems))

    @cached_property
    def spans(self) -> tuple[Span, ...]:
        """The resolved phases, for one scenario after the other."""
        return self._resolved[0]

    @cached_property
    def _resolved(self) -> tuple[tuple[Span, ...], list[str]]:
        return resolved(self)

    @property
    def scenario_names(self) -> tuple[str, ...]:
        """Names of the scenarios, none where there is one motion only."""
        return tuple(self.scenarios)

    @cached_property
    def chosen(self) -> tuple[Choice, ...]:
        """Parameters chosen with the motion: name, bounds, guess."""
        return chosen_of(self, settings_of(self))

    @property
    def kind(self) -> Literal["sum", "mean", "worst"]:
        """How the costs of the spans make one; mean and worst are over the sums of scenarios."""
        if len(self.scenarios) < 2:
            return "sum"
        return "worst" if self.cost is not None and self.cost.largest else "mean"

    @cached_property
    def shared_inputs(self) -> tuple[str, ...]:
        """Inputs of the models of the spans that are equal in all scenarios.

        Of an input with bounded rate these are its rate, and its state; see `shared_starts`.
        """
        inputs = list(dict.fromkeys(v.name for span in self.spans for v in span.model.u))
        if self.shared is None:
            return tuple(inputs)
        wanted = {*self.shared, *map(rate_name, self.shared)}
        return tuple(name for name in inputs if name in wanted)

    @cached_property
    def shared_starts(self) -> tuple[tuple[int, str], ...]:
        """(phase, state): inputs with bounded rate whose free start is equal in all scenarios."""
        found: list[tuple[int, str]] = []
        for span in self.spans:
            linked = {link.state for link in span.links}
            for v in span.model.x:
                low, high = span.nodes[0.0][v.name]
                free = low < high and v.name not in linked
                if span.scenario == 0 and rate_name(v.name) in self.shared_inputs and free:
                    found.append((span.phase, v.name))
        return tuple(found)

    def to_mpc(self, step: float = 0.01, **options: Any) -> Any:
        """A model predictive controller that solves this every `step` seconds over the next T.

        See `controller_of` in `ocp.mpc` for the options, and `Controller` for what it does.
        """
        return import_module("ocp.mpc.controller").controller_of(self, step, **options)


def sized(problem: Problem) -> Problem:
    """`problem` with nominal values from what it asks for; itself where 1 is near enough."""
    asked: dict[str, float] = {}
    for phase in problem.chain:
        for given in (phase.start, phase.end, *phase.via.values(), phase.bounds, problem.bounds):
            for name, wanted in given.items():
                asked[name] = max(asked.get(name, 0.0), _size(wanted))
    asked = {name: size for name, size in asked.items() if size > 0.0}
    models = [phase.model for phase in problem.chain]
    if not any(_far(v, asked) for model in models for v in (*model.x, *model.u)):
        return problem
    for phase in problem.chain:
        T = phase.T.start if isinstance(phase.T, Free) else float(phase.T)
        asked |= _following(phase.model, T, asked)
    made = {id(phase.model): _with_nominals(phase.model, asked) for phase in problem.chain}
    phases = tuple(replace(phase, model=made[id(phase.model)]) for phase in problem.chain)
    return replace(problem, phases=Chain(phases))


def cost_size(problem: Problem) -> float:
    """The cost of a motion in which everything has its nominal value."""
    total = 0.0
    for span in problem.spans:
        model, T = span.model, span.T.start if isinstance(span.T, Free) else float(span.T)
        z = [float(v.start) for v in model.z]
        at = ca.Function("cost", span.symbols, [ca.vertcat(span.running, span.end)])
        running, end = at(T, model.nominal("x"), z, model.nominal("u"), span.p).full()[:, 0]
        total += abs(T * running) + abs(end)
    return total if isfinite(total) and total > 0.0 else 1.0


def _size(wanted: Range) -> float:
    return max((abs(x) for x in as_box(wanted) if isfinite(x)), default=0.0)


def _far(v: Variable, sizes: Sizes) -> bool:
    """Whether the nominal value of a variable is far from its size, and none that was given."""
    times = sizes.get(v.name, v.nominal) / v.nominal
    return times * FAR <= 1.0 or (v.nominal == UNSAID and times >= FAR)


def _following(model: Model, T: float, known: Sizes) -> dict[str, float]:
    """Sizes of states and inputs of which nothing is asked, from those of others."""
    symbols = arguments(model)
    ode = ca.SX(0, 1) if model.ode is None else model.ode
    slopes = ca.Function("slopes", symbols, [
        ca.densify(ca.jacobian(ode, ca.vertcat(symbols[1], symbols[3])))
    ])  # fmt: skip
    z = [float(v.start) for v in model.z]
    start = 0.0, model.initial_state(), z, model.values("u"), model.values("p")
    table = np.abs(slopes(*start).full())
    names, found = [v.name for v in (*model.x, *model.u)], dict(known)
    for _ in names:
        rates = {n: found[n] / T for n in names[: len(model.x)] if n in found}
        for j, name in enumerate(names):
            terms = [
                size / table[names.index(n), j] for n, size in rates.items()
                if np.isfinite(table[names.index(n), j]) and table[names.index(n), j] > 0.0
            ]  # fmt: skip
            if name not in found and terms:
                found[name] = max(terms)
    return found


def _with_nominals(model: Model, sizes: Sizes) -> Model:
    def named(group: tuple[Variable, ...]) -> tuple[Variable, ...]:
        return tuple(replace(v, nominal=sizes[v.name]) if _far(v, sizes) else v for v in group)

    again = partial(_with_nominals, sizes=sizes)
    return rebuilt(model, again, x=named(model.x), u=named(model.u))
