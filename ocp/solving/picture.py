"""Figures of optimal motions, optimised and simulated, and of the motion while `solve` runs."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import astuple, replace
from math import isfinite
from pathlib import Path
from time import perf_counter
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, final

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ocp.formulation.phase import Span
from ocp.solving.active import per_unit
from ocp.solving.motion import ScenarioMotion, Stretch
from ocp.solving.solution import Solution
from ocp.solving.watch import Progress
from symfric.foundation import checks
from symfric.foundation.panels import panels, save
from symfric.foundation.parameters import check_names
from symfric.foundation.style import Line, colour, line
from symfric.results.pictures import level
from symfric.results.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

SHADES = {"slip+": colour(6), "stick": "0.45", "slip-": colour(1)}
"""Kind of mode -> background colour."""
WANTED = "0.35"
"""Colour of bounds and prescribed values."""

Modes = Sequence[tuple[str, float, float]]
"""(kind, begin [s], end [s]) of the modes of a contact."""
COSTATE = "costate "
CIRCLES = 60
"""Approximate number of nodes drawn for a motion."""


class Drawn(NamedTuple):
    """Motion in a plot.

    Attributes:
        label: legend entry.
        motion: the optimised motion.
        runs: re-simulated phases of the motion; empty if it was not verified.
        ending: text with duration, cost and status.
    """

    label: str
    motion: ScenarioMotion
    runs: Sequence[Trajectory]
    ending: str


def plot_solutions(
    solutions: Mapping[str, Solution],
    names: Sequence[str] = (),
    path: str | Path | None = None,
) -> Figure:
    """Plot signals of one or several optimal motions over time, one panel each.

    Circles are optimised nodes of the mesh. Lines are the simulated motion under the same control,
    or the optimised motion without a simulation. Inputs are steps. Thin vertical lines separate
    phases. For a single solution, bounds are dashed lines, prescribed values and ranges are crosses
    and bars, and shaded bands show the modes of each contact.

    Args:
        solutions: legend entry -> solution; each scenario is a separate motion.
        names: signals to show, by default all signals common to the solutions; "costate x" is the
            costate of the state x in the first scenario.
        path: image file; its extension selects the format.

    Raises:
        ValueError: no solution, an unknown signal, costates that are not known, or an unsupported
            file extension.
    """
    if not solutions:
        raise checks.refused("plot", "at least one solution", solutions)
    first = next(iter(solutions.values()))
    motions = {label: _with_costates(one, names) for label, one in solutions.items()}
    known = [each[0].signals for each in motions.values()]
    shared = [name for name in known[0] if all(name in signals for signals in known)]
    check_names(f"plot of '{first.problem.name}'", names, shared)
    drawn: list[Drawn] = []
    for label, one in solutions.items():
        status = "" if one.status.ok else f", {one.status.name.lower().replace('_', ' ')}"
        status = ", verified" * one.verified + status
        for motion in motions[label]:
            ending = f"T = {motion.T:.4g} s, J = {one.cost:.5g}{status}"
            runs = [run for k, run in enumerate(one.trajectories) if k in motion.spans]
            drawn.append(Drawn(f"{label} {motion.name}".strip(), motion, runs, ending))
    alone = len(solutions) == 1
    spans = [first.problem.spans[i] for i in first.motions[0].spans] if alone else []
    modes = {name: [*map(astuple, each)] for name, each in first.modes.items()} if alone else {}
    return plot_motions(drawn, list(names) or shared, spans, modes, path)


def _with_costates(solution: Solution, names: Sequence[str]) -> tuple[ScenarioMotion, ...]:
    """Return the motions, or the first one with its costates if `names` contain some."""
    if not any(name.startswith(COSTATE) for name in names):
        return solution.motions
    first = solution.motions[0]
    rows = {f"{COSTATE}{name}": row for name, row in solution.costates.items()}
    units = {f"{COSTATE}{name}": per_unit(first.units[name]) for name in solution.costates}
    return (replace(first, signals=first.signals | rows, units=first.units | units),)


def plot_motions(
    drawn: Sequence[Drawn],
    names: Sequence[str],
    spans: Sequence[Span] = (),
    modes: Mapping[str, Modes] = MappingProxyType({}),
    path: str | Path | None = None,
) -> Figure:
    """Plot signals of motions over time, one panel each; see `ocp.plot_solutions`.

    Args:
        drawn: the motions; the phases and units of the first one are shown.
        names: signals to show.
        spans: phases of the first motion, whose bounds, ends and via points are drawn.
        modes: contact -> its modes.
        path: image file; its extension selects the format.
    """
    first = drawn[0].motion
    figure, axes = panels(len(names))
    for axis, name in zip(axes, names, strict=True):
        for number, one in enumerate(drawn):
            _signal(axis, one, name, line(number))
        for phase in first.phases[1:]:
            axis.axvline(phase.begin, color="0.6", linewidth=0.6, zorder=0)
        for phase, span in zip(first.phases, spans, strict=False):
            _wanted(axis, phase, span, name)
        _modes(axis, modes)
        if name.startswith(COSTATE):  # other signals have bounds that remain visible
            level(axis, [one.motion[name] for one in drawn])
        axis.set_ylabel(f"{name} [{first.units[name]}]")
    _explain(axes[0], drawn, modes)
    lines = "lines: simulated" if all(one.runs for one in drawn) else "lines: optimised"
    axes[-1].set_xlabel(f"t [s]   (circles: optimised nodes, {lines})")
    figure.align_ylabels(axes)
    return save(figure, path)


def _explain(axis: "Axes", drawn: Sequence[Drawn], modes: Mapping[str, Modes]) -> None:
    """Add the title or legend with the labels and the status of the motions."""
    entries = [f"{one.label}: {one.ending}" for one in drawn]
    handles: list[Artist] = []
    if len(entries) > 1:
        for number, entry in enumerate(entries):
            handles += axis.plot([], [], label=entry, **line(number))
    else:
        axis.set_title(entries[0])
    kinds = {kind for each in modes.values() for kind, _, _ in each}
    shades = [(kind, shade) for kind, shade in SHADES.items() if kind in kinds]
    handles += [Patch(facecolor=shade, alpha=0.35, label=kind) for kind, shade in shades]
    if len(modes) > 1:
        handles.append(Patch(facecolor="none", label=f"bands from below: {', '.join(modes)}"))
    root = axis.get_figure(root=True)
    if handles and isinstance(root, Figure):
        columns = 1 if len(entries) > 1 else len(handles)
        root.legend(
            handles=handles, fontsize="small", loc="outside upper left", ncols=columns,
            frameon=False,
        )  # fmt: skip


def _signal(axis: "Axes", one: Drawn, name: str, look: Line) -> None:
    motion = one.motion
    if name in motion.controls:
        edges = np.append(motion.t_control, motion.phases[-1].end)
        axis.stairs(motion.controls[name], edges, baseline=None, linewidth=1.2, **look)
        return
    at = motion.nodes
    nodes = np.arange(motion.t.size)[at][:: max(1, np.size(motion.t[at]) // CIRCLES)]
    axis.plot(motion.t[nodes], motion[name][nodes], "o", color=look["color"], ms=3.5, mfc="none")
    for run in one.runs:
        if name in run.units:
            axis.plot(run.t, run[name], linewidth=1.0, **look)
    if not any(name in run.units for run in one.runs):
        axis.plot(motion.t, motion[name], linewidth=1.0, **look)


def _wanted(axis: "Axes", phase: Stretch, span: Span, name: str) -> None:
    """Draw the bounds, prescribed values and ranges of a signal in a phase."""
    rows = {row.name: (row.lower, row.upper) for row in span.path}
    for bound in span.boxes.get(name) or rows.get(f"the bound on {name}") or ():
        if isfinite(bound):
            axis.plot([phase.begin, phase.end], [bound] * 2, "--", color=WANTED, linewidth=0.8)
    for fraction, boxes in span.nodes.items():
        if name in boxes and boxes[name] != span.boxes[name]:
            _range(axis, phase.begin + fraction * phase.T, boxes[name])
    for fraction, conditions in span.rows_at.items():
        for row in conditions:
            if row.name.startswith(f"{name} at "):
                _range(axis, phase.begin + fraction * phase.T, (row.lower, row.upper))


def _range(axis: "Axes", t: float, box: tuple[float, float]) -> None:
    low, high = box
    if low == high:
        axis.plot([t], [low], "x", color=WANTED, ms=6)
    else:
        finite = [bound for bound in box if isfinite(bound)]
        axis.plot([t] * len(finite), finite, "_-", color=WANTED, ms=6, linewidth=0.8)


def _modes(axis: "Axes", modes: Mapping[str, Modes]) -> None:
    """Draw a background band for each contact."""
    count = len(modes)
    for k, each in enumerate(modes.values()):
        for kind, begin, end in each:
            axis.axvspan(
                begin, end, k / count, (k + 1) / count,
                facecolor=SHADES.get(kind, "0.8"), alpha=0.2, linewidth=0, zorder=0,
            )  # fmt: skip


SHOWN = 4
"""Number of signals that are shown by default."""


@final
class LivePlot:
    """Plot that is redrawn while `solve(problem, progress=LivePlot("x", "force"))` runs.

    A notebook updates the figure of the cell; elsewhere a window opens if the backend of Matplotlib
    has windows. `figure` is the last plot in all cases.
    """

    def __init__(self, *names: str, every: float = 0.5) -> None:
        """Create the plot.

        Args:
            names: signals to show; by default the first four.
            every: shortest time between two plots [s]; drawing takes about 0.1 s.
        """
        self.names, self.every = names, checks.number("LivePlot: every", every, lower=0.0, unit="s")
        self.figure: Any = None
        self._axes: list[Any] = []
        self._handle: Any = None
        self._next = 0.0

    def __call__(self, now: Progress) -> None:
        """Draw the motion of the iterate, with cost and violation in the title."""
        if perf_counter() < self._next:
            return
        motion = now.motion
        check_names("LivePlot", self.names, motion.signals)
        shown = self.names or [*motion.signals][:SHOWN]
        if self.figure is None:
            self.figure, self._axes = panels(len(shown))
            self._axes[-1].set_xlabel("t [s]")
        for axis, name in zip(self._axes, shown, strict=True):
            for old in [*axis.lines]:
                old.remove()
            style = "steps-post" if name in motion.controls else "default"
            axis.plot(motion.t, motion[name], color="C0", linewidth=1.2, drawstyle=style)
            axis.set_ylabel(f"{name} [{motion.units[name]}]")
        where = f"{now.stage}, iteration {now.iteration}"
        self._axes[0].set_title(f"{where}: J = {now.cost:.5g}, violation {now.violation:.1g}")
        self._show()
        self._next = perf_counter() + self.every

    def _show(self) -> None:
        """Show the figure in the notebook or in its window."""
        shell: Any = sys.modules.get("IPython")
        if shell is not None and shell.get_ipython() is not None:
            if self._handle is None:
                self._handle = shell.display.display(self.figure, display_id=True)
            else:
                self._handle.update(self.figure)
        elif self.figure.has_window():
            self.figure.canvas.manager.show()
            self.figure.canvas.draw_idle()
            self.figure.canvas.flush_events()
