"""An initial-value problem with a solution that others have published."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import final

from symfric.foundation.parameters import Variable
from symfric.model import Model

TEST_SET = (
    "Mazzia and Magherini, Test Set for Initial Value Problem Solvers, release 2.4, "
    "University of Bari and INdAM, 2008"
)


@final
@dataclass(frozen=True, eq=False)
class Problem:
    """What is integrated, and where it has to end.

    Attributes:
        name: as in the literature.
        model: makes the equations.
        t_end: end of the span from 0.
        reference: signal -> its published value at the end.
        source: of equations and reference.
        digits: correct ones wanted at rtol 1e-6 and at 1e-10.
        drift: outputs of the model that are zero on the exact solution: constraints of a problem
            of higher index in its index-reduced form.
        laborious: methods that need millions of steps below rtol 1e-6.
    """

    name: str
    model: Callable[[], Model]
    t_end: float
    reference: Mapping[str, float]
    source: str = TEST_SET
    digits: Mapping[float, int] = field(default_factory=lambda: {1e-6: 5, 1e-10: 9})
    drift: tuple[str, ...] = ()
    laborious: tuple[str, ...] = ()


def numbered(values: Sequence[float], first: int = 1) -> dict[str, float]:
    """y1, y2, ... -> values."""
    return {f"y{i}": value for i, value in enumerate(values, start=first)}


def unknowns(
    starts: Sequence[float], nominal: Sequence[float], unit: str = "1"
) -> tuple[Variable, ...]:
    """Variables y1, y2, ..., as the test set calls them."""
    every = zip(starts, nominal, strict=True)
    return tuple(
        Variable(f"y{i}", unit, start=float(start), nominal=size)
        for i, (start, size) in enumerate(every, start=1)
    )
