"""`symfric run` and `symfric report`: simulate a scene with one friction law or several."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from symfric import Law, SolveError, Trajectory, parameters, simulate
from symfric.cli import options as opt
from symfric.cli import output
from symfric.cli.machines import Driven, OwnMachine, driven, scenes_with
from symfric.cli.options import Strings
from symfric.foundation import checks
from symfric.integrator import simulate_by_peer
from symfric.integrator.methods.tableaux import ADAPTIVE as ADAPTIVE  # for options.toml
from symfric.model import Model
from symfric.results.kinds import friction_laws, is_mechanism, kinds, norms
from symfric.scenes import ALL_SCENES as ALL_SCENES  # for options.toml
from symfric.scenes import MECHANISMS, Robot, Scene


def run(
    scene: str,
    law: list[str],
    settings: Strings = None,
    preset: str | None = None,
    law_of: Strings = None,
    inputs: Strings = None,
    x0: Strings = None,
    t_end: float | None = None,
    friction_level: float | None = None,
    rtol: float = 1e-6,
    method: str = "auto",
    backend: str = "auto",
    peer: str | None = None,
    max_step: float | None = None,
    times: str | None = None,
    samples: int = 2001,
    csv: Path | None = None,
    plot: Path | None = None,
    panels: str = "main",
    movie: Path | None = None,
    json: str | None = None,
) -> None:
    """Simulate SCENE with a friction law.

    --set accepts parameters of the scene and of the law. For a robot, the coefficients of the law
    are relative: its break-away friction is the friction tag of each joint, or --friction-level.
    --set stop_stiffness=1e4 lets joints stop at their limits.

    Example: symfric run rabinowicz --law lugre --set mu_s=0.2 --plot stick_slip.png

    Example: symfric run pendulum_box --law lugre --preset jing_mi_table_7 --plot box.png

    Example: symfric run arm.urdf --law lugre --x0 elbow=0.3 --input tau_elbow=2 --csv arm.csv

    Example: symfric run my_machine.py:press --law lugre --t-end 2 --set stroke=0.1
    """
    if peer is not None and (method, backend, max_step, times) != ("auto", "auto", None, None):
        raise ValueError(
            "--peer: expected no --method, --backend, --max-step or --times, got one of them"
        )
    laws = opt.laws_of(law)
    if len(laws) > 1 and (csv or json or movie):
        raise ValueError(
            f"--csv, --json and --animate: expected one --law, got {len(laws)}; compare several "
            "with --plot"
        )
    opt.check_outputs(csv, json, movie, picture=plot)
    checks.choice("--panels", panels, ("main", "all"))
    ends = [] if times is None else times.split(",")
    stops = [checks.parsed("--times", end.strip()) for end in ends]
    settings = with_level(scene, settings, friction_level)
    machines, models, given = prepared(scene, laws, settings, preset, law_of, inputs, x0, t_end)
    chosen = next(iter(laws))
    check_movie(movie, scene, models[chosen])
    common: Any = {"x0": given.start, "u": given.signals, "rtol": rtol, "samples": samples}

    def integrate(model: Model, tell: Callable[[float], None]) -> Trajectory:
        if peer is not None:
            return simulate_by_peer(model, given.until, peer, **common, throw=False)
        return simulate(
            model, given.until, **common, method=method, backend=backend, max_step=max_step,
            times=stops, throw=False, progress=tell,
        )  # fmt: skip

    found = simulated(scene, models, integrate)
    first = found[chosen]
    if plot:
        from symfric.results.pictures import plot_trajectories  # noqa: PLC0415  (slow to import)

        # one run has no legend: its title names the laws that act
        shown = found if len(found) > 1 else {first.scene: first}
        plot_trajectories(shown, path=plot, panels=panels)
    if movie:
        with output.progress(f"{movie}") as tell:
            first.animate(movie, progress=tell)
    content = to_dict(chosen, machines[chosen], first) if json else {}
    show = partial(show_runs, found, machines)
    files = (csv, first.to_csv), (plot, None), (movie, None)
    output.finish(content | {"inputs": given.texts}, json, show, *files)
    refuse_failed(found.values())


def report(
    scene: str,
    law: list[str],
    html: Path = Path("report.html"),
    settings: Strings = None,
    preset: str | None = None,
    law_of: Strings = None,
    inputs: Strings = None,
    x0: Strings = None,
    t_end: float | None = None,
    friction_level: float | None = None,
    rtol: float = 1e-6,
) -> None:
    """Simulate SCENE and write a report of signals, friction, errors and laws.

    The error of every run is measured with another method at a hundredth of the tolerance. The HTML
    page is self-contained and includes the laws with their limits and the command.

    Example: symfric report rabinowicz --law lugre --law brown_mcphee --html report.html
    """
    from symfric.results.report import report as write_report  # noqa: PLC0415  (not for `run`)

    opt.check_outputs(html)
    laws = opt.laws_of(law)
    settings = with_level(scene, settings, friction_level)
    machines, models, given = prepared(scene, laws, settings, preset, law_of, inputs, x0, t_end)
    found = simulated(
        scene,
        models,
        lambda model, tell: simulate(
            model, given.until, x0=given.start, u=given.signals, rtol=rtol, measure_error=True,
            throw=False, progress=tell,
        ),
    )  # fmt: skip
    values = {name: parameters(machine) for name, machine in machines.items()}
    write_report(found, html, settings=values, command=output.command_line())
    output.say_written(html)
    refuse_failed(found.values())


def with_level(scene: str, settings: Strings, level: float | None) -> Strings:
    """Return the texts of --set, with the value of --friction-level.

    Raises:
        ValueError: a level for a scene that is not a robot.
    """
    if level is None:
        return settings
    if not scene.endswith(".urdf"):
        raise ValueError(f"--friction-level: expected with a robot's FILE.urdf, got {scene}")
    return [*(settings or ()), f"level={level!r}"]


def prepared(
    scene: str, laws: Mapping[str, Law], settings: Strings, preset: str | None, law_of: Strings,
    inputs: Strings, x0: Strings, t_end: float | None,
) -> tuple[dict[str, Scene], dict[str, Model], Driven]:  # fmt: skip
    """Return scene and model for each law, and inputs, start values and end time of the runs."""
    machines = scenes_with(scene, laws, settings, preset, law_of)
    models = {name: machine.model() for name, machine in machines.items()}
    first = next(iter(laws))
    return machines, models, driven(machines[first], models[first], inputs, x0, t_end)


def simulated(
    scene: str,
    models: Mapping[str, Model],
    integrate: Callable[[Model, Callable[[float], None]], Trajectory],
) -> dict[str, Trajectory]:
    """Return the runs of the models of a scene, by name of the law; show their progress."""
    found: dict[str, Trajectory] = {}
    for name, model in models.items():
        with output.progress(f"{scene} with {name}") as tell:
            found[name] = integrate(model, tell)
    return found


def refuse_failed(runs: Iterable[Trajectory]) -> None:
    """Raise an error for the first run that did not reach its end.

    Raises:
        SolveError: a run failed; the error has its message and its partial result.
    """
    for run in runs:
        if not run.status.ok:
            raise SolveError(run.message, run.status, run)


def check_movie(path: Path | None, scene: str, model: Model) -> None:
    """Check that an animation can be written, before the computation starts.

    Raises:
        ValueError: a scene without geometry, or an unknown file format.
    """
    if path is None:
        return
    if model.sketch is None or model.sketch().still:
        raise ValueError(
            f"--animate: expected a scene with geometry, such as {', '.join(MECHANISMS)}, got "
            f"{scene}; --plot shows its signals"
        )
    from symfric.results.animation import check_format  # noqa: PLC0415  (slow to import)

    check_format(path)


def to_dict(law: str, scene: Scene, trajectory: Trajectory) -> dict[str, Any]:
    """Return the content of `--json`."""
    found = {
        "scene": trajectory.scene,
        "law": law,
        "parameters": {name: p.value for name, p in parameters(scene).items()}
        | (dict(scene.values) if isinstance(scene, OwnMachine) else {}),
        "status": trajectory.status.name,
        "message": trajectory.message,
        "statistics": trajectory.statistics.to_dict(),
        "t_end": float(trajectory.t[-1]),
        "final": trajectory.final,
        "extremes": trajectory.extremes,
    }
    if is_mechanism(trajectory.model):
        found["energy_balance"] = trajectory.energy_balance().to_dict()
        found["constraints"] = largest_norms(trajectory)
    return found


def largest_norms(trajectory: Trajectory) -> dict[str, float]:
    """Return the largest violation of the constraints, by name of their norm."""
    return {name: float(trajectory[name].max()) for name in norms(trajectory.model)}


TABLE = ("position", "rate", "normal force", "friction", "energy")
"""Kinds of signals in the table of a mechanism; --csv and --json contain all signals."""


def show_runs(found: Mapping[str, Trajectory], machines: Mapping[str, Scene]) -> None:
    """Print the runs, and the warnings of laws whose parameters differ from the defaults.

    `symfric laws` prints the warnings about default values.
    """
    for name, trajectory in found.items():
        acting, machine = friction_laws(trajectory.model), machines[name]
        acts = not isinstance(machine, Robot) or type(machine.law).__name__ in acting
        show_trajectory(name if acts else acting or "no friction", trajectory)
        for held in (getattr(machines[name], item.name) for item in fields(machines[name])):
            if isinstance(held, Law) and any(
                p.value != p.default for p in parameters(held).values()
            ):
                for warning in held.warnings():
                    output.show(f"Warning: {name}: {warning}.\n")


def show_trajectory(law: str, trajectory: Trajectory) -> None:
    """Print the range of every signal, the status and the cost of a simulation.

    For mechanisms, the table contains only the main signals; constraints and energy follow it.
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
    levels = {
        name.removeprefix("constraint_"): f"{x:.1e} {trajectory.units[name]}".rstrip()
        for name, x in largest_norms(trajectory).items()
    }
    if levels:
        text = ", ".join(f"{name} {x}" for name, x in levels.items())
        output.show(f"Largest constraint violations: {text}")
    balance = trajectory.energy_balance()
    work = "".join(f", {name} {w[-1]:+.6g} J" for name, w in balance.work.items() if w.any())
    output.show(
        f"Energy: {balance.energy[0]:.6g} -> {balance.energy[-1]:.6g} J{work}; "
        f"unexplained at most {np.abs(balance.defect).max():.1e} J "
        f"({balance.relative:.1e} of the energy exchanged)"
    )
