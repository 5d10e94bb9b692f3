"""Equations of a family of periodic orbits over one parameter, and of a family of equilibria."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple, Self, final

import numpy as np
from numpy.typing import NDArray

from symfric.dynamics.balance import rows_at_rest
from symfric.dynamics.curve import Equations as Curve
from symfric.dynamics.curve import Node
from symfric.dynamics.equations import Equations
from symfric.dynamics.shooting import Linear, Shooting
from symfric.dynamics.tangent import tangent
from symfric.foundation.numeric import Array

TINY = 1e-300
CROSSES = 0.9
"""Cosine of the angle between rate and normal of a section below which a section is replaced."""


@final
@dataclass(frozen=True, eq=False)
class Orbits(Curve):
    """Equations of periodic orbits; z = (x, T, parameter), and the phase condition is a row.

    Attributes:
        problem: shooting equations with the derivatives by the parameter.
        p: values of all free parameters.
        scale, tolerance: see `Curve`.
        section: a state and the rate there: the start of each orbit is in the plane through the
            state that is orthogonal to the rate. By default, the phase is that of the prediction.
    """

    problem: Shooting
    p: Mapping[str, float]
    scale: Array
    tolerance: float
    section: tuple[Array, Array] | None = None

    @property
    def name(self) -> str:
        """Name of the parameter."""
        return self.problem.names[0]

    def at(self, z: Array) -> Node:
        """Return the linearised shooting equations; see `Curve.at`."""
        nx = z.size - 2
        if not z[nx] > 0:
            raise ValueError("the period falls to zero")
        p = {**self.p, self.name: float(z[-1])}
        return self._node(z, self.problem.linear(z[None, :nx], float(z[nx]), p))

    def _node(self, z: Array, found: Linear) -> Node:
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
        """Return the equations with a section that the orbit of `node` crosses; see `Curve`."""
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


class State(NamedTuple):
    """Equilibrium on a curve: its unknowns, and the eigenvalues of small deviations [1/s]."""

    y: Array
    d: Array
    eigenvalues: NDArray[np.complex128]
    vectors: NDArray[np.complex128]


@final
@dataclass(frozen=True, eq=False)
class Equilibria(Curve):
    """Equations of equilibria; z = (y, parameter), with the modes of y as constants.

    Attributes:
        eq: equations of the model.
        d: inputs and parameters.
        index: index of the parameter in d.
        scale, tolerance: see `Curve`.
    """

    eq: Equations
    d: Array
    index: int
    scale: Array
    tolerance: float

    def at(self, z: Array) -> Node:
        """Return the linearised equations of an equilibrium; see `Curve.at`."""
        if self.turns(z):
            raise ValueError("a sliding contact comes to rest")
        y, d = self._split(z)
        r, J = rows_at_rest(self.eq, y, d)
        own = np.setdiff1d(np.arange(y.size), np.union1d(self.eq.modes, self.eq.cyclic))
        chosen = np.append(own, y.size)
        columns = np.append(own, y.size + self.index)
        size = np.maximum((np.abs(J[:, columns]) * self.scale[chosen]).max(axis=1), TINY)
        D = np.eye(z.size)[:, chosen]
        return Node(z, r / size, J[:, columns] / size[:, None], chosen, D, (y, d))

    def turns(self, z: Array) -> bool:
        """Return True if a contact slides against the direction of its mode."""
        modes = z[[mode for _, mode in self.eq.switching]]
        return bool((modes * self.eq.sliding(*self._split(z)).full().ravel() < 0).any())

    def _split(self, z: Array) -> tuple[Array, Array]:
        """Return the unknowns, and inputs and parameters."""
        d = self.d.copy()
        d[self.index] = z[-1]
        return z[:-1], d

    def state(self, node: Node) -> State:
        """Return the equilibrium with its eigenvalues."""
        y, d = node.content
        linear = tangent(self.eq, y, d)
        values: NDArray[np.complex128]
        values, vectors = (part.astype(complex) for part in np.linalg.eig(linear.A))
        order = np.argsort(-values.real)
        directions = (linear.T @ vectors).astype(complex)
        return State(y, d, values[order], directions[:, order])
