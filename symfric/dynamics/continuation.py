"""Continuation of equilibria and periodic orbits in a parameter, through folds and grazing."""

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TypeVar

import numpy as np

from symfric.dynamics.branch import Branch, Special
from symfric.dynamics.curve import ContinuationStep, Node, at_edge, corrected, followed, tangent
from symfric.dynamics.equilibrium import Equilibrium
from symfric.dynamics.families import Equilibria, Family, Orbits, Trace
from symfric.dynamics.orbit import PeriodicOrbit
from symfric.dynamics.shooting import OrbitShooting
from symfric.dynamics.sticking import Near, restarted, same_sequence
from symfric.foundation import checks
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import check_names
from symfric.integrator.equations.inputs import Input
from symfric.model import Model

At = TypeVar("At", bound=Equilibrium | PeriodicOrbit)
INTERRUPTED = "interrupted by the user"
SMALL = 1e-3
"""First amplitude of orbits from a Hopf point, relative to the magnitudes of the states."""


def continuation(
    start: Equilibrium | PeriodicOrbit,
    parameter: str,
    between: tuple[float, float],
    *,
    points: int = 200,
    step: float = 0.05,
    rtol: float = 1e-8,
) -> Branch:
    """Return the branch of equilibria or periodic orbits through a start, in both directions.

    Pseudo-arclength continuation passes folds and follows unstable parts. Special points are
    located on the way: folds, Hopf points, branch points, period doublings, Neimark-Sacker points,
    and the grazing of a sliding orbit by the set of stick. Exact friction needs no smoothing: at a
    grazing, the branch continues with the orbit of the other sequence of stick and slip. They are
    located to about 1e-8 of the range, and a Hopf point at which orbits vanish by extrapolation to
    1e-5. `Branch.message` names those that were located to a step only, such as very sharp folds.

    Args:
        start: isolated equilibrium, or a periodic orbit that is not `symmetric`. A given period
            does not change.
        parameter: name of a free parameter of the model, or of an input that is constant.
        between: smallest and largest value of the parameter, within its bounds.
        points: largest number of points.
        step: longest step, relative to the magnitudes of states, period and range of the parameter.
        rtol: relative tolerance of the runs of orbits.

    Returns:
        The branch. After an interrupt (Ctrl-C) it contains the points found so far.

    Raises:
        ValueError: bad input, or no curve at the start.
    """
    where = "continuation"
    if not isinstance(start, Equilibrium | PeriodicOrbit):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise checks.refused(f"{where}: start", "an equilibrium or a periodic orbit", start)
    hint = f"free it when the model is made, such as rabinowicz(law, free=['{parameter}'])"
    check_names(f"{where}: parameter", [parameter], [*start.p, *start.u], hint)
    if parameter in start.u:
        start = _with_parameter(start, parameter)
    model = start.model
    span = checked_span(where, model, between, start.p[parameter], parameter)
    checks.count(f"{where}: points", points, least=2)
    checks.number(f"{where}: step", step, above=0.0, upper=1.0)
    if isinstance(start, PeriodicOrbit):
        if start.symmetric:
            raise checks.refused(
                f"{where}: start", "an orbit without symmetry", start,
                "periodic_orbit(...) without symmetric=",
            )  # fmt: skip
        curve, z = _orbits(start, parameter, span, rtol)
    elif start.free:
        raise checks.refused(
            f"{where}: start", "an isolated equilibrium", start,
            f"contacts at rest hold a set of dimension {start.free}; survives() returns its ends",
        )  # fmt: skip
    else:
        curve, z = _equilibria(start, parameter, span)
    node = curve.at(z)
    up = tangent(curve, node, _unit(z.size))
    back, on = _traced(curve, node, [-up, up], span, points, step)
    driven = isinstance(start, PeriodicOrbit) and start.driven
    return _joined(model, parameter, start.u, dict(start.p), [back, on], driven=driven)


def orbits_from(
    branch: Branch,
    hopf: Special,
    between: tuple[float, float],
    *,
    points: int = 200,
    step: float = 0.05,
    rtol: float = 1e-8,
) -> Branch:
    """Return the branch of periodic orbits that begins at a Hopf point of a branch of equilibria.

    The arguments are those of `continuation`.

    Raises:
        ValueError: bad input, a point of another kind, or no orbit next to it.
    """
    where = "orbits_from"
    if not isinstance(branch, Branch):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise checks.refused(f"{where}: branch", "a branch of equilibria", branch)
    model = branch.model
    if not isinstance(hopf, Special) or hopf.kind != "Hopf":  # pyright: ignore[reportUnnecessaryIsInstance]
        raise checks.refused(f"{where}: hopf", "a Hopf point, branch.located('Hopf')[0]", hopf)
    span = checked_span(where, model, between, hopf.value, branch.parameter)
    nominal = np.maximum(model.nominal("x"), np.abs(hopf.x))
    problem = OrbitShooting(
        model, branch.u, (branch.parameter,), nominal, np.ones(nominal.size), rtol, driven=False
    )
    scale = np.concatenate([nominal, [hopf.period, span[1] - span[0]]])
    curve = Orbits(problem, branch.p, scale, 10 * rtol)
    along = np.concatenate([hopf.direction / nominal, [0.0, 0.0]])
    along /= np.linalg.norm(along)
    z = np.concatenate([hopf.x, [hopf.period, hopf.value]])
    node, _ = corrected(curve, z + SMALL * along * scale, along)
    tau = tangent(curve, node, along)
    (part,) = _traced(curve, node, [tau], span, points, step)
    return _joined(model, branch.parameter, branch.u, branch.p, [Trace(), part], driven=False)


def _with_parameter(start: At, name: str) -> At:
    """Return the start with a constant input as the last parameter of its model."""
    model, u = start.model, dict(start.u)
    value = checks.number(f"continuation: input {name}", u.pop(name))
    (given,) = (v for v in model.u if v.name == name)
    others = tuple(v for v in model.u if v is not given)
    changed = replace(model, u=others, p=(*model.p, given))
    return replace(start, model=changed, u=u, p={**start.p, name: value})


def checked_span(
    where: str, model: Model, between: tuple[float, float], value: float, name: str
) -> tuple[float, float]:
    """Return the range of a parameter, which contains `value` and is within its bounds."""
    ends = checks.array(f"{where}: between", between, what="two numbers")
    if ends.size != 2:
        raise checks.refused(f"{where}: between", "two numbers", between)
    low, high = ends.tolist()
    if not low <= value <= high or not low < high:
        raise ValueError(
            f"{where}: between: expected a range that contains the start, {name} = {value:g}, got "
            f"{low:g} ... {high:g}"
        )
    for end in (low, high):
        model.values("p", {name: end})
    return low, high


def _unit(n: int) -> Array:
    found = np.zeros(n)
    found[-1] = 1.0
    return found


def _orbits(
    start: PeriodicOrbit, name: str, span: tuple[float, float], rtol: float
) -> tuple[Orbits, Array]:
    """Return the equations of orbits through `start`, and the unknowns there."""
    model = start.model
    reach = [start.run.extremes[v.name] for v in model.x]
    scale = np.maximum([high - low for low, high in reach], 1e-9 * model.nominal("x"))
    signs = np.ones(scale.size)
    problem = OrbitShooting(model, start.u, (name,), scale, signs, rtol, driven=start.driven)
    z = np.array([*start.x.values(), start.period, start.p[name]])
    every = np.concatenate([scale, [start.period, span[1] - span[0]]])
    return Orbits(problem, start.p, every, 10 * rtol), z


def _equilibria(
    start: Equilibrium, name: str, span: tuple[float, float]
) -> tuple[Equilibria, Array]:
    """Return the equations of equilibria through `start`, and the unknowns there."""
    eq, k = start.equations, [*start.u, *start.p].index(name)
    scale = np.append(np.maximum(eq.scale, np.abs(start.y)), span[1] - span[0])
    return Equilibria(eq, start.data, (k,), scale, 1e-11), np.append(start.y, start.data[k])


def _traced(
    curve: Family,
    node: Node,
    ways: list[Array],
    span: tuple[float, float],
    points: int,
    step: float,
) -> list[Trace]:
    """Return the parts of the curve from `node` in each direction, extended in turn."""
    first, reason = curve.point(node), f"ends after {points} points"
    traces = [Trace([first]) for _ in ways]
    running = deque(
        (trace, _extended(curve, node, tau, span, step, trace))
        for trace, tau in zip(traces, ways, strict=True)
    )
    try:
        while running and 1 + sum(len(trace.points) - 1 for trace in traces) < points:
            if next(running[0][1], False):
                running.rotate(-1)
            else:
                running.popleft()
    except KeyboardInterrupt:
        reason = INTERRUPTED
    for trace, _ in running:
        trace.message = reason
    return traces


def _extended(
    curve: Family, node: Node, tau: Array, span: tuple[float, float], step: float, trace: Trace
) -> Iterator[bool]:
    """Add points to the trace one by one; yield True as long as the curve continues."""
    for found in _steps(curve, node, tau, span, step, trace):
        trace.locate(curve, found)
        if last := at_edge(curve, found, span):
            if last is not found.node:
                trace.points.append(curve.point(last))
            trace.message = "ends at the given range"
            return
        trace.points.append(curve.point(found.node))
        if (value := curve.vanishing(trace.points)) is not None:
            trace.add("Hopf", curve, found.node, value)
            trace.message = "ends at a Hopf point"
            return
        yield True


def _steps(
    curve: Family, node: Node, tau: Array, span: tuple[float, float], step: float, trace: Trace
) -> Iterator[ContinuationStep]:
    """Yield steps along the curve, also across changes of stick and slip."""
    known = {curve.kind_of(node)}
    while True:
        near = Near(curve)
        for found in followed(curve, node, tau, step, same_sequence, near.most):
            node, tau = found.node, found.tau
            known.add(curve.kind_of(node))
            yield found
        if isinstance(curve, Equilibria) and curve.turns(node.z + step * tau * curve.scale):
            trace.message = "ends where a sliding contact comes to rest"
            return
        other = _other(curve, node, near, span, known, trace)
        if other is None:
            return
        node, away = other
        known.add(curve.kind_of(node))
        trace.points.append(curve.point(node))
        tau = tangent(curve, node, away * _unit(node.z.size))


def _other(
    curve: Family, node: Node, near: Near, span: tuple[float, float], known: set[str], trace: Trace
) -> tuple[Node, float] | None:
    """Return the orbit beyond the end of a smooth part, and the direction away from `node`.

    The part ends at a change of stick and slip, or at a fold that is too sharp to be followed.
    """
    trace.message = "ends where no further step was possible; try a smaller step or rtol"
    if not isinstance(curve, Orbits):
        return None
    if curve.problem.eq.switching:
        kind, value = near.boundary(node)
        trace.add(kind, curve, node, value)
        trace.message = f"ends where the sequence of stick and slip changes ({kind})"
    other = restarted(curve, node, span, lambda new: curve.kind_of(new) not in known)
    if other is not None and not curve.problem.eq.switching:
        trace.add("fold", curve, node)
        trace.rough("fold", float(node.z[-1]))
    return other


def _joined(
    model: Model, name: str, u: Mapping[str, Input], p: Mapping[str, float], parts: list[Trace],
    *, driven: bool,
) -> Branch:  # fmt: skip
    """Return the branch of a backward and a forward part."""
    back, on = parts
    points = [*reversed(back.points[1:]), *on.points]
    shift = max(len(back.points) - 1, 0)
    special = [replace(s, index=shift + 1 - s.index) for s in reversed(back.special)]
    special += [replace(s, index=shift + s.index) for s in on.special]
    values, x, periods, exponents, low, high, sequences = zip(*points, strict=True)
    parts_of = np.full((len(points), max(found.size for found in exponents), 2), np.nan)
    for row, found in zip(parts_of, exponents, strict=True):
        row[: found.size] = np.column_stack([found.real, found.imag])
    ends = dict.fromkeys((back.message, on.message))
    message = "; ".join(m for m in (*ends, *back.notes, *on.notes) if m)
    return Branch(
        model, name, dict(u), dict(p), np.array(values), np.array(x), np.array(periods), parts_of,
        np.array(low), np.array(high), sequences, tuple(special), message, driven,
    )  # fmt: skip
