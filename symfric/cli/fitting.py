"""What the texts of `symfric identify` mean: data, kinds of residuals, what is fitted and how."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import inf
from re import fullmatch
from typing import Any, final

from identification.data.dataset import Dataset
from identification.residuals.closed_loop import ClosedLoop
from identification.residuals.inverse import InverseDynamics
from identification.residuals.points import Points
from identification.residuals.shooting import Shooting
from identification.unknowns.spec import above, linear, log, tied
from symfric.cli.options import assignments
from symfric.foundation import checks
from symfric.foundation.parameters import check_names

KINDS = {
    "points": "forces F at velocities v, over a time where --column t=NAME or --step says so",
    "inverse": "the force that the measured motion needs",
    "shooting": "simulated motion",
    "loop": "simulated motion under the controller of the record",
}
OF_KIND = ("x0", "dead_time")
"""Entries of --free that are no parameters."""

RULES = {"log": log, "linear": linear}


@final
@dataclass(frozen=True)
class Reading:
    """How files are read, see `Dataset.read`; `resample`: as equal intervals, cut at gaps."""

    columns: dict[str, str] | list[str] | None
    units: dict[str, str] | str | None
    step: float | None
    variable: str | None
    points: bool
    missing: str = "refuse"
    resample: bool = False

    def read(self, paths: Sequence[str]) -> Dataset:
        """The records of the files."""
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
    """The texts of --column and --unit: SIGNAL=NAME, repeated, or all columns in their order.

    Points have a time where a column t or a step is given.

    Raises:
        ValueError: some of both, or a name without a value.
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
        return assignments(option, texts)
    if len(texts) > 1:
        raise ValueError(f"{option}: expected {such}, repeated, or once {other}, got both")
    return [part.strip() for part in texts[0].split(",")]


def _units(texts: Sequence[str] | None) -> dict[str, str] | str | None:
    found = _named_or_all("--unit", texts, "x=mm", '"rad, N m"')
    return ", ".join(found) if isinstance(found, list) else found


def kind_of(name: str, windows: str | None, free: dict[str, Any]) -> Any:
    """The kind of residuals; `windows` [s] or "choose" of simulated motions.

    Of points an `offset` among `free` is taken out of it: a constant force beside friction.
    """
    check_names("--kind", [name], KINDS)
    if windows is not None and name != "shooting":
        raise ValueError(f"--windows: expected with --kind shooting only, got --kind {name}")
    if name == "points":
        offset = "offset" in free
        if free.pop("offset", None) is not None:
            raise ValueError("--free offset: expected no more than its name with --kind points")
        return Points(offset=offset)
    if name == "inverse":
        return InverseDynamics()
    if name == "loop":
        return ClosedLoop()
    length = windows if windows in (None, "choose") else checks.parsed("--windows", str(windows))
    return Shooting(windows=length)


def free_in(texts: Iterable[str] | None) -> dict[str, Any]:
    """Parameters that are fitted, and how: see `free_one`."""
    found: dict[str, Any] = {}
    for text in texts or ():
        name, equals, how = (part.strip() for part in text.partition("="))
        if not name or name in found or (equals and not how):
            raise checks.refused("--free", "NAME or NAME=HOW, every name once", text)
        found[name] = free_one(name, how)
    return found


def free_one(name: str, how: str) -> Any:
    """One entry of `free` in Python.

    `1.5` is a start value, `0:2` are bounds, either of which may be left out; `log(1e3, 1e7)`,
    `linear(0, 2, 1)`, `above(mu_d)`, `tied(mu_d, 1.2)` are the functions of `identification`. `x0`
    and `dead_time` take what `Shooting` takes.
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
