"""Integrators that were built before, kept with their model and for as long as it lives."""

from collections.abc import Hashable

from symfric.foundation.memory import remember
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.methods.method import Method
from symfric.integrator.running.integrator import Integrator
from symfric.model import Model

REMEMBERED = 16
"""Integrators kept per model; the oldest goes first."""


def built(model: Model, inputs: InputData, method: Method) -> tuple[Integrator, bool]:
    """The integrator of this model, structure of inputs and method; whether it was built just now.

    The model holds it, not a table of models: an integrator refers to its model, and a table would
    keep both alive for ever.
    """
    known: dict[Hashable, Integrator] = model.memory.setdefault("integrators", {})
    key = (method.name, method.finer, inputs.key)
    found = known.get(key)
    if found is not None:
        return found, False
    return remember(known, key, Integrator(model, inputs, method), REMEMBERED), True
