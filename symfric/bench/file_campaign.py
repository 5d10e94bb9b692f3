"""A hundred files of one simulated stage: good ones, damaged ones, and physics gone wrong.

The stage is that of `synthetic_drive_data`, 95 kg with Stribeck friction, moved at four speeds.
Every file is written from the same record, so that what a fit says can be held against the truth.

What a file cannot show, marked `hidden`: a force times a constant (a wrong gain, kN for N), times
or positions times a constant within what machines do, a velocity that is consistent with them, a
gain of the force that differs by its sign by up to 15 % (1.1 for one sign is answered with a mass
of 99.9 kg and an offset of -1.7 N, unreported; 1.2 is reported). Such files are answered with
numbers that are right for what they say.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from typing import Any, Literal, final

import numpy as np
from numpy.typing import NDArray

from identification import synthetic_drive_data

Array = NDArray[np.float64]
Truth = Literal["good", "bad", "hidden"]

HEADER = "t [s],x [m],force [N]"
NAMES = ["t", "x", "force"]
UNITS = "m, N"


@final
@dataclass(frozen=True, eq=False)
class File:
    """One file of the campaign.

    Attributes:
        name: what is the matter with it.
        truth: "good": the fit must be right; "bad": it must be refused, flagged, or right;
            "hidden": no file can show it.
        content: its bytes.
        suffix: of its name.
        said: arguments of `Dataset.read`.
    """

    name: str
    truth: Truth
    content: bytes
    suffix: str = ".csv"
    said: Mapping[str, Any] = field(default_factory=dict[str, Any])


def table(
    a: Array, header: str = HEADER, separator: str = ",", decimal: str = ".", end: str = "\n"
) -> bytes:
    """A matrix as text."""
    rows = (separator.join(f"{x:.10g}".replace(".", decimal) for x in row) for row in a.tolist())
    return (end.join([*([header] if header else []), *rows]) + end).encode()


def campaign(seed: int = 3) -> Iterator[File]:
    """All files."""
    record = synthetic_drive_data(speeds=(0.004, 0.012, 0.03, 0.08), seed=seed)[0]
    a = np.column_stack([record.time, record["x"], record["force"]])
    rng = np.random.default_rng(seed)
    yield from _dialects(a)
    yield from _stores(a)
    yield from _damaged(a)
    yield from _unsaid(a)
    for name, spoil in _harmless(rng).items():
        yield File(name, "good", table(spoil(a.copy())))
    for name, spoil in {**_sensors(rng), **_physics(rng), **_disturbed(rng)}.items():
        yield File(name, "bad", table(spoil(a.copy())))
    yield from _velocities(a)
    for name, spoil in _hidden().items():
        yield File(name, "hidden", table(spoil(a.copy())))


def _dialects(a: Array) -> Iterator[File]:
    plain = table(a)
    semicolon = HEADER.replace(",", ";")
    yield File("plain", "good", plain)
    yield File("semicolon, decimal comma", "good", table(a, semicolon, ";", ","))
    yield File("tab", "good", table(a, HEADER.replace(",", "\t"), "\t"))
    yield File("spaces", "good", table(a, "t_s x_m force_N", "   "))
    yield File("no header", "good", table(a, "", " "), said={"columns": NAMES, "units": UNITS})
    yield File("byte order mark", "good", b"\xef\xbb\xbf" + plain)
    yield File("UTF-16", "good", plain.decode().encode("utf-16"))
    yield File("carriage returns", "good", table(a, end="\r\n"))
    yield File("comments first", "good", b"# rig 3\n% 2026-05-01\n" + plain)
    yield File("title lines", "good", b"Recorder 7\nRate;1000\n\n" + table(a, semicolon, ";", ","))
    yield File("header in a comment", "good", table(a, "# t_s x_m force_N", " "))
    yield File("row of units", "good", table(a, "time;pos;F\ns;m;N", ";"))
    quoted = "\n".join(
        ",".join(f'"{cell}"' for cell in line.split(",")) for line in plain.decode().splitlines()
    )
    yield File("quotes", "good", quoted.encode())
    other = np.column_stack([1e-3 * a[:, 2], a[:, 1] * 1e3, a[:, 0] * 1e3, a[:, 0]])
    yield File("other units and order", "good", table(other, "F [kN],x [mm],t [ms],spare [K]"))
    yield File("units in the call", "good", table(a, "time,q,F"), said={"units": UNITS})
    yield File("step in the call", "good", table(a[:, 1:], "x [m],F [N]"), said={"step": 1e-3})
    words = plain.decode().replace("\n", ",auto\n").replace("force [N],auto", "force [N],mode", 1)
    yield File("column of words", "good", words.encode())


def _stores(a: Array) -> Iterator[File]:
    from scipy.io import savemat  # noqa: PLC0415  (slow to import)

    def mat(content: Mapping[str, Any], **options: Any) -> bytes:
        file = BytesIO()
        savemat(file, dict(content), **options)
        return file.getvalue()

    run = dict(zip(NAMES, a.T, strict=True))
    said = {"units": UNITS}
    named = {"columns": NAMES, "units": UNITS}
    yield File("MATLAB variables", "good", mat(run), ".mat", said)
    yield File("MATLAB struct", "good", mat({"log": {"run": run}}), ".mat", said)
    yield File("MATLAB matrix", "good", mat({"d": a}, do_compression=True), ".mat", named)
    yield File("MATLAB, cut off", "bad", mat(run)[:70_000], ".mat", said)
    yield File("MATLAB 7.3", "bad", b"\x89HDF\r\n\x1a\n" + bytes(512), ".mat", said)
    damaged = bytearray(mat({"log": run}))
    damaged[130:180] = bytes(range(50))
    yield File("MATLAB, damaged", "bad", bytes(damaged), ".mat", said)
    file = BytesIO()
    np.savez(file, **run)
    yield File("NumPy archive", "good", file.getvalue(), ".npz", said)
    yield File("NumPy archive, cut off", "bad", file.getvalue()[:50_000], ".npz", said)


def _damaged(a: Array) -> Iterator[File]:
    plain = table(a).decode()
    lines = plain.splitlines()
    t, x, force = lines[50].split(",")

    def line_50(text: str) -> bytes:
        return "\n".join([*lines[:50], text, *lines[51:]]).encode()

    cells = {
        "nan": f"{t},nan,{force}",
        "infinite number": f"{t},inf,{force}",
        "text in a cell": f"{t},--,{force}",
        "empty cell": f"{t},,{force}",
        "cell missing": f"{t},{x}",
        "cell too many": f"{t},{x},{force},7",
        "decimal comma between commas": line_50(f"{t},{x.replace('.', ',')},{force}").decode(),
        "number with an underscore": f"{t},1_0,{force}",
        "two rows in one": f"{lines[50]}{lines[51]}",
        "header again": lines[0],
    }
    for name, text in cells.items():
        yield File(name, "bad", text.encode() if "\n" in text else line_50(text))
    yield File("empty file", "bad", b"")
    yield File("header alone", "bad", lines[0].encode())
    yield File("two records in one", "bad", "\n".join([*lines, *lines[1:]]).encode())
    repeated = a.copy()
    repeated[500:520, 0] = repeated[499, 0]
    yield File("times repeated", "bad", table(repeated))
    yield File("times backwards", "bad", table(a[::-1]))
    yield File("bytes of zero", "bad", plain.encode()[:9000] + bytes(300) + plain.encode()[9300:])
    yield File("spreadsheet", "bad", b"PK\x03\x04" + bytes(range(256)) * 20)
    yield File("web page", "bad", b"<html>\n<body>404, not found</body>\n</html>\n")
    clock = "\n".join([lines[0], *(f"12:00:{line}" for line in lines[1:])])
    yield File("times of day", "bad", clock.encode())


def _unsaid(a: Array) -> Iterator[File]:
    yield File("no header, no names", "bad", table(a, ""))
    yield File("no units", "bad", table(a, "t,x,force"))
    yield File("no time", "bad", table(a[:, 1:], "x [m],force [N]"))
    yield File("volts", "bad", table(a, "t [s],x [m],force [V]"))
    yield File("angle and newtons", "bad", table(a, "t [s],x [rad],force [N]"))
    yield File("column twice", "bad", table(a[:, [0, 1, 2, 2]], HEADER + ",force [N]"))
    yield File("unknown unit", "bad", table(a, "t [s],x [furlong],force [N]"))


def _put(a: Array, rows: Any, column: Any, values: Any) -> Array:
    a[rows, column] = values
    return a


Spoil = Callable[[Array], Array]


def _harmless(rng: np.random.Generator) -> dict[str, Spoil]:
    """Harmless changes, which a fit has to tolerate."""

    def rounded(column: int, step: float) -> Spoil:
        return lambda a: _put(a, slice(None), column, step * np.rint(a[:, column] / step))

    def noisy(column: int, size: float) -> Spoil:
        return lambda a: a + size * rng.standard_normal(a.shape) * (np.arange(3) == column)

    return {
        "encoder of 1 um": rounded(1, 1e-6),
        "force in steps of 1 N": rounded(2, 1.0),
        "force noise of 5 N": noisy(2, 5.0),
        "jitter of .5 %": noisy(0, 5e-6 / 3),
        "offset of the position": lambda a: _put(a, slice(None), 1, a[:, 1] + 3.0),
        "begins late": lambda a: _put(a, slice(None), 0, a[:, 0] + 5e3),
    }


def _sensors(rng: np.random.Generator) -> dict[str, Spoil]:
    every, x, force = slice(None), 1, 2
    few = rng.integers(50, 8000, 20)

    def held(a: Array, column: int, count: int) -> Array:
        return _put(a, every, column, np.repeat(a[::count, column], count)[: len(a)])

    def late(count: int) -> Spoil:
        return lambda a: np.column_stack([a[count:, :2], a[:-count, 2]])

    return {
        "force clipped at 60 N": lambda a: _put(a, every, force, np.clip(a[:, 2], -60, 60)),
        "force clipped at 40 N": lambda a: _put(a, every, force, np.clip(a[:, 2], -40, 40)),
        "force clipped at 25 N": lambda a: _put(a, every, force, np.clip(a[:, 2], -25, 25)),
        "force clipped on one side": lambda a: _put(a, every, force, np.minimum(a[:, 2], 40)),
        "clipped before its noise": lambda a: _put(
            a, every, force, np.clip(a[:, 2], -40, 40) + 0.05 * rng.standard_normal(len(a))
        ),
        "20 spikes of 10 kN": lambda a: _put(a, few, force, 1e4),
        "20 spikes of 150 N": lambda a: _put(a, few, force, 150.0),
        "3 glitches of 50 mm": lambda a: _put(a, few[:3], x, a[few[:3], 1] + 0.05),
        "3 glitches of 1 mm": lambda a: _put(a, few[:3], x, a[few[:3], 1] + 1e-3),
        "20 drop-outs to zero": lambda a: _put(a, few, x, 0.0),
        "counts lost": lambda a: _put(a, slice(3000, None), x, a[3000:, 1] + 3e-3),
        "encoder frozen for .4 s": lambda a: _put(a, slice(3400, 3800), x, a[3400, 1]),
        "encoder frozen for 40 ms": lambda a: _put(a, slice(3400, 3440), x, a[3400, 1]),
        "force frozen for .4 s": lambda a: _put(a, slice(3400, 3800), force, a[3400, 2]),
        "force frozen to the end": lambda a: _put(a, slice(3400, None), force, a[3400, 2]),
        "encoder of 50 um": lambda a: _put(a, every, x, 5e-5 * np.rint(a[:, 1] / 5e-5)),
        "encoder of 1 mm": lambda a: _put(a, every, x, 1e-3 * np.rint(a[:, 1] / 1e-3)),
        "force in steps of 20 N": lambda a: _put(a, every, force, 20 * np.rint(a[:, 2] / 20)),
        "position held for 10 samples": lambda a: held(a, x, 10),
        "force held for 10 samples": lambda a: held(a, force, 10),
        "position modulo 20 mm": lambda a: _put(a, every, x, a[:, 1] % 0.02),
        "force drifts by 30 N": lambda a: _put(a, every, force, a[:, 2] + 30 * a[:, 0] / a[-1, 0]),
        "zero of the force steps by 20 N": lambda a: _put(
            a, every, force, a[:, 2] + 20 * (a[:, 0] > 4)
        ),
        "hum of 20 N": lambda a: _put(
            a, every, force, a[:, 2] + 20 * np.sin(2 * np.pi * 50 * a[:, 0])
        ),
        "force 5 ms late": late(5),
        "force 20 ms late": late(20),
        "jitter of 20 %": lambda a: _put(
            a, every, 0, np.sort(a[:, 0] + 2e-4 * rng.standard_normal(len(a)))
        ),
        "gap of .5 s": lambda a: np.delete(a, slice(2000, 2500), axis=0),
        "one row missing": lambda a: np.delete(a, 2000, axis=0),
        "one row in a hundred missing": lambda a: np.delete(a, few[0] + 100 * np.arange(1, 10), 0),
    }


def _physics(rng: np.random.Generator) -> dict[str, Spoil]:
    every, x, force = slice(None), 1, 2

    def white(size: float, n: int) -> Array:
        return size * rng.standard_normal(n)

    return {
        "force flipped": lambda a: a * [1, 1, -1],
        "position flipped": lambda a: a * [1, -1, 1],
        "columns exchanged": lambda a: a[:, [0, 2, 1]],
        "standstill": lambda a: np.column_stack([a[:, 0], white(1e-7, len(a)), white(1, len(a))]),
        "noise": lambda a: np.column_stack([a[:, 0], white(1, len(a)), white(1, len(a))]),
        "force of noise": lambda a: _put(a, every, force, white(10, len(a))),
        "constant force": lambda a: _put(a, every, force, 3.0),
        "one way only": lambda a: a[:850],
        "60 samples": lambda a: a[:60],
        "velocity for position": lambda a: _put(a, every, x, np.gradient(a[:, 1], 1e-3)),
        "force without its sign": lambda a: _put(a, every, force, np.abs(a[:, 2])),
        "force of another run": lambda a: _put(a, every, force, np.roll(a[:, 2], len(a) // 3)),
        "um taken for m": lambda a: a * [1, 1e6, 1],
        "ms taken for s": lambda a: a * [1e3, 1, 1],
        "all too large": lambda a: a * [1, 1e9, 1e9],
        "all too small": lambda a: a * [1, 1e-9, 1e-9],
        "force sensor squares": lambda a: _put(
            a, every, force, np.sign(a[:, 2]) * a[:, 2] ** 2 / 50
        ),
        "spring parallel to the drive": lambda a: _put(a, every, force, a[:, 2] + 2e3 * a[:, 1]),
        "friction grows on the way": lambda a: _put(
            a, every, force, a[:, 2] * (1 + 10 * np.abs(a[:, 1]))
        ),
    }


def _disturbed(rng: np.random.Generator) -> dict[str, Spoil]:
    """Disturbances that act on the drive, or between it and its sensors."""
    every, x, force = slice(None), 1, 2

    def pushed(extra: Callable[[Array, Array, Array], Array]) -> Spoil:
        """A force added that depends on time, position and velocity."""

        def spoil(a: Array) -> Array:
            v = np.gradient(a[:, 1], 1e-3)
            return _put(a, every, force, a[:, 2] + extra(a[:, 0], a[:, 1], v))

        return spoil

    def behind(a: Array) -> Array:
        """The position behind a backlash of .5 mm."""
        table_, seen = a[0, 1], np.empty(len(a))
        for k, motor in enumerate(a[:, 1].tolist()):
            table_ = min(max(table_, motor - 2.5e-4), motor + 2.5e-4)
            seen[k] = table_
        return _put(a, every, x, seen + 1e-7 * rng.standard_normal(len(a)))

    return {
        "friction falls by 30 %": pushed(lambda t, x, v: -0.3 * t / t[-1] * 22 * np.tanh(v / 1e-3)),
        "cogging of 5 N": pushed(lambda t, x, v: 5 * np.sin(2 * np.pi * x / 5e-3)),
        "gravity by an angle": pushed(lambda t, x, v: 30 * np.cos(20 * x)),
        "slow hum of 10 N": pushed(lambda t, x, v: 10 * np.sin(2 * np.pi * 0.3 * t)),
        "force stays away for 1 s": lambda a: _put(a, slice(3000, 4000), force, 0.0),
        "force gain of 1.3 one way": lambda a: _put(
            a, every, force, a[:, 2] * np.where(a[:, 2] > 0, 1.3, 1.0)
        ),
        "sign turned half way": lambda a: _put(a, slice(4400, None), force, -a[4400:, 2]),
        "dead band of 10 N": lambda a: _put(
            a, every, force, np.sign(a[:, 2]) * np.maximum(np.abs(a[:, 2]) - 10, 0)
        ),
        "backlash of .5 mm": behind,
        "position through a filter of 5 ms": lambda a: _put(
            a, every, x, np.convolve(a[:, 1], np.exp(-np.arange(60) / 5) / 5.516655)[: len(a)]
        ),
    }


def _velocities(a: Array) -> Iterator[File]:
    v = np.gradient(a[:, 1], a[:, 0])
    for name, factor in (("velocity flipped", -1.0), ("mm/s taken for m/s", 1e3)):
        yield File(name, "bad", table(np.column_stack([a, factor * v]), HEADER + ",v [m/s]"))


def _hidden() -> dict[str, Spoil]:
    return {
        "force times 2": lambda a: a * [1, 1, 2],
        "times 10 % too long": lambda a: a * [1.1, 1, 1],
    }
