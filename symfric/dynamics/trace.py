"""Points of a branch and the location of its special points."""

from dataclasses import dataclass, field, replace
from typing import NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from symfric.dynamics.branch import Special
from symfric.dynamics.curve import Node, Step, located
from symfric.dynamics.families import Equilibria, Orbits
from symfric.dynamics.shooting import Linear
from symfric.foundation.numeric import Array
from symfric.results.signals import extremes

Family = Orbits | Equilibria
NEUTRAL = 1e-7
"""Growth within which a deviation counts as neutral."""
REAL = 1e-6
"""Imaginary part, relative to the size, below which an exponent counts as real."""
VANISHES = 2e-2
"""Size of orbits, relative to the magnitudes of states, below which they end at a Hopf point."""
FINER = 1e-3
"""Factor of the tolerances for the location of special points."""


class Point(NamedTuple):
    """Point of a branch, as in `Branch`."""

    value: float
    x: Array
    period: float
    exponents: NDArray[np.complex128]
    low: Array
    high: Array
    sequence: str


@final
@dataclass(eq=False)
class Trace:
    """Points and special points of one direction, filled while it is followed."""

    points: list[Point] = field(default_factory=list[Point])
    special: list[Special] = field(default_factory=list[Special])
    message: str = ""
    notes: list[str] = field(default_factory=list[str])

    def add(self, kind: str, curve: "Family", node: Node, value: float | None = None) -> None:
        """Add a special point at a node, or at another value of the parameter next to it."""
        at = float(node.z[-1]) if value is None else value
        found = Special(kind, at, len(self.points), *state(curve, node), np.zeros(0))
        self.special.append(found)

    def rough(self, kind: str, value: float) -> None:
        """Note that a special point was located to the end of its step only."""
        self.notes.append(f"the {kind} near {value:.6g} is located to its step only")


def size(curve: Orbits, point: Point) -> float:
    """Return the largest range of a state over an orbit, relative to its magnitude."""
    return float(((point.high - point.low) / curve.scale[: point.x.size]).max())


def vanishing(curve: Family, points: list[Point]) -> float | None:
    """Return the parameter at which orbits that become small vanish; None for other orbits.

    The square of their size is linear in the parameter near a Hopf point.
    """
    if not isinstance(curve, Orbits) or curve.problem.driven or len(points) < 2:
        return None
    one, other = points[-2:]
    a, b = size(curve, one) ** 2, size(curve, other) ** 2
    if not b < min(a, VANISHES**2):
        return None
    return other.value + (other.value - one.value) * b / (a - b)


def finer(curve: Family) -> Family:
    """Return the equations with a tighter tolerance, for the location of special points."""
    if not isinstance(curve, Orbits):
        return curve
    problem = replace(curve.problem, rtol=max(curve.problem.rtol * FINER, 1e-12))
    return replace(curve, problem=problem, tolerance=max(curve.tolerance * FINER, 1e-10))


def sequence(node: Node) -> str:
    """Return the events of one period, from the first stick on; empty for an equilibrium."""
    if isinstance(node.content, Linear):
        return " ".join(name for _, name in node.content.segments[0].run.happened)
    return ""


def state(curve: Family, node: Node) -> tuple[Array, float]:
    """Return states and period of a node; the period is 0 for an equilibrium."""
    if isinstance(curve, Orbits):
        return node.z[:-2], float(node.z[-2])
    return node.z[: len(curve.eq.model.x)], 0.0


def exponents(curve: Family, node: Node) -> NDArray[np.complex128]:
    """Return the eigenvalues of an equilibrium, or the multipliers of an orbit."""
    if isinstance(curve, Orbits):
        return node.content.multipliers(driven=curve.problem.driven)
    return curve.state(node).eigenvalues


def point(curve: Family, node: Node) -> Point:
    """Return the point of a branch at a node."""
    x, period = state(curve, node)
    low = high = x
    if isinstance(curve, Orbits):
        run = node.content.segments[0].run
        reach = extremes(run.looks, run.states(run.looks), run.states)
        low, high = np.array([reach[v.name] for v in curve.problem.model.x]).T
    return Point(float(node.z[-1]), x, period, exponents(curve, node), low, high, sequence(node))


def note(curve: Family, step: Step, trace: Trace) -> None:
    """Locate the special points within a step."""
    if step.sharp:
        far = max((step.start, step.node), key=lambda n: float(n.z[-1]) * step.along[-1])
        trace.add("fold", curve, far)
        trace.rough("fold", float(far.z[-1]))
        return
    turns = bool(step.along[-1] * step.tau[-1] < 0)
    if turns:
        node, _ = located(finer(curve), step, lambda _, tau: float(tau[-1]))
        trace.add("fold", curve, node)
        if node is step.node:
            trace.rough("fold", float(node.z[-1]))
    before, after = (growths(curve, n) for n in (step.start, step.node))
    first, last = (int((g > NEUTRAL).sum()) for g in (before, after))
    if first == last or before.size != after.size or (turns and abs(first - last) == 1):
        return
    for k in {max(first, last) - 1, min(first, last)}:
        if before[k] * after[k] < 0:
            node, _ = located(finer(curve), step, lambda n, _, k=k: float(growths(curve, n)[k]))
            trace.special.append(named(curve, node, k, len(trace.points)))
            if node is step.node:
                trace.rough(trace.special[-1].kind, float(node.z[-1]))
            return


def kind_of(curve: Family, node: Node) -> str:
    """Return the events of an orbit, or without events the side of a fold on which it is.

    The parity of the number of real multipliers above 1 changes at a fold.
    """
    found = exponents(curve, node)
    above = (np.abs(found.imag) < REAL * np.abs(found)) & (found.real > 1)
    return sequence(node) or ("odd" if above.sum() % 2 else "even")


def growths(curve: Family, node: Node) -> Array:
    """Return the growth of all deviations, the largest first."""
    found = exponents(curve, node)
    if isinstance(curve, Orbits):
        return np.sort(np.log(np.maximum(np.abs(found), 1e-300)))[::-1]
    return np.sort(found.real)[::-1]


def named(curve: Family, node: Node, k: int, index: int) -> Special:
    """Return the special point at a node at which the growth number `k` vanishes."""
    found, (x, period) = exponents(curve, node), state(curve, node)
    if isinstance(curve, Orbits):
        critical = found[np.argsort(-np.abs(found))][k]
        real = abs(critical.imag) < REAL * abs(critical)
        kind = "Neimark-Sacker"
        if real:
            kind = "period doubling" if critical.real < 0 else "branch point"
        return Special(kind, float(node.z[-1]), index, x, period, np.zeros(0))
    at = curve.state(node)
    k = int(np.argmin(np.abs(found.real)))
    if abs(found[k].imag) < REAL * max(1e-300, float(np.abs(found).max())):
        return Special("branch point", float(node.z[-1]), index, x, 0.0, np.zeros(0))
    direction = at.vectors[: x.size, k].real
    period = 2 * np.pi / abs(float(found[k].imag))
    return Special("Hopf", float(node.z[-1]), index, x, period, direction)
