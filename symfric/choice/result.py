"""The choice: laws on a machine, best first, what to take, and how to look at it."""

import csv
import json
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

from symfric.choice.ranking import Ranking, Row
from symfric.choice.text import lines, verdict
from symfric.foundation.files import write_text, written

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SCREEN = 16
"""Rows of the text that a terminal shows."""


@final
@dataclass(frozen=True, eq=False, repr=False)
class Choice(Ranking):
    """A ranking of laws that shows, draws and writes itself; see `Ranking` for its attributes."""

    @property
    def verdict(self) -> tuple[str, ...]:
        """Recommended laws and reasons, for simulation, optimal control and a controller."""
        return verdict(self.rows, self.needs, self.accuracy, self.control)

    @property
    def table(self) -> list[dict[str, Any]]:
        """A row of plain numbers and texts for each law; what CSV and data frames hold."""
        return [flat(row) for row in self.rows]

    def __repr__(self) -> str:
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
