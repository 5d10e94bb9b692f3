"""Optimal control problems, nominal values from their ends and bounds, and their form in files.

Solvers use unknowns and costs divided by their nominal values. The default nominal value of a
variable is 1. A default far below or far above the prescribed values, or a given nominal value far
above them, is replaced by their magnitude: ends, via points and bounds for states. The magnitudes
of other variables follow from the equations,

    |x_i| / T ~ |d x_i' / d x_j| |x_j|     |x_i| / T ~ |d x_i' / d u_j| |u_j|
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from importlib import import_module
from math import isfinite
from typing import Any, Literal, final

import casadi as ca
import numpy as np

from ocp.formulation.changed_models import rate_name, rebuilt, states_of
from ocp.formulation.expressions import TIME, arguments, integral
from ocp.formulation.phase import Chain, Free, Phase, Span, as_box, initial, size_of
from ocp.formulation.resolve import resolved
from ocp.formulation.statement import Choice, Statement, chosen_of, forms_of, only, settings_of
from symfric.foundation import checks
from symfric.foundation.variable import Variable
from symfric.model import Model, check_model

FAR = 100.0
"""Factor between a size and a nominal value above which the nominal value is replaced."""
DEFAULT = 1.0
"""Nominal value of a variable for which none is given."""


@final
@dataclass(frozen=True, eq=False)
class Problem(Statement):
    """Optimal control problem: minimise a cost over the motion of one or several phases.

        min J   subject to   x' = ode(t, x, z, u, p),  0 = alg(t, x, z, u, p)   in every phase,
                             ends, bounds, path conditions, links between phases

    `bounds`, `rates`, `path` and `p` apply to every phase whose model has the names; fields of a
    phase take precedence. Fields refer to variables by name, so they apply to different models.

    Attributes:
        phases: a `Phase`, or several: `out >> back`.
        cost: a sum of `integral(...)` over all phases, `at_end(...)` of the last phase, `TIME`,
            `track(...)`, `effort(...)`, `absolute(...)` and `largest(...)`. With scenarios, the
            mean of their costs is minimised, or the largest one with `worst(...)`.
        bounds, rates, inputs, path, p: as in `Phase`.
        totals: name -> integrand: integrals over the motion as states that start at zero, such as
            {"energy": lambda s: s.force**2}, which bounds and ends can name.
        choose: parameter -> (lower, upper) or (lower, upper, guess): parameters optimised with the
            motion; their values are equal in all phases and scenarios.
        periodic: states whose value at the end of the last phase equals that at the start of the
            first one; the start is free unless `start` names it.
        scenarios: name -> values of parameters; the motion is computed for each scenario.
        shared: inputs that are equal in all scenarios, by default all inputs. Free durations are
            always equal.
        durations: pairs such as ((0, 1), 2.0): the sum of the durations of phases 0 and 1 is 2 s.
            The second item may be a `Free`.

    Raises:
        ValueError: all problems at once.
    """

    def __post_init__(self) -> None:
        _ = self.spans  # raises ValueError

    @cached_property
    def spans(self) -> tuple[Span, ...]:
        """Resolved phases, in the order of scenarios and of phases within each scenario."""
        return resolved(self)

    @property
    def scenario_names(self) -> tuple[str, ...]:
        """Names of the scenarios; empty for a problem without scenarios."""
        return tuple(self.scenarios)

    @cached_property
    def chosen(self) -> tuple[Choice, ...]:
        """Parameters chosen with the motion: name, bounds, guess."""
        return chosen_of(self, settings_of(self))

    @property
    def kind(self) -> Literal["sum", "mean", "worst"]:
        """Kind of total cost: sum over phases, or mean or worst of the sums of all scenarios."""
        if len(self.scenarios) < 2:
            return "sum"
        return "worst" if self.cost is not None and self.cost.largest else "mean"

    @cached_property
    def shared_inputs(self) -> tuple[str, ...]:
        """Inputs of the models of the spans that are equal in all scenarios.

        An input with bounded rate is represented by its rate; see `shared_starts` for its start.
        """
        inputs = dict.fromkeys(v.name for span in self.spans for v in span.model.u)
        if self.shared is None:
            return tuple(inputs)
        wanted = {rate_name(name, k) for name in self.shared for k in range(4)}
        return tuple(name for name in inputs if name in wanted)

    @cached_property
    def shared_starts(self) -> tuple[tuple[int, str], ...]:
        """(phase, state) of inputs that are states, and whose free start all scenarios share."""
        starts: list[tuple[int, str]] = []
        for span, phase in zip(self.spans, self.chain, strict=False):  # of the first scenario
            linked = {link.state for link in span.links}
            forms = forms_of(self, phase)
            forms = forms if self.shared is None else only(forms, self.shared)
            for name in states_of(forms):
                low, high = span.nodes[0.0][name]
                if low < high and name not in linked:
                    starts.append((span.phase, name))
        return tuple(starts)

    def to_mpc(self, step: float = 0.01, **options: Any) -> Any:
        """Return a model predictive controller that solves this problem every `step` seconds.

        See `controller_of` in `ocp.mpc` for the options, and `Controller` for the method.
        """
        return import_module("ocp.mpc.controller").controller_of(self, step, **options)


def sized(problem: Problem) -> Problem:
    """Return `problem` with nominal values from its conditions, unchanged if none is far off."""
    sizes: dict[str, float] = {}
    for phase in problem.chain:
        for ranges in (phase.start, phase.end, *phase.via.values(), phase.bounds, problem.bounds):
            for name, wanted in ranges.items():
                sizes[name] = max(sizes.get(name, 0.0), size_of(as_box(wanted), 0.0))
    sizes = {name: size for name, size in sizes.items() if size > 0.0}
    models = [phase.model for phase in problem.chain]
    if not any(_far(v, sizes) for model in models for v in (*model.x, *model.u)):
        return problem
    for phase in problem.chain:
        sizes |= _sizes_by_equations(phase.model, initial(phase.T), sizes)
    made = {id(model): _with_nominals(model, sizes) for model in models}
    phases = tuple(replace(phase, model=made[id(phase.model)]) for phase in problem.chain)
    return replace(problem, phases=Chain(phases))


def cost_size(problem: Problem) -> float:
    """Return the magnitude of the cost at nominal states and inputs; 1 if it is not positive."""
    total = 0.0
    for span in problem.spans:
        model, T = span.model, initial(span.T)
        z = [float(v.start) for v in model.z]
        at = ca.Function("cost", span.symbols, [ca.vertcat(span.integrand, span.end)])
        running, end = at(T, model.nominal("x"), z, model.nominal("u"), span.p).full()[:, 0]
        total += abs(T * running) + abs(end)
    return total if isfinite(total) and total > 0.0 else 1.0


def _far(v: Variable, sizes: Mapping[str, float]) -> bool:
    """Return True if a nominal value is far above the size, or a default is far below it."""
    times = sizes.get(v.name, v.nominal) / v.nominal
    return times * FAR <= 1.0 or (v.nominal == DEFAULT and times >= FAR)


def _sizes_by_equations(model: Model, T: float, known: Mapping[str, float]) -> dict[str, float]:
    """Return `known` sizes and the sizes of states and inputs that follow from the equations."""
    symbols = arguments(model)
    ode = ca.SX(0, 1) if model.ode is None else model.ode
    slope = ca.densify(ca.jacobian(ode, ca.vertcat(symbols[1], symbols[3])))
    z = [float(v.start) for v in model.z]
    start = 0.0, model.initial_state(), z, model.values("u"), model.values("p")
    table = np.abs(ca.Function("slopes", symbols, [slope])(*start).full())
    names, sizes = [v.name for v in (*model.x, *model.u)], dict(known)
    for _ in names:
        rates = {i: sizes[n] / T for i, n in enumerate(names[: len(model.x)]) if n in sizes}
        for j, name in enumerate(names):
            terms = [
                rate / table[i, j]
                for i, rate in rates.items()
                if np.isfinite(table[i, j]) and table[i, j] > 0.0
            ]
            if name not in sizes and terms:
                sizes[name] = max(terms)
    return sizes


def _with_nominals(model: Model, sizes: Mapping[str, float]) -> Model:
    def fitted(v: Variable) -> Variable:
        kept = v.nominal != DEFAULT and not _far(v, sizes)
        return v if kept else replace(v, nominal=sizes.get(v.name, v.nominal))

    x, u = tuple(map(fitted, model.x)), tuple(map(fitted, model.u))
    return rebuilt(model, partial(_with_nominals, sizes=sizes), x=x, u=u)


@final
@dataclass(frozen=True, eq=False)
class PosedPhase:
    """Phase of a problem from a file: name, user's model, duration [s], states with a start."""

    name: str
    model: Model
    T: float | Free
    start: tuple[str, ...] = ()


@final
@dataclass(frozen=True, eq=False, repr=False)
class Posed:
    """Problem from a file, which suffices to transcribe it, and to verify and plot its solution.

    Costs, conditions and links are expressions in `spans`. The user's functions are not stored, so
    phases cannot be solved by modes again: write the problem again, and pass the solution as
    `guess`.

    Attributes:
        name, spans, chain, chosen, kind, scenario_names, shared_inputs, shared_starts: as in
            `Problem`.
        periodic, choose: names of periodic states and of chosen parameters.
        durations: as in `Problem`; in older files only the indices of the phases.
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
    durations: tuple[tuple[tuple[int, ...], float | Free], ...] | tuple[tuple[int, ...], ...]
    shared_starts: tuple[tuple[int, str], ...] = ()

    def __post_init__(self) -> None:
        for span in self.spans:
            if np.shape(span.p) != (len(span.model.p),):
                what = f"{len(span.model.p)} values of parameters in phase '{span.name}'"
                raise checks.refused(f"problem '{self.name}' of a file", what, span.p)

    def __repr__(self) -> str:
        return f"<problem '{self.name}' of a file: {len(self.chain)} phases>"

    def __getattr__(self, name: str) -> object:
        if name.startswith("_"):
            raise AttributeError(name)
        raise AttributeError(
            f"problem '{self.name}' of a file: expected an attribute kept in files, got {name}; "
            "write the problem again, and give the loaded solution as guess"
        )


def posed(problem: Problem | Posed) -> Posed:
    """Return the part of a problem that a file stores."""
    if isinstance(problem, Posed):
        return problem
    return Posed(
        problem.name,
        problem.spans,
        tuple(PosedPhase(one.name, one.model, one.T, tuple(one.start)) for one in problem.chain),
        problem.chosen,
        problem.kind,
        problem.scenario_names,
        problem.shared_inputs,
        tuple(problem.periodic),
        tuple(problem.choose),
        tuple((tuple(phases), total) for phases, total in problem.durations),
        problem.shared_starts,
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
    """Return the problem of moving a mass by `distance` [m] from rest to rest.

    The force is bounded by |force| <= `limit` [N]. The cost is int force^2 dt for a given duration
    `T` [s], and the duration for `T=Free(lower, upper)`.

    Raises:
        ValueError: errors of `Problem`, such as a model without these signals.
    """
    check_model("rest_to_rest", model)
    names = [v.name for group in (model.x, model.u) for v in group]
    for name in (position, velocity, force):
        checks.choice(f"rest_to_rest of '{model.name}'", name, names)
    limit = checks.number("rest_to_rest: limit", limit, unit="N", above=0.0)
    start = {position: 0.0, velocity: 0.0}
    end, bounds = start | {position: distance}, {force: (-limit, limit)}
    move = Phase(model, T, start=start, end=end, bounds=bounds)
    return Problem(move, TIME if isinstance(T, Free) else integral(lambda s: s[force] ** 2))
