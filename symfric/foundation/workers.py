"""Tasks in separate processes, which may crash or hang."""

import os
import signal
from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from math import inf, isfinite
from multiprocessing import get_context
from multiprocessing.connection import wait
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic
from typing import Any, NamedTuple, final

WALL = 10
"""Ratio of wall time to the limit of processor time above which a task counts as blocked."""

Work = Callable[[Any], Any]
Task = tuple[int, Any]
"""Number of a task, and the argument of its function."""


@final
class Crashed(NamedTuple):
    """Signal or exit status of a process that ended without a result, and its last output line."""

    how: str
    last_line: str


@final
class TimedOut(NamedTuple):
    """Limit of processor time [s] that a task exceeded."""

    limit: float


@final
@dataclass(frozen=True)
class _Running:
    number: int
    process: Any
    log: Path
    since: float


def outcomes(
    work: Work, tasks: Iterable[Task], size: int, limit: float = inf, *, start: str = "forkserver"
) -> Generator[tuple[int, Any]]:
    """Yield number and result (or `Crashed` or `TimedOut`) of the tasks in order of completion.

    Each task runs in a separate process. Closing the iterator ends all processes.

    Args:
        work: function of a module, called with the argument of a task.
        tasks: numbers and arguments.
        size: number of simultaneous processes.
        limit: processor time of a task [s], which does not depend on the load of the machine; wall
            time is limited to `WALL` times this value.
        start: "forkserver" forks processes from one that has imported the module of `work`; "fork"
            forks this process, for functions that cannot be pickled.
    """
    context: Any = get_context(start)
    if start == "forkserver":
        context.set_forkserver_preload(["__main__", work.__module__])
    waiting, running = iter(tasks), dict[Any, _Running]()
    with TemporaryDirectory(prefix="symfric-") as folder:
        try:
            while True:
                while len(running) < size and (task := next(waiting, None)) is not None:
                    pipe, end = context.Pipe(duplex=False)
                    log = Path(folder) / f"{task[0]}.txt"
                    arguments = (work, task[1], end, str(log), limit)
                    process = context.Process(target=_run, args=arguments, daemon=True)
                    process.start()
                    end.close()
                    running[pipe] = _Running(task[0], process, log, monotonic())
                if not running:
                    return
                wait([*running], timeout=1.0)
                for pipe, one in [*running.items()]:
                    late = monotonic() - one.since > WALL * limit
                    if pipe.poll() or late:
                        result = _result(pipe, one, limit) if pipe.poll() else TimedOut(limit)
                        del running[pipe]
                        _end(pipe, one)
                        yield one.number, result
        finally:
            for pipe, one in running.items():
                _end(pipe, one)


def _end(pipe: Any, one: _Running) -> None:
    one.process.kill()
    one.process.join(10)
    pipe.close()


def _result(pipe: Any, one: _Running, limit: float) -> Any:
    """Return the result of a task, or the reason why its process ended without a result."""
    try:
        return pipe.recv()
    except (EOFError, ConnectionError):
        one.process.join(10)
    code = one.process.exitcode or 0
    if code == -signal.SIGPROF:
        return TimedOut(limit)
    lines = one.log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
    how = signal.Signals(-code).name if code < 0 else f"exit status {code}"
    return Crashed(how, lines[-1] if lines else "no output")


def _run(work: Work, argument: Any, pipe: Any, log: str, limit: float) -> None:
    """Run one task; an exception ends the process, with the traceback in `log`.

    The timer counts processor time and ends the process with SIGPROF, also inside compiled code.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # only the parent handles Ctrl-C
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    with open(log, "w", encoding="utf-8") as output:
        os.dup2(output.fileno(), 1)
        os.dup2(output.fileno(), 2)
    signal.setitimer(signal.ITIMER_PROF, limit if isfinite(limit) else 0.0)
    result = work(argument)
    signal.setitimer(signal.ITIMER_PROF, 0.0)
    pipe.send(result)
