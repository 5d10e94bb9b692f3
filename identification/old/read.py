"""Read measured records from CSV files whose header names columns and units."""

from collections.abc import Mapping
from pathlib import Path

from identification.old.data import UNITS, Dataset
from identification.old.matlab import read_mat
from symfric.foundation import checks
from symfric.foundation.tables import Column, read_table

ALIASES = {
    "t": ("t", "time"),
    "x": ("x", "q", "qm", "position"),
    "force": ("force", "F", "f"),
    "v": ("v", "qd", "dq", "velocity"),
}
"""Names a column may have in a file, by signal."""

REQUIRED = ("t", "x", "force")


def read_data(path: str | Path, columns: Mapping[str, str] | None = None) -> Dataset:
    """A record from a `.csv` or `.mat` file.

    CSV: a header such as `t [s], x [m], force [N]`, in any order; `v [m/s]` is used if it is
    there, other columns are left out. Aliases: time, q, qm, position, F, qd, dq, velocity. Units
    s, ms, us; m, cm, mm, um; N, mN, kN; m/s, mm/s, um/s become SI. Comma, semicolon or tab
    separates the cells; numbers have a decimal point.

    MATLAB up to version 7: the EMPS benchmark files are recognised (force
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
    wanted = {
        key: Column(_names(key, columns), unit, needed=key in REQUIRED or key in columns)
        for key, unit in UNITS.items()
    }
    table = read_table(file, wanted)
    found = table.columns
    return Dataset(
        file.name,
        found["t"],
        found["x"],
        found["force"],
        found.get("v"),
        first_row=table.first_row,
    )
