"""`symfric identify`: friction laws fitted to measured data, with what they are worth."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from typing import Annotated, Any, final

import typer

from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.result.fitted import Fitted
from identification.select import INTERRUPTED, Ranking, select
from identification.starts.start import findings_of
from identification.verdict.profile import Profile
from symfric import SolveError, Status
from symfric.cli import output
from symfric.cli.fitting import KINDS, free_in, kind_of, reading
from symfric.cli.machines import LawsOption
from symfric.cli.options import (
    HtmlOption,
    JsonOption,
    MissingOption,
    PlotOption,
    ResampleOption,
    check_outputs,
    law_names,
    numbers,
)
from symfric.foundation import checks
from symfric.foundation.parameters import check_names

MOST_WORKERS = 256


def identify(
    data: Annotated[
        list[str],
        typer.Argument(metavar="DATA", help="CSV, .mat or .npy; each file a record."),
    ],
    law: LawsOption,
    validate: Annotated[
        list[str] | None,
        typer.Option("--validate", metavar="DATA", help="Record for errors only; may be repeated."),
    ] = None,
    kind: Annotated[
        str,
        typer.Option(
            "--kind",
            metavar="NAME",
            help="; ".join(f"{n}: {t}" for n, t in KINDS.items()) + ".",
        ),
    ] = "inverse",
    windows: Annotated[
        str | None,
        typer.Option("--windows", metavar="SECONDS|choose", help="Length of simulated pieces."),
    ] = None,
    columns: Annotated[
        list[str] | None,
        typer.Option("--column", metavar="SIGNAL=NAME", help="Column of a signal; all: t,x,-,F."),
    ] = None,
    units: Annotated[
        list[str] | None,
        typer.Option("--unit", metavar="SIGNAL=UNIT", help='Unit of a column; or all: "rad, N m".'),
    ] = None,
    step: Annotated[
        float | None,
        typer.Option("--step", metavar="SECONDS", help="Sample time of files without one."),
    ] = None,
    variable: Annotated[
        str | None,
        typer.Option("--variable", metavar="NAME", help="Struct or matrix in a .mat file."),
    ] = None,
    missing: MissingOption = "refuse",
    resample: ResampleOption = False,
    normal_force: Annotated[
        float,
        typer.Option(
            "--normal-force",
            metavar="NUMBER",
            help="Normal force [N]; with 1 coefficients are forces.",
        ),
    ] = 1.0,
    fixed: Annotated[
        list[str] | None, typer.Option("--fix", metavar="NAME=VALUE", help="Hold a parameter.")
    ] = None,
    free: Annotated[
        list[str] | None,
        typer.Option(
            "--free",
            metavar="NAME[=HOW]",
            help="Fit this one, too; HOW: START, LOW:HIGH, log(LOW,HIGH), above(NAME), tied(NAME).",
        ),
    ] = None,
    noise: Annotated[
        list[str] | None,
        typer.Option("--noise", metavar="SIGNAL=VALUE", help="Noise level; default estimated."),
    ] = None,
    loss: Annotated[
        str,
        typer.Option(
            "--loss", metavar="NAME", help="squares; against outliers huber, soft_l1, cauchy."
        ),
    ] = "squares",
    starts: Annotated[int, typer.Option("--starts", metavar="N", help="Most starts.")] = 6,
    workers: Annotated[
        int, typer.Option("--workers", metavar="N", help="Processes for the starts.")
    ] = 1,
    profiles: Annotated[
        list[str] | None,
        typer.Option("--profile", metavar="NAME", help="Interval by profile likelihood."),
    ] = None,
    html: HtmlOption = None,
    plot: PlotOption = None,
    json: JsonOption = None,
) -> None:
    """Fit friction laws to measured data, and say what they are worth.

    Prints the verdict of the residuals, parameters with 95 % intervals and what the data do not
    tell. The exit status is 1 where data or residuals say that the result is no physics.

    Example: symfric identify run*.csv --law stribeck,lugre --validate v.csv --html out.html
    """
    check_outputs(html, json, picture=plot)
    laws, wishes = law_names(law), free_in(free)
    chosen = kind_of(kind, windows, wishes)
    read = reading(columns, units, step, variable, kind == "points", missing, resample)
    asked: dict[str, Any] = {
        "free": wishes or None,
        "fixed": numbers("--fix", fixed) or None,
        "normal_force": normal_force,
        "noise": numbers("--noise", noise) or "estimate",
        "loss": loss,
        "starts": starts,
    }
    checks.count("--workers", workers, most=MOST_WORKERS)
    records = read.read(data)
    other = read.read(validate) if validate else None
    if profiles:
        one = Fit(chosen, laws[0], records, **asked).prepared()
        check_names("--profile", profiles, one.task.unknowns.fitted)
    with output.progress(f"identify {' and '.join(laws)}") as tell, _executor(workers) as executor:
        how: dict[str, Any] = {"executor": executor, "progress": _told(tell)}
        if len(laws) > 1:
            ranking = select(laws, records, chosen, other, **how, **asked)
            fit = ranking.best
        else:
            ranking = None
            fit = Fit(chosen, laws[0], records, **asked).solve(**how, throw=False)
    found = judged(fit, other, profiles or (), ranking)
    if html:
        found.fit.to_html(html, found.ranking)
    if plot:
        found.fit.plot(plot)
    output.emit_json(found.to_dict(), json)
    if json != "-":
        show(found)
    output.say_written(html, plot, json)
    refuse(found)


@final
@dataclass(frozen=True, eq=False)
class Found:
    """What there is to show.

    Attributes:
        fit: with its errors on other data.
        profiles: that were asked for.
        ranking: of several laws, whose best one the fit is.
        failed: why other data or profiles could not be had.
    """

    fit: Fitted
    profiles: tuple[Profile, ...] = ()
    ranking: Ranking | None = None
    failed: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """What `--json` holds: the fit, which `Fitted.from_json` reads, and more."""
        more: dict[str, Any] = {}
        if self.profiles:
            more["profiles"] = [p.to_dict() for p in self.profiles]
        if self.ranking is not None:
            more["ranking"] = self.ranking.to_dict()
        return self.fit.to_dict() | more


def judged(
    fit: Fitted, other: Dataset | None, names: Sequence[str], ranking: Ranking | None
) -> Found:
    """The fit on other data, and profiles; what fails is told, and the rest is kept."""
    failed: list[str] = []
    profiles: list[Profile] = []
    if other is not None:
        failed += [
            f"--validate: {f.sentence}"
            for f in findings_of(fit.live.kind if fit.live else None, other).errors
        ]
        try:
            fit = replace(fit, validation=fit.validate(other))
        except ValueError as error:
            failed.append(str(error))
    for name in names:
        try:
            profiles.append(fit.profile(name))
        except ValueError as error:
            failed.append(str(error))
    return Found(fit, tuple(profiles), ranking, tuple(failed))


def show(found: Found) -> None:
    """Print the ranking, the fit of the best law, and profiles."""
    if found.ranking is not None:
        typer.echo(f"{found.ranking}\n")
    typer.echo(str(found.fit))
    for profile in found.profiles:
        typer.echo("")
        output.show(str(profile))


def refuse(found: Found) -> None:
    """Raise where the result is no physics, or where something could not be done.

    Raises:
        SolveError: the fit did not end well, or it did, but other data or profiles were of no use.
    """
    fit = found.fit
    if not fit.status.ok:
        said = next((f.sentence for f in fit.findings if f.severity == "error"), "")
        why = said or next(iter(fit.verdict.nonsense), "") or fit.status.value
        raise SolveError(f"identify {fit.name}: {fit.status.name.lower()}: {why}", fit.status, fit)
    ranked = () if found.ranking is None else found.ranking.rows
    if any(INTERRUPTED in row.sentence for row in ranked):
        raise SolveError(f"identify: {INTERRUPTED}; the laws before are ranked", Status.INTERRUPTED)
    if found.failed:
        raise SolveError("; ".join(found.failed), fit.status, fit)


def _told(tell: Callable[[float], None]) -> Callable[[str, float], None]:
    def advance(text: str, done: float) -> None:
        del text
        tell(done)

    return advance


def _executor(workers: int) -> AbstractContextManager[Executor | None]:
    return nullcontext() if workers == 1 else ProcessPoolExecutor(workers)
