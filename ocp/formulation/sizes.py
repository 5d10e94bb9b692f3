"""Typical magnitudes from what a problem asks for, where its models say none.

Solvers see unknowns and costs over their typical magnitudes. A `nominal` of 1 is what a variable
has that was given none: far from the values asked for it is taken from these, and so is one that is
far above them. States have that of their ends, of points on the way and of bounds; others follow by
the equations,

    |x_i| / T ~ |d x_i' / d x_j| |x_j|     |x_i| / T ~ |d x_i' / d u_j| |u_j|
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from math import isfinite
from typing import Any

import casadi as ca
import numpy as np

from ocp.formulation.bounds import Free, Range, as_box
from ocp.formulation.phase import Chain
from ocp.formulation.problem import Problem
from symfric.foundation.variable import Variable
from symfric.model import Model

FAR = 100.0
"""Factor between a size and 1 from which on it counts."""
UNSAID = 1.0
"""The nominal value of a variable that was given none."""

Sizes = Mapping[str, float]


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
    symbols = [model.t, *(model.vector(letter) for letter in "xzup")]
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

    changes: dict[str, Any] = {"x": named(model.x), "u": named(model.u)}
    if model.contacts:
        changes["opening"] = partial(_open_with_nominals, model, sizes)
    if model.holonomic is not None:
        changes |= {"ode": None, "alg": ca.SX(0, 1)}  # made of `holonomic` once more
    return replace(model, **changes)


def _open_with_nominals(model: Model, sizes: Sizes) -> Model:
    return _with_nominals(model.open, sizes)
