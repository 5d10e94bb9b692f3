"""Types of signals for tables and figures: `Variable.kind` and `Output.kind`."""

import casadi as ca
import numpy as np

from symfric.foundation.numeric import Scalar, is_casadi

POSITION, RATE, FRICTION_STATE = "position", "rate", "state of friction"
MODE = "mode of friction"
"""Integer that only jumps; results round off the integration error within a step."""
NORMAL_FORCE, FRICTION, ENERGY = "normal force", "friction", "energy"
CONSTRAINTS = "constraints"
"""Norms of the residuals of constraints on positions, velocities and accelerations."""
INPUT = "input"
WORK = "work rate"
"""Powers [W] that change the energy of a mechanism."""


def in_results(kind: str, value: Scalar) -> Scalar:
    """Return the value of a variable of this type for results: a mode as an integer."""
    if kind != MODE:
        return value
    return ca.floor(value + 0.5) if is_casadi(value) else np.floor(value + 0.5)
