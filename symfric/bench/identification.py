"""Identification with goals: convergence to the true parameters, admissible starts, and cost."""

import tempfile
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from identification import Dataset, Fit, Fitted, InverseDynamics
from symfric.bench.identification_files import File, campaign
from symfric.bench.identification_length import length
from symfric.bench.identification_measured import emps, franka
from symfric.bench.identification_memory import gms, lugre
from symfric.bench.identification_online import online
from symfric.bench.identification_repeats import starts, velocity
from symfric.bench.identification_robot import robot
from symfric.bench.identification_verdicts import TITLE, draw, verdicts
from symfric.bench.report import Found, Progress, Report, goal, timed
from symfric.foundation.parameters import check_names
from symfric.foundation.status import SolveError

TRUTH = {"m": 95.0, "offset": -3.0, "mu_s": 28.0, "mu_d": 20.0, "v_s": 0.01, "sigma_2": 200.0}
"""Parameters of the stage of `identification_files`."""
CLOSE = 0.05
"""Largest relative error of a parameter that counts as right."""
EVERY = 12
"""Quick runs read every twelfth file."""


class Outcome(NamedTuple):
    """Outcome for one file.

    Attributes:
        file: name of the file.
        truth: "good", "bad" or "hidden".
        kind: "refused", "flagged", "right", "silent" or "crashed".
        message: message to the user.
    """

    file: str
    truth: str
    kind: str
    message: str


def outcome(file: File) -> Outcome:
    """Return the outcome of reading, checking and fitting one file."""
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("error")
        path = Path(folder) / f"log{file.suffix}"
        path.write_bytes(file.content)
        try:
            kind, message = _judged(path, file)
        except (ValueError, SolveError) as error:
            kind, message = "refused", str(error)
        except Exception as error:  # noqa: BLE001  (any error is counted and shown)
            kind, message = "crashed", f"{type(error).__name__}: {error}"
    return Outcome(file.name, file.truth, kind, message)


def _judged(path: Path, file: File) -> tuple[str, str]:
    data = Dataset.read(path, **file.options)
    findings = data.check()
    if findings.errors:
        return "refused", findings.errors[0].sentence
    if {"gap", "irregular"} & set(findings.kinds):  # the findings advise it
        data = data.resampled()
    fit = Fit(InverseDynamics(), "stribeck", data).solve()
    wrong = [f"{name} {fit.values[name]:.4g}" for name in TRUTH if not _is_close(fit, name)]
    if not fit.verdict.good:
        return "flagged", fit.message
    if not wrong:
        return "right", fit.message
    if findings.warnings:
        return "flagged", f"{findings.warnings[0].sentence} Wrong: {', '.join(wrong)}."
    return "silent", f"{fit.message} Wrong: {', '.join(wrong)}."


def _is_close(fit: Fitted, name: str) -> bool:
    """Return True if a parameter is right or if its interval includes the true value."""
    estimate = fit.parameters[name]
    error = abs(estimate.value - TRUTH[name])
    low, high = estimate.low, estimate.high
    inside = low is not None and high is not None and low <= TRUTH[name] <= high
    return error <= CLOSE * abs(TRUTH[name]) or inside


def files(quick: bool = False) -> Iterator[Found]:
    """Measure silent errors and crashes on damaged files, and right results on intact files.

    Each file of `identification_files` is read, checked and fitted by inverse dynamics with a
    Stribeck law and default settings. Its outcome is one of

        refused   the reader, the fit or the status explains why there is no result,
        flagged   the result has a warning about the data or the residuals,
        right     every parameter is within 5 % of the truth, or its 95 % interval includes it,
        silent    the result is wrong and has no warning,
        crashed   there is an error without an explanation.

    All good files must be right, and no bad file may be silent. Files whose defects leave no trace
    are counted separately.
    """
    chosen = [*campaign()][:: EVERY if quick else 1]
    seconds, found = timed(lambda: [outcome(file) for file in chosen])
    counts = Counter((o.truth, o.kind) for o in found)
    total = Counter(o.truth for o in found)
    silent = [o.file for o in found if (o.truth, o.kind) == ("bad", "silent")]
    note = f"{total['bad']} bad: {counts['bad', 'refused']} refused, {counts['bad', 'flagged']} "
    note = "; ".join([note + f"flagged, {counts['bad', 'right']} right", *silent])
    yield goal("bad files with a wrong result and no warning", len(silent), 0, "<=", seconds, note)
    lost = ", ".join(o.file for o in found if o.truth == "good" and o.kind != "right")
    share = counts["good", "right"] / max(total["good"], 1)
    yield goal("fraction of good files with a right result", share, 1.0, ">=", note=lost)
    crashed = [o.file for o in found if o.kind == "crashed"]
    yield goal("crashes", len(crashed), 0, note=", ".join(crashed))
    note = f"{total['hidden']} with defects that the file cannot reveal"
    yield goal("files", len(found), 10 if quick else 100, ">=", note=note)


CASES: Mapping[str, Callable[[bool], Iterator[Found]]] = {
    "lugre": lugre,
    "verdicts": verdicts,
    "velocity": velocity,
    "emps": emps,
    "franka": franka,
    "starts": starts,
    "gms": gms,
    "files": files,
    "length": length,
    "robot": robot,
    "online": online,
}


def bench(
    quick: bool = False, cases: Sequence[str] = tuple(CASES), progress: Progress = None
) -> Report:
    """Measure `cases`; with `quick`, use fewer seeds.

    Raises:
        ValueError: an unknown case.
    """
    check_names("bench identification: cases", cases, CASES)
    tasks = {case: partial(_named, case, quick) for case in cases}
    return Report((TITLE, draw)).collect(tasks, progress)


def _named(case: str, quick: bool) -> Iterator[Found]:
    """Yield the rows of a case, with its name in the first column."""
    for item in CASES[case](quick):
        yield item if isinstance(item, str) else (item[0], {"case": case, **item[1]})
