"""Identification with goals: convergence to the true parameters, admissible starts, and cost."""

import tempfile
import tomllib
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any, Literal, NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from identification import Dataset, Fit, Fitted, InverseDynamics, synthetic_drive_data
from symfric.bench.identification_measured import emps, franka
from symfric.bench.identification_memory import gms, lugre
from symfric.bench.identification_repeats import coverage, starts
from symfric.bench.report import Found, Progress, Report, goal, timed
from symfric.foundation.parameters import check_names
from symfric.foundation.status import SolveError

TRUTH = {"m": 95.0, "offset": -3.0, "mu_s": 28.0, "mu_d": 20.0, "v_s": 0.01, "sigma_2": 200.0}
"""Parameters of the stage of `campaign`."""
CLOSE = 0.05
"""Largest relative error of a parameter that counts as right."""
EVERY = 5
"""Quick runs read every fifth file."""


Array = NDArray[np.float64]
Truth = Literal["good", "bad", "hidden"]

HEADER = "t [s],x [m],force [N]"
NAMES = ["t", "x", "force"]
UNITS = "m, N"
CHANGES: dict[str, dict[str, str]] = tomllib.loads(
    Path(__file__).with_name("identification_files.toml").read_text("utf-8")
)
"""Changes of the record by the truth of their files."""


@final
@dataclass(frozen=True, eq=False)
class File:
    """File of the campaign.

    Attributes:
        name: defect or peculiarity of the file.
        truth: "good": the fit must be right; "bad": the file must be refused, flagged, or right;
            "hidden": the file does not reveal its defect.
        content: bytes of the file.
        suffix: suffix of the file name.
        options: arguments of `Dataset.read`.
    """

    name: str
    truth: Truth
    content: bytes
    suffix: str = ".csv"
    options: Mapping[str, Any] = field(default_factory=dict[str, Any])


def table(
    a: Array, header: str = HEADER, separator: str = ",", decimal: str = ".", end: str = "\n"
) -> bytes:
    """Return a matrix as encoded text."""
    rows = (separator.join(f"{x:.10g}".replace(".", decimal) for x in row) for row in a.tolist())
    return (end.join([*([header] if header else []), *rows]) + end).encode()


def campaign(seed: int = 3) -> Iterator[File]:
    """Yield a hundred intact, damaged and physically implausible files of one simulated stage.

    The stage is that of `synthetic_drive_data`, 95 kg with Stribeck friction, moved at four speeds.
    All files contain the same record.

    Some defects leave no trace in a file and are marked "hidden": a force multiplied by a constant
    (a wrong gain, kN for N), times or positions multiplied by a plausible constant, a velocity
    consistent with them, and a gain of the force that depends on its sign by up to 15 % (1.1 for
    one sign gives a mass of 99.9 kg and an offset of -1.7 N without a warning; 1.2 is reported).
    Fits of such files are right for the numbers in them.
    """
    record = synthetic_drive_data(speeds=(0.004, 0.012, 0.03, 0.08), seed=seed)[0]
    a = np.column_stack([record.time, record["x"], record["force"]])
    rng = np.random.default_rng(seed)
    yield from _dialects(a)
    yield from _stores(a)
    yield from _damaged(a)
    yield from _incomplete(a)
    known: dict[str, Any] = {"normal": rng.standard_normal}
    for name, change in CHANGES["good"].items():
        yield File(name, "good", table(altered(a, change, known)))
    known["few"] = rng.integers(50, 8000, 20)
    for name, change in CHANGES["bad"].items():
        yield File(name, "bad", table(altered(a, change, known)))
    v = np.gradient(a[:, 1], a[:, 0])
    for name, factor in (("velocity flipped", -1.0), ("mm/s taken for m/s", 1e3)):
        yield File(name, "bad", table(np.column_stack([a, factor * v]), HEADER + ",v [m/s]"))
    for name, factors in (("force times 2", [1, 1, 2]), ("times 10 % too long", [1.1, 1, 1])):
        yield File(name, "hidden", table(a * factors))


def _dialects(a: Array) -> Iterator[File]:
    plain = table(a)
    semicolon = HEADER.replace(",", ";")
    quoted = "\n".join(
        ",".join(f'"{cell}"' for cell in line.split(",")) for line in plain.decode().splitlines()
    )
    other = np.column_stack([1e-3 * a[:, 2], a[:, 1] * 1e3, a[:, 0] * 1e3, a[:, 0]])
    words = plain.decode().replace("\n", ",auto\n").replace("force [N],auto", "force [N],mode", 1)
    named = {"columns": NAMES, "units": UNITS}
    contents: dict[str, tuple[bytes, dict[str, Any]]] = {
        "plain": (plain, {}),
        "semicolon, decimal comma": (table(a, semicolon, ";", ","), {}),
        "tab": (table(a, HEADER.replace(",", "\t"), "\t"), {}),
        "spaces": (table(a, "t_s x_m force_N", "   "), {}),
        "no header": (table(a, "", " "), named),
        "byte order mark": (b"\xef\xbb\xbf" + plain, {}),
        "UTF-16": (plain.decode().encode("utf-16"), {}),
        "carriage returns": (table(a, end="\r\n"), {}),
        "comments first": (b"# rig 3\n% 2026-05-01\n" + plain, {}),
        "title lines": (b"Recorder 7\nRate;1000\n\n" + table(a, semicolon, ";", ","), {}),
        "header in a comment": (table(a, "# t_s x_m force_N", " "), {}),
        "row of units": (table(a, "time;pos;F\ns;m;N", ";"), {}),
        "quotes": (quoted.encode(), {}),
        "other units and order": (table(other, "F [kN],x [mm],t [ms],spare [K]"), {}),
        "units in the call": (table(a, "time,q,F"), {"units": UNITS}),
        "step in the call": (table(a[:, 1:], "x [m],F [N]"), {"step": 1e-3}),
        "column of words": (words.encode(), {}),
    }
    for name, (content, options) in contents.items():
        yield File(name, "good", content, options=options)


def _stores(a: Array) -> Iterator[File]:
    from scipy.io import savemat  # noqa: PLC0415  (slow to import)

    def mat(content: Mapping[str, Any], **options: Any) -> bytes:
        file = BytesIO()
        savemat(file, dict(content), **options)
        return file.getvalue()

    run = dict(zip(NAMES, a.T, strict=True))
    units = {"units": UNITS}
    named = {"columns": NAMES, "units": UNITS}
    yield File("MATLAB variables", "good", mat(run), ".mat", units)
    yield File("MATLAB struct", "good", mat({"log": {"run": run}}), ".mat", units)
    yield File("MATLAB matrix", "good", mat({"d": a}, do_compression=True), ".mat", named)
    yield File("MATLAB, cut off", "bad", mat(run)[:70_000], ".mat", units)
    yield File("MATLAB 7.3", "bad", b"\x89HDF\r\n\x1a\n" + bytes(512), ".mat", units)
    damaged = bytearray(mat({"log": run}))
    damaged[130:180] = bytes(range(50))
    yield File("MATLAB, damaged", "bad", bytes(damaged), ".mat", units)
    file = BytesIO()
    np.savez(file, **run)
    yield File("NumPy archive", "good", file.getvalue(), ".npz", units)
    yield File("NumPy archive, cut off", "bad", file.getvalue()[:50_000], ".npz", units)


def _damaged(a: Array) -> Iterator[File]:
    plain = table(a).decode()
    lines = plain.splitlines()
    t, x, force = lines[50].split(",")
    cells = {
        "nan": f"{t},nan,{force}",
        "infinite number": f"{t},inf,{force}",
        "text in a cell": f"{t},--,{force}",
        "empty cell": f"{t},,{force}",
        "cell missing": f"{t},{x}",
        "cell too many": f"{t},{x},{force},7",
        "decimal comma between commas": f"{t},{x.replace('.', ',')},{force}",
        "number with an underscore": f"{t},1_0,{force}",
        "two rows in one": f"{lines[50]}{lines[51]}",
        "header again": lines[0],
    }
    repeated = a.copy()
    repeated[500:520, 0] = repeated[499, 0]
    clock = [lines[0], *(f"12:00:{line}" for line in lines[1:])]
    contents = {
        name: "\n".join([*lines[:50], cell, *lines[51:]]) for name, cell in cells.items()
    } | {
        "empty file": "",
        "header alone": lines[0],
        "two records in one": "\n".join([*lines, *lines[1:]]),
        "times repeated": table(repeated).decode(),
        "times backwards": table(a[::-1]).decode(),
        "bytes of zero": plain[:9000] + "\0" * 300 + plain[9300:],
        "spreadsheet": (b"PK\x03\x04" + bytes(range(256)) * 20).decode("latin-1"),
        "web page": "<html>\n<body>404, not found</body>\n</html>\n",
        "times of day": "\n".join(clock),
    }
    for name, content in contents.items():
        yield File(name, "bad", content.encode("latin-1"))


def _incomplete(a: Array) -> Iterator[File]:
    """Yield files with missing or contradictory headers."""
    headers = {
        "no header, no names": "",
        "no units": "t,x,force",
        "volts": "t [s],x [m],force [V]",
        "angle and newtons": "t [s],x [rad],force [N]",
        "unknown unit": "t [s],x [furlong],force [N]",
    }
    for name, header in headers.items():
        yield File(name, "bad", table(a, header))
    yield File("no time", "bad", table(a[:, 1:], "x [m],force [N]"))
    yield File("column twice", "bad", table(a[:, [0, 1, 2, 2]], HEADER + ",force [N]"))


def altered(a: Array, change: str, known: dict[str, Any]) -> Array:
    """Return the record after a `change` of the data file; `known` are further names in it."""
    target, _, formula = change.partition(" = ")
    column, _, rows = target.removesuffix("]").partition("[")
    names = {"np": np, "n": len(a), "a": a, "backlash": backlash, **known}
    if column == "a":
        return eval(formula, names | dict(zip("txF", a.T, strict=True)))
    made, chosen = a.copy(), eval(f"np.s_[{rows or ':'}]", names)
    t, x, F = a[chosen].T
    made[chosen, "txF".index(column)] = eval(formula, names | {"t": t, "x": x, "F": F})
    return made


def backlash(motor: Array, half: float) -> Array:
    """Return the position behind a play of `half` [m] to both sides."""
    stage, seen = motor[0], np.empty(motor.size)
    for k, x in enumerate(motor.tolist()):
        seen[k] = stage = min(max(stage, x - half), x + half)
    return seen


# ---- outcomes ----


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

    Each file of `campaign` is read, checked and fitted by inverse dynamics with a
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
    yield goal("files", len(found), 20 if quick else 100, ">=", note=note)


CASES: Mapping[str, Callable[[bool], Iterator[Found]]] = {
    "lugre": lugre,
    "coverage": coverage,
    "emps": emps,
    "franka": franka,
    "starts": starts,
    "gms": gms,
    "files": files,
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
    return Report().collect(tasks, progress)


def _named(case: str, quick: bool) -> Iterator[Found]:
    """Yield the rows of a case, with its name in the first column."""
    for item in CASES[case](quick):
        yield item if isinstance(item, str) else (item[0], {"case": case, **item[1]})
