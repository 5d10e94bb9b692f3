"""Start values of any law from data, assigned by the roles of its parameters."""

from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import replace
from math import isfinite, sqrt
from typing import NamedTuple

import numpy as np

from identification.data.dataset import Dataset
from identification.data.differentiate import differentiate
from identification.data.findings import Findings
from identification.residuals.points import Points
from identification.starts.law_fit import fit_law, velocity
from identification.starts.maxwell_slip import HEADROOM, carrying, element_values, scaled, shared
from identification.starts.measured import Hysteresis, Measured, hysteresis, travelled
from identification.starts.stribeck import BINS, Curve, StribeckCurve, binned, fit_curve
from identification.unknowns.roles import orders, parts
from identification.unknowns.subject import Subject
from symfric.foundation import checks
from symfric.foundation.parameters import Parameter, parameters
from symfric.laws.base.law import Law
from symfric.scenes.blocks import Drive

STEADY = ("level", "viscous", "velocity scale", "")
"""Roles that the steady curve of a law determines."""
ELASTIC = ("MaxwellSlip", "GMS", "Leuven", "BoucWen", "HaessigFriedland", "StickSlip", "Armstrong")
"""Laws whose elements unload elastically; bristles unload at twice their stiffness."""
DAMPED = 0.6
"""Ratio of bristle damping to sqrt(stiffness mass) if the data do not determine it."""
BEYOND = 5.0
"""Distance after a reversal beyond which a body counts as sliding, in paths to zero force."""
APART = 1.05
"""Least ratio of velocities that must differ."""
SPIKE = 0.3
"""Bristle damping force at the largest speed over the sliding force, without a mass."""


class Facts(NamedTuple):
    """Information from the data, independent of the law.

    Attributes:
        stribeck: curve through the bins.
        curve: the bins, without mass and offset.
        friction: the samples without inertia.
        reversals: branches after reversals, or None.
        m: moving mass [kg], 0 without a mass or a known acceleration.
        offset: constant force [N].
    """

    stribeck: StribeckCurve
    curve: Curve
    friction: Measured
    reversals: Hysteresis | None
    m: float
    offset: float

    @property
    def N(self) -> float:
        """Normal force [N]."""
        return self.friction.N


def start_values(
    what: Law | Drive, measured: Measured, *, free: Collection[str]
) -> dict[str, float]:
    """Return start values of the parameters `free` of a law, or a drive with mass and offset.

    Levels, viscous coefficients and velocity scales: least squares of the law's own steady curve
    in bins of the velocity (`fit_law`). Stiffness and damping of bristles: branches after
    reversals (`hysteresis`). Mass and offset: linear regression together with the Stribeck curve.
    Undetermined parameters keep the value of `what`. The result is deterministic, and
    `with_values` accepts it.

    Args:
        what: with numbers; parameters that are not free keep their value.
        measured: velocity and force; positions or times for laws with states; accelerations for
            the mass of a drive.
        free: names of parameters.

    Raises:
        ValueError: unknown names; data without motion.
    """
    names = checks.names("start_values: free", tuple(free), parameters(what))
    law = what.law if isinstance(what, Drive) else what
    N = float(what.N) if isinstance(what, Drive) else measured.N
    facts = facts_of(replace(measured, N=N), mass="m" in names, offset="offset" in names)
    known = parameters(what)
    values = {n: _guess(known[n], facts, law) for n in names}
    shift = facts.stribeck.offset
    elements = element_values(law, facts.friction, facts.stribeck, offset=shift, free=names)
    values |= {n: value for n, value in elements.items() if n in values}
    own = parameters(law)  # elements that share a level are not told apart by the steady curve
    mine = [n for n in names if n in own and known[n].role in STEADY]
    mine = [n for n in mine if known[n].field != "mu" or "mu_s" not in own]
    values |= fit_law(law, mine, facts.curve, N, values)
    values |= {n: value for n, value in elements.items() if n in values}
    values |= carrying(law, values)
    return _constructible(what, values)


def facts_of(measured: Measured, *, mass: bool = False, offset: bool = False) -> Facts:
    """Return levels, stiffness, mass and offset of the data, as far as they determine them.

    The Stribeck curve is fitted twice: to all samples, and, if reversals show the length of
    pre-sliding, to samples more than `BEYOND` times this length after the last reversal.
    """
    m = _mass(measured) if mass else 0.0
    friction = measured.F if measured.a is None else measured.F - m * measured.a
    pure = replace(measured, F=friction)
    slides = np.abs(measured.v) > noise_speed(measured)
    curve = binned(measured.v[slides], friction[slides])
    stribeck = fit_curve(curve)
    reversals = hysteresis(pure, offset=stribeck.offset)
    if reversals is not None:
        far = slides & (travelled(pure) > BEYOND * reversals.half)
        if np.unique(np.sign(measured.v[far])).size == np.unique(np.sign(measured.v[slides])).size:
            curve = binned(measured.v[far], friction[far])
            stribeck = fit_curve(curve)
            reversals = hysteresis(pure, offset=stribeck.offset) or reversals
    shift = stribeck.offset if offset else 0.0
    return Facts(stribeck, replace(curve, F=curve.F - shift), pure, reversals, m, shift)


def noise_speed(measured: Measured) -> float:
    """Return the speed [m/s] below which noise hides the direction: three standard deviations.

    Estimated from second differences of records with times, which nearly remove smooth motion; 0
    for points without time.
    """
    if measured.t is None or measured.v.size < 5:
        return 0.0
    bends = np.concatenate([np.diff(measured.v[r], 2) for r in measured.records])
    noise = 1.4826 * float(np.median(np.abs(bends))) / np.sqrt(6)
    return min(3 * noise, 0.1 * measured.fastest)


def _mass(measured: Measured) -> float:
    """Return the slope of the force over the acceleration inside bins of velocity [kg], >= 0.

    Friction is similar inside a bin and cancels with the mean of the bin.
    """
    if measured.a is None:
        return 0.0
    edges = np.quantile(measured.v, np.linspace(0, 1, BINS + 1))
    place = np.clip(np.searchsorted(edges, measured.v, side="right") - 1, 0, BINS - 1)
    count = np.maximum(np.bincount(place, minlength=BINS), 1)
    a, F = (y - (np.bincount(place, y, BINS) / count)[place] for y in (measured.a, measured.F))
    return max(float(a @ F) / max(float(a @ a), 1e-300), 0.0)


def _guess(parameter: Parameter, facts: Facts, law: Law) -> float:
    """Return the start of one parameter from its role and unit; its own value if unknown."""
    value, unit = float(parameter.value), parameter.unit
    parted = shared(parameter, law)
    match parameter.role:
        case "mass" if facts.m > 0:
            return facts.m
        case "offset":
            return facts.offset
        case "level":
            return _level(parameter, facts, law) / parted
        case "viscous" if unit in ("N s/m", "N m s/rad"):
            return facts.stribeck.sigma_2
        case "viscous" if unit in ("s/m", "s/rad"):
            return facts.stribeck.sigma_2 / facts.N
        case "velocity scale" if parameter.lower >= 0:
            return velocity(parameter, facts.stribeck.v_s)
        case "stiffness" if (stiffness := _stiffness(facts, law)) > 0:
            per = facts.N if unit == "1/m" else 1.0
            share = value / scaled(parameters(law), parameter.field, parted) if parted > 1 else 1.0
            return stiffness / per * share
        case "damping" if (stiffness := _stiffness(facts, law)) > 0:
            return _damping(facts, stiffness) / (facts.N if unit == "s/m" else 1.0)
        case "length" if (stiffness := _stiffness(facts, law)) > 0:
            return 0.3 * facts.stribeck.F_C / stiffness
        case "time" if unit == "N/s" and facts.reversals is not None:
            level = facts.stribeck.F_C or facts.stribeck.F_S
            return level * facts.stribeck.v_s / facts.reversals.half
        case _:
            return value


def _level(parameter: Parameter, facts: Facts, law: Law) -> float:
    """Return a friction level in the unit of the parameter: static for the upper ones of a pair."""
    if parameter.unit not in ("1", "N", "N m"):
        return float(parameter.value)
    per = facts.N if parameter.unit == "1" else 1.0
    sliding = facts.stribeck.F_C or float(np.median(np.abs(facts.curve.F)))
    upper = {high for part in parts(law) for _, high in type(part).ordered}
    if parameter.field in upper:
        return max(facts.stribeck.F_S, sliding) / per
    if parameter.field == "mu" and "mu_s" in parameters(law):  # the elements must carry mu_s
        return HEADROOM * facts.stribeck.F_S / per
    known = [p for p in parameters(law).values() if p.role == "level" and p.field not in upper]
    largest = max(float(p.value) for p in known if p.unit == parameter.unit)
    return sliding / per * (float(parameter.value) / largest if largest > 0 else 1.0)


def _stiffness(facts: Facts, law: Law) -> float:
    """Return the stiffness of a bristle or of all elements [N/m]; 0 if undetermined."""
    if facts.reversals is None:
        return 0.0
    elastic = any(type(part).__name__ in ELASTIC for part in parts(law))
    return facts.reversals.elastic if elastic else facts.reversals.bristle


def _damping(facts: Facts, stiffness: float) -> float:
    """Return the damping of a bristle [N s/m]: from reversals, .6 of critical, or small."""
    if facts.m > 0:
        return DAMPED * sqrt(stiffness * facts.m)
    if facts.reversals is not None and facts.reversals.damping > facts.stribeck.sigma_2:
        return (facts.reversals.damping - facts.stribeck.sigma_2) / 2
    return SPIKE * facts.stribeck.F_C / facts.friction.fastest


def _constructible(what: Law | Drive, values: Mapping[str, float]) -> dict[str, float]:
    """Return `values` inside bounds and in order, so that `with_values` accepts them."""
    known = parameters(what)
    found = {n: _inside(known[n], value) for n, value in values.items()}
    for _ in range(3):  # ordering one pair may break another
        for low, high, strictly in orders(what):
            ratio = APART if strictly else 1.0
            at = {n: found.get(n, float(known[n].value)) for n in (low, high)}
            if at[high] >= ratio * at[low]:
                continue
            if high in found:
                found[high] = _inside(known[high], ratio * at[low])
            elif low in found:
                found[low] = _inside(known[low], at[high] / ratio)
    return found


def _inside(parameter: Parameter, value: float) -> float:
    """Return `value` inside the bounds; if positive, at least a millionth of the default."""
    own = float(parameter.value)
    least = parameter.lower
    if 0 < least < 1e-6 * abs(own):
        least = 1e-6 * abs(own)
    return min(max(value if isfinite(value) else own, least), parameter.upper)


FEW = 0.01
"""Share of points with an arbitrarily small speed, such as noise about rest."""


def findings_of(kind: object, data: Dataset) -> Findings:
    """Return the warnings on the data for these residuals."""
    if isinstance(kind, Points):
        return data.check()
    called = {part: name for part, name in _roles(kind).items() if any(name in r for r in data)}
    return data.check(**called)


def explained(error: ValueError, findings: Findings) -> ValueError:
    """Return the error of failed residuals, preceded by the first error in the data."""
    if not findings.errors:
        return error
    sentence = findings.errors[0].sentence.rstrip(".")
    return ValueError(f"data '{findings.name}': {sentence}; then {error}")


def _roles(kind: object) -> dict[str, str]:
    """Return the channels of position and force of a drive."""
    names = {name: getattr(kind, name, name) for name in ("x", "force")}
    return {name: given if isinstance(given, str) else name for name, given in names.items()}


def measured(kind: object, data: Dataset, load: float) -> Measured | None:
    """Return velocity and force of points or of a drive, all records; None if unavailable."""
    try:
        if isinstance(kind, Points):
            timed = all(r.t is not None for r in data)
            names = {"v": kind.v, "F": kind.F} | ({"t": "t"} if timed else {})
            each = [{part: r[name] for part, name in names.items()} for r in data]
        else:
            called, chosen = _roles(kind), getattr(kind, "filter", None)
            motions = [differentiate(r, chosen, **called) for r in data]
            each = [{"v": m.v, "F": m.force, "x": m.x, "t": m.t, "a": m.a} for m in motions]
        signals = {part: np.concatenate([one[part] for one in each]) for part in each[0]}
        breaks = tuple(np.cumsum([one["v"].size for one in each])[:-1].tolist())
        return Measured(**signals, N=load, breaks=breaks)
    except ValueError:  # the preparation of the residuals reports missing channels
        return None


def strongest(
    kind: object, data: Dataset, seen: Measured | None, mass: float | None
) -> float | None:
    """Return the largest force on the friction of points or of a drive [N]; None if unknown.

    In sliding it is F - m a, at rest F. Unknown for points with a measured normal force.
    """
    loaded = isinstance(kind, Points) and (kind.N is not None or any("N" in r for r in data))
    if seen is None or loaded:
        return None
    if seen.a is None or mass is None:
        return float(np.abs(seen.F).max())
    return float(max(np.abs(seen.F).max(), np.abs(seen.F - mass * seen.a).max()))


def slowest(kind: object, seen: Measured | None) -> float:
    """Return the speed [m/s] above which nearly all points not at rest lie; 0 for motions."""
    if seen is None or not isinstance(kind, Points):
        return 0.0
    speeds = np.abs(seen.v[seen.v != 0])
    return float(np.quantile(speeds, FEW)) if speeds.size else 0.0


def centre(subject: Subject, seen: Measured | None, given: Mapping[str, float]) -> dict[str, float]:
    """Return the start of every free parameter: from the user, else the data, else the law."""
    values, found = {u.name: u.start for u in subject.unknowns}, dict[str, float]()
    whole: Law | Drive | None = subject.law if subject.scene is None else subject.drive
    if whole is not None and seen is not None:
        with suppress(ValueError):  # data without motion: keep the values of the law
            found = start_values(whole, seen, free=[*values])
    return values | {n: x for n, x in found.items() if n not in subject.started} | dict(given)
