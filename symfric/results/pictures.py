"""Pictures of simulations, with units."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from symfric.foundation.panels import panels, save
from symfric.foundation.style import colour, line
from symfric.model.kinds import CONSTRAINTS
from symfric.results.kinds import is_mechanism, kinds

if TYPE_CHECKING:
    from symfric.results.trajectory import Trajectory


PANELS = 8
"""More signals than this are drawn together, a panel per unit, unless they were named."""


def plot_trajectories(
    trajectories: "Mapping[str, Trajectory]",
    names: Sequence[str] = (),
    path: str | Path | None = None,
) -> Figure:
    """Signals of one or several simulations over time, a panel each.

    Args:
        trajectories: legend entry -> trajectory.
        names: signals or details to show, a panel each; the signals that all trajectories share
            if none is given. Where these are many there is a panel per unit; of mechanisms per
            kind, without multipliers and sliding velocities.
        path: image file.
    """
    first = next(iter(trajectories.values()))
    for trajectory in trajectories.values():
        trajectory.check(names)
    shared = [n for n in first.units if all(n in t.units for t in trajectories.values())]
    shown = list(names) or shared
    if len(shown) > PANELS and not names:
        return save(_grouped(trajectories, shown), path)
    figure, axes = panels(len(shown))
    for axis, name in zip(axes, shown, strict=True):
        for k, (label, trajectory) in enumerate(trajectories.items()):
            axis.plot(
                trajectory.looks, trajectory.at_looks(name), label=label, linewidth=1.2, **line(k)
            )
        axis.set_ylabel(f"{name} [{first.unit(name)}]")
    axes[0].set_title(first.scene, loc="left")
    if list(trajectories) != [first.scene]:
        axes[0].legend(
            loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize="small", ncols=3
        )
    axes[-1].set_xlabel("t [s]")
    figure.align_ylabels(axes)
    return save(figure, path)


def _groups(trajectory: "Trajectory", shown: Sequence[str]) -> dict[str, list[str]]:
    """Panels of many signals: title -> names."""
    found = {name: "" for name in shown}
    if is_mechanism(trajectory.model):
        found = {name: kind for name, kind in kinds(trajectory.model).items() if name in shown}
    groups: dict[str, list[str]] = {}
    for name, kind in found.items():
        unit = trajectory.units[name]
        title = f"{kind} [{unit}]" if unit else "[several units]"
        groups.setdefault(kind if kind == CONSTRAINTS else title.strip(), []).append(name)
    return groups


def _grouped(trajectories: "Mapping[str, Trajectory]", shown: Sequence[str]) -> Figure:
    """Many signals: a panel per kind, a colour per signal, a line style per simulation."""
    first = next(iter(trajectories.values()))
    groups = _groups(first, shown)
    figure, axes = panels(len(groups), width=9.5, height=2.3)
    for axis, (title, members) in zip(axes, groups.items(), strict=True):
        for k, name in enumerate(members):
            for style, trajectory in zip(
                ("-", "--", ":", "-."), trajectories.values(), strict=False
            ):
                label = name if style == "-" else None
                dots = title == CONSTRAINTS
                axis.plot(
                    trajectory.t if dots else trajectory.looks,
                    trajectory[name] if dots else trajectory.at_looks(name),
                    "." if dots else style,
                    color=colour(k),
                    label=label,
                    linewidth=1.1,
                    markersize=1.5,
                )
        if title == CONSTRAINTS:
            axis.set_yscale("log", nonpositive="mask")
        axis.set_ylabel(title)
        axis.legend(
            loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize="x-small",
            markerscale=4,
        )  # fmt: skip
    styles = ", ".join(
        f"{label} {style}"
        for label, style in zip(trajectories, ("-", "- -", ":", "- ."), strict=False)
    )
    axes[0].set_title(
        f"{first.scene}: {styles}" if len(trajectories) > 1 else first.scene, loc="left"
    )
    axes[-1].set_xlabel("t [s]")
    figure.align_ylabels(axes)
    return figure
