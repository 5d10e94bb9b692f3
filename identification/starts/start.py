"""Start values of any law from data, assigned by the roles of the parameters."""

from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from math import isfinite, sqrt
from typing import NamedTuple

import numpy as np

from identification.starts.maxwell_slip import SlipElements, fit_elements
from identification.starts.measured import Array, Hysteresis, Measured, hysteresis, travelled
from identification.starts.stribeck import (
    BINS,
    BinnedForce,
    StribeckCurve,
    binned,
    fit_curve,
    fit_law,
)
from identification.unknowns.roles import Natural, orders, parts, velocity, viscous_force
from identification.unknowns.subject import Subject
from symfric.foundation import checks
from symfric.foundation.parameters import Parameter, parameters
from symfric.laws.base.law import Law
from symfric.scenes.blocks import Drive

STEADY = ("level", "viscous", "velocity scale", "")
"""Roles of parameters that the steady curve of a law determines."""
ELASTIC = ("MaxwellSlip", "GMS", "Leuven", "BoucWen", "HaessigFriedland", "StickSlip", "Armstrong")
"""Laws whose elements unload elastically; bristles initially unload at twice their stiffness."""
DAMPED = 0.6
"""Ratio of bristle damping to sqrt(stiffness mass) if the data do not determine it."""
BEYOND = 5.0
"""Path after a reversal beyond which a body slides, relative to the path to zero force."""
APART = 1.05
"""Least ratio of strictly ordered velocities."""
SPIKE = 0.3
"""Bristle damping force at the largest speed relative to the sliding force, without a mass."""


class Facts(NamedTuple):
    """Law-independent information from the data.

    Attributes:
        stribeck: curve fitted to the bins.
        curve: the bins, without the forces of mass and offset.
        friction: samples without inertia.
        reversals: branches after reversals, or None.
        m: moving mass [kg]; 0 without a mass or a known acceleration.
        offset: constant force [N].
    """

    stribeck: StribeckCurve
    curve: BinnedForce
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
    """Return start values of the parameters `free` of a law, or of a drive with mass and offset.

    Levels, viscous coefficients and velocity scales result from least squares of the steady curve
    of the law in bins of the velocity (`fit_law`). Stiffness and damping of bristles result from
    branches after reversals (`hysteresis`), mass and offset from linear regression together with
    the Stribeck curve. Undetermined parameters keep the value of `what`. The result is
    deterministic, and `with_values` accepts it.

    Args:
        what: law or drive with numbers; parameters that are not free keep their value.
        measured: velocity and force; positions or times for laws with states; accelerations for
            the mass of a drive.
        free: names of parameters.

    Raises:
        ValueError: unknown names, or data without motion.
    """
    names = checks.names("start_values: free", tuple(free), parameters(what))
    if isinstance(what, Drive):
        measured = replace(measured, N=float(what.N))
    units = measured.natural
    sizes = units.sizes(what)
    if {*sizes.values()} == {1.0}:
        units = Natural()
    found = _start_values(units.rescaled(what), measured.rescaled(units), names)
    return {n: sizes[n] * x for n, x in found.items()}


def centre(subject: Subject, seen: Measured | None, given: Mapping[str, float]) -> dict[str, float]:
    """Return the start of each free parameter: from the user, otherwise the data, then the law."""
    values, found = {u.name: u.start for u in subject.unknowns}, dict[str, float]()
    whole: Law | Drive | None = subject.law if subject.scene is None else subject.drive
    if whole is not None and seen is not None:
        with suppress(ValueError):  # without motion in the data, keep the values of the law
            found = start_values(whole, seen, free=[*values])
    started = subject.requests.started
    return values | {n: x for n, x in found.items() if n not in started} | dict(given)


def _start_values(what: Law | Drive, measured: Measured, names: Sequence[str]) -> dict[str, float]:
    """Return start values in natural units."""
    law, N = what.law if isinstance(what, Drive) else what, measured.N
    facts = facts_of(measured, mass="m" in names, offset="offset" in names)
    known = parameters(what)
    values = {n: _guess(known[n], facts, law) for n in names}
    shift = facts.stribeck.offset
    elements = element_values(law, facts.friction, facts.stribeck, offset=shift, free=names)
    values |= {n: value for n, value in elements.items() if n in values}
    own = parameters(law)  # the steady curve cannot separate elements that share a level
    mine = [n for n in names if n in own and known[n].role in STEADY]
    mine = [n for n in mine if known[n].field != "mu" or "mu_s" not in own]
    values |= fit_law(law, mine, facts.curve, N, values)
    values |= {n: value for n, value in elements.items() if n in values}
    values |= carrying(law, values)
    return _constructible(what, values)


def facts_of(measured: Measured, *, mass: bool = False, offset: bool = False) -> Facts:
    """Return level, stiffness, mass and offset as far as the data determine them.

    The Stribeck curve is fitted to all samples. If reversals show the length of pre-sliding, it is
    fitted again to samples more than `BEYOND` times this length after the last reversal.
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
    """Return the speed [m/s] below which noise hides the direction, three standard deviations.

    The noise is estimated from second differences of records with times, which nearly remove smooth
    motion; the result is 0 for points without time.
    """
    if measured.t is None or measured.v.size < 5:
        return 0.0
    bends = np.concatenate([np.diff(measured.v[r], 2) for r in measured.records])
    noise = 1.4826 * float(np.median(np.abs(bends))) / np.sqrt(6)
    return min(3 * noise, 0.1 * measured.fastest)


def _mass(measured: Measured) -> float:
    """Return the slope of the force over the acceleration inside bins of velocity [kg], >= 0.

    Friction is nearly constant inside a bin and cancels with the mean of the bin.
    """
    if measured.a is None:
        return 0.0
    edges = np.quantile(measured.v, np.linspace(0, 1, BINS + 1))
    place = np.clip(np.searchsorted(edges, measured.v, side="right") - 1, 0, BINS - 1)
    count = np.maximum(np.bincount(place, minlength=BINS), 1)
    a, F = (y - (np.bincount(place, y, BINS) / count)[place] for y in (measured.a, measured.F))
    return max(float(a @ F) / max(float(a @ a), 1e-300), 0.0)


def _guess(parameter: Parameter, facts: Facts, law: Law) -> float:
    """Return the start of a parameter by its role and unit; its present value if undetermined."""
    value, unit, fastest = float(parameter.value), parameter.unit, facts.friction.fastest
    parted = shared(parameter, law)
    match parameter.role:
        case "mass" if facts.m > 0:
            return facts.m
        case "offset":
            return facts.offset
        case "level":
            return _level(parameter, facts, law) / parted
        case "viscous" if (force := viscous_force(law, parameter.name, fastest, facts.N)) > 0:
            return facts.stribeck.sigma_2 * fastest / force
        case "velocity scale" if parameter.lower >= 0:
            return velocity(parameter, facts.stribeck.v_s)
        case "stiffness" if (stiffness := _stiffness(facts, law)) > 0:
            per = facts.N if unit == "1/m" else 1.0
            same = [float(p.value) for p in parameters(law).values() if p.field == parameter.field]
            share = value / (sum(same) * parted / len(same)) if parted > 1 else 1.0
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
    """Return a friction level in the unit of the parameter, the static level for upper levels."""
    if parameter.unit not in ("1", "N", "N m"):
        return float(parameter.value)
    per = facts.N if parameter.unit == "1" else 1.0
    sliding = facts.stribeck.F_C or float(np.median(np.abs(facts.curve.F)))
    upper = {high for part in parts(law) for _, high in type(part).ordered}
    if parameter.field in upper:
        return max(facts.stribeck.F_S, sliding) / per
    if parameter.field == "mu" and "mu_s" in parameters(law):  # the elements have to carry mu_s
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
    """Return bristle damping [N s/m]: .6 of critical with a mass, from reversals, or small."""
    if facts.m > 0:
        return DAMPED * sqrt(stiffness * facts.m)
    if facts.reversals is not None and facts.reversals.damping > facts.stribeck.sigma_2:
        return (facts.reversals.damping - facts.stribeck.sigma_2) / 2
    return SPIKE * facts.stribeck.F_C / facts.friction.fastest


def _constructible(what: Law | Drive, values: Mapping[str, float]) -> dict[str, float]:
    """Return `values` moved inside bounds and into order, so that `with_values` accepts them."""
    known = parameters(what)
    found = {n: _inside(known[n], value) for n, value in values.items()}
    for _ in range(3):  # ordering one pair can violate another order
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
    """Return `value` inside the bounds.

    A positive lower bound is raised to a millionth of the parameter's value if it is smaller.
    """
    own = float(parameter.value)
    least = parameter.lower
    if 0 < least < 1e-6 * abs(own):
        least = 1e-6 * abs(own)
    return min(max(value if isfinite(value) else own, least), parameter.upper)


FIELDS = ("k", "mu", "alpha")
"""Fields of elements: stiffness, friction coefficient or share."""
ENOUGH = 1500
"""Number of samples sufficient for start values."""
SLOW = 0.75
"""Median share of the static level above which a record shows pre-sliding or slow motion."""
LEAST = 0.05
"""Lower limit of this share when forces are divided by it."""
SPLIT = 1.25
"""Factor between the radius of an element and those of the two elements it is split into."""
HEADROOM = 1.1
"""Ratio of the sum of the element coefficients to the static level of the law, if it has one."""


def element_names(law: Law) -> dict[str, tuple[str, ...]]:
    """Return field of an element -> names of the parameters of all elements, in order.

    The result is empty for a law without elements, or with separate elements for each direction.
    """
    sets = [e for part in parts(law) if isinstance(e := getattr(part, "elements", None), tuple)]
    if len(sets) != 1:
        return {}
    known = parameters(law)
    own = {f: tuple(n for n, p in known.items() if p.field == f) for f in FIELDS}
    return {f: names for f, names in own.items() if len(names) == len(sets[0])}


def element_values(
    law: Law, measured: Measured, curve: StribeckCurve, *, offset: float, free: Collection[str]
) -> dict[str, float]:
    """Return stiffness and level of each element of `law`, in the order in which they slip.

    They result from `fit_elements`. For a law with a Stribeck curve, the force is first divided by
    this curve, so that pre-sliding and sliding are comparable. The result is empty if data or law
    have no elements.

    Args:
        law: law with N = measured.N.
        measured: friction without inertia, with positions or times.
        curve: Stribeck curve of the friction.
        offset: constant force [N] in addition to friction.
        free: names of requested parameters. Only the ratios of the shares alpha_i are relevant; if
            some are held, the others are scaled relative to the first held share.
    """
    names = element_names(law)
    if not names or measured.x is None:
        return {}
    falls = "mu_s" in parameters(law)
    viscous = any(p.role == "viscous" for p in parameters(law).values())
    force = measured.F - offset
    friction = replace(measured, F=force, a=None)
    if falls:
        friction = _as_if_slow(friction, curve)
    count = len(next(iter(names.values())))
    try:
        found = fit_elements(friction, count, viscous=viscous and not falls, most=ENOUGH)
    except ValueError:
        return {}  # without hysteresis in the data, keep the values of the law
    k, levels = _as_many(found, count)
    total = float(levels.sum())
    carried = HEADROOM * curve.F_S / total if falls else 1.0
    shares = levels / total
    held = [(i, n) for i, n in enumerate(names.get("alpha", ())) if n not in free]
    if held:
        i, name = held[0]
        shares = shares / shares[i] * float(parameters(law)[name].value)
    each = {"k": k, "alpha": shares, "mu": carried * levels / measured.N}
    return {n: float(x) for f, own in names.items() for n, x in zip(own, each[f], strict=True)}


def _as_if_slow(friction: Measured, curve: StribeckCurve) -> Measured:
    """Return the forces scaled as if all sliding were at the maximum of the Stribeck curve.

    If there are slow records, only their samples are returned.
    """
    side = np.where(friction.v == 0, 1.0, np.sign(friction.v))
    sliding = np.abs(curve.force(np.where(friction.v == 0, side * 1e-300, friction.v)))
    sliding = np.maximum(sliding - curve.sigma_2 * np.abs(friction.v), 0.0)
    share = np.maximum(sliding / max(curve.F_S, float(sliding.max())), LEAST)
    force = (friction.F - curve.sigma_2 * friction.v) / share
    slow = [r for r in friction.records if float(np.median(share[r])) > SLOW]
    kept = slow or list(friction.records)
    return friction.at([np.arange(r.start, r.stop) for r in kept], force)


def carrying(law: Law, values: Mapping[str, float]) -> dict[str, float]:
    """Return coefficients of elements, scaled up to carry mu_s if the law requires this."""
    mine, known = element_names(law).get("mu", ()), parameters(law)
    if "mu_s" not in known or not set(mine) & values.keys():
        return {}
    at = {n: values.get(n, float(known[n].value)) for n in (*mine, "mu_s")}
    missing = HEADROOM * at["mu_s"] - sum(at[n] for n in mine)
    free = [n for n in mine if n in values]
    carried = sum(at[n] for n in free)
    return {n: at[n] * (1 + max(missing, 0.0) / carried) for n in free}


def _as_many(elements: SlipElements, count: int) -> tuple[Array, Array]:
    """Return stiffnesses and levels of `count` elements; the strongest ones are split if needed."""
    levels, radii = elements.levels, elements.radii
    while levels.size < count:
        i = int(np.argmax(levels))
        levels = np.r_[levels[:i], levels[i] / 2, levels[i] / 2, levels[i + 1 :]]
        radii = np.r_[radii[:i], radii[i] / SPLIT, radii[i] * SPLIT, radii[i + 1 :]]
    order = np.argsort(radii)
    return (levels / radii)[order], levels[order]


def shared(parameter: Parameter, law: Law) -> int:
    """Return the number of elements that share a parameter's field, or 1."""
    if parameter.field not in FIELDS:
        return 1
    return max(len(getattr(part, "elements", "1")) for part in parts(law))
