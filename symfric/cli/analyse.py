"""`symfric analyse`: steady motions, periodic orbits and their stability over a parameter."""

from functools import partial
from pathlib import Path

from symfric import Law, simulate
from symfric.cli import options as opt
from symfric.cli import output
from symfric.cli.machines import OwnMachine, driven, scenes_with
from symfric.cli.options import Strings
from symfric.dynamics import Branch, continuation, equilibrium, orbits_from, periodic_orbit
from symfric.foundation import checks
from symfric.foundation.parameters import Variable, check_names, parameters
from symfric.model import Model
from symfric.model.kinds import MODE
from symfric.scenes import ALL_SCENES as ALL_SCENES  # for options.toml

STARTS = ("run", "equilibrium")


def analyse(
    scene: str,
    law: list[str],
    over: str,
    start: str = "run",
    settings: Strings = None,
    preset: str | None = None,
    law_of: Strings = None,
    x0: Strings = None,
    t_end: float | None = None,
    points: int = 200,
    longest: float = 0.05,
    state: str | None = None,
    plot: Path | None = None,
    html: Path | None = None,
    save: Path | None = None,
    json: str | None = None,
) -> None:
    """Follow steady motions or periodic orbits of SCENE over a parameter.

    The start is the orbit that a run settles to, or an equilibrium, whose Hopf points are followed
    by the orbits that begin there. Folds, Hopf points, period doublings and grazing are located.

    Example: symfric analyse rabinowicz --law exact_coulomb --set sigma_2=0.1 --over v_belt=0.05:0.5

    Example: symfric analyse rabinowicz --law lugre --over v_belt=0.05:0.5 --plot branches.png
    """
    opt.check_outputs(html, save, json, picture=plot)
    checks.choice("--from", start, STARTS)
    name, low, high = _range(over)
    laws = opt.laws_of(law)
    if len(laws) != 1:
        raise ValueError(f"--law: expected one law, got {len(laws)}; analyse one at a time")
    model, first, until = _machine(scene, laws, settings, preset, law_of, name, x0, t_end)
    own = next(v.name for v in model.x if v.kind != MODE) if state is None else state
    check_names("--state", [own], [v.name for v in model.x])
    (free,) = (v for v in (*model.u, *model.p) if v.name == name)
    given = {name: _inside(free, low, high)}
    u, p = (given, {}) if free in model.u else ({}, given)
    with output.progress(f"analyse {scene}") as tell:
        if start == "run":
            run = simulate(model, until, x0=first, u=u, p=p, progress=tell)
            orbit = periodic_orbit(model, run, u=u, p=p)
            branches = [continuation(orbit, name, (low, high), points=points, step=longest)]
        else:
            at = equilibrium(model, u=u, p=p, guess=first or None)
            rest = continuation(at, name, (low, high), points=points, step=longest)
            branches = [rest]
            for hopf in rest.located("Hopf"):
                branches.append(orbits_from(rest, hopf, (low, high), points=points, step=longest))
    content = {"scene": scene, "law": law[0], "branches": [b.to_dict() for b in branches]}
    draw = partial(branches[0].plot, own, *branches[1:])
    if html:
        branches[0].to_html(html, *branches[1:], state=own, command=output.command_line())
    files = (plot, draw), (html, None), (save, branches[-1].save)
    output.finish(content, json, partial(_show, branches), *files)


def _range(text: str) -> tuple[str, float, float]:
    """Return name, smallest and largest value of --over."""
    name, _, ends = text.partition("=")
    low, colon, high = ends.partition(":")
    if not (name.strip() and colon):
        raise ValueError(f"--over: expected NAME=LOW:HIGH, got '{text}'; such as v_belt=0.05:0.5")
    least, most = (checks.parsed(f"--over {name}", end.strip()) for end in (low, high))
    if not least < most:
        raise ValueError(f"--over {name}: expected LOW below HIGH, got {ends}")
    return name.strip(), least, most


def _inside(free: Variable, low: float, high: float) -> float:
    """Return the value of the parameter at the start: its own if it is in the range."""
    own = float(free.start)
    return own if low <= own <= high else (low + high) / 2


def _machine(
    scene: str, laws: dict[str, Law], settings: Strings, preset: str | None, law_of: Strings,
    name: str, x0: Strings, t_end: float | None,
) -> tuple[Model, dict[str, float], float]:  # fmt: skip
    """Return the model with a free parameter, the start values and the end time of a run."""
    (machine,) = scenes_with(scene, laws, settings, preset, law_of).values()
    of_file = isinstance(machine, OwnMachine)
    known = [] if of_file else [*parameters(machine)]
    model = machine.model([name] if name in known else [])
    known = [*known, *(v.name for v in (*model.p, *model.u))]
    check_names(f"--over of {scene}", [name], known, "a parameter p of the model, or an input")
    given = driven(machine, model, None, x0, 100.0 if of_file and t_end is None else t_end)
    if others := [one for one in given.signals if one != name]:
        raise ValueError(
            f"analyse {scene}: expected no inputs of time except that of --over, got "
            f"{', '.join(others)}; use periodic_orbit(..., period=) in Python"
        )
    longest = given.until if of_file else max(given.until, 5 * machine.t_end)
    return model, given.start, longest if t_end is None else t_end


def _show(branches: list[Branch]) -> None:
    """Print each branch with its special points."""
    for branch in branches:
        shown = branch.shown()
        output.show(shown.title)
        for line in shown.lines:
            output.show(f"  {line}")
        output.show()
        output.show_part(shown.table.header, shown.table.rows)
