"""Campaigns: cases judged in worker processes, counted, and saved while they run."""

import os
import signal
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic
from typing import Any, NamedTuple, final

import numpy as np

from symfric.stress.cases import Case, draw
from symfric.stress.judge import CLASSES, FAILING, Verdict, judge
from symfric.stress.problem import WORK

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


LIMIT = 120.0
"""Processor time [s] after which a case counts as hanging; the slowest need ten."""
NOTABLE = ("loose", "undecided", *FAILING)
"""Classes whose cases a report lists."""


@final
@dataclass(frozen=True, eq=False)
class Report:
    """Result of a campaign, or of its part so far.

    Attributes:
        seed: seed of the campaign.
        asked: number of cases requested; larger than `len(verdicts)` before the end.
        verdicts: number of a case -> verdict.
        seconds: wall time.
    """

    seed: int
    asked: int
    verdicts: dict[int, Verdict]
    seconds: float

    @property
    def classes(self) -> dict[str, int]:
        """Number of cases of each class."""
        count = Counter(v.kind for v in self.verdicts.values())
        return {name: count[name] for name in CLASSES}

    @property
    def groups(self) -> dict[str, dict[str, int]]:
        """Class -> group of reasons -> cases, the largest group first."""
        count = Counter((v.kind, v.group) for v in self.verdicts.values() if v.group)
        return {
            name: {group: n for (kind, group), n in count.most_common() if kind == name}
            for name in CLASSES
        }

    @property
    def refereed(self) -> int:
        """Cases judged by the referee, which shares no code with symfric."""
        return sum(v.by == "referee" for v in self.verdicts.values())

    @property
    def passed(self) -> bool:
        """True if no case is silently wrong, not finite, crashing or hanging."""
        return not any(self.classes[name] for name in FAILING)

    def errors(self) -> dict[str, float]:
        """Median, 99 % and greatest error [tolerances] of the runs that are right or loose."""
        found = [v.error for v in self.verdicts.values() if v.kind in ("right", "loose")]
        errors = np.array([e for e in found if e is not None] or [0.0])
        return {
            "median": float(np.median(errors)),
            "99 %": float(np.quantile(errors, 0.99)),
            "greatest": float(errors.max()),
        }

    def to_dict(self) -> dict[str, Any]:
        """For JSON: counts, and every case that is neither right nor refused."""
        return {
            "seed": self.seed,
            "cases": len(self.verdicts),
            "asked": self.asked,
            "seconds": round(self.seconds, 1),
            "classes": self.classes,
            "refereed": self.refereed,
            "groups": self.groups,
            "errors_in_tolerances": self.errors(),
            "notable": [
                {"case": draw(self.seed, n).to_dict(), "verdict": v.to_dict()}
                for n, v in sorted(self.verdicts.items())
                if v.kind in NOTABLE
            ],
        }

    def save(self, folder: Path) -> list[Path]:
        """Write the failing cases as files that `symfric stress --case` reruns."""
        paths: list[Path] = []
        for n, v in sorted(self.verdicts.items()):
            if v.kind in FAILING:
                paths.append(folder / f"{v.kind}_{self.seed}_{n}.json")
                draw(self.seed, n).write(paths[-1])
        return paths


def campaign(
    cases: int | Sequence[int],
    seed: int = 1,
    *,
    work: int = WORK,
    workers: int | None = None,
    limit: float = LIMIT,
    progress: Callable[[Report], None] | None = None,
) -> Report:
    """Run the cases 0 ... `cases` - 1 of `seed`, or those whose numbers are given.

    The same seed and number give the same case on any machine. An interrupt (Ctrl-C) returns the
    report so far.

    Args:
        cases: number of cases, or their numbers.
        seed: seed of the campaign.
        work: attempts of a run, see `judge`.
        workers: number of processes; default one per core.
        limit: processor time of a case [s].
        progress: called with the report so far after each case.

    Raises:
        ValueError: an argument is not positive.
    """
    numbers = range(cases) if isinstance(cases, int) else cases
    positive = {"cases": len(numbers), "work": work, "workers": workers, "limit": limit}
    for name, value in positive.items():
        if value is not None and not value > 0:
            raise ValueError(f"stress: expected {name} > 0, got {value}")
    began, verdicts = monotonic(), dict[int, Verdict]()

    def report() -> Report:
        return Report(seed, len(numbers), verdicts, monotonic() - began)

    tasks = ((number, (seed, number, work)) for number in numbers)
    pool = WorkerPool(_judged, tasks, min(workers or os.cpu_count() or 1, len(numbers)), limit)
    try:
        for number, outcome in pool.outcomes():
            verdicts[number] = _verdict(outcome)
            if progress is not None:
                progress(report())
    except KeyboardInterrupt:
        pass
    finally:
        pool.stop()
    return report()


def rerun(case: Case, limit: float = LIMIT) -> Verdict:
    """Judge one case in its own process, where a crash is a verdict, too."""
    pool = WorkerPool(_judged, iter([(0, case.to_dict())]), 1, limit)
    try:
        return next(_verdict(outcome) for _, outcome in pool.outcomes())
    finally:
        pool.stop()


def _judged(task: Any) -> Any:
    """Judge a case, given as (seed, number, work) or as its data."""
    if isinstance(task, tuple):
        seed, number, work = task
        return judge(draw(seed, number), work).to_dict()
    return judge(Case.from_dict(task)).to_dict()


def _verdict(outcome: Any) -> Verdict:
    if isinstance(outcome, Crashed):
        return Verdict("crash", f"{outcome.how}: {outcome.last_line}", outcome.how)
    if isinstance(outcome, TimedOut):
        return Verdict("hang", f"not finished after {outcome.limit:g} s of processor time")
    return Verdict.from_dict(outcome)
