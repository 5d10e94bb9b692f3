"""Pictures of laws: the steady curve, and what else the law does."""

import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from math import isfinite
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from symfric.figures.data import Curve, FigureData, Scales, draw_curves, phenomena, scales
from symfric.figures.pushing import stiction
from symfric.figures.sliding import dwell, hysteresis, lag, transition, velocity_step
from symfric.foundation.panels import blank, dressed, grid, save
from symfric.foundation.parameters import parameters
from symfric.foundation.status import SolveError
from symfric.foundation.style import colour, dash, line
from symfric.foundation.units import readable, turned
from symfric.laws import AnyLaw, Law, Population, law_name, steady_force, steady_inputs
from symfric.laws.base.law import FORCE

Make = Callable[[AnyLaw, float, Scales], FigureData]

ACCELERATION = "dv"
"""Further input of a law that any motion offers."""


def natures(laws: Mapping[str, AnyLaw], N: float) -> list[FigureData]:
    """Return the behaviours that set `laws` (legend entry -> law) apart, each with all laws that
    have it.

    All get the amplitudes of the first that has it. A law with pre-sliding shows its hysteresis,
    and its lag or its reversals; one that needs the applied force how it sticks; one whose static
    friction grows with time the dwell; one that needs other inputs how they change it; a law of the
    velocity alone nothing: its steady curve says all. A law that fails in one of them is left out
    there, and the figure says why.
    """
    shown = {label: behaviours(law) for label, law in laws.items()}
    found: list[FigureData] = []
    for name in dict.fromkeys(name for own in shown.values() for name in own):
        able = {label: law for label, law in laws.items() if name in shown[label]}
        given = scales(next(iter(able.values())), N)
        parts: list[FigureData] = []
        failed: list[str] = []
        for label, law in able.items():
            try:
                parts.append(shown[label][name](law, N, given).named(label))
            except (SolveError, ValueError) as error:
                failed.append(f"{label} is left out: {error}")
        if parts:
            curves = tuple(curve for part in parts for curve in part.curves)
            found.append(replace(parts[0], curves=curves, note="; ".join(failed)))
    return found


def behaviours(law: AnyLaw) -> dict[str, Make]:
    """Name -> what makes the figure of a behaviour, for those that `law` is drawn with."""
    codes, needs = phenomena(law), () if isinstance(law, Population) else law.inputs
    own = [i for i in needs if i.name not in (FORCE, ACCELERATION)]
    if own:
        return {f"input_{i.name}": partial(over_input, name=i.name) for i in own}
    if FORCE in (i.name for i in needs):
        return {"stiction": stiction}
    found: dict[str, Make] = {}
    if "P" in codes:
        found["hysteresis"] = partial(hysteresis, speeds=(1.0,))
    if "L" in codes and "P" not in codes and "T" in codes:
        found["velocity_step"] = velocity_step
    elif "L" in codes:
        found["lag"] = partial(
            lag, frequencies=(50.0,) if isinstance(law, Population) else (5.0, 50.0)
        )
    elif "P" in codes:
        found["transition"] = partial(transition, frequencies=(2.0,))
    if "T" in codes and isinstance(law, Law):
        found["dwell"] = dwell
    return found


def over_input(law: AnyLaw, N: float, given: Scales, name: str) -> FigureData:
    """Force in steady sliding at the Stribeck velocity over one of the further inputs of a law.

    Over twice its nominal magnitude to both sides, the others as in pictures of steady sliding.
    """
    if not isinstance(law, Law):
        raise ValueError(f"over_input of {law_name(law)}: expected a law, got a population")
    own = {i.name: i for i in law.inputs}
    V, u = given.velocity, np.linspace(-2.0, 2.0, 401) * own[name].nominal
    others = {i.name: i.steady for i in law.inputs if i.name != name}
    v = np.full(u.shape, V)
    F = law.force(v, N, law.steady_state(v, N), **others, **{name: u})
    return FigureData(
        f"input_{name}",
        f"sliding at {V:.3g} m/s over {name}, N = {N:g} N",
        {name: own[name].unit, "F": "N"},
        ((name, "F"),),
        (Curve(law_name(law), "", {name: u, "F": np.asarray(F, dtype=float)}),),
    )


Array = NDArray[np.float64]
LAYERS = 50.0
"""Half of the window around rest, in velocities over which the law is smooth, at most."""
ABREAST = 3
"""Behaviours in a row."""


def plot_laws(laws: Mapping[str, AnyLaw], N: float = 1.0, path: str | Path | None = None) -> Figure:
    """One law, or several, in one picture: the steady curve, and what else the law does.

    Above stands the force in steady sliding over the velocity, around rest on a window that fits
    the law, and over decades of the velocity. Below stands what that curve cannot tell: hysteresis
    in pre-sliding, frictional lag, dwell, stiction (`symfric.figures.pictures`); a law of the
    velocity alone has nothing there. Each panel has its own axes. Laws of a turning contact have
    rad/s and N m.

    Args:
        laws: legend entry -> law, with numbers for parameters.
        N: normal force [N].
        path: image file.
    """
    shown = natures(laws, N)
    tiles = [(d, panel) for d in shown for panel in d.panels[: None if len(shown) == 1 else 1]]
    rows = -(-len(tiles) // ABREAST)
    figure = blank(7.5, 0.5 + 2.6 * (1 + rows) + 0.25 * (len(laws) > 1))
    places = figure.add_gridspec(1 + rows, 6)
    near, far = (dressed(figure.add_subplot(places[0, k : k + 3])) for k in (0, 3))
    _steady(near, far, laws, N)
    for k, (data, panel) in enumerate(tiles):
        row, at = divmod(k, ABREAST)
        width = 6 // min(ABREAST, len(tiles) - row * ABREAST)
        axis = figure.add_subplot(places[1 + row, at * width : (at + 1) * width])
        _behaviour(dressed(axis), data, panel, list(laws))
    inputs = dict.fromkeys(steady_inputs(law) for law in laws.values())
    figure.suptitle(
        f"{', '.join(laws)}   N = {N:g} N{''.join(inputs)}", x=0.01, ha="left", fontsize="large"
    )
    if len(laws) > 1:
        entries = near.get_legend_handles_labels()
        figure.legend(*entries, loc="outside lower center", ncols=4, fontsize="small")
    return save(figure, path)


def _steady(near: Axes, far: Axes, laws: Mapping[str, AnyLaw], N: float) -> None:
    """Return the steady curves around rest, and over decades; both in the units that suit the
    first.

    Thin, over decades: those while v < 0 of laws that are not odd.
    """
    half = max(window(law, N) for law in laws.values())
    fine = half * np.geomspace(1e-5, 1.0, 600)
    around = np.concatenate([-fine[::-1], [0.0], fine])
    ends = [decades(law, N) for law in laws.values()]
    over = np.geomspace(min(low for low, _ in ends), max(high for _, high in ends), 801)
    forces = [[steady_force(law, v, N) for v in (around, over, -over)] for law in laws.values()]
    (by_v, unit_v), (by_F, unit_F) = (
        readable("m/s", [around]),
        readable("N", [f[1] for f in forces]),
    )
    for k, (label, (F, ahead, back)) in enumerate(zip(laws, forces, strict=True)):
        near.plot(by_v * around, by_F * F, label=label, linewidth=1.4, **line(k))
        far.plot(by_v * over, by_F * ahead, label=label, linewidth=1.4, **line(k))
        if np.abs(back + ahead).max() > 1e-6 * np.abs(ahead).max():
            far.plot(
                by_v * over, -by_F * back, label=f"{label}: -F(-v)",
                linewidth=0.9, color=colour(k), linestyle=dash(k + 1),
            )  # fmt: skip
            far.legend(fontsize="x-small")
    far.set_xscale("log")
    low, high = far.dataLim.intervaly
    far.set_ylim(min(0.0, 1.08 * low), 1.08 * max(high, 0.0) or 1.0)
    if all(_turns(law) for law in laws.values()):
        unit_v, unit_F = turned(unit_v), turned(unit_F)
    for axis, title in ((near, "steady sliding, around rest"), (far, "over decades")):
        axis.set_title(title, loc="left", fontsize="medium")
        axis.set_xlabel(f"v [{unit_v}]")
        axis.set_ylabel(f"F [{unit_F}]")


def window(law: AnyLaw, N: float) -> float:
    """Half the window around rest [m/s]: 5 Stribeck velocities, 50 smoothing ones at most.

    A law that is viscous and no more has no velocity of its own: 1 m/s.
    """
    if set(phenomena(law)) == {"V"}:
        return 1.0
    V = scales(law, N).velocity
    layer = V if isinstance(law, Population) else float(law.velocity_scale)
    return min(5 * V, LAYERS * layer) if isfinite(layer) else 5 * V


def decades(law: AnyLaw, N: float) -> tuple[float, float]:
    """Return the velocities [m/s] between which the steady curve has all it has.

    From a hundredth of the least velocity on which the law changes to a hundred times the greatest,
    or to where viscous friction has doubled the peak.
    """
    if set(phenomena(law)) == {"V"}:
        return 1e-3, 10.0
    found = scales(law, N)
    layer = found.velocity if isinstance(law, Population) else float(law.velocity_scale)
    low = 1e-2 * min(found.velocity, layer)
    v = np.geomspace(2 * found.velocity, 100 * found.velocity, 201)
    over = np.flatnonzero(np.abs(steady_force(law, v, N)) > 2 * found.static)
    return low, float(v[over[0]] if over.size else v[-1])


def _turns(law: AnyLaw) -> bool:
    """Test for a law of a turning contact, by the units of its parameters."""
    return any(p.unit.startswith("rad/s") for p in parameters(law).values())


def _behaviour(axis: Axes, data: FigureData, panel: tuple[str, str], laws: Sequence[str]) -> None:
    """One behaviour in a panel of its own, and a legend where its cases differ."""
    several = len(laws) > 1
    drawn = [c for c in data.curves if not several or c.case == _first_case(data, c.law)]
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
"""Name of a figure -> title of its panel in the picture of a law."""


def _first_case(data: FigureData, law: str) -> str:
    return next(c.case for c in data.curves if c.law == law)


def plot_catalogue(
    laws: Mapping[str, AnyLaw], N: float = 1.0, path: str | Path | None = None
) -> Figure:
    """Friction force in steady sliding against velocity, a small panel with its own axes per law.

    Args:
        laws: title -> law, with numbers for parameters.
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
        v = np.concatenate([-(fine := edge * np.geomspace(1e-5, 1.0, 300))[::-1], [0.0], fine])
        F = steady_force(law, v, N)
        by_v, unit_v = readable("m/s", [v])
        by_F, unit_F = readable("N", [F])
        if _turns(law):
            unit_v, unit_F = turned(unit_v), turned(unit_F)
        axis.plot(by_v * v, by_F * F, linewidth=1.2)
        axis.set_title(f"{label} [{unit_F}]", fontsize="x-small")
        edge *= by_v
        axis.set_xticks([-edge, 0.0, edge], labels=[f"{-edge:.3g}", unit_v, f"{edge:.3g}"])
        axis.locator_params(axis="y", nbins=4)
        axis.tick_params(labelsize="xx-small")
    figure.supxlabel("sliding velocity v, each panel with its unit", fontsize="small")
    figure.supylabel(f"force in steady sliding F, N = {N:g} N", fontsize="small")
    return save(figure, path)
