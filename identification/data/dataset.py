"""Class `Dataset`: measured data of one or several records of named signals, in SI units."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, final

import numpy as np

from identification.data.check import check
from identification.data.findings import Findings
from identification.data.merge import merged
from identification.data.raw import Missing, Wanted, record
from identification.data.reading import ASSUMED, Paths, columns_of, files, read_records, to_csv
from identification.data.record import Record, first_of
from identification.data.resample import delayed, resampled, scaled, unwrapped, without_spikes
from symfric.drives.drive import Drive
from symfric.foundation import checks


@final
@dataclass(frozen=True, eq=False)
class Dataset:
    """Records that are fitted together.

    Attributes:
        records: at least one record.
        name: common name for messages.

    Raises:
        ValueError: no records, or both rotary and linear ones.
    """

    records: tuple[Record, ...]
    name: str = ""

    def __post_init__(self) -> None:
        records = checks.many("Dataset: records", self.records, "records")
        for one in records:
            such = "a record, such as Dataset.of(t=t, x=x)[0]"
            checks.kind("Dataset: records", one, Record, such)
        if not records:
            raise ValueError("Dataset: expected at least one record, got none")
        object.__setattr__(self, "records", records)
        object.__setattr__(self, "name", self.name or first_of([r.name for r in records]))
        names = {_turns(r): r.name for r in reversed(records)}
        if {True, False} <= names.keys():
            raise ValueError(
                f"data '{self.name}': expected records that all slide or all turn, got "
                f"'{names[False]}' in m and '{names[True]}' in rad"
            )

    @classmethod
    def read(
        cls,
        paths: Paths,
        *,
        columns: Mapping[str, str] | Sequence[str] | None = None,
        units: Mapping[str, str] | str | None = None,
        step: float | None = None,
        variable: str | None = None,
        points: bool = False,
        missing: Missing = "refuse",
        drive: Drive | None = None,
    ) -> "Dataset":
        """Read records from files: text, `.mat` up to version 7, `.npz`, `.npy`, HDF5, Parquet.

        Text: comma, semicolon, tab or spaces; decimal commas unless commas separate cells; comment
        lines; rows of a data logger; a header such as `t [s], x [mm], F [N]` or none; a row of
        units below it or none. MATLAB: variables, structs (nested; a vector of structs is several
        records), matrices. HDF5 (groups are structs) needs the package h5py, Parquet needs pyarrow.

        A column becomes the channel t, x, v, a or force if its name is that of the channel or a
        usual alias (time, q, pos, angle, vel, omega, torque, ...) and no other column matches. All
        other columns keep their names. Every canonical channel needs a unit from the file or the
        call; the stored numbers are in SI units. Columns with non-numeric cells are left out, and
        requesting one raises an error with the reason; in a canonical channel they are an error.

        Args:
            paths: a file, a pattern such as "run*.csv", or a list of these.
            columns: channel -> column ({"x": "encoder [mm]"}) or a pattern ({"x": "*pos*"}), or
                the names of all columns in order (["t [ms]", "x", "-", "force"]; "-" leaves a
                column out).
            units: "rad, N m" for canonical channels whose columns have no unit, or channel ->
                unit ({"x": "mm", "theta_2": "deg"}), which overrides the file.
            step: sample interval [s] of files without time.
            variable: struct, matrix or nested part of a `.mat` or `.npz` file: "run(2).log".
            points: rows are points (v, F) of a friction curve; no time is needed.
            missing: "drop" leaves out rows in which a channel has no finite number (an empty cell,
                NaN) and rows that repeat the previous row including its time; `resampled` then
                makes the intervals equal and splits records at long gaps.
            drive: drive whose currents and angles or encoder counts the files contain; the records
                are those of its load, see `identification.data.at_load`.

        Raises:
            ValueError: unusable data, with file, row and column; for several files all errors.
        """
        wanted = Wanted(
            columns, units, step, checks.flag("read: points", points), {}, missing, drive
        )
        found = read_records(paths, wanted, variable)
        pattern = paths if isinstance(paths, str) and len(files(paths)) > 1 else ""
        return cls(found, pattern)

    @classmethod
    def of(
        cls,
        frame: object = None,
        /,
        *,
        units: Mapping[str, str] | str | None = None,
        columns: Mapping[str, str] | None = None,
        step: float | None = None,
        points: bool = False,
        missing: Missing = "refuse",
        drive: Drive | None = None,
        name: str = "data",
        **arrays: object,
    ) -> "Dataset":
        """Return one record from arrays: `Dataset.of(t=t, x=x, force=force)`, a dict or a frame.

        Numbers are in SI units (m, N; with `units="rad, N m"` rotary) unless a name has a unit,
        such as "x [mm]"; the columns of a pandas frame need units, as in a file.

        Args:
            frame: a mapping or a pandas frame with the columns.
            units, columns, step, points, missing, drive: as in `read`.
            name: name of the record.
            arrays: further columns by name.

        Raises:
            ValueError: non-numeric columns or columns of different lengths, no time, no unit.
        """
        checks.text("Dataset.of: name", name)
        raw, framed = columns_of(name, frame, arrays)
        points = checks.flag("Dataset.of: points", points)
        assumed = {} if framed else ASSUMED
        wanted = Wanted(columns, units, step, points, assumed, missing, drive)
        return cls((record(raw, wanted),), name)

    def __iter__(self) -> Iterator[Record]:
        return iter(self.records)

    def __len__(self) -> int:
        return len(self.records)

    def __getitem__(self, index: int) -> Record:
        return self.records[index]

    def __add__(self, other: "Dataset") -> "Dataset":
        """Return the records of both data sets."""
        other = checks.kind("Dataset: +", other, Dataset, "a Dataset")
        return Dataset((*self.records, *other.records), f"{self.name} + {other.name}")

    def __str__(self) -> str:
        return "\n".join([f"{self.name}: {len(self)} record(s)", *map(_line, self.records)])

    @property
    def rotary(self) -> bool:
        """True for a rotary drive, with channels in rad and N m."""
        return any(_turns(one) for one in self.records)

    @property
    def size(self) -> int:
        """Number of samples of all records."""
        return sum(one.size for one in self.records)

    def each(self, change: Callable[[Record], Record]) -> "Dataset":
        """Return the data with a function applied to every record."""
        return Dataset(tuple(map(change, self.records)), self.name)

    def check(self, **roles: str) -> Findings:
        """Check the data and return the findings, each with its location.

        An error makes a physically meaningful fit impossible; a warning means that some numbers are
        not identifiable or less accurate than they appear. Every signal is checked for clipping,
        spikes and frozen intervals. Signals with a part in the drive are compared with each other:
        sign and delay of the force relative to the motion, exchanged columns, standstill, motion in
        one direction, too little excitation, wraps, drift, units.

        Args:
            roles: signals whose names differ from their part: `check(x="theta", force="tau_1")`.

        Limits: a wrong gain of the force, consistently wrong units, or a load that changed between
        records are not detectable from the data alone. Delays up to one sample, or up to a fifth of
        the standard deviation of the window that smooths the position, are not reported.
        """
        return check(self.name, self.records, roles)

    def between(self, begin: float, end: float) -> "Dataset":
        """Return the samples with begin <= t <= end [s]; records without such samples are omitted.

        Raises:
            ValueError: no record has two samples in this interval.
        """
        begin, end = (checks.number("Dataset.between", at, unit="s") for at in (begin, end))
        held = [r for r in self if np.count_nonzero((r.time >= begin) & (r.time <= end)) > 1]
        return Dataset(tuple(r.between(begin, end) for r in held or self.records), self.name)

    def thinned(self, every: int) -> "Dataset":
        """Return every n-th sample of each record, n = `every`, without prior filtering."""
        return self.each(lambda one: one.thinned(every))

    def renamed(self, names: Mapping[str, str]) -> "Dataset":
        """Return the data with renamed signals: {"old": "new"}."""
        return self.each(lambda one: one.renamed(names))

    def without_spikes(self) -> "Dataset":
        """Return the data with spikes replaced by linear interpolation."""
        return self.each(without_spikes)

    def unwrapped(self, periods: Mapping[str, float]) -> "Dataset":
        """Return the data with periodic signals unwrapped: {"x": 6.2832}."""
        return self.each(lambda one: unwrapped(one, periods))

    def scaled(
        self, factors: Mapping[str, float], units: Mapping[str, str] | None = None
    ) -> "Dataset":
        """Return the data with scaled signals: {"force": -1}; `units` gives their new units."""
        return self.each(lambda one: scaled(one, factors, units))

    def split(self, share: float = 0.5) -> "tuple[Dataset, Dataset]":
        """Split each record into the first `share` of its samples and the remaining samples.

        Raises:
            ValueError: a share that leaves fewer than two samples in a part.
        """
        where = f"data '{self.name}': split"
        share = checks.number(where, share, lower=0.0, upper=1.0)
        pairs = [(one, round(share * one.size)) for one in self.records]
        for one, cut in pairs:
            if not 2 <= cut <= one.size - 2:
                raise ValueError(
                    f"{where}: expected a share that leaves two samples on each side, got {share:g}"
                    f" of {one.size}"
                )
        first = Dataset(tuple(one.at(slice(0, cut)) for one, cut in pairs), self.name)
        return first, Dataset(tuple(one.at(slice(cut, None)) for one, cut in pairs), self.name)

    def resampled(
        self, step: float | None = None, gap: Literal["split", "refuse"] = "split"
    ) -> "Dataset":
        """Return the data at equal intervals; a record with gaps is split into several records.

        See `identification.data.resample.resampled`.
        """
        pieces = (p for one in self.records for p in resampled(one, step, gap))
        return Dataset(tuple(pieces), self.name)

    def delayed(self, delays: Mapping[str, float]) -> "Dataset":
        """Return the data with delayed signals [s], new(t) = old(t - delay), with the ends cut."""
        return self.each(lambda one: delayed(one, delays))

    def merged(
        self,
        other: "Dataset",
        on: tuple[str, str],
        shift: float | Literal["estimate"] = "estimate",
        drift: float | Literal["estimate"] = 0.0,
    ) -> "Dataset":
        """Merge the records of two recorders of one experiment, at the times of the first.

        See `identification.data.merge.merged`.

        Args:
            other: data with the same number of records.
            on: names of a quantity that both measured, here and in `other`: ("x", "x").
            shift: offset added to the times of `other` [s].
            drift: relative excess speed of the clock of the first recorder.

        Raises:
            ValueError: different numbers of records, no common time, an undetermined delay,
                or clocks that drift.
        """
        where = f"data '{self.name}': merged"
        other = checks.kind(where, other, Dataset, "a Dataset")
        if len(other) != len(self):
            raise ValueError(f"{where}: expected {len(self)} records, got {len(other)}")
        pairs = zip(self.records, other.records, strict=True)
        return Dataset(tuple(r for a, b in pairs for r in merged(a, b, on, shift, drift)))

    def to_csv(self, path: str | Path) -> tuple[Path, ...]:
        """Write every record as CSV with units in the header; `Dataset.read` reads it back.

        Several records are numbered: `run.csv` becomes `run_1.csv`, `run_2.csv`. Controllers are
        not written.

        Returns:
            The paths of the files.
        """
        target = checks.path(f"data '{self.name}': to_csv", path)
        if len(self) == 1:
            return (to_csv(self.records[0], target),)
        names = (target.with_stem(f"{target.stem}_{k}") for k in range(1, len(self) + 1))
        return tuple(to_csv(one, name) for one, name in zip(self.records, names, strict=True))


def _turns(one: Record) -> bool | None:
    """Return True for a rotary drive; None without a canonical channel."""
    for key, turning in (("x", "rad"), ("v", "rad/s"), ("force", "N m"), ("F", "N m")):
        if key in one.signals and one.units[key]:
            return one.units[key] == turning
    return None


def _line(one: Record) -> str:
    signals = ", ".join(f"{key} [{one.units[key] or '?'}]" for key in one.signals)
    if one.t is None:
        return f"  {one.name}: {one.size} points, {signals}"
    return f"  {one.name}: {one.t[0]:g} ... {one.t[-1]:g} s, {one.size} samples, {signals}"
