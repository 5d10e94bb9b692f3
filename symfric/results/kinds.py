"""What the signals of a mechanism are, so that tables and pictures put like to like."""

from symfric.model import Model

CONSTRAINTS = "constraints"
NORMS = ("constraint_position", "constraint_velocity", "constraint_acceleration")
"""Norms of the constraints on positions, velocities and accelerations."""
ENDINGS = {"_N": "normal force", "_friction": "friction", "_power": "friction"}


def is_mechanism(model: Model) -> bool:
    """Whether the model is one of bodies and joints."""
    return model.holonomic is not None


def norms(model: Model) -> tuple[str, ...]:
    """Names of the norms of constraints; none where no loop is closed."""
    return NORMS if is_mechanism(model) and NORMS[-1] in model.outputs else ()


def kinds(model: Model) -> dict[str, str]:
    """Name -> kind of the signals of a mechanism.

    Multipliers, and sliding velocities, which are rates times radii, are not among them.
    """
    n = model.holonomic.n if model.holonomic else 0
    found = {v.name: "position" for v in model.x[:n]} | {v.name: "rate" for v in model.x[n : 2 * n]}
    found |= {v.name: "state of friction" for v in model.x[2 * n :]}
    found |= {v.name: "input" for v in model.u}
    later = [v.name for v in model.z] + list(model.outputs)
    for ending, kind in ENDINGS.items():
        found |= {name: kind for name in later if name.endswith(ending)}
    found |= {name: "energy" for name, output in model.outputs.items() if output.unit == "J"}
    return found | dict.fromkeys(norms(model), CONSTRAINTS)
