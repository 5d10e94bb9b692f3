"""Result of a simulation: named signals over time, with plots, energy balance and files."""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import casadi as ca
import numpy as np

from symfric.foundation import checks, packed
from symfric.foundation.files import write_table, write_text
from symfric.foundation.numeric import Array, Scalar
from symfric.foundation.shown import Showing, Shown, TextTable, among, counted
from symfric.foundation.variable import stacked
from symfric.model.kinds import WORK
from symfric.model.model import friction
from symfric.results.sections import Cycle, crossings, cycle
from symfric.results.signals import Signals, integrals
from symfric.results.stored import module

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@final
@dataclass(frozen=True, eq=False, repr=False)
class EnergyBalance(Showing):
    """Energy of a mechanism and work on its bodies, over the times of a trajectory.

        defect(t) = E(t) - E(0) - W(t),   W the sum of all work

    W is the integral of the powers over the dense output. Error control does not use W; the defect
    therefore measures the error of the simulation. It has the order of the method, 5 (rodas5p,
    radau5), 4 (rodas4p) or 3 (rodas3), and is up to a hundred times larger inside the steps than at
    their ends. It includes the energy removed by the reset of an event.

    Attributes:
        t: times [s], shape (n,).
        energy: kinetic and potential energy [J], without potentials that depend on time or inputs.
        work: work on the bodies [J] by name: of friction (negative), of each force that is not
            conservative, and of prescribed motions.
        defect: E(t) - E(0) - W(t) [J].
        scale: largest kinetic energy, change of potential energy, or work [J].
    """

    t: Array
    energy: Array
    work: dict[str, Array]
    defect: Array
    scale: float

    def shown(self) -> Shown:
        """Return the energy at the start and at the end, the work, and the largest defect."""
        rows = [("energy at the start", f"{self.energy[0]:.6g}")]
        rows += [(f"work of {name}", f"{work[-1]:.6g}") for name, work in self.work.items()]
        rows += [("energy at the end", f"{self.energy[-1]:.6g}")]
        rows += [("unexplained, at most", f"{np.abs(self.defect).max():.3g}")]
        title = f"energy from {self.t[0]:g} to {self.t[-1]:g} s"
        after = f"unexplained over what moved: {self.relative:.2g}"
        return Shown(title, (), TextTable(("", "J"), tuple(rows), numbers=(1,)), (after,))

    @property
    def relative(self) -> float:
        """Largest defect divided by `scale`; 0 if `scale` is at the level of rounding errors."""
        largest = float(np.abs(self.defect).max(initial=0.0))
        moved = self.scale > 1e-16 * float(np.abs(self.energy).max(initial=0.0))
        return largest / self.scale if moved else 0.0

    def to_dict(self) -> dict[str, Any]:
        """Return the energies at start and end, the work, and the largest defect [J]."""
        return {
            "start": float(self.energy[0]),
            "end": float(self.energy[-1]),
            "work": {name: float(work[-1]) for name, work in self.work.items()},
            "defect": float(np.abs(self.defect).max()),
            "relative": self.relative,
        }


CHEAP = 200_000
"""Number of steps times signals up to which `shown` computes extremes over all steps (20 ms)."""


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(packed.Portable, Signals):
    """Named signals of a simulated model.

    `trajectory["v"]` is a signal at the times `trajectory.t`; `trajectory.at(times)` evaluates all
    signals at any time in the span, by the dense output of the method. Signals are evaluated when
    they are first used. `details` lists additional results, such as the reaction
    `trajectory["hinge_Fx"]`; plots and CSV files also accept their names.

    Attributes:
        scene: name of the model.
        t: times of the result [s], shape (n,).
        units: unit of every signal by name.
        status: status at the end of the simulation.
        message: explanation of the status.
        count: function that returns `statistics`.
        span: first time and last reached time [s].
        ends: function that returns `step_times`.
        states: function of times that returns the states; cheaper than all signals.
        evaluate: function of times that returns all signals.
        express: function of an expression of the model and times that returns its values, shape
            (rows, n).
        model: the model that was simulated.
        happened: (time [s], name) of every event.
        differentiate: function of times that returns derivatives of all signals, if requested.
        delays: function that returns derivatives of the event times in `happened`, if requested.
        pull_back: function that returns the gradient of a weighted sum of signals at `t`, if
            requested.
        keep: function that returns the run as data for files and pickles.
    """

    hidden = Signals.hidden | {"keep"}

    keep: "Callable[[Trajectory], Any] | None" = None

    def shown(self) -> Shown:
        """Return the laws, the status, and first, last and extreme values of every signal.

        Extremes are taken over all steps if they are known or cheap to compute, else over `t`.
        """
        counts, (first, last) = self.statistics, self.span
        known = "extremes" in self.__dict__ or counts.steps * len(self.units) <= CHEAP
        laws = friction(self.model)
        happened = f", {counted(len(self.happened), 'event')}" if self.model.events else ""
        lines = [
            *([f"friction: {laws}"] if laws else []),
            f"{self.status.name}: {self.message}",
            f"{counted(counts.steps, 'step')} of {counts.method} ({counts.backend}){happened}, "
            f"{counted(self.t.size, 'time')} in t",
        ]
        if isfinite(counts.error):
            slopes = among(f"{name} {x:.0e}" for name, x in counts.sensitivity_errors.items())
            derivatives = f", of derivatives by {slopes}" if slopes else ""
            lines.append(f"measured error: {counts.error:.0e}{derivatives}")
        after = [] if known else [f"least and greatest at {self.t.size} times; see extremes"]
        if "further" in self.model.__dict__ and self.details:
            after.append(f"further: {among(self.details)}")
        header = ("signal", "unit", "first", "last", "least", "greatest")
        table = TextTable(header, tuple(self._rows(known)), numbers=(2, 3, 4, 5))
        title = f"run of '{self.scene}' from {first:g} to {last:g} s"
        return Shown(title, tuple(lines), table, tuple(after))

    def _rows(self, known: bool) -> Iterator[tuple[str, ...]]:
        """Yield the rows of the table, with extremes over all steps if `known`, else over `t`."""
        if not self.t.size:
            yield from ((name, unit, "", "", "", "") for name, unit in self.units.items())
            return
        ends = self.extremes if known else {n: (v.min(), v.max()) for n, v in self.signals.items()}
        for name, unit in self.units.items():
            numbers = (self[name][0], self[name][-1], *ends[name])
            yield (name, unit, *(f"{x:.6g}" for x in numbers))

    def thumbnail(self) -> "Figure":
        """Return a small plot of some signals."""
        from symfric.results.pictures import thumbnail  # noqa: PLC0415  (slow to import)

        return thumbnail(self)

    def crossings(self, expression: Scalar, direction: int = 0) -> Array:
        """Return the times [s] at which an expression passes through zero, to rounding.

        They are roots of the dense output, not of samples; `run.at(times)` returns the Poincare
        section. An expression that stays at zero for a while, as a sliding velocity in stick does,
        crosses when it leaves zero to the other side. Of two crossings between the end and the
        middle of one step, both are missed.

        Args:
            expression: scalar SX in the symbols of the model, or the name of a signal.
            direction: 1 for rising crossings only, -1 for falling ones, 0 for both.

        Raises:
            ValueError: an unknown name, foreign symbols, or another direction.
        """
        checks.count(f"{self._where}: crossings: direction", direction, least=-1, most=1)
        return crossings(partial(self.of, self._expression(expression)), self.looks, direction)

    def period(self, expression: Scalar | None = None, tolerance: float = 1e-3) -> Cycle:
        """Return the cycle that the run settles to, with its period and the end of the transient.

        The states at rising crossings of `expression` are compared, without cyclic states
        (`Model.cyclic`) and without whole turns of `Model.angles`. The period is the time of the
        smallest number of crossings after which all states return. The transient ends at the first
        crossing from which on every return holds.

        Args:
            expression: scalar SX, or the name of a signal; by default the state of the machine with
                the largest range, relative to its nominal value, minus the middle of its range.
            tolerance: largest difference of a state between two returns, relative to its range.

        Raises:
            ValueError: a run at rest, too few crossings, or a motion that does not repeat.
        """
        checks.number(f"{self._where}: period: tolerance", tolerance, above=0.0, upper=1.0)
        return cycle(self, None if expression is None else self._expression(expression), tolerance)

    def _expression(self, expression: Scalar) -> ca.SX:
        if isinstance(expression, str):
            self.check([expression])
            return self.model.expression(expression)
        return ca.SX(checks.expression(f"{self._where}: expression", expression))

    def energy_balance(self) -> EnergyBalance:
        """Return the energy balance of a mechanism: energy, work by cause, and defect.

        Raises:
            ValueError: the model is not a mechanism and has no detail "conserved".
        """
        if "conserved" not in self.details:
            raise ValueError(
                f"{self._where}: expected a mechanism, got a model without an energy balance; "
                "integral(name) integrates any of its signals"
            )
        model, at = self.model, np.concatenate([self.step_times[:1], self.t])
        powers = [name for name, output in model.further.items() if output.kind == WORK]
        column = stacked(model.expression(name) for name in powers)
        energy, kinetic = self.of(
            ca.vertcat(model.expression("conserved"), model.expression("kinetic")), at
        )
        rows = integrals(self.step_times, self.of, column, self.t) if powers else ()
        names = (name.removesuffix("_work_rate") for name in powers)
        work = dict(zip(names, rows, strict=True))
        potential = energy - kinetic
        sizes = [kinetic, potential - potential[0], *work.values()]
        defect = (energy - energy[0])[1:] - sum(work.values(), np.zeros(self.t.size))
        scale = max(float(np.abs(size).max()) for size in sizes)
        return EnergyBalance(self.t, energy[1:], work, defect, scale)

    def plot(
        self,
        *names: str,
        path: str | Path | None = None,
        label: str = "",
        panels: str = "main",
        log: Sequence[str] = (),
    ) -> "Figure":
        """Plot signals over time with units, and save the figure to `path` if it is given.

        A notebook shows the figure that a cell returns; elsewhere, `.show()` opens a window.

        Args:
            names: signals or details, each in its own panel.
            path: image file; its suffix selects the format.
            label: legend entry of this trajectory.
            panels: signals to plot if no names are given: "main" for positions, friction and energy
                or power, "all" for every signal, grouped by kind if there are many.
            log: signals on logarithmic axes, as in `plot("v", "x", log=["v"])`.
        """
        from symfric.results.pictures import plot_trajectories  # noqa: PLC0415  (slow to import)

        return plot_trajectories({label or self.scene: self}, names, path, panels, log)

    def plot_section(
        self, x: str, y: str, expression: Scalar, direction: int = 1,
        path: str | Path | None = None,
    ) -> "Figure":  # fmt: skip
        """Plot two signals where an expression passes through zero, a Poincare section.

        Points on a curve show a quasi-periodic motion, and a few separate points a periodic one.

        Args:
            x, y: names of signals or details on the abscissa and the ordinate.
            expression, direction: as in `crossings`; "x" crosses at x = 0, and
                ca.sin(w * model.t) once a period of an input.
            path: image file.

        Raises:
            ValueError: as in `crossings`, or the expression never crosses zero.
        """
        from symfric.results.pictures import plot_points  # noqa: PLC0415  (slow to import)

        self.check([x, y])
        times = self.crossings(expression, direction)
        if not times.size:
            raise ValueError(
                f"{self._where}: plot_section: expected an expression that crosses zero, got none; "
                "simulate longer, or subtract a value that the motion passes"
            )
        return plot_points(self, x, y, times, path)

    def animate(
        self,
        path: str | Path,
        *,
        fps: float = 12.5,
        speed: float | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> None:
        """Write an animation of a machine as GIF, HTML with embedded pictures, or MP4.

        Planar machines are viewed along the normal of their plane. A joint with friction is drawn
        filled while all its contacts are slower than the velocity scale of their law, and hollow
        while a contact slides.

        Args:
            path: file with the suffix .gif, .html or .mp4 (requires the program ffmpeg).
            fps: pictures per second.
            speed: speed relative to real time; by default 1 for runs of 2 to 12 s, while other runs
                are shown in 6 s.
            progress: function that is called with the completed fraction.

        Raises:
            ValueError: the model has no bodies, the suffix is not supported, ffmpeg is missing, or
                a number is not positive.
        """
        from symfric.results.animation import animate  # noqa: PLC0415  (slow to import)

        animate(self, path, fps=fps, speed=speed, progress=progress)

    def save(self, path: str | Path) -> None:
        """Write the run to one file, from which `symfric.load_run` restores it exactly.

        The file contains the model, the signals at `t` and all accepted steps; a long run is
        repeated to compute its steps. A loaded run supports all methods of this class, including
        values between the times, animations and requested derivatives, and its `model` can be
        simulated again. Inputs given by functions are stored as expressions.

        Raises:
            ValueError: the file cannot be written, or a file cannot contain some part of the model.
        """
        self.packed_as().save(path)

    def packed_as(self) -> Any:
        """Return the run as data."""
        if self.keep is None:
            raise ValueError(f"{self._where}: expected one of simulate, got another")
        return self.keep(self)

    def to_csv(self, path: str | Path, *names: str) -> None:
        """Write signals as columns with units in the header, such as `v [m/s]`.

        Args:
            path: CSV file.
            names: signals or details; by default all signals.
        """
        columns = self._columns(names)
        header = ["t [s]", *(f"{name} [{self.unit(name)}]" for name in columns)]
        write_table(path, header, np.column_stack([self.t, *columns.values()]).tolist())

    def to_dataframe(self, *names: str) -> Any:
        """Return signals or details, by default all signals, as a pandas DataFrame over t.

        The attribute `attrs` contains the units.

        Raises:
            ImportError: pandas is not installed.
        """
        pandas = module("to_dataframe", "pandas")
        columns = self._columns(names)
        units = {"t": "s"} | {name: self.unit(name) for name in columns}
        frame = pandas.DataFrame(columns, index=pandas.Index(self.t, name="t"))
        frame.attrs.update(self._about | {"units": units})
        return frame

    def to_xarray(self, *names: str) -> Any:
        """Return signals or details, by default all signals, as an xarray Dataset with units.

        Raises:
            ImportError: xarray is not installed.
        """
        xarray = module("to_xarray", "xarray")
        columns = self._columns(names)
        arrays = {name: ("t", v, {"units": self.unit(name)}) for name, v in columns.items()}
        times = {"t": ("t", self.t, {"units": "s"})}
        return xarray.Dataset(arrays, coords=times, attrs=self._about)

    def _columns(self, names: Sequence[str]) -> dict[str, Array]:
        """Return signals and details by name; by default all signals."""
        self.check(names)
        return {name: self[name] for name in names} if names else dict(self.signals)

    @property
    def _about(self) -> dict[str, str]:
        return {"scene": self.scene, "status": self.status.name, "message": self.message}

    def to_dict(self) -> dict[str, Any]:
        """Return scene, status, statistics, units, times and signals as built-in types."""
        return {
            **self._about,
            "statistics": self.statistics.to_dict(),
            "units": {"t": "s", **self.units},
            "t": self.t.tolist(),
            "signals": {name: values.tolist() for name, values in self.signals.items()},
        }

    def to_json(self, path: str | Path) -> None:
        """Write the result of `to_dict` as JSON."""
        write_text(path, json.dumps(self.to_dict()))
