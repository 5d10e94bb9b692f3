"""Settings of the estimators of changing friction, and their checks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, final

from symfric.compensation.force import PARAMETERS, TABLES
from symfric.compensation.settings import pairs_of
from symfric.foundation import checks
from symfric.foundation.parameters import Variable

SHARES = {"accuracy": 0.05, "memory": 0.05}
"""Default accuracy over the level of the law, and default memory over the time of change."""
SLIDING, FALLEN, SAMPLES, AROUND = 5.0, 2.0, 10, 5.0
"""Slowest sliding over the noise of the velocity, and over the velocity scale of the law; window in
samples; bounds over the spread."""


@final
@dataclass(frozen=True, eq=False)
class Adaptation:
    """Settings of an estimator; numbers become parameters of the C.

    Attributes:
        mass: moving mass [kg]; default that of the drive.
        noise: standard deviation of the measured velocity [m/s]; required. For differences of an
            encoder with steps of `count` [m] it is count / (h sqrt(6)).
        accuracy: standard deviation of the force of the law with the right parameters [N]; default
            5 % of its level at rest.
        window: time [s] over which the errors of the law are correlated; default the larger of ten
            samples and 2 mass noise / accuracy, the time in which noise of the velocity causes an
            error of the force of that size.
        change: time [s] in which a parameter may change by its spread.
        memory: time constant [s] of forgetting of the recursive least squares; default a twentieth
            of `change`, which causes a lag of 5 % of the spread. It must exceed the time in which
            the motion shows all parameters.
        slowest: speed [m/s] below which samples are not used; default the larger of 5 `noise` and
            twice the velocity scale of the law, such as v_s, where the excess of break-away has
            fallen to 2 %. Stiffness and curve at lower speeds are seldom known well.
        valid: force [N] from which samples are not used, such as the limit of the drive.
        free: estimated parameters of the compensator: scales, offset, inertia, or parameters of
            the law. Default: the scales of dry and viscous friction, and the offset. Without
            "scale_stribeck", all dry levels change by "scale_coulomb". Write its estimate also to
            scale_stribeck of the compensator, unless scale_stribeck is 0 against hunting.
        spread: parameter -> standard deviation of its changes; default 1 for scales, the level of
            the law for the offset, and half the start value for other parameters.
        bounds: parameter -> (lowest, highest) output; default five spreads around the start value,
            within the bounds of the parameter.
    """

    mass: float | None = None
    noise: float | None = None
    accuracy: float | None = None
    window: float | None = None
    change: float = 60.0
    memory: float | None = None
    slowest: float | None = None
    valid: float | None = None
    free: Sequence[str] | None = None
    spread: Mapping[str, float] | None = None
    bounds: Mapping[str, tuple[float, float]] | None = None


def chosen_adaptation(
    where: str, settings: Adaptation | None, chosen: Mapping[str, Any]
) -> Adaptation:
    """Return settings combined with keywords, after checking their numbers."""
    checks.check_names(where, chosen, [item.name for item in fields(Adaptation)])
    settings = Adaptation() if settings is None else settings
    s = replace(checks.kind(where, settings, Adaptation, "settings, Adaptation()"), **chosen)
    for name, bound in TABLES["adaptation"].items():
        if getattr(s, name) is not None:
            checks.number(f"{where}: {name}", getattr(s, name), **bound)
    if s.noise is None:
        hint = "of an encoder: count / (h sqrt(6))"
        raise checks.refused(f"{where}: noise", "the deviation of the velocity", None, hint)
    return s


def adaptation_from_text(texts: Sequence[str]) -> Adaptation:
    """Return the settings given by arguments of a command line, each with one or several settings.

        noise=1e-4,mass=2  free=scale_coulomb,offset  spread=offset:2  bounds=offset:-5:5

    Raises:
        ValueError: unknown or repeated names, or values that are not numbers.
    """
    where, found = "adaptation", dict[str, Any]()
    for name, value in pairs_of(where, texts, [item.name for item in fields(Adaptation)]):
        parts, at = value.split(","), f"{where}: {name}"
        if name == "free":
            found[name] = tuple(parts)
        elif name in ("spread", "bounds"):
            rows = [part.split(":") for part in parts]
            if any(len(row) != (2 if name == "spread" else 3) for row in rows):
                raise checks.refused(at, "A:1,B:2 or, for bounds, A:LOW:HIGH", value)
            numbers = {row[0]: tuple(checks.parsed(at, x) for x in row[1:]) for row in rows}
            found[name] = {n: x[0] if name == "spread" else x for n, x in numbers.items()}
        else:
            found[name] = checks.parsed(at, value)
    return chosen_adaptation(where, None, found)


def estimated(
    where: str, s: Adaptation, known: Mapping[str, Variable], level: float, idle: Sequence[str]
) -> tuple[Variable, ...]:
    """Return the estimated parameters; `nominal` is the spread, `lower` and `upper` the bounds.

    Args:
        known: parameters that may be estimated, with the values of the law as start values.
        level: force of the law at rest [N].
        idle: parameters that have no effect on the force.
    """
    usual = ("scale_coulomb", "scale_force", "scale_viscous", "offset")
    free = [n for n in usual if n in known and n not in idle] if s.free is None else s.free
    names = checks.names(f"{where}: free", free, known)
    without = [n for n in names if n in idle]
    if without or not names:
        got = f"{', '.join(without)} without an effect" if without else "none"
        raise ValueError(f"{where}: free: expected parameters that have an effect, got {got}")
    spreads = checks.named(f"{where}: spread", s.spread, names)
    bounds = checks.named(f"{where}: bounds", s.bounds, names)
    return tuple(
        _estimate(where, known[name], spreads.get(name), bounds.get(name), level) for name in names
    )


def _estimate(where: str, p: Variable, spread: object, bounds: object, level: float) -> Variable:
    start = float(p.start)
    if spread is None:
        usual = level if p.name == "offset" else abs(start) / 2
        spread = 1.0 if p.name.startswith("scale_") else usual
    at = f"{where}: spread of '{p.name}'"
    wide = checks.number(at, spread, unit=p.unit, above=0.0)
    around = max(p.lower, start - AROUND * wide), min(p.upper, start + AROUND * wide)
    bounds = around if bounds is None else bounds
    what = f"(low, high) around {start:g}"
    found = checks.array(f"{where}: bounds of '{p.name}'", bounds, what=what).tolist()
    if len(found) != 2 or not found[0] <= start <= found[1]:
        raise checks.refused(f"{where}: bounds of '{p.name}'", what, bounds)
    low, high = found
    return Variable(p.name, p.unit, start=start, nominal=wide, lower=low, upper=high, doc=p.doc)


def scale_parameters(terms: Sequence[str], offset: float, mass: float) -> dict[str, Variable]:
    """Return the parameters of a compensator that are not those of its law."""
    starts = {f"scale_{n}": 1.0 for n in terms} | {"offset": offset, "inertia": mass}
    return {n: Variable(n, start=x, **({"lower": 0.0} | PARAMETERS[n])) for n, x in starts.items()}
