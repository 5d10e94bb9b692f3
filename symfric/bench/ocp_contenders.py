"""Optimal control problems by others: what a user of CasADi's Opti or of rockit writes.

Both get the same model, mesh, start and Ipopt; none refines its mesh or looks at its result.
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
    """The solution of a solver.

    Attributes:
        cost: J as the solver says.
        iterations: of Ipopt.
        answer: its word.
        time_s: processor time [s] of building and solving.
        durations: of each phase [s].
        controls: of each phase: input -> values held on the intervals.
        meshes: starts of the intervals as fractions of the phase; None: they are equal.
    """

    cost: float
    iterations: int
    answer: str
    time_s: float
    durations: tuple[float, ...]
    controls: tuple[Mapping[str, Array], ...]
    meshes: tuple[Array, ...] | None = None


Guesses = Mapping[str, Array]
"""State -> samples at equal distances from 0 to the end of the problem."""


def opti(problem: Problem, intervals: int, guess: Guesses | None = None) -> Attempt:
    """Radau collocation written in a Python loop with CasADi's Opti, `intervals` in all.

    Args:
        problem: of one scenario, without chosen parameters and joins.
        guess: where states start; straight lines where it says nothing.
    """
    begin = process_time()
    o = ca.Opti()
    each = max(1, intervals // len(problem.spans))
    cost, before, clock = ca.MX(0), None, ca.MX(0)
    parts: list[tuple[Span, ca.MX, list[ca.MX]]] = []
    for span in problem.spans:
        T = _duration(o, span.T)
        start = start_of(problem, span, guess)
        share, end, inputs = _collocated(o, span, T, each, clock, before, start)
        cost, before, clock = cost + share, end, clock + T
        parts.append((span, T, inputs))
    if problem.periodic or problem.choose or problem.scenarios:
        raise ValueError("opti: expected one motion with given ends and parameters")
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


def _duration(o: ca.Opti, T: float | Free) -> ca.MX:
    if not isinstance(T, Free):
        return ca.MX(T)
    unknown = o.variable()
    o.subject_to(o.bounded(T.lower, unknown, T.upper))
    o.set_initial(unknown, T.start)
    return unknown


def _named(span: Span, rows: Array) -> dict[str, Array]:
    return {v.name: rows[:, i] for i, v in enumerate(span.model.u)}


def straight(span: Span) -> Callable[[float], Array]:
    """Straight lines through what is asked of each state, with the slopes of coordinates."""
    fractions = sorted(span.nodes)
    duration = span.T.start if isinstance(span.T, Free) else span.T
    names = [v.name for v in span.model.x]
    rows: dict[str, Array] = {}
    for name in names:
        boxes = [span.nodes[s][name] for s in fractions]
        known = [(s, (a + b) / 2) for s, (a, b) in zip(fractions, boxes, strict=True)
                 if isfinite(a) and isfinite(b)]  # fmt: skip
        at = [s for s, _ in known] or [0.0]
        rows[name] = np.array([at, [x for _, x in known] or [0.0]])
    rates = {"v": "x"} | {f"{name}_rate": name for name in names} | {"v1": "x1"}

    def at_fraction(s: float) -> Array:
        def value(name: str, s: float) -> float:
            return float(np.interp(s, *rows[name]))

        return np.array([
            (value(rates[n], min(s + 1e-3, 1.0)) - value(rates[n], max(s - 1e-3, 0.0)))
            / (min(s + 1e-3, 1.0) - max(s - 1e-3, 0.0)) / duration
            if rates.get(n) in rows else value(n, s)
            for n in names
        ])  # fmt: skip

    return at_fraction


def start_of(problem: Problem, span: Span, guess: Guesses | None) -> Callable[[float], Array]:
    """Fraction of a phase -> states to start from."""
    lines = straight(span)
    if not guess:
        return lines
    lengths = [s.T.start if isinstance(s.T, Free) else s.T for s in problem.spans]
    begin, whole = sum(lengths[: span.phase]), sum(lengths)

    def at(s: float) -> Array:
        f = (begin + s * lengths[span.phase]) / whole
        return np.array([
            np.interp(f, np.linspace(0, 1, guess[v.name].size), guess[v.name])
            if v.name in guess else x
            for v, x in zip(span.model.x, lines(s), strict=True)
        ])  # fmt: skip

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
    """Equations of a phase; its cost, its end and its inputs."""
    model = span.model
    point = ca.Function(
        "point", span.symbols, [_ode(span), model.alg, span.running, _stack(span.path)]
    )
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
            rate, alg, running, path = point(clock + (k + tau[j]) * h, nodes[j], z, u, p)
            o.subject_to(ca.horzcat(*nodes) @ C[:, j - 1] == h * rate)
            if model.z:
                o.subject_to(alg == 0)
            for row, value in zip(span.path, ca.vertsplit(path), strict=False):
                _bound(o, value, row.lower, row.upper)
            cost += float(B[j - 1]) * h * running
        x = nodes[-1]
        for s in span.nodes:
            if s > 0 and abs((k + 1) / N - s) < 0.5 / N:
                _meet(o, span, s, x)
    return cost + at_end(clock + T, x, z, u, p), x, inputs


def _ode(span: Span) -> ca.SX:
    return span.model.function("ode")(*span.symbols)


def _stack(rows: Sequence[Any]) -> ca.SX:
    return ca.vertcat(ca.SX(0, 1), *(row.expression for row in rows))


def _bound(o: ca.Opti, x: ca.MX, low: float, high: float) -> None:
    if low == high:
        o.subject_to(x == low)
        return
    if isfinite(low):
        o.subject_to(x >= low)
    if isfinite(high):
        o.subject_to(x <= high)


def _meet(o: ca.Opti, span: Span, s: float, x: ca.MX) -> None:
    linked = {link.state for link in span.links} if s == 0.0 else set[str]()
    for i, v in enumerate(span.model.x):
        low, high = span.nodes[s][v.name]
        if v.name not in linked and (low, high) != span.boxes[v.name]:
            _bound(o, x[i], low, high)


def has_rockit() -> bool:
    """True if rockit is installed."""
    return find_spec("rockit") is not None


def rockit(problem: Problem, intervals: int, substeps: int = 0) -> Attempt:
    """Collocation, or multiple shooting with so many Runge-Kutta steps, by rockit.

    Limits: explicit models without algebraic variables; bounds of states and inputs; phases of
    given durations.
    """
    other: Any = import_module("rockit")

    begin = process_time()
    master, clock = other.Ocp(), 0.0
    each = max(1, intervals // len(problem.spans))
    stages: list[tuple[Span, Any, ca.MX, ca.MX]] = []
    for span in problem.spans:
        if isinstance(span.T, Free) or span.model.z or _follows_time(span):
            raise ValueError(
                "rockit: expected given durations, no algebraic variables and no time in equations"
            )
        stage = master.stage(t0=clock, T=span.T)
        x, u = stage.state(len(span.model.x)), stage.control(len(span.model.u))
        p = ca.MX(ca.DM(span.p))
        point = ca.Function("point", span.symbols, [_ode(span), span.running])
        # its clock is no input of what it integrates
        rate, running = point(0.0, x, ca.MX(0, 1), u, p)
        stage.set_der(x, rate)
        stage.add_objective(stage.integral(running))
        for name, symbol in _symbols(span, x, u):
            low, high = span.boxes[name]
            if isfinite(low) and isfinite(high):
                stage.subject_to(low <= (symbol <= high))
        guess = straight(span)
        at = np.linspace(0, 1, each + 1)
        samples = np.array([guess(s) for s in at.tolist()])
        line = ca.interpolant("line", "linear", [clock + span.T * at], samples.ravel())
        stage.set_initial(x, line(stage.t))
        stage.method(
            other.MultipleShooting(N=each, M=substeps, intg="rk")
            if substeps
            else other.DirectCollocation(N=each)
        )
        stages.append((span, stage, x, u))
        clock += span.T
    _join(master, stages)
    master.solver("ipopt", IPOPT)
    with contextlib.redirect_stdout(io.StringIO()):
        try:
            found = master.solve_limited()
        except RuntimeError:  # it gave up, and has its last iterate
            found = master.non_converged_solution
    return Attempt(
        float(sum(found(stage).value(stage.objective) for _, stage, *_ in stages)),
        int(found.stats["iter_count"]),
        str(found.stats["return_status"]),
        process_time() - begin,
        tuple(float(span.T) for span, *_ in stages if not isinstance(span.T, Free)),
        tuple(
            _named(span, _sampled(found(stage).sample(u, grid="control")[1], each))
            for span, stage, _, u in stages
        ),
    )


def _follows_time(span: Span) -> bool:
    return bool(ca.depends_on(ca.vertcat(_ode(span), span.running), span.model.t))


def _symbols(span: Span, x: ca.MX, u: ca.MX) -> list[tuple[str, ca.MX]]:
    pairs = [(v.name, x[i]) for i, v in enumerate(span.model.x)]
    return pairs + [(v.name, u[i]) for i, v in enumerate(span.model.u)]


def _sampled(values: Any, count: int) -> Array:
    return np.asarray(values, dtype=float).reshape(count + 1, -1)[:-1]


def _join(master: Any, stages: Sequence[tuple[Span, Any, ca.MX, ca.MX]]) -> None:
    """Ends, links and middle points."""
    for number, (span, stage, x, _) in enumerate(stages):
        linked = {link.state for link in span.links}
        if number:
            _, old, y, _ = stages[number - 1]
            master.subject_to(old.at_tf(y) == stage.at_t0(x))
        for s, place in ((0.0, stage.at_t0), (1.0, stage.at_tf)):
            for i, v in enumerate(span.model.x):
                low, high = span.nodes[s][v.name]
                if low == high and not (s == 0.0 and v.name in linked):
                    master.subject_to(place(x)[i] == low)
