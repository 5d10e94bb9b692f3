"""What a signal of a model is, for tables and pictures: `Variable.kind` and `Output.kind`."""

POSITION, RATE, FRICTION_STATE = "position", "rate", "state of friction"
NORMAL_FORCE, FRICTION, ENERGY = "normal force", "friction", "energy"
CONSTRAINTS = "constraints"
"""Norms of what is left of constraints on positions, velocities and accelerations."""
INPUT = "input"
WORK = "work rate"
"""Powers [W] that change the energy of a mechanism."""
