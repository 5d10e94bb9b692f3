"""Families of periodic orbits and equilibria over parameters, and their special points."""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple, Self, final

import numpy as np
from numpy.typing import NDArray

from symfric.dynamics.balance import rows_at_rest
from symfric.dynamics.branch import Special
from symfric.dynamics.curve import ContinuationStep, CurveEquations, Node, located
from symfric.dynamics.equations import ModelEquations, tangent
from symfric.dynamics.shooting import LinearisedShooting, OrbitShooting
from symfric.foundation.numeric import Array
from symfric.results.signals import extremes

TINY = 1e-300
CROSSES = 0.9
"""Cosine of the angle between rate and normal of a section below which a section is replaced."""
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


def sequence(node: Node) -> str:
    """Return the events of one period, from the first stick on; empty for an equilibrium."""
    if isinstance(node.content, LinearisedShooting):
        return " ".join(name for _, name in node.content.segments[0].run.happened)
    return ""


class Family(CurveEquations):
    """Equations of a family over one parameter, and the deviations from its members."""

    @abstractmethod
    def state(self, node: Node) -> tuple[Array, float]:
        """Return states and period of a node; the period is 0 for an equilibrium."""

    @abstractmethod
    def exponents(self, node: Node) -> NDArray[np.complex128]:
        """Return the eigenvalues of an equilibrium, or the multipliers of an orbit."""

    @abstractmethod
    def growths(self, node: Node) -> Array:
        """Return the growth of all deviations, the largest first."""

    @abstractmethod
    def critical(self, node: Node, k: int) -> tuple[str, float, Array]:
        """Return kind, period and direction, as in `Special`, where growth number `k` vanishes."""

    def finer(self) -> Self:
        """Return the equations with a tighter tolerance, for the location of special points."""
        return self

    def vanishing(self, points: list[Point]) -> float | None:
        """Return the parameter at which orbits that become small vanish; None for others."""
        del points
        return None

    def extremes(self, node: Node) -> tuple[Array, Array]:
        """Return the smallest and the largest values of the states."""
        x, _ = self.state(node)
        return x, x

    def point(self, node: Node) -> Point:
        """Return the point of a branch at a node."""
        x, period = self.state(node)
        low, high = self.extremes(node)
        found = self.exponents(node)
        return Point(float(node.z[-1]), x, period, found, low, high, sequence(node))

    def kind_of(self, node: Node) -> str:
        """Return the events of an orbit, or without events the side of a fold on which it is.

        The parity of the number of real multipliers above 1 changes at a fold.
        """
        found = self.exponents(node)
        above = (np.abs(found.imag) < REAL * np.abs(found)) & (found.real > 1)
        return sequence(node) or ("odd" if above.sum() % 2 else "even")


@final
@dataclass(frozen=True, eq=False)
class Orbits(Family):
    """Equations of periodic orbits; z = (x, T, parameter), and the phase condition is a row.

    Attributes:
        problem: shooting equations with the derivatives by the parameter.
        p: values of all free parameters.
        scale, tolerance: see `CurveEquations`.
        section: a state and the rate there: the start of each orbit is in the plane through the
            state that is orthogonal to the rate. By default, the phase is that of the prediction.
    """

    problem: OrbitShooting
    p: Mapping[str, float]
    scale: Array
    tolerance: float
    section: tuple[Array, Array] | None = None

    @property
    def name(self) -> str:
        """Name of the parameter."""
        return self.problem.names[0]

    def at(self, z: Array) -> Node:
        """Return the linearised shooting equations; see `CurveEquations.at`."""
        nx = z.size - 2
        if not z[nx] > 0:
            raise ValueError("the period falls to zero")
        p = {**self.p, self.name: float(z[-1])}
        return self._node(z, self.problem.linear(z[None, :nx], float(z[nx]), p))

    def _node(self, z: Array, found: LinearisedShooting) -> Node:
        """Return the node of linearised shooting equations at z."""
        nx, (chosen, basis), part = z.size - 2, found.bases[0], found.segments[0]
        z, s = np.concatenate([part.start, z[nx:]]), self.scale[chosen]
        free = [nx + 1] if self.problem.driven else [nx, nx + 1]
        every = np.append(chosen, free)
        D = np.zeros((z.size, every.size))
        D[:nx, : chosen.size], D[free, range(chosen.size, every.size)] = basis, 1.0
        rows, slopes = [found.r / s], [found.J / s[:, None]]
        if not self.problem.driven:
            state, rate = (part.start, part.rates[0]) if self.section is None else self.section
            normal = rate / self.problem.scale**2
            phase = normal @ basis
            size = max(float(np.abs(phase * s).max()), TINY)
            rows.append(np.array([normal @ (part.start - state) / size]))
            slopes.append(np.append(phase, [0.0, 0.0])[None, :] / size)
        return Node(z, np.concatenate(rows), np.vstack(slopes), every, D, found)

    def anchored(self, node: Node) -> tuple[Self, Node]:
        """Return the equations with a section that the orbit of `node` crosses."""
        if self.problem.driven:
            return self, node
        part, size = node.content.segments[0], self.problem.scale
        own = part.rates[0] / size
        if self.section is not None:
            normal = self.section[1] / size
            if own @ normal > CROSSES * np.linalg.norm(own) * np.linalg.norm(normal):
                return self, node
        curve = replace(self, section=(part.start, part.rates[0]))
        return curve, curve._node(node.z, node.content)

    def state(self, node: Node) -> tuple[Array, float]:
        """Return states and period; see `Family.state`."""
        return node.z[:-2], float(node.z[-2])

    def exponents(self, node: Node) -> NDArray[np.complex128]:
        """Return the multipliers; see `Family.exponents`."""
        return node.content.multipliers(driven=self.problem.driven)

    def growths(self, node: Node) -> Array:
        """Return the logarithms of the sizes of the multipliers; see `Family.growths`."""
        return np.sort(np.log(np.maximum(np.abs(self.exponents(node)), 1e-300)))[::-1]

    def critical(self, node: Node, k: int) -> tuple[str, float, Array]:
        """Return kind, period and direction; see `Family.critical`."""
        found = self.exponents(node)
        value = found[np.argsort(-np.abs(found))][k]
        kind = "Neimark-Sacker"
        if abs(value.imag) < REAL * abs(value):
            kind = "period doubling" if value.real < 0 else "branch point"
        return kind, float(node.z[-2]), np.zeros(0)

    def finer(self) -> Self:
        """Return the equations with a tighter tolerance; see `Family.finer`."""
        problem = replace(self.problem, rtol=max(self.problem.rtol * FINER, 1e-12))
        return replace(self, problem=problem, tolerance=max(self.tolerance * FINER, 1e-10))

    def vanishing(self, points: list[Point]) -> float | None:
        """Return the parameter at which orbits vanish; see `Family.vanishing`.

        The square of their size is linear in the parameter near a Hopf point.
        """
        if self.problem.driven or len(points) < 2:
            return None
        one, other = points[-2:]
        own = self.problem.states
        sizes = (((p.high - p.low)[own] / self.scale[own]).max() for p in (one, other))
        a, b = (float(size) ** 2 for size in sizes)
        if not b < min(a, VANISHES**2):
            return None
        return other.value + (other.value - one.value) * b / (a - b)

    def extremes(self, node: Node) -> tuple[Array, Array]:
        """Return the smallest and the largest values of the states over an orbit."""
        run = node.content.segments[0].run
        reach = extremes(run.looks, run.states(run.looks), run.states)
        low, high = np.array([reach[v.name] for v in self.problem.model.x]).T
        return low, high


@final
@dataclass(frozen=True, eq=False)
class Equilibria(Family):
    """Equations of equilibria; z = (y, parameters), with the modes of y as constants.

    Attributes:
        eq: equations of the model.
        d: inputs and parameters.
        free: indices of the free parameters in d.
        scale, tolerance: see `CurveEquations`.
    """

    eq: ModelEquations
    d: Array
    free: tuple[int, ...]
    scale: Array
    tolerance: float

    def at(self, z: Array) -> Node:
        """Return the linearised equations of an equilibrium; see `CurveEquations.at`."""
        if self.turns(z):
            raise ValueError("a sliding contact comes to rest")
        y, d = self.split(z)
        r, J = rows_at_rest(self.eq, y, d)
        own = np.setdiff1d(np.arange(y.size), np.union1d(self.eq.modes, self.eq.cyclic))
        chosen = np.append(own, np.arange(y.size, z.size))
        columns = np.append(own, [y.size + k for k in self.free])
        size = np.maximum((np.abs(J[:, columns]) * self.scale[chosen]).max(axis=1), TINY)
        D = np.eye(z.size)[:, chosen]
        return Node(z, r / size, J[:, columns] / size[:, None], chosen, D, (y, d))

    def turns(self, z: Array) -> bool:
        """Return True if a contact slides against the direction of its mode."""
        modes = z[[mode for _, mode in self.eq.switching]]
        slips = self.eq.values(*self.split(z))[2].full().ravel()
        return bool((modes * slips < 0).any())

    def split(self, z: Array) -> tuple[Array, Array]:
        """Return the unknowns, and inputs and parameters."""
        d, count = self.d.copy(), len(self.free)
        d[[*self.free]] = z[-count:]
        return z[:-count], d

    def state(self, node: Node) -> tuple[Array, float]:
        """Return the states; see `Family.state`."""
        return node.z[: len(self.eq.model.x)], 0.0

    def exponents(self, node: Node) -> NDArray[np.complex128]:
        """Return the eigenvalues; see `Family.exponents`."""
        return self._modes(node)[0]

    def growths(self, node: Node) -> Array:
        """Return the real parts of the eigenvalues; see `Family.growths`."""
        return np.sort(self.exponents(node).real)[::-1]

    def critical(self, node: Node, k: int) -> tuple[str, float, Array]:
        """Return kind, period and direction; see `Family.critical`."""
        values, vectors = self._modes(node)
        k = int(np.argmin(np.abs(values.real)))
        if abs(values[k].imag) < REAL * max(1e-300, float(np.abs(values).max())):
            return "branch point", 0.0, np.zeros(0)
        direction = vectors[: len(self.eq.model.x), k].real
        return "Hopf", 2 * np.pi / abs(float(values[k].imag)), direction

    def _modes(self, node: Node) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """Return the eigenvalues [1/s], without those of cyclic states, and directions in y."""
        linear = tangent(self.eq, *node.content)
        values: NDArray[np.complex128]
        values, vectors = (part.astype(complex) for part in np.linalg.eig(linear.A))
        decided = np.sort(np.argsort(np.abs(values))[self.eq.cyclic.size :])  # theirs are zero
        order = decided[np.argsort(-values[decided].real)]
        return values[order], (linear.T @ vectors).astype(complex)[:, order]


@final
@dataclass(eq=False)
class Trace:
    """Points and special points of one direction, filled while it is followed."""

    points: list[Point] = field(default_factory=list[Point])
    special: list[Special] = field(default_factory=list[Special])
    message: str = ""
    notes: list[str] = field(default_factory=list[str])

    def add(self, kind: str, curve: Family, node: Node, value: float | None = None) -> None:
        """Add a special point at a node, or at another value of the parameter next to it."""
        at = float(node.z[-1]) if value is None else value
        found = Special(kind, at, len(self.points), *curve.state(node), np.zeros(0))
        self.special.append(found)

    def rough(self, kind: str, value: float) -> None:
        """Note that a special point was located to the end of its step only."""
        self.notes.append(f"the {kind} near {value:.6g} is located to its step only")

    def locate(self, curve: Family, step: ContinuationStep) -> None:
        """Add the special points within a step."""
        if step.sharp:
            far = max((step.start, step.node), key=lambda n: float(n.z[-1]) * step.along[-1])
            self.add("fold", curve, far)
            self.rough("fold", float(far.z[-1]))
            return
        turns = bool(step.along[-1] * step.tau[-1] < 0)
        if turns:
            node, _ = located(curve.finer(), step, lambda _, tau: float(tau[-1]))
            self.add("fold", curve, node)
            if node is step.node:
                self.rough("fold", float(node.z[-1]))
        before, after = (curve.growths(n) for n in (step.start, step.node))
        first, last = (int((g > NEUTRAL).sum()) for g in (before, after))
        if first == last or before.size != after.size or (turns and abs(first - last) == 1):
            return
        for k in {max(first, last) - 1, min(first, last)}:
            if before[k] * after[k] < 0:
                finer = curve.finer()
                node, _ = located(finer, step, lambda n, _, k=k: float(curve.growths(n)[k]))
                kind, period, direction = curve.critical(node, k)
                x, value = curve.state(node)[0], float(node.z[-1])
                self.special.append(Special(kind, value, len(self.points), x, period, direction))
                if node is step.node:
                    self.rough(kind, value)
                return
