"""Curves of Hopf points and folds of equilibria in the plane of two parameters.

    equilibrium at (p_1, p_2),   Re s(p_1, p_2) = 0

s is the eigenvalue of the linearised equations that is next to the imaginary axis: complex at a
Hopf point, real at a fold.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, cast, final

import numpy as np
from numpy.typing import NDArray

from symfric.dynamics.branch import Branch, Special
from symfric.dynamics.continuation import checked_span
from symfric.dynamics.curve import CurveEquations, Node, at_edge, corrected, followed
from symfric.dynamics.curve import tangent as direction
from symfric.dynamics.equations import equations, tangent
from symfric.dynamics.families import REAL, TINY, Equilibria
from symfric.foundation import checks
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import check_names
from symfric.foundation.shown import Showing, Shown
from symfric.model import Model

if TYPE_CHECKING:
    from matplotlib.figure import Figure

KINDS = ("Hopf", "fold")
CHANGE = 1e-5
"""Change of the unknowns, relative to their magnitudes, in differences of the eigenvalue."""


@final
@dataclass(frozen=True, eq=False, repr=False)
class Boundary(Showing):
    """Curve of Hopf points or folds of equilibria in two parameters.

    Attributes:
        model: the model.
        kind: "Hopf" or "fold".
        parameters: names of both parameters.
        values: their values, shape (n, 2), in the order of the curve.
        x: states, shape (n, nx).
        periods: periods [s] of the oscillation at Hopf points, shape (n,); 0 at folds.
        message: reasons why the curve ends.
    """

    model: Model
    kind: str
    parameters: tuple[str, str]
    values: Array
    x: Array
    periods: Array
    message: str

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Plot the first parameter over the second one.

        Args:
            path: image file.
        """
        from symfric.foundation.panels import NARROW, panels, save  # noqa: PLC0415  (slow to import)
        from symfric.foundation.style import line  # noqa: PLC0415  (slow to import)

        units = {v.name: v.unit for v in self.model.p}
        first, second = (f"{name} [{units[name]}]" for name in self.parameters)
        figure, (axis,) = panels(1, width=NARROW, height=3.0)
        axis.plot(*self.values.T[::-1], linewidth=1.6, label=self.kind, **line(0))
        axis.set(xlabel=second, ylabel=first)
        axis.legend(frameon=False, fontsize="small")
        return save(figure, path)

    def shown(self) -> Shown:
        """Return the ranges of both parameters."""
        low, high = self.values.min(axis=0), self.values.max(axis=0)
        ranges = ", ".join(
            f"{name} from {a:.6g} to {b:.6g}"
            for name, a, b in zip(self.parameters, low, high, strict=True)
        )
        title = f"{self.kind} points of '{self.model.name}'"
        return Shown(title, (f"{len(self.values)} points, {ranges}", self.message))


@final
@dataclass(frozen=True, eq=False)
class BoundaryEquations(CurveEquations):
    """Equations of a boundary; z = (y, first parameter, second parameter)."""

    rest: Equilibria
    hopf: bool
    scale: Array
    tolerance: float

    def critical(self, z: Array) -> complex:
        """Return the eigenvalue next to the imaginary axis, relative to the largest one [1/s]."""
        A = tangent(self.rest.eq, *self.rest.split(z)).A
        found: NDArray[np.complex128] = np.linalg.eigvals(A).astype(complex)
        size = float(np.abs(found).max(initial=TINY))
        other = (found.imag > REAL * size) != self.hopf
        if other.all():
            raise ValueError("the eigenvalues on the imaginary axis meet")
        return complex(found[int(np.argmin(np.abs(found.real) + 2 * size * other))])

    def growth(self, z: Array) -> float:
        """Return the test whose zero is the boundary, without unit."""
        found = self.critical(z)
        return found.real / abs(found) if self.hopf else found.real * float(self.scale[-1])

    def at(self, z: Array) -> Node:
        """Return the linearised equations; see `CurveEquations.at`."""
        node = self.rest.at(z)
        row = [
            (self.growth(z + a * e) - self.growth(z - a * e)) / (2 * a)
            for a, e in zip(CHANGE * self.scale[node.chosen], node.D.T, strict=True)
        ]
        r, J = np.append(node.r, self.growth(z)), np.vstack([node.J, row])
        return node._replace(r=r, J=J)


def boundary(
    branch: Branch,
    special: Special,
    parameter: str,
    between: tuple[float, float],
    *,
    points: int = 100,
    step: float = 0.05,
) -> Boundary:
    """Return the curve of Hopf points or folds over a second parameter, in both directions.

    Limits: special points of equilibria only. The curve ends where the frequency of a Hopf point
    vanishes (Bogdanov-Takens point).

    Args:
        branch: branch of equilibria.
        special: one of its Hopf points or folds, such as `branch.located("Hopf")[0]`.
        parameter: name of the second free parameter.
        between: smallest and largest value of the second parameter, within its bounds.
        points: largest number of points, half of them in each direction.
        step: longest step, relative to the magnitudes of states and the ranges of the parameters.

    Raises:
        ValueError: bad input, or a point of another kind.
    """
    where = "boundary"
    if not isinstance(branch, Branch):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise checks.refused(f"{where}: branch", "a branch of `continuation`", branch)
    model = branch.model
    if branch.of_orbits or special not in branch.special or special.kind not in KINDS:
        raise checks.refused(
            f"{where}: special", "a Hopf point or a fold of the branch of equilibria",
            getattr(special, "kind", special), "branch.located('Hopf')[0]",
        )  # fmt: skip
    names = [v.name for v in model.p if v.name != branch.parameter]
    check_names(f"{where}: parameter", [parameter], names)
    span = checked_span(where, model, between, branch.p[parameter], parameter)
    checks.count(f"{where}: points", points, least=2)
    checks.number(f"{where}: step", step, above=0.0, upper=1.0)
    try:
        curve, node = _start(branch, special, parameter, span)
    except ValueError as error:
        hint = "take a range near the magnitude of the parameter"
        raise ValueError(f"{where}: no curve at the start: {error}; {hint}") from error
    tau = direction(curve, node, np.eye(node.z.size)[-1])
    sides = [
        [n.z for n in _within(curve, node, side * tau, span, step, points // 2)] for side in (-1, 1)
    ]
    rows = np.array([*reversed(sides[0]), node.z, *sides[1]])
    rates = np.array([curve.critical(row).imag for row in rows])
    periods = 2 * np.pi / rates if curve.hopf else np.zeros(len(rows))
    message = "; ".join(dict.fromkeys(_reason(side, span, points // 2) for side in sides))
    return Boundary(
        model, special.kind, (branch.parameter, parameter), rows[:, -2:],
        rows[:, : len(model.x)], periods, message,
    )  # fmt: skip


def _reason(end: list[Array], span: tuple[float, float], points: int) -> str:
    """Return the reason why one end of a boundary was reached."""
    if end and np.abs(end[-1][-1] - np.array(span)).min() <= 1e-9 * (span[1] - span[0]):
        return "ends at the given range"
    if len(end) >= points:
        return f"ends after {points} points"
    return "ends where no further step was possible"


def _start(
    branch: Branch, special: Special, parameter: str, span: tuple[float, float]
) -> tuple[BoundaryEquations, Node]:
    """Return the equations of a boundary and the node at a special point."""
    model, u = branch.model, branch.u
    eq, p = equations("boundary", model), branch.p | {branch.parameter: special.value}
    y = np.zeros(eq.y.numel())
    y[: special.x.size] = special.x
    scale, order = np.maximum(eq.scale, np.abs(y)), [*u, *p]
    reach, width = max(float(np.ptp(branch.values)), TINY), span[1] - span[0]
    d = np.concatenate([model.values("u", cast("dict[str, float]", u)), model.values("p", p)])
    first, second = order.index(branch.parameter), order.index(parameter)
    every = np.concatenate([scale, [reach, width]])
    rest = Equilibria(eq, d, (first, second), every, 1e-11)
    curve = BoundaryEquations(rest, special.kind == "Hopf", every, 1e-10)
    z = np.concatenate([y, [special.value, p[parameter]]])
    return curve, corrected(curve, z, np.eye(z.size)[-1])[0]


def _within(
    curve: BoundaryEquations,
    node: Node,
    tau: Array,
    span: tuple[float, float],
    step: float,
    points: int,
) -> Iterator[Node]:
    """Yield the nodes of a curve up to the end of the range of the second parameter."""
    steps = followed(curve, node, tau, step, lambda _, __: None, lambda _: np.inf)
    for k, found in enumerate(steps):
        end = at_edge(curve, found, span)
        yield end or found.node
        if end or k + 2 > points:
            return
