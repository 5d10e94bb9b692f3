"""Pictures of results, with units. With `symfric.animation` all that imports Matplotlib."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from symfric.files import written
from symfric.kinds import CONSTRAINTS, is_mechanism, kinds
from symfric.laws import steady_force
from symfric.parameters import parameters

if TYPE_CHECKING:
    from symfric.figures import FigureData
    from symfric.integrator.trajectory import Trajectory
    from symfric.laws import AnyLaw


def save(figure: Figure, path: str | Path | None) -> Figure:
    """Write `figure` to `path`, if given, and close it; return it either way."""
    if path is not None:
        with written(path) as temporary:
            figure.savefig(temporary, dpi=150)
        plt.close(figure)
    return figure


def panels(
    count: int, width: float = 7.0, height: float = 1.9, shared: bool = True
) -> tuple[Figure, list[Axes]]:
    """`count` panels under each other with a light grid, their abscissa shared by default."""
    figure, axes = plt.subplots(
        count, 1, sharex=shared, squeeze=False, figsize=(width, 0.7 + height * count)
    )
    figure.set_layout_engine("constrained")
    for row in axes[:, 0]:
        row.grid(alpha=0.3)
    return figure, list(axes[:, 0])


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
        for label, trajectory in trajectories.items():
            axis.plot(trajectory.t, trajectory[name], label=label, linewidth=1.2)
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
                    trajectory.t, trajectory[name], "." if dots else style, color=f"C{k % 10}",
                    label=label, linewidth=1.1, markersize=1.5,
                )  # fmt: skip
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


def plot_laws(
    laws: "Mapping[str, AnyLaw]", N: float = 1.0, path: str | Path | None = None
) -> Figure:
    """Friction force in steady sliding against velocity: near rest, and over many decades.

    Args:
        laws: legend entry -> law, with numbers for parameters.
        N: normal force [N].
        path: image file.
    """
    figure, (near, far) = plt.subplots(1, 2, sharey=True, figsize=(7.5, 3.2), layout="constrained")
    scales = [scale for law in laws.values() for scale in _velocity_scales(law)]
    scale = max(scales, default=0.1)
    decades = np.geomspace(1e-3 * scale, max(1.0, 10 * scale), 1201)
    around = np.linspace(-10 * scale, 10 * scale, 2001)
    for label, law in laws.items():
        for axis, v in ((near, around), (far, decades)):
            axis.plot(v, steady_force(law, v, N), label=label, linewidth=1.3)
    near.ticklabel_format(axis="x", style="sci", scilimits=(-2, 3), useMathText=True)
    far.set_xscale("log")
    for axis in (near, far):
        axis.grid(alpha=0.3)
        axis.set_xlabel("v [m/s]")
    near.set_ylabel("F in steady sliding [N]")
    near.set_title(f"near rest, N = {N:g} N", fontsize="medium")
    far.set_title("over decades", fontsize="medium")
    near.legend(fontsize="small")
    return save(figure, path)


def plot_catalogue(
    laws: "Mapping[str, AnyLaw]", N: float = 1.0, path: str | Path | None = None
) -> Figure:
    """Friction force in steady sliding against velocity, a small panel with its own axes per law.

    Args:
        laws: title -> law, with numbers for parameters.
        N: normal force [N].
        path: image file.
    """
    columns = 6
    rows = -(-len(laws) // columns)
    figure, grid = plt.subplots(
        rows, columns, squeeze=False, figsize=(11, 0.6 + 1.3 * rows), layout="constrained"
    )
    for axis in grid.flat[len(laws) :]:
        axis.set_visible(False)
    for axis, (label, law) in zip(grid.flat, laws.items(), strict=False):
        edge = 5 * max(_velocity_scales(law), default=0.1)
        v = np.linspace(-edge, edge, 1001)
        axis.plot(v, steady_force(law, v, N), linewidth=1.1)
        axis.set_title(label, fontsize="x-small")
        axis.set_xticks([-edge, 0.0, edge], labels=[f"{-edge:.3g}", "0", f"{edge:.3g}"])
        axis.locator_params(axis="y", nbins=4)
        axis.tick_params(labelsize="xx-small")
        axis.yaxis.get_offset_text().set_fontsize("xx-small")
        axis.grid(alpha=0.3)
    figure.supxlabel("v [m/s or rad/s]", fontsize="small")
    figure.supylabel(f"F in steady sliding [N or N m], N = {N:g}", fontsize="small")
    return save(figure, path)


def _velocity_scales(law: "AnyLaw") -> list[float]:
    """The velocities [m/s] among the parameters, on which the force changes."""
    known = [(float(p.value), p.unit) for p in parameters(law).values()]
    scales = [value for value, unit in known if unit in ("m/s", "rad/s")]
    return scales + [1 / value for value, unit in known if unit == "s/m" and value > 0]


def plot_figure(data: "FigureData", path: str | Path | None = None) -> Figure:
    """A behaviour figure: a panel per pair of columns, a colour per law or, for one law, per case.

    With several laws the cases differ by their dashes.

    Args:
        data: its curves, panels and units.
        path: image file.
    """
    laws = list(dict.fromkeys(c.law for c in data.curves))
    cases = list(dict.fromkeys(c.case for c in data.curves))
    abscissae = {x for x, _ in data.panels}
    height = {1: 4.0, 2: 2.6}.get(len(data.panels), 1.7)
    figure, axes = panels(len(data.panels), 7.0, height, shared=len(abscissae) == 1)
    dashes = ["-", "--", ":", "-."]
    for axis, (x, y) in zip(axes, data.panels, strict=True):
        for c in data.curves:
            case = cases.index(c.case)
            dash = dashes[case % len(dashes)] if len(laws) > 1 else "--" if c.reference else "-"
            number = laws.index(c.law) if len(laws) > 1 else case
            label = c.label if len(laws) > 1 else c.case or "as it is"
            axis.plot(
                c[x], c[y], dash, color=f"C{number % 10}", linewidth=1.2,
                marker="o" if data.dots else None, markersize=4, label=label,
            )  # fmt: skip
        axis.ticklabel_format(axis="both", style="sci", scilimits=(-2, 4), useMathText=True)
        if x in data.log:
            axis.set_xscale("log")
        axis.set_ylabel(f"{y} [{data.units[y]}]")
        if axis is axes[-1] or len(abscissae) > 1:
            axis.set_xlabel(f"{x} [{data.units[x]}]")
    title = data.title if len(laws) > 1 else f"{laws[0]}: {data.title}"
    figure.suptitle(title, fontsize="medium")
    if len(data.curves) > 1:
        entries = axes[0].get_legend_handles_labels()
        figure.legend(*entries, loc="outside lower center", ncols=3, fontsize="small")
    figure.align_ylabels(axes)
    return save(figure, path)


def _filled(number: int) -> str | None:
    """Hollow markers from the eleventh line on, which has the colour of the first."""
    return "none" if number >= 10 else None


def plot_work_precision(
    lines: Mapping[str, Mapping[str, Sequence[tuple[float, float]]]],
    path: str | Path | None = None,
) -> Figure:
    """Run time against error, a panel per case.

    Args:
        lines: case -> integrator -> points (relative error, time in s).
        path: image file.
    """
    figure, axes = plt.subplots(1, len(lines), squeeze=False, sharey=True, figsize=(11, 4.8))
    figure.set_layout_engine("constrained")
    names = list(dict.fromkeys(name for integrators in lines.values() for name in integrators))
    for axis, (case, integrators) in zip(axes[0], lines.items(), strict=True):
        for name, points in integrators.items():
            error, time = zip(*sorted(points), strict=True)
            bold = name.startswith("symfric")
            axis.loglog(
                error, [1e3 * t for t in time], marker="o", markersize=4 if bold else 3,
                linewidth=2.0 if bold else 1.0, linestyle="-" if bold else "--", label=name,
                color=f"C{names.index(name) % 10}", markerfacecolor=_filled(names.index(name)),
            )  # fmt: skip
        axis.set_title(case)
        axis.set_xlabel("relative position error [1]")
        axis.invert_xaxis()
        axis.grid(alpha=0.3, which="both")
    axes[0, 0].set_ylabel("time of a run [ms]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5,
                  fontsize="small")  # fmt: skip
    return save(figure, path)
