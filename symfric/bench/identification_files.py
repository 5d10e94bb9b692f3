"""A hundred files of one simulated stage: intact files, damaged files, and implausible physics.

The stage is that of `synthetic_drive_data`, 95 kg with Stribeck friction, moved at four speeds. All
files contain the same record, and the fit of each file is compared with the true parameters.

Some defects leave no trace in a file and are marked "hidden": a force multiplied by a constant (a
wrong gain, kN for N), times or positions multiplied by a plausible constant, a velocity consistent
with them, and a gain of the force that depends on its sign by up to 15 % (1.1 for one sign gives a
mass of 99.9 kg and an offset of -1.7 N without a warning; 1.2 is reported). Fits of such files are
right for the numbers in them.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from typing import Any, Literal, final

import numpy as np

from identification import synthetic_drive_data
from symfric.bench.identification_records import with_play
from symfric.foundation.numeric import Array

Truth = Literal["good", "bad", "hidden"]

HEADER = "t [s],x [m],force [N]"
NAMES = ["t", "x", "force"]
UNITS = "m, N"


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
    """Yield all files of the campaign."""
    record = synthetic_drive_data(speeds=(0.004, 0.012, 0.03, 0.08), seed=seed)[0]
    a = np.column_stack([record.time, record["x"], record["force"]])
    rng = np.random.default_rng(seed)
    yield from _dialects(a)
    yield from _stores(a)
    yield from _damaged(a)
    yield from _incomplete(a)
    for name, spoil in _harmless(rng).items():
        yield File(name, "good", table(spoil(a.copy())))
    for name, spoil in {**_sensors(rng), **_physics(rng), **_disturbed(rng)}.items():
        yield File(name, "bad", table(spoil(a.copy())))
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


Spoil = Callable[[Array], Array]
Column = Callable[[Array, Array, Array], Any]
"""Function that returns new values of a column from t, x and F."""
T, X, F = 0, 1, 2


def put(column: int, new: Column, rows: Any = slice(None)) -> Spoil:
    """Return a function that changes `rows` of a column."""

    def spoil(a: Array) -> Array:
        a[rows, column] = new(*a[rows].T)
        return a

    return spoil


def _harmless(rng: np.random.Generator) -> dict[str, Spoil]:
    """Return harmless changes that a fit has to tolerate."""

    def noisy(column: int, size: float) -> Spoil:
        return lambda a: a + size * rng.standard_normal(a.shape) * (np.arange(3) == column)

    return {
        "encoder of 1 um": put(X, lambda t, x, F: 1e-6 * np.rint(x / 1e-6)),
        "force in steps of 1 N": put(F, lambda t, x, F: np.rint(F)),
        "force noise of 5 N": noisy(F, 5.0),
        "jitter of .5 %": noisy(T, 5e-6 / 3),
        "offset of the position": put(X, lambda t, x, F: x + 3.0),
        "begins late": put(T, lambda t, x, F: t + 5e3),
    }


def _sensors(rng: np.random.Generator) -> dict[str, Spoil]:
    few = rng.integers(50, 8000, 20)
    sparse = few[0] + 100 * np.arange(1, 10)

    def clipped(low: float, high: float = 1e9) -> Spoil:
        return put(F, lambda t, x, F: np.clip(F, low, high))

    def altered(column: int, new: Callable[[Array], Any], rows: Any = slice(None)) -> Spoil:
        return put(column, lambda t, x, F: new((t, x, F)[column]), rows)

    def rounded(column: int, step: float) -> Spoil:
        return altered(column, lambda a: step * np.rint(a / step))

    def frozen(column: int, end: int | None) -> Spoil:
        return altered(column, lambda a: a[0], slice(3400, end))

    def held(column: int, count: int) -> Spoil:
        return altered(column, lambda a: np.repeat(a[::count], count)[: a.size])

    def late(count: int) -> Spoil:
        return lambda a: np.column_stack([a[count:, :2], a[:-count, 2]])

    return {
        "force clipped at 60 N": clipped(-60, 60),
        "force clipped at 40 N": clipped(-40, 40),
        "force clipped at 25 N": clipped(-25, 25),
        "force clipped on one side": clipped(-1e9, 40),
        "clipped before its noise": put(
            F, lambda t, x, F: np.clip(F, -40, 40) + 0.05 * rng.standard_normal(F.size)
        ),
        "20 spikes of 10 kN": put(F, lambda t, x, F: 1e4, few),
        "20 spikes of 150 N": put(F, lambda t, x, F: 150.0, few),
        "3 glitches of 50 mm": put(X, lambda t, x, F: x + 0.05, few[:3]),
        "3 glitches of 1 mm": put(X, lambda t, x, F: x + 1e-3, few[:3]),
        "20 drop-outs to zero": put(X, lambda t, x, F: 0.0, few),
        "counts lost": put(X, lambda t, x, F: x + 3e-3, slice(3000, None)),
        "encoder frozen for .4 s": frozen(X, 3800),
        "encoder frozen for 40 ms": frozen(X, 3440),
        "force frozen for .4 s": frozen(F, 3800),
        "force frozen to the end": frozen(F, None),
        "encoder of 50 um": rounded(X, 5e-5),
        "encoder of 1 mm": rounded(X, 1e-3),
        "force in steps of 20 N": rounded(F, 20),
        "position held for 10 samples": held(X, 10),
        "force held for 10 samples": held(F, 10),
        "position modulo 20 mm": put(X, lambda t, x, F: x % 0.02),
        "force drifts by 30 N": put(F, lambda t, x, F: F + 30 * t / t[-1]),
        "zero of the force steps by 20 N": put(F, lambda t, x, F: F + 20 * (t > 4)),
        "hum of 20 N": put(F, lambda t, x, F: F + 20 * np.sin(2 * np.pi * 50 * t)),
        "force 5 ms late": late(5),
        "force 20 ms late": late(20),
        "jitter of 20 %": put(
            T, lambda t, x, F: np.sort(t + 2e-4 * rng.standard_normal(t.size))
        ),
        "gap of .5 s": lambda a: np.delete(a, slice(2000, 2500), axis=0),
        "one row missing": lambda a: np.delete(a, 2000, axis=0),
        "one row in a hundred missing": lambda a: np.delete(a, sparse, 0),
    }  # fmt: skip


def _physics(rng: np.random.Generator) -> dict[str, Spoil]:
    def white(t: Array, size: float) -> Array:
        return np.column_stack([t, size * rng.standard_normal(t.size), rng.standard_normal(t.size)])

    return {
        "force flipped": lambda a: a * [1, 1, -1],
        "position flipped": lambda a: a * [1, -1, 1],
        "columns exchanged": lambda a: a[:, [0, 2, 1]],
        "standstill": lambda a: white(a[:, 0], 1e-7),
        "noise": lambda a: white(a[:, 0], 1),
        "force of noise": put(F, lambda t, x, F: 10 * rng.standard_normal(t.size)),
        "constant force": put(F, lambda t, x, F: 3.0),
        "one way only": lambda a: a[:850],
        "60 samples": lambda a: a[:60],
        "velocity for position": put(X, lambda t, x, F: np.gradient(x, 1e-3)),
        "force without its sign": put(F, lambda t, x, F: np.abs(F)),
        "force of another run": put(F, lambda t, x, F: np.roll(F, F.size // 3)),
        "um taken for m": lambda a: a * [1, 1e6, 1],
        "ms taken for s": lambda a: a * [1e3, 1, 1],
        "all too large": lambda a: a * [1, 1e9, 1e9],
        "all too small": lambda a: a * [1, 1e-9, 1e-9],
        "force sensor squares": put(F, lambda t, x, F: np.sign(F) * F**2 / 50),
        "spring parallel to the drive": put(F, lambda t, x, F: F + 2e3 * x),
        "friction grows on the way": put(F, lambda t, x, F: F * (1 + 10 * np.abs(x))),
    }


def _disturbed(rng: np.random.Generator) -> dict[str, Spoil]:
    """Return disturbances that act on the drive, or between the drive and its sensors."""

    def fading(t: Array, x: Array, F: Array) -> Array:
        return F - 0.3 * t / t[-1] * 22 * np.tanh(np.gradient(x, 1e-3) / 1e-3)

    def backlash(t: Array, x: Array, F: Array) -> Array:
        return with_play(x, 5e-4) + 1e-7 * rng.standard_normal(x.size)

    def low_pass(t: Array, x: Array, F: Array) -> Array:
        return np.convolve(x, np.exp(-np.arange(60) / 5) / 5.516655)[: x.size]

    return {
        "friction falls by 30 %": put(F, fading),
        "cogging of 5 N": put(F, lambda t, x, F: F + 5 * np.sin(2 * np.pi * x / 5e-3)),
        "gravity by an angle": put(F, lambda t, x, F: F + 30 * np.cos(20 * x)),
        "slow hum of 10 N": put(F, lambda t, x, F: F + 10 * np.sin(2 * np.pi * 0.3 * t)),
        "force stays away for 1 s": put(F, lambda t, x, F: 0.0, slice(3000, 4000)),
        "force gain of 1.3 one way": put(F, lambda t, x, F: F * np.where(F > 0, 1.3, 1.0)),
        "sign turned half way": put(F, lambda t, x, F: -F, slice(4400, None)),
        "dead band of 10 N": put(
            F, lambda t, x, F: np.sign(F) * np.maximum(np.abs(F) - 10, 0)
        ),
        "backlash of .5 mm": put(X, backlash),
        "position through a filter of 5 ms": put(X, low_pass),
    }  # fmt: skip
