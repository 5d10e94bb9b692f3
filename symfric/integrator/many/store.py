"""Results of an ensemble, in memory or in a folder that fills chunk by chunk."""

from collections.abc import Iterable
from pathlib import Path
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.files import written
from symfric.integrator.many.chunk import Solved

Array = NDArray[np.float64]


@final
class Store:
    """Signals of all members and what became of them.

    In a folder every signal is an array file, memory-mapped, and a small file marks every chunk
    that is complete; a later call goes on from there. The folder's own folder is named by a hash of
    everything that the results depend on, so results of other arguments are never taken.

    Attributes:
        signals: name -> values (members, times).
        attempts, reached: attempts of each member, and the time [s] it reached.
        failed: number of a member -> sentence.
    """

    def __init__(self, folder: Path | None, names: Iterable[str], members: int, times: int) -> None:
        self._folder = folder
        if folder is None:
            self.signals = {name: np.full((members, times), np.nan) for name in names}
        else:
            self.signals = {
                name: _array_file(folder / f"{name}.npy", (members, times)) for name in names
            }
        self.attempts = np.zeros(members, dtype=np.int64)
        self.reached = np.full(members, np.nan)
        self.failed: dict[int, str] = {}

    def _mark(self, first: int) -> Path | None:
        return None if self._folder is None else self._folder / f"chunk-{first}.npz"

    def has(self, first: int) -> bool:
        """Whether the chunk that starts at `first` was complete before; takes it over if so."""
        mark = self._mark(first)
        if mark is None or not mark.exists():
            return False
        with np.load(mark) as saved:
            failed = zip(saved["failed"].tolist(), saved["why"].tolist(), strict=True)
            self._note(first, saved["attempts"], saved["reached"], dict(failed))
        return True

    def put(self, first: int, result: Solved) -> None:
        """Take the results of the chunk that starts at `first`."""
        size = result.attempts.size
        for i, values in enumerate(self.signals.values()):
            values[first : first + size] = result.signals[:, :, i]
            if isinstance(values, np.memmap):
                values.flush()
        self._note(first, result.attempts, result.reached, result.failed)
        mark = self._mark(first)
        if mark is not None:
            with written(mark) as temporary, temporary.open("wb") as file:
                np.savez(
                    file,
                    attempts=result.attempts,
                    reached=result.reached,
                    failed=np.array(list(result.failed), dtype=np.int64),
                    why=np.array(list(result.failed.values()), dtype=np.str_),
                )

    def _note(
        self, first: int, attempts: NDArray[np.int64], reached: Array, failed: dict[int, str]
    ) -> None:
        self.attempts[first : first + attempts.size] = attempts
        self.reached[first : first + attempts.size] = reached
        self.failed |= {first + m: why for m, why in failed.items()}


def _array_file(path: Path, shape: tuple[int, int]) -> Array:
    """Memory-mapped array file, full of NaN when it is made."""
    if not path.exists():
        with written(path) as temporary:
            array = np.lib.format.open_memmap(temporary, mode="w+", dtype=float, shape=shape)
            array[:] = np.nan
            array.flush()
    return np.lib.format.open_memmap(path, mode="r+")
