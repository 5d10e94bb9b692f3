"""Plots of laws: steady curves, and behaviours that steady curves do not show."""

import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from itertools import chain
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from symfric.figures.catalogue import together
from symfric.figures.data import Array, Curve, FigureData, draw_curves, phenomena
from symfric.figures.motion import Scales, scales
from symfric.figures.pushing import stiction
from symfric.figures.sliding import dwell, hysteresis, lag, transition, velocity_step
from symfric.foundation.panels import blank, dressed, grid, legend_below, save
from symfric.foundation.parameters import parameters
from symfric.foundation.status import SolveError
from symfric.foundation.style import colour, dash, line
from symfric.foundation.units import readable, turned
from symfric.laws import AnyLaw, Law, Population, law_name, steady_force, steady_inputs
from symfric.laws.base.law import FORCE

Make = Callable[[AnyLaw, float, Scales], FigureData]

ACCELERATION = "dv"
"""Name of the sliding acceleration, an input of laws that every motion provides."""


def natures(laws: Mapping[str, AnyLaw], N: float) -> list[FigureData]:
    """Return figures of the behaviours of `laws`, given by legend entry, beyond the steady curve.

    Each figure contains all laws that show the behaviour, and the first of them determines its
    scales. A law whose simulation fails is omitted, with the reason in the note of the figure. Laws
    that depend on the velocity alone have no such figure.
    """

    def together_in(name: str) -> FigureData:
        able = {label: law for label, law in laws.items() if name in behaviours(law)}
        given = scales(next(iter(able.values())), N)
        return together(able, lambda law: behaviours(law)[name](law, N, given))

    figures: list[FigureData] = []
    for name in dict.fromkeys(name for law in laws.values() for name in behaviours(law)):
        with suppress(SolveError, ValueError):
            figures.append(together_in(name))
    return figures


def behaviours(law: AnyLaw) -> dict[str, Make]:
    """Return the figures that characterise `law` beyond its steady curve, by name.

    For a law with further inputs they show the effect of these, for a law that needs the applied
    force its stiction, and for all others pre-sliding with lag or reversals, and the increase of
    static friction with dwell time.
    """
    codes = phenomena(law)
    inputs = [] if isinstance(law, Population) else [i.name for i in law.inputs]
    if further := [name for name in inputs if name not in (FORCE, ACCELERATION)]:
        return {f"input_{name}": partial(over_input, name=name) for name in further}
    if FORCE in inputs:
        return {"stiction": stiction}
    made: dict[str, Make] = {}
    if "P" in codes:
        made["hysteresis"] = partial(hysteresis, speeds=(1.0,))
    if "L" in codes and "P" not in codes and "T" in codes:
        made["velocity_step"] = velocity_step
    elif "L" in codes:
        made["lag"] = partial(
            lag, frequencies=(50.0,) if isinstance(law, Population) else (5.0, 50.0)
        )
    elif "P" in codes:
        made["transition"] = partial(transition, frequencies=(2.0,))
    if "T" in codes and isinstance(law, Law):
        made["dwell"] = dwell
    return made


def over_input(law: AnyLaw, N: float, given: Scales, name: str) -> FigureData:
    """Show the force in steady sliding at the Stribeck velocity over the further input `name`.

    The input ranges up to twice its nominal magnitude in both directions. All other inputs have
    their values of steady sliding.
    """
    if not isinstance(law, Law):
        raise ValueError(f"over_input of {law_name(law)}: expected a law, got a population")
    inputs = {i.name: i for i in law.inputs}
    V, u = given.velocity, np.linspace(-2.0, 2.0, 401) * inputs[name].nominal
    at = {i.name: u if i.name == name else i.steady for i in law.inputs}
    v = np.full(u.shape, V)
    F = law.force(v, N, law.steady_state_at(v, N, **at), **at)
    return FigureData(
        f"input_{name}",
        f"sliding at {V:.3g} m/s over {name}, N = {N:g} N",
        {name: inputs[name].unit, "F": "N"},
        ((name, "F"),),
        (Curve(law_name(law), "", {name: u, "F": np.asarray(F, dtype=float)}),),
    )


LAYERS = 50.0
"""Largest ratio of the half width of the window around rest to the smoothing velocity."""
COLUMNS = 3
"""Number of behaviours in a row."""


def plot_laws(laws: Mapping[str, AnyLaw], N: float = 1.0, path: str | Path | None = None) -> Figure:
    """Draw the steady curves of laws, and the behaviours that steady curves do not show.

    The upper panels show the force in steady sliding over the velocity, around rest and over
    several decades. The lower panels show hysteresis in pre-sliding, frictional lag, dwell and
    stiction of the laws that have them (`symfric.figures.pictures`). Laws of a rotating contact
    have the units rad/s and N m.

    Args:
        laws: laws with numerical parameters, by legend entry.
        N: normal force [N].
        path: image file.
    """
    shown = natures(laws, N)
    tiles = [(d, panel) for d in shown for panel in d.panels[: None if len(shown) == 1 else 1]]
    rows = -(-len(tiles) // COLUMNS)
    figure = blank(7.5, 0.5 + 2.6 * (1 + rows) + 0.25 * (len(laws) > 1))
    cells = figure.add_gridspec(1 + rows, 6)
    near, far = (dressed(figure.add_subplot(cells[0, k : k + 3])) for k in (0, 3))
    _steady(near, far, laws, N)
    for k, (data, panel) in enumerate(tiles):
        row, column = divmod(k, COLUMNS)
        width = 6 // min(COLUMNS, len(tiles) - row * COLUMNS)
        axis = figure.add_subplot(cells[1 + row, column * width : (column + 1) * width])
        _behaviour(dressed(axis), data, panel, list(laws))
    inputs = dict.fromkeys(steady_inputs(law) for law in laws.values())
    figure.suptitle(
        f"{', '.join(laws)}   N = {N:g} N{''.join(inputs)}", x=0.01, ha="left", fontsize="large"
    )
    if len(laws) > 1:
        legend_below(figure, near, 4, fontsize="small", frameon=True)
    return save(figure, path)


def _steady(near: Axes, far: Axes, laws: Mapping[str, AnyLaw], N: float) -> None:
    """Draw the steady curves around rest and over decades, in the units of the first law.

    For a law that is not odd, a thin line over decades shows -F(-v).
    """
    around = _around(max(window(law, N) for law in laws.values()), 600)
    ends = [decades(law, N) for law in laws.values()]
    over = np.geomspace(min(low for low, _ in ends), max(high for _, high in ends), 801)
    forces = [[steady_force(law, v, N) for v in (around, over, -over)] for law in laws.values()]
    by_v, unit_v, by_F, unit_F = _units(laws.values(), around, [f[1] for f in forces])
    for k, (label, (F, forwards, backwards)) in enumerate(zip(laws, forces, strict=True)):
        near.plot(by_v * around, by_F * F, label=label, linewidth=1.4, **line(k))
        far.plot(by_v * over, by_F * forwards, label=label, linewidth=1.4, **line(k))
        if np.abs(backwards + forwards).max() > 1e-6 * np.abs(forwards).max():
            far.plot(
                by_v * over, -by_F * backwards, label=f"{label}: -F(-v)",
                linewidth=0.9, color=colour(k), linestyle=dash(k + 1),
            )  # fmt: skip
            far.legend(fontsize="x-small")
    far.set_xscale("log")
    low, high = far.dataLim.intervaly
    far.set_ylim(min(0.0, 1.08 * low), 1.08 * max(high, 0.0) or 1.0)
    for axis, title in ((near, "steady sliding, around rest"), (far, "over decades")):
        axis.set_title(title, loc="left", fontsize="medium")
        axis.set_xlabel(f"v [{unit_v}]")
        axis.set_ylabel(f"F [{unit_F}]")


def _around(half: float, samples: int) -> Array:
    """Return velocities [m/s] between -`half` and `half`, which are dense near rest."""
    positive = half * np.geomspace(1e-5, 1.0, samples)
    return np.concatenate([-positive[::-1], [0.0], positive])


def _units(
    laws: Iterable[AnyLaw], v: Array, forces: Sequence[Array]
) -> tuple[float, str, float, str]:
    """Return factor and unit of velocity and force, for rotation if all laws are in rad/s."""
    (by_v, unit_v), (by_F, unit_F) = readable("m/s", [v]), readable("N", forces)
    if all(any(p.unit.startswith("rad/s") for p in parameters(law).values()) for law in laws):
        unit_v, unit_F = turned(unit_v), turned(unit_F)
    return by_v, unit_v, by_F, unit_F


def _velocities(law: AnyLaw, N: float) -> tuple[Scales, float]:
    """Return the scales of a law, and the velocity over which it is smooth around rest [m/s]."""
    found = scales(law, N)
    return found, found.velocity if isinstance(law, Population) else float(law.velocity_scale)


def window(law: AnyLaw, N: float) -> float:
    """Return the half width of the window around rest [m/s].

    It is 5 Stribeck velocities, but at most 50 smoothing velocities. For a law with viscous
    friction only it is 1 m/s.
    """
    if set(phenomena(law)) == {"V"}:
        return 1.0
    found, smooth = _velocities(law, N)
    return min(5 * found.velocity, LAYERS * smooth)


def decades(law: AnyLaw, N: float) -> tuple[float, float]:
    """Return the range of velocities [m/s] that shows the whole steady curve.

    It extends from a hundredth of the smallest velocity scale of the law to a hundred times its
    Stribeck velocity, or to the velocity at which viscous friction has doubled the peak.
    """
    if set(phenomena(law)) == {"V"}:
        return 1e-3, 10.0
    found, smooth = _velocities(law, N)
    v = np.geomspace(2 * found.velocity, 100 * found.velocity, 201)
    viscous = np.flatnonzero(np.abs(steady_force(law, v, N)) > 2 * found.static)
    high = v[viscous[0]] if viscous.size else v[-1]
    return 1e-2 * min(found.velocity, smooth), float(high)


def _behaviour(axis: Axes, data: FigureData, panel: tuple[str, str], laws: Sequence[str]) -> None:
    """Draw a behaviour in a panel: all cases of a single law, or the first case of each law."""
    several = len(laws) > 1
    first = {c.law: c.case for c in reversed(data.curves)}
    drawn = [c for c in data.curves if not several or c.case == first[c.law]]
    draw_curves(axis, data, panel, drawn, laws if several else ())
    axis.set_title(
        TITLES.get(data.name, f"sliding, over {panel[0]}"), loc="left", fontsize="medium"
    )
    if data.note:
        axis.text(
            0.02, 0.98, "\n".join(textwrap.wrap(data.note, 40)), transform=axis.transAxes,
            va="top", fontsize="xx-small",
        )  # fmt: skip
    if not several and len(drawn) > 1:
        axis.legend(fontsize="x-small", handlelength=1.8, framealpha=0.6)
    axis.tick_params(labelsize="small")


TITLES = {
    "hysteresis": "pre-sliding, loops in a loop",
    "lag": "lag, v up and down",
    "transition": "reversals at 2 Hz",
    "velocity_step": "v ten times, and back",
    "dwell": "peak after a rest",
    "stiction": "stiction, pulled to and fro",
}
"""Titles of the panels of behaviours, by name of the figure."""


def plot_catalogue(
    laws: Mapping[str, AnyLaw], N: float = 1.0, path: str | Path | None = None
) -> Figure:
    """Draw the force in steady sliding over the velocity, in one small panel per law.

    Args:
        laws: laws with numerical parameters, by title.
        N: normal force [N].
        path: image file.
    """
    columns = 6
    rows = -(-len(laws) // columns)
    figure, tiles = grid(rows, columns, 11.0, 0.6 + 1.35 * rows)
    axes = list(chain(*tiles))
    for axis in axes[len(laws) :]:
        axis.set_visible(False)
    for axis, (label, law) in zip(axes, laws.items(), strict=False):
        edge = window(law, N)
        v = _around(edge, 300)
        F = steady_force(law, v, N)
        by_v, unit_v, by_F, unit_F = _units([law], v, [F])
        axis.plot(by_v * v, by_F * F, linewidth=1.2)
        axis.set_title(f"{label} [{unit_F}]", fontsize="x-small")
        edge *= by_v
        axis.set_xticks([-edge, 0.0, edge], labels=[f"{-edge:.3g}", unit_v, f"{edge:.3g}"])
        axis.locator_params(axis="y", nbins=4)
        axis.tick_params(labelsize="xx-small")
    figure.supxlabel("sliding velocity v, each panel with its unit", fontsize="small")
    figure.supylabel(f"force in steady sliding F, N = {N:g} N", fontsize="small")
    return save(figure, path)
