"""Campaigns: cases are judged in worker processes, counted, and saved during the run."""

import os
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from time import monotonic
from typing import Any, final

import numpy as np

from symfric.foundation.workers import Crashed, TimedOut, outcomes
from symfric.stress.cases import Case, draw
from symfric.stress.judge import CLASSES, FAILING, Judgement, judge
from symfric.stress.problem import WORK

LIMIT = 120.0
"""Processor time [s] after which a case counts as a hang; the slowest cases need 10 s."""
NOTABLE = ("loose", "undecided", *FAILING)
"""Classes whose cases a report lists."""


@final
@dataclass(frozen=True, eq=False)
class Report:
    """Result of a campaign, or of the part that has finished.

    Attributes:
        seed: seed of the campaign.
        asked: number of requested cases; larger than `len(verdicts)` before the end.
        verdicts: number of a case -> verdict.
        seconds: wall time [s].
    """

    seed: int
    asked: int
    verdicts: dict[int, Judgement]
    seconds: float

    @property
    def classes(self) -> dict[str, int]:
        """Number of cases of each class."""
        count = Counter(v.kind for v in self.verdicts.values())
        return {name: count[name] for name in CLASSES}

    @property
    def groups(self) -> dict[str, dict[str, int]]:
        """Class -> group of reasons -> number of cases, the largest group first."""
        count = Counter((v.kind, v.group) for v in self.verdicts.values() if v.group)
        return {
            name: {group: n for (kind, group), n in count.most_common() if kind == name}
            for name in CLASSES
        }

    @property
    def refereed(self) -> int:
        """Number of cases judged by the referee, which shares no code with symfric."""
        return sum(v.by == "referee" for v in self.verdicts.values())

    @property
    def passed(self) -> bool:
        """True if no case is silently wrong, not finite, crashing or hanging."""
        return not any(self.classes[name] for name in FAILING)

    def errors(self) -> dict[str, float]:
        """Return the median, 99 % quantile and maximum of the errors of right and loose runs."""
        found = [v.error for v in self.verdicts.values() if v.kind in ("right", "loose")]
        errors = np.array([e for e in found if e is not None] or [0.0])
        return {
            "median": float(np.median(errors)),
            "99 %": float(np.quantile(errors, 0.99)),
            "greatest": float(errors.max()),
        }

    def to_dict(self) -> dict[str, Any]:
        """Return the counts, and every case that is neither right nor refused."""
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
                {"case": draw(self.seed, n).to_dict(), "verdict": asdict(v)}
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
    """Run the cases 0 ... `cases` - 1 of `seed`, or the cases with the given numbers.

    The same seed and number give the same case on any machine. An interrupt (Ctrl-C) returns the
    report so far.

    Args:
        cases: number of cases, or their numbers.
        seed: seed of the campaign.
        work: limit of attempts times unknowns of a run, see `judge`.
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
    began, verdicts = monotonic(), dict[int, Judgement]()

    def report() -> Report:
        return Report(seed, len(numbers), verdicts, monotonic() - began)

    tasks = ((number, (draw(seed, number), work)) for number in numbers)
    size = min(workers or os.cpu_count() or 1, len(numbers))
    with closing(outcomes(_judged, tasks, size, limit)) as found:
        try:
            for number, outcome in found:
                verdicts[number] = _verdict(outcome)
                if progress is not None:
                    progress(report())
        except KeyboardInterrupt:
            pass
    return report()


def rerun(case: Case, limit: float = LIMIT) -> Judgement:
    """Judge one case in a separate process, so that a crash is also a verdict."""
    ((_, outcome),) = outcomes(_judged, [(0, (case, WORK))], 1, limit)
    return _verdict(outcome)


def _judged(task: tuple[Case, int]) -> Judgement:
    """Judge a case for a task (case, limit of work)."""
    return judge(*task)


def _verdict(outcome: Any) -> Judgement:
    if isinstance(outcome, Crashed):
        return Judgement("crash", f"{outcome.how}: {outcome.last_line}", outcome.how)
    if isinstance(outcome, TimedOut):
        return Judgement("hang", f"not finished after {outcome.limit:g} s of processor time")
    return outcome
