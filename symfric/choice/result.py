"""The choice: rows, best first, what to take, and how to look at it."""

import csv
import json
from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

from symfric.choice.row import Row
from symfric.choice.verdict import verdict
from symfric.foundation.checks import check_names
from symfric.foundation.files import write_text, written

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SCREEN = 16
"""Rows of the text that a terminal shows."""


@final
@dataclass(frozen=True, eq=False)
class Choice:
    """Laws on a machine, the best first.

    Attributes:
        machine: its name.
        needs: what the law has to show, words of `NEEDS`.
        accuracy: largest error relative to the motion.
        friction: that all laws describe.
        reference, uncertain: what errors are measured from, and how far that may be off itself.
        control: largest error of fixed steps.
        t_end: length of the motion [s].
        rows: one for each candidate.
        wall_s: how long it took [s].
        unmeasured: laws without a row, since somebody interrupted it.
    """

    machine: str
    needs: tuple[str, ...]
    accuracy: float
    friction: str
    reference: str
    uncertain: float
    control: float
    t_end: float
    rows: tuple[Row, ...]
    wall_s: float
    unmeasured: tuple[str, ...] = ()

    def __getitem__(self, law: str) -> Row:
        """The row of a law."""
        found = {row.law: row for row in self.rows}
        check_names("choice", [law], found)
        return found[law]

    def __iter__(self) -> Iterator[Row]:
        return iter(self.rows)

    @property
    def interrupted(self) -> bool:
        """Whether somebody stopped it before all laws were measured."""
        return bool(self.unmeasured)

    @property
    def placed(self) -> tuple[Row, ...]:
        """The rows of all laws that run here, by their rank."""
        return tuple(row for row in self.rows if row.rank)

    @property
    def ranked(self) -> tuple[Row, ...]:
        """The rows of laws that show what is needed and keep the accuracy, least work first."""
        return tuple(row for row in self.rows if row.ranked)

    @property
    def best(self) -> Row | None:
        """The first of them; None where there is none."""
        return next(iter(self.ranked), None)

    @property
    def verdict(self) -> tuple[str, ...]:
        """What to take and why, for simulation, optimal control and a controller."""
        return verdict(self.rows, self.needs, self.accuracy, self.control)

    @property
    def title(self) -> str:
        """What was asked, in a line."""
        asked = f"laws that show {' and '.join(self.needs)}" if self.needs else "all laws"
        return f"{self.machine}: {asked}, {self.accuracy:g} off at most"

    @property
    def table(self) -> list[dict[str, Any]]:
        """A row of plain numbers and texts for each law; what CSV and data frames hold."""
        return [flat(row) for row in self.rows]

    def __repr__(self) -> str:
        from symfric.choice.text import lines  # noqa: PLC0415

        return "\n".join(lines(self, SCREEN))

    def _repr_html_(self) -> str:  # pyright: ignore[reportUnusedFunction]  (notebooks call it)
        from symfric.choice.page import body  # noqa: PLC0415  (matplotlib is slow to import)

        return body(self)

    def plot(self, path: str | Path | None = None, *, wide: bool = False) -> "Figure":
        """Draw error against work, marked by what a law shows; save it to `path` if given.

        It is as wide as a column of print, 85 mm; `wide` puts the panels side by side.
        """
        from symfric.choice.pictures import plot_choice  # noqa: PLC0415  (matplotlib is slow to import)

        return plot_choice(self, path, wide)

    def to_html(self, path: str | Path) -> None:
        """Write one page that needs nothing from elsewhere: verdict, picture, table."""
        from symfric.choice.page import page  # noqa: PLC0415  (matplotlib is slow to import)

        write_text(path, page(self))

    def to_csv(self, path: str | Path) -> None:
        """Write the table, a law a line."""
        rows = self.table
        with written(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
            sheet = csv.DictWriter(file, fieldnames=list(rows[0]) if rows else ["law"])
            sheet.writeheader()
            sheet.writerows(rows)

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain data; numbers that are none are null."""
        best = self.best
        return {
            "machine": self.machine,
            "needs": list(self.needs),
            "accuracy": self.accuracy,
            "friction": self.friction,
            "reference": self.reference,
            "uncertain": self.uncertain if isfinite(self.uncertain) else None,
            "control": self.control,
            "t_end": self.t_end,
            "best": None if best is None else best.law,
            "verdict": list(self.verdict),
            "unmeasured": list(self.unmeasured),
            "wall_s": self.wall_s,
            "rows": [row.to_dict() for row in self.rows],
        }

    def to_json(self, path: str | Path) -> None:
        """Write `to_dict` as a file."""
        write_text(path, json.dumps(self.to_dict(), indent=2, ensure_ascii=False) + "\n")


def flat(row: Row) -> dict[str, Any]:
    """A row without nested values."""
    found = row.to_dict()
    del found["curve"]
    values = found.pop("values") or {}
    form = [f"form={row.form}"] if row.form else []
    found["values"] = " ".join([*form, *(f"{n}={value:g}" for n, value in values.items())])
    found["phenomena"] = " ".join(row.phenomena)
    found["hard"] = " ".join(row.hard)
    return found
