"""The result of a simulation: named signals over time that plot and write themselves."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from symfric.foundation import checks, packed
from symfric.foundation.files import write_table, write_text
from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import check_names
from symfric.foundation.shown import Showing, Shown
from symfric.foundation.status import Status
from symfric.foundation.symbols import strays
from symfric.model import Model
from symfric.results import tables
from symfric.results.derivatives import Derivatives
from symfric.results.energy import EnergyBalance, energy_balance
from symfric.results.extremes import extremes, looks
from symfric.results.quadrature import Quadrature
from symfric.results.shown import shown
from symfric.results.statistics import Statistics

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]


class Kept(Protocol):
    """A run as data, see `symfric.integrator.stored`."""

    def unpacked(self) -> "Trajectory":
        """The run again."""
        ...

    def save(self, path: str | Path) -> None:
        """Write it to a file."""
        ...


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(Showing, Derivatives, Quadrature):
    """Named signals of a simulated model.

    `trajectory["v"]` is a signal at the times `trajectory.t`; `trajectory.at(times)` evaluates
    all signals anywhere in the span by the dense output of the method. Signals are evaluated when
    they are first asked for. Further results, named in `details`, are not even written before:
    `trajectory["hinge_Fx"]` gives a reaction, and plots and CSV files take such names, too.

    Attributes:
        scene: name of the model.
        t: times of the result [s], shape (n,).
        units: name -> unit of every signal.
        status: how it ended; `message` says it in a sentence.
        count: makes `statistics`: steps, evaluations, times.
        span: first time and the last one reached [s].
        ends: makes `step_times`.
        states: the states alone, at any times; cheaper than all signals.
        evaluate: all signals at any times.
        express: an expression of the model at any times, shape (rows, n).
        model: the model that was simulated.
        happened: (time [s], name) of every event.
        differentiate: derivatives of all signals at any times, where they were asked for.
        delays: derivatives of the times of `happened`, likewise.
        pull_back: gradient of a weighted sum of signals at `t`, likewise.
        keep: what a file and a pickle hold of it.
    """

    hidden = Showing.hidden | {
        "count", "delays", "ends", "evaluate", "express", "keep", "pull_back", "states",
    }  # fmt: skip

    scene: str
    t: Array
    units: dict[str, str]
    status: Status
    message: str
    count: Callable[[], Statistics]
    span: tuple[float, float]
    ends: Callable[[], Array]
    states: Callable[[Array], dict[str, Array]]
    evaluate: Callable[[Array], dict[str, Array]]
    express: Callable[[ca.SX, Array], Array]
    model: Model
    happened: tuple[tuple[float, str], ...] = ()
    differentiate: Callable[[Array], dict[str, dict[str, Array]]] | None = None
    pull_back: Callable[[Mapping[str, Array]], dict[str, float]] | None = None
    delays: Callable[[], dict[str, Array]] | None = None
    keep: "Callable[[Trajectory], Kept] | None" = None

    def shown(self) -> Shown:
        """How it ended, and every signal with its extremes."""
        return shown(self)

    def thumbnail(self) -> "Figure":
        """Some signals, small."""
        from symfric.results.thumbnail import picture  # noqa: PLC0415  (matplotlib is slow to import)

        return picture(self)

    @property
    def doubts(self) -> str:
        """What its tolerances do not vouch for, in sentences; "" where nothing is known."""
        return self.message.removeprefix(self.status.value).strip() if self.status.ok else ""

    @cached_property
    def statistics(self) -> Statistics:
        """Steps, evaluations, times."""
        return self.count()

    @property
    def step_times(self) -> Array:
        """Ends of the accepted steps [s], shape (steps + 1,); `at(step_times)` has the signals.

        A run whose steps would take much memory has not kept them, and is run again for them, as it
        is for values between the times `t`.
        """
        return self._ends

    @cached_property
    def _ends(self) -> Array:
        return self.ends()

    @cached_property
    def signals(self) -> dict[str, Array]:
        """Name -> values at `t`, shape (n,): states, algebraic variables, inputs, outputs."""
        return self.evaluate(self.t)

    @cached_property
    def looks(self) -> Array:
        """Times [s] that show every accepted step, however short, and `t`, shape (k,)."""
        jumps = np.array([time for time, _ in self.happened], dtype=float)
        return looks(self.t, self.step_times, jumps)

    @cached_property
    def _looked(self) -> dict[str, Array]:
        return self.evaluate(self.looks)

    def at_looks(self, name: str) -> Array:
        """A signal or detail at `looks`: what pictures show."""
        self.check([name])
        if name in self._looked:
            return self._looked[name]
        return self.of(self.model.expression(name), self.looks)

    @cached_property
    def extremes(self) -> dict[str, tuple[float, float]]:
        """Name -> least and greatest value of a signal over all accepted steps."""
        found = extremes(self.looks, self._looked, self.evaluate)
        return {name: (float(low), float(high)) for name, (low, high) in found.items()}

    @cached_property
    def _own_states(self) -> dict[str, Array]:
        return self.states(self.t)

    def __getitem__(self, name: str) -> Array:
        if name == "t":
            return self.t
        if not isinstance(name, str) or name not in self.units:  # pyright: ignore[reportUnnecessaryIsInstance]
            self.check([name])
            return self._further[name]
        states = self._own_states
        return states[name] if name in states else self.signals[name]

    @cached_property
    def _further(self) -> dict[str, Array]:
        """All details at `t`; one by one they would cost almost as much each."""
        column = ca.vertcat(*(o.expression for o in self.model.further.values()), 0)
        return dict(zip(self.model.further, self.of(column), strict=False))

    @cached_property
    def details(self) -> dict[str, str]:
        """Name -> unit of the further results of the model, such as reactions."""
        return {name: output.unit for name, output in self.model.further.items()}

    def unit(self, name: str) -> str:
        """The unit of a signal or detail."""
        return self.units[name] if name in self.units else self.details[name]

    def check(self, names: Iterable[str]) -> None:
        """Refuse what is neither a signal nor a detail.

        Raises:
            ValueError: unknown names, with the nearest known one.
        """
        where = f"trajectory of '{self.scene}'"
        names = [checks.text(where, name, "the name of a signal") for name in names]
        known = self.units if all(n in self.units for n in names) else self.units | self.details
        check_names(f"trajectory of '{self.scene}'", names, known)

    def of(self, expression: Scalar, times: ArrayLike | None = None) -> Array:
        """Values of an expression in the symbols of the model: t, x, z, u, p.

        Args:
            expression: SX of one element, or a column (rows, 1).
            times: where [s], shape (n,); `t` if not given.

        Returns:
            Shape (n,), or (rows, n) for a column.

        Raises:
            ValueError: a symbol that is none of the model's, a time outside the span.
        """
        where = f"trajectory of '{self.scene}': of"
        column, model = ca.SX(checks.expression(where, expression)), self.model
        known = ca.vertcat(model.t, *(model.vector(letter) for letter in "xzup"))
        stray = strays(column, known)
        if stray:
            raise ValueError(
                f"trajectory of '{self.scene}': expected an expression in the symbols of its "
                f"model, got {', '.join(stray)}"
            )
        values = self.express(ca.vec(column), self.t if times is None else self._inside(times))
        return values[0] if column.is_scalar() else values

    def energy_balance(self) -> EnergyBalance:
        """Where the energy of a mechanism went, and what the books do not explain.

        Raises:
            ValueError: a model that does not keep books of its energy.
        """
        return energy_balance(self)

    def at(self, times: ArrayLike) -> dict[str, Array]:
        """All signals at `times` [s] inside the simulated span, by dense output.

        Raises:
            ValueError: a time outside the span.
        """
        return self.evaluate(self._inside(times))

    def _inside(self, times: ArrayLike) -> Array:
        where = f"trajectory of '{self.scene}': times"
        at = np.atleast_1d(checks.array(where, times, ndim=None, what="times [s]"))
        if at.ndim > 1:
            raise checks.refused(where, "a time or a sequence of times [s]", times)
        first, last = self.span
        if at.size and not (first <= at.min() and at.max() <= last):
            raise ValueError(
                f"trajectory of '{self.scene}': expected times in [{first:g}, {last:g}] s, "
                f"got {at.min():g} ... {at.max():g} s"
            )
        return at

    @cached_property
    def final(self) -> dict[str, float]:
        """All signals at the last time reached."""
        return {k: float(v[0]) for k, v in self.evaluate(np.array(self.span[1:])).items()}

    def plot(
        self,
        *names: str,
        path: str | Path | None = None,
        label: str = "",
        panels: str = "main",
        log: Sequence[str] = (),
    ) -> "Figure":
        """Signals over time with units; saved to `path` if given.

        A notebook shows the figure that a cell returns; elsewhere `.show()` opens it in a window.

        Args:
            names: signals or details to show, a panel each.
            path: image file, its format taken from the ending.
            label: legend entry of this trajectory.
            panels: without names, "main" for positions, friction and energy or power, "all" for
                every signal, those of a kind together where they are many.
            log: signals on logarithmic axes, as `plot("v", "x", log=["v"])`.
        """
        from symfric.results.pictures import plot_trajectories  # noqa: PLC0415  (matplotlib is slow to import)

        return plot_trajectories({label or self.scene: self}, names, path, panels, log)

    def animate(
        self,
        path: str | Path,
        *,
        fps: float = 20.0,
        speed: float | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> None:
        """Write a moving picture of a machine: GIF, HTML with the pictures inside, or MP4.

        Planar machines are seen along the normal of their plane. Joints with friction are filled
        while all their contacts move slower than the velocity scale of their law, hollow while one
        slides.

        Args:
            path: file ending in .gif, .html or .mp4 (needs the program ffmpeg).
            fps: pictures per second.
            speed: of the motion relative to real time; what lasts between 2 and 12 s is shown as
                fast as it is, anything else in 6 s.
            progress: called with the fraction done.

        Raises:
            ValueError: a model without bodies, another ending, no ffmpeg, numbers not above zero.
        """
        from symfric.results.animation import animate  # noqa: PLC0415  (matplotlib is slow to import)

        animate(self, path, fps=fps, speed=speed, progress=progress)

    def save(self, path: str | Path) -> None:
        """Write the whole run to one file, which `symfric.load_run` reads to the bit.

        It holds the model, the signals at `t` and all accepted steps, those of a long run found by
        another one. A loaded run does all that this one does: times in between, extremes, further
        results, pictures, films, energy, derivatives that were asked for, another simulation of its
        `model`. Functions are no data: inputs by functions are kept as expressions.

        Raises:
            ValueError: the file cannot be written, or a model holds what no file does.
        """
        self.packed_as().save(path)

    def packed_as(self) -> "Kept":
        """The run as data."""
        if self.keep is None:
            raise ValueError(f"trajectory of '{self.scene}': expected one of simulate, got another")
        return self.keep(self)

    def __copy__(self) -> "Trajectory":
        """One with the same symbols."""
        return packed.shallow(self)

    def __reduce__(self) -> tuple[Any, ...]:
        """A pickle holds what a file does."""
        return packed.loads, (packed.dumps(self),)

    def to_csv(self, path: str | Path, *names: str) -> None:
        """Write signals as columns with units in the header, such as `v [m/s]`.

        Args:
            path: file.
            names: signals or details; all signals if none is given.
        """
        columns = tables.columns(self, names)
        header = ["t [s]", *(f"{name} [{self.unit(name)}]" for name in columns)]
        write_table(path, header, np.column_stack([self.t, *columns.values()]).tolist())

    def to_dataframe(self, *names: str) -> Any:
        """Signals or details, all signals if none is given, as a pandas table over t.

        Raises:
            ImportError: no pandas.
        """
        return tables.dataframe(self, names)

    def to_xarray(self, *names: str) -> Any:
        """The same as an xarray data set, with units as attributes.

        Raises:
            ImportError: no xarray.
        """
        return tables.dataset(self, names)

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain data: scene, status, statistics, units, times and signals."""
        return {
            "scene": self.scene,
            "status": self.status.name,
            "message": self.message,
            "statistics": self.statistics.to_dict(),
            "units": {"t": "s", **self.units},
            "t": self.t.tolist(),
            "signals": {name: values.tolist() for name, values in self.signals.items()},
        }

    def to_json(self, path: str | Path) -> None:
        """Write `to_dict` as JSON."""
        write_text(path, json.dumps(self.to_dict()))
