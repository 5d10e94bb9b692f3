"""`symfric identify`: fit friction laws or a robot to measured data and assess the result."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from math import inf
from pathlib import Path
from re import fullmatch
from typing import Any

import typer

from identification.data.dataset import Dataset
from identification.fit import Fit, findings_of
from identification.residuals.closed_loop import ClosedLoop
from identification.residuals.inverse import InverseDynamics
from identification.residuals.points import Points
from identification.residuals.shooting import Shooting
from identification.result.fitted import Fitted
from identification.robot.friction import USUAL
from identification.robot.identify import identify_robot
from identification.select import INTERRUPTED, FitRanking, select
from identification.unknowns.spec import above, linear, log, tied
from identification.verdict.profile import Profile
from symfric import Drive, SolveError, Status
from symfric.cli import options as opt
from symfric.cli import output
from symfric.cli.options import Strings
from symfric.foundation import checks
from symfric.foundation.parameters import check_names

KINDS = ("points", "inverse", "shooting", "loop")
DELAYED = ("inverse", "shooting")
"""Types of residuals with a dead time."""
RULES: dict[str, Callable[..., Any]] = {"log": log, "linear": linear, "above": above, "tied": tied}


def reader(
    columns: Strings,
    units: Strings,
    kind: str,
    missing: str,
    resample: bool,
    step: float | None = None,
    variable: str | None = None,
    scales: Strings = None,
    drive: Path | None = None,
) -> Callable[[list[str]], Dataset]:
    """Return a function that reads files according to --column, --unit, --kind and other options.

    --column and --unit are SIGNAL=NAME, repeated, or list all columns in order. Points are a time
    series if a column t or a step is given. With `resample`, records have equal intervals and are
    split at gaps. `scales` are SIGNAL=FACTOR, such as force=-1 to turn a sign. `drive` is the file
    of the drive whose currents the files contain.

    Raises:
        ValueError: a mixture of both forms, or a name without a value.
    """
    named = _named_or_all("--column", columns, "x=pos", "t,x,-,force")
    each = _named_or_all("--unit", units, "x=mm", '"rad, N m"')
    timed = step is not None or (named is not None and "t" in named)
    how: dict[str, Any] = {
        "columns": named, "units": ", ".join(each) if isinstance(each, list) else each,
        "step": step, "variable": variable, "points": kind == "points" and not timed,
        "missing": missing, "drive": None if drive is None else Drive.read(drive),
    }  # fmt: skip

    def read(paths: list[str]) -> Dataset:
        found = Dataset.read(list(paths), **how)
        if factors := opt.numbers("--scale", scales):
            found = found.scaled(factors)
        return found.resampled() if resample else found

    return read


def _named_or_all(
    option: str, texts: Strings, such: str, other: str
) -> dict[str, str] | list[str] | None:
    if not texts:
        return None
    if all("=" in text for text in texts):
        return opt.assignments(option, texts)
    if len(texts) > 1:
        raise ValueError(f"{option}: expected {such}, repeated, or once {other}, got both")
    return [part.strip() for part in texts[0].split(",")]


def residuals_of(
    name: str, windows: str | None, free: dict[str, Any], dead_time: str | None = None
) -> Any:
    """Return the type of residuals; `windows` is a length [s] or "choose", for shooting only.

    `dead_time` is LOW:HIGH [s], for inverse dynamics and shooting. For points, `offset` is removed
    from `free` and adds a constant force to friction.
    """
    check_names("--kind", [name], KINDS)
    if dead_time is not None:
        if name not in DELAYED:
            kinds = " or ".join(DELAYED)
            raise ValueError(f"--dead-time: expected with --kind {kinds} only, got --kind {name}")
        ends = [checks.parsed("--dead-time", end) for end in dead_time.split(":")]
        if len(ends) != 2:
            raise checks.refused("--dead-time", "LOW:HIGH in seconds, such as 0:6e-3", dead_time)
        free["dead_time"] = (ends[0], ends[1])
    if windows is not None and name != "shooting":
        raise ValueError(f"--windows: expected with --kind shooting only, got --kind {name}")
    if name == "points":
        offset = "offset" in free
        if free.pop("offset", None) is not None:
            raise ValueError("--free offset: expected no value with --kind points, got one")
        return Points(offset=offset)
    if name == "shooting":
        length = windows if windows in (None, "choose") else checks.parsed("--windows", windows)
        return Shooting(windows=length)
    return InverseDynamics() if name == "inverse" else ClosedLoop()


def free_in(texts: Iterable[str] | None) -> dict[str, Any]:
    """Return the parameters to fit with their specifications, see `free_one`."""
    found: dict[str, Any] = {}
    for text in texts or ():
        name, equals, how = (part.strip() for part in text.partition("="))
        if not name or name in found or (equals and not how):
            raise checks.refused("--free", "NAME or NAME=HOW, every name once", text)
        found[name] = free_one(name, how)
    return found


def free_one(name: str, how: str) -> Any:
    """Return one entry of --free as the corresponding entry of `free` in Python.

    `1.5` is a start value; `0:2` are bounds, either of which may be omitted; `log(1e3, 1e7)`,
    `linear(0, 2, 1)`, `above(mu_d)` and `tied(mu_d, 1.2)` call functions of `identification`.
    `x0` and `dead_time` accept the values that `Shooting` accepts.
    """
    number = partial(checks.parsed, f"--free {name}")
    called = fullmatch(r"(\w+)\((.*)\)", how)
    if not how or name == "x0":
        return how or None
    if called:
        rule, arguments = called[1], [part.strip() for part in called[2].split(",")]
        check_names(f"--free {name}", [rule], RULES)
        bounds = rule in ("log", "linear")
        if len(arguments) - bounds not in (1, 2):
            what = "(lower, upper) or with a start value" if bounds else "(NAME) or with a number"
            raise ValueError(f"--free {name}: expected {rule}{what}")
        first = number(arguments[0]) if bounds else arguments[0]
        return RULES[rule](first, *map(number, arguments[1:]))
    if ":" in how:
        low, _, high = (part.strip() for part in how.partition(":"))
        return number(low) if low else -inf, number(high) if high else inf
    return number(how)


def identify(
    data: list[str],
    law: Strings = None,
    validate: Strings = None,
    kind: str = "inverse",
    windows: str | None = None,
    dead_time: str | None = None,
    columns: Strings = None,
    units: Strings = None,
    step: float | None = None,
    variable: str | None = None,
    missing: str = "refuse",
    resample: bool = False,
    scales: Strings = None,
    drive: Path | None = None,
    normal_force: float = 1.0,
    fixed: Strings = None,
    free: Strings = None,
    noise: Strings = None,
    loss: str = "squares",
    starts: int = 6,
    workers: int = 1,
    profiles: Strings = None,
    html: Path | None = None,
    plot: Path | None = None,
    json: str | None = None,
    rotors: bool = False,
    urdf: Path | None = None,
) -> None:
    """Fit friction laws or a robot to measured data and assess the result.

    If the first file is a URDF, the command identifies inertias and friction of the robot. Columns
    have the names of the joints, such as shoulder [rad] and shoulder_torque [N m].

    Otherwise it prints the assessment of the residuals, parameters with 95 % intervals, and
    parameters that the data do not identify. The exit status is 1 if the data or the residuals make
    the result meaningless.

    Example: symfric identify run*.csv --law stribeck,lugre --validate v.csv --html out.html

    Example: symfric identify log.csv --drive drive.toml --law stribeck
    """
    opt.check_outputs(html, json, urdf, picture=plot)
    if data[0].endswith(".urdf"):
        refuse_options("of a robot", {
            "--drive": drive, "--kind": kind != "inverse", "--windows": windows,
            "--dead-time": dead_time, "--normal-force": normal_force != 1.0, "--fix": fixed,
            "--free": free, "--noise": noise, "--starts": starts != 6, "--workers": workers != 1,
            "--profile": profiles, "--html": html,
        })  # fmt: skip
        read = reader(columns, units, "inverse", missing, resample, step, variable, scales)
        identify_robots(data, law, validate, read, loss, plot, json, rotors, urdf)
        return
    refuse_options("without ROBOT.urdf", {"--rotors": rotors, "--urdf": urdf})
    if not law:
        raise ValueError("identify: expected --law NAME[,NAME], got none; see symfric identify -h")
    laws, wishes = opt.laws_of(law), free_in(free)
    first = next(iter(laws.values()))
    chosen = residuals_of(kind, windows, wishes, dead_time)
    read = reader(columns, units, kind, missing, resample, step, variable, scales, drive)
    request: dict[str, Any] = {
        "free": wishes or None,
        "fixed": opt.numbers("--fix", fixed) or None,
        "normal_force": normal_force,
        "noise": opt.numbers("--noise", noise) or "estimate",
        "loss": loss,
        "starts": starts,
    }
    pool = opt.processes(workers)
    records = read(data)
    other = read(validate) if validate else None
    if profiles:
        one = Fit(chosen, first, records, **request).prepared()
        check_names("--profile", profiles, one.task.unknowns.fitted)
    ranking: FitRanking | None = None
    with output.progress(f"identify {' and '.join(laws)}") as tell, pool as executor:
        how: dict[str, Any] = {"executor": executor, "progress": tell}
        if len(laws) > 1:
            ranking = select(laws, records, chosen, other, **how, **request)
            fit = ranking.best
        else:
            fit = Fit(chosen, first, records, **request).solve(**how, throw=False)
    fit, found, failed = judged(fit, other, profiles or ())
    content = fit.to_dict()
    if found:
        content["profiles"] = [p.to_dict() for p in found]
    if ranking is not None:
        content["ranking"] = ranking.to_dict()

    def show() -> None:
        typer.echo(str(fit) if ranking is None else f"{ranking}\n\n{fit}")
        for profile in found:
            output.show(f"\n{profile}")

    files = (html, partial(fit.to_html, ranking=ranking)), (plot, fit.plot)
    output.finish(content, json, show, *files)
    refuse(fit, ranking, failed)


def refuse_options(where: str, options: dict[str, Any]) -> None:
    """Raise an error if any of the options is given."""
    if wrong := [name for name, given in options.items() if given]:
        raise ValueError(f"identify {where}: expected no {', '.join(wrong)}, got one")


def judged(
    fit: Fitted, other: Dataset | None, names: Sequence[str]
) -> tuple[Fitted, list[Profile], list[str]]:
    """Return the fit with its errors on other data, the profiles, and the reasons of failures."""
    failed: list[str] = []
    profiles: list[Profile] = []
    if other is not None:
        kind = fit.live.kind if fit.live else None
        failed += [f"--validate: {f.sentence}" for f in findings_of(kind, other).errors]
        try:
            fit = replace(fit, validation=fit.validate(other))
        except ValueError as error:
            failed.append(str(error))
    for name in names:
        try:
            profiles.append(fit.profile(name))
        except ValueError as error:
            failed.append(str(error))
    return fit, profiles, failed


def refuse(fit: Fitted, ranking: FitRanking | None, failed: Sequence[str]) -> None:
    """Raise an error if the result is meaningless or incomplete.

    Raises:
        SolveError: the fit failed, the ranking was interrupted, or validation or profiles failed.
    """
    if not fit.status.ok:
        finding = next((f.sentence for f in fit.findings if f.severity == "error"), "")
        why = finding or next(iter(fit.verdict.nonsense), "") or fit.status.value
        raise SolveError(f"identify {fit.name}: {fit.status.name.lower()}: {why}", fit.status, fit)
    if any(INTERRUPTED in row.sentence for row in (ranking.rows if ranking else ())):
        raise SolveError(
            f"identify: {INTERRUPTED}; the laws before it are ranked", Status.INTERRUPTED
        )
    if failed:
        raise SolveError("; ".join(failed), fit.status, fit)


METHODS = {"squares": "weighted", "huber": "robust"}
"""Value of --loss -> method of `identify_robot`."""


def identify_robots(
    data: list[str], law: Strings, validate: Strings, read: Callable[[list[str]], Dataset],
    loss: str, plot: Path | None, json: str | None, rotors: bool, urdf: Path | None,
) -> None:  # fmt: skip
    """Identify a robot, print the table and write the requested files."""
    robot, *logs = data
    if not logs:
        raise ValueError(f"identify: expected logs of the joints of '{robot}', got none")
    laws = opt.laws_of(law or [USUAL])
    if len(laws) > 1:
        raise ValueError(f"--law: expected one law for the joints of a robot, got {len(laws)}")
    method = METHODS[checks.choice("--loss of a robot", loss, [*METHODS])]
    others = read(validate) if validate else None
    fit = identify_robot(
        robot, read(logs), *laws.values(), validation=others, method=method, rotors=rotors
    )
    shown = fit.shown()

    def show() -> None:
        output.show("\n".join((shown.title, *shown.lines, "")))
        output.show_table(shown.table.header, shown.table.rows)
        for text in shown.after:
            output.show(f"\n{text}")

    output.finish(fit.to_dict(), json, show, (plot, fit.plot), (urdf, fit.to_urdf))
