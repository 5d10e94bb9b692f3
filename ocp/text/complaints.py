"""What may be wrong with the text of a problem, before its expressions are looked at."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ocp.text.problem import Problem


def kind_problems(problem: "Problem") -> Iterator[str]:
    """Things of the wrong kind; without these nothing else can be asked."""
    yield from ()


def input_problems(problem: "Problem") -> Iterator[str]:
    """Names, ranges, durations."""
    yield from ()
