"""Models that go to other processes: without what only pictures and reactions need.

CasADi symbols are pickled only inside a context that keeps them the same symbols everywhere. What
makes `contacts`, `details` and `sketch` is often a function inside a function, which no pickle
takes.
"""

import pickle
from collections.abc import Iterable
from dataclasses import replace

import casadi as ca

from symfric.foundation import checks
from symfric.model import Model, Output


def plain(model: Model, signals: Iterable[str] | None = None) -> Model:
    """The equations of `model` with the outputs among `signals` alone; None keeps them all."""
    wanted = model.signals if signals is None else set(signals)
    outputs = {name: output for name, output in model.outputs.items() if name in wanted}
    return replace(
        model, outputs=outputs, contacts=(), opening=None, details=dict[str, Output], sketch=None
    )


def packed(model: Model) -> bytes:
    """A plain model as bytes."""
    with ca.global_pickle_context():
        return pickle.dumps(model)


def unpacked(data: bytes) -> Model:
    """The model of such bytes."""
    with ca.global_unpickle_context():
        return checks.kind("unpacked", pickle.loads(data), Model, "packed(model)")
