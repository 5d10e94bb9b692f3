"""What becomes of good, damaged and wrong files: none may be answered wrongly in silence.

Each file of `symfric.bench.file_campaign` is read, checked and fitted by inverse dynamics with a
Stribeck law, as a stranger would. It ends as

    refused   the reader, the fit or the status says in a sentence why there is no result,
    flagged   there is a result, but the data or the residuals say that it is not to be trusted,
    right     every parameter within 5 % or its 95 % interval of the truth,
    silent    a wrong result without a word,
    crashed   an error that is no sentence.

Of good files all must be right, of bad ones none silent. What no file can show is listed in
`file_campaign` and counted apart.
"""

import tempfile
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import final

from identification import Dataset, Fit, Fitted, InverseDynamics
from symfric.bench.file_campaign import File, campaign
from symfric.bench.identification import Row
from symfric.foundation.status import SolveError

TRUTH = {"m": 95.0, "offset": -3.0, "mu_s": 28.0, "mu_d": 20.0, "v_s": 0.01, "sigma_2": 200.0}
CLOSE = 0.05
"""Relative error of a parameter that counts as right."""
EVERY = 5
"""Of so many files one is tried where it has to be quick."""


@final
@dataclass(frozen=True)
class Outcome:
    """How a file ended.

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
    """What becomes of one file."""
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
    wrong = [name for name in TRUTH if not _close(fit, name)]
    if not fit.verdict.good:
        return "flagged", fit.message
    if not wrong:
        return "right", fit.message
    if findings.warnings:
        return "flagged", f"{findings.warnings[0].sentence} Wrong: {', '.join(wrong)}."
    told = ", ".join(f"{name} {fit.values[name]:.4g}" for name in wrong)
    return "silent", f"{fit.message} Wrong: {told}."


def _close(fit: Fitted, name: str) -> bool:
    """Whether a parameter is right, or is said not to be told by the data."""
    estimate = fit.parameters[name]
    error = abs(estimate.value - TRUTH[name])
    low, high = estimate.low, estimate.high
    inside = low is not None and high is not None and low <= TRUTH[name] <= high
    return error <= CLOSE * abs(TRUTH[name]) or inside


def measure(quick: bool = False) -> Iterator[Row]:
    """Rows of the bench: files answered wrongly in silence, crashes, good files that are right."""
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
    yield Row("files", "bad files wrong in silence", len(silent), 0, "<=", seconds,
              "; ".join([note, *silent]))  # fmt: skip
    yield Row("files", "good files right", (len(good) - len(lost)) / max(len(good), 1), 1.0, ">=",
              0.0, ", ".join(lost))  # fmt: skip
    crashed = [o.file for o in found if o.kind == "crashed"]
    yield Row("files", "crashes", len(crashed), 0, "<=", 0.0, ", ".join(crashed))
    yield Row("files", "files", len(found), 20 if quick else 100, ">=", 0.0,
              f"{hidden} with what no file can show")  # fmt: skip
