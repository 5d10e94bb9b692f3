"""Pictures of optimal motions: what the optimiser says against what the model does."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ocp.solution import Solution
from symfric.foundation.panels import panels, save
from symfric.foundation.parameters import check_names

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def plot_solutions(
    solutions: Mapping[str, Solution],
    names: Sequence[str] = (),
    path: str | Path | None = None,
) -> "Figure":
    """Signals of one or several optimal motions over time, a panel each.

    Circles are the optimised ends of the intervals, lines the motion that was simulated under the
    same control, steps the inputs.

    Args:
        solutions: legend entry -> solution.
        names: signals to show; those that all solutions share if none is given.
        path: image file.
    """
    first = next(iter(solutions.values()))
    shared = [n for n in first.signals if all(n in s.signals for s in solutions.values())]
    check_names(f"plot of '{first.problem.model.name}'", names, shared)
    shown = list(names) or shared
    figure, axes = panels(len(shown))
    for axis, name in zip(axes, shown, strict=True):
        for number, solution in enumerate(solutions.values()):
            _signal(axis, solution, name, f"C{number}")
        axis.set_ylabel(f"{name} [{first.units[name]}]")
    entries = [f"{label}: {_says(solution)}" for label, solution in solutions.items()]
    if len(entries) > 1:
        colours = (f"C{number}" for number in range(len(entries)))
        proxies = [axes[0].plot([], [], color=colour)[0] for colour in colours]
        axes[0].legend(proxies, entries, fontsize="small")
    else:
        axes[0].set_title(entries[0])
    axes[-1].set_xlabel("t [s]   (circles: optimised, lines: simulated)")
    figure.align_ylabels(axes)
    return save(figure, path)


def _says(solution: Solution) -> str:
    ended = "" if solution.ok else f", {solution.status.name.lower().replace('_', ' ')}"
    return f"T = {solution.T:.4g} s{ended}"


def _signal(axis: "Axes", solution: Solution, name: str, colour: str) -> None:
    edges = np.append(solution.t_control, solution.T)
    if name in solution.controls:
        axis.stairs(solution.controls[name], edges, baseline=None, color=colour, linewidth=1.2)
        return
    nodes = slice(None, None, (solution.t.size - 1) // solution.t_control.size)
    axis.plot(solution.t[nodes], solution[name][nodes], "o", color=colour, ms=3.5, mfc="none")
    moved = solution.trajectory
    t, values = (solution.t, solution[name]) if moved is None else (moved.t, moved[name])
    axis.plot(t, values, color=colour, linewidth=1.0)
