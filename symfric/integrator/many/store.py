"""Results of an ensemble, in memory or in a folder that is filled chunk by chunk."""

import os
import stat
import warnings
from collections.abc import Collection, Iterable
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from math import prod
from pathlib import Path
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation import storable
from symfric.foundation.files import written
from symfric.foundation.numeric import Array
from symfric.integrator.many.chunk import Solved

BLOCK = 2**20
"""Bytes written at once when a file is created."""


@final
class Store:
    """Signals of all members and the outcome of their runs.

    In a folder, every signal is an array file, memory-mapped for reading, and a small file with a
    checksum marks every complete chunk, so that a later call can continue. Chunks that are missing,
    truncated, damaged or changed by another program are computed again. The name of the subfolder
    is a hash of all data that determine the results, so results of other arguments are never used.

    Attributes:
        signals: name -> values (members, times).
        attempts, reached: number of attempts of each member, and the time [s] that it reached.
        reach: least and greatest value of each state over the steps, shape (members, 2, nx).
        failed: number of a failed member -> message.
        damaged: first members of the chunks whose stored results have changed.

    Raises:
        ValueError: the folder is not writable or too small for all results.
    """

    def __init__(
        self, folder: Path | None, names: Iterable[str], members: int, times: int, states: int
    ) -> None:
        self._folder, shape = folder, (members, times)
        self._files: list[_ArrayFile] = []
        if folder is None:
            self.signals = {name: np.full(shape, np.nan) for name in names}
        else:
            files = {name: _ArrayFile(folder / f"{name}.npy", shape) for name in names}
            for file in files.values():
                file.make()
            self._files = list(files.values())
            self.signals = {name: file.array for name, file in files.items()}
        self.attempts = np.zeros(members, dtype=np.int64)
        self.reached = np.full(members, np.nan)
        self.reach = np.full((members, 2, states), np.nan)
        self.failed: dict[int, str] = {}
        self.damaged: list[int] = []

    def _mark(self, first: int) -> Path | None:
        return None if self._folder is None else self._folder / f"chunk-{first}.npz"

    def left(self, firsts: Collection[int]) -> list[int]:
        """Return the first members of the incomplete chunks among those that start at `firsts`.

        Warns:
            UserWarning: stored results of some chunks have changed.
        """
        found = [first for first in firsts if not self.has(first)]
        if self.damaged:
            warnings.warn(
                f"simulate_many: out: {len(self.damaged)} of {len(firsts)} chunks in "
                f"'{self._folder}' have been deleted, truncated or changed since; they "
                "are computed again",
                UserWarning,
                stacklevel=3,
            )
        return found

    def has(self, first: int) -> bool:
        """Return True if the chunk that starts at `first` is complete, and load its results."""
        mark = self._mark(first)
        if mark is None or not mark.exists():
            return False
        try:
            with mark.open("rb") as file:
                saved = storable.arrays(file)
            if str(saved.pop("checksum")) == self._checksum(first, saved["attempts"].size):
                self._note(first, saved)
                return True
        except (OSError, ValueError, KeyError):
            pass  # the marker file is damaged
        self.damaged.append(first)
        return False

    def put(self, first: int, result: Solved) -> None:
        """Store the results of the chunk that starts at `first`.

        Raises:
            ValueError: the results cannot be written; complete chunks are kept.
        """
        size, mark = result.attempts.size, self._mark(first)
        outcome: dict[str, Any] = {
            name: getattr(result, name) for name in ("attempts", "reached", "reach")
        }
        outcome["failed"] = np.array(list(result.failed), dtype=np.int64)
        outcome["why"] = np.array(list(result.failed.values()), dtype=np.str_)
        self._note(first, outcome)
        if mark is None:
            for i, values in enumerate(self.signals.values()):
                values[first : first + size] = result.signals[:, :, i]
            return
        try:
            for i, file in enumerate(self._files):
                file.write(first, result.signals[:, :, i])
            with written(mark) as temporary, temporary.open("wb") as marker:
                np.savez(marker, **outcome, checksum=np.array(self._checksum(first, size)))
        except (OSError, ValueError) as error:
            raise ValueError(
                f"simulate_many: out: expected disk space for members from {first} on in "
                f"'{self._folder}', got {_reason(error)}; complete chunks are kept, call again to "
                "continue"
            ) from None

    def _checksum(self, first: int, size: int) -> str:
        """Return a hash of the results of `size` members, as read from the files."""
        total = sha256()
        for values in self.signals.values():
            total.update(np.ascontiguousarray(values[first : first + size]).tobytes())
        return total.hexdigest()

    def _note(self, first: int, outcome: dict[str, NDArray[Any]]) -> None:
        """Store the results of the members from `first` on, and the messages of failed members."""
        failed = zip(outcome["failed"].tolist(), outcome["why"].tolist(), strict=True)
        pick = slice(first, first + outcome["attempts"].size)
        for name in ("attempts", "reached", "reach"):
            getattr(self, name)[pick] = outcome[name]
        self.failed |= {first + m: why for m, why in failed}


def _reason(error: OSError | ValueError) -> str:
    """Return the message of the operating system about a file that cannot be written."""
    cause = error if isinstance(error, OSError) else error.__cause__
    return cause.strerror if isinstance(cause, OSError) and cause.strerror else str(error)


def _claim(temporary: Path, path: Path) -> None:
    """Link a temporary file to `path`, unless `path` exists.

    Raises:
        FileExistsError: `path` exists.
    """
    try:
        os.link(temporary, path)
    except FileExistsError:
        raise
    except OSError:  # no hard links: the last writer wins
        pass


@final
@dataclass(frozen=True, eq=False)
class _ArrayFile:
    """Array file (`numpy.save`), written by rows and read through a memory map.

    It is not written through the map, because a signal would then end the process on a full disk.
    """

    path: Path
    shape: tuple[int, int]

    def make(self) -> None:
        """Create a file of NaN, so that its disk space is allocated, unless a valid one exists.

        If two calls create the file at the same time, both use the file of one of them.
        """
        missing = not os.path.lexists(self.path)
        if not missing and self._is_whole():
            return
        row = np.full(self.shape[1:], np.nan).tobytes()
        rows = max(1, BLOCK // len(row))
        try:
            with suppress(FileExistsError), written(self.path) as temporary:
                with temporary.open("wb") as file:
                    np.lib.format.write_array_header_1_0(file, self._header)
                    for first in range(0, self.shape[0], rows):
                        file.write(row * min(rows, self.shape[0] - first))
                if missing:
                    _claim(temporary, self.path)
        except (OSError, ValueError) as error:
            raise ValueError(
                f"simulate_many: out: expected {8e-6 * prod(self.shape):.3g} MB of disk space for "
                f"'{self.path}', got {_reason(error)}"
            ) from None

    @property
    def _header(self) -> dict[str, object]:
        return {"descr": "<f8", "fortran_order": False, "shape": self.shape}

    def _is_whole(self) -> bool:
        """Return True if the file has the required header and size."""
        try:
            status = self.path.lstat()
            if not stat.S_ISREG(status.st_mode):
                return False
            with self.path.open("rb") as file:
                version = np.lib.format.read_magic(file)
                header = np.lib.format.read_array_header_1_0(file) if version == (1, 0) else None
                size = file.tell() + 8 * prod(self.shape)
        except (OSError, ValueError):
            return False
        return header == (self.shape, False, np.dtype("<f8")) and status.st_size == size

    @cached_property
    def array(self) -> Array:
        """Values as a read-only memory map."""
        return np.lib.format.open_memmap(self.path, mode="r")

    def write(self, first: int, rows: Array) -> None:
        """Overwrite the rows from `first` on with `rows`."""
        end = self.path.stat().st_size
        with self.path.open("r+b") as file:
            file.seek(end - 8 * prod(self.shape) + 8 * first * self.shape[1])
            file.write(np.ascontiguousarray(rows, dtype="<f8").tobytes())
