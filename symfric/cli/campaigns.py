"""`symfric bench`, `symfric gallery`, `symfric stress`: what is computed for minutes and hours.

Benchmarks are run time against error, as ratios measured in one run; the gallery computes the
figures of the papers again; stress judges random cases by a referee or by other methods.
"""

from collections.abc import Iterable
from itertools import groupby
from pathlib import Path
from re import split
from textwrap import shorten
from time import monotonic
from typing import TYPE_CHECKING, Annotated

import typer

from symfric.cli import completions, output
from symfric.cli import options as opt
from symfric.cli.options import argument, option
from symfric.foundation.files import make_folder
from symfric.foundation.parameters import check_names

if TYPE_CHECKING:
    from symfric.bench.table import Table
    from symfric.gallery.rendering import Gallery
    from symfric.stress.campaign import Report
    from symfric.stress.cases import Case
    from symfric.stress.judge import Verdict

SUBJECTS = (
    "integrator",
    "calls",
    "ensemble",
    "multibody",
    "ivp",
    "jitter",
    "regularisation",
    "ocp",
    "interop",
    "identification",
    "codegen",
    "embedded",
)
TABLES = ("calls", "ensemble", "embedded", "interop")
"""Subjects without a picture."""


def _completed(incomplete: str) -> list[str]:
    return [subject for subject in SUBJECTS if subject.startswith(incomplete)]


def bench(
    subject: Annotated[
        str,
        argument(
            "SUBJECT", f"What to measure, default integrator: {', '.join(SUBJECTS)}.", _completed
        ),
    ] = "integrator",
    quick: Annotated[bool, option("--quick", "Fewer points, fewer others.")] = False,
    links: Annotated[
        str | None, option("--links N,N,...", "Lengths of chains; multibody only.")
    ] = None,
    plot: opt.PlotOption = None,
    csv: Annotated[
        Path | None, option("--csv FILE.csv", "Runs of multibody, regularisation.")
    ] = None,
    json: opt.JsonOption = None,
) -> None:
    """Measure symfric beside other integrators.

    Time, error and ratios at equal error. integrator: stick-slip of one mass, ensembles and
    derivatives. calls: many short steps, events, gradients, signals, import. ensemble: members side
    by side beside the same one by one, on one core. multibody: mechanisms,
    the cost of their steps, what they do not need, reference numbers. ivp: correct digits on
    problems with published solutions (Test Set for IVP Solvers). jitter: total variation of
    accelerations against law, step and transition velocity. regularisation: error of smooth laws
    against dry friction, over their width or stiffness. ocp: optimal control from many starts,
    whether it lands, large programs, controllers; beside CasADi's Opti and rockit. interop: laws in
    Opti, rockit, do-mpc and CasADi's integrators, as their users write them. identification:
    fits from many starts and noises, their intervals, measured machines, damaged files. codegen:
    generated C beside its goals and CasADi's own. embedded: its instructions and bytes on Cortex-M
    cores, under QEMU.

    Example: symfric bench multibody --plot bench.png --csv runs.csv
    """
    check_names("bench", [subject], SUBJECTS)
    drawn = tuple(name for name in SUBJECTS if name not in TABLES)
    only = (
        ("--links", links, ("multibody",)),
        ("--csv", csv, ("multibody", "regularisation")),
        ("--plot", plot, drawn),
    )
    given = [o for o, value, where in only if value is not None and subject not in where]
    if given:
        raise ValueError(f"bench {subject}: expected no {', '.join(given)}, got one")
    opt.check_outputs(json, csv, picture=plot)
    from symfric import bench as measures  # noqa: PLC0415  (only this command needs it)

    sizes = {"links": lengths(links)} if links else {}
    with output.progress("measuring") as tell:
        result = getattr(measures, f"bench_{subject}")(
            quick=quick, progress=output.unnamed(tell), **sizes
        )
    if plot:
        result.plot(plot)
    if csv:
        result.write_csv(csv)
    output.emit_json(result.to_dict(), json)
    if json != "-":
        show(result.shown())
    output.say_written(plot, csv, json)


def show(shown: "Iterable[Table | str]") -> None:
    """Print tables and sentences."""
    for item in shown:
        if isinstance(item, str):
            output.show(item)
        else:
            output.show_table(item.head, item.rows, item.title)


def lengths(text: str) -> tuple[int, ...]:
    """The numbers of `--links`, increasing.

    Raises:
        ValueError: something else than positive whole numbers with commas between them.
    """
    parts = text.split(",")
    if not all(part.strip().isdigit() and int(part) > 0 for part in parts):
        raise ValueError(f"--links: expected positive whole numbers such as 2,4,8, got '{text}'")
    return tuple(sorted({int(part) for part in parts}))


INTERRUPTED = 130
"""Exit status after Ctrl-C, as of all commands."""


def gallery(
    names: Annotated[
        list[str] | None,
        argument("NAME", "A figure, or a paper; all if none is given.", completions.plates),
    ] = None,
    out: Annotated[Path, option("--out DIR", "Where pictures and numbers go.")] = Path("gallery"),
    quick: Annotated[bool, option("--quick", "At reduced size, a second a figure.")] = False,
    workers: opt.WorkersOption = None,
    listed: Annotated[bool, option("--list", "List the figures and compute none.")] = False,
) -> None:
    """Compute the figures of the papers again.

    Beside each: what is compared, how far we are, which observation is reproduced, which
    explanation refuted, and what the text leaves open. Writes a picture and a JSON file of its
    numbers for every figure, and index.html with all of them.
    Ctrl-C keeps what is done. A figure that fails is told, the others go on, and the exit status
    is 1; it is 130 after Ctrl-C.

    Example: symfric gallery --list

    Example: symfric gallery self_tuning selection/fig_02 --out figures
    """
    from symfric.gallery import chosen  # noqa: PLC0415  (of this command only)
    from symfric.gallery.rendering import render  # noqa: PLC0415  (likewise)

    asked = tuple(names or ())
    if listed:
        return show_list(chosen(asked))
    if workers is not None and workers < 1:
        raise ValueError(f"gallery: expected --workers >= 1, got {workers}")
    chosen(asked)
    make_folder(out)
    with output.progress(f"{len(chosen(asked))} figures") as tell:
        done = render(out, asked, quick=quick, workers=workers, progress=tell)
    show_gallery(done)
    took = f"{len(done.records)} of {len(done.asked)} figures in {done.seconds:.0f} s"
    output.note(f"{took}, {'at reduced size, ' if quick else ''}wrote {out / 'index.html'}")
    if done.left:
        raise typer.Exit(INTERRUPTED)
    if done.failures:
        raise typer.Exit(1)
    return None


def show_list(names: tuple[str, ...]) -> None:
    """Print what there is."""
    from symfric.gallery import short  # noqa: PLC0415  (of this command only)
    from symfric.gallery.plate import about  # noqa: PLC0415  (likewise)

    told = [(short(name), about(name)) for name in names]
    papers = dict.fromkeys(said["paper"] for _, said in told)
    for paper in papers:
        output.show(f"\n{paper}")
        rows = [(name, said["title"]) for name, said in told if said["paper"] == paper]
        output.show_table(["figure", "what it shows"], rows)


def show_gallery(done: "Gallery") -> None:
    """Print what is compared, how far we are, and what failed."""
    from symfric.gallery import short  # noqa: PLC0415  (of this command only)

    for folder, names in groupby(done.records, lambda name: name.partition("/")[0]):
        records = {name: done.records[name] for name in names}
        paper = next(iter(records.values()))["paper"]
        output.show(f"{folder}: {paper}")
        rows = [
            (
                short(name).partition("/")[2],
                brief(r["compared"]),
                r["how_far"],
                f"{r['seconds']:.1f}",
            )
            for name, r in records.items()
        ]
        output.show_table(["figure", "what is compared", "how far", "s"], rows)
        output.show()
    for name, why in done.failures.items():
        output.note(f"symfric: {name} failed, {why}")
    if done.left:
        output.note(f"symfric: {done.left} of {len(done.asked)} figures were not computed")


def brief(text: str) -> str:
    """The first sentence or clause, cut to two lines of the table."""
    return shorten(split(r"(?<!\.)[.;:](?: |$)", text)[0], 84, placeholder=" ...")


EVERY = 60.0
"""Time between two writings of the files [s]."""


def stress(
    cases: Annotated[int, option("--cases N", "How many cases.")] = 500,
    seed: Annotated[int, option("--seed N", "Which cases; the same N, the same cases.")] = 1,
    case: Annotated[Path | None, option("--case FILE", "Rerun one saved case.")] = None,
    out: Annotated[Path, option("--out DIR", "Where failing cases are kept.")] = Path(
        "stress_cases"
    ),
    workers: opt.WorkersOption = None,
    limit: Annotated[
        float, option("--limit SECONDS", "Processor time of a case; more counts as hanging.")
    ] = 120.0,
    json: opt.JsonOption = None,
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
    from symfric.stress.campaign import campaign, rerun  # noqa: PLC0415  (of this command only)
    from symfric.stress.cases import Case  # noqa: PLC0415  (likewise)
    from symfric.stress.judge import FAILING  # noqa: PLC0415  (likewise)

    opt.check_outputs(json)
    if case is not None:
        one = Case.read(case)
        verdict = rerun(one, limit)
        output.emit_json({"case": one.to_dict(), "verdict": verdict.to_dict()}, json)
        if json != "-":
            show_verdict(one, verdict)
        passed, saved = verdict.kind not in FAILING, []
    else:
        opt.check_folder(out)
        written = monotonic()
        with output.progress(f"{cases} cases") as show_fraction:

            def progress(report: "Report") -> None:
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


def show_report(report: "Report") -> None:
    """Print how many cases are of each class, and why they are not right."""
    from symfric.stress.judge import CLASSES  # noqa: PLC0415  (of this command only)

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


def show_verdict(case: "Case", verdict: "Verdict") -> None:
    """Print one case and what became of it."""
    output.show(
        f"{case.law} in {case.scene}, rtol {case.rtol:g}, {case.method}: {verdict.kind}"
        f"{f' ({verdict.group})' if verdict.group else ''}. {verdict.reason}"
    )
