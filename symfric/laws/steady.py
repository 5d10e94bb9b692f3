"""Force in steady sliding of anything that has a name: laws of all kinds and populations."""

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import Scalar
from symfric.laws.base import smooth
from symfric.laws.composed.populations import AnyLaw, Population

Array = NDArray[np.float64]


def steady_force(law: AnyLaw, v: Array, N: float) -> Array:
    """Force in steady sliding [N] at the velocities `v` [m/s].

    Further inputs of the law have their values `Input.steady`, with the sign of v where the law is
    odd: an applied force pulls forward.
    """
    if isinstance(law, Population):
        return law.steady_force(v, N)
    ahead: Scalar = smooth.sign(v, 0.0) if law.facts.odd else 1.0
    given = {i.name: i.steady * ahead for i in law.inputs}
    force = law.force(v, N, law.steady_state(v, N), **given)
    return np.array(np.broadcast_to(force, v.shape), dtype=float)


def steady_inputs(law: AnyLaw) -> str:
    """The further inputs behind `steady_force` as text: ", F_e = 1 N"; empty where there are none.

    For an odd law these are the values at v > 0.
    """
    return "".join(f", {i.name} = {i.steady:g} {i.unit}" for i in law.inputs)
