"""Which parameters of a drive are fitted, and why the others are not."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from math import floor, log10
from typing import final

from symfric.foundation.numeric import is_symbolic
from symfric.foundation.parameters import (
    Parameter,
    Parametric,
    check_names,
    parameters,
    symbolise,
    with_values,
)
from symfric.laws import Asymmetric, Law
from symfric.scenes import Drive

VELOCITY_SCALES = ("m/s", "s/m")
"""Units of parameters that place a feature on the velocity axis."""

WIDTH, BLEND = 1e-3, 1e-4
"""Smoothing widths over the largest speed in the data; the blend is the narrower one."""


@final
@dataclass(frozen=True, eq=False)
class Choice:
    """A drive with its fixed values set, the names to fit and the reasons for the others.

    Attributes:
        drive: fixed parameters have their values, free ones those of the law.
        free: names of the parameters to fit.
        reasons: fixed name -> why.
        v_max: largest speed in the data [m/s].
    """

    drive: Drive
    free: tuple[str, ...]
    reasons: dict[str, str]
    v_max: float


def choose(
    law: Law,
    v_max: float,
    normal_force: float = 1.0,
    free: Iterable[str] = (),
    fixed: Mapping[str, float] | None = None,
) -> Choice:
    """Decide by unit and name what the data of a drive under constant load can tell.

    Fitted: mass, offset, friction coefficients, viscous coefficients, velocity scales.
    Held unless named in `free`: smoothing widths (1e-3 of the largest speed), parameters of the
    load (unit N), dimensionless shape parameters, and the offset of a law with two directions.

    Raises:
        ValueError: a law with states or symbols, unknown names, a name both free and fixed.
    """
    _check_law(law)
    free, fixed = tuple(free), dict(fixed or {})
    drive = Drive(law, N=normal_force)
    known = parameters(drive)
    check_names("identify: free and fixed", [*free, *fixed], [n for n in known if n != "N"])
    if set(free) & set(fixed):
        both = ", ".join(sorted(set(free) & set(fixed)))
        raise ValueError(f"identify: expected each name free or fixed, got both for {both}")
    directions = any(isinstance(part, Asymmetric) for part in parts(drive))
    held: dict[str, float] = {}
    reasons: dict[str, str] = {}
    for name, parameter in known.items():
        if name in fixed:
            held[name], reasons[name] = float(fixed[name]), "given"
        elif name not in free and (reason := _reason(parameter, directions)):
            held[name], reasons[name] = _held(parameter, v_max), reason
    drive = with_values(drive, held | _starts(drive, held))
    return Choice(drive, tuple(n for n in known if n not in reasons), reasons, v_max)


def _starts(drive: Drive, held: Mapping[str, float]) -> dict[str, float]:
    """Start values of free parameters that a held one would put in the wrong order."""
    values = {name: float(p.value) for name, p in parameters(drive).items()} | dict(held)
    starts: dict[str, float] = {}
    for part in parts(symbolise(drive, *values)[0]):
        for pair in type(part).ordered:
            low, high = (getattr(part, field).name() for field in pair)
            if values[low] > values[high] and not {low, high} <= set(held):
                free, other = (low, high) if high in held else (high, low)
                starts[free] = values[other]
    return starts


def _check_law(law: Law) -> None:
    if law.states:
        raise ValueError(
            f"identify: expected a static law, got {type(law).__name__} with internal states "
            f"{', '.join(s.name for s in law.states)}; identify a static law with the same steady "
            "state (stribeck), bristle parameters need a record of pre-sliding"
        )
    symbols = [name for name, p in parameters(law).items() if is_symbolic(p.value)]
    if symbols:
        raise ValueError(
            f"identify: expected numbers as start values, got symbols for {', '.join(symbols)}; "
            "name them in free="
        )


def parts(obj: Parametric) -> Iterator[Parametric]:
    """`obj` and every parametric object inside it."""
    yield obj
    for item in fields(obj):
        value = getattr(obj, item.name)
        for child in value if isinstance(value, tuple) else (value,):
            if isinstance(child, Parametric):
                yield from parts(child)


def is_smoothing(name: str) -> bool:
    """Whether a parameter is a smoothing width: `v_eps`, `N_eps`, `v_blend`, also numbered."""
    return bool({"eps", "blend"} & set(name.split("_")))


def is_coefficient(parameter: Parameter) -> bool:
    """Whether a parameter is a friction coefficient mu: times N it is a force level."""
    return parameter.unit == "1" and parameter.name.startswith("mu")


def _reason(parameter: Parameter, directions: bool) -> str:
    if parameter.name == "N":
        return "given"
    if is_smoothing(parameter.name):
        return "smoothing width, small against the speeds"
    if parameter.name == "offset":
        return "part of the direction-dependent levels" if directions else ""
    if parameter.unit == "N":
        return "the load is constant in the data"
    if parameter.unit == "1" and not is_coefficient(parameter):
        return "shape, fitted only on request"
    return ""


def _held(parameter: Parameter, v_max: float) -> float:
    """Value of a parameter that is not fitted; a width the user changed is kept."""
    value = float(parameter.value)
    if is_smoothing(parameter.name) and parameter.unit == "m/s" and value == parameter.default:
        return one_digit((BLEND if "blend" in parameter.name else WIDTH) * v_max)
    return value


def one_digit(value: float) -> float:
    """`value` > 0 rounded to one significant digit."""
    digits = -floor(log10(value))
    return round(value, digits)
