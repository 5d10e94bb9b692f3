"""Which parameters of a drive are fitted, and why the others are not."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from math import floor, log10
from typing import final

import casadi as ca
import numpy as np

from identification.old.data import Array
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

VELOCITIES = ("m/s", "rad/s")
STEEPNESSES = ("s/m", "s/rad")
"""Units of what places a feature on the velocity axis, and of its inverse."""

LEVELS = ("mass", "offset", "level", "viscous")
FITTED = (*LEVELS, "velocity scale", "")
"""Roles that are fitted unless named in `fixed`; nobody has said what "" is for."""

REASONS = {
    "width": "smoothing width, small against the speeds",
    "load": "the load is constant in the data",
}

ALIKE = 1e-7
"""Part of a parameter's effect on the force, relative to it, that no other one has as well."""

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
    """Decide by their role what the data of a drive under constant load can tell.

    Fitted: mass, offset, friction levels (coefficients and forces), viscous coefficients, velocity
    scales, and what has no role. Held unless named in `free`: smoothing widths (1e-3 of the largest
    speed), the load and shares of it, shapes, temperatures and geometry, the offset of a law with
    two directions, and the later ones of those that a constant load cannot tell apart, such as the
    parts of a level with and without load.

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
    reasons = {n: _reason(p, directions) for n, p in known.items() if n not in free}
    reasons |= dict.fromkeys(fixed, "given")
    asked = [*free, *(n for n in known if n not in free and not reasons[n])]
    reasons |= _inseparable(drive, asked, set(free))
    reasons = {n: reasons[n] for n in known if reasons.get(n)}
    held = {n: float(fixed[n]) if n in fixed else _held(known[n], v_max) for n in reasons}
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


def is_coefficient(parameter: Parameter) -> bool:
    """Whether a parameter is a friction coefficient: times N it is a force level."""
    return parameter.role == "level" and parameter.unit == "1"


def is_velocity(parameter: Parameter) -> bool:
    """Whether a parameter places a feature on the velocity axis, or is as small as one."""
    scale = parameter.role in ("velocity scale", "width", "")
    return scale and parameter.unit in (*VELOCITIES, *STEEPNESSES)


def _reason(parameter: Parameter, directions: bool) -> str:
    if parameter.name == "N":
        return "given"
    if parameter.role == "offset" and directions:
        return "part of the direction-dependent levels"
    if parameter.role in FITTED:
        return ""
    return REASONS.get(parameter.role, f"{parameter.role}, fitted only on request")


def _inseparable(drive: Drive, names: Sequence[str], asked: Collection[str]) -> dict[str, str]:
    """Those of `names` that only a change of load or temperature could tell from others.

    Each is compared with those before it, by sensitivities of the force at many speeds and a
    position of the parameters that is special in nothing; those in `asked` are kept. What no change
    could tell apart either is left to the fit, which names it.
    """
    law, known = drive.law, parameters(drive.law)
    mine = [n for n in names if n in known]
    around = [n for n, p in known.items() if n not in names and p.role in ("load", "temperature")]
    if law.inputs or not mine:
        return {}
    law, variables = symbolise(law, *mine, *around)
    v, N = ca.SX.sym("v"), ca.SX.sym("N")
    by_name = {x.name: x for x in variables}
    p = ca.vertcat(*(by_name[n].symbol for n in mine), *(by_name[n].symbol for n in around), N)
    slope = ca.jacobian(ca.SX(law.force(v, N, ca.SX(0, 1))), p)[: len(mine)]
    usual = [float(by_name[n].start) or 0.1 for n in (*mine, *around)]
    speeds = np.concatenate([side * np.geomspace(1e-7, 1e2, 200) for side in (-1, 1)])
    slopes = ca.Function("slope", [v, p], [slope]).map(speeds.size)
    here, rng = np.array([*usual, float(drive.N) or 1.0]), np.random.default_rng(0)
    here *= 1 + 0.1 * rng.random(here.size)
    apart = 0.3 * (np.arange(here.size) >= len(mine))
    places = [here, *(here * (1 + apart * rng.random(here.size)) for _ in range(3))]
    parts = [slopes(speeds[None, :], at).full().reshape(speeds.size, -1) for at in places]
    constant, changing = parts[0], np.vstack(parts)
    kept, found = list[int](), dict[str, str]()
    for i, name in enumerate(mine):
        others = _same_effect(constant, kept, i)
        if name in asked or others is None or _same_effect(changing, kept, i) is not None:
            kept.append(i)
        else:
            told = ", ".join(mine[k] for k in others)
            found[name] = f"load and temperature are constant: it cannot be told from {told}"
    return found


def _same_effect(columns: Array, kept: Sequence[int], i: int) -> list[int] | None:
    """Which of the columns `kept` make up column i; None where they do not."""
    columns = columns[np.isfinite(columns).all(axis=1)]
    column, others = columns[:, i], columns[:, list(kept)]
    others = others / np.maximum(np.linalg.norm(others, axis=0), 1e-300)
    shares = np.linalg.lstsq(others, column, rcond=None)[0]
    if np.linalg.norm(column - others @ shares) > ALIKE * np.linalg.norm(column):
        return None
    least = 1e-3 * np.abs(shares).max(initial=0.0)
    return [k for k, share in zip(kept, shares, strict=True) if abs(share) > least]


def _held(parameter: Parameter, v_max: float) -> float:
    """Value of a parameter that is not fitted; a width the user changed is kept."""
    value = float(parameter.value)
    if parameter.role == "width" and parameter.unit in VELOCITIES and value == parameter.default:
        return one_digit((BLEND if parameter.field == "v_blend" else WIDTH) * v_max)
    return value


def one_digit(value: float) -> float:
    """`value` > 0 rounded to one significant digit."""
    digits = -floor(log10(value))
    return round(value, digits)
