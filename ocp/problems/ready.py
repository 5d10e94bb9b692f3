"""What a ready problem is: a text, its known optimum, and where that is from."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, final

if TYPE_CHECKING:
    from ocp.formulation.problem import Problem


@final
@dataclass(frozen=True, eq=False)
class Ready:
    """A problem that `symfric ocp NAME` solves and `symfric bench ocp` measures.

    Attributes:
        name: as on the command line.
        title: one line that says what moves, and what is sought.
        make: the problem; keyword arguments are its numbers, such as v_t.
        optimum: best known cost J, in the unit of the problem's cost; NaN where none is known.
        uncertain: what the optimum is good for.
        source: closed form, publication, or how it was found.
        friction: whether it has contacts, so that modes are found.
    """

    name: str
    title: str
    make: Callable[..., "Problem"]
    optimum: float
    uncertain: float
    source: str
    friction: bool = False


def by_name(*ready: Ready) -> dict[str, Ready]:
    """Name -> problem."""
    return {r.name: r for r in ready}
