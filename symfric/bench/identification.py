"""Identification and its goals: who finds the truth, from where, and at what cost."""

import tempfile
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from time import process_time
from typing import Any, NamedTuple, final

from identification import Dataset, Fit, Fitted, InverseDynamics
from symfric.bench import table
from symfric.bench.file_campaign import File, campaign
from symfric.bench.table import Goal
from symfric.foundation.parameters import check_names
from symfric.foundation.status import SolveError

CASES = {
    "lugre": "_memory",
    "coverage": "_repeats",
    "emps": "_measured",
    "laws": "_measured",
    "franka": "_measured",
    "starts": "_repeats",
    "gms": "_memory",
    "files": "",
}
"""Case -> end of the name of the module `symfric.bench.identification...`, whose function
`case(quick)` yields the rows."""


@final
@dataclass(frozen=True, eq=False)
class IdentificationBenchmark(table.Report):
    """Measurements by case."""

    rows: tuple[Goal, ...]

    def shown(self) -> Iterator[table.Table | str]:
        """Numbers and their goals."""
        yield table.of(
            "Identification: measured numbers and goals", self.rows,
            {"case": "case", "quantity": "what", "measured": table.shortened("value"),
             "goal": lambda r: f"{r.better} {r.goal:g}",
             "met": lambda r: "yes" if r.met else "no",
             "processor time [s]": table.rounded("seconds", 1), "note": "note"},
        )  # fmt: skip

    def drawn(self) -> tuple[Any, ...]:
        """The distance of each number from its goal; right of the line it is worse."""
        return "goals", ((f"{row.case}: {row.what}", row) for row in self.rows)


def bench_identification(
    *,
    quick: bool = False,
    cases: Sequence[str] = tuple(CASES),
    progress: table.Progress = None,
) -> IdentificationBenchmark:
    """Measure `cases`; `quick` takes fewer seeds. Ctrl-C returns the rows so far.

    Raises:
        ValueError: an unknown case.
    """
    check_names("bench identification: cases", cases, CASES)
    every = table.each(cases, progress, str)
    rows = (replace(row, case=case) for case in every for row in _measure_of(case)(quick))
    return IdentificationBenchmark(table.until_stopped(rows))


def _measure_of(case: str) -> Callable[[bool], Iterator[Goal]]:
    return getattr(import_module(f"symfric.bench.identification{CASES[case]}"), case)


TRUTH = {"m": 95.0, "offset": -3.0, "mu_s": 28.0, "mu_d": 20.0, "v_s": 0.01, "sigma_2": 200.0}
CLOSE = 0.05
"""Relative error of a parameter that counts as right."""
EVERY = 5
"""Of so many files one is tried where it has to be quick."""


class Outcome(NamedTuple):
    """The outcome for one file.

    Attributes:
        file: its name.
        truth: "good", "bad" or "hidden".
        kind: "refused", "flagged", "right", "silent" or "crashed".
        sentence: what was said.
    """

    file: str
    truth: str
    kind: str
    sentence: str


def outcomes(quick: bool = False, seed: int = 3) -> Iterator[Outcome]:
    """Every file of the campaign, one after the other."""
    with tempfile.TemporaryDirectory() as folder:
        for k, file in enumerate(campaign(seed)):
            if not quick or k % EVERY == 0:
                yield outcome(file, Path(folder))


def outcome(file: File, folder: Path) -> Outcome:
    """Read, check and fit one file."""
    path = folder / f"log{file.suffix}"
    path.write_bytes(file.content)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            kind, sentence = _judged(path, file)
    except (ValueError, SolveError) as error:
        kind, sentence = "refused", str(error)
    except Exception as error:  # noqa: BLE001  (whatever it is, it is counted and shown)
        kind, sentence = "crashed", f"{type(error).__name__}: {error}"
    return Outcome(file.name, file.truth, kind, sentence)


def _judged(path: Path, file: File) -> tuple[str, str]:
    data = Dataset.read(path, **file.said)
    findings = data.check()
    if findings.errors:
        return "refused", findings.errors[0].sentence
    if {"gap", "irregular"} & set(findings.kinds):  # as the findings say
        data = data.resampled()
    fit = Fit(InverseDynamics(), "stribeck", data).solve()
    wrong = [name for name in TRUTH if not _is_close(fit, name)]
    if not fit.verdict.good:
        return "flagged", fit.message
    if not wrong:
        return "right", fit.message
    if findings.warnings:
        return "flagged", f"{findings.warnings[0].sentence} Wrong: {', '.join(wrong)}."
    told = ", ".join(f"{name} {fit.values[name]:.4g}" for name in wrong)
    return "silent", f"{fit.message} Wrong: {told}."


def _is_close(fit: Fitted, name: str) -> bool:
    """True if a parameter is right, or is reported as not identifiable."""
    estimate = fit.parameters[name]
    error = abs(estimate.value - TRUTH[name])
    low, high = estimate.low, estimate.high
    inside = low is not None and high is not None and low <= TRUTH[name] <= high
    return error <= CLOSE * abs(TRUTH[name]) or inside


def files(quick: bool = False) -> Iterator[Goal]:
    """Rows of the bench: files answered wrongly in silence, crashes, good files that are right.

    Each file of `symfric.bench.file_campaign` is read, checked and fitted by inverse dynamics with
    a Stribeck law, as a stranger would. It ends as

        refused   the reader, the fit or the status says in a sentence why there is no result,
        flagged   there is a result, but the data or the residuals say that it is not to be trusted,
        right     every parameter within 5 % or its 95 % interval of the truth,
        silent    a wrong result without a word,
        crashed   an error that is no sentence.

    Of good files all must be right, of bad ones none silent. What no file can show is listed in
    `file_campaign` and counted apart.
    """
    begun = process_time()
    found = list(outcomes(quick))
    seconds = process_time() - begun
    counts = Counter((o.truth, o.kind) for o in found)
    silent = [o.file for o in found if o.truth == "bad" and o.kind == "silent"]
    good = [o for o in found if o.truth == "good"]
    lost = [o.file for o in good if o.kind != "right"]
    bad = sum(o.truth == "bad" for o in found)
    hidden = sum(o.truth == "hidden" for o in found)
    refused, flagged = counts["bad", "refused"], counts["bad", "flagged"]
    note = f"{bad} bad: {refused} refused, {flagged} flagged, {counts['bad', 'right']} right"
    note = "; ".join([note, *silent])
    yield Goal("bad files with a wrong result and no warning", len(silent), 0, "<=", seconds, note)
    share = (len(good) - len(lost)) / max(len(good), 1)
    yield Goal("fraction of good files with a right result", share, 1.0, ">=", note=", ".join(lost))
    crashed = [o.file for o in found if o.kind == "crashed"]
    yield Goal("crashes", len(crashed), 0, note=", ".join(crashed))
    note = f"{hidden} with defects that the file cannot reveal"
    yield Goal("files", len(found), 20 if quick else 100, ">=", note=note)
