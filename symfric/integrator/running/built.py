"""Integrators that were built before, kept with their model and for as long as it lives."""

from threading import Lock

from symfric.integrator.equations.inputs import InputData
from symfric.integrator.methods.method import Method
from symfric.integrator.running.integrator import Integrator
from symfric.model import Model

REMEMBERED = 16
"""Integrators kept per model; the oldest goes first."""
_LOCK = Lock()


def built(model: Model, inputs: InputData, method: Method) -> tuple[Integrator, bool]:
    """The integrator of this model, structure of inputs and method; whether it was built just now.

    The model holds it, not a table of models: an integrator refers to its model, and a table would
    keep both alive for ever.
    """
    known: dict[object, Integrator] = model.memory.setdefault("integrators", {})
    key = (method.name, inputs.key)
    with _LOCK:
        if key in known:
            return known[key], False
    made = Integrator(model, inputs, method)
    with _LOCK:
        if key not in known and len(known) >= REMEMBERED:
            del known[next(iter(known))]
        return known.setdefault(key, made), True
