"""What a signal of a model is, for tables and pictures: `Variable.kind` and `Output.kind`."""

import casadi as ca
import numpy as np

from symfric.foundation.numeric import Scalar, is_casadi

POSITION, RATE, FRICTION_STATE = "position", "rate", "state of friction"
MODE = "mode of friction"
"""A whole number that only jumps; results round off what error control adds to it within a step."""
NORMAL_FORCE, FRICTION, ENERGY = "normal force", "friction", "energy"
CONSTRAINTS = "constraints"
"""Norms of what is left of constraints on positions, velocities and accelerations."""
INPUT = "input"
WORK = "work rate"
"""Powers [W] that change the energy of a mechanism."""


def in_results(kind: str, value: Scalar) -> Scalar:
    """The value of a variable of that kind as results give it: a mode as a whole number."""
    if kind != MODE:
        return value
    return ca.floor(value + 0.5) if is_casadi(value) else np.floor(value + 0.5)
