"""Elements of a law that is made of some (GMS, Maxwell-slip, Leuven) from measured hysteresis."""

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identification.starts.law_curve import parts
from identification.starts.maxwell_slip import Elements, fit_elements
from identification.starts.measured import Measured
from identification.starts.stribeck import StribeckCurve
from symfric.foundation.parameters import Parameter, parameters
from symfric.laws.base.law import Law

Array = NDArray[np.float64]

FIELDS = ("k", "mu", "alpha")
"""Fields of an element: stiffness, friction coefficient or share."""
MOST = 1500
"""Samples that are enough for a start."""
SLOW = 0.75
"""Share of the static level that friction keeps, by the median, in a record of pre-sliding."""
LEAST = 0.05
"""Least share of it that a force is divided by."""
APART = 1.25
"""Radii over those of the element that is split where fewer explain the data than the law has."""
HEADROOM = 1.1
"""What the elements of a law carry together over its static level, where it has one."""


def element_names(law: Law) -> dict[str, tuple[str, ...]]:
    """Field of an element -> names of the parameters of all elements, in their order.

    Empty for a law without elements, or with two sets of them (one for each direction).
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
    """Stiffness and level of each element of `law`, the one that slips first in front.

    The Maxwell-slip elements of `fit_elements`; for a law with a Stribeck curve, of the force over
    this curve, which is alike in pre-sliding and in sliding. Empty where the data or the law have
    no elements.

    Args:
        law: with N = measured.N.
        measured: friction alone, with positions or times.
        curve: its Stribeck curve.
        offset: constant force [N] beside friction.
        free: names that are asked for. Shares alpha_i count by their ratios alone; where some are
            held, the others stand in the right ratio to the first one of them.
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
        found = fit_elements(friction, count, viscous=viscous and not falls, most=MOST)
    except ValueError:
        return {}  # no hysteresis in these data: what the law has is as good
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
    """Forces over the Stribeck curve, times its top; slow records alone where there are some."""
    side = np.where(friction.v == 0, 1.0, np.sign(friction.v))
    sliding = np.abs(curve.force(np.where(friction.v == 0, side * 1e-300, friction.v)))
    sliding = np.maximum(sliding - curve.sigma_2 * np.abs(friction.v), 0.0)
    share = np.maximum(sliding / max(curve.F_S, float(sliding.max())), LEAST)
    force = (friction.F - curve.sigma_2 * friction.v) / share
    slow = [r for r in friction.records if float(np.median(share[r])) > SLOW]
    kept = slow or list(friction.records)
    rows = np.concatenate([np.arange(r.start, r.stop) for r in kept])
    breaks = tuple(np.cumsum([r.stop - r.start for r in kept])[:-1].tolist())
    path = None if friction.x is None else friction.x[rows]
    t = None if friction.t is None else friction.t[rows]
    return Measured(
        v=friction.v[rows], F=force[rows], x=path, t=t, a=None, N=friction.N, breaks=breaks
    )


def carrying(law: Law, values: Mapping[str, float]) -> dict[str, float]:
    """Coefficients of elements, raised together until they carry mu_s, where a law asks for it."""
    mine, known = element_names(law).get("mu", ()), parameters(law)
    if "mu_s" not in known or not set(mine) & values.keys():
        return {}
    at = {n: values.get(n, float(known[n].value)) for n in (*mine, "mu_s")}
    missing = HEADROOM * at["mu_s"] - sum(at[n] for n in mine)
    free = [n for n in mine if n in values]
    carried = sum(at[n] for n in free)
    return {n: at[n] * (1 + max(missing, 0.0) / carried) for n in free}


def _as_many(elements: Elements, count: int) -> tuple[Array, Array]:
    """Stiffnesses and levels of `count` elements: the strongest ones are split."""
    levels, radii = elements.levels, elements.radii
    while levels.size < count:
        i = int(np.argmax(levels))
        levels = np.r_[levels[:i], levels[i] / 2, levels[i] / 2, levels[i + 1 :]]
        radii = np.r_[radii[:i], radii[i] / APART, radii[i] * APART, radii[i + 1 :]]
    order = np.argsort(radii)
    return (levels / radii)[order], levels[order]


def shared(parameter: Parameter, law: Law) -> int:
    """Elements that a parameter of one of them stands beside, itself included; else 1."""
    if parameter.field not in FIELDS:
        return 1
    return max(len(getattr(part, "elements", "1")) for part in parts(law))


def scaled(values: Mapping[str, Parameter], field: str, count: int) -> float:
    """Sum of the values of one field over `count` elements."""
    same = [float(p.value) for p in values.values() if p.field == field]
    return sum(same) * count / len(same)
