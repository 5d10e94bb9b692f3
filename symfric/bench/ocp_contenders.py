"""Optimal control problems in other tools, in the style of users of CasADi's Opti and rockit.

Both tools use the same model, mesh, start and Ipopt; neither refines its mesh or verifies results.
"""

import contextlib
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from math import isfinite
from time import process_time
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.formulation.phase import Free, Span
from ocp.formulation.problem import Problem

Array = NDArray[np.float64]
IPOPT = {
    "ipopt.print_level": 0,
    "print_time": False,
    "ipopt.sb": "yes",
    "ipopt.max_iter": 2000,
    "ipopt.max_cpu_time": 60.0,
}
DEGREE = 3


@final
@dataclass(frozen=True, eq=False)
class Attempt:
    """Result of a solver.

    Attributes:
        cost: J reported by the solver.
        iterations: number of iterations.
        status: status reported by the solver.
        time_s: processor time [s] of building and solving.
        durations: duration of each phase [s].
        controls: for each phase, input -> constant values on the intervals.
        meshes: for each phase, starts of the intervals as fractions; None: equal intervals.
    """

    cost: float
    iterations: int
    status: str
    time_s: float
    durations: tuple[float, ...]
    controls: tuple[Mapping[str, Array], ...]
    meshes: tuple[Array, ...] | None = None


Guesses = Mapping[str, Array]
"""State -> equally spaced samples from 0 to the end of the problem."""


def opti(problem: Problem, intervals: int, guess: Guesses) -> Attempt:
    """Return the solution by Radau collocation, written as a Python loop with CasADi's Opti.

    Args:
        problem: problem of one scenario, without chosen parameters and periodic states.
        intervals: total number of intervals.
        guess: initial guess of the states.
    """
    if problem.periodic or problem.choose or problem.scenarios:
        raise ValueError("opti: expected one motion with given ends and parameters")
    begin = process_time()
    o = ca.Opti()
    each = max(1, intervals // len(problem.spans))
    cost, before, clock = ca.MX(0), None, ca.MX(0)
    parts: list[tuple[Span, ca.MX, list[ca.MX]]] = []
    for span in problem.spans:
        T = ca.MX(span.T) if not isinstance(span.T, Free) else o.variable()
        if isinstance(span.T, Free):
            o.subject_to(o.bounded(span.T.lower, T, span.T.upper))
            o.set_initial(T, span.T.start)
        start = states_of(problem, span, guess)
        share, end, inputs = _collocated(o, span, T, each, clock, before, start)
        cost, before, clock = cost + share, end, clock + T
        parts.append((span, T, inputs))
    o.minimize(cost)
    o.solver("ipopt", IPOPT)
    try:
        value = o.solve().value
    except RuntimeError:
        value = o.debug.value
    stats = o.stats()
    return Attempt(
        float(value(cost)),
        int(stats["iter_count"]),
        str(stats["return_status"]),
        process_time() - begin,
        tuple(float(value(T)) for _, T, _ in parts),
        tuple(
            _named(span, np.array([np.ravel(value(u)) for u in inputs]))
            for span, _, inputs in parts
        ),
    )


def _named(span: Span, rows: Array) -> dict[str, Array]:
    return {v.name: rows[:, i] for i, v in enumerate(span.model.u)}


def states_of(problem: Problem, span: Span, guess: Guesses) -> Callable[[float], Array]:
    """Return the guess of the states as a function of the fraction of a phase."""
    lengths = [s.T.start if isinstance(s.T, Free) else s.T for s in problem.spans]
    begin, whole = sum(lengths[: span.phase]), sum(lengths)

    def at(s: float) -> Array:
        f = (begin + s * lengths[span.phase]) / whole
        known = (guess[v.name] for v in span.model.x)
        return np.array([np.interp(f, np.linspace(0, 1, row.size), row) for row in known])

    return at


def _collocated(
    o: ca.Opti,
    span: Span,
    T: ca.MX,
    N: int,
    clock: ca.MX,
    before: ca.MX | None,
    guess: Callable[[float], Array],
) -> tuple[ca.MX, ca.MX, list[ca.MX]]:
    """Add the equations of a phase; return its cost, its final state and its inputs."""
    model = span.model
    path = ca.vertcat(ca.SX(0, 1), *(row.expression for row in span.path))
    point = ca.Function("point", span.symbols, [_ode(span), model.alg, span.running, path])
    at_end = ca.Function("end", span.symbols, [span.end])
    tau = [0.0, *ca.collocation_points(DEGREE, "radau")]
    C, _, B = ca.collocation_coeff(tau[1:])
    p, h, cost = ca.MX(ca.DM(span.p)), T / N, ca.MX(0)

    def state(s: float) -> ca.MX:
        x = o.variable(len(model.x))
        o.set_initial(x, guess(s))
        for i, v in enumerate(model.x):
            _bound(o, x[i], *span.boxes[v.name])
        return x

    x = state(0.0)
    _meet(o, span, 0.0, x)
    if before is not None:
        names = [link.state for link in span.links]
        for i, v in enumerate(model.x):
            if v.name in names:
                o.subject_to(x[i] == before[i])
    inputs: list[ca.MX] = []
    z, u = ca.MX(0, 1), ca.MX(0, 1)
    for k in range(N):
        u = o.variable(len(model.u))
        inputs.append(u)
        for i, v in enumerate(model.u):
            _bound(o, u[i], *span.boxes[v.name])
        nodes = [x, *(state((k + s) / N) for s in tau[1:])]
        for j in range(1, DEGREE + 1):
            z = o.variable(len(model.z)) if model.z else ca.MX(0, 1)
            rate, alg, running, limited = point(clock + (k + tau[j]) * h, nodes[j], z, u, p)
            o.subject_to(ca.horzcat(*nodes) @ C[:, j - 1] == h * rate)
            if model.z:
                o.subject_to(alg == 0)
            for row, value in zip(span.path, ca.vertsplit(limited), strict=False):
                _bound(o, value, row.lower, row.upper)
            cost += float(B[j - 1]) * h * running
        x = nodes[-1]
        for s in span.nodes:
            if s > 0 and abs((k + 1) / N - s) < 0.5 / N:
                _meet(o, span, s, x)
    return cost + at_end(clock + T, x, z, u, p), x, inputs


def _ode(span: Span) -> ca.SX:
    return span.model.function("ode")(*span.symbols)


def _bound(o: ca.Opti, x: ca.MX, low: float, high: float) -> None:
    if low == high:
        o.subject_to(x == low)
        return
    if isfinite(low):
        o.subject_to(x >= low)
    if isfinite(high):
        o.subject_to(x <= high)


def _meet(o: ca.Opti, span: Span, s: float, x: ca.MX) -> None:
    """Add the conditions on states at the fraction `s` of a phase."""
    linked = {link.state for link in span.links} if s == 0.0 else set[str]()
    for i, v in enumerate(span.model.x):
        low, high = span.nodes[s][v.name]
        if v.name not in linked and (low, high) != span.boxes[v.name]:
            _bound(o, x[i], low, high)


def has_rockit() -> bool:
    """Return True if rockit is installed."""
    return find_spec("rockit") is not None


def rockit(problem: Problem, intervals: int, guess: Guesses) -> Attempt:
    """Return the solution by collocation with rockit, with arguments as those of `opti`.

    Limits: explicit models without algebraic variables, bounds on states and inputs, and phases of
    given durations.
    """
    other: Any = import_module("rockit")
    begin = process_time()
    master, clock = other.Ocp(), 0.0
    each = max(1, intervals // len(problem.spans))
    stages: list[tuple[Span, Any, ca.MX, ca.MX]] = []
    for span in problem.spans:
        model, equations = span.model, [_ode(span), span.running]
        if isinstance(span.T, Free) or model.z or ca.depends_on(ca.vertcat(*equations), model.t):
            raise ValueError(
                "rockit: expected given durations, no algebraic variables and no time in equations"
            )
        stage = master.stage(t0=clock, T=span.T)
        x, u = stage.state(len(model.x)), stage.control(len(model.u))
        point = ca.Function("point", span.symbols, equations)
        rate, running = point(0.0, x, ca.MX(0, 1), u, ca.MX(ca.DM(span.p)))
        stage.set_der(x, rate)
        stage.add_objective(stage.integral(running))
        for v, symbol in zip((*model.x, *model.u), ca.vertsplit(ca.vertcat(x, u)), strict=True):
            low, high = span.boxes[v.name]
            if isfinite(low) and isfinite(high):
                stage.subject_to(low <= (symbol <= high))
        at = np.linspace(0, 1, each + 1)
        samples = np.array([*map(states_of(problem, span, guess), at.tolist())])
        line = ca.interpolant("line", "linear", [clock + span.T * at], samples.ravel())
        stage.set_initial(x, line(stage.t))
        stage.method(other.DirectCollocation(N=each))
        stages.append((span, stage, x, u))
        clock += span.T
    _join(master, stages)
    master.solver("ipopt", IPOPT)
    with contextlib.redirect_stdout(io.StringIO()):
        try:
            found = master.solve_limited()
        except RuntimeError:  # without convergence, the last iterate is used
            found = master.non_converged_solution
    controls = [found(stage).sample(u, grid="control")[1] for _, stage, _, u in stages]
    return Attempt(
        float(sum(found(stage).value(stage.objective) for _, stage, *_ in stages)),
        int(found.stats["iter_count"]),
        str(found.stats["return_status"]),
        process_time() - begin,
        tuple(float(span.T) for span in problem.spans if not isinstance(span.T, Free)),
        tuple(
            _named(span, np.asarray(u, dtype=float).reshape(each + 1, -1)[:-1])
            for span, u in zip(problem.spans, controls, strict=True)
        ),
    )


def _join(master: Any, stages: Sequence[tuple[Span, Any, ca.MX, ca.MX]]) -> None:
    """Add end conditions and links between phases."""
    for number, (span, stage, x, _) in enumerate(stages):
        linked = {link.state for link in span.links}
        if number:
            _, old, y, _ = stages[number - 1]
            master.subject_to(old.at_tf(y) == stage.at_t0(x))
        for s, at_end in ((0.0, stage.at_t0), (1.0, stage.at_tf)):
            for i, v in enumerate(span.model.x):
                low, high = span.nodes[s][v.name]
                if low == high and not (s == 0.0 and v.name in linked):
                    master.subject_to(at_end(x)[i] == low)
