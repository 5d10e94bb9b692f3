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


class Rows(NamedTuple):
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


def _layout(rows: Rows) -> tuple[bool, int | None, list[str] | None, list[str] | None]:
    """Return whether commas are decimal, the first row of numbers, names and units."""
    last = [cell for row in rows.cells[-LOOKED_AT:] for cell in row]
    with_comma, with_point = (sum(p.fullmatch(c) is not None for c in last)
                              for p in (WITH_COMMA, WITH_POINT))  # fmt: skip
    comma = rows.delimiter != "," and with_comma > with_point
    first = _first(rows, comma)
    return comma, first, *_header(rows, first)


def _plain(file: Path) -> Raw | None:
    """Return the columns of a large file of numbers; None if it contains other cells."""
    with file.open("rb") as stream:
        head = stream.read(LARGE // 16)
        stream.seek(-LARGE // 16, SEEK_END)
        tail = stream.read()
    parts = head[: head.rfind(b"\n")], tail[tail.find(b"\n") + 1 :]
    try:
        rows = _rows(b"\n".join(parts), f"read '{file.name}'")
        comma, first, names, units = _layout(rows)
        if comma or first is None:
            return None
        delimiter = None if rows.delimiter == " " else rows.delimiter
        skipped = rows.numbers[first] - 1
        values = np.loadtxt(
            file, delimiter=delimiter, skiprows=skipped, comments=None, encoding="latin-1", ndmin=2
        )
    except ValueError:
        return None
    width = len(names or rows.cells[first])
    if values.shape[1] != width or not np.isfinite(values).all():
        return None
    said = [label(name) for name in names] if names else [("", "")] * width
    columns = (
        Column(name, unit or (units[k] if units else ""), np.ascontiguousarray(values[:, k]))
        for k, (name, unit) in enumerate(said)
    )
    return Raw(file.name, tuple(columns), skipped + 1)


def _by_cells(file: Path) -> Raw:
    """Return the columns of a text file cell by cell, with a message on the first bad one."""
    where = f"read '{file.name}'"
    rows = _rows(file.read_bytes(), where)
    comma, first, names, units = _layout(rows)
    if first is None:
        got = f"{len(rows.cells)} rows of text only" if rows.cells else "an empty file"
        got = "a header alone" if names else got
        raise ValueError(f"{where}: expected rows of numbers, got {got}")
    width = len(names or rows.cells[first])
    body, numbers = rows.cells[first:], rows.numbers[first:]
    for number, row in zip(numbers, body, strict=True):
        if any(row[width:]):
            hint = "; write numbers with a decimal point" if rows.delimiter == "," else ""
            raise ValueError(
                f"{where}: row {number}: expected {width} cells as in the "
                f"{'header' if names else 'first row'}, got {len(row)}{hint}"
            )
    columns: list[Column] = []
    for k in range(width):
        cells = [row[k] if k < len(row) else "" for row in body]
        if comma:
            cells = [cell.replace(",", ".") if cell.count(",") == 1 else cell for cell in cells]
        name, said = label(names[k]) if names else ("", "")
        values, problem, gaps = _numbers(cells, numbers)
        columns.append(Column(name, said or (units[k] if units else ""), values, problem, gaps))
    return Raw(file.name, tuple(columns), numbers[0])


def _rows(raw: bytes, where: str) -> Rows:
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
    return Rows(delimiter, numbers, [_cells(line, delimiter) for line in plain], comments)


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


def _numeric(row: Sequence[str], comma: bool) -> bool:
    """Return True if at least half of the cells are numbers; the row is then not a header."""
    cells = [cell.replace(",", ".") if comma else cell for cell in row if cell]
    numbers = sum(map(_is_number, cells))
    return numbers > 0 and numbers >= len(cells) / 2


def _first(rows: Rows, comma: bool) -> int | None:
    """Return the index of the first numeric row that is as wide as most of the last rows.

    Rows with text and numbers before a header with names of channels are settings of the recorder.
    """
    widths = [_width(row) for row in rows.cells[-LOOKED_AT:] if _numeric(row, comma)]
    usual = max(set(widths), key=widths.count, default=0)
    wide = [k for k, row in enumerate(rows.cells) if _width(row) >= usual]
    names = [k for k in wide if k < LOOKED_AT and sum(map(_is_name, rows.cells[k])) > 1]
    found = [k for k in wide if _numeric(rows.cells[k], comma)]
    header = next(iter(names), -1)
    for k in names:  # a header below rows of numbers only is an error in the file
        if not any(_is_data(rows.cells[i], comma) for i in found if header < i < k):
            header = k
    later = [k for k in found if k > header]
    return next(iter(later or found), None)


def _is_data(row: Sequence[str], comma: bool) -> bool:
    """Return True if all cells are numbers."""
    return all(_is_number(cell.replace(",", ".") if comma else cell) for cell in row if cell)


def _is_name(cell: str) -> bool:
    """Return True if a cell names a channel: a usual name, or a name with its unit."""
    name, said = label(cell)
    return bool(name) and not _is_number(cell) and (bool(said) or is_channel(name))


def _header(rows: Rows, first: int | None) -> tuple[list[str] | None, list[str] | None]:
    """Return names and units of the columns; None for those that the file does not contain."""
    width = 0 if first is None else _width(rows.cells[first])
    above = [row for row in rows.cells[:first] if first is None or len(row) >= width]
    if not above:
        spoken = [s for c in rows.comments[-1:] for s in (_cells(c, rows.delimiter), c.split())]
        return next((s for s in spoken if len(s) == width and width), None), None
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
