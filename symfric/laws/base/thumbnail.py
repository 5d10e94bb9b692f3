"""A small picture of a law for notebooks: friction in steady sliding over the velocity."""

from math import isfinite
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from symfric.foundation.checks import as_number
from symfric.foundation.numeric import is_symbolic
from symfric.foundation.parameters import parameters
from symfric.foundation.style import COLOURS
from symfric.laws.base import smooth

if TYPE_CHECKING:
    from symfric.laws.base.law import Law

LOAD = 1.0
"""Normal force of the picture [N]."""


def picture(law: "Law") -> Figure | None:
    """Steady force under 1 N, over twenty times the velocity in which the law changes."""
    if any(is_symbolic(p.value) for p in parameters(law).values()):
        return None
    scale = as_number(law.velocity_scale)
    largest = 20 * scale if scale is not None and isfinite(scale) else 1.0
    v = largest * np.linspace(-1.0, 1.0, 400)  # even: v = 0 is not among them
    ahead = smooth.sign(v, 0.0) if law.facts.odd else 1.0
    inputs = {i.name: i.steady * ahead for i in law.inputs}
    with np.errstate(all="ignore"):
        force = law.force(v, LOAD, law.steady_state(v, LOAD), **inputs)
    figure = Figure(figsize=(4.2, 1.9), layout="constrained")
    axis = figure.subplots()
    axis.plot(1e3 * v, np.broadcast_to(force, v.shape), linewidth=1.2, color=COLOURS[0])
    axis.set_xlabel("v [mm/s], steady", fontsize=7)
    axis.set_ylabel("F [N] under 1 N", fontsize=7)
    axis.tick_params(labelsize=7)
    axis.grid(alpha=0.3)
    return figure
