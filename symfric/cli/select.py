"""`symfric select`: rank friction laws on a machine and recommend one."""

import signal
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from os import cpu_count
from pathlib import Path
from textwrap import fill
from time import perf_counter
from typing import Any

import typer

from symfric import Coulomb, Law, SolveError, Status, parameters
from symfric.choice import NEEDS as NEEDS
from symfric.choice import Friction
from symfric.choice import select as select_law
from symfric.choice.nature import forms, lacking, needed
from symfric.choice.ranking import LEGEND, lines
from symfric.cli import options as opt
from symfric.cli import output
from symfric.cli.identify import reader, residuals_of
from symfric.cli.machines import OwnMachine, kind_of, settable, with_set
from symfric.cli.options import Strings
from symfric.figures.data import phenomena
from symfric.foundation import checks
from symfric.foundation.parameters import check_names, options
from symfric.laws import ALL_LAWS
from symfric.scenes import Scene

OFTEN = 10.0
"""Interval between progress lines if standard error is not a terminal [s]."""
OF_FRICTION = ("mu_s", "mu_d", "v_s")


def select(
    scene: str,
    need: str = "stiction,stribeck",
    accuracy: float = 1e-4,
    law: Strings = None,
    settings: Strings = None,
    preset: str | None = None,
    law_of: Strings = None,
    t_end: float | None = None,
    of: str | None = None,
    control: float = 0.05,
    fixed_steps: bool = True,
    effort: float = 1.0,
    workers: int | None = None,
    data: Strings = None,
    kind: str = "inverse",
    columns: Strings = None,
    units: Strings = None,
    missing: str = "refuse",
    resample: bool = False,
    drive: Path | None = None,
    normal_force: float = 1.0,
    paper: bool = False,
    plot: Path | None = None,
    html: Path | None = None,
    csv: Path | None = None,
    json: str | None = None,
) -> None:
    """Rank friction laws on a machine and recommend one.

    With --data, the candidates with the required phenomena are fitted first, and only laws that fit
    as well as the best one are ranked. Without data, every law describes the same friction (--set
    mu_s=0.2 --set mu_d=0.15, and v_s if known) and is smoothed as far as --accuracy allows. --set
    also accepts parameters of the scene, and --set lugre.sigma_1=2 sets a parameter of one law. If
    a law has an exact form with events, this form is tried first, unless --set gms.form=smooth
    selects the form (or form=smooth for all laws). Ctrl-C returns the results so far.

    Example: symfric select rabinowicz --need stiction,stribeck --accuracy 1e-4 --html choice.html

    Example: symfric select my_machine.py:press --t-end 2 --need presliding
    """
    opt.check_outputs(html, csv, json, picture=plot)
    if paper:
        return _paper(scene, json, any((law, settings, preset, law_of, plot, html, csv)))
    words = needed("--need", [word for word in need.split(",") if word])
    given = opt.assignments("--set", settings)
    levels = opt.numbers("--set", {n: given.pop(n) for n in OF_FRICTION if n in given})
    candidates, formed_by_user = _candidates(opt.laws_of(law or [*ALL_LAWS]), given)
    machine = _with(kind_of(scene, preset=preset, law_of=law_of), scene, given)
    misfits = None
    if data:
        records = reader(columns, units, kind, missing, resample, drive=drive)(data)
        able = [n for n, c in candidates.items() if not lacking(words, phenomena(c))]
        candidates, misfits = fitted(able, records, residuals_of(kind, None, {}), normal_force)
    with reported(f"select {scene}") as tell, stoppable():
        found = select_law(
            machine,
            {n: (c,) if n in formed_by_user else forms(c) for n, c in candidates.items()},
            needs=words,
            accuracy=accuracy,
            friction=Friction(**levels) if levels else None,
            misfits=misfits,
            t_end=t_end,
            of=None if of is None else [name.strip() for name in of.split(",")],
            control=control,
            fixed_steps=fixed_steps,
            effort=effort,
            workers=cpu_count() or 1 if workers is None else workers,
            progress=tell,
        )
    text = "\n".join([*lines(found), "", fill(LEGEND, 80)])
    files = (plot, found.plot), (html, found.to_html), (csv, found.to_csv)
    output.finish(found.to_dict(), json, partial(typer.echo, text), *files)
    if found.interrupted:
        raise SolveError("select: interrupted", Status.INTERRUPTED, found)
    if found.best is None:
        raise SolveError(f"select: {found.verdict[0]}", Status.SOLVER_FAILED, found)
    return None


@contextmanager
def stoppable() -> Generator[None]:
    """Treat SIGTERM, which `timeout` sends, as Ctrl-C, which returns the results so far."""

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


@contextmanager
def reported(text: str) -> Generator[Callable[[str, float], None]]:
    """Report progress with a bar on a terminal, otherwise with lines on standard error."""
    last = began = perf_counter()
    with output.progress(text) as tell:

        def say(name: str, share: float) -> None:
            nonlocal last
            tell(share)
            if not sys.stderr.isatty() and perf_counter() - last > OFTEN:
                last = perf_counter()
                output.note(f"{text}: {100 * share:.0f} % after {last - began:.0f} s, {name} last")

        yield say


def _candidates(named: dict[str, Law], given: dict[str, str]) -> tuple[dict[str, Law], set[str]]:
    """Return the laws with their settings, and the names of laws whose form is set.

    The settings of laws are removed from `given`.

    Raises:
        ValueError: an option value that no law has, or unknown laws or parameters.
    """
    laws, chosen = dict(named), set[str]()
    choices: dict[str, dict[str, tuple[str, ...]]] = {}
    for text, law in laws.items():
        for option in options(law).values():
            choices.setdefault(option.name, {})[text] = option.choices
    for name in [name for name in given if name in choices]:
        every = dict.fromkeys(c for own in choices[name].values() for c in own)
        text = checks.choice(f"--set {name}", given.pop(name), list(every))
        for law, own in choices[name].items():
            if text in own:
                laws[law] = replace(laws[law], **{name: text})
                chosen.add(law)
    for key in [key for key in given if "." in key]:
        of, _, own = key.rpartition(".")
        check_names(f"--set {key}", [of], laws)
        if own in options(laws[of]):
            chosen.add(of)
        laws[of] = opt.with_settings(laws[of], of, {own: given.pop(key)})
    return laws, chosen


def _with(kind: Callable[[Law], Scene], scene: str, texts: dict[str, str]) -> Any:
    """Return the scene with its settings in --set: parameters, forms and structure."""
    one = kind(Coulomb())
    of_law = parameters(one.law)
    known = [n for n in settable(one, texts) if n not in of_law]
    check_names(f"--set of {scene}", texts, [*known, *OF_FRICTION])
    one = with_set(one, texts)  # refuses bad values
    if isinstance(one, OwnMachine):
        return partial(one.make, **one.values)
    if not texts:
        return kind

    def machine(law: Law) -> Scene:
        return with_set(kind(law), texts)

    machine.__name__ = scene
    return machine


def fitted(
    laws: list[str], records: Any, residuals: Any, normal_force: float
) -> tuple[dict[str, Law], dict[str, float]]:
    """Return the fitted laws and their relative errors.

    Laws that cannot be fitted are reported on standard error.

    Raises:
        ValueError: none of the laws can be fitted.
    """
    from identification.select import select as rank_fits  # noqa: PLC0415  (only with data)

    with output.progress("fit") as tell:
        ranking = rank_fits(
            laws, records, residuals, folds=0, normal_force=normal_force, progress=tell
        )
    found, misfits = dict[str, Law](), dict[str, float]()
    for row in ranking.rows:
        if row.fit is not None and row.fit.law is not None:
            found[row.law], misfits[row.law] = row.fit.law, row.fitted / 100
        else:
            output.note(f"{row.law}: {row.sentence}")
    if not found:
        raise ValueError("--data: expected data that some law fits, got none; see above")
    return found, misfits


def _paper(scene: str, json: str | None, others: bool) -> None:
    """Print the tables of the paper and the corresponding tables of symfric.

    Raises:
        ValueError: a scene that is not in the paper, or other options.
    """
    from symfric.gallery.selection.tables import TABLES, compare_with_paper  # noqa: PLC0415  (for --paper only)

    check_names("--paper of", [scene], TABLES)
    if others:
        raise ValueError("--paper: expected no option but --json, got others")
    with output.progress(f"select {scene} --paper") as tell:
        found = compare_with_paper(scene, progress=tell)
    output.finish(found.to_dict(), json, lambda: typer.echo("\n".join(found.lines())))
