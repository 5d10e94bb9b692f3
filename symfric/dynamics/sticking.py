"""Change of the sequence of stick and slip along a branch of periodic orbits."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, final

import casadi as ca
import numpy as np

from symfric.dynamics.curve import ContinuationStep, Node, corrected
from symfric.dynamics.families import Family, Orbits, sequence
from symfric.dynamics.orbit import periodic_orbit
from symfric.foundation.numeric import Array
from symfric.foundation.status import SolveError
from symfric.integrator import Trajectory, simulate
from symfric.model import Contact
from symfric.results.signals import extremes

GRAZES, NEARLY = 1e-3, 1e-2
"""Distances from sticking, relative to the largest sliding velocity, at which a branch ends, and up
to which its end is a grazing."""
CLOSER, HALF = 0.9, 0.4
"""Share of the way to a predicted grazing that a step may take, and longest step relative to the
size of an orbit."""
GRAZINGS = 4
"""Number of orbits that approach a grazing."""
MOMENT = 1e-6
"""Time, relative to the period, over which a rate is measured."""
NEAR = (1e-3, 1e-2)
"""Distances from the boundary at which the other orbit is sought, relative to the range."""
PERIODS = 6
"""Number of periods of a run that settles to the other orbit."""


class Gap(NamedTuple):
    """Smallest distance of an orbit from sticking.

    Attributes:
        contact: index among the contacts with modes that never stick; -1 without such contacts.
        time: time of the smallest sliding velocity [s].
        least: the smallest sliding velocity, with the sign of the sliding.
        share: |least| relative to the largest sliding velocity.
    """

    contact: int
    time: float
    least: float
    share: float


def gap(curve: Orbits, node: Node) -> Gap:
    """Return the smallest distance of an orbit from sticking."""
    run, eq, model = node.content.segments[0].run, curve.problem.eq, curve.problem.model
    best = Gap(-1, 0.0, 0.0, np.inf)
    happened = {name for _, name in run.happened}

    def sizes(at: Array) -> dict[str, Array]:
        y = np.zeros((eq.y.numel(), at.size))
        y[: len(model.x)] = [*run.states(at).values()]
        known = run.at(at) if model.u else {}
        d = [*(known[v.name] for v in model.u), *np.outer(node.content.p, np.ones(at.size))]
        slips = eq.values(y, np.array(d).reshape(-1, at.size))[2].full()
        return {str(k): row for k, row in enumerate(np.abs(slips))}

    free = {str(k) for k, (c, _) in enumerate(eq.switching) if c.called("stick") not in happened}
    if not free:
        return best
    looked = sizes(run.looks)
    for name, (low, high) in extremes(run.looks, looked, sizes).items():
        if name in free and low / high < best.share:
            time = float(run.looks[int(np.argmin(looked[name]))])
            best = Gap(int(name), time, float(low), float(low / high))
    return best


def same_sequence(last: Node, new: Node) -> None:
    """Raise a ValueError if the events of two orbits differ."""
    if sequence(last) != sequence(new):
        raise ValueError("the sequence of stick and slip changes")


@final
@dataclass(eq=False)
class Near:
    """Distance of the last orbits from sticking, which limits the steps.

    The distance of a sliding orbit is smooth along the curve: its zero is the grazing.
    """

    curve: Family
    gaps: tuple[Gap, ...] = ()
    last: ContinuationStep | None = None

    def most(self, step: ContinuationStep) -> float:
        """Return the largest length of the next step: short of the predicted grazing."""
        if not isinstance(self.curve, Orbits):
            return np.inf
        run, problem = step.node.content.segments[0].run, self.curve.problem
        self.gaps, self.last = (*self.gaps[-1:], gap(self.curve, step.node)), step
        if self.gaps[-1].share < GRAZES:
            return 0.0
        values = np.array([*run.states(run.looks).values()])
        size = float((np.ptp(values, axis=1) / problem.scale)[problem.states].max())
        return min(max(CLOSER * self._way(), 0.0), HALF * size)

    def _way(self) -> float:
        """Return the length from the last node to the grazing."""
        if len(self.gaps) < 2 or self.last is None:
            return np.inf
        one, other = self.gaps
        if one.contact != other.contact or not other.least < one.least:
            return np.inf
        return self.last.length * other.least / (one.least - other.least)

    def boundary(self, node: Node) -> tuple[str, float]:
        """Return the kind and the parameter of the change after `node`."""
        value, last, curve = float(node.z[-1]), self.last, self.curve.finer()
        if not isinstance(curve, Orbits) or last is None or not self.gaps:
            return "change of stick and slip", value
        if self.gaps[-1].share > NEARLY:
            return _stopping(last)
        way, found = CLOSER * self._way(), [(0.0, self.gaps[-1].least, value)]
        for _ in range(GRAZINGS):
            z = last.node.z + way * last.tau * curve.scale
            try:
                new, _ = corrected(curve, z, last.tau)
                same_sequence(node, new)
            except ValueError:
                break
            found = [*found[-1:], (way, gap(curve, new).least, float(new.z[-1]))]
            end = _zero([(w, g) for w, g, _ in found], way)
            way += CLOSER * (end - way)
        return "grazing", _zero([(v, g) for _, g, v in found], value)


def _zero(points: Sequence[tuple[float, float]], otherwise: float) -> float:
    """Return the zero of the line through two points."""
    if len(points) < 2 or points[0][1] == points[1][1]:
        return otherwise
    (p_0, g_0), (p_1, g_1) = points
    return p_1 - g_1 * (p_1 - p_0) / (g_1 - g_0)


def _stopping(step: ContinuationStep) -> tuple[str, float]:
    """Return the kind and the parameter of the end of an orbit that sticks.

    It ends in a grazing if the slip reaches zero ever more slowly. The square of its rate is then
    linear in the parameter.
    """
    rates = [_slowest(n.content.segments[0].run) for n in (step.start, step.node)]
    values = [float(n.z[-1]) for n in (step.start, step.node)]
    (before, _), (after, share) = rates
    if share > NEARLY or not after < before:
        return "change of stick and slip", values[1]
    return "grazing", _zero([(p, r**2) for p, (r, _) in zip(values, rates, strict=True)], values[1])


def _slowest(run: Trajectory) -> tuple[float, float]:
    """Return the smallest rate at which a slip reaches zero, and its share of the largest rate."""
    least, share = np.inf, np.inf
    for c in run.model.contacts:
        h = MOMENT * (run.span[1] - run.span[0])
        own = [t for t, name in run.happened if name == c.called("stick")]
        times = np.array([t for t in own if t - 2 * h > run.span[0]])
        if not times.size:
            continue
        inside = run.looks[run.looks >= run.span[0] + h]
        rates = np.abs(run.of(c.slip, times - h) - run.of(c.slip, times - 2 * h)) / h
        every = np.abs(run.of(c.slip, inside) - run.of(c.slip, inside - h)) / h
        if rates.min() / every.max() < share:
            least, share = float(rates.min()), float(rates.min() / every.max())
    return least, share


def restarted(
    curve: Orbits, node: Node, span: tuple[float, float], accept: Callable[[Node], bool]
) -> tuple[Node, float] | None:
    """Return an orbit next to `node` that is accepted, and the direction away from `node`.

    The contact that is nearest to sticking is put into stick where it is nearest, and a run leads
    to the other orbit. Without such a contact, the run starts from the orbit itself.
    """
    problem, name = curve.problem, curve.name
    model, run = problem.model, node.content.segments[0].run
    nearest, value, T = gap(curve, node), float(node.z[-1]), float(node.z[-2])
    first, given = (nearest.time, T) if problem.driven else (0.0, None)
    for share in NEAR:
        for side in (-1.0, 1.0):
            p = {**curve.p, name: value + side * share * (span[1] - span[0])}
            if not span[0] < p[name] < span[1]:
                continue
            x = {v.name: float(run.at(nearest.time)[v.name][0]) for v in model.x}
            if nearest.contact >= 0:
                c, mode = problem.eq.switching[nearest.contact]
                x[model.x[mode].name] = 0.0
                x |= _at_rest(run, nearest.time, c, x, p)
            try:
                settled = simulate(
                    model, first + PERIODS * T, t_start=first, x0=x, u=problem.u, p=p, rtol=1e-7
                )
                orbit = periodic_orbit(
                    model, settled, u=problem.u, p=p, period=given, rtol=problem.rtol
                )
                z = np.array([*orbit.x.values(), orbit.period, p[name]])
                found = curve.at(z)
            except (ValueError, SolveError):
                continue
            if accept(found):
                return found, side
    return None


def _at_rest(
    run: Trajectory, time: float, c: Contact, x: Mapping[str, float], p: Mapping[str, float]
) -> dict[str, float]:
    """Return the states by name that a contact sets where its slip becomes zero."""
    model = run.model
    symbols = [model.vector(group) for group in ("x", "u", "p")]
    u = [float(run.at(time)[v.name][0]) for v in model.u]
    known = [*x.values()], u, model.values("p", p)
    return {
        name: float(ca.Function("rest", symbols, [ca.SX(value)])(*known))
        for name, value in c.rest.items()
    }
