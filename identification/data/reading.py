"""Which files are meant, and who reads each."""

from collections.abc import Callable, Sequence
from functools import partial
from glob import glob, has_magic
from os import PathLike
from pathlib import Path

from identification.data.mat_file import read_mat, read_npy
from identification.data.raw import Wanted, gathered, record
from identification.data.record import Record
from identification.data.text_file import read_text
from symfric.foundation import checks

TEXT = (".csv", ".txt", ".tsv", ".dat", ".asc", ".log", ".prn", ".data", "")
NUMPY = (".npy", ".npz")
Paths = str | PathLike[str] | Sequence[str | PathLike[str]]


def files(paths: Paths) -> tuple[Path, ...]:
    """The files that a path, a pattern such as `run*.csv` or several of them mean, in order.

    Raises:
        ValueError: nothing there, a folder, a pattern that fits no file.
    """
    several = paths if not isinstance(paths, str | PathLike) else (paths,)
    found: list[Path] = []
    for given in checks.many("read", several, "paths"):
        path = checks.path("read", given)
        if path.is_file():
            found.append(path)
        elif path.is_dir():
            raise ValueError(f"read '{path}': expected a file, got a folder; write '{path}/*.csv'")
        elif has_magic(str(path)):
            hits = [Path(hit) for hit in sorted(glob(str(path))) if Path(hit).is_file()]
            if not hits:
                raise ValueError(f"read '{path}': expected files, got none that fit the pattern")
            found.extend(hits)
        else:
            raise ValueError(f"read '{path}': expected a file, got nothing there; check the path")
    if not found:
        raise ValueError("read: expected paths of files, got none")
    return tuple(found)


def read_records(paths: Paths, wanted: Wanted, variable: str | None) -> tuple[Record, ...]:
    """The records of all files; what is wrong with any of them is one error."""
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
            f"read '{file}': expected a file that can be read, got {error.strerror or error}"
        ) from None
    if isinstance(found, Record):
        return (found,)
    works: list[Callable[[], Record]] = [partial(record, raw, wanted) for raw in found]
    return tuple(gathered(works))
