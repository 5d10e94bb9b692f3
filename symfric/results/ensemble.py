"""The result of many runs: signals of all members, what was varied, and what became of each."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation import checks
from symfric.foundation.files import write_table
from symfric.foundation.shown import Showing, Shown
from symfric.foundation.status import Status
from symfric.foundation.typed import agree
from symfric.results import tables_many
from symfric.results.stored import Format

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False, repr=False)
class Ensemble(Showing):
    """Results of many runs.

    `study["x"]` is a signal of all members, `study.varied["mu_s"]` what each was given,
    `study.extremes["v"]` how far each went.

    Attributes:
        scene: name of the model.
        t: times [s], shape (k,); (members, 1) where each member has its own end and nothing else
            was asked for.
        signals: name -> values, shape (members, k); NaN after a member ended, failed or met a
            terminal event, and for members that were not reached. Memory-mapped where the results
            went to a folder.
        units: name -> unit of every signal; `unit(name)` tells that of what was varied, too.
        attempts: attempts of each member, shape (members,).
        reached: time [s] each member reached, shape (members,): that of a terminal event or of
            its failure, else its end; NaN for members that were not started.
        failed: number of a failed member -> sentence.
        status: SUCCESS, or INTERRUPTED with the members that were finished.
        varied: what members were given arrays of, shape (members,): parameters by name, start
            values as "x0.v", inputs as "u.force", ends as "t_end". Samples of inputs are not kept.
        fixed: numbers that all were given, likewise.
        given_units: name -> unit of `varied` and `fixed`.
        reach: state -> its least and greatest value over the start and the ends of all accepted
            steps, shape (2, members); NaN for members that were not started.
        doubtful: number of a member that ended well -> sentence on what is doubtful of it.
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
        """Refuse arrays that are not those of the same members; for files."""
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
        """Members, failures, what was varied, and where signals end."""
        from symfric.results.shown_many import shown  # noqa: PLC0415  (only who looks needs it)

        return shown(self)

    def thumbnail(self) -> "Figure | None":
        """The first signal of members, small."""
        from symfric.results.shown_many import picture  # noqa: PLC0415  (only who looks needs it)

        return picture(self)

    def __getitem__(self, name: str) -> Array:
        if name in self.varied:
            return self.varied[name]
        checks.check_names(f"ensemble of '{self.scene}'", [name], [*self.signals, *self.varied])
        return self.signals[name]

    def __len__(self) -> int:
        return self.attempts.size

    def unit(self, name: str) -> str:
        """The unit of a signal or of what was given."""
        known = self.units | self.given_units
        checks.check_names(f"ensemble of '{self.scene}'", [name], known)
        return known[name]

    @property
    def finished(self) -> NDArray[np.bool_]:
        """Which members ran to their end or to a terminal event, shape (members,)."""
        found = np.isfinite(self.reached)
        found[list(self.failed)] = False
        return found

    @property
    def ends(self) -> dict[str, Array]:
        """Name -> value at the last time, shape (members,)."""
        return {name: np.array(values[:, -1]) for name, values in self.signals.items()}

    @cached_property
    def extremes(self) -> dict[str, tuple[Array, Array]]:
        """Name -> least and greatest value of each member, shape (members,) both.

        Those of states are over all accepted steps, however short, and over `t`. Those of other
        signals are over `t` alone, where short events get lost: ask for more times by `t_eval`, or
        simulate such a member alone. NaN of members without a value.
        """
        return {name: self._extreme(name) for name in self.signals}

    def _extreme(self, name: str) -> tuple[Array, Array]:
        values = self.signals[name]
        least, most = np.fmin.reduce(values, axis=1), np.fmax.reduce(values, axis=1)
        if name in self.reach:
            least, most = np.fmin(least, self.reach[name][0]), np.fmax(most, self.reach[name][1])
        return least, most

    def plot(
        self, *names: str, over: str = "", at: float | str = "end", path: str | Path | None = None
    ) -> "Figure":
        """Median and bands of 50 and 90 % of the members over time; histograms of ends alone.

        Args:
            names: signals to show; the first six if none is given.
            over: what was varied, to show the signals over it, a point for each member, as in
                `study.plot("v", over="mu_s", at="greatest")`.
            at: where, then: a time of the result [s], the nearest is taken; "end", "least" or
                "greatest" (see `extremes`).
            path: image file, its format taken from the ending.

        Raises:
            ValueError: unknown names.
        """
        if over:
            from symfric.results.over import plot_over  # noqa: PLC0415  (matplotlib is slow to import)

            return plot_over(self, names, over, at, path)
        from symfric.results.bands import plot_many  # noqa: PLC0415  (matplotlib is slow to import)

        return plot_many(self.scene, self.t, self.signals, self.units, names, path)

    def save(self, path: str | Path) -> None:
        """Write everything to one file, which `symfric.load_ensemble` reads to the bit.

        An interrupted ensemble has its finished members there. What is too large for memory is
        better left in the folder of `simulate_many(..., out=)`.

        Raises:
            ValueError: the file cannot be written.
        """
        ENSEMBLE.save(path, self)

    def to_csv(self, path: str | Path, *names: str) -> None:
        """Write a row for each member and time: member, t, what was varied, signals, with units.

        Args:
            path: file.
            names: signals; all if none is given.
        """
        columns = tables_many.columns(self, names)
        header = ["member"]
        header += [f"{name} [{unit}]" for name, unit in tables_many.units(self, columns).items()]
        members = enumerate(tables_many.by_member(self, columns))
        write_table(path, header, ([m, *row] for m, rows in members for row in rows.tolist()))

    def to_dataframe(self, *names: str) -> Any:
        """A row for each member and time, as a pandas table with what was varied as columns.

        Where only ends are known, a row for each member. Units stand in its `attrs`.

        Args:
            names: signals; all if none is given.

        Raises:
            ImportError: no pandas.
        """
        return tables_many.dataframe(self, names)

    def to_xarray(self, *names: str) -> Any:
        """Signals over member and t as an xarray data set, with what was varied as coordinates.

        Raises:
            ImportError: no xarray.
        """
        return tables_many.dataset(self, names)


ENSEMBLE = Format("symfric ensemble", 2, "load_ensemble", "a saved ensemble", Ensemble)


def load_ensemble(path: str | Path) -> Ensemble:
    """The ensemble that `study.save(path)` wrote, to the bit.

    Raises:
        ValueError: no such file, one that something else wrote, a damaged one, or one of a newer
            version.
    """
    return ENSEMBLE.load(path)
