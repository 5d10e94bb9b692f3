"""Commands `symfric bench`, `symfric gallery` and `symfric stress`, which take minutes to hours.

Benchmarks compare run time and error, as ratios measured in one run. The gallery reproduces the
figures of the papers. Stress tests verify random cases with an independent reference solver or with
other methods.
"""

import sys
from collections.abc import Iterable
from dataclasses import asdict
from functools import partial
from itertools import groupby
from pathlib import Path
from re import split
from textwrap import shorten
from time import monotonic
from typing import TYPE_CHECKING

import typer

from symfric.bench import PICTURES, SUBJECTS, measure
from symfric.cli import options as opt
from symfric.cli import output
from symfric.cli.app import INTERRUPTED
from symfric.foundation.files import check_folder, make_folder
from symfric.foundation.parameters import check_names

if TYPE_CHECKING:
    from symfric.bench.report import PrintedTable
    from symfric.gallery.rendering import Gallery
    from symfric.stress.campaign import Report
    from symfric.stress.cases import Case
    from symfric.stress.judge import Judgement

EVERY = 60.0
"""Interval between updates of the files of stress tests [s]."""


def bench(
    subject: str = "integrator",
    quick: bool = False,
    links: str | None = None,
    plot: Path | None = None,
    csv: Path | None = None,
    json: str | None = None,
) -> None:
    """Compare symfric with other tools in run time and error.

    integrator: stick-slip of one mass, and derivatives. calls: many short steps, and events.
    ensemble: ensembles, and the same runs one by one on one core. multibody: mechanisms, the cost
    and size of their equations, and energy. ivp: correct digits on problems with published
    solutions (Test Set for IVP Solvers). dynamics: periodic orbits and branches, with closed forms,
    long runs and AUTO-07p. regularisation: error of smooth laws relative to dry
    friction, over their width or stiffness. ocp: optimal control with dry friction in symfric,
    CasADi's Opti, rockit, nosnoc, do-mpc, opty and Dymos, judged by an independent simulation.
    starts: optimal control from random starts. interop: laws in Opti, rockit, do-mpc and CasADi's
    integrators. identification: fits from many starts and with many noise seeds,
    confidence intervals, measured machines, damaged files. codegen: generated C, its requirements,
    and C of CasADi. embedded: instructions and memory of generated C on Cortex-M cores under QEMU.

    In files and pipes each row is also printed on standard error as it is measured. Ctrl-C keeps
    the rows so far; the exit status is then 130. If a measurement fails, the others are made, and
    the exit status is 1.

    Example: symfric bench multibody --plot bench.png --csv runs.csv
    """
    check_names("bench", [subject], SUBJECTS)
    only = (("--links", links, ("multibody",)), ("--plot", plot, PICTURES))
    given = [o for o, value, where in only if value is not None and subject not in where]
    if given:
        raise ValueError(f"bench {subject}: expected no {', '.join(given)}, got one")
    opt.check_outputs(json, csv, picture=plot)
    sizes = {"links": lengths(links)} if links else {}
    with output.progress("measuring") as bar:

        def tell(item: str, fraction: float, row: str) -> None:
            bar(item, fraction)
            if row and not sys.stderr.isatty():
                output.note(row)

        result = measure(subject, quick, tell, **sizes)
    files = (plot, result.plot), (csv, result.write_csv)
    output.finish(result.to_dict(), json, lambda: show(result.shown()), *files)
    if result.interrupted:
        raise typer.Exit(INTERRUPTED)
    if result.failed:
        raise typer.Exit(1)


def show(shown: "Iterable[PrintedTable | str]") -> None:
    """Print tables and sentences."""
    for item in shown:
        if isinstance(item, str):
            output.show(item)
        else:
            output.show_table(item.head, item.rows, item.title)


def lengths(text: str) -> tuple[int, ...]:
    """Return the numbers of `--links` in increasing order.

    Raises:
        ValueError: the text is not a list of positive whole numbers separated by commas.
    """
    parts = text.split(",")
    if not all(part.strip().isdigit() and int(part) > 0 for part in parts):
        raise ValueError(f"--links: expected positive whole numbers such as 2,4,8, got '{text}'")
    return tuple(sorted({int(part) for part in parts}))


def gallery(
    names: list[str] | None = None,
    out: Path = Path("gallery"),
    quick: bool = False,
    workers: int | None = None,
    listed: bool = False,
) -> None:
    """Reproduce the figures of the source papers.

    Each figure states the compared quantities and their distance, observations of the paper that
    are reproduced, explanations that are refuted, and questions that the text does not decide. The
    command writes a picture and a JSON file of the numbers for every figure, and index.html with
    all figures. A figure that fails is reported, the others continue, and the exit status is 1.
    Ctrl-C keeps the finished figures; the exit status is then 130.

    Example: symfric gallery --list

    Example: symfric gallery self_tuning selection/fig_02 --out figures
    """
    from symfric.gallery import chosen, short  # noqa: PLC0415  (for this command only)
    from symfric.gallery.plate import about  # noqa: PLC0415  (for this command only)
    from symfric.gallery.rendering import render  # noqa: PLC0415  (for this command only)

    wanted = tuple(names or ())
    figures = chosen(wanted)
    if listed:
        for paper, group in groupby(figures, lambda name: about(name)["paper"]):
            output.show(f"\n{paper}")
            rows = [(short(name), about(name)["title"]) for name in group]
            output.show_table(["figure", "content"], rows)
        return
    if workers is not None and workers < 1:
        raise ValueError(f"gallery: expected --workers >= 1, got {workers}")
    make_folder(out)
    with output.progress(f"{len(figures)} figures") as tell:
        done = render(out, wanted, quick=quick, workers=workers, progress=tell)
    show_gallery(done)
    took = f"{len(done.records)} of {len(done.asked)} figures in {done.seconds:.0f} s"
    output.note(f"{took}, {'at reduced size, ' if quick else ''}wrote {out / 'index.html'}")
    if done.left or done.failures:
        raise typer.Exit(INTERRUPTED if done.left else 1)


def show_gallery(done: "Gallery") -> None:
    """Print comparisons, distances and failures."""
    from symfric.gallery import short  # noqa: PLC0415  (for this command only)

    for folder, names in groupby(done.records, lambda name: name.partition("/")[0]):
        records = {short(name).partition("/")[2]: done.records[name] for name in names}
        paper = next(iter(records.values()))["paper"]
        output.show(f"{folder}: {paper}")
        # show the first sentence or clause of each comparison, on at most two lines of the table
        rows = [
            (name, shorten(split(r"(?<!\.)[.;:](?: |$)", r["compared"])[0], 84, placeholder=" ..."),
             r["how_far"], r["seconds"])
            for name, r in records.items()
        ]  # fmt: skip
        output.show_table(["figure", "comparison", "distance", "time [s]"], rows)
        output.show()
    for name, why in done.failures.items():
        output.note(f"symfric: {name} failed, {why}")
    if done.left:
        output.note(f"symfric: {done.left} of {len(done.asked)} figures were not computed")


def stress(
    cases: int = 500,
    seed: int = 1,
    case: Path | None = None,
    out: Path = Path("stress_cases"),
    workers: int | None = None,
    limit: float = 120.0,
    json: str | None = None,
) -> None:
    """Verify runs of random laws in random scenes.

    Half of the cases use ten laws and six scenes that have an independent implementation, solved by
    SciPy at 1e-10; the others are compared with other methods at smaller tolerances. Parameters,
    tolerances, methods, inputs and start values are also random. A case is right, refused, loose,
    undecided, silently wrong, not finite, a crash or a hang. The last four classes are failures:
    these cases are saved, and the exit status is 1. The files are updated every minute.

    Example: symfric stress --cases 1000 --seed 7 --json stress.json

    Example: symfric stress --case stress_cases/silent_7_123.json
    """
    from symfric.stress.campaign import campaign, rerun  # noqa: PLC0415  (for this command only)
    from symfric.stress.cases import Case  # noqa: PLC0415  (for this command only)
    from symfric.stress.judge import FAILING  # noqa: PLC0415  (for this command only)

    opt.check_outputs(json)
    if case is not None:
        one = Case.read(case)
        verdict = rerun(one, limit)
        content = {"case": one.to_dict(), "verdict": asdict(verdict)}
        output.finish(content, json, partial(show_verdict, one, verdict))
        passed = verdict.kind not in FAILING
    else:
        check_folder(out)
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
        files = ((path, None) for path in saved)
        output.finish(report.to_dict(), json, partial(show_report, report), *files)
    if not passed:
        raise typer.Exit(1)


def show_report(report: "Report") -> None:
    """Print the number of cases in each class, and the reasons."""
    from symfric.stress.judge import CLASSES  # noqa: PLC0415  (for this command only)

    rows: list[tuple[str, str, str]] = []
    for kind, count in report.classes.items():
        rows.append((kind, str(count), CLASSES[kind]))
        rows += [("", f"{n}", f"  {group}") for group, n in report.groups[kind].items()]
    done, asked = len(report.verdicts), report.asked
    title = f"{done} cases of seed {report.seed} in {report.seconds:.0f} s"
    output.show_table(["class", "cases", "meaning and reasons"], rows, title)
    errors = ", ".join(f"{name} {e:.3g}" for name, e in report.errors().items())
    output.show(f"Verified by the independent reference solver: {report.refereed}.")
    output.show(f"Errors of right and loose cases, in tolerances: {errors}.")
    if done < asked:
        output.show(f"Interrupted: {asked - done} of {asked} cases were not run.")


def show_verdict(case: "Case", verdict: "Judgement") -> None:
    """Print one case and its verdict."""
    group = f" ({verdict.group})" if verdict.group else ""
    output.show(
        f"{case.law} in {case.scene}, rtol {case.rtol:g}, {case.method}: {verdict.kind}{group}. "
        f"{verdict.reason}"
    )
