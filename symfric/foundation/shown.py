"""Display of objects: one description as text that fits a screen and as HTML for notebooks.

In HTML, text from users is escaped, images are embedded, and there are no scripts.
"""

from abc import ABC, abstractmethod
from base64 import b64encode
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from html import escape
from io import BytesIO
from itertools import zip_longest
from typing import TYPE_CHECKING, Any, ClassVar, cast, final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import Scalar, is_casadi, is_number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH, HEIGHT = 100, 25
"""Size of a screen in columns and lines."""
DOTS_PER_INCH = 80
"""Resolution of images in notebooks."""
BOX = "font-family:sans-serif;font-size:13px;line-height:1.35;max-width:64em"
TABLE = "border-collapse:collapse;font-size:13px"
CELL = "padding:1px 10px 1px 0;vertical-align:top"
HEAD = f"{CELL};border-bottom:1px solid #888;font-weight:600"


class Showing(ABC):
    """Base class of objects with a `repr` that fits a screen and with HTML for notebooks.

    Attributes:
        hidden: internal names that `dir` and completion omit.
    """

    hidden: ClassVar[frozenset[str]] = frozenset(
        {"hidden", "shown", "thumbnail", "to_pack", "packed_as"}
    )

    def __dir__(self) -> list[str]:
        return sorted(set(super().__dir__()) - self.hidden)

    @abstractmethod
    def shown(self) -> "Shown":
        """Return the description; it must not require expensive computations."""

    def thumbnail(self) -> "Figure | None":
        """Return a small figure for notebooks, or None."""
        return None

    def __repr__(self) -> str:
        return self.shown().text()

    def _repr_html_(self) -> str:
        return self.shown().html(self.thumbnail())


@final
@dataclass(frozen=True)
class TextTable:
    """Table of strings.

    Attributes:
        header: names of the columns; if all are "", the table has no header.
        rows: cells of each row.
        numbers: indices of right-aligned columns.
        rest: line below a shortened table; "{n}" is the number and "{names}" the first cells of the
            omitted rows.
    """

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: tuple[int, ...] = ()
    rest: str = "... {n} more: {names}"


@final
@dataclass(frozen=True)
class Shown:
    """Description of an object.

    Attributes:
        title: name and type of the object, in one line.
        lines: lines below the title.
        table: parts of the object.
        after: lines below the table.
    """

    title: str
    lines: tuple[str, ...] = ()
    table: TextTable = TextTable((), ())
    after: tuple[str, ...] = ()

    def text(self) -> str:
        """Return the description as text that fits a screen."""
        top = [cut(line) for line in (self.title, *self.lines)]
        bottom = [cut(line) for line in self.after]
        return "\n".join([*top, *_rows(self.table, HEIGHT - len(top) - len(bottom)), *bottom])

    def html(self, picture: "Figure | None" = None) -> str:
        """Return the description as HTML, followed by the figure if there is one."""
        parts = [f"<div><b>{escape(self.title)}</b></div>"]
        parts += [f"<div>{escape(line)}</div>" for line in self.lines]
        parts += [_html_table(self.table)] if self.table.rows else []
        parts += [f"<div>{escape(line)}</div>" for line in self.after]
        if picture is not None:
            parts += [
                f'<img alt="{escape(self.title)}" style="max-width:100%;margin-top:6px" '
                f'src="{data_uri(picture, DOTS_PER_INCH)}">'
            ]
        return f'<div style="{BOX}">{"".join(parts)}</div>'


def cut(line: str, width: int = WIDTH) -> str:
    """Return `line` shortened to `width` characters."""
    return line if len(line) <= width else f"{line[: width - 4].rstrip(', ')} ..."


def figure_of(value: object) -> str:
    """Return a number with six significant digits; "(expression)" if it is symbolic."""
    if is_casadi(value):
        return str(value) if value.is_constant() else "(expression)"  # pyright: ignore
    return f"{value:.6g}" if is_number(value) else str(value)


def spaced(unit: str) -> str:
    """Return a unit after a space; "" for pure numbers."""
    return "" if unit in ("", "1") else f" {unit}"


def valued(named: Iterable[tuple[str, Scalar, str]]) -> str:
    """Return numbers with their names and units, such as "m = 0.8 kg, mu_s = 0.2"."""
    return ", ".join(f"{n} = {figure_of(v)}{spaced(unit)}" for n, v, unit in named)


def counted(n: int, one: str, many: str = "") -> str:
    """Return a count with its noun: "1 state", "3 states", "no states"."""
    return f"{n or 'no'} {one if n == 1 else many or one + 's'}"


def among(names: Iterable[str], most: int = 8) -> str:
    """Return names joined by commas; beyond `most` names, only their number is added."""
    every = list(names)
    more = f", ... {len(every) - most} more" if len(every) > most else ""
    return ", ".join(every[:most]) + more


def columns(rows: Iterable[Sequence[str]], right: Sequence[int] = ()) -> Iterator[str]:
    """Yield lines of padded columns; the columns in `right` are right-aligned."""
    lines = [list(row) for row in rows]
    widths = [max(map(len, column)) for column in zip_longest(*lines, fillvalue="")]
    for line in lines:
        cells = [
            cell.rjust(w) if j in right else cell.ljust(w)
            for j, (cell, w) in enumerate(zip(line, widths, strict=False))
        ]
        yield "  ".join(cells).rstrip()


def _rows(table: TextTable, most: int) -> list[str]:
    """Return the table as at most `most` aligned lines."""
    rows, lines = list(table.rows), [table.header] if any(table.header) else []
    room = most - len(lines)
    shown = rows if len(rows) <= room else rows[: max(0, room - 1)]
    found = list(columns([*lines, *shown], table.numbers))
    left = [row[0] for row in rows[len(shown) :]]
    if left:
        found.append(table.rest.format(n=len(left), names=", ".join(left)))
    return [cut(f"  {line}".rstrip()) for line in found]


def _html_table(table: TextTable) -> str:
    def cells(row: Sequence[str], mark: str, style: str) -> str:
        right = ";text-align:right;white-space:nowrap"
        return "".join(
            f'<{mark} style="{style}{right if j in table.numbers else ";text-align:left"}">'
            f"{escape(text)}</{mark}>"
            for j, text in enumerate(row)
        )

    head = f"<thead><tr>{cells(table.header, 'th', HEAD)}</tr></thead>" * any(table.header)
    body = "".join(f"<tr>{cells(row, 'td', CELL)}</tr>" for row in table.rows)
    whole = f'<table style="{TABLE}">{head}<tbody>{body}</tbody></table>'
    return f'<div style="overflow-x:auto">{whole}</div>'  # scrolls in narrow notebook cells


def png(figure: "Figure", dpi: float = 100) -> bytes:
    """Return `figure` as the bytes of a PNG file."""
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi)
    return buffer.getvalue()


def data_uri(figure: "Figure", dpi: float = 60) -> str:
    """Return `figure` as a data URI for the `src` of an HTML image."""
    return png_uri(png(figure, dpi))


def png_uri(content: bytes) -> str:
    """Return the bytes of a PNG file as a data URI."""
    return "data:image/png;base64," + b64encode(content).decode()


SHORT = 8
"""Largest number of values of an array that are listed."""


def brief(self: Any) -> str:
    """Return the class and the fields of a dataclass, one per line, as text that fits a screen."""
    lines = [f"  {item.name}: {in_a_line(getattr(self, item.name))}" for item in fields(self)]
    if len(lines) > HEIGHT - 2:
        lines = [*lines[: HEIGHT - 2], f"  ... {len(lines) - HEIGHT + 2} more"]
    return "\n".join([f"<{type(self).__name__}", *(cut(line, WIDTH - 1) for line in lines)]) + ">"


LEAST_SHARE = 0.1
"""Smallest coefficient of a combination that is shown; the largest one is 1."""


def combination(weights: Any, names: Iterable[str]) -> str:
    """Return a weighted sum as text, with the largest weight as 1, such as 1 offset - 0.2 m."""
    weights = weights / weights[np.argmax(np.abs(weights))]
    terms = ((c, n) for c, n in zip(weights, names, strict=True) if abs(c) > LEAST_SHARE)
    text = " ".join(f"{'-' if c < 0 else '+'} {abs(c):.2g} {n}" for c, n in terms)
    return text.removeprefix("+ ")


def in_a_line(value: Any) -> str:
    """Return a description of a value in one line."""
    if isinstance(value, np.ndarray):
        return _array(cast(NDArray[Any], value))
    if is_casadi(value):
        return f"expression of shape {value.shape}"
    if isinstance(value, Mapping):
        inside = cast(Mapping[object, object], value)
        return among(f"{name}: {in_a_line(held)}" for name, held in inside.items()) or "none"
    if isinstance(value, tuple | list):
        parts = [in_a_line(one) for one in cast(tuple[object, ...], value)]
        return f"({among(parts)})"
    if isinstance(value, float):
        return f"{value:.6g}"
    return " ".join(repr(value).split())


def _array(value: NDArray[Any]) -> str:
    if value.size <= SHORT and value.ndim == 1:
        return f"[{', '.join(in_a_line(x.item()) for x in value)}]"
    shape = " x ".join(map(str, value.shape))
    finite = value[np.isfinite(value)] if value.dtype.kind in "iuf" else value[:0]
    reach = f" from {finite.min():.6g} to {finite.max():.6g}" if finite.size else ""
    return f"{shape} values{reach}"
