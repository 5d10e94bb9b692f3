"""How far motions are off what a problem asks for, whoever found the controls."""

from collections.abc import Mapping, Sequence
from math import isfinite, nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ocp.formulation.phase import Span
from ocp.formulation.problem import Problem
from ocp.friction.exact import set_valued
from ocp.result.solution import Solution
from symfric.bench.ocp_contenders import Attempt
from symfric.integrator import Hold, simulate

Array = NDArray[np.float64]


def attempt_of(solution: Solution, time_s: float) -> Attempt:
    """What `ocp.solve` found, in the same terms."""
    motion, meshes, controls = solution.motions[0], [], []
    for stretch in motion.phases:
        inside = (motion.t_control >= stretch.begin - 1e-12) & (motion.t_control < stretch.end)
        meshes.append((motion.t_control[inside] - stretch.begin) / stretch.T)
        controls.append({name: u[inside] for name, u in motion.controls.items()})
    return Attempt(
        cost=solution.cost,
        iterations=solution.iterations,
        answer=solution.status.name,
        time_s=time_s,
        durations=tuple(stretch.T for stretch in motion.phases),
        controls=tuple(controls),
        meshes=tuple(meshes),
    )


def landed(problem: Problem, attempt: Attempt, *, exact: bool = False, rtol: float = 1e-9) -> float:
    """Largest relative miss of ends and middle points under the controls, simulated.

    Of a state relative to its range, or its nominal value; NaN where the motion cannot be
    simulated.

    Args:
        exact: with exact Coulomb friction and stiction in place of the laws.
    """
    state: dict[str, float] = {}
    modes: dict[str, int] = {}
    worst, clock = 0.0, 0.0
    for span, T, controls in zip(problem.spans, attempt.durations, attempt.controls, strict=True):
        mesh = attempt.meshes[span.phase] if attempt.meshes else None
        looks = sorted({*span.nodes, *np.linspace(0, 1, 101).tolist()})
        how: dict[str, Any] = {
            "t_start": clock,
            "x0": _begin(span, state),
            "u": _held(span, controls, mesh, clock, T),
            "p": {v.name: float(x) for v, x in zip(span.model.p, span.p, strict=True)},
            "t_eval": clock + T * np.array(looks),
            "rtol": rtol,
            "throw": False,
        }
        if exact:
            run = set_valued(span.model, clock + T, modes=modes, **how)
            modes = dict(run.pieces[-1].modes) if run.pieces else {}
        else:
            run = simulate(span.model, clock + T, **how)
        if not run.status.ok:
            return nan
        worst = max(worst, _miss(span, {n: run[n] for n in span.nodes[1.0]}, looks))
        state, clock = {n: float(run[n][-1]) for n in span.nodes[1.0]}, clock + T
    return worst


def _begin(span: Span, before: Mapping[str, float]) -> dict[str, float]:
    linked = {link.state for link in span.links}
    return {
        v.name: before[v.name] if v.name in linked else float(np.mean(span.nodes[0.0][v.name]))
        for v in span.model.x
    }


def _held(
    span: Span, controls: Mapping[str, Array], mesh: Array | None, clock: float, T: float
) -> dict[str, Hold]:
    N = next(iter(controls.values())).size
    at = clock + T * (np.arange(N) / N if mesh is None else mesh)
    at[0] = clock
    return {n: Hold(at, np.clip(u, *span.box(n))) for n, u in controls.items()}


def _miss(span: Span, signals: Mapping[str, Array], looks: Sequence[float]) -> float:
    nominal = {v.name: v.nominal for v in span.model.x}
    worst = 0.0
    for s, boxes in span.nodes.items():
        for name, (low, high) in boxes.items():
            if s > 0 and isfinite(low) and isfinite(high):
                x = float(signals[name][looks.index(s)])
                size = max(float(np.abs(signals[name]).max()), nominal[name])
                worst = max(worst, (low - x) / size, (x - high) / size)
    return worst
