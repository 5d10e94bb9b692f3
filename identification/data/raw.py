"""Raw columns of a file, and their conversion to a record with names, SI units and time."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from re import fullmatch
from typing import Any, Literal, TypeVar, final

import numpy as np
from numpy.typing import NDArray

from identification.data.at_load import at_load
from identification.data.record import Array, Record
from identification.data.units import CHANNELS, OF_DRIVE, Channel, by_channel, is_common, unit
from symfric.drives.drive import Drive
from symfric.foundation import checks
from symfric.foundation.units import parsed

T = TypeVar("T")
Missing = Literal["refuse", "drop"]

MOTION, POINTS = ("t", "x", "v", "a", "force"), ("v", "F", "N", "t")
"""Channels of records over time, and of points."""
SKIPPED = ("", "-", "_")
"""Entries of `columns` that mark columns to ignore."""


@final
@dataclass(frozen=True, eq=False)
class Column:
    """A column of a file.

    Attributes:
        label: header without the unit.
        unit: unit in the file; "" if there is none.
        values: numbers, NaN for missing ones, shape (n,).
        problem: first bad cell, with its location; "" if all cells are numbers.
        gaps: True if empty cells (or NaN, or infinite numbers) are the only problem.
    """

    label: str
    unit: str
    values: Array
    problem: str = ""
    gaps: bool = False

    @classmethod
    def of(cls, label: str, unit: str, values: Array) -> "Column":
        """Return a column of numbers, some of which may be NaN or infinite."""
        bad, problem = np.flatnonzero(~np.isfinite(values)), ""
        if bad.size:
            got = f"{values[bad[0]]} ({bad.size} such)"
            problem = f"sample {bad[0]}: expected a finite number, got {got}"
        return cls(label, unit, values, problem, bool(bad.size))

    def __str__(self) -> str:
        return f"{self.label} [{self.unit}]" if self.unit else self.label


@final
@dataclass(frozen=True, eq=False)
class Raw:
    """Columns of one record before they are assigned to channels.

    Attributes:
        name: name of the file and of the record in it.
        columns: columns in the order of the file; without a header their labels are "".
        first_row: row of the first sample in the file; 0 if samples have no rows.
        verb: first word of messages.
    """

    name: str
    columns: tuple[Column, ...]
    first_row: int = 0
    verb: str = "read"


@final
@dataclass(frozen=True, eq=False)
class Wanted:
    """Arguments of the caller that concern columns.

    Attributes:
        columns: channel -> column, or the names of all columns in order; None: the header.
        units: channel or column -> unit, or the short form "rad, N m"; None: the header.
        step: sample interval of records without time [s].
        points: whether the rows are points without time.
        assumed: default units of canonical channels.
        missing: "refuse" or "drop": treatment of rows in which a channel has no number, and of
            rows that repeat the previous one.
        drive: drive whose log contains a current and possibly counts; None: no drive.
    """

    columns: Mapping[str, str] | Sequence[str] | None
    units: Mapping[str, str] | str | None
    step: float | None
    points: bool
    assumed: Mapping[str, str]
    missing: Missing
    drive: Drive | None = None

    def __post_init__(self) -> None:
        checks.choice("read: missing", self.missing, ("refuse", "drop"))
        if self.drive is not None:
            checks.kind("read: drive", self.drive, Drive, "a drive, such as Drive.read(path)")
            if self.points:
                raise ValueError("read: drive: expected records over time, got points=True")

    @property
    def channels(self) -> Mapping[str, Channel]:
        """Canonical channels of the files."""
        return CHANNELS if self.drive is None else OF_DRIVE

    @property
    def names(self) -> tuple[str, ...]:
        """Channels that are recognised by the names of their columns."""
        motion = MOTION if self.drive is None else tuple(OF_DRIVE)
        return POINTS if self.points else motion


def label(cell: str) -> tuple[str, str]:
    """Return name and unit of a header cell such as `x [mm]`, `x (mm)` or `x / mm`.

    The unit is "" if the cell contains none.
    """
    cell = cell.strip()
    match = fullmatch(r"(.*?)\s*\[(.*)\]", cell)
    if match:
        return match[1], match[2].strip()
    for pattern in (r"(.*?)\s*\((.*)\)", r"(.*\S)\s+/\s*(\S.*)", r"([^/]*\w)/(\w[^/]*)"):
        match = fullmatch(pattern, cell)
        if match and match[1] and is_common(match[2]):
            return match[1], match[2].strip()
    match = fullmatch(r"(.+)_([A-Za-z]+)", cell)
    if match and is_common(match[2]) and any(_matches(match[1], n) for n in MOTION):
        return match[1], match[2]
    return cell, ""


def column_of(where: str, key: str, values: object) -> Column:
    """Return a column of values held in Python; dates are converted to seconds from the first one.

    Raises:
        ValueError: not a vector.
    """
    name, said = label(key)
    if isinstance(values, np.ma.MaskedArray):  # masked values are missing
        masked: Any = values  # pyright: ignore[reportUnknownVariableType]
        values = masked.astype(float).filled(np.nan) if masked.dtype.kind in "iuf" else masked
    wrong = checks.refused(f"{where}: {key}", "a vector of numbers", values)
    try:
        found = np.asarray(values)
    except (ValueError, TypeError):
        raise wrong from None
    if found.ndim == 2 and min(found.shape) == 1:  # a row or column vector as in MATLAB
        found = found.ravel()
    if found.ndim != 1:
        raise wrong
    if found.dtype.kind in "mM" and found.size:
        spent = found - found[np.argmin(np.isnat(found))]
        seconds = spent.astype("timedelta64[ns]") / np.timedelta64(1, "s")  # NaN if not a time
        return Column.of(name, "s", seconds)
    if found.dtype.kind in "iufb":
        return Column.of(name, said, found.astype(float))
    numbers = np.full(found.size, np.nan)
    for k, item in enumerate(found):
        number = checks.as_number(item) if found.dtype.kind == "O" else None
        if number is None:
            problem = f"sample {k}: expected a number, got {checks.shown(item)}"
            return Column(name, said, numbers, problem)
        numbers[k] = number
    return Column.of(name, said, numbers)


def is_channel(name: str) -> bool:
    """Return True if `name` is a usual name of a channel."""
    return any(_matches(name, channel) for channel in CHANNELS)


def _matches(name: str, channel: str, known: Mapping[str, Channel] = CHANNELS) -> bool:
    """Return True if `name` is an alias of `channel`."""
    names = known[channel].aliases
    return name in names or (len(name) > 1 and name.lower() in names)


def record(raw: Raw, wanted: Wanted) -> Record:
    """Convert raw columns to a record.

    Raises:
        ValueError: a requested channel is absent or not numeric, a unit is missing or wrong, or
            the time is missing; all problems in one error.
    """
    where = f"{raw.verb} '{raw.name}'"
    columns = _labelled(where, raw, wanted)
    if wanted.drive is not None:
        columns = tuple(map(_in_amperes, columns))
    have = ", ".join(map(str, columns))
    named = _channels(where, columns, wanted, have)
    requested = wanted.columns.keys() if isinstance(wanted.columns, Mapping) else set[str]()
    needed = named.keys() & {*requested, *({"v", "F"} if wanted.points else wanted.channels)}
    given = _units(where, named, wanted)
    rows = _rows(where, columns, {key: named[key] for key in named if key in needed}, wanted)
    problems: list[str] = []
    signals, units, left_out = dict[str, Array](), dict[str, str](), dict[str, str]()
    for key, column in named.items():
        values = column.values[rows]
        if column.problem and not (column.gaps and np.isfinite(values).all()):
            left_out[column.label] = column.problem
            if key in needed:
                problems.append(f"column '{column}', {column.problem}")
            continue
        try:
            factor, units[key] = _scale(key, column, given.get(key, ""), wanted)
            signals[key] = factor * values
        except ValueError as error:
            problems.append(str(error))
    if problems:
        silent = any(problem.endswith("got none") for problem in problems)
        hint = "; pass units='m, N', units='rad, N m' or units={'x': 'mm'}" * silent
        if wanted.missing == "refuse" and any(named[key].gaps for key in needed):
            hint += "; missing='drop' (--missing drop) leaves out rows without a number"
        raise ValueError(f"{where}: " + "; ".join(problems) + hint)
    t = None if wanted.points else _time(where, columns, signals, wanted, rows, have)
    signals.pop("t", None)
    if not signals and left_out:
        why = "; ".join(f"column '{name}', {bad}" for name, bad in left_out.items())
        raise ValueError(f"{where}: expected a column of numbers besides time, got none: {why}")
    found = Record(
        raw.name,
        t,
        signals,
        {key: units[key] for key in signals},
        first_row=raw.first_row if rows.all() else 0,
        columns={k: c.label for k, c in named.items() if c.label not in (k, "") and k in signals},
        left_out=left_out,
    )
    return found if wanted.drive is None else at_load(found, wanted.drive)


def _in_amperes(column: Column) -> Column:
    """Return a column such as `current_A` with its unit."""
    match = fullmatch(r"(.+)_(m?A)", column.label)
    if column.unit or match is None or not _matches(match[1], "current", OF_DRIVE):
        return column
    return replace(column, label=match[1], unit=match[2])


def _labelled(where: str, raw: Raw, wanted: Wanted) -> tuple[Column, ...]:
    """Return the columns, renamed if the caller gives the names of all columns in order."""
    columns = raw.columns
    if isinstance(wanted.columns, Mapping) or wanted.columns is None:
        if any(c.label == "" for c in columns):
            raise ValueError(
                f"{where}: expected names of {len(columns)} columns, got a file without a header; "
                "write columns=['t', 'x', 'force'], with '-' for a column to ignore"
            )
        return columns
    names = checks.many(f"{where}: columns", wanted.columns, "names")
    if len(names) != len(columns):
        have = f" ({', '.join(map(str, columns))})" if any(c.label for c in columns) else ""
        raise ValueError(
            f"{where}: columns: expected {len(columns)} names, one for each column{have}, got "
            f"{len(names)}; write '-' for a column to ignore"
        )
    kept: list[Column] = []
    for name, column in zip(names, columns, strict=True):
        text = "" if name is None else str(name).strip()
        if text not in SKIPPED:
            new, given = label(text)
            kept.append(replace(column, label=new, unit=given or column.unit))
    return tuple(kept)


def _channels(
    where: str, columns: Sequence[Column], wanted: Wanted, have: str
) -> dict[str, Column]:
    """Return channel -> column; names given by the caller precede canonical ones."""
    left, found = [*columns], dict[str, Column]()

    def take(key: str, column: Column) -> None:
        found[key] = column
        if column in left:
            left.remove(column)

    if isinstance(wanted.columns, Mapping):
        for key, name in checks.named(f"{where}: columns", wanted.columns).items():
            name = checks.text(f"{where}: columns: {key}", name, "the name of a column")
            hits = [c for c in columns if name in (c.label, str(c))]
            hits = hits or [c for c in columns if fnmatchcase(c.label.lower(), name.lower())]
            if len(hits) != 1:
                got = f"{len(hits)} of them" if hits else have
                raise ValueError(f"{where}: expected one column '{name}' for {key}, got {got}")
            take(key, hits[0])
    for key in wanted.names:
        if key in found:
            continue
        exact = [c for c in left if c.label == key]
        near = [c for c in left if _matches(c.label, key, wanted.channels)]
        if len(exact) > 1:
            got = ", ".join(f"'{c}'" for c in exact)
            raise ValueError(f"{where}: expected one column for {key}, got {got}")
        if exact or len(near) == 1:  # the caller has to choose among several aliases
            take(key, (exact or near)[0])
    for column in left:
        name = column.label
        found[name if name not in found else f"{name}_{columns.index(column) + 1}"] = column
    return found


def _rows(
    where: str, columns: Sequence[Column], needed: Mapping[str, Column], wanted: Wanted
) -> NDArray[np.bool_]:
    """Return the mask of used rows: all, or new rows with numbers in all needed channels."""
    taken = np.ones(max((c.values.size for c in columns), default=0), dtype=np.bool_)
    if wanted.missing == "refuse":
        return taken
    if "t" in needed and taken.size:
        alike = [c.values[1:] == c.values[:-1] for c in needed.values()]
        taken[1:] &= ~np.logical_and.reduce(alike)
    holed = [c for c in needed.values() if c.gaps]
    for column in holed:
        taken &= np.isfinite(column.values)
    if not taken.any():
        names = ", ".join(f"'{c}'" for c in holed)
        raise ValueError(f"{where}: expected a row with numbers in {names}, got none")
    return taken


def _units(where: str, named: Mapping[str, Column], wanted: Wanted) -> dict[str, str]:
    """Return the units given by the caller, by channel."""
    if isinstance(wanted.units, str):
        given = by_channel(f"{where}: units", wanted.units, wanted.channels)
        for key, text in given.items():
            own = named[key].unit if key in named else ""
            if own and unit(own) != unit(text) and text in wanted.units:
                raise ValueError(
                    f"{where}: column '{named[key]}': expected its unit once, got '{own}' in "
                    f"the file and '{text}' in the call; units={{'{key}': '{text}'}} overrides the "
                    "file"
                )
        return {key: text for key, text in given.items() if key in named and not named[key].unit}
    given = checks.named(f"{where}: units", wanted.units)
    known = {**{c.label: key for key, c in named.items()}, **{key: key for key in named}}
    checks.check_names(f"{where}: units", given, known)
    return {known[key]: checks.text(f"{where}: units: {key}", u) for key, u in given.items()}


def _scale(key: str, column: Column, given: str, wanted: Wanted) -> tuple[float, str]:
    """Return the factor to SI units and the SI unit of a column."""
    text = given or column.unit or wanted.assumed.get(key, "")
    if key == "t" and not text and wanted.units is not None:
        text = "s"
    meant = unit(text) if text else None
    if meant is None and wanted.drive is not None:
        meant = parsed(text)  # counts, whose size is that of the encoder
    channel = wanted.channels.get(key) if not wanted.points or key in ("v", "F", "N") else None
    if channel and (meant is None or meant.si not in channel.units):
        such = f"a unit of {channel.examples}"
        raise ValueError(f"column '{column}': expected {such}, got {text or 'none'}")
    return (1.0, text) if meant is None else (meant.factor, meant.si)


def _time(
    where: str, columns: Sequence[Column], signals: Mapping[str, Array], wanted: Wanted,
    rows: NDArray[np.bool_], have: str,
) -> Array:  # fmt: skip
    if wanted.step is not None:
        if "t" in signals:
            raise ValueError(
                f"{where}: expected step= only without a time, got also a column of times; "
                "name it '-' in columns"
            )
        step = checks.number(f"{where}: step", wanted.step, unit="s", above=0.0)
        return step * np.flatnonzero(rows).astype(np.float64)
    if "t" not in signals:
        timed = [c.label for c in columns if c.unit and getattr(unit(c.unit), "si", "") == "s"]
        name = timed[0] if len(timed) == 1 else "..."
        raise ValueError(
            f"{where}: expected a column of time 't [s]', got {have}; name it with "
            f"columns={{'t': '{name}'}} (--column t={name}), pass step= [s] (--step) for equally "
            "spaced samples, or points=True"
        )
    return signals["t"]
