"""Plates on disk: pictures and numbers, computed in parallel, also where one fails."""

import json
import os
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Event, Thread
from time import perf_counter, time
from typing import Any, final

from symfric import __version__
from symfric.foundation.files import write_text
from symfric.foundation.panels import save
from symfric.gallery.pages import index_page
from symfric.gallery.plate import chosen, script, scripts
from symfric.stress.campaign import Crashed, TimedOut, WorkerPool

LIMIT = 600.0
"""Seconds that the figures of one process may take before they count as hanging."""

Record = dict[str, Any]
"""A plate as plain data, with its name, picture and seconds."""


@final
@dataclass(frozen=True, eq=False)
class Gallery:
    """Outcome of a rendering.

    Attributes:
        folder: where pictures, numbers and `index.html` are.
        asked: names of the plates that were to be computed.
        records: name -> plate as plain data, of what was computed now.
        failures: name -> why it was not; neither is what an interrupt left undone.
        seconds: wall time.
    """

    folder: Path
    asked: tuple[str, ...]
    records: dict[str, Record]
    failures: dict[str, str]
    seconds: float

    @property
    def left(self) -> int:
        """Number of plates that an interrupt left undone."""
        return len(self.asked) - len(self.records) - len(self.failures)


def render(
    folder: Path,
    names: Sequence[str] = (),
    *,
    quick: bool = False,
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Gallery:
    """Compute plates and write a picture and a JSON file of each, and `index.html` of all there.

    Plates of a module share a process and the runs in its cache. An interrupt (Ctrl-C) ends
    with what there is.

    Args:
        folder: what is written into.
        names: of plates, or how their names begin, such as a paper; all if none is given.
        quick: at reduced size.
        workers: processes; default one a core.
        progress: called with the fraction done.

    Raises:
        ValueError: a name that no plate has.
    """
    asked = chosen(tuple(names))
    began, groups = time(), together(asked)
    for name in asked:  # what is there afterwards is of now
        for ending in (".json", ".png"):
            with suppress(FileNotFoundError):
                place(folder, name, ending).unlink()
    tasks = ((i, (group, str(folder), quick)) for i, group in enumerate(groups))
    size = min(workers or os.cpu_count() or 1, len(groups))
    pool = WorkerPool(_rendered, tasks, size, LIMIT)
    failures = dict[str, str]()

    def tell() -> None:
        if progress is not None:
            there = sum(place(folder, name, ".json").exists() for name in asked)
            progress((there + len(failures)) / len(asked))

    try:
        with _repeated(tell):
            for number, outcome in pool.outcomes():
                failures |= _failures(groups[number], folder, outcome)
    except KeyboardInterrupt:
        pass
    finally:
        pool.stop()
    tell()
    there = read(folder)
    write_text(folder / "index.html", index_page([*there.values()]))
    records = {name: there[name] for name in asked if name in there}
    fresh = {n: r for n, r in records.items() if place(folder, n, ".json").stat().st_mtime >= began}
    return Gallery(folder, asked, fresh, failures, time() - began)


@contextmanager
def _repeated(tell: Callable[[], None], every: float = 0.5) -> Generator[None]:
    """Call `tell` every so many seconds while the block runs: a process draws many plates."""
    end = Event()

    def watch() -> None:
        while not end.wait(every):
            tell()

    watcher = Thread(target=watch, daemon=True)
    watcher.start()
    try:
        yield
    finally:
        end.set()
        watcher.join()


def place(folder: Path, name: str, ending: str) -> Path:
    """Path of a file of a plate."""
    return folder / f"{name}{ending}"


def read(folder: Path) -> dict[str, Record]:
    """The plates that were written into `folder`, in the order of the gallery."""
    found: dict[str, Record] = {}
    for name in scripts():
        with suppress(FileNotFoundError):
            found[name] = json.loads(place(folder, name, ".json").read_text(encoding="utf-8"))
    return found


def draw(name: str, folder: Path, quick: bool = False) -> Record:
    """Compute one plate and write its picture and numbers.

    Returns:
        What its JSON file holds.
    """
    began = perf_counter()
    plate = script(name)(quick=quick)
    save(plate.picture, place(folder, name, ".png"))
    about = {"name": name, "picture": f"{name}.png", "quick": quick, "symfric": __version__}
    record = about | {"seconds": round(perf_counter() - began, 2)} | plate.to_dict()
    write_text(place(folder, name, ".json"), json.dumps(record, indent=2, allow_nan=False) + "\n")
    return record


def together(names: Sequence[str]) -> list[tuple[str, ...]]:
    """Plates by process: those of a module share the runs in its cache."""
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(scripts()[name], []).append(name)
    return [tuple(group) for group in sorted(groups.values(), key=len, reverse=True)]


def _rendered(task: tuple[tuple[str, ...], str, bool]) -> dict[str, str]:
    """Draw the plates of one process; why those that failed did."""
    names, folder, quick = task
    failures: dict[str, str] = {}
    for name in names:
        try:
            draw(name, Path(folder), quick)
        except Exception as error:  # noqa: BLE001  (one failure must not stop the others)
            failures[name] = f"{type(error).__name__}: {' '.join(str(error).split())}"
    return failures


def _failures(
    group: tuple[str, ...], folder: Path, outcome: dict[str, str] | Crashed | TimedOut
) -> dict[str, str]:
    if isinstance(outcome, dict):
        return outcome
    died = isinstance(outcome, Crashed)
    why = (
        f"its process died, {outcome.how}: {outcome.last_line}"
        if died
        else "no end within its time"
    )
    return {name: why for name in group if not place(folder, name, ".json").exists()}
