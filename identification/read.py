"""Read measured records from CSV files whose header names columns and units."""

import csv
from collections.abc import Mapping
from pathlib import Path
from re import fullmatch

import numpy as np

from identification.data import UNITS, Array, Dataset
from identification.matlab import read_mat
from symfric.foundation import checks

ALIASES = {
    "t": ("t", "time"),
    "x": ("x", "q", "qm", "position"),
    "force": ("force", "F", "f"),
    "v": ("v", "qd", "dq", "velocity"),
}
"""Names a column may have in a file, by signal."""

FACTORS = {
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6},
    "m": {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6},
    "N": {"N": 1.0, "mN": 1e-3, "kN": 1e3},
    "m/s": {"m/s": 1.0, "mm/s": 1e-3, "um/s": 1e-6, "µm/s": 1e-6},
}
"""Accepted units and their factors, by SI unit."""

REQUIRED = ("t", "x", "force")


def read_data(path: str | Path, columns: Mapping[str, str] | None = None) -> Dataset:
    """A record from a `.csv` or `.mat` file.

    CSV: a header such as `t [s], x [m], force [N]`, in any order; `v [m/s]` is used if it is
    there, other columns are left out. Aliases: time, q, qm, position, F, qd, dq, velocity. Units
    s, ms, us; m, mm, um; N, mN, kN; m/s, mm/s, um/s become SI. Comma, semicolon or tab separates
    the cells; numbers have a decimal point.

    MATLAB (needs scipy, the extra `symfric[mat]`): the EMPS benchmark files are recognised (force
    gtau*vir, position qm, controller); other files have variables with the names above or those
    in `columns`, in SI units.

    Args:
        path: the file.
        columns: signal ("t", "x", "force", "v") -> name of its column or variable in the file.

    Raises:
        ValueError: file, column or cell that cannot be used, with its place.
    """
    file = checks.path("read", path)
    columns = checks.named(f"read '{file.name}': columns", columns, UNITS)
    for name in columns.values():
        checks.text(f"read '{file.name}': columns", name, "the name of a column")
    if not file.is_file():
        raise ValueError(f"read '{path}': expected a file, got nothing there; check the path")
    if file.suffix.lower() == ".mat":
        return read_mat(file, {key: _names(key, columns) for key in UNITS})
    if file.suffix.lower() not in (".csv", ".txt", ".tsv"):
        raise ValueError(f"read '{file.name}': expected a .csv or .mat file, got '{file.suffix}'")
    return _read_csv(file, columns)


def _names(key: str, columns: Mapping[str, str]) -> tuple[str, ...]:
    return (columns[key],) if key in columns else ALIASES[key]


def _read_csv(file: Path, columns: Mapping[str, str]) -> Dataset:
    rows = _rows(file)
    header = [cell.strip() for cell in rows[0][1]]
    found = _columns(file.name, header, columns)
    problems: list[str] = []
    values: dict[str, Array] = {}
    for key, (index, factor) in found.items():
        cells, bad = _numbers(rows[1:], index)
        values[key] = factor * cells
        if bad:
            problems.append(f"column '{header[index]}', {bad}")
    if problems:
        raise ValueError(f"read '{file.name}': " + "; ".join(problems))
    first = rows[1][0] if len(rows) > 1 else 0
    x, force, v = values["x"], values["force"], values.get("v")
    return Dataset(file.name, values["t"], x, force, v, first_row=first)


def _rows(file: Path) -> list[tuple[int, list[str]]]:
    """Non-empty rows with their number in the file, the header first."""
    try:
        text = file.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"read '{file.name}': expected UTF-8 text, got other bytes") from None
    first = next((line for line in text.splitlines() if line.strip()), "")
    delimiter = max(",;\t", key=first.count)
    lines = csv.reader(text.splitlines(), delimiter=delimiter)
    rows = [(number, row) for number, row in enumerate(lines, start=1) if any(map(str.strip, row))]
    if not rows:
        raise ValueError(
            f"read '{file.name}': expected a header such as 't [s], x [m], force [N]', "
            "got an empty file"
        )
    return rows


def _columns(
    where: str, header: list[str], columns: Mapping[str, str]
) -> dict[str, tuple[int, float]]:
    """Signal -> column index and factor to SI."""
    labels = [_label(cell) for cell in header]
    found: dict[str, tuple[int, float]] = {}
    problems: list[str] = []
    for key, unit in UNITS.items():
        names = _names(key, columns)
        hits = [i for i, (name, _) in enumerate(labels) if name in names or header[i] in names]
        if len(hits) > 1:
            problems.append(f"expected one column for {key}, got {[header[i] for i in hits]}")
        elif hits:
            given = labels[hits[0]][1]
            if given in FACTORS[unit]:
                found[key] = hits[0], FACTORS[unit][given]
            else:
                problems.append(
                    f"column '{header[hits[0]]}': expected a unit of {', '.join(FACTORS[unit])} "
                    f"in brackets, got {given or 'none'}"
                )
        elif key in REQUIRED or key in columns:
            problems.append(
                f"expected a column '{names[0]} [{unit}]', got {', '.join(header)}; "
                "name it in the header or with columns="
            )
    if problems:
        raise ValueError(f"read '{where}': " + "; ".join(problems))
    return found


def _label(cell: str) -> tuple[str, str]:
    """Name and unit of a header cell such as `x [mm]`."""
    match = fullmatch(r"(.*?)\s*\[(.*)\]", cell)
    return (match[1], match[2].strip().replace("μ", "µ")) if match else (cell, "")


def _numbers(rows: list[tuple[int, list[str]]], index: int) -> tuple[Array, str]:
    """One column as numbers, and a sentence about its first bad cell, if any."""
    values = np.full(len(rows), np.nan)
    for k, (number, row) in enumerate(rows):
        cell = row[index].strip() if index < len(row) else ""
        try:
            values[k] = float(cell)
        except ValueError:
            return values, f"row {number}: expected a number, got '{cell}'"
    return values, ""
