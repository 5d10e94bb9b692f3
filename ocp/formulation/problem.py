"""An optimal control problem, nominal values from its ends and bounds, and its form in files.

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

from ocp.formulation.expressions import TIME, arguments, integral
from ocp.formulation.phase import Chain, Free, Phase, Range, Span, as_box
from ocp.formulation.resolve import function_problems, resolved
from ocp.formulation.statement import Choice, Statement, chosen_of, rate_name, rebuilt, settings_of
from ocp.formulation.validate import input_problems, kind_problems
from symfric.foundation import checks
from symfric.foundation.variable import Variable
from symfric.model import Model, check_model

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

    `bounds`, `rates`, `path` and `p` hold in every phase that has the names; fields of a
    phase win. Everything is bound to names, so that one statement serves several models.

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
        """Sum of the costs of the spans, or mean or worst of these sums over scenarios."""
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
    sizes: dict[str, float] = {}
    for phase in problem.chain:
        for given in (phase.start, phase.end, *phase.via.values(), phase.bounds, problem.bounds):
            for name, wanted in given.items():
                sizes[name] = max(sizes.get(name, 0.0), _size(wanted))
    sizes = {name: size for name, size in sizes.items() if size > 0.0}
    models = [phase.model for phase in problem.chain]
    if not any(_far(v, sizes) for model in models for v in (*model.x, *model.u)):
        return problem
    for phase in problem.chain:
        T = phase.T.start if isinstance(phase.T, Free) else float(phase.T)
        sizes |= _following(phase.model, T, sizes)
    made = {id(phase.model): _with_nominals(phase.model, sizes) for phase in problem.chain}
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
    """True if a nominal value is far above the size, or was not given and is far below it."""
    times = sizes.get(v.name, v.nominal) / v.nominal
    return times * FAR <= 1.0 or (v.nominal == UNSAID and times >= FAR)


def _following(model: Model, T: float, known: Sizes) -> dict[str, float]:
    """Sizes of states and inputs without ends or bounds, from those of others."""
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


@final
@dataclass(frozen=True, eq=False)
class PosedPhase:
    """A phase: name, model as it was given, and duration [s]."""

    name: str
    model: Model
    T: float | Free


@final
@dataclass(frozen=True, eq=False, repr=False)
class Posed:
    """A problem of a file: enough to verify and to draw a solution, and to start others from it.

    Costs, conditions and links are expressions in `spans`; the functions that users wrote are
    not kept, so that it is not solved again: write the problem, and give the solution as `guess`.

    Attributes:
        name, spans, chain, chosen, kind, scenario_names, shared_inputs: as those of a `Problem`.
        periodic, choose: names.
        durations: numbers of the phases whose durations add up to something.
    """

    name: str
    spans: tuple[Span, ...]
    chain: tuple[PosedPhase, ...]
    chosen: tuple[Choice, ...]
    kind: Literal["sum", "mean", "worst"]
    scenario_names: tuple[str, ...]
    shared_inputs: tuple[str, ...]
    periodic: tuple[str, ...]
    choose: tuple[str, ...]
    durations: tuple[tuple[int, ...], ...]

    def __repr__(self) -> str:
        return f"<problem '{self.name}' of a file: {len(self.chain)} phases>"

    def __getattr__(self, name: str) -> object:
        if name.startswith("_"):
            raise AttributeError(name)
        raise AttributeError(
            f"problem '{self.name}' of a file: expected what a file keeps, got {name}; write the "
            "problem again, and give the loaded solution as guess"
        )


def posed(problem: Problem | Posed) -> Posed:
    """The part of a problem that a file keeps."""
    if isinstance(problem, Posed):
        return problem
    return Posed(
        problem.name,
        problem.spans,
        tuple(PosedPhase(phase.name, phase.model, phase.T) for phase in problem.chain),
        problem.chosen,
        problem.kind,
        problem.scenario_names,
        problem.shared_inputs,
        tuple(problem.periodic),
        tuple(problem.choose),
        tuple(tuple(phases) for phases, _ in problem.durations),
    )


def rest_to_rest(
    model: Model,
    distance: float,
    T: float | Free,
    *,
    limit: float,
    position: str = "x",
    velocity: str = "v",
    force: str = "force",
) -> Problem:
    """Move a mass over `distance` [m] from rest to rest, with |force| <= `limit` [N].

    With a given duration `T` [s] the move of least effort, min int force^2 dt; with
    `T=Free(lower, upper)` the fastest one, min T.

    Raises:
        ValueError: what `Problem` finds wrong, such as a model without these signals.
    """
    check_model("rest_to_rest", model)
    names = [v.name for group in (model.x, model.u) for v in group]
    for name in (position, velocity, force):
        checks.choice(f"rest_to_rest of '{model.name}'", name, names)
    limit = checks.number("rest_to_rest: limit", limit, unit="N", above=0.0)
    move = Phase(
        model,
        T,
        start={position: 0.0, velocity: 0.0},
        end={position: distance, velocity: 0.0},
        bounds={force: (-limit, limit)},
    )
    return Problem(move, TIME if isinstance(T, Free) else integral(lambda s: s[force] ** 2))
