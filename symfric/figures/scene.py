"""Scenes with several laws: the signals that all runs share."""

from collections.abc import Callable, Mapping

import casadi as ca

from symfric.figures.data import Curve, FigureData
from symfric.integrator import Input, simulate
from symfric.laws import Law
from symfric.scenes import ALL_SCENES

DEFAULT_T_END = {
    "rabinowicz": 20.0,
    "drive": 4.0,
    "quarter_car": 10.0,
    "pendulum": 10.0,
    "double_pendulum": 5.0,
    "pendulum_box": 15.0,
    "four_mass": 4.0,
    "slider_crank": 0.25,
    "four_bar": 3.0,
    "arm": 1.0,
}
"""Times [s] that show what the scene is about, such as three stick-slip periods."""


def sine(t: ca.SX) -> ca.SX:
    """Force 2 sin(pi t) N: beyond the default break-away force of 1.18 N in both directions."""
    return 2 * ca.sin(ca.pi * t)


DEFAULT_INPUT: dict[str, tuple[str, str, Callable[[ca.SX], ca.SX]]] = {
    "drive": ("force", "2 sin(pi t)", sine)
}
"""Input of a scene that is given none: name, text and function of time."""

PANELS = 5
"""Signals drawn at most; all of them are columns."""


def scene_figure(laws: Mapping[str, Law], scene: str) -> FigureData:
    """The signals of `scene` that its runs with each of `laws` share, over the default time.

    Columns t [s] and the shared signals; a curve for each legend entry of `laws`.
    """
    inputs: dict[str, Input] = {}
    if scene in DEFAULT_INPUT:
        name, _, function = DEFAULT_INPUT[scene]
        inputs[name] = function
    runs = {
        label: simulate(ALL_SCENES[scene](law).model(), DEFAULT_T_END[scene], u=inputs)
        for label, law in laws.items()
    }
    units = next(iter(runs.values())).units
    shared = [name for name in units if all(name in run.units for run in runs.values())]
    return FigureData(
        scene,
        scene,
        {"t": "s"} | {name: units[name] for name in shared},
        tuple(("t", name) for name in shared[:PANELS]),
        tuple(
            Curve(label, "", {"t": run.t} | {name: run[name] for name in shared})
            for label, run in runs.items()
        ),
    )
