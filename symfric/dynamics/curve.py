"""Pseudo-arclength continuation of the solutions of equations with one parameter.

    r(z) = 0,   one unknown more than equations

A step extrapolates the last points and their unit tangents tau by Hermite's polynomial. Newton's
method corrects the prediction in the plane orthogonal to tau. Coordinates are scaled. The step
length follows the number of corrections.
Source: Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems, 1977.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple, Self

import numpy as np
from scipy.interpolate import KroghInterpolator
from scipy.optimize import brentq

from symfric.dynamics.equations import Indices
from symfric.foundation.numeric import Array

CORRECTIONS, FEW = 6, 2
"""Largest number of corrections, and the number up to which the next step is longer."""
GROWTH, SHRINKAGE = 1.5, 0.4
"""Factors of the step after few corrections, and after a failure."""
SHORTEST = 1e-6
"""Shortest step relative to the longest one."""
FARTHEST = 0.5
"""Largest correction relative to the step."""
SHARP = 1e-3
"""Step, relative to the longest one, below which a turn is too sharp to be resolved."""
DEPENDENT = 1e-12
BEHIND = 3
"""Largest number of points that predict the next one."""
POLISHED = 100.0
"""Largest correction without another evaluation, in multiples of the tolerance."""
NEAR = 1e-6
"""Change of sign of a test that counts as located, relative to its values at the ends of a step."""


class Node(NamedTuple):
    """Linearised equations at z.

    Attributes:
        z: all unknowns, the parameter last, shape (n,).
        r: residuals, shape (m,).
        J: derivatives by the coordinates, shape (m, m + 1 or more rows).
        chosen: indices of the coordinates in z; the parameter is the last one.
        D: change of z by the coordinates, shape (n, coordinates).
        content: what the equations were made from.
    """

    z: Array
    r: Array
    J: Array
    chosen: Indices
    D: Array
    content: Any


class CurveEquations(ABC):
    """Equations r(z) = 0 of a curve.

    Attributes:
        scale: magnitudes of z, shape (n,).
        tolerance: largest residual and correction, relative to `scale`.
    """

    scale: Array
    tolerance: float

    @abstractmethod
    def at(self, z: Array) -> Node:
        """Return the linearised equations; residuals are relative to their magnitudes.

        Raises:
            ValueError: the equations have no values there.
        """

    def anchored(self, node: Node) -> tuple[Self, Node]:
        """Return equations whose free choices, such as a phase, suit `node`, and the node there.

        All nodes of the same equations are on one smooth curve.
        """
        return self, node


def tangent(curve: CurveEquations, node: Node, along: Array) -> Array:
    """Return the unit tangent at `node` in the direction of `along`, scaled, shape (n,)."""
    s = curve.scale[node.chosen]
    rows = np.vstack([node.J * s, (along[node.chosen])])
    right = np.zeros(rows.shape[0])
    right[-1] = 1.0
    found: Array = np.linalg.lstsq(rows, right, rcond=DEPENDENT)[0].astype(float)
    tau = (node.D @ (s * found)) / curve.scale
    return tau / np.linalg.norm(tau[node.chosen])


def corrected(curve: CurveEquations, z: Array, tau: Array) -> tuple[Node, int]:
    """Return the solution next to `z` in the plane orthogonal to `tau`, and the corrections.

    Raises:
        ValueError: the correction does not converge.
    """
    start, before = z, np.inf
    for count in range(CORRECTIONS + 1):
        node = curve.at(z)
        s = curve.scale[node.chosen]
        off = float(tau @ ((node.z - start) / curve.scale))
        rows = np.vstack([node.J * s, tau[node.chosen]])
        right = np.append(-node.r, -off)
        size = float(np.abs(node.r).max(initial=0.0))
        if size > max(before, curve.tolerance):
            break
        before = size
        step = np.linalg.lstsq(rows, right, rcond=DEPENDENT)[0]
        z = node.z + node.D @ (s * step)
        if size <= curve.tolerance:
            small = np.abs(step).max(initial=0.0) <= POLISHED * curve.tolerance
            return (node._replace(z=z) if small else node), count
    raise ValueError("the correction does not converge")


class ContinuationStep(NamedTuple):
    """Step of a continuation.

    Attributes:
        node, tau: solution and tangent at its end.
        start, along: node and tangent at its start.
        length: its length.
        sharp: True if the curve turns back within the step, too sharply to be resolved.
    """

    node: Node
    tau: Array
    start: Node
    along: Array
    length: float
    sharp: bool


def followed(
    curve: CurveEquations, node: Node, tau: Array, longest: float,
    accept: Callable[[Node, Node], None], most: Callable[[ContinuationStep], float],
) -> Iterator[ContinuationStep]:  # fmt: skip
    """Yield steps along the curve until no step is possible.

    Args:
        curve: the equations.
        node, tau: start and its tangent.
        longest: longest step.
        accept: function of the last and a new node that raises a ValueError to refuse the new one.
        most: function of a step that returns the largest length of the next one; 0 ends the curve.
    """
    curve, node = curve.anchored(node)
    tau = tangent(curve, node, tau)
    length, turn = longest / 10, _turn(curve, node, tau)
    past = [(0.0, node, tau)]
    while length >= SHORTEST * longest:
        move = _predicted(past, length, curve.scale)
        try:
            new, count = corrected(curve, node.z + move * curve.scale, tau)
            off = float(np.linalg.norm(((new.z - node.z) / curve.scale - move)[new.chosen]))
            if off > FARTHEST * length:
                raise ValueError("the correction leads to another part of the curve")
            accept(node, new)
            after = tangent(curve, new, tau)
            other = turn * _turn(curve, new, after) < 0
            if other and length > SHARP * longest:
                raise ValueError("the orientation of the curve changes within the step")
            sharp = other and turn * _turn_before(curve, new, after, length) < 0
        except ValueError:
            length, past = length * SHRINKAGE, past[-2:] if len(past) > 2 else past[-1:]
            continue
        if sharp:
            after = -after
        elif other:
            turn = -turn  # a branch point
        step = ContinuationStep(new, after, node, tau, length, sharp)
        yield step
        past = _behind(past, step, curve.scale)
        same, (curve, node) = curve, curve.anchored(new)
        if curve is not same:
            after = tangent(curve, node, after)
            past = [(0.0, node, after)]
        tau, longer = after, length * GROWTH if count <= FEW else length
        length = min(longest, longer, most(step))


Past = Sequence[tuple[float, Node, Array]]
"""Arc length, node and tangent of the last points."""


def _predicted(past: Past, length: float, scale: Array) -> Array:
    """Return the scaled change of z over the next `length` by Hermite's polynomial."""
    at = np.repeat([s for s, _, _ in past], 2)
    rows = [part for _, node, tau in past for part in (node.z / scale, tau)]
    ahead: Array = KroghInterpolator(at, rows)(at[-1] + length)
    return ahead - past[-1][1].z / scale


def _behind(past: Past, step: ContinuationStep, scale: Array) -> Past:
    """Return the points that predict the step after `step`."""
    new = (0.0, step.node, step.tau)
    if step.sharp or not np.array_equal(step.node.chosen, step.start.chosen):
        return [new]
    chord = float(np.linalg.norm(((step.node.z - step.start.z) / scale)[step.node.chosen]))
    bend = float(np.linalg.norm((step.tau - step.along)[step.node.chosen]))
    arc = chord * (1 + bend**2 / 24)
    shift = past[-1][0] + arc
    return [*((s - shift, node, tau) for s, node, tau in past[1 - BEHIND :]), new]


def _turn_before(curve: CurveEquations, node: Node, tau: Array, length: float) -> float:
    """Return the orientation on the same part of the curve as `node`, a step before it.

    If it equals that of `node`, the last step did not cross a branch point: it led across a turn to
    the other part of the curve.
    """
    back, _ = corrected(curve, node.z - length * tau * curve.scale, tau)
    return _turn(curve, back, tangent(curve, back, tau))


def _turn(curve: CurveEquations, node: Node, tau: Array) -> float:
    """Return the orientation of the curve, 1 or -1, which is constant except at branch points.

    It is the sign of the determinant of the equations with the tangent; 0 if they are not square.
    """
    rows = np.vstack([node.J * curve.scale[node.chosen], tau[node.chosen]])
    return float(np.linalg.slogdet(rows)[0]) if rows.shape[0] == rows.shape[1] else 0.0


def located(
    curve: CurveEquations, step: ContinuationStep, test: Callable[[Node, Array], float]
) -> tuple[Node, Array]:
    """Return the node of a step, and its tangent, at which `test` of these changes its sign.

    The search ends where the equations cannot be solved more accurately. If it ends far from the
    change, the end of the step is returned.
    """
    found: dict[float, tuple[Node, Array]] = {}
    values: dict[float, float] = {}
    way = step.length * step.along * curve.scale
    bend = step.node.z - step.start.z - way

    def value(length: float) -> float:
        share = length / step.length
        node, _ = corrected(curve, step.start.z + share * way + share**2 * bend, step.along)
        found[length] = node, tangent(curve, node, step.along)
        values[length] = test(*found[length])
        return values[length]

    try:
        root: Any = brentq(value, 0.0, step.length, xtol=1e-12 * step.length)
    except (ValueError, RuntimeError):
        sizes = {length: abs(at) for length, at in values.items()}
        root = min(sizes, key=lambda length: sizes[length], default=None)
        if root is None or sizes[root] > NEAR * max(sizes.values()):
            return step.node, step.tau
    if root not in found:
        value(float(root))
    return found[float(root)]


def at_edge(
    curve: CurveEquations, step: ContinuationStep, span: tuple[float, float]
) -> Node | None:
    """Return the node at which the last unknown leaves `span`; None if it stays within."""
    low, high = span
    value = float(step.node.z[-1])
    if low < value < high:
        return None
    edge = low if value <= low else high
    return located(curve, step, lambda node, _: float(node.z[-1]) - edge)[0]
