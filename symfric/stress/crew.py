"""Workers that may crash or hang without taking a campaign with them."""

import os
import signal
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic
from typing import Any, final

LIFETIME = 250
"""Tasks after which a worker makes room for a fresh one."""

Work = Callable[[Any], Any]
Task = tuple[int, Any]
"""Number, and what the work is given."""


@final
@dataclass(frozen=True)
class Died:
    """A worker's process ended: how, and its last line on standard error."""

    how: str
    words: str


@final
@dataclass(frozen=True)
class Hung:
    """A worker found no end within so many seconds."""

    seconds: float


@final
class _Worker:
    """A process that does one task after another."""

    def __init__(self, work: Work, log: Path) -> None:
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(work, theirs, str(log)), daemon=True)
        before = signal.getsignal(signal.SIGINT)
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the campaign alone
        try:
            self.process.start()
        finally:
            signal.signal(signal.SIGINT, before)
        theirs.close()
        self.log, self.done = log, 0
        self.task: int | None = None
        self.since = 0.0

    def give(self, task: Task) -> None:
        """Let it do a task."""
        self.task, self.since = task[0], monotonic()
        self.pipe.send(task[1])

    def last_words(self) -> Died:
        """How a dead worker died."""
        self.process.join(10)
        code = self.process.exitcode or 0
        lines = self.log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
        how = signal.Signals(-code).name if code < 0 else f"exit status {code}"
        return Died(how, lines[-1] if lines else "without a word")

    def end(self) -> None:
        """Stop the process, whatever it is doing."""
        self.process.kill()
        self.process.join(10)
        self.pipe.close()


@final
@dataclass(eq=False)
class Crew:
    """Workers and what they are to do.

    Attributes:
        work: a function of a module, called with the task.
        tasks: number and argument.
        size: workers at most.
        limit: seconds that a task may take.
    """

    work: Work
    tasks: Iterator[Task]
    size: int
    limit: float
    workers: list[_Worker] = field(default_factory=list[_Worker])
    hired: int = 0

    def __post_init__(self) -> None:
        self.folder = TemporaryDirectory(prefix="symfric-stress-")

    def outcomes(self) -> Iterator[tuple[int, Any]]:
        """Number and result of each task as they come; `Died` or `Hung` where there is none."""
        while self._employ():
            ready = wait([worker.pipe for worker in self.workers], timeout=1.0)
            for worker in list(self.workers):
                number = worker.task or 0
                if worker.pipe in ready:
                    yield number, self._answer(worker)
                elif monotonic() - worker.since > self.limit:
                    self._lay_off(worker)
                    yield number, Hung(self.limit)

    def dismiss(self) -> None:
        """Stop all workers."""
        for worker in list(self.workers):
            self._lay_off(worker)
        self.folder.cleanup()

    def _employ(self) -> bool:
        """Give every idle worker a task, hire while there are any; whether anybody works."""
        for worker in [w for w in self.workers if w.task is None]:
            task = next(self.tasks, None) if worker.done < LIFETIME else None
            if task is None:
                self._lay_off(worker)
            else:
                worker.give(task)
        while len(self.workers) < self.size and (task := next(self.tasks, None)) is not None:
            log = Path(self.folder.name) / f"{self.hired}.txt"
            log.touch()
            self.hired += 1
            self.workers.append(_Worker(self.work, log))
            self.workers[-1].give(task)
        return bool(self.workers)

    def _answer(self, worker: _Worker) -> Any:
        try:
            result = worker.pipe.recv()
        except (EOFError, ConnectionError):
            words = worker.last_words()
            self._lay_off(worker)
            return words
        worker.task, worker.done = None, worker.done + 1
        return result

    def _lay_off(self, worker: _Worker) -> None:
        self.workers.remove(worker)
        worker.end()


def _serve(work: Work, pipe: Connection, log: str) -> None:
    """Do what comes; a defect in it ends the process, its traceback in the file `log`."""
    with open(log, "w", encoding="utf-8") as words:
        os.dup2(words.fileno(), 1)
        os.dup2(words.fileno(), 2)
    while True:
        try:
            task = pipe.recv()
        except (EOFError, ConnectionError):
            return
        pipe.send(work(task))
