"""Tolerances that follow the size of the motion itself.

Absolute tolerances are fractions of each state's nominal value, which is a guess of the model: a
decimetre, a turn. A motion of a micrometre would be resolved to a hundredth of itself, one of a
nanometre not at all. So a run that turns out to be that small is run again on its own scale.
"""

import numpy as np
from numpy.typing import NDArray

from symfric.integrator.running.record import Run

Array = NDArray[np.float64]
SMALL, REST = 1e-3, 1e-12
"""Sizes, in nominal values, below which a motion has a scale of its own and is none any more: what
is left then is the rounding of states it is coupled to."""

ROUNDS = 3
"""How often: a motion that was not resolved at all may have been taken for a larger one."""


def ample(run: Run, nominal: Array) -> bool:
    """Whether no state of a run is small all the time: most do not even end small."""
    # few numbers: quicker than by NumPy
    ends = zip(run.end.tolist(), nominal.tolist(), strict=False)
    return all(
        abs(end) >= SMALL * typical or run.farthest(i) >= SMALL * typical
        for i, (end, typical) in enumerate(ends)
    )


def own_scale(size: Array, nominal: Array) -> Array:
    """Typical magnitudes: `nominal`, or the `size` of what moves far less."""
    small = (size < SMALL * nominal) & (size > REST * nominal)
    return np.where(small, size, nominal)


def finer(scale: Array, size: Array, nominal: Array) -> Array | None:
    """The scale of another run of a motion of this `size`; None where `scale` serves."""
    own = np.minimum(scale, own_scale(size, nominal))
    return own if (own < 0.1 * scale).any() else None
