"""Scenes with several laws: the signals that all runs share."""

from collections.abc import Mapping

from symfric.figures.data import Curve, FigureData
from symfric.integrator import Input, simulate
from symfric.laws import AnyLaw, Population, law_name
from symfric.laws.base.law import check_law
from symfric.model.kinds import ENERGY
from symfric.results.kinds import main
from symfric.results.trajectory import Trajectory
from symfric.scenes import ALL_SCENES

PANELS = 2
"""Signals of a kind that are drawn at most, of energies the sum; all of them are columns."""


def in_scene(law: AnyLaw, scene: str) -> Trajectory:
    """The run of `scene` with `law`, over the time that shows what it is about.

    Raises:
        ValueError: a population of contacts, a law that the scene refuses.
        SolveError: the simulation failed.
    """
    if isinstance(law, Population):
        raise ValueError(
            f"{scene} with {law_name(law)}: expected a law with equations, got a population of "
            "random contacts; it has figures"
        )
    check_law(scene, law)
    kind = ALL_SCENES[scene]
    inputs: dict[str, Input] = {name: given.function for name, given in kind.inputs.items()}
    return simulate(kind(law).model(), kind.t_end, u=inputs)


def scene_figure(scene: str, runs: Mapping[str, Trajectory]) -> FigureData:
    """The signals that `runs` (legend entry -> run of `scene`) share.

    Columns t [s] and the shared signals; a curve for each run. Drawn are positions, friction and
    energy or power.
    """
    first = next(iter(runs.values()))
    shared = {n: u for n, u in first.units.items() if all(n in run.units for run in runs.values())}
    groups = main(first.model, shared)
    drawn = [
        name
        for group in groups
        for name in (list(group.names)[-1:] if group.title == ENERGY else [*group.names][:PANELS])
    ]
    return FigureData(
        scene,
        scene,
        {"t": "s"} | shared,
        tuple(("t", name) for name in drawn or [*shared][: 2 * PANELS]),
        tuple(
            Curve(label, "", {"t": run.t} | {name: run[name] for name in shared})
            for label, run in runs.items()
        ),
    )
