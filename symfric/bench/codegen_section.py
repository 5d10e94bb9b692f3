"""One table of `symfric bench codegen`, and numbers beside their goals."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import isfinite
from typing import Any, Literal, final

Cell = str | float
"""Of a table; text, or a number (NaN: not measured)."""


@final
@dataclass(frozen=True)
class Goal:
    """A measured number beside its goal; NaN meets none.

    Attributes:
        what: what was measured, with its unit.
        value, goal: the number, and what it should be.
        better: whether it should be at most ("<=") or at least (">=") the goal.
    """

    what: str
    value: float
    goal: float
    better: Literal["<=", ">="] = "<="

    @property
    def met(self) -> bool:
        """Whether the goal is met."""
        return self.value <= self.goal if self.better == "<=" else self.value >= self.goal


@final
@dataclass(frozen=True, eq=False)
class Section:
    """One table.

    Attributes:
        title: what is measured, how and in which units.
        head: names of the columns.
        rows: cells, as many a row as there are columns.
        goals: the numbers among them that have one.
        notes: sentences below the table, such as which tool is absent.
    """

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    goals: Sequence[Goal] = ()
    notes: Sequence[str] = ()

    def to_dict(self) -> dict[str, Any]:
        """Everything by name; what was not measured is None."""
        return {
            "title": self.title,
            "rows": [
                {name: _known(cell) for name, cell in zip(self.head, row, strict=True)}
                for row in self.rows
            ],
            "goals": [asdict(g) | {"value": _known(g.value), "met": g.met} for g in self.goals],
            "notes": list(self.notes),
        }


def _known(cell: Cell) -> Cell | None:
    return None if isinstance(cell, float) and not isfinite(cell) else cell
