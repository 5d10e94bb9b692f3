"""Worker processes that may crash or loop forever without ending a campaign."""

import os
import signal
from collections.abc import Callable, Iterator
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic
from typing import Any, NamedTuple, final

TASKS_PER_PROCESS = 250
"""A process is replaced after this many tasks, which bounds its memory."""
WALL = 10
"""Wall time over processor time after which a task counts as blocked."""

Work = Callable[[Any], Any]
Task = tuple[int, Any]
"""Number of a task and the argument of the work."""


@final
class Crashed(NamedTuple):
    """The process of a task ended: its signal or exit status, and its last line of output."""

    how: str
    last_line: str


@final
class TimedOut(NamedTuple):
    """A task took more processor time than its limit [s]."""

    limit: float


@final
class _Worker:
    """A process that runs one task after another."""

    def __init__(self, work: Work, log: Path, limit: float) -> None:
        context = get_context("spawn")
        self.pipe, end = context.Pipe()
        arguments = (work, end, str(log), limit)
        self.process = context.Process(target=_serve, args=arguments, daemon=True)
        before = signal.getsignal(signal.SIGINT)
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # only the campaign handles Ctrl-C
        try:
            self.process.start()
        finally:
            signal.signal(signal.SIGINT, before)
        end.close()
        self.log, self.done = log, 0
        self.task: int | None = None
        self.since = 0.0

    def start(self, task: Task) -> None:
        """Send a task to the process."""
        self.task, self.since = task[0], monotonic()
        self.pipe.send(task[1])

    def failure(self, limit: float) -> Crashed | TimedOut:
        """Describe how the process ended."""
        self.process.join(10)
        code = self.process.exitcode or 0
        if code == -signal.SIGPROF:
            return TimedOut(limit)
        lines = self.log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
        how = signal.Signals(-code).name if code < 0 else f"exit status {code}"
        return Crashed(how, lines[-1] if lines else "no output")

    def stop(self) -> None:
        """End the process."""
        self.process.kill()
        self.process.join(10)
        self.pipe.close()


@final
class WorkerPool:
    """Processes that run `work`, a function of a module, on each task.

    Args:
        work: called with the argument of a task.
        tasks: numbers and arguments.
        size: number of processes.
        limit: processor time of a task [s], which a loaded machine does not change; wall time is
            limited to `WALL` times as much.
    """

    def __init__(self, work: Work, tasks: Iterator[Task], size: int, limit: float) -> None:
        self.work, self.tasks, self.size, self.limit = work, tasks, size, limit
        self.workers = list[_Worker]()
        self.started = 0
        self.folder = TemporaryDirectory(prefix="symfric-stress-")

    def outcomes(self) -> Iterator[tuple[int, Any]]:
        """Yield number and result of each task as they come, or `Crashed` or `TimedOut`."""
        while self._assign():
            ready = wait([worker.pipe for worker in self.workers], timeout=1.0)
            for worker in list(self.workers):
                number = worker.task or 0
                if worker.pipe in ready:
                    yield number, self._receive(worker)
                elif monotonic() - worker.since > WALL * self.limit:
                    self._remove(worker)
                    yield number, TimedOut(self.limit)

    def stop(self) -> None:
        """End all processes."""
        for worker in list(self.workers):
            self._remove(worker)
        self.folder.cleanup()

    def _assign(self) -> bool:
        """Give every idle worker a task, start missing workers; return whether any is busy."""
        for worker in [w for w in self.workers if w.task is None]:
            task = next(self.tasks, None) if worker.done < TASKS_PER_PROCESS else None
            if task is None:
                self._remove(worker)
            else:
                worker.start(task)
        while len(self.workers) < self.size and (task := next(self.tasks, None)) is not None:
            log = Path(self.folder.name) / f"{self.started}.txt"
            log.touch()
            self.started += 1
            self.workers.append(_Worker(self.work, log, self.limit))
            self.workers[-1].start(task)
        return bool(self.workers)

    def _receive(self, worker: _Worker) -> Any:
        try:
            result = worker.pipe.recv()
        except (EOFError, ConnectionError):
            failure = worker.failure(self.limit)
            self._remove(worker)
            return failure
        worker.task, worker.done = None, worker.done + 1
        return result

    def _remove(self, worker: _Worker) -> None:
        self.workers.remove(worker)
        worker.stop()


def _serve(work: Work, pipe: Connection, log: str, limit: float) -> None:
    """Run tasks until the pipe closes; an exception ends the process, its traceback in `log`.

    The timer counts processor time and ends the process by SIGPROF, inside compiled code, too.
    """
    with open(log, "w", encoding="utf-8") as output:
        os.dup2(output.fileno(), 1)
        os.dup2(output.fileno(), 2)
    while True:
        try:
            task = pipe.recv()
        except (EOFError, ConnectionError):
            return
        signal.setitimer(signal.ITIMER_PROF, limit)
        result = work(task)
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        pipe.send(result)
