"""Readers of HDF5 files (also MATLAB 7.3) and Parquet files by the optional packages for them."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

import numpy as np

from identification.data.mat_file import Node, node, of_variables
from identification.data.raw import Raw, column_of
from identification.data.record import Record

T = TypeVar("T")


def read_hdf5(file: Path, variable: str | None) -> Record | list[Raw]:
    """Return the columns of an HDF5 file, whose groups are structs.

    Raises:
        ValueError: the package is not installed, the file is damaged, or there are no columns.
    """

    def read(h5py: Any, stream: BinaryIO) -> dict[str, Node]:
        with h5py.File(stream, "r") as group:
            return _struct(group)

    content = _read(file, "an HDF5 file", "h5py", read)
    return of_variables(f"read '{file.name}'", file.name, content, variable)


def read_parquet(file: Path) -> Raw:
    """Return the columns of a Parquet file.

    Raises:
        ValueError: the package is not installed, or the file is damaged.
    """

    def read(parquet: Any, stream: BinaryIO) -> Any:
        return parquet.read_table(stream)

    table, where = _read(file, "a Parquet file", "pyarrow.parquet", read), f"read '{file.name}'"
    pairs = zip(table.column_names, table.columns, strict=True)
    return Raw(file.name, tuple(column_of(where, key, values) for key, values in pairs))


def _read(file: Path, such: str, module: str, read: Callable[[Any, BinaryIO], T]) -> T:
    """Return the content of a file, read by a module of an optional package."""
    where, package = f"read '{file.name}'", module.partition(".")[0]
    try:
        reader = import_module(module)
    except ImportError:
        raise ValueError(
            f"{where}: expected the package {package} to read {file.suffix}, got none installed; "
            f"run 'pip install {package}', or save the data as .csv"
        ) from None
    with file.open("rb") as stream:
        try:
            return read(reader, stream)
        except Exception as error:  # noqa: BLE001 (damaged bytes raise various errors)
            first = (str(error).splitlines() or [""])[0]
            raise ValueError(
                f"{where}: expected {such}, got a damaged or another file: {first}"
            ) from None


def _struct(group: Any) -> dict[str, Node]:
    """Return the datasets and groups of a group by name, without links to nothing.

    MATLAB hides some names by `#`.
    """
    found = {k: v for k, v in group.items() if v is not None and not k.startswith("#")}
    return {k: _struct(v) if hasattr(v, "items") else _numbers(v[()]) for k, v in found.items()}


def _numbers(value: Any) -> Node:
    """Return a dataset as a node; MATLAB stores vectors as matrices of one row."""
    array = np.asarray(value)
    return node(np.squeeze(array) if array.ndim > 1 and 1 in array.shape else array)
