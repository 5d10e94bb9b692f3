"""A law's steady force at given velocities as a function of its parameters, with slopes."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.parameters import Parameter, Parametric, Variable, parameters, symbolise
from symfric.laws.base import smooth
from symfric.laws.base.law import Law

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class LawCurve:
    """Force of a law in steady sliding, as a function of the parameters it depends on.

    Attributes:
        parameters: in the order of p.
        force: function of p: forces (points,), slopes (points, p).
        floors: (high, low, value): p[high] >= p[low], or >= value where low is -1.
        strict: (high, low): velocities p[high] > p[low].
    """

    parameters: tuple[Parameter, ...]
    force: ca.Function
    floors: tuple[tuple[int, int, float], ...]
    strict: tuple[tuple[int, int], ...]

    def at(self, p: Array) -> tuple[Array, Array]:
        """Forces and their slopes; not finite where the law has none."""
        F, J = self.force(p)
        return F.full().ravel(), J.full()


def law_curve(law: Law, names: Sequence[str], v: Array, N: float) -> LawCurve | None:
    """The steady curve of `law` at velocities `v` [m/s] and normal force N [N].

    Only those of `names` that it depends on are kept; None where there are none. Further inputs of
    the law have their steady values.
    """
    kept = _felt(law, names, N)
    if not kept:
        return None
    known = parameters(law)
    model, variables = symbolise(law, *kept)
    speed, p = ca.SX.sym("v"), ca.vertcat(*(x.symbol for x in variables))
    F = _steady(model, speed, N)
    one = ca.Function("curve", [speed, p], [F, ca.jacobian(F, p)])
    at = ca.MX.sym("p", len(kept))
    forces, slopes = one.map(v.size)(ca.DM(v).T, at)
    slopes = ca.reshape(slopes, len(kept), v.size).T
    force = ca.Function("curves", [at], [forces.T, slopes])
    return LawCurve(tuple(known[n] for n in kept), force, *_orders(model, variables))


def _steady(law: Law, v: ca.SX, N: float) -> ca.SX:
    ahead = smooth.sign(v, 0.0) if law.facts.odd else 1.0
    given = {i.name: i.steady * ahead for i in law.inputs}
    return ca.SX(law.force(v, N, law.steady_state(v, N), **given))


def _felt(law: Law, names: Sequence[str], N: float) -> list[str]:
    """Those of `names` that the steady force depends on."""
    if not names:
        return []
    model, variables = symbolise(law, *names)
    p = ca.vertcat(*(x.symbol for x in variables))
    felt = ca.which_depends(_steady(model, ca.SX.sym("v"), N), p, 1, False)
    return [name for name, depends in zip(names, felt, strict=True) if depends]


def parts(obj: Parametric) -> list[Parametric]:
    """`obj` and every parametric object inside it."""
    found = [obj]
    for item in fields(obj):
        value = getattr(obj, item.name)
        for child in value if isinstance(value, tuple) else (value,):
            found += parts(child) if isinstance(child, Parametric) else []
    return found


def _orders(
    law: Law, variables: Sequence[Variable]
) -> tuple[tuple[tuple[int, int, float], ...], tuple[tuple[int, int], ...]]:
    """Which values must not fall below others, or below a number; which must differ."""

    def place(value: object) -> int:
        return next((i for i, x in enumerate(variables) if x.symbol is value), -1)

    floors = list[tuple[int, int, float]]()
    strict = list[tuple[int, int]]()
    for part in parts(law):
        for low, high in type(part).ordered:
            i, j = place(getattr(part, high)), place(getattr(part, low))
            if i >= 0:
                floors.append((i, j, 0.0 if j >= 0 else float(getattr(part, low))))
        for low, high in type(part).strictly_ordered:
            i, j = place(getattr(part, high)), place(getattr(part, low))
            if i >= 0 and j >= 0:
                strict.append((i, j))
    return tuple(floors), tuple(strict)
