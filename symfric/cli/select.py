"""`symfric select`: rank friction laws on a machine and recommend one."""

import signal
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import replace
from os import cpu_count
from pathlib import Path
from textwrap import fill
from time import perf_counter
from typing import Annotated, Any

import typer

from symfric import Law, SolveError, Status, law_from_text, parameters, with_values
from symfric.choice import NEEDS, Choice, Friction
from symfric.choice import select as select_law
from symfric.choice.nature import forms, lacking, needed
from symfric.choice.ranking import LEGEND, lines
from symfric.cli import completions, output
from symfric.cli import options as opt
from symfric.cli.identify import Reading, reading, residuals_of
from symfric.cli.machines import LawOfOption, PresetOption, formed, kind_of
from symfric.cli.options import argument, option
from symfric.figures.data import phenomena
from symfric.foundation import checks
from symfric.foundation.parameters import check_names, options
from symfric.laws import ALL_LAWS
from symfric.scenes import Scene


def select(
    scene: Annotated[
        str,
        argument(
            "SCENE",
            "A scene, FILE.urdf, or FILE.py[:NAME], a function law -> Model.",
            completions.scenes,
        ),
    ],
    need: Annotated[
        str, option("--need WORD,...", f"Required: {', '.join(NEEDS)}.", completions.needs)
    ] = "stiction,stribeck",
    accuracy: Annotated[
        float, option("--accuracy NUMBER", "Largest error relative to the motion.")
    ] = 1e-4,
    law: Annotated[
        list[str] | None,
        option(
            "--law NAME[,NAME]",
            "Candidates, with commas or repeated; all laws by default.",
            completions.each_law,
        ),
    ] = None,
    settings: opt.SetOption = None,
    preset: PresetOption = None,
    law_of: LawOfOption = None,
    t_end: opt.EndOption = None,
    of: Annotated[
        str | None, option("--of SIGNAL,...", "Signals to compare; default: positions.")
    ] = None,
    control: Annotated[float, option("--control NUMBER", "Largest error of fixed steps.")] = 0.05,
    fixed_steps: Annotated[
        bool, option("--fixed-steps/--no-fixed-steps", "Measure fixed steps, too.")
    ] = True,
    effort: Annotated[
        float, option("--effort NUMBER", "Largest cost of a law, relative to the default.")
    ] = 1.0,
    workers: opt.WorkersOption = None,
    data: Annotated[
        list[str] | None, option("--data FILE", "Fit the candidates to these data first.")
    ] = None,
    kind: Annotated[
        str, option("--kind NAME", "Residuals of --data, see `symfric identify`.")
    ] = "inverse",
    columns: opt.ColumnOption = None,
    units: opt.UnitOption = None,
    missing: opt.MissingOption = "refuse",
    resample: opt.ResampleOption = False,
    normal_force: opt.NormalForceOption = 1.0,
    paper: Annotated[
        bool, option("--paper", "Compare with the tables of Jing and Mi; two scenes only.")
    ] = False,
    plot: opt.PlotOption = None,
    html: opt.HtmlOption = None,
    csv: Annotated[Path | None, option("--csv FILE.csv", "Write the table.")] = None,
    json: opt.JsonOption = None,
) -> None:
    """Rank friction laws on a machine and recommend one.

    With --data, candidates with the required phenomena are fitted first, and those are ranked that
    fit as well as the best. Without data, every law describes the same friction (--set mu_s=0.2
    --set mu_d=0.15, and v_s if known) and is smoothed as far as --accuracy allows. --set also
    accepts parameters of the scene, and --set lugre.sigma_1=2 sets a parameter of one law. If a law
    has an exact form with events, this form is tried first unless --set gms.form=smooth (or
    form=smooth, for all laws) chooses one. Ctrl-C returns the results so far.

    Example: symfric select rabinowicz --need stiction,stribeck --accuracy 1e-4 --html choice.html

    Example: symfric select my_machine.py:press --t-end 2 --need presliding
    """
    opt.check_outputs(html, csv, json, picture=plot)
    if paper:
        _paper(scene, json, any((law, settings, preset, law_of, plot, html, csv)))
        return
    words = needed("--need", [word for word in need.split(",") if word])
    machine, friction, candidates, formed_by_user = _resolved(scene, settings, preset, law_of, law)
    misfits = None
    if data:
        read = reading(columns, units, None, None, kind == "points", missing, resample)
        able = {n: c for n, c in candidates.items() if not lacking(words, phenomena(c))}
        candidates, misfits = fitted(able, read, data, kind, normal_force)
    with reported(f"select {scene}") as tell, stoppable():
        found = select_law(
            machine,
            {n: (c,) if n in formed_by_user else forms(c) for n, c in candidates.items()},
            needs=words,
            accuracy=accuracy,
            friction=friction,
            misfits=misfits,
            t_end=t_end,
            of=None if of is None else [name.strip() for name in of.split(",")],
            control=control,
            fixed_steps=fixed_steps,
            effort=effort,
            workers=cpu_count() or 1 if workers is None else workers,
            progress=tell,
        )
    for path, write in ((csv, found.to_csv), (plot, found.plot), (html, found.to_html)):
        if path:
            write(path)
    output.finish(found.to_dict(), json, lambda: show_choice(found), plot, html, csv)
    if found.interrupted:
        raise SolveError("select: interrupted", Status.INTERRUPTED, found)
    if found.best is None:
        raise SolveError(f"select: {found.verdict[0]}", Status.SOLVER_FAILED, found)


@contextmanager
def stoppable() -> Generator[None]:
    """Treat SIGTERM, as sent by `timeout`, as Ctrl-C, which returns the results so far."""

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


OFTEN = 10.0
"""Seconds between progress lines if standard error is not a terminal."""


@contextmanager
def reported(text: str) -> Generator[Callable[[str, float], None]]:
    """Report progress by a bar on a terminal, else by lines on standard error."""
    last = began = perf_counter()
    with output.progress(text) as tell:

        def say(name: str, share: float) -> None:
            nonlocal last
            tell(share)
            if not sys.stderr.isatty() and perf_counter() - last > OFTEN:
                last = perf_counter()
                output.note(f"{text}: {100 * share:.0f} % after {last - began:.0f} s, {name} last")

        yield say


OF_FRICTION = ("mu_s", "mu_d", "v_s")


def _resolved(
    scene: str,
    settings: list[str] | None,
    preset: str | None,
    law_of: list[str] | None,
    names: list[str] | None,
) -> tuple[Any, Friction | None, dict[str, Law], set[str]]:
    """Return machine, friction, candidates with --set applied, and names with a form in --set.

    Raises:
        ValueError: unknown names, parameters or forms.
    """
    given = opt.assignments("--set", settings)
    friction = _numbers({n: given.pop(n) for n in OF_FRICTION if n in given})
    texts = opt.law_names(names) if names else list(ALL_LAWS)
    laws = {text: law_from_text(text) for text in texts}
    chosen = _formed(laws, given)
    for key in [key for key in given if "." in key]:
        of, _, own = key.rpartition(".")
        check_names(f"--set {key}", [of], laws)
        if own in options(laws[of]):
            chosen.add(of)
        laws[of] = opt.with_settings(laws[of], of, [f"{own}={given.pop(key)}"])
    if ".py" in scene:
        machine: Any = opt.function_of_file("select", scene, "machine", _numbers(given))
    else:
        machine = _with(kind_of(scene, preset=preset, law_of=law_of), scene, given)
    levels = Friction(**friction) if friction else None
    return machine, levels, laws, chosen


def _formed(laws: dict[str, Law], given: dict[str, str]) -> set[str]:
    """Remove options of laws from `given` and set them in all laws that have them.

    Returns:
        Names of these laws.

    Raises:
        ValueError: an option value that no law has.
    """
    chosen: set[str] = set()
    every = [(n, o) for n, law in laws.items() for o in options(law).values()]
    for name in [name for name in given if any(o.name == name for _, o in every)]:
        own = [(law, o) for law, o in every if o.name == name]
        text = given.pop(name)
        checks.choice(
            f"--set {name}", text, list(dict.fromkeys(c for _, o in own for c in o.choices))
        )
        for law, o in own:
            if text in o.choices:
                laws[law] = replace(laws[law], **{name: text})
                chosen.add(law)
    return chosen


def _with(kind: Callable[[Law], Scene], scene: str, texts: dict[str, str]) -> Any:
    """Return the scene with its own settings of --set: parameters, forms, structure."""
    if not texts:
        return kind
    one = kind(law_from_text("coulomb"))
    forms = (*options(one), *one.structures())
    made = {n: text for n, text in texts.items() if n in forms}
    own = set(parameters(one.law))
    known = [n for n in parameters(formed(one, made)) if n not in own]
    check_names(f"--set of {scene}", texts, [*known, *forms, *OF_FRICTION])
    values = _numbers({n: text for n, text in texts.items() if n not in forms})

    def machine(law: Law) -> Scene:
        return with_values(formed(kind(law), made), values)

    machine.__name__ = scene
    return machine


def _numbers(texts: dict[str, str]) -> dict[str, float]:
    return {name: checks.parsed(f"--set {name}", text) for name, text in texts.items()}


def fitted(
    laws: dict[str, Law], read: Reading, files: list[str], kind: str, normal_force: float
) -> tuple[dict[str, Law], dict[str, float]]:
    """Return the fitted laws and their relative errors.

    Laws that cannot be fitted are reported on standard error.

    Raises:
        ValueError: no law can be fitted.
    """
    from identification.select import select as rank_fits  # noqa: PLC0415  (only with data)

    chosen = residuals_of(kind, None, {})
    records = read.read(files)
    with output.progress("fit") as tell:
        ranking = rank_fits(
            list(laws), records, chosen, folds=0, normal_force=normal_force,
            progress=lambda _, share: tell(share),
        )  # fmt: skip
    found = {r.law: r for r in ranking.rows if r.fit is not None and r.fit.law is not None}
    for row in ranking.rows:
        if row.law not in found:
            output.note(f"{row.law}: {row.sentence}")
    if not found:
        raise ValueError("--data: expected data that some law fits, got none; see above")
    held = {name: row.fit.law for name, row in found.items() if row.fit and row.fit.law}
    return held, {name: row.fitted / 100 for name, row in found.items()}


def _paper(scene: str, json: str | None, others: bool) -> None:
    """Print the tables of the paper and those of symfric.

    Raises:
        ValueError: a scene that is not in the paper, or other options.
    """
    from symfric.gallery.selection.tables import TABLES, compare_with_paper  # noqa: PLC0415  (for --paper only)

    check_names("--paper of", [scene], TABLES)
    if others:
        raise ValueError("--paper: expected no option but --json, got others")
    with output.progress(f"select {scene} --paper") as tell:
        found = compare_with_paper(scene, progress=lambda _, share: tell(share))
    output.finish(found.to_dict(), json, lambda: typer.echo("\n".join(found.lines())))


def show_choice(found: Choice) -> None:
    """Print table, reasons and verdict."""
    for line in lines(found):
        typer.echo(line)
    typer.echo("\n" + fill(LEGEND, 80))
