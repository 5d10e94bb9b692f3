"""Result of many runs: signals of all members, varied arguments, and the end of each run."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation import checks
from symfric.foundation.files import write_table
from symfric.foundation.numeric import Array
from symfric.foundation.shown import Showing, Shown, TextTable, among, counted, spaced, valued
from symfric.foundation.status import Status
from symfric.foundation.storable import agree
from symfric.results.stored import Format, module

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PLACES = ("end", "least", "greatest")
MOST = 5_000_000
"""Largest number of values that `shown` reads; all count in a memory-mapped file, because the last
column is on all pages."""


@final
@dataclass(frozen=True, eq=False, repr=False)
class Ensemble(Showing):
    """Results of many runs.

    `study["x"]` is a signal of all members, `study.varied["mu_s"]` a parameter of all members, and
    `study.extremes["v"]` the range of a signal.

    Attributes:
        scene: name of the model.
        t: times [s], shape (k,); or the ends of the members, shape (members, 1), if they differ and
            no other times were requested.
        signals: values by name, shape (members, k); NaN after a member ended, failed or met a
            terminal event, and for members that were not started. Memory-mapped if the results
            were written to a folder.
        units: unit of every signal by name; `unit(name)` also accepts varied quantities.
        attempts: number of attempts of each member, shape (members,).
        reached: time [s] that each member reached, shape (members,): that of a terminal event or of
            a failure, else the end; NaN for members that were not started.
        failed: message of each failed member by its number.
        status: SUCCESS; or INTERRUPTED, with results of the finished members only.
        varied: arguments that differ between members, shape (members,): parameters by name, start
            values as "x0.v", inputs as "u.force", ends as "t_end". Samples of inputs are not kept.
        fixed: arguments that are equal for all members, with names as in `varied`.
        given_units: units of `varied` and `fixed` by name.
        reach: smallest and largest value of each state over the start and the ends of all accepted
            steps, shape (2, members); NaN for members that were not started.
        doubtful: message about a doubt for members that ended without failure, by number.
    """

    scene: str
    t: Array
    signals: Mapping[str, Array]
    units: dict[str, str]
    attempts: NDArray[np.int64]
    reached: Array
    failed: dict[int, str]
    status: Status
    varied: dict[str, Array] = field(default_factory=dict[str, Array])
    fixed: dict[str, float] = field(default_factory=dict[str, float])
    given_units: dict[str, str] = field(default_factory=dict[str, str])
    reach: dict[str, Array] = field(default_factory=dict[str, Array])
    doubtful: dict[int, str] = field(default_factory=dict[int, str])

    def check_fields(self) -> None:
        """Check the shapes of all arrays and the names; used when a file is read."""
        n, k = self.attempts.size, self.t.shape[-1]
        agree(
            "Ensemble",
            self.t.shape in ((k,), (n, k)),
            all(values.shape == (n, k) for values in self.signals.values()),
            self.signals.keys() == self.units.keys(),
            all(v.shape == (n,) for v in (self.attempts, self.reached, *self.varied.values())),
            {*self.varied, *self.fixed} <= self.given_units.keys() | self.units.keys(),
            all(ends.shape == (2, n) for ends in self.reach.values()),
        )

    def shown(self) -> Shown:
        """Return the members, failures, varied arguments, and signals at the last time."""
        members, times = self.attempts.size, self.t.shape[-1]
        first, last = np.min(self.t), np.max(self.t)
        span = f"{last:g} s"
        if times > 1:
            span = f"{counted(times, 'time')} from {first:g} to {last:g} s"
        done = int(np.isfinite(self.reached).sum())
        left = f", {members - done} members not started" if done < members else ""
        lines = [f"{self.status.name}: {counted(self.attempts.sum(), 'attempt')} in all{left}"]
        if self.varied:
            ranges = (f"{name} from {x.min():.6g} to {x.max():.6g}{spaced(self.unit(name))}"
                      for name, x in self.varied.items())  # fmt: skip
            lines.append(f"varied: {', '.join(ranges)}")
        if self.fixed:
            known = ((n, v, self.unit(n)) for n, v in self.fixed.items())
            lines.append(f"fixed: {valued(known)}")
        for number, why in list(self.failed.items())[:3]:
            lines.append(f"member {number} failed: {why}")
        if self.doubtful:
            number, why = next(iter(self.doubtful.items()))
            lines.append(f"doubtful: {len(self.doubtful)}, the first is {number}: {why}")
        if len(self.failed) > 3:
            lines.append(f"failed: {len(self.failed)}, members {among(map(str, self.failed))}")
        mapped = any(isinstance(values, np.memmap) for values in self.signals.values())
        read = (members * times if mapped else members) <= MOST
        rows = [(name, unit, *self._ends(name, read)) for name, unit in self.units.items()]
        header = ("signal", "unit", "least", "median", "greatest")
        return Shown(
            f"ensemble of '{self.scene}': {counted(members, 'member')} at {span}",
            tuple(lines),
            TextTable(header, tuple(rows), numbers=(2, 3, 4)),
            ("over the members, at the last time",) if read else (),
        )

    def _ends(self, name: str, read: bool) -> Iterable[str]:
        """Return least, median and greatest value at the last time; empty unless `read`."""
        values = np.asarray(self.signals[name][:, -1]) if read else np.zeros(0)
        values = values[np.isfinite(values)]
        if not values.size:
            return "", "", ""
        return (f"{x:.6g}" for x in (values.min(), np.median(values), values.max()))

    def thumbnail(self) -> "Figure | None":
        """Return a small plot of the first signal; None if there is only one time per member."""
        from symfric.results.pictures import thumbnail_of_many  # noqa: PLC0415  (slow to import)

        if self.t.ndim > 1 or self.t.size < 2:
            return None
        name, values = next(iter(self.signals.items()))
        return thumbnail_of_many(self.t, values, f"{name} [{self.units[name]}]")

    def __getitem__(self, name: str) -> Array:
        if name in self.varied:
            return self.varied[name]
        checks.check_names(f"ensemble of '{self.scene}'", [name], [*self.signals, *self.varied])
        return self.signals[name]

    def __len__(self) -> int:
        return self.attempts.size

    def unit(self, name: str) -> str:
        """Return the unit of a signal or of an argument."""
        known = self.units | self.given_units
        checks.check_names(f"ensemble of '{self.scene}'", [name], known)
        return known[name]

    @property
    def finished(self) -> NDArray[np.bool_]:
        """True for members that ran to their end or to a terminal event, shape (members,)."""
        found = np.isfinite(self.reached)
        found[list(self.failed)] = False
        return found

    @property
    def ends(self) -> dict[str, Array]:
        """Values at the last time by name, shape (members,)."""
        return {name: np.array(values[:, -1]) for name, values in self.signals.items()}

    @cached_property
    def extremes(self) -> dict[str, tuple[Array, Array]]:
        """Smallest and largest value of each member by name, each of shape (members,).

        For states, they are taken over all accepted steps and `t`. For other signals, they are
        taken over `t` only and may miss short events; request more times by `t_eval`, or simulate
        such a member alone. Members without a value have NaN.
        """
        found: dict[str, tuple[Array, Array]] = {}
        for name, values in self.signals.items():
            least, most = np.fmin.reduce(values, axis=1), np.fmax.reduce(values, axis=1)
            low, high = self.reach.get(name, (least, most))
            found[name] = np.fmin(least, low), np.fmax(most, high)
        return found

    def plot(
        self, *names: str, over: str = "", at: float | str = "end", path: str | Path | None = None
    ) -> "Figure":
        """Plot the median and the bands of 50 and 90 % of the members over time.

        If there is only one time per member, plot histograms.

        Args:
            names: signals; by default the first six.
            over: varied quantity on the abscissa, with a point for each member, as in
                `study.plot("v", over="mu_s", at="greatest")`.
            at: with `over`, a time [s], rounded to the nearest time of the result; or "end",
                "least" or "greatest" (see `extremes`).
            path: image file; its suffix selects the format.

        Raises:
            ValueError: a name is unknown.
        """
        from symfric.results import pictures  # noqa: PLC0415  (slow to import)

        if not over:
            return pictures.plot_many(self.scene, self.t, self.signals, self.units, names, path)
        where = f"ensemble of '{self.scene}': plot"
        checks.check_names(f"{where}: over", [over], self.varied)
        shown = self._chosen(names)[: None if names else pictures.SHOWN]
        when, values = self._at(f"{where}: at", shown, at)
        signals = {name: (self.units[name], values[name]) for name in shown}
        others = {n: (self.unit(n), v) for n, v in self.varied.items() if n != over}
        return pictures.plot_over(
            self.scene, when, signals, (over, self.unit(over), self.varied[over]), others, path
        )

    def _at(
        self, where: str, names: Sequence[str], at: float | str
    ) -> tuple[str, dict[str, Array]]:
        """Return `at` in words, and the values by name, shape (members,)."""
        if isinstance(at, str):
            checks.choice(where, at, PLACES)
            if at == "end":
                when = "at the end" if self.t.ndim > 1 else f"at t = {self.t[-1]:.4g} s"
                return when, {name: self.signals[name][:, -1] for name in names}
            which = PLACES.index(at) - 1
            return f"{at} of each run", {name: self.extremes[name][which] for name in names}
        if self.t.ndim > 1:
            raise checks.refused(where, "'end', where each member has its own", at)
        first, last = float(self.t[0]), float(self.t[-1])
        time = checks.number(where, at, unit="s", lower=first, upper=last)
        k = int(np.abs(self.t - time).argmin())
        return f"at t = {self.t[k]:.4g} s", {name: self.signals[name][:, k] for name in names}

    def save(self, path: str | Path) -> None:
        """Write the ensemble to one file, from which `symfric.load_ensemble` restores it exactly.

        The file of an interrupted ensemble contains the finished members. For results that exceed
        the memory, use `simulate_many(..., out=)` to write them to a folder.

        Raises:
            ValueError: the file cannot be written.
        """
        ENSEMBLE.save(path, self)

    def to_csv(self, path: str | Path, *names: str) -> None:
        """Write a CSV file with a row for each member and time.

        The columns are member, t, varied quantities and signals, with units in the header.

        Args:
            path: CSV file.
            names: signals; by default all.
        """
        columns = self._columns(names)
        header = ["member", *(f"{name} [{unit}]" for name, unit in self._units(columns).items())]
        rows = ([m, *row] for m in range(len(self))
                for row in np.column_stack([v[m] for v in columns.values()]).tolist())  # fmt: skip
        write_table(path, header, rows)

    def to_dataframe(self, *names: str) -> Any:
        """Return a pandas DataFrame with a row for each member and time.

        The columns are varied quantities and signals; the attribute `attrs` contains the units. If
        there is only one time per member, there is one row for each member.

        Args:
            names: signals; by default all.

        Raises:
            ImportError: pandas is not installed.
        """
        pandas = module("to_dataframe", "pandas")
        columns = self._columns(names)
        flat = {name: values.ravel() for name, values in columns.items()}
        members = np.arange(len(self))
        index = pandas.Index(members, name="member")
        if self.t.shape[-1] > 1:
            index = pandas.MultiIndex.from_product([members, self.t], names=["member", "t"])
        if self.t.ndim == 1:
            del flat["t"]
        frame = pandas.DataFrame(flat, index=index)
        frame.attrs.update(self._about | {"units": self._units(columns)})
        return frame

    def to_xarray(self, *names: str) -> Any:
        """Return an xarray Dataset over member and t, with varied quantities as coordinates.

        Raises:
            ImportError: xarray is not installed.
        """
        xarray = module("to_xarray", "xarray")
        over_t, unit = self.t.ndim == 1, {"units": "s"}
        coordinates: dict[str, Any] = {"member": np.arange(len(self))}
        coordinates["t"] = ("t", self.t, unit) if over_t else ("member", self.t[:, 0], unit)
        for name, values in self.varied.items():
            coordinates[name] = ("member", values, {"units": self.unit(name)})
        arrays: dict[str, Any] = {}
        for name in self._chosen(names):
            values, its_unit = self.signals[name], {"units": self.units[name]}
            both = (("member", "t"), values, its_unit)
            arrays[name] = both if over_t else ("member", values[:, 0], its_unit)
        return xarray.Dataset(arrays, coords=coordinates, attrs=self._about)

    def _chosen(self, names: Sequence[str]) -> list[str]:
        """Return the given names of signals; by default all."""
        checks.check_names(f"ensemble of '{self.scene}'", names, self.signals)
        return list(names) or list(self.signals)

    def _columns(self, names: Sequence[str]) -> dict[str, Array]:
        """Return times, varied quantities and signals by name, broadcast to (members, times)."""
        wanted, shape = self._chosen(names), (len(self), self.t.shape[-1])
        found = {"t": np.broadcast_to(self.t, shape)}
        found |= {n: np.broadcast_to(v[:, None], shape) for n, v in self.varied.items()}
        return found | {name: self.signals[name] for name in wanted}

    def _units(self, names: Iterable[str]) -> dict[str, str]:
        return {name: "s" if name == "t" else self.unit(name) for name in names}

    @property
    def _about(self) -> dict[str, Any]:
        """Scene, status and fixed arguments."""
        return {"scene": self.scene, "status": self.status.name, **self.fixed}


ENSEMBLE = Format("symfric ensemble", 2, "load_ensemble", "a saved ensemble", Ensemble)


def load_ensemble(path: str | Path) -> Ensemble:
    """Return the ensemble that `study.save(path)` wrote, restored exactly.

    Raises:
        ValueError: the file does not exist, is not a saved ensemble, is damaged, or was written by
            a newer version.
    """
    return ENSEMBLE.load(path)
