"""Kinds of signals for tables and figures, the values of `Variable.kind` and `Output.kind`."""

import casadi as ca
import numpy as np

from symfric.foundation.numeric import Scalar, is_casadi

POSITION, RATE, FRICTION_STATE = "position", "rate", "state of friction"
MODE = "mode of friction"
"""Integer state that changes only by jumps; results are rounded to remove integration errors."""
NORMAL_FORCE, FRICTION, ENERGY = "normal force", "friction", "energy"
CONSTRAINTS = "constraints"
"""Norms of the residuals of constraints on positions, velocities and accelerations."""
INPUT = "input"
WORK = "work rate"
"""Power [W] that changes the energy of a mechanism."""


def in_results(kind: str, value: Scalar) -> Scalar:
    """Return the value of a variable of this kind for results; modes are rounded to integers."""
    if kind != MODE:
        return value
    return ca.floor(value + 0.5) if is_casadi(value) else np.floor(value + 0.5)
