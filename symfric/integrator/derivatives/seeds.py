"""What a run is differentiated with respect to."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.parameters import check_names
from symfric.model import Model

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Seeds:
    """What to differentiate with respect to.

    Attributes:
        names: as the user wrote them: a parameter, or "x0.v" for the start value of a state.
        parameters: row in p of each name, -1 for a start value.
        start: derivative of the start values of x by each name, shape (nx, names).
    """

    names: tuple[str, ...]
    parameters: tuple[int, ...]
    start: Array

    def of_data(self, n_d: int) -> Array:
        """Derivative of the run data d by each name, shape (n_d, names)."""
        selector = np.zeros((n_d, len(self.names)))
        for column, row in enumerate(self.parameters):
            if row >= 0:
                selector[row, column] = 1.0
        return selector

    def through(self, by_data: Array) -> Array:
        """Derivative by each name from that by the run data, shape (names,)."""
        return np.array([by_data[row] if row >= 0 else 0.0 for row in self.parameters])


def seeds(
    model: Model,
    names: Sequence[str],
    x0: Mapping[str, float] | None,
    p: Mapping[str, float] | None,
    t: float = 0.0,
) -> Seeds:
    """Look the names up; `x0` and `p` as in `simulate`, which starts at `t` [s].

    A start value that follows from others, as a bristle's in steady sliding does, is differentiated
    along with them.

    Raises:
        ValueError: a name that is neither a free parameter nor "x0." and a state.
    """
    free, states = [v.name for v in model.p], [v.name for v in model.x]
    known = [*free, *(f"x0.{name}" for name in states)]
    check_names(f"sensitivities of '{model.name}' (parameters must be free)", names, known)
    by_p = model.start_by_parameters(x0, p, t)
    columns = [
        by_p[:, free.index(n)] if n in free else model.start_by_state(n[3:], x0, p, t)
        for n in names
    ]
    rows = tuple(free.index(n) if n in free else -1 for n in names)
    return Seeds(tuple(names), rows, np.column_stack(columns))
