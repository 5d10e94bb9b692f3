"""Reader of CSV files with column names and units in the header; results are in SI units."""

import csv
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from re import fullmatch

import numpy as np

from symfric.foundation.numeric import Array
from symfric.foundation.units import parsed

Rows = list[tuple[int, list[str]]]
"""Row number in the file and cells of each row."""

USUAL: Mapping[str, str] = {
    "s": "s, ms, us, µs, min, h, d, a, yr", "m": "m, mm, cm, um, µm", "N": "N, mN, kN",
    "m/s": "m/s, mm/s, um/s, µm/s", "N m": "N m, Nm, mN m, mNm, kN m, kNm",
    "rad": "rad, mrad, deg, °, rev", "rad/s": "rad/s, deg/s, rpm",
}  # fmt: skip
"""Usual units by SI unit, for messages; a column may have any unit of the dimension."""


def read_columns(file: Path, wanted: Mapping[str, tuple[Collection[str], str]]) -> dict[str, Array]:
    """Return columns of a CSV file in SI units, by key.

    Cells are separated by commas, semicolons or tabs; numbers may have a decimal comma if the
    separator is not a comma. Columns without a unit in the header are in SI units. Columns that are
    not in `wanted` are ignored.

    Args:
        file: file to read.
        wanted: possible names in the header, without or with the unit, and SI unit, by key.

    Raises:
        ValueError: all problems of the header, or else of the cells, at once, each with its place.
        OSError: the file cannot be read.
    """
    rows, delimiter = _rows(file)
    header = [cell.strip() for cell in rows[0][1]]
    places, problems = dict[str, tuple[int, float]](), list[str]()
    for key, (names, unit) in wanted.items():
        try:
            places[key] = _place(header, key, names, unit)
        except ValueError as error:
            problems.append(str(error))
    _refuse(file.name, problems)
    long = [(n, row) for n, row in rows if any(map(str.strip, row[len(header) :]))]
    if long:
        problems.append(
            f"row {long[0][0]}: expected {len(header)} cells as in the header, got "
            f"{len(long[0][1])}" + "; write numbers with a decimal point" * (delimiter == ",")
        )
    columns: dict[str, Array] = {}
    for key, (index, factor) in places.items():
        cells, bad = _numbers(rows[1:], index, "." if delimiter == "," else ",")
        columns[key] = factor * cells
        if bad:
            problems.append(f"column '{header[index]}', {bad}")
    _refuse(file.name, problems)
    return columns


def _refuse(name: str, problems: Sequence[str]) -> None:
    if problems:
        raise ValueError(f"read '{name}': " + "; ".join(problems))


def _rows(file: Path) -> tuple[Rows, str]:
    """Return the non-empty rows, beginning with the header, and the separator."""
    if not file.is_file():
        kind = "a folder" if file.is_dir() else "something else"
        got = kind if file.exists() else "nothing there; check the path"
        raise ValueError(f"read '{file}': expected a file, got {got}")
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


def _place(header: list[str], key: str, names: Collection[str], unit: str) -> tuple[int, float]:
    """Return the index of a column and the factor from its unit to SI.

    Raises:
        ValueError: the column is missing, is not unique, or has a unit of another dimension.
    """
    labels = [_label(cell) for cell in header]
    hits = [i for i, (name, _) in enumerate(labels) if name in names or header[i] in names]
    if not hits:
        raise ValueError(
            f"expected a column '{_label(next(iter(names)))[0]} [{unit}]', "
            f"got {', '.join(header)}; check the header"
        )
    if len(hits) > 1:
        twice = ", ".join(f"'{header[i]}'" for i in hits)
        raise ValueError(f"expected one column for {key}, got {twice}")
    written = labels[hits[0]][1] or unit
    meant, si = parsed(written), parsed(unit)
    if meant is not None and si is not None and meant.powers == si.powers:
        return hits[0], meant.factor / si.factor
    if written == unit:
        return hits[0], 1.0
    raise ValueError(
        f"column '{header[hits[0]]}': expected a unit of {USUAL.get(unit, unit)} in brackets, "
        f"got {written}"
    )


def _label(cell: str) -> tuple[str, str]:
    """Return the name and the unit in a header cell such as `x [mm]`."""
    match = fullmatch(r"(.*?)\s*\[(.*)\]", cell)
    return (match[1], match[2].strip().replace("μ", "µ")) if match else (cell, "")


def _numbers(rows: Rows, index: int, decimal: str) -> tuple[Array, str]:
    """Return one column as numbers, and a message about its first invalid cell, or ""."""
    values = np.full(len(rows), np.nan)
    for k, (number, row) in enumerate(rows):
        cell = row[index].strip() if index < len(row) else ""
        try:
            values[k] = float(cell.replace(decimal, "."))
        except ValueError:
            return values, f"row {number}: expected a number, got '{cell[:40]}'"
    return values, ""
