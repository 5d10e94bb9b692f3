"""Reader of HDF5 files (also MATLAB 7.3) and Parquet files by the optional packages for them."""

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from identification.data.mat_file import Node, node, of_variables
from identification.data.raw import Column, Raw, label
from identification.data.record import Record

PACKAGES = {".h5": "h5py", ".hdf5": "h5py", ".parquet": "pyarrow", ".pq": "pyarrow"}
"""Suffix -> package that reads the file."""


def read_archive(file: Path, variable: str | None) -> Record | list[Raw]:
    """Return the columns of an HDF5 file (groups are structs), or those of a Parquet table.

    Raises:
        ValueError: the package is not installed, the file is damaged, or there are no columns.
    """
    where, package = f"read '{file.name}'", PACKAGES[file.suffix.lower()]
    try:
        reader: Any = import_module("pyarrow.parquet" if package == "pyarrow" else package)
    except ImportError:
        raise ValueError(
            f"{where}: expected the package {package} to read {file.suffix}, got none installed; "
            f"run 'pip install {package}', or save the data as .csv"
        ) from None
    try:
        if package == "h5py":
            with reader.File(file, "r") as group:
                content: dict[str, Node] = _struct(group)
        else:
            table = reader.read_table(file)
            return [Raw(file.name, tuple(map(_column, table.column_names, table.columns)))]
    except (OSError, ValueError) as error:  # errors of PyArrow are of both types
        if isinstance(error, FileNotFoundError | PermissionError):
            raise
        raise ValueError(
            f"{where}: expected a file of {package}, got another one: {error}"
        ) from None
    return of_variables(where, file.name, content, variable)


def _struct(group: Any) -> dict[str, Node]:
    """Return the datasets and groups of a group by name; MATLAB hides some names by `#`."""
    found = {k: v for k, v in group.items() if not k.startswith("#")}
    return {k: _struct(v) if hasattr(v, "items") else _numbers(v[()]) for k, v in found.items()}


def _numbers(value: Any) -> Node:
    """Return a dataset as a node; MATLAB stores vectors as matrices of one row."""
    array = np.asarray(value)
    return node(np.squeeze(array) if array.ndim > 1 and 1 in array.shape else array)


def _column(name: str, values: Any) -> Column:
    """Return a column of a table; times with a date are converted to seconds from the first."""
    text, unit = label(name)
    array = np.asarray(values.to_numpy())
    if array.dtype.kind == "M":
        return Column.of(
            text, "s", (array - array[0]).astype("timedelta64[ns]").astype(float) / 1e9
        )
    if array.dtype.kind in "iufb":
        return Column.of(text, unit, array.astype(float))
    problem = f"expected numbers, got values of type {array.dtype}"
    return Column(text, unit, np.full(array.size, np.nan), problem)
