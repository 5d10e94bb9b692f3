"""`symfric run` and `symfric report`: simulate a scene with one friction law or several."""

import shlex
import sys
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from symfric import Law, SolveError, Trajectory, parameters, simulate
from symfric.cli import options as opt
from symfric.cli import output
from symfric.cli.machines import (
    LawOfOption,
    LawsOption,
    PresetOption,
    SceneArgument,
    driven,
    kind_of,
    scenes_with,
)
from symfric.cli.options import option
from symfric.foundation import checks
from symfric.integrator import simulate_by_peer
from symfric.model import Model
from symfric.results.kinds import is_mechanism, kinds, norms
from symfric.scenes import MECHANISMS, Scene


def run(
    scene: SceneArgument,
    law: LawsOption,
    settings: opt.SetOption = None,
    preset: PresetOption = None,
    law_of: LawOfOption = None,
    inputs: opt.InputOption = None,
    x0: opt.StartOption = None,
    t_end: opt.EndOption = None,
    rtol: opt.RtolOption = 1e-6,
    method: Annotated[
        str, option("--method NAME", "Method: auto, rodas5p, rodas4p, rodas3, radau5, dopri5.")
    ] = "auto",
    backend: Annotated[
        str, option("--backend auto|vm|compiled", "Compiled C, or CasADi's virtual machine.")
    ] = "auto",
    peer: Annotated[
        str | None,
        option("--peer sundials|rosenbrock|ggl", "Use an integrator of CasADi, for comparison."),
    ] = None,
    max_step: Annotated[
        float | None, option("--max-step SECONDS", "Longest step [s]; default: no limit.")
    ] = None,
    times: Annotated[
        str | None, option("--times T1,T2,...", "Times [s] at which a step must end.")
    ] = None,
    samples: Annotated[int, option("--samples N", "Number of equally spaced output times.")] = 2001,
    csv: Annotated[Path | None, option("--csv --out FILE.csv", "Write the signals.")] = None,
    plot: opt.PlotOption = None,
    panels: Annotated[
        str,
        option("--panels main|all", "Panels of --plot; main: positions, friction, energy, power."),
    ] = "main",
    movie: Annotated[
        Path | None, option("--animate FILE.gif", "Write an animation: .gif, .html, .mp4.")
    ] = None,
    json: opt.JsonOption = None,
) -> None:
    """Simulate SCENE with a friction law.

    --set accepts parameters of the scene and of the law. For a robot, the coefficients of the law
    are relative: its break-away friction is the friction tag of each joint (--set level=0.5 for
    joints without a tag).

    Example: symfric run rabinowicz --law lugre --set mu_s=0.2 --plot stick_slip.png

    Example: symfric run pendulum_box --law lugre --preset jing_mi_table_7 --plot box.png

    Example: symfric run arm.urdf --law lugre --x0 elbow=0.3 --input tau_elbow=2 --csv arm.csv
    """
    kind_of(scene, preset=preset, law_of=law_of)
    how: Any = {"max_step": max_step, "times": opt.seconds("--times", times)}
    if peer is not None and (method, backend, max_step, times) != ("auto", "auto", None, None):
        raise ValueError(
            "--peer: expected no --method, --backend, --max-step or --times, got one of them"
        )
    laws = opt.law_names(law)
    if len(laws) > 1 and (csv or json or movie):
        raise ValueError(
            f"--csv, --json and --animate: expected one --law, got {len(laws)}; compare several "
            "with --plot"
        )
    opt.check_outputs(csv, json, movie, picture=plot)
    checks.choice("--panels", panels, ("main", "all"))
    machines = scenes_with(scene, laws, opt.assignments("--set", settings), preset, law_of)
    models = {name: machine.model() for name, machine in machines.items()}
    check_movie(movie, scene, models[laws[0]])
    machine = next(iter(machines.values()))
    given = driven(machine, models[laws[0]], inputs, x0, t_end)
    until = given.until
    found: dict[str, Trajectory] = {}
    common: Any = {"x0": given.start, "u": given.signals, "rtol": rtol, "samples": samples}
    common |= {"throw": False}
    for name, model in models.items():
        with output.progress(f"{scene} with {name}") as tell:
            if peer is None:
                how |= {"method": method, "backend": backend, "progress": tell}
                found[name] = simulate(model, until, **common, **how)
            else:
                found[name] = simulate_by_peer(model, until, peer, **common)
    if csv:
        next(iter(found.values())).to_csv(csv)
    if plot:
        from symfric.results.pictures import plot_trajectories  # noqa: PLC0415  (matplotlib is slow)

        plot_trajectories(found, path=plot, panels=panels)
    if movie:
        with output.progress(f"{movie}") as tell:
            next(iter(found.values())).animate(movie, progress=tell)
    for name, trajectory in found.items():
        output.emit_json(to_dict(name, machines[name], trajectory) | {"inputs": given.texts}, json)
        if json != "-":
            show_trajectory(name, trajectory)
            show_warnings(name, machines[name])
    output.say_written(csv, plot, movie, json)
    refuse_failed(found)


def refuse_failed(found: Mapping[str, Trajectory]) -> None:
    """Raise an error for the first run that did not reach its end.

    Raises:
        SolveError: message and partial result of that run.
    """
    for run in found.values():
        if not run.status.ok:
            raise SolveError(run.message, run.status, run)


def check_movie(path: Path | None, scene: str, model: Model) -> None:
    """Check before the work starts that an animation can be written.

    Raises:
        ValueError: a scene without geometry, or an unknown file format.
    """
    if path is None:
        return
    if model.sketch is None:
        raise ValueError(
            f"--animate: expected a scene with geometry, such as {', '.join(MECHANISMS)}, got "
            f"{scene}; --plot shows its signals"
        )
    from symfric.results.animation import check_format  # noqa: PLC0415  (matplotlib is slow)

    check_format(path)


def to_dict(law: str, scene: Scene, trajectory: Trajectory) -> dict[str, Any]:
    """Return the content of `--json`."""
    books: dict[str, Any] = {}
    if is_mechanism(trajectory.model):
        books["energy_balance"] = trajectory.energy_balance().to_dict()
        books["constraints"] = largest_norms(trajectory)
    return {
        "scene": trajectory.scene,
        "law": law,
        "parameters": {name: p.value for name, p in parameters(scene).items()},
        "status": trajectory.status.name,
        "message": trajectory.message,
        "statistics": trajectory.statistics.to_dict(),
        "t_end": float(trajectory.t[-1]),
        "final": trajectory.final,
        "extremes": trajectory.extremes,
    } | books


def largest_norms(trajectory: Trajectory) -> dict[str, float]:
    """Return the largest violation of the constraints on each level."""
    return {name: float(trajectory[name].max()) for name in norms(trajectory.model)}


def show_warnings(law: str, scene: Scene) -> None:
    """Print warnings about changed parameters of the laws; `symfric laws` warns of defaults."""
    held = (getattr(scene, item.name) for item in fields(scene))
    for value in held:
        chosen = isinstance(value, Law) and any(
            p.value != p.default for p in parameters(value).values()
        )
        for warning in value.warnings() if chosen else ():
            output.show(f"Warning: {law}: {warning}.\n")


TABLE = ("position", "rate", "normal force", "friction", "energy")
"""Types of signals that the table of a mechanism shows; --csv and --json contain all."""


def show_trajectory(law: str, trajectory: Trajectory) -> None:
    """Print the range of every signal, the status and the cost of a simulation.

    For mechanisms the table is limited to the main signals, followed by constraints and energy.
    """
    s, names = trajectory.statistics, list(trajectory.units)
    mechanism = is_mechanism(trajectory.model)
    if mechanism:
        kind = kinds(trajectory.model)
        names = [n for n in names if kind.get(n) in TABLE and trajectory.units[n] != "W"]
    output.show_table(
        ["signal", "final", "least", "greatest", "unit"],
        [
            (name, trajectory.final[name], *trajectory.extremes[name], trajectory.units[name])
            for name in names
        ],
        title=f"{trajectory.scene} with {law}, 0 ... {trajectory.t[-1]:g} s",
    )
    if mechanism:
        show_books(trajectory)
    ended = trajectory.message
    if not trajectory.status.ok:
        ended = f"{trajectory.status.name}: see the last line for the reason."
    output.show(
        f"{ended}\n{s.method} ({s.backend}): {s.steps} steps, "
        f"{s.rejections} rejected, built in {s.build_time + s.compile_time:.2f} s, "
        f"run in {s.run_time:.2f} s\n"
    )


def show_books(trajectory: Trajectory) -> None:
    """Print the largest constraint violations and the energy balance."""
    levels = largest_norms(trajectory)
    if levels:
        text = ", ".join(
            f"{name.removeprefix('constraint_')} {x:.1e} {trajectory.units[name]}".rstrip()
            for name, x in levels.items()
        )
        output.show(f"Largest constraint violations: {text}")
    balance = trajectory.energy_balance()
    work = "".join(f", {name} {w[-1]:+.6g} J" for name, w in balance.work.items() if w.any())
    output.show(
        f"Energy: {balance.energy[0]:.6g} -> {balance.energy[-1]:.6g} J{work}; "
        f"unexplained at most {np.abs(balance.defect).max():.1e} J "
        f"({balance.relative:.1e} of the energy exchanged)"
    )


def report(
    scene: SceneArgument,
    law: LawsOption,
    html: Annotated[Path, option("--html --out FILE.html", "HTML page to write.")] = Path(
        "report.html"
    ),
    settings: opt.SetOption = None,
    preset: PresetOption = None,
    law_of: LawOfOption = None,
    inputs: opt.InputOption = None,
    x0: opt.StartOption = None,
    t_end: opt.EndOption = None,
    rtol: opt.RtolOption = 1e-6,
) -> None:
    """Simulate SCENE and write a report of signals, friction, errors and laws.

    The error of every run is measured with another method at a hundredth of the tolerance. The HTML
    page is self-contained and includes the laws with their limits and the command.

    Example: symfric report rabinowicz --law lugre --law brown_mcphee --html report.html
    """
    from symfric.results.report import report as write_report  # noqa: PLC0415  (not for `run`)

    opt.check_outputs(html)
    laws = opt.law_names(law)
    machines = scenes_with(scene, laws, opt.assignments("--set", settings), preset, law_of)
    models = {name: machine.model() for name, machine in machines.items()}
    machine = next(iter(machines.values()))
    given = driven(machine, models[laws[0]], inputs, x0, t_end)
    how: Any = {"x0": given.start, "u": given.signals, "rtol": rtol, "samples": 2001}
    found: dict[str, Trajectory] = {}
    for name, model in models.items():
        with output.progress(f"{scene} with {name}") as tell:
            found[name] = simulate(
                model, given.until, **how, throw=False, measure_error=True, progress=tell
            )
    write_report(
        found,
        html,
        settings={name: parameters(machine) for name, machine in machines.items()},
        command=output.printable(shlex.join(["symfric", *sys.argv[1:]])),
    )
    output.say_written(html)
    refuse_failed(found)
