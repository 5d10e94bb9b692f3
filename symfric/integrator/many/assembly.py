"""Start positions and velocities of many mechanisms put onto their constraints, all at once."""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.integrator.compiled.columns import Columns
from symfric.integrator.equations.initial import ASSEMBLED, ITERATIONS
from symfric.integrator.equations.manifold import Manifold

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Assembly:
    """What `symfric.integrator.equations.initial.consistent` does before it solves for algebraic
    unknowns, for the rows of matrices.
    """

    manifold: Manifold
    nx: int
    defect: Columns
    project: Columns
    slope: Columns

    @classmethod
    def of(cls, manifold: Manifold, nx: int) -> "Assembly":
        """Of a mechanism with `nx` states."""
        functions = (manifold.defect, manifold.project, manifold.slope)
        return cls(manifold, nx, *(Columns(function) for function in functions))

    def __call__(self, y: Array, d: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Rows of y (members, n) with positions and velocities on the constraints, and which are.

        Where there are charts, each has an orthonormal basis of its tangent space.
        """
        y, closed = y.copy(), np.full(y.shape[0], self.manifold.m == 0)
        todo = np.flatnonzero(~closed)
        for _ in range(ITERATIONS):
            if not todo.size:
                break
            here = np.ascontiguousarray(y[todo]), np.ascontiguousarray(d[todo])
            (defect,) = self.defect(here, backend="auto")
            size = np.maximum(1.0, np.abs(here[0][:, : self.nx]).max(axis=1, initial=0.0))
            good = np.abs(defect).max(axis=1, initial=0.0) < ASSEMBLED * size
            closed[todo[good]] = True
            todo = todo[~good]
            if todo.size:
                (y[todo],) = self.project([here[0][~good], here[1][~good]], backend="auto")
        if self.manifold.charted:
            y[:, self.manifold.basis] = self._bases(y, d)
        return y, closed

    def _bases(self, y: Array, d: Array) -> Array:
        """Bases of the tangent spaces, columns below each other."""
        n, m = self.manifold.n, self.manifold.m
        (entries,) = self.slope([y, d], backend="auto")
        rows, columns = self.manifold.slope.size_out(0)
        slope = entries.reshape(-1, columns, rows).transpose(0, 2, 1)
        # the trailing right singular vectors span the null space
        right = np.linalg.svd(np.nan_to_num(slope[:, n : n + m, :n]))[2]
        return right[:, m:].reshape(y.shape[0], -1)
