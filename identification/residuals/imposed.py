"""A law with states under imposed velocity and normal force: one step from sample to sample."""

from collections.abc import Mapping
from dataclasses import replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.held_step import advanced
from symfric.foundation.numeric import Scalar
from symfric.laws import GMS, Law

Array = NDArray[np.float64]

NEAR_REST = 0.05
"""First velocity, over the usual one, below which a record starts at rest."""


def imposed_step(
    law: Law,
    z: ca.SX,
    before: tuple[Scalar, Scalar, Mapping[str, Scalar]],
    after: tuple[Scalar, Scalar, Mapping[str, Scalar]],
    h: Scalar,
    where: str,
) -> ca.SX:
    """States of `law` one sample later, (nz, 1).

        z' = rate(z, v(t), N(t)),   v, N and further inputs linear between the samples

    Two steps with the mean velocity and load of each held: exact exponentials for bristles, exact
    event steps for elements that yield, second order elsewhere
    (`symfric.codegen.blocks.held_step`). They meet in the middle, or where the velocity passes
    through zero, so that no step sees two directions. The smooth form of GMS takes the step of its
    event form, which slips later by up to the share rho of the limit.

    Args:
        law: with states; its parameters may be symbols.
        z: SX symbols of its states.
        before, after: velocity, normal force and further inputs at the two samples.
        h: sample interval [s].
        where: begins the message of an error.

    Raises:
        ValueError: a law whose modes or states act on each other: only a simulation follows.
    """
    v, N, size = (ca.SX.sym(name) for name in ("v", "N", "h"))
    names = list(before[2])
    given = {name: ca.SX.sym(name) for name in names}
    rate = ca.SX(law.rate(v, N, z, **given))
    end = _held(law, v, N, z, rate, given, size, where)
    inner = ca.vertcat(v, N, *given.values())

    first, last = (_stacked(point, names) for point in (before, after))
    crosses = first[0] * last[0] < 0
    share = ca.if_else(crosses, first[0] / (first[0] - last[0] + (1 - crosses)), 0.5)
    middle = first + share * (last - first)
    middle[0] = ca.if_else(crosses, 0, middle[0])
    old = ca.vertcat(inner, size)
    half = ca.substitute(end, old, ca.vertcat((first + middle) / 2, share * h))
    new = ca.vertcat((middle + last) / 2, (1 - share) * h, half)
    return ca.substitute(end, ca.vertcat(old, z), new)


def _held(
    law: Law,
    v: ca.SX,
    N: ca.SX,
    z: ca.SX,
    rate: ca.SX,
    given: Mapping[str, ca.SX],
    h: ca.SX,
    where: str,
) -> ca.SX:
    """States after a step with everything held."""
    if isinstance(law, GMS) and law.form != "event":
        law = replace(law, form="event")
    try:
        return advanced(law, v, N, z, rate, given, h, where).end
    except ValueError:
        raise ValueError(
            f"{where}: expected a law with a step for imposed velocity, got {type(law).__name__}, "
            "whose modes or states act on each other; use Shooting(), which simulates"
        ) from None


def _stacked(point: tuple[Scalar, Scalar, Mapping[str, Scalar]], names: list[str]) -> ca.SX:
    v, N, given = point
    return ca.vertcat(ca.SX(v), ca.SX(N), *(ca.SX(given[name]) for name in names))


def moving_start(v: Array) -> float:
    """Velocity from which states start in steady sliding: the first one, 0 where it is near rest.

    A bristle that has slid far is bent fully at the smallest speed; at rest it is taken as relaxed.
    """
    return float(v[0]) if abs(v[0]) > NEAR_REST * float(np.sqrt(np.mean(v**2))) else 0.0
