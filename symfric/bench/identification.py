"""Identification against its goals: who finds the truth, from where, and at what cost."""

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from importlib import import_module
from math import isfinite, log10
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, final

from symfric.foundation.parameters import check_names

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CASES = ("lugre", "coverage", "emps", "laws", "franka", "starts", "gms", "files")
"""Modules `symfric.bench.identification_<case>`, each with `measure(quick) -> rows`."""
Tell = Callable[[str, float], None]


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
        """Everything by name; what was not measured is None."""
        return (
            asdict(self)
            | {"value": self.value if isfinite(self.value) else None}
            | {"met": self.met}
        )


@final
@dataclass(frozen=True, eq=False)
class IdentificationBenchmark:
    """What was measured, case by case."""

    rows: tuple[Row, ...]

    def to_dict(self) -> dict[str, Any]:
        """Rows as dictionaries."""
        return {"rows": [row.to_dict() for row in self.rows]}

    def plot(self, path: str | Path) -> "Figure":
        """How far each number is from its goal; right of the line it is worse."""
        from symfric.bench.pictures import plot_goals  # noqa: PLC0415  (matplotlib is slow)

        known = [row for row in self.rows if row.value > 0 and row.goal > 0]
        side = {"<=": 1.0, ">=": -1.0}
        return plot_goals(
            [f"{row.case}: {row.what}" for row in known],
            [side[row.better] * log10(row.value / row.goal) for row in known],
            [row.met for row in known],
            path,
        )


def bench_identification(
    *, quick: bool = False, cases: tuple[str, ...] = CASES, progress: Tell | None = None
) -> IdentificationBenchmark:
    """Measure `cases`; `quick` takes fewer seeds. Ctrl-C leaves the rows that there are.

    Raises:
        ValueError: an unknown case.
    """
    check_names("bench identification: cases", cases, CASES)
    rows = list[Row]()
    try:
        for row in _measured(cases, quick, progress):
            rows.append(row)
    except KeyboardInterrupt:
        if not rows:
            raise
    return IdentificationBenchmark(tuple(rows))


def _measured(cases: tuple[str, ...], quick: bool, progress: Tell | None) -> Iterator[Row]:
    for k, case in enumerate(cases):
        if progress is not None:
            progress(case, k / len(cases))
        yield from import_module(f"symfric.bench.identification_{case}").measure(quick)
