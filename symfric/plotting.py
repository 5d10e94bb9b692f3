"""Pictures of results, labelled with units. The only module that imports Matplotlib."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from symfric.files import written
from symfric.parameters import check_names

if TYPE_CHECKING:
    from symfric.integrator.trajectory import Trajectory


def save(figure: Figure, path: str | Path | None) -> Figure:
    """Write `figure` to `path`, if given, and close it; return it either way."""
    if path is not None:
        with written(path) as temporary:
            figure.savefig(temporary, dpi=150)
        plt.close(figure)
    return figure


def panels(count: int, width: float = 7.0, height: float = 1.9) -> tuple[Figure, list[Axes]]:
    """`count` panels under each other with a shared abscissa and a light grid."""
    figure, axes = plt.subplots(
        count, 1, sharex=True, squeeze=False, figsize=(width, 0.7 + height * count)
    )
    figure.set_layout_engine("constrained")
    for row in axes[:, 0]:
        row.grid(alpha=0.3)
    return figure, list(axes[:, 0])


def plot_trajectories(
    trajectories: "Mapping[str, Trajectory]",
    names: Sequence[str] = (),
    path: str | Path | None = None,
) -> Figure:
    """Signals of one or several simulations over time, a panel each.

    Args:
        trajectories: legend entry -> trajectory.
        names: signals to show; those that all trajectories share if none is given.
        path: image file.
    """
    first = next(iter(trajectories.values()))
    shared = [n for n in first.signals if all(n in t.signals for t in trajectories.values())]
    check_names(f"plot of '{first.scene}'", names, shared)
    shown = list(names) or shared
    figure, axes = panels(len(shown))
    for axis, name in zip(axes, shown, strict=True):
        for label, trajectory in trajectories.items():
            axis.plot(trajectory.t, trajectory[name], label=label, linewidth=1.2)
        axis.set_ylabel(f"{name} [{first.units[name]}]")
    axes[0].set_title(first.scene)
    if len(trajectories) > 1:
        axes[0].legend(loc="upper right", fontsize="small", ncols=len(trajectories))
    axes[-1].set_xlabel("t [s]")
    return save(figure, path)
