"""Reader of text files: dialects of CSV, headers of recorders."""

import csv
from collections.abc import Sequence
from os import SEEK_END
from pathlib import Path
from re import compile as pattern
from typing import NamedTuple

import numpy as np

from identification.data.raw import Array, Column, Raw, is_channel, label
from identification.data.units import is_common, unit

COMMENTS = ("#", "%", "//")
"""First characters of comment lines."""
DELIMITERS = ("\t", ";", ",", " ")
EMPTY = ("", "-", "na", "n/a", "null")
"""Cells that count as missing numbers, in addition to NaN."""
LOOKED_AT = 40
"""Number of lines at the end of the file from which the delimiter is deduced."""
LARGE = 2**20
"""Size [bytes] above which NumPy reads the numbers of a file."""
RULE = pattern(r"[-=_+|,;\s]*[-=_]{3,}[-=_+|,;\s]*")
"""Line that separates a header from the numbers."""
WITH_COMMA, WITH_POINT = (pattern(rf"[-+]?\d*{mark}\d+([eE][-+]?\d+)?") for mark in (",", r"\."))


class SplitLines(NamedTuple):
    """Lines of a text file split into cells.

    Attributes:
        delimiter: delimiter of the cells; " " stands for any number of spaces and tabs.
        numbers: row numbers in the file.
        cells: cells of each row.
        comments: comment lines before the first other line.
    """

    delimiter: str
    numbers: list[int]
    cells: list[list[str]]
    comments: list[str]


class Layout(NamedTuple):
    """Layout of the columns of a text file.

    Attributes:
        comma: True if decimal points are commas.
        first: index of the first row of numbers.
        labels: name and unit of each column; "" for those that the file does not contain.
        named: True if there is a header.
    """

    comma: bool
    first: int
    labels: list[tuple[str, str]]
    named: bool


def read_text(file: Path) -> Raw:
    """Return the columns of a text file.

    The cells are separated by commas, semicolons, tabs or spaces; decimal commas are accepted
    unless commas separate cells. Lines before the header and lines that begin with #, % or // are
    ignored. If there is no other header, a last comment with as many words as columns is the
    header. A row of units may follow the header. Rows of a recorder before the header may contain
    numbers. The numbers of a large file without other cells are read by NumPy.

    Raises:
        ValueError: no such file, no text, no rows of numbers, or rows of different lengths.
    """
    found = _plain(file) if file.stat().st_size > LARGE else None
    return found or _by_cells(file)


def _layout(rows: SplitLines, where: str) -> Layout:
    """Return the layout of the columns.

    Raises:
        ValueError: no row of numbers.
    """
    last = [cell for row in rows.cells[-LOOKED_AT:] for cell in row]
    with_comma, with_point = (sum(p.fullmatch(c) is not None for c in last)
                              for p in (WITH_COMMA, WITH_POINT))  # fmt: skip
    comma = rows.delimiter != "," and with_comma > with_point
    first = _first(rows, comma)
    if first is None:
        count = len(rows.cells)
        got = "an empty file" if not count else "a header alone"
        if count > 2:  # names and units
            got = f"{count} rows of text, the last one '{' '.join(rows.cells[-1])[:40]}'"
        raise ValueError(f"{where}: expected rows of numbers, got {got}")
    names, units = _header(rows, first)
    labels = [label(name) for name in names or [""] * len(rows.cells[first])]
    labels = [(name, said or (units[k] if units else "")) for k, (name, said) in enumerate(labels)]
    return Layout(comma, first, labels, names is not None)


def _plain(file: Path) -> Raw | None:
    """Return the columns of a large file of numbers; None if it contains other cells."""
    where = f"read '{file.name}'"
    with file.open("rb") as stream:
        head = stream.read(LARGE // 16)
        stream.seek(-LARGE // 16, SEEK_END)
        tail = stream.read()
    parts = head[: head.rfind(b"\n")], tail[tail.find(b"\n") + 1 :]
    try:
        rows = _rows(b"\n".join(parts), where)
        layout = _layout(rows, where)
        delimiter = None if rows.delimiter == " " else rows.delimiter
        skipped = rows.numbers[layout.first] - 1
        with file.open(encoding="latin-1") as lines:
            points = (line.replace(",", ".") for line in lines) if layout.comma else file
            values = np.loadtxt(
                points, delimiter=delimiter, skiprows=skipped, comments=None, encoding="latin-1",
                ndmin=2,
            )  # fmt: skip
    except ValueError:
        return None
    if values.shape[1] != len(layout.labels) or not np.isfinite(values).all():
        return None
    pairs = zip(layout.labels, values.T, strict=True)
    columns = (Column(name, unit, np.ascontiguousarray(y)) for (name, unit), y in pairs)
    return Raw(file.name, tuple(columns), skipped + 1)


def _by_cells(file: Path) -> Raw:
    """Return the columns of a text file cell by cell, with a message on the first bad one."""
    where = f"read '{file.name}'"
    rows = _rows(file.read_bytes(), where)
    comma, first, labels, named = _layout(rows, where)
    width = len(labels)
    body, numbers = rows.cells[first:], rows.numbers[first:]
    for number, row in zip(numbers, body, strict=True):
        if any(row[width:]):
            hint = "; write numbers with a decimal point" if rows.delimiter == "," else ""
            raise ValueError(
                f"{where}: row {number}: expected {width} cells as in the "
                f"{'header' if named else 'first row'}, got {len(row)}{hint}"
            )
    columns: list[Column] = []
    for k, (name, said) in enumerate(labels):
        cells = [row[k] if k < len(row) else "" for row in body]
        if comma:
            cells = [cell.replace(",", ".") if cell.count(",") == 1 else cell for cell in cells]
        columns.append(Column(name, said, *_numbers(cells, numbers)))
    return Raw(file.name, tuple(columns), numbers[0])


def _rows(raw: bytes, where: str) -> SplitLines:
    """Return the non-empty lines, split into cells."""
    wide = raw.startswith((b"\xff\xfe", b"\xfe\xff"))
    try:
        text = raw.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError:
        if wide:
            raise ValueError(
                f"{where}: expected text in UTF-8 or UTF-16, got other bytes"
            ) from None
        text = raw.decode("latin-1")  # degree and micro signs of older recorders
    if "\0" in text:
        raise ValueError(f"{where}: expected a text file, got one with binary numbers")
    comments, plain, numbers = list[str](), list[str](), list[int]()
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    for number, line in enumerate((line.strip("\ufeff ") for line in lines), start=1):
        if line.lstrip('" \t').startswith(COMMENTS):
            if not plain:
                comments.append(line.lstrip('" \t#%/').strip())
        elif line.strip(" \t,;") and not RULE.fullmatch(line):
            plain.append(line)
            numbers.append(number)
    delimiter = _delimiter(plain) if plain else ","
    return SplitLines(delimiter, numbers, [_cells(line, delimiter) for line in plain], comments)


def _delimiter(lines: Sequence[str]) -> str:
    """Return the delimiter for which most of the last lines have equally many numeric cells."""

    def score(delimiter: str) -> tuple[float, int]:
        rows = [_cells(line, delimiter) for line in lines[-LOOKED_AT:]]
        widths = [len(row) for row in rows]
        usual = max(set(widths), key=widths.count)
        numbers = sum(sum(map(_is_number, row)) for row in rows if len(row) == usual)
        return (numbers / (usual * len(rows)) if usual > 1 else 0.0), -DELIMITERS.index(delimiter)

    best = max(DELIMITERS, key=score)
    if score(best)[0] > 0:
        return best
    return max(",;\t", key=lines[0].count) if any(d in lines[0] for d in ",;\t") else " "


def _cells(line: str, delimiter: str) -> list[str]:
    """Return the cells of one line."""
    if delimiter == " ":
        return line.split()
    if '"' in line:
        try:
            return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]
        except (csv.Error, StopIteration):
            pass
    return [cell.strip() for cell in line.split(delimiter)]


def _number(cell: str) -> float:
    if "_" in cell:  # accepted by Python in numbers
        raise ValueError
    return float(cell)


def _is_number(cell: str) -> bool:
    try:
        _number(cell)
    except ValueError:
        return WITH_COMMA.fullmatch(cell) is not None
    return True


def _numeric(row: Sequence[str], comma: bool, share: float = 0.5) -> bool:
    """Return True if at least `share` of the cells are numbers; the row is then not a header."""
    cells = [cell.replace(",", ".") if comma else cell for cell in row if cell]
    numbers = sum(map(_is_number, cells))
    return numbers > 0 and numbers >= share * len(cells)


def _first(rows: SplitLines, comma: bool) -> int | None:
    """Return the index of the first numeric row that is as wide as most of the last rows.

    Rows with text and numbers before a header with names of channels are settings of the recorder.
    """
    widths = [_width(row) for row in rows.cells[-LOOKED_AT:] if _numeric(row, comma)]
    usual = max(set(widths), key=widths.count, default=0)
    wide = [k for k, row in enumerate(rows.cells) if _width(row) >= usual]
    names = [k for k in wide if k < LOOKED_AT and sum(map(_is_name, rows.cells[k])) > 1]
    header = next(iter(names), -1)
    for k in names:  # a header below rows of numbers only is an error in the file
        if not any(header < i < k and _numeric(rows.cells[i], comma, 1.0) for i in wide[:k]):
            header = k
    later = [k for k in wide if k > header]
    return next((k for k in [*later, *wide] if _numeric(rows.cells[k], comma)), None)


def _is_name(cell: str) -> bool:
    """Return True if a cell names a channel: a usual name, or a name with its unit."""
    name, said = label(cell)
    return bool(name) and not _is_number(cell) and (bool(said) or is_channel(name))


def _header(rows: SplitLines, first: int) -> tuple[list[str] | None, list[str] | None]:
    """Return names and units of the columns; None for those that the file does not contain."""
    width = _width(rows.cells[first])
    above = [row for row in rows.cells[:first] if len(row) >= width]
    if not above:
        spoken = [s for c in rows.comments[-1:] for s in (_cells(c, rows.delimiter), c.split())]
        return next((s for s in spoken if len(s) == width), None), None
    cells = above[-1]
    if len(above) > 1 and all(unit(c.strip("[]()")) is not None for c in cells):
        names = above[-2]
        if len(names) == len(cells) and not all(is_common(c) for c in names if c):
            return names, [c.strip("[]()") for c in cells]
    return cells[: _width(cells)], None


def _width(row: Sequence[str]) -> int:
    """Return the number of cells up to the last non-empty one."""
    return max((k + 1 for k, cell in enumerate(row) if cell), default=0)


def _numbers(cells: Sequence[str], numbers: Sequence[int]) -> tuple[Array, str, bool]:
    """Return the numbers, a message on the first bad cell, and True if all bad cells are empty."""
    values = np.full(len(cells), np.nan)
    problem = ""
    for k, cell in enumerate(cells):
        try:
            values[k] = _number(cell)
        except ValueError:
            problem = problem or f"row {numbers[k]}: expected a number, got '{cell[:40]}'"
            if cell.lower() not in EMPTY:
                return values, problem, False
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size and not problem:
        k, more = int(bad[0]), f" ({bad.size} such cells)" if bad.size > 1 else ""
        problem = f"row {numbers[k]}: expected a finite number, got {cells[k][:40]}{more}"
    return values, problem, bool(bad.size)
