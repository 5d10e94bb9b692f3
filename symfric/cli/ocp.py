"""`symfric ocp`: solve a ready optimal control problem, or one in a Python file."""

from functools import partial
from pathlib import Path
from typing import Annotated, Any, cast, get_args

from ocp import Problem, Solution, load, solve
from ocp.problems import READY, Ready
from ocp.solving.methods import Fatrop, Ipopt, Sqp
from ocp.strategies import Friction
from ocp.transcription.schemes import Legendre, Radau, Scheme, Shooting
from symfric import SolveError
from symfric.cli import completions, output
from symfric.cli import options as opt
from symfric.cli.options import argument, option
from symfric.foundation import checks
from symfric.foundation.parameters import check_names

SOLVERS = {"ipopt": Ipopt, "fatrop": Fatrop, "sqp": Sqp}
DEFAULT_NAME = "problem"
"""Default name of the problem in a Python file."""


def ocp(
    problem: Annotated[
        str | None,
        argument(
            "NAME|FILE.py[:NAME]",
            "A ready problem, or a `Problem` (or a function that returns one) in a file.",
            completions.problems,
        ),
    ] = None,
    settings: opt.SetOption = None,
    intervals: Annotated[
        int | None, option("--intervals N", "Number of equal intervals of the first mesh.")
    ] = None,
    scheme: Annotated[
        str, option("--scheme NAME", "radau3, legendre4, shooting:rodas5p:2 (method, steps).")
    ] = "radau3",
    solver: Annotated[
        str, option("--solver", "Solver of the nonlinear program.", metavar="|".join(SOLVERS))
    ] = "ipopt",
    friction: Annotated[
        str, option("--friction NAME", f"Treatment of friction: {', '.join(get_args(Friction))}.")
    ] = "auto",
    tolerance: Annotated[
        float, option("--tolerance NUMBER", "Largest relative violation of the end conditions.")
    ] = 1e-3,
    resting_margin: Annotated[
        float,
        option(
            "--resting-margin NUMBER",
            "Friction margin of a sticking contact, relative to its static level.",
        ),
    ] = 1e-4,
    max_time: Annotated[float | None, option("--max-time SECONDS", "Time limit.")] = None,
    guess: Annotated[Path | None, option("--guess FILE", "Start from a saved solution.")] = None,
    save: Annotated[
        Path | None, option("--save FILE", "Save the solution for a warm start.")
    ] = None,
    csv: Annotated[Path | None, option("--csv FILE.csv", "Write all signals.")] = None,
    plot: opt.PlotOption = None,
    json: opt.JsonOption = None,
) -> None:
    """Solve an optimal control problem and check it.

    Without a name, list the ready problems. --set accepts their parameters, and those of a function
    in a file.

    Example: symfric ocp out_and_back --plot move.png

    Example: symfric ocp crane.py:swing --set length=2 --csv swing.csv
    """
    if problem is None:
        return _list()
    opt.check_outputs(csv, save, json, picture=plot)
    check_names("--solver", [solver], SOLVERS)
    check_names("--friction", [friction], get_args(Friction))
    values = opt.numbers("--set", settings)
    ready, request = problem_of(problem, values)
    margin = checks.number("--resting-margin", resting_margin, above=0.0, upper=0.1)
    how: dict[str, Any] = {} if intervals is None else {"intervals": intervals}
    if max_time is not None:
        how["max_time"] = checks.number("--max-time", max_time, unit="s", above=0.0)
    if guess is not None:
        how["guess"] = load(guess)
    with output.progress(f"ocp {problem}") as tell:
        found = solve(
            request,
            scheme=scheme_of(scheme),
            solver=SOLVERS[solver](),
            friction=cast("Friction", friction),
            tolerance=tolerance,
            resting_margin=margin,
            progress=lambda now: tell(min(1.0, now.iteration / 1000)),
            throw=False,
            **how,
        )
    if csv:
        found.to_csv(csv)
    if save:
        found.save(save)
    if plot:
        found.plot(path=plot)
    show = partial(show_solution, problem, found, None if values else ready)
    output.finish(found.to_dict(), json, show, csv, save, plot)
    if not found.ok:
        raise SolveError(found.message, found.status, found)
    return None


def problem_of(text: str, values: dict[str, float]) -> tuple[Ready | None, Problem]:
    """Return the problem that `text` names, and its entry among the ready problems.

    Raises:
        ValueError: no such problem or file, an error in the file, or an object of another type.
    """
    _, _, name = text.partition(".py")
    if not (name == "" and text.endswith(".py")) and not name.startswith(":"):
        check_names("ocp", [text], READY)
        return READY[text], opt.called_with(text, READY[text].make, values)
    return None, opt.held_by_file("ocp", text, DEFAULT_NAME, values, "Problem", Problem)


def scheme_of(text: str) -> Scheme:
    """Return the transcription scheme of `--scheme`.

    Raises:
        ValueError: not of the form radau3, legendre4 or shooting:METHOD:STEPS.
    """
    kinds = {"radau": Radau, "legendre": Legendre}
    for kind, scheme in kinds.items():
        degree = text.removeprefix(kind)
        if degree != text and (degree == "" or degree.isdigit()):
            return scheme(int(degree)) if degree else scheme()
    name, *rest = text.split(":")
    if name == "shooting" and len(rest) <= 2 and all(part.isdigit() for part in rest[1:]):
        method = rest[:1] or ["rodas5p"]
        return Shooting(method[0], *(int(part) for part in rest[1:]))
    raise ValueError(f"--scheme: expected radau3, legendre4 or shooting:METHOD:STEPS, got '{text}'")


def _list() -> None:
    output.show_table(
        ["problem", "cost J", "uncertainty", "description"],
        [[r.name, r.optimum, r.uncertain, r.title] for r in READY.values()],
        "Ready problems and their best known costs",
    )


def show_solution(name: str, found: Solution, ready: Ready | None) -> None:
    """Print the solution, its verification and the modes of contacts."""
    spent = sum(getattr(found.statistics, f"{what}_time") for what in ("build", "solve", "verify"))
    known = [] if ready is None else [ready.optimum, (found.cost / ready.optimum - 1) * 100]
    output.show_table(
        ["duration T [s]", "cost J", *(["best known J", "difference [%]"] if known else []),
         "verified", "iterations", "time [s]"],
        [[found.T, found.cost, *known, "yes" if found.verified else "no", found.iterations,
          round(spent, 2)]],
        name,
    )  # fmt: skip
    if found.modes:
        output.show_table(
            ["contact", "mode", "from [s]", "to [s]"],
            [[contact, mode.kind, mode.begin, mode.end]
             for contact, modes in found.modes.items() for mode in modes],
            "Modes",
        )  # fmt: skip
    if found.chosen:
        output.show_table(["chosen parameter", "value"], [[*pair] for pair in found.chosen.items()])
    output.show(f"\n{found.message}")
