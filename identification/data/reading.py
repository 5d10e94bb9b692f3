"""Reader of text files (dialects of CSV), other files and Python objects as columns."""

import csv
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from glob import glob, has_magic
from os import PathLike
from pathlib import Path
from re import compile as pattern
from typing import Any, NamedTuple

import numpy as np

from identification.data.mat_file import read_variables
from identification.data.raw import Array, Column, Raw, Wanted, gathered, label, record
from identification.data.record import Record
from identification.data.units import CHANNELS, is_common, unit
from symfric.foundation import checks
from symfric.foundation.files import write_table

ASSUMED = {name: channel.units[0] for name, channel in CHANNELS.items()}
"""Default units of arrays; numbers in Python are in SI units."""


def columns_of(name: str, frame: object, arrays: Mapping[str, object]) -> tuple[Raw, bool]:
    """Return the columns of `frame` and `arrays`, and whether the columns need units as in a file.

    A frame, such as that of pandas or polars, has `columns` and returns a column by its name; a
    mapping contains arrays. Times with a date are converted to seconds from the first one.

    Raises:
        ValueError: neither is given, or columns are not vectors of one length.
    """
    where = f"data '{name}'"
    given: dict[str, object] = {}
    framed = hasattr(frame, "columns") and hasattr(frame, "__getitem__")
    if framed:
        held: Any = frame
        index = getattr(held, "index", None)
        if getattr(index, "name", None) is not None:
            given[str(getattr(index, "name", ""))] = index
        given |= {str(key): held[key] for key in held.columns}
    elif isinstance(frame, Mapping):
        given = dict(checks.named(where, frame))
    elif frame is not None:
        such = "arrays by name or a frame"
        raise checks.refused(where, such, frame, "write Dataset.of(t=t, x=x, force=force)")
    columns = [_held(where, key, v) for key, v in [*given.items(), *arrays.items()]]
    if not columns:
        raise ValueError(f"{where}: expected columns such as t=..., x=..., force=..., got none")
    names = [*given, *arrays]
    labels = names if len({*names}) < len(names) else [c.label for c in columns]
    if len({*labels}) < len(labels):
        raise ValueError(f"{where}: expected every column once, got {', '.join(labels)}")
    if len({c.values.size for c in columns}) > 1:
        got = ", ".join(f"{c.label}: {c.values.size}" for c in columns)
        raise ValueError(f"{where}: expected columns of one length, got {got}")
    return Raw(name, tuple(columns), verb="data"), framed


def _held(where: str, key: str, values: object) -> Column:
    name, said = label(key)
    if isinstance(values, np.ma.MaskedArray):  # masked values are missing
        masked: Any = values  # pyright: ignore[reportUnknownVariableType]
        values = masked.astype(float).filled(np.nan) if masked.dtype.kind in "iuf" else masked
    wrong = checks.refused(f"{where}: {key}", "a vector of numbers", values)
    try:
        found = np.asarray(values)
    except (ValueError, TypeError):
        raise wrong from None
    if found.ndim == 2 and min(found.shape) == 1:  # a row or column vector as in MATLAB
        found = found.ravel()
    if found.ndim != 1:
        raise wrong
    if found.dtype.kind in "mM" and found.size:
        seconds = (found - found[0]).astype("timedelta64[ns]").astype(np.int64) * 1e-9
        return Column.of(name, "s", seconds)
    if found.dtype.kind in "iufb":
        return Column.of(name, said, found.astype(float))
    numbers = np.full(found.size, np.nan)
    for k, item in enumerate(found):
        number = checks.as_number(item) if found.dtype.kind == "O" else None
        if number is None:
            problem = f"sample {k}: expected a number, got {checks.shown(item)}"
            return Column(name, said, numbers, problem)
        numbers[k] = number
    return Column.of(name, said, numbers)


COMMENTS = ("#", "%", "//")
"""First characters of comment lines."""
DELIMITERS = ("\t", ";", ",", " ")
EMPTY = ("", "-", "na", "n/a", "null")
"""Cells that count as missing numbers, in addition to NaN."""
LOOKED_AT = 40
"""Number of lines at the end of the file from which the delimiter is deduced."""
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
    header. A row of units may follow the header.

    Raises:
        ValueError: no such file, no text, no rows of numbers, or rows of different lengths.
    """
    rows = _rows(file)
    where = f"read '{file.name}'"
    last = [cell for row in rows.cells[-LOOKED_AT:] for cell in row]
    with_comma, with_point = (sum(p.fullmatch(c) is not None for c in last)
                              for p in (WITH_COMMA, WITH_POINT))  # fmt: skip
    comma = rows.delimiter != "," and with_comma > with_point
    first = _first(rows, comma)
    names, units = _header(rows, first)
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


def _rows(file: Path) -> Rows:
    """Return the non-empty lines, split into cells."""
    raw, where = file.read_bytes(), f"read '{file.name}'"
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
        elif line.strip(" \t,;"):
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
    """Return the index of the first numeric row that is as wide as most of the last rows."""
    widths = [_width(row) for row in rows.cells[-LOOKED_AT:] if _numeric(row, comma)]
    usual = max(set(widths), key=widths.count, default=0)
    found = (k for k, r in enumerate(rows.cells) if _width(r) >= usual and _numeric(r, comma))
    return next(found, None)


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
    return values, problem, bool(bad.size) and not np.isinf(values).any()


def to_csv(record: Record, path: Path) -> Path:
    """Write a record with units in the header, and return the path."""
    signals = {**({} if record.t is None else {"t": record.t}), **record.signals}
    units = {key: record.unit(key) for key in signals}
    header = [f"{key} [{units[key]}]" if units[key] else key for key in signals]
    write_table(path, header, np.column_stack(list(signals.values())).tolist())
    return path


def _text(file: Path, variable: str | None) -> list[Raw]:
    """Return the columns of a text file."""
    if variable is not None:
        raise ValueError(
            f"read '{file.name}': expected variable= only of .mat, .npz and .npy files"
        )
    return [read_text(file)]


TEXT = (".csv", ".txt", ".tsv", ".dat", ".asc", ".log", ".prn", ".data", "")
READERS: dict[str, Callable[[Path, str | None], Record | list[Raw]]] = {
    **dict.fromkeys(TEXT, _text), **dict.fromkeys((".mat", ".npz", ".npy"), read_variables)
}  # fmt: skip
"""Functions that read a file, by its suffix."""
Paths = str | PathLike[str] | Sequence[str | PathLike[str]]


def files(paths: Paths) -> tuple[Path, ...]:
    """Return the files of a path, a pattern such as `run*.csv` or a list of these, in order.

    Raises:
        ValueError: an absent file, a folder, or a pattern without a match.
    """
    several = paths if not isinstance(paths, str | PathLike) else (paths,)
    found: list[Path] = []
    for given in checks.many("read", several, "paths"):
        path = checks.path("read", given)
        hits = [Path(hit) for hit in sorted(glob(str(path))) if Path(hit).is_file()]
        if path.is_file():
            hits = [path]
        elif path.is_dir():
            raise ValueError(f"read '{path}': expected a file, got a folder; pass '{path}/*.csv'")
        elif not has_magic(str(path)):
            raise ValueError(f"read '{path}': expected a file, got nothing there; check the path")
        elif not hits:
            raise ValueError(f"read '{path}': expected files, got none that match the pattern")
        found += hits
    if not found:
        raise ValueError("read: expected paths of files, got none")
    return tuple(found)


def read_records(paths: Paths, wanted: Wanted, variable: str | None) -> tuple[Record, ...]:
    """Return the records of all files; problems of several files are joined in one error."""
    if variable is not None:
        checks.text("read: variable", variable, "the name of a variable")
    works = [partial(_read, file, wanted, variable) for file in files(paths)]
    return tuple(record for found in gathered(works) for record in found)


def _read(file: Path, wanted: Wanted, variable: str | None) -> list[Record]:
    suffix, where = file.suffix.lower(), f"read '{file.name}'"
    if suffix not in READERS:
        such = f"one of {', '.join(filter(None, READERS))}"
        raise ValueError(f"{where}: expected {such}, got '{file.suffix}'")
    try:
        found = READERS[suffix](file, variable)
    except OSError as error:
        got = error.strerror or error
        raise ValueError(f"read '{file}': expected a readable file, got {got}") from None
    if isinstance(found, Record):
        return [found]
    return gathered([partial(record, raw, wanted) for raw in found])
