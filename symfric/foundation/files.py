"""Atomic writing of files, and checks of output paths."""

import csv
import json
import os
from collections.abc import Generator, Iterable, Mapping
from contextlib import contextmanager, suppress
from errno import EDQUOT, EFBIG, EIO, ENOSPC
from math import isfinite
from pathlib import Path
from secrets import token_hex
from typing import Any, cast

from symfric.foundation import checks

FULL = (ENOSPC, EDQUOT, EFBIG, EIO)
"""Error numbers of a full disk."""


@contextmanager
def _expecting(what: str, path: str | Path) -> Generator[None, None, None]:
    """Convert errors of the operating system to a ValueError that names the output path."""
    try:
        yield
    except (OSError, RuntimeError) as error:  # RuntimeError for circular links in Python 3.12
        system = error.strerror if isinstance(error, OSError) else None
        reason = system.lower() if system else "circular links"
        raise ValueError(f"output '{path}': expected {what}, got {reason}") from None


@contextmanager
def written(path: str | Path) -> Generator[Path, None, None]:
    """Yield a temporary path that is renamed to `path` if the block succeeds.

    A missing folder is created (see `check_folder`). After an error or an interrupt the old file,
    if any, is unchanged and the temporary file is removed.

    Raises:
        ValueError: the path is a folder or a device, its folder cannot be created or written, or
            the disk is full.
    """
    target = check_file(path)
    with _expecting("a writable place", path):
        target.parent.mkdir(parents=True, exist_ok=True)
        temporary = target.with_name(f".{target.stem}-{token_hex(4)}{target.suffix}")
        temporary.touch(exist_ok=False)
    try:
        yield temporary
        temporary.replace(target)
    except OSError as error:
        if error.errno not in FULL:
            raise
        got = str(error.strerror).lower()
        raise ValueError(f"output '{path}': expected space on the disk, got {got}") from error
    finally:
        with suppress(FileNotFoundError):
            temporary.unlink()


def check_file(path: str | Path) -> Path:
    """Return the output file of `path`, with links followed.

    Raises:
        ValueError: `path` is not a path, is a folder or a device, or has circular links; or its
            folder is invalid (see `check_folder`).
    """
    place = checks.path("output", path)
    with _expecting("a file name", path):
        target = _resolved(place)  # a link is kept and points to the new file
        if target.exists() and not target.is_file():
            kind = "a folder" if target.is_dir() else "a device"
            raise ValueError(f"output '{path}': expected a file name, got {kind}")
    check_folder(target.parent)
    return target


def _resolved(place: Path) -> Path:
    """Return `place` with links followed; circular links raise an OSError, also in Python 3.13."""
    with suppress(FileNotFoundError, NotADirectoryError):
        place.stat()
    return place.resolve()


def check_folder(folder: str | Path) -> Path:
    """Return an output folder, which may be missing.

    Missing folders are allowed below an existing folder, but not directly below the root of the
    file system, where a mistake in the first name would create a new tree.

    Raises:
        ValueError: the nearest existing path is a file or is not writable, or a missing folder
            would be directly below the root.
    """
    place = checks.path("output", folder)
    with _expecting("a folder", folder):
        absolute = _resolved(place)
        existing = next(p for p in (absolute, *absolute.parents) if p.exists())
    if not existing.is_dir():
        raise ValueError(f"output '{folder}': expected a folder, got the file '{existing}'")
    if existing != absolute and existing == Path(absolute.anchor):
        first = absolute.parts[1]
        raise ValueError(
            f"output '{folder}': expected a folder that exists, got none named '{existing / first}'"
            "; check the path or make the folder first"
        )
    if not os.access(existing, os.W_OK):
        raise ValueError(f"output '{folder}': expected a writable place, got no permission")
    return absolute


def make_folder(folder: str | Path) -> Path:
    """Create an output folder if it is missing; see `check_folder`.

    Raises:
        ValueError: the folder cannot be created.
    """
    place = check_folder(folder)
    with _expecting("a writable place", folder):
        place.mkdir(parents=True, exist_ok=True)
    return place


def write_text(path: str | Path, text: str) -> None:
    """Write `text` to `path` atomically, in UTF-8."""
    with written(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def read_json(where: str, path: str | Path, what: str) -> dict[str, Any]:
    """Return the JSON object in a file; `what` describes the expected content in messages.

    Raises:
        ValueError: the file does not exist, or its content is not a JSON object.
    """
    place = checks.path(where, path)
    try:
        data = json.loads(place.read_text(encoding="utf-8"))
    except OSError as error:
        reason = "no such file" if isinstance(error, FileNotFoundError) else "an unreadable file"
        raise ValueError(f"{where} '{path}': expected {what}, got {reason}") from None
    except (ValueError, RecursionError):
        raise ValueError(f"{where} '{path}': expected {what}, got something else") from None
    if not isinstance(data, dict):
        raise ValueError(f"{where} '{path}': expected {what}, got something else")
    return cast(dict[str, Any], data)


def json_data(value: Any) -> Any:
    """Return `value` as JSON data; infinity and NaN become None."""
    if isinstance(value, Mapping):
        return {str(name): json_data(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [json_data(item) for item in value]
    return None if isinstance(value, float) and not isfinite(value) else value


def write_table(path: str | Path, header: Iterable[str], rows: Iterable[Iterable[object]]) -> None:
    """Write a CSV file atomically, in UTF-8; numbers keep all digits."""
    with written(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows(rows)
