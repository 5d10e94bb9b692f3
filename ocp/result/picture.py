"""Pictures of optimal motions: what the optimiser says against what the model does."""

from collections.abc import Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ocp.result.motion import Motion
from ocp.result.solution import Solution
from symfric.foundation import checks
from symfric.foundation.panels import panels, save
from symfric.foundation.parameters import check_names
from symfric.foundation.style import Line, colour, line
from symfric.results.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

SHADES = {"slip+": colour(6), "stick": "0.45", "slip-": colour(1)}
"""Kind of mode -> colour of its background."""
ASKED = "0.35"
"""Colour of bounds and of what is asked for."""

CIRCLES = 60
"""Nodes of a motion that are drawn, about: of more they would be a thick line."""


def plot_solutions(
    solutions: Mapping[str, Solution],
    names: Sequence[str] = (),
    path: str | Path | None = None,
) -> "Figure":
    """Signals of one or several optimal motions over time, a panel each.

    Circles are the optimised nodes of the mesh, lines the motion that was simulated under the same
    control (the optimised one where nothing was simulated), steps the inputs. Thin upright lines
    part the phases. Of a single solution, bounds are dashed, values and ranges that were asked for
    are crosses and bars, and the modes of its contacts are shaded, a band for each contact.

    Args:
        solutions: legend entry -> solution; each scenario is a motion of its own.
        names: signals to show; those that all solutions share if none is given.
        path: image file, its format taken from the ending.

    Raises:
        ValueError: no solution, an unknown signal, or an ending that Matplotlib does not write.
    """
    if not solutions:
        raise checks.refused("plot", "at least one solution", solutions)
    first = next(iter(solutions.values()))
    shared = [n for n in first.signals if all(n in s.signals for s in solutions.values())]
    check_names(f"plot of '{first.problem.name}'", names, shared)
    shown = list(names) or shared
    drawn = [
        (f"{label} {motion.name}".strip(), solution, motion)
        for label, solution in solutions.items()
        for motion in solution.motions
    ]
    figure, axes = panels(len(shown))
    for axis, name in zip(axes, shown, strict=True):
        for number, (_, solution, motion) in enumerate(drawn):
            _signal(axis, solution, motion, name, line(number))
        for phase in first.phases[1:]:
            axis.axvline(phase.begin, color="0.6", linewidth=0.6, zorder=0)
        if len(solutions) == 1:
            _asked(axis, first, name)
            _modes(axis, first)
        axis.set_ylabel(f"{name} [{first.units[name]}]")
    _explain(axes[0], drawn, first if len(solutions) == 1 else None)
    runs = all(simulated(solution, motion) for _, solution, motion in drawn)
    lines = "lines: simulated" if runs else "lines: optimised"
    axes[-1].set_xlabel(f"t [s]   (circles: optimised nodes, {lines})")
    figure.align_ylabels(axes)
    return save(figure, path)


def _says(solution: Solution, motion: Motion) -> str:
    ended = "" if solution.ok else f", {solution.status.name.lower().replace('_', ' ')}"
    checked = "" if solution.verification is None else ", verified" * solution.verified
    return f"T = {motion.T:.4g} s, J = {solution.cost:.5g}{checked}{ended}"


def _explain(
    axis: "Axes", drawn: Sequence[tuple[str, Solution, Motion]], alone: Solution | None
) -> None:
    """Title or legend: what is what, and how it ended."""
    entries = [f"{label}: {_says(solution, motion)}" for label, solution, motion in drawn]
    handles: list[Artist] = []
    if len(entries) > 1:
        for number, entry in enumerate(entries):
            handles += axis.plot([], [], label=entry, **line(number))
    else:
        axis.set_title(entries[0])
    if alone is not None and alone.modes:
        kinds = {mode.kind for modes in alone.modes.values() for mode in modes}
        handles += [
            Patch(facecolor=shade, alpha=0.35, label=kind)
            for kind, shade in SHADES.items()
            if kind in kinds
        ]
        if len(alone.modes) > 1:
            bands = ", ".join(alone.modes)
            handles.append(Patch(facecolor="none", label=f"bands from below: {bands}"))
    if handles:
        root = axis.get_figure(root=True)
        if isinstance(root, Figure):
            columns = 1 if len(entries) > 1 else len(handles)
            root.legend(
                handles=handles, fontsize="small", loc="outside upper left", ncols=columns,
                frameon=False,
            )  # fmt: skip


def _signal(axis: "Axes", solution: Solution, motion: Motion, name: str, look: Line) -> None:
    if name in motion.controls:
        edges = np.append(motion.t_control, motion.phases[-1].end)
        axis.stairs(motion.controls[name], edges, baseline=None, linewidth=1.2, **look)
        return
    at = motion.nodes
    nodes = np.arange(motion.t.size)[at][:: max(1, np.size(motion.t[at]) // CIRCLES)]
    axis.plot(motion.t[nodes], motion[name][nodes], "o", color=look["color"], ms=3.5, mfc="none")
    runs = simulated(solution, motion)
    for run in runs:
        if name in run.units:
            axis.plot(run.t, run[name], linewidth=1.0, **look)
    if not runs:
        axis.plot(motion.t, motion[name], linewidth=1.0, **look)


def simulated(solution: Solution, motion: Motion) -> list[Trajectory]:
    """The re-simulated spans of a motion; none where it was not verified."""
    runs = solution.trajectories
    return [runs[number] for number in motion.spans if number < len(runs)]


def _asked(axis: "Axes", solution: Solution, name: str) -> None:
    """Bounds over each phase, and what is asked for at its ends and on the way."""
    motion = solution.motions[0]
    for phase, number in zip(motion.phases, motion.spans, strict=True):
        span = solution.problem.spans[number]
        rows = {row.name: (row.lower, row.upper) for row in span.path}
        bounds = span.boxes.get(name) or rows.get(f"the bound on {name}") or ()
        for bound in bounds:
            if isfinite(bound):
                axis.plot([phase.begin, phase.end], [bound] * 2, "--", color=ASKED, linewidth=0.8)
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
        axis.plot([t], [low], "x", color=ASKED, ms=6)
    else:
        finite = [bound for bound in box if isfinite(bound)]
        axis.plot([t] * len(finite), finite, "_-", color=ASKED, ms=6, linewidth=0.8)


def _modes(axis: "Axes", solution: Solution) -> None:
    """A band of background for each contact."""
    count = len(solution.modes)
    for k, modes in enumerate(solution.modes.values()):
        for mode in modes:
            axis.axvspan(
                mode.begin,
                mode.end,
                k / count,
                (k + 1) / count,
                facecolor=SHADES.get(mode.kind, "0.8"),
                alpha=0.2,
                linewidth=0,
                zorder=0,
            )
