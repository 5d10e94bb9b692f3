"""`symfric report`: one HTML page of simulations, for the drawer and for others."""

import shlex
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from symfric import SolveError, Trajectory, parameters, simulate
from symfric.cli import output
from symfric.cli.inputs import driven
from symfric.cli.machines import LawOfOption, LawsOption, PresetOption, SceneArgument, scenes_with
from symfric.cli.options import (
    RtolOption,
    SetOption,
    StartOption,
    assignments,
    check_outputs,
    law_names,
)
from symfric.results.report import report as write_report


def report(
    scene: SceneArgument,
    law: LawsOption,
    html: Annotated[
        Path, typer.Option("--html", "--out", metavar="FILE.html", help="Write one page of it all.")
    ] = Path("report.html"),
    settings: SetOption = None,
    preset: PresetOption = None,
    law_of: LawOfOption = None,
    inputs: Annotated[
        list[str] | None,
        typer.Option("--input", metavar="NAME=VALUE", help="Input, as of `run`."),
    ] = None,
    x0: StartOption = None,
    t_end: Annotated[
        float | None,
        typer.Option("--t-end", metavar="SECONDS", help="Last time [s]; default as of `run`."),
    ] = None,
    rtol: RtolOption = 1e-6,
) -> None:
    """Simulate SCENE and write one page: signals, friction, error, laws.

    The error of every run is measured by another formula at a hundredth of the tolerance. The page
    needs nothing from elsewhere; it holds the laws with their limits and how to run it again.

    Example: symfric report rabinowicz --law lugre --law brown_mcphee --html report.html
    """
    check_outputs(html)
    laws = law_names(law)
    machines = scenes_with(scene, laws, assignments("--set", settings), preset, law_of)
    models = {name: machine.model() for name, machine in machines.items()}
    machine = next(iter(machines.values()))
    given = driven(machine, models[laws[0]], inputs, x0, t_end)
    how: Any = {
        "x0": given.start,
        "u": given.signals,
        "rtol": rtol,
        "samples": 2001,
        "throw": False,
    }
    found: dict[str, Trajectory] = {}
    for name, model in models.items():
        with output.progress(f"{scene} with {name}") as tell:
            found[name] = simulate(model, given.until, **how, measure_error=True, progress=tell)
    write_report(
        found,
        html,
        settings={name: parameters(machine) for name, machine in machines.items()},
        command=output.printable(shlex.join(["symfric", *sys.argv[1:]])),
    )
    output.say_written(html)
    for trajectory in found.values():
        if not trajectory.status.ok:
            raise SolveError(trajectory.message, trajectory.status, trajectory)
