"""`symfric stress`: random cases, each judged by a referee or by other methods."""

from pathlib import Path
from time import monotonic
from typing import Annotated

import typer

from symfric.cli import output
from symfric.cli.options import JsonOption, WorkersOption, check_folder, check_outputs
from symfric.stress.campaign import Report, campaign, rerun
from symfric.stress.cases import Case
from symfric.stress.judge import CLASSES, FAILING, Verdict

EVERY = 60.0
"""Time between two writings of the files [s]."""


def stress(
    cases: Annotated[int, typer.Option("--cases", metavar="N", help="How many cases.")] = 500,
    seed: Annotated[
        int, typer.Option("--seed", metavar="N", help="Which cases; the same N, the same cases.")
    ] = 1,
    case: Annotated[
        Path | None, typer.Option("--case", metavar="FILE", help="Rerun one saved case.")
    ] = None,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Where failing cases are kept.")
    ] = Path("stress_cases"),
    workers: WorkersOption = None,
    limit: Annotated[
        float,
        typer.Option(
            "--limit", metavar="SECONDS", help="Processor time of a case; more counts as hanging."
        ),
    ] = 120.0,
    json: JsonOption = None,
) -> None:
    """Judge runs of random laws in random scenes.

    Half of the cases are of ten laws and six scenes that a referee has equations of its own for,
    solved by SciPy at 1e-10; the others are compared with other methods at smaller tolerances.
    Parameters by decades, tolerances, methods, inputs and start values are drawn, too. A case is
    right, refused, loose, undecided, silently wrong, not finite, a crash or a hang; the last four
    must not happen: their cases are saved, and the exit status is 1. The files are written every
    minute while the campaign runs.

    Example: symfric stress --cases 1000 --seed 7 --json stress.json

    Example: symfric stress --case stress_cases/silent_7_123.json
    """
    check_outputs(json)
    if case is not None:
        one = Case.read(case)
        verdict = rerun(one, limit)
        output.emit_json({"case": one.to_dict(), "verdict": verdict.to_dict()}, json)
        if json != "-":
            show_verdict(one, verdict)
        passed, saved = verdict.kind not in FAILING, []
    else:
        check_folder(out)
        written = monotonic()
        with output.progress(f"{cases} cases") as show_fraction:

            def progress(report: Report) -> None:
                nonlocal written
                show_fraction(len(report.verdicts) / report.asked)
                if monotonic() - written > EVERY:
                    report.save(out)
                    if json != "-":
                        output.emit_json(report.to_dict(), json)
                    written = monotonic()

            report = campaign(cases, seed, workers=workers, limit=limit, progress=progress)
        passed, saved = report.passed, report.save(out)
        output.emit_json(report.to_dict(), json)
        if json != "-":
            show_report(report)
    output.say_written(json, *saved)
    if not passed:
        raise typer.Exit(1)


def show_report(report: Report) -> None:
    """Print how many cases are of each class, and why they are not right."""
    rows: list[tuple[str, str, str]] = []
    for kind, count in report.classes.items():
        rows.append((kind, str(count), CLASSES[kind]))
        groups = report.groups[kind]
        rows += [("", f"{n}", f"  {group}") for group, n in groups.items()]
    done, asked = len(report.verdicts), report.asked
    output.show_table(
        ["class", "cases", "what it means, and why"],
        rows,
        title=f"{done} cases of seed {report.seed} in {report.seconds:.0f} s",
    )
    errors = ", ".join(f"{name} {e:.3g}" for name, e in report.errors().items())
    output.show(f"Judged by the referee, which shares no code with symfric: {report.refereed}.")
    output.show(f"Errors of what is right or loose, in tolerances: {errors}.")
    if done < asked:
        output.show(f"Interrupted: {asked - done} of {asked} cases were not run.")


def show_verdict(case: Case, verdict: Verdict) -> None:
    """Print one case and what became of it."""
    output.show(
        f"{case.law} in {case.scene}, rtol {case.rtol:g}, {case.method}: {verdict.kind}"
        f"{f' ({verdict.group})' if verdict.group else ''}. {verdict.reason}"
    )
