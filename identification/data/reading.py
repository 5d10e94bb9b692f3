"""Columns from text files (dialects of CSV), other files and Python objects."""

import csv
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from glob import glob, has_magic
from os import PathLike
from pathlib import Path
from re import fullmatch
from typing import Any, final

import numpy as np

from identification.data.mat_file import read_mat, read_npy
from identification.data.raw import Array, Column, Raw, Wanted, gathered, label, record
from identification.data.record import Record
from identification.data.units import is_common, unit
from symfric.foundation import checks
from symfric.foundation.files import write_table

ASSUMED = {"t": "s", "x": "m", "v": "m/s", "a": "m/s^2", "force": "N", "F": "N", "N": "N"}
"""Default units of arrays: numbers in Python are SI."""


def columns_of(name: str, frame: object, arrays: Mapping[str, object]) -> tuple[Raw, bool]:
    """Return the columns of `frame` and `arrays`, and whether they come from a frame.

    A frame has `columns` and returns one by its name: pandas, polars. A mapping holds
    arrays. Times with a date become seconds from the first one.

    Raises:
        ValueError: neither, or columns that are not vectors of one length.
    """
    where = f"data '{name}'"
    given: dict[str, object] = {}
    framed = hasattr(frame, "columns") and hasattr(frame, "__getitem__")
    if framed:
        held: Any = frame
        given = {str(key): held[key] for key in held.columns}
        index = getattr(held, "index", None)
        if getattr(index, "name", None) is not None:
            given = {str(getattr(index, "name", "")): index, **given}
    elif isinstance(frame, Mapping):
        given = dict(checks.named(where, frame))
    elif frame is not None:
        raise checks.refused(
            where, "arrays by name or a frame", frame, "write Dataset.of(t=t, x=x, force=force)"
        )
    twice = [key for key in arrays if key in given]
    if twice:
        raise ValueError(f"{where}: expected every column once, got {', '.join(twice)} twice")
    columns = tuple(_held(where, key, v) for key, v in (given | dict(arrays)).items())
    if not columns:
        raise ValueError(f"{where}: expected columns such as t=..., x=..., force=..., got none")
    labels = [c.label for c in columns]
    if len(set(labels)) < len(labels):
        raise ValueError(f"{where}: expected every column once, got {', '.join(labels)}")
    sizes = {c.label: c.values.size for c in columns}
    if len(set(sizes.values())) > 1:
        got = ", ".join(f"{key}: {size}" for key, size in sizes.items())
        raise ValueError(f"{where}: expected columns of one length, got {got}")
    return Raw(name, columns, verb="data"), framed


def _held(where: str, key: str, values: object) -> Column:
    name, said = label(key)
    if isinstance(values, np.ma.MaskedArray):  # masked values were not measured
        masked: Any = values  # pyright: ignore[reportUnknownVariableType]
        values = masked.astype(float).filled(np.nan) if masked.dtype.kind in "iuf" else masked
    try:
        found = np.asarray(values)
    except (ValueError, TypeError):
        raise checks.refused(f"{where}: {key}", "a vector of numbers", values) from None
    if found.ndim == 2 and min(found.shape) == 1:  # a vector as MATLAB has them
        found = found.ravel()
    if found.dtype.kind in "mM" and found.ndim == 1 and found.size:
        seconds = (found - found[0]).astype("timedelta64[ns]").astype(np.int64) * 1e-9
        return Column.of(name, "s", seconds)
    if found.ndim != 1:
        raise checks.refused(f"{where}: {key}", "a vector of numbers", values)
    numbers, problem = np.full(found.size, np.nan), ""
    if found.dtype.kind in "iufb":
        numbers = found.astype(float)
    elif found.dtype.kind == "O":
        for k, item in enumerate(found):
            number = checks.as_number(item)
            if number is None:
                problem = f"sample {k}: expected a number, got {checks.shown(item)}"
                break
            numbers[k] = number
    else:
        problem = f"sample 0: expected a number, got {checks.shown(found[0])}" if found.size else ""
    return Column(name, said, numbers, problem) if problem else Column.of(name, said, numbers)


COMMENTS = ("#", "%", "//")
"""First characters of comment lines."""
DELIMITERS = ("\t", ";", ",", " ")
EMPTY = ("", "-", "na", "n/a", "null")
"""Cells without a number, in addition to NaN."""
LOOKED_AT = 40
"""Lines at the end of the file from which the delimiter is deduced."""


@final
@dataclass(frozen=True, eq=False)
class Rows:
    """Lines split into cells.

    Attributes:
        delimiter: between the cells; a space is any number of spaces and tabs.
        numbers: row numbers in the file.
        cells: of each row.
        comments: comment rows before the first other row.
    """

    delimiter: str
    numbers: list[int]
    cells: list[list[str]]
    comments: list[str]


def read_text(file: Path) -> Raw:
    """Return the columns of a text file.

    Comma, semicolon, tab or spaces separate the cells; decimal commas are accepted unless commas
    separate cells. Lines before the header and lines that begin with #, % or // are ignored, except
    that a last comment with as many words as columns is the header of a file without another one. A
    row of units may follow the header.

    Raises:
        ValueError: an absent file, no text, no rows of numbers, rows of different lengths.
    """
    rows = _rows(file)
    where = f"read '{file.name}'"
    comma = rows.delimiter != "," and _decimal_comma(rows)
    first = _first(rows, comma)
    header, names, units = _header(rows, first)
    if first is None:
        got = "an empty file" if not rows.cells else f"{len(rows.cells)} rows of text only"
        if header is not None:
            got = "a header alone"
        raise ValueError(f"{where}: expected rows of numbers, got {got}")
    width = len(names) if names else len(rows.cells[first])
    body, numbers = rows.cells[first:], rows.numbers[first:]
    for number, row in zip(numbers, body, strict=True):
        if len(row) > width and any(cell for cell in row[width:]):
            hint = "; write numbers with a decimal point" if rows.delimiter == "," else ""
            raise ValueError(
                f"{where}: row {number}: expected {width} cells as in the "
                f"{'header' if names else 'first row'}, got {len(row)}{hint}"
            )
    columns: list[Column] = []
    for k in range(width):
        values, problem, gaps = _column(body, numbers, k, comma)
        name, said = label(names[k]) if names else ("", "")
        columns.append(Column(name, said or (units[k] if units else ""), values, problem, gaps))
    return Raw(file.name, tuple(columns), numbers[0])


def _rows(file: Path) -> Rows:
    """Return the lines that are not empty, split into cells."""
    try:
        text = file.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raw = file.read_bytes()
        if not raw.startswith((b"\xff\xfe", b"\xfe\xff")):
            text = raw.decode("latin-1")  # degree and micro signs of older recorders
        else:
            try:
                text = raw.decode("utf-16")
            except UnicodeDecodeError:
                raise ValueError(
                    f"read '{file.name}': expected text in UTF-8 or UTF-16, got other bytes"
                ) from None
    if "\0" in text:
        raise ValueError(f"read '{file.name}': expected a text file, got one with binary numbers")
    lines = [(n, line.strip("\ufeff \r")) for n, line in enumerate(text.split("\n"), start=1)]
    comments: list[str] = []
    plain: list[tuple[int, str]] = []
    for number, line in lines:
        if line.lstrip('" \t').startswith(COMMENTS):
            if not plain:
                comments.append(line.lstrip('" \t#%/').strip())
        elif line.strip(" \t,;"):
            plain.append((number, line))
    if not plain:
        return Rows(",", [], [], comments)
    delimiter = _delimiter([line for _, line in plain])
    cells = [split_line(line, delimiter) for _, line in plain]
    return Rows(delimiter, [n for n, _ in plain], cells, comments)


def _delimiter(lines: Sequence[str]) -> str:
    """Return the delimiter with which most of the last lines have the same number of numbers."""
    last = lines[-LOOKED_AT:]

    def score(delimiter: str) -> tuple[float, int]:
        rows = [split_line(line, delimiter) for line in last]
        widths = [len(row) for row in rows]
        usual = max(set(widths), key=widths.count)
        numbers = sum(sum(map(_is_number, row)) for row in rows if len(row) == usual)
        return (numbers / (usual * len(rows)) if usual > 1 else 0.0), -DELIMITERS.index(delimiter)

    best = max(DELIMITERS, key=score)
    if score(best)[0] > 0:
        return best
    return max(",;\t", key=lines[0].count) if any(d in lines[0] for d in ",;\t") else " "


def split_line(line: str, delimiter: str) -> list[str]:
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
    if "_" in cell:  # Python accepts it in numbers
        raise ValueError
    return float(cell)


def _is_number(cell: str) -> bool:
    try:
        _number(cell)
    except ValueError:
        return fullmatch(r"[-+]?\d*,\d+([eE][-+]?\d+)?", cell) is not None
    return True


def _decimal_comma(rows: Rows) -> bool:
    """Return True if more cells are numbers with a decimal comma than with a point."""
    cells = [cell for row in rows.cells[-LOOKED_AT:] for cell in row]
    with_comma = sum(fullmatch(r"[-+]?\d*,\d+([eE][-+]?\d+)?", c) is not None for c in cells)
    with_point = sum(fullmatch(r"[-+]?\d*\.\d+([eE][-+]?\d+)?", c) is not None for c in cells)
    return with_comma > with_point


def _numeric(row: Sequence[str], comma: bool) -> bool:
    """Return True if at least half of the cells are numbers, so the row is not a header."""
    cells = [cell.replace(",", ".") if comma else cell for cell in row if cell]
    numbers = sum(map(_is_number, cells))
    return numbers > 0 and numbers >= len(cells) / 2


def _first(rows: Rows, comma: bool) -> int | None:
    """Return the first row of numbers, at least as wide as most of the last ones."""
    widths = [_trimmed(row) for row in rows.cells[-LOOKED_AT:] if _numeric(row, comma)]
    usual = max(set(widths), key=widths.count, default=0)
    return next(
        (k for k, r in enumerate(rows.cells) if _trimmed(r) >= usual and _numeric(r, comma)), None
    )


def _header(rows: Rows, first: int | None) -> tuple[int | None, list[str] | None, list[str] | None]:
    """Return the index of the header row, names and units of the columns, if there are any."""
    end = len(rows.cells) if first is None else first
    width = 0 if first is None else _trimmed(rows.cells[first])
    above = [k for k in range(end) if first is None or len(rows.cells[k]) >= width]
    if not above:
        spoken = [split_line(c, rows.delimiter) for c in rows.comments[-1:]]
        spoken += [c.split() for c in rows.comments[-1:]]
        names = next((s for s in spoken if len(s) == width and width), None)
        return None, names, None
    last = above[-1]
    cells = rows.cells[last]
    if len(above) > 1 and all(unit(c.strip("[]()")) is not None for c in cells):
        names = rows.cells[above[-2]]
        if len(names) == len(cells) and not all(is_common(c) for c in names if c):
            return above[-2], names, [c.strip("[]()") for c in cells]
    while cells and not cells[-1]:
        cells = cells[:-1]
    return last, cells, None


def _trimmed(row: Sequence[str]) -> int:
    """Return the number of cells up to the last that is not empty."""
    return max((k + 1 for k, cell in enumerate(row) if cell), default=0)


def _column(
    body: Sequence[Sequence[str]], numbers: Sequence[int], index: int, comma: bool
) -> tuple[Array, str, bool]:
    """Return a column as numbers, a message on its first bad cell, True if all such are empty."""
    cells = [row[index] if index < len(row) else "" for row in body]
    if comma:
        cells = [cell.replace(",", ".") if cell.count(",") == 1 else cell for cell in cells]
    values = np.full(len(cells), np.nan)
    problem = ""
    for k, cell in enumerate(cells):
        try:
            values[k] = _number(cell)
        except ValueError:
            problem = problem or f"row {numbers[k]}: expected a number, got '{cell[:40]}'"
            if cell.lower() not in EMPTY:
                return values, problem, False
    gaps = not bool(np.isinf(values).any())
    if problem:
        return values, problem, gaps
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        place = f"row {numbers[int(bad[0])]}"
        return (
            values,
            f"{place}: expected a finite number, got {cells[int(bad[0])][:40]}"
            + (f" ({bad.size} such cells)" if bad.size > 1 else ""),
            gaps,
        )
    return values, "", False


def to_csv(record: Record, path: Path) -> Path:
    """Write a record with units in its header, and return the path."""
    signals = {**({} if record.t is None else {"t": record.t}), **record.signals}
    units = {key: record.unit(key) for key in signals}
    header = [f"{key} [{units[key]}]" if units[key] else key for key in signals]
    write_table(path, header, np.column_stack(list(signals.values())).tolist())
    return path


TEXT = (".csv", ".txt", ".tsv", ".dat", ".asc", ".log", ".prn", ".data", "")
NUMPY = (".npy", ".npz")
Paths = str | PathLike[str] | Sequence[str | PathLike[str]]


def files(paths: Paths) -> tuple[Path, ...]:
    """Return the files of a path, a pattern such as `run*.csv` or several of them, in order.

    Raises:
        ValueError: an absent file, a folder, a pattern without a match.
    """
    several = paths if not isinstance(paths, str | PathLike) else (paths,)
    found: list[Path] = []
    for given in checks.many("read", several, "paths"):
        path = checks.path("read", given)
        if path.is_file():
            found.append(path)
        elif path.is_dir():
            raise ValueError(f"read '{path}': expected a file, got a folder; pass '{path}/*.csv'")
        elif has_magic(str(path)):
            hits = [Path(hit) for hit in sorted(glob(str(path))) if Path(hit).is_file()]
            if not hits:
                raise ValueError(f"read '{path}': expected files, got none that match the pattern")
            found.extend(hits)
        else:
            raise ValueError(f"read '{path}': expected a file, got nothing there; check the path")
    if not found:
        raise ValueError("read: expected paths of files, got none")
    return tuple(found)


def read_records(paths: Paths, wanted: Wanted, variable: str | None) -> tuple[Record, ...]:
    """Return the records of all files; the problems of all files are one error."""
    if variable is not None:
        checks.text("read: variable", variable, "the name of a variable")
    works = [partial(_read, file, wanted, variable) for file in files(paths)]
    return tuple(record for found in gathered(works) for record in found)


def _read(file: Path, wanted: Wanted, variable: str | None) -> tuple[Record, ...]:
    suffix = file.suffix.lower()
    try:
        if suffix == ".mat":
            found = read_mat(file, variable)
        elif suffix in NUMPY:
            found = read_npy(file, variable)
        elif suffix in TEXT:
            if variable is not None:
                raise ValueError(
                    f"read '{file.name}': expected variable= only of .mat, .npz and .npy files"
                )
            found = [read_text(file)]
        else:
            raise ValueError(
                f"read '{file.name}': expected a text file ({', '.join(filter(None, TEXT))}), "
                f".mat, .npz or .npy, got '{file.suffix}'"
            )
    except OSError as error:
        raise ValueError(
            f"read '{file}': expected a readable file, got {error.strerror or error}"
        ) from None
    if isinstance(found, Record):
        return (found,)
    works: list[Callable[[], Record]] = [partial(record, raw, wanted) for raw in found]
    return tuple(gathered(works))
