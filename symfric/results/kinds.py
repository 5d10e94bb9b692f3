"""What the signals of a mechanism are, so that tables and pictures put like to like."""

from symfric.model import Model
from symfric.model.kinds import CONSTRAINTS, INPUT


def is_mechanism(model: Model) -> bool:
    """Whether the model is one of bodies and joints."""
    return model.holonomic is not None


def norms(model: Model) -> tuple[str, ...]:
    """Names of the norms of constraints; none where no loop is closed."""
    return tuple(name for name, kind in kinds(model).items() if kind == CONSTRAINTS)


def kinds(model: Model) -> dict[str, str]:
    """Name -> kind of the signals that have one; inputs always do.

    Multipliers, and sliding velocities, which are rates times radii, are not among them.
    """
    found = {v.name: v.kind for v in (*model.x, *model.z)}
    found |= {v.name: v.kind or INPUT for v in model.u}
    found |= {name: output.kind for name, output in model.outputs.items()}
    return {name: kind for name, kind in found.items() if kind}
