"""Scenes with several laws: the signals that all runs share."""

from collections.abc import Mapping

from symfric.figures.data import Curve, FigureData
from symfric.integrator import Input, simulate
from symfric.laws import Law
from symfric.scenes import ALL_SCENES

PANELS = 5
"""Signals drawn at most; all of them are columns."""


def scene_figure(laws: Mapping[str, Law], scene: str) -> FigureData:
    """The signals of `scene` that its runs with each of `laws` share, over the time that shows it.

    Columns t [s] and the shared signals; a curve for each legend entry of `laws`.
    """
    kind = ALL_SCENES[scene]
    inputs: dict[str, Input] = {name: given.function for name, given in kind.inputs.items()}
    runs = {label: simulate(kind(law).model(), kind.t_end, u=inputs) for label, law in laws.items()}
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
