"""Signals in CSV files: a header with column names and units, rows of numbers, results in SI.

The reader serves both identification records and simulation inputs.
"""

import csv
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from re import fullmatch
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.units import parsed

Array = NDArray[np.float64]
Rows = list[tuple[int, list[str]]]
"""Row number in the file, cells."""

USUAL: Mapping[str, str] = {
    "s": "s, ms, us, µs, min, h, d, a, yr", "m": "m, mm, cm, um, µm", "N": "N, mN, kN",
    "m/s": "m/s, mm/s, um/s, µm/s", "N m": "N m, Nm, mN m, mNm, kN m, kNm",
    "rad": "rad, mrad, deg, °, rev", "rad/s": "rad/s, deg/s, rpm",
}  # fmt: skip
"""SI unit -> its usual units, for messages; a column may have any unit of its dimension."""


@final
@dataclass(frozen=True)
class Column:
    """Column to look for.

    Attributes:
        names: possible names in the header, without or with the unit.
        unit: SI unit of the result.
        needed: True if it is required.
        assumed: True if a header without a unit means the SI unit.
    """

    names: Collection[str]
    unit: str
    needed: bool = True
    assumed: bool = False


@final
@dataclass(frozen=True, eq=False)
class Table:
    """Columns that were found.

    Attributes:
        columns: name -> values in SI units, shape (n,).
        first_row: row of the file with the first numbers; 0 if there are none.
    """

    columns: dict[str, Array]
    first_row: int


def read_table(file: Path, wanted: Mapping[str, Column]) -> Table:
    """Return the columns `wanted` of a CSV file.

    Comma, semicolon or tab separates the cells; numbers may have a decimal comma if commas are not
    the separator. Other columns are ignored.

    Raises:
        ValueError: all problems of the header, or of the cells, at once, each with its place.
        OSError: the file cannot be read.
    """
    rows, delimiter = _rows(file)
    header = [cell.strip() for cell in rows[0][1]]
    found = _places(file.name, header, wanted)
    columns: dict[str, Array] = {}
    problems: list[str] = []
    long = [(n, row) for n, row in rows if any(map(str.strip, row[len(header) :]))]
    if long:
        problems.append(
            f"row {long[0][0]}: expected {len(header)} cells as in the header, got "
            f"{len(long[0][1])}" + "; write numbers with a decimal point" * (delimiter == ",")
        )
    for key, (index, factor) in found.items():
        cells, bad = _numbers(rows[1:], index, "." if delimiter == "," else ",")
        columns[key] = factor * cells
        if bad:
            problems.append(f"column '{header[index]}', {bad}")
    _refuse(file.name, problems)
    return Table(columns, rows[1][0] if len(rows) > 1 else 0)


def _refuse(name: str, problems: Sequence[str]) -> None:
    if problems:
        raise ValueError(f"read '{name}': " + "; ".join(problems))


def _rows(file: Path) -> tuple[Rows, str]:
    """Return non-empty rows with their number in the file, the header first, and the separator."""
    if not file.exists():
        raise ValueError(f"read '{file}': expected a file, got nothing there; check the path")
    if not file.is_file():
        kind = "a folder" if file.is_dir() else "something else"
        raise ValueError(f"read '{file}': expected a file, got {kind}")
    try:
        text = file.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"read '{file.name}': expected UTF-8 text, got other bytes") from None
    first = next((line for line in text.splitlines() if line.strip()), "")
    delimiter = max(",;\t", key=first.count)
    lines = csv.reader(text.splitlines(), delimiter=delimiter)
    try:
        rows = [(n, row) for n, row in enumerate(lines, start=1) if any(map(str.strip, row))]
    except csv.Error as error:
        raise ValueError(
            f"read '{file.name}': expected rows of short cells, got {error} in row {lines.line_num}"
        ) from None
    if not rows:
        raise ValueError(
            f"read '{file.name}': expected a header such as 't [s], x [m], force [N]', "
            "got an empty file"
        )
    return rows, delimiter


def _places(
    where: str, header: list[str], wanted: Mapping[str, Column]
) -> dict[str, tuple[int, float]]:
    """Return name -> index of its column and factor to SI."""
    labels = [_label(cell) for cell in header]
    found: dict[str, tuple[int, float]] = {}
    problems: list[str] = []
    for key, column in wanted.items():
        names = column.names
        hits = [i for i, (name, _) in enumerate(labels) if name in names or header[i] in names]
        if len(hits) > 1:
            twice = ", ".join(f"'{header[i]}'" for i in hits)
            problems.append(f"expected one column for {key}, got {twice}")
        elif hits:
            given = labels[hits[0]][1] or (column.unit if column.assumed else "")
            factor = _factor(column.unit, given)
            if factor is not None:
                found[key] = hits[0], factor
            else:
                usual = USUAL.get(column.unit, column.unit)
                problems.append(
                    f"column '{header[hits[0]]}': expected a unit of {usual} in brackets, "
                    f"got {given or 'none'}"
                )
        elif column.needed:
            example = next(iter(names))
            problems.append(
                f"expected a column '{_label(example)[0]} [{column.unit}]', "
                f"got {', '.join(header)}; check the header"
            )
    _refuse(where, problems)
    return found


def _factor(si: str, given: str) -> float | None:
    """Return the factor from the unit `given` to `si`; None for another dimension."""
    meant, wanted = parsed(given or "?"), parsed(si)
    if meant is None or wanted is None or meant.powers != wanted.powers:
        return 1.0 if given == si else None
    return meant.factor / wanted.factor


def _label(cell: str) -> tuple[str, str]:
    """Return name and unit of a header cell such as `x [mm]`."""
    match = fullmatch(r"(.*?)\s*\[(.*)\]", cell)
    return (match[1], match[2].strip().replace("μ", "µ")) if match else (cell, "")


def _numbers(rows: Rows, index: int, decimal: str) -> tuple[Array, str]:
    """Return one column as numbers, and a sentence about its first bad cell, if any."""
    values = np.full(len(rows), np.nan)
    for k, (number, row) in enumerate(rows):
        cell = row[index].strip() if index < len(row) else ""
        try:
            values[k] = float(cell.replace(decimal, "."))
        except ValueError:
            return values, f"row {number}: expected a number, got '{cell[:40]}'"
    return values, ""
