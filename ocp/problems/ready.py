"""Ready problems: a problem, its known optimum, and the source of that."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar, final

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
    make: Callable[..., Problem]
    optimum: float
    uncertain: float
    source: str
    friction: bool = False


Make = TypeVar("Make", bound=Callable[..., Problem])


def ready(to: list[Ready], *about: Any, friction: bool = False) -> Callable[[Make], Make]:
    """Add the decorated function to a list: `about` is title, optimum, its error and source."""

    def add(make: Make) -> Make:
        title, *numbers = about
        to.append(Ready(make.__name__, title, make, *numbers, friction=friction))
        return make

    return add
