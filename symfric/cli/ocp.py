"""`symfric ocp`: solve a predefined optimal control problem, or a problem in a Python file."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import cast, get_args

from ocp import Problem, Solution, load, solve
from ocp.problems import READY, Ready
from ocp.solving.active import Sensitivity
from ocp.solving.methods import Fatrop, Ipopt, Sqp
from ocp.strategies import Friction
from ocp.transcription.schemes import Legendre, Radau, Scheme, Shooting
from symfric import SolveError
from symfric.cli import options as opt
from symfric.cli import output
from symfric.foundation.parameters import check_names

SOLVERS = {"ipopt": Ipopt, "fatrop": Fatrop, "sqp": Sqp}
TREATMENTS = get_args(Friction)


def ocp(
    problem: str | None = None,
    settings: list[str] | None = None,
    intervals: int | None = None,
    scheme: str = "radau3",
    solver: str = "ipopt",
    friction: str = "auto",
    tolerance: float = 1e-3,
    resting_margin: float = 1e-4,
    max_time: float | None = None,
    guess: Path | None = None,
    starts: int | None = None,
    workers: int = 1,
    refine: bool = True,
    verify: bool = True,
    sensitivity: str | None = None,
    save: Path | None = None,
    csv: Path | None = None,
    plot: Path | None = None,
    json: str | None = None,
) -> None:
    """Solve an optimal control problem and check it.

    Without a name, the command lists the ready problems. --set accepts the parameters of a ready
    problem, or of a function in a file.

    Example: symfric ocp out_and_back --plot move.png

    Example: symfric ocp crane.py:swing --set length=2 --csv swing.csv

    Example: symfric ocp goddard --sensitivity "m at the end"
    """
    if problem is None:
        return output.show_table(
            ["problem", "cost J", "uncertainty", "description"],
            [[r.name, r.optimum, r.uncertain, r.title] for r in READY.values()],
            "Ready problems and their best known costs",
        )
    opt.check_outputs(csv, save, json, picture=plot)
    check_names("--solver", [solver], SOLVERS)
    check_names("--friction", [friction], TREATMENTS)
    values, ready = opt.numbers("--set", settings), None
    if problem.endswith(".py") or ".py:" in problem:
        request = opt.held_by_file("ocp", problem, "problem", values, "Problem", Problem)
    else:
        check_names("ocp", [problem], READY)
        ready = None if values else READY[problem]
        request = opt.called_with(problem, READY[problem].make, values)
    start = None if guess is None else load(guess)
    pool = opt.processes(workers)
    with output.progress(f"ocp {problem}") as tell, pool as executor:
        found = solve(
            request,
            scheme=scheme_of(scheme),
            solver=SOLVERS[solver](),
            friction=cast("Friction", friction),
            tolerance=tolerance,
            resting_margin=resting_margin,
            intervals=intervals,
            max_time=max_time,
            guess=start,
            starts=starts,
            executor=executor,
            refine=refine,
            verify=verify,
            progress=lambda now: tell(min(1.0, now.iteration / 1000)),
            throw=False,
        )
    names = (sensitivity or "").split(",") if sensitivity and found.ok else []
    rates = [found.sensitivity(name.strip()) for name in names]
    show = partial(show_solution, problem, found, ready, rates)
    rows = {r.name: {"dJ": r.cost, "dT": r.T, "doubts": list(r.doubts)} for r in rates}
    files = (csv, found.to_csv), (save, found.save), (plot, found.plot)
    output.finish(found.to_dict() | {"sensitivities": rows}, json, show, *files)
    if not found.ok:
        raise SolveError(found.message, found.status, found)
    return None


def scheme_of(text: str) -> Scheme:
    """Return the transcription scheme of `--scheme`.

    Raises:
        ValueError: a text that does not have the form radau3, legendre4 or shooting:METHOD:STEPS.
    """
    for kind, scheme in {"radau": Radau, "legendre": Legendre}.items():
        degree = text.removeprefix(kind)
        if degree != text and (degree == "" or degree.isdigit()):
            return scheme(int(degree)) if degree else scheme()
    name, *rest = text.split(":")
    if name == "shooting" and len(rest) <= 2 and all(part.isdigit() for part in rest[1:]):
        return Shooting((rest or ["rodas5p"])[0], *map(int, rest[1:]))
    raise ValueError(f"--scheme: expected radau3, legendre4 or shooting:METHOD:STEPS, got '{text}'")


def show_solution(
    name: str, found: Solution, ready: Ready | None, rates: Sequence[Sensitivity]
) -> None:
    """Print the solution, its verification, the modes of contacts and sensitivities."""
    s = found.statistics
    row: dict[str, str | float] = {"duration T [s]": found.T, "cost J": found.cost}
    if ready is not None:
        row["best known J"] = ready.optimum
        row["difference [%]"] = (found.cost / ready.optimum - 1) * 100
    row["verified"] = "yes" if found.verified else "no"
    row["iterations"] = found.iterations
    row["time [s]"] = round(s.build_time + s.solve_time + s.verify_time, 2)
    output.show_table([*row], [[*row.values()]], name)
    if found.modes:
        rows = [(c, m.kind, m.begin, m.end) for c, modes in found.modes.items() for m in modes]
        output.show_table(["contact", "mode", "from [s]", "to [s]"], rows, "Modes")
    if found.soft:
        rows = [(n, p.cost, p.violation, p.time) for n, p in found.soft.items()]
        output.show_table(["soft condition", "cost", "largest violation", "at [s]"], rows)
    if found.chosen:
        output.show_table(["chosen parameter", "value"], [[*pair] for pair in found.chosen.items()])
    if rates:
        rows = [(r.name, r.unit, r.cost, r.T, "; ".join(r.doubts)) for r in rates]
        heads = ["p", "unit", "dJ/dp", "dT/dp [s/unit]", "doubts"]
        output.show_table(heads, rows, "Sensitivities with fixed active conditions and modes")
    output.show(f"\n{found.message}")
