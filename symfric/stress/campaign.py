"""A campaign: cases by number, judged in worker processes, counted and kept."""

import os
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Any, final

import numpy as np

from symfric.stress.cases import Case, draw
from symfric.stress.crew import Crew, Died, Hung
from symfric.stress.judge import CLASSES, FAILING, Verdict, judge
from symfric.stress.problem import WORK

LIMIT = 120.0
"""Seconds that a case may take before it counts as hanging; the slowest need ten."""
KEPT = ("loose", "undecided", *FAILING)
"""Classes whose cases are kept as files."""


@final
@dataclass(frozen=True, eq=False)
class Report:
    """What came of a campaign.

    Attributes:
        seed: of the campaign.
        asked: how many cases were to be run; more than `verdicts` after an interrupt.
        verdicts: number of a case -> verdict.
        seconds: wall time.
    """

    seed: int
    asked: int
    verdicts: dict[int, Verdict]
    seconds: float

    @property
    def classes(self) -> dict[str, int]:
        """How many cases are of each class."""
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
        """Whether no case is silently wrong, not finite, crashing or hanging."""
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
                if v.kind in KEPT
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
    progress: Callable[[float], None] | None = None,
) -> Report:
    """Run the cases 0 ... `cases` - 1 of `seed`, or those of the numbers given.

    The same seed and number are the same case on any machine.

    Args:
        work: as in `judge`.
        workers: processes; default one a core.
        limit: seconds that a case may take.
        progress: called with the fraction done.

    An interrupt (Ctrl-C) ends the campaign with what there is.

    Raises:
        ValueError: a number that is not positive.
    """
    numbers = range(cases) if isinstance(cases, int) else cases
    for name, value in (
        ("cases", len(numbers)),
        ("work", work),
        ("workers", workers),
        ("limit", limit),
    ):
        if value is not None and not value > 0:
            raise ValueError(f"stress: expected {name} > 0, got {value}")
    began, verdicts = monotonic(), dict[int, Verdict]()
    tasks = ((number, (seed, number, work)) for number in numbers)
    crew = Crew(_judged, tasks, min(workers or os.cpu_count() or 1, len(numbers)), limit)
    try:
        for number, outcome in crew.outcomes():
            verdicts[number] = _verdict(outcome)
            if progress is not None:
                progress(len(verdicts) / len(numbers))
    except KeyboardInterrupt:
        pass
    finally:
        crew.dismiss()
    return Report(seed, len(numbers), verdicts, monotonic() - began)


def rerun(case: Case, limit: float = LIMIT) -> Verdict:
    """Judge one case in a process of its own, so that a crash is a verdict, too."""
    crew = Crew(_judged, iter([(0, case.to_dict())]), 1, limit)
    try:
        return next(_verdict(outcome) for _, outcome in crew.outcomes())
    finally:
        crew.dismiss()


def _judged(task: Any) -> Any:
    """What a worker does with (seed, number, work) or the data of a case."""
    if isinstance(task, tuple):
        seed, number, work = task
        return judge(draw(seed, number), work).to_dict()
    return judge(Case.from_dict(task)).to_dict()


def _verdict(outcome: Any) -> Verdict:
    if isinstance(outcome, Died):
        return Verdict("crash", f"{outcome.how}: {outcome.words}", outcome.how)
    if isinstance(outcome, Hung):
        return Verdict("hang", f"no end in {outcome.seconds:g} s")
    return Verdict.from_dict(outcome)
