"""Readers of files by suffix, and of Python objects, as columns.

HDF5 files (also MATLAB 7.3) and Parquet files need optional packages.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from glob import glob, has_magic
from importlib import import_module
from os import PathLike
from pathlib import Path
from re import DOTALL, fullmatch
from typing import Any, BinaryIO, TypeVar

import numpy as np

from identification.data.mat_file import Node, node, of_variables, read_variables
from identification.data.raw import Raw, Wanted, column_of, record
from identification.data.record import Record
from identification.data.text import read_text
from identification.data.units import CHANNELS
from symfric.foundation import checks
from symfric.foundation.files import write_table

T = TypeVar("T")
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
    columns = [column_of(where, key, v) for key, v in [*given.items(), *arrays.items()]]
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


def to_csv(record: Record, path: Path) -> Path:
    """Write a record with units in the header, and return the path."""
    signals = {**({} if record.t is None else {"t": record.t}), **record.signals}
    units = {key: record.unit(key) for key in signals}
    header = [f"{key} [{units[key]}]" if units[key] else key for key in signals]
    write_table(path, header, np.column_stack(list(signals.values())).tolist())
    return path


def read_hdf5(file: Path, variable: str | None) -> Record | list[Raw]:
    """Return the columns of an HDF5 file, whose groups are structs.

    Raises:
        ValueError: the package is not installed, the file is damaged, or there are no columns.
    """

    def read(h5py: Any, stream: BinaryIO) -> dict[str, Node]:
        with h5py.File(stream, "r") as group:
            return _struct(group)

    content = _by_package(file, "an HDF5 file", "h5py", read)
    return of_variables(f"read '{file.name}'", file.name, content, variable)


def read_parquet(file: Path) -> Raw:
    """Return the columns of a Parquet file.

    Raises:
        ValueError: the package is not installed, or the file is damaged.
    """
    where = f"read '{file.name}'"
    table = _by_package(file, "a Parquet file", "pyarrow.parquet", lambda p, s: p.read_table(s))
    pairs = zip(table.column_names, table.columns, strict=True)
    return Raw(file.name, tuple(column_of(where, key, values) for key, values in pairs))


def _by_package(file: Path, such: str, module: str, read: Callable[[Any, BinaryIO], T]) -> T:
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


TEXT = (".csv", ".txt", ".tsv", ".dat", ".asc", ".log", ".prn", ".data", "")
PARQUET = (".parquet", ".pq")
READERS: dict[str, Callable[..., Any]] = {
    **dict.fromkeys(TEXT, read_text), **dict.fromkeys((".mat", ".npz", ".npy"), read_variables),
    **dict.fromkeys((".h5", ".hdf5"), read_hdf5), **dict.fromkeys(PARQUET, read_parquet),
}  # fmt: skip
"""Functions that read a file, by its suffix; those of text and Parquet return one table."""
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
    single = suffix in (*TEXT, *PARQUET)
    if single and variable is not None:
        raise ValueError(f"{where}: expected variable= only of .mat, .npz, .npy and .h5 files")
    try:
        found = [READERS[suffix](file)] if single else READERS[suffix](file, variable)
    except OSError as error:
        got = error.strerror or error
        raise ValueError(f"read '{file}': expected a readable file, got {got}") from None
    if isinstance(found, Record):
        return [found]
    return gathered([partial(record, raw, wanted) for raw in found])


def gathered(works: Sequence[Callable[[], T]]) -> list[T]:
    """Return the results of `works`; join their ValueErrors in one error with a line for each."""
    found: list[T] = []
    problems: list[str] = []
    for work in works:
        try:
            found.append(work())
        except ValueError as error:
            problems.append(str(error))
    if problems:
        raise ValueError("\n".join(_once(problems)))
    return found


SHOWN = 3
"""Number of files with the same problem that a message names."""


def _once(problems: Sequence[str]) -> Iterator[str]:
    """Yield each message once, with the names of all files that have the same problem."""
    alike = dict[tuple[str, str], list[str]]()
    for problem in problems:
        match = fullmatch(r"(\w+ )('[^']*')(:.*)", problem, DOTALL)
        verb, name, rest = match.groups() if match else (problem, "", "")
        alike.setdefault((verb, rest), []).append(name)
    for (verb, rest), names in alike.items():
        more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
        yield f"{verb}{', '.join(names[:SHOWN])}{more}{rest}"
