"""Identification against its goals: who finds the truth, from where, at what cost."""

from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Literal, final

CASES = ("lugre", "coverage", "emps", "franka", "starts", "gms", "files")
"""Modules `symfric.bench.identification_<case>`, each with `measure(quick) -> rows`."""


@final
@dataclass(frozen=True)
class Row:
    """One measured number beside its goal.

    Attributes:
        case, what: which problem, and what was measured with its unit.
        value, goal: the number, and what it should be.
        better: whether it should be at most ("<=") or at least (">=") the goal.
        seconds: processor time of the measurement [s].
        note: what a reader has to know, such as data that are absent.
    """

    case: str
    what: str
    value: float
    goal: float
    better: Literal["<=", ">="]
    seconds: float
    note: str = ""

    @property
    def met(self) -> bool:
        """Whether the goal is met; NaN meets none."""
        return self.value <= self.goal if self.better == "<=" else self.value >= self.goal

    def to_dict(self) -> dict[str, Any]:
        """Everything by name."""
        return {**self.__dict__, "met": self.met}


def bench_identification(cases: tuple[str, ...] = CASES, *, quick: bool = False) -> Iterator[Row]:
    """The rows of `cases`, one after the other as they are measured; `quick` takes fewer seeds."""
    for case in cases:
        yield from import_module(f"symfric.bench.identification_{case}").measure(quick)
