"""`symfric identify`: fit friction laws to measured data and assess the result."""

from collections.abc import Iterable, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from math import inf
from re import fullmatch
from typing import Annotated, Any, final

import typer

from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.residuals.closed_loop import ClosedLoop
from identification.residuals.inverse import InverseDynamics
from identification.residuals.points import Points
from identification.residuals.shooting import Shooting
from identification.result.fitted import Fitted
from identification.select import INTERRUPTED, Ranking, select
from identification.starts.start import findings_of
from identification.unknowns.spec import above, linear, log, tied
from identification.verdict.profile import Profile
from symfric import SolveError, Status
from symfric.cli import options as opt
from symfric.cli import output
from symfric.cli.machines import LawsOption
from symfric.cli.options import argument, option
from symfric.foundation import checks
from symfric.foundation.parameters import check_names

KINDS = {
    "points": "forces F at velocities v, time series with --column t=NAME or --step",
    "inverse": "inverse dynamics",
    "shooting": "simulated motion",
    "loop": "simulated motion under the controller of the record",
}
OF_KIND = ("x0", "dead_time")
"""Entries of --free that are not parameters."""

RULES = {"log": log, "linear": linear}


@final
@dataclass(frozen=True)
class Reading:
    """Options of `Dataset.read`; `resample` resamples to equal intervals and splits at gaps."""

    columns: dict[str, str] | list[str] | None
    units: dict[str, str] | str | None
    step: float | None
    variable: str | None
    points: bool
    missing: str = "refuse"
    resample: bool = False

    def read(self, paths: Sequence[str]) -> Dataset:
        """Read the records of the files."""
        missing: Any = self.missing
        found = Dataset.read(
            list(paths), columns=self.columns, units=self.units, step=self.step,
            variable=self.variable, points=self.points, missing=missing,
        )  # fmt: skip
        return found.resampled() if self.resample else found


def reading(
    columns: Sequence[str] | None,
    units: Sequence[str] | None,
    step: float | None,
    variable: str | None,
    points: bool,
    missing: str = "refuse",
    resample: bool = False,
) -> Reading:
    """Convert --column and --unit: SIGNAL=NAME, repeated, or all columns in their order.

    Points are a time series if a column t or a step is given.

    Raises:
        ValueError: both forms mixed, or a name without a value.
    """
    named = _named_or_all("--column", columns, "x=pos", "t,x,-,force")
    timed = step is not None or (named is not None and "t" in named)
    return Reading(named, _units(units), step, variable, points and not timed, missing, resample)


def _named_or_all(
    option: str, texts: Sequence[str] | None, such: str, other: str
) -> dict[str, str] | list[str] | None:
    if not texts:
        return None
    if all("=" in text for text in texts):
        return opt.assignments(option, texts)
    if len(texts) > 1:
        raise ValueError(f"{option}: expected {such}, repeated, or once {other}, got both")
    return [part.strip() for part in texts[0].split(",")]


def _units(texts: Sequence[str] | None) -> dict[str, str] | str | None:
    found = _named_or_all("--unit", texts, "x=mm", '"rad, N m"')
    return ", ".join(found) if isinstance(found, list) else found


def residuals_of(name: str, windows: str | None, free: dict[str, Any]) -> Any:
    """Return the type of residuals; `windows` is a length [s] or "choose", for shooting only.

    For points, `offset` in `free` is removed from it and adds a constant force to friction.
    """
    check_names("--kind", [name], KINDS)
    if windows is not None and name != "shooting":
        raise ValueError(f"--windows: expected with --kind shooting only, got --kind {name}")
    if name == "points":
        offset = "offset" in free
        if free.pop("offset", None) is not None:
            raise ValueError("--free offset: expected no value with --kind points, got one")
        return Points(offset=offset)
    if name == "inverse":
        return InverseDynamics()
    if name == "loop":
        return ClosedLoop()
    length = windows if windows in (None, "choose") else checks.parsed("--windows", str(windows))
    return Shooting(windows=length)


def free_in(texts: Iterable[str] | None) -> dict[str, Any]:
    """Return the fitted parameters with their specifications, see `free_one`."""
    found: dict[str, Any] = {}
    for text in texts or ():
        name, equals, how = (part.strip() for part in text.partition("="))
        if not name or name in found or (equals and not how):
            raise checks.refused("--free", "NAME or NAME=HOW, every name once", text)
        found[name] = free_one(name, how)
    return found


def free_one(name: str, how: str) -> Any:
    """Convert one entry of --free to an entry of `free` in Python.

    `1.5` is a start value; `0:2` are bounds, either of which may be omitted; `log(1e3, 1e7)`,
    `linear(0, 2, 1)`, `above(mu_d)` and `tied(mu_d, 1.2)` are the functions of `identification`.
    `x0` and `dead_time` accept the values of `Shooting`.
    """
    where = f"--free {name}"
    if not how:
        return None
    if name == "x0":
        return how
    called = fullmatch(r"(\w+)\((.*)\)", how)
    if called:
        return _rule(where, called[1], [part.strip() for part in called[2].split(",")])
    if ":" in how:
        low, _, high = (part.strip() for part in how.partition(":"))
        return (
            checks.parsed(where, low) if low else -inf,
            checks.parsed(where, high) if high else inf,
        )
    return checks.parsed(where, how)


def _rule(where: str, rule: str, arguments: list[str]) -> Any:
    check_names(where, [rule], ["log", "linear", "above", "tied"])
    if rule in RULES:
        if len(arguments) not in (2, 3):
            raise ValueError(f"{where}: expected {rule}(lower, upper) or with a start value")
        return RULES[rule](*(checks.parsed(where, text) for text in arguments))
    if len(arguments) not in (1, 2):
        raise ValueError(f"{where}: expected {rule}(NAME) or with a number")
    numbers = [checks.parsed(where, text) for text in arguments[1:]]
    return above(arguments[0], *numbers) if rule == "above" else tied(arguments[0], *numbers)


MOST_WORKERS = 256


def identify(
    data: Annotated[list[str], argument("DATA", "CSV, .mat or .npy; one record per file.")],
    law: LawsOption,
    validate: Annotated[
        list[str] | None, option("--validate DATA", "Record for validation only; may be repeated.")
    ] = None,
    kind: Annotated[
        str, option("--kind NAME", "; ".join(f"{n}: {t}" for n, t in KINDS.items()) + ".")
    ] = "inverse",
    windows: Annotated[
        str | None, option("--windows SECONDS|choose", "Length of simulated windows.")
    ] = None,
    columns: opt.ColumnOption = None,
    units: opt.UnitOption = None,
    step: Annotated[
        float | None, option("--step SECONDS", "Sample time of files without one.")
    ] = None,
    variable: Annotated[
        str | None, option("--variable NAME", "Struct or matrix in a .mat file.")
    ] = None,
    missing: opt.MissingOption = "refuse",
    resample: opt.ResampleOption = False,
    normal_force: opt.NormalForceOption = 1.0,
    fixed: Annotated[list[str] | None, option("--fix NAME=VALUE", "Hold a parameter.")] = None,
    free: Annotated[
        list[str] | None,
        option(
            "--free NAME[=HOW]",
            "Fit this one, too; HOW: START, LOW:HIGH, log(LOW,HIGH), above(NAME), tied(NAME).",
        ),
    ] = None,
    noise: Annotated[
        list[str] | None, option("--noise SIGNAL=VALUE", "Noise level; default: estimated.")
    ] = None,
    loss: Annotated[
        str, option("--loss NAME", "squares, or against outliers huber, soft_l1, cauchy.")
    ] = "squares",
    starts: Annotated[int, option("--starts N", "Largest number of starts.")] = 6,
    workers: Annotated[int, option("--workers N", "Processes for the starts.")] = 1,
    profiles: Annotated[
        list[str] | None, option("--profile NAME", "Confidence interval by profile likelihood.")
    ] = None,
    html: opt.HtmlOption = None,
    plot: opt.PlotOption = None,
    json: opt.JsonOption = None,
) -> None:
    """Fit friction laws to measured data and assess the result.

    Prints the assessment of the residuals, parameters with 95 % intervals, and parameters that the
    data do not identify. The exit status is 1 if data or residuals make the result meaningless.

    Example: symfric identify run*.csv --law stribeck,lugre --validate v.csv --html out.html
    """
    opt.check_outputs(html, json, picture=plot)
    laws, wishes = opt.law_names(law), free_in(free)
    chosen = residuals_of(kind, windows, wishes)
    read = reading(columns, units, step, variable, kind == "points", missing, resample)
    request: dict[str, Any] = {
        "free": wishes or None,
        "fixed": opt.numbers("--fix", fixed) or None,
        "normal_force": normal_force,
        "noise": opt.numbers("--noise", noise) or "estimate",
        "loss": loss,
        "starts": starts,
    }
    checks.count("--workers", workers, most=MOST_WORKERS)
    records = read.read(data)
    other = read.read(validate) if validate else None
    if profiles:
        one = Fit(chosen, laws[0], records, **request).prepared()
        check_names("--profile", profiles, one.task.unknowns.fitted)
    with output.progress(f"identify {' and '.join(laws)}") as tell, _executor(workers) as executor:
        how: dict[str, Any] = {"executor": executor, "progress": output.unnamed(tell)}
        if len(laws) > 1:
            ranking = select(laws, records, chosen, other, **how, **request)
            fit = ranking.best
        else:
            ranking = None
            fit = Fit(chosen, laws[0], records, **request).solve(**how, throw=False)
    found = judged(fit, other, profiles or (), ranking)
    if html:
        found.fit.to_html(html, found.ranking)
    if plot:
        found.fit.plot(plot)
    output.finish(found.to_dict(), json, lambda: show(found), html, plot)
    refuse(found)


@final
@dataclass(frozen=True, eq=False)
class Found:
    """Results to show.

    Attributes:
        fit: fit, with its errors on validation data.
        profiles: requested profiles.
        ranking: ranking of several laws, if any; `fit` is the best one.
        failed: reasons why validation or profiles failed.
    """

    fit: Fitted
    profiles: tuple[Profile, ...] = ()
    ranking: Ranking | None = None
    failed: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return the content of `--json`: the fit, which `Fitted.from_json` reads, and more."""
        more: dict[str, Any] = {}
        if self.profiles:
            more["profiles"] = [p.to_dict() for p in self.profiles]
        if self.ranking is not None:
            more["ranking"] = self.ranking.to_dict()
        return self.fit.to_dict() | more


def judged(
    fit: Fitted, other: Dataset | None, names: Sequence[str], ranking: Ranking | None
) -> Found:
    """Validate the fit and compute profiles; collect the failures."""
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
    """Raise an error if the result is meaningless or incomplete.

    Raises:
        SolveError: the fit failed, the ranking was interrupted, or validation or profiles failed.
    """
    fit = found.fit
    if not fit.status.ok:
        finding = next((f.sentence for f in fit.findings if f.severity == "error"), "")
        why = finding or next(iter(fit.verdict.nonsense), "") or fit.status.value
        raise SolveError(f"identify {fit.name}: {fit.status.name.lower()}: {why}", fit.status, fit)
    ranked = () if found.ranking is None else found.ranking.rows
    if any(INTERRUPTED in row.sentence for row in ranked):
        raise SolveError(
            f"identify: {INTERRUPTED}; the laws before it are ranked", Status.INTERRUPTED
        )
    if found.failed:
        raise SolveError("; ".join(found.failed), fit.status, fit)


def _executor(workers: int) -> AbstractContextManager[Executor | None]:
    return nullcontext() if workers == 1 else ProcessPoolExecutor(workers)
