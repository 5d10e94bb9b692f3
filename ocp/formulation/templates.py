"""Ready problems: moves of a driven mass."""

from ocp.formulation.bounds import Free
from ocp.formulation.expressions import TIME, integral
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from symfric.foundation import checks
from symfric.model import Model, check_model


def rest_to_rest(
    model: Model,
    distance: float,
    T: float | Free,
    *,
    limit: float,
    position: str = "x",
    velocity: str = "v",
    force: str = "force",
) -> Problem:
    """Move a mass over `distance` [m] from rest to rest, with |force| <= `limit` [N].

    With a given duration `T` [s] the move of least effort, min int force^2 dt; with
    `T=Free(lower, upper)` the fastest one, min T.

    Raises:
        ValueError: what `Problem` finds wrong, such as a model without these signals.
    """
    check_model("rest_to_rest", model)
    names = [v.name for group in (model.x, model.u) for v in group]
    for name in (position, velocity, force):
        checks.choice(f"rest_to_rest of '{model.name}'", name, names)
    limit = checks.number("rest_to_rest: limit", limit, unit="N", above=0.0)
    move = Phase(
        model,
        T,
        start={position: 0.0, velocity: 0.0},
        end={position: distance, velocity: 0.0},
        bounds={force: (-limit, limit)},
    )
    return Problem(move, TIME if isinstance(T, Free) else integral(lambda s: s[force] ** 2))
