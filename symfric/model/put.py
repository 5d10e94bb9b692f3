"""Substitution of symbols in the parts of a model."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple, final

import casadi as ca

from symfric.foundation.numeric import Scalar
from symfric.model.parts import Event, Monitor, Output
from symfric.model.start import System


@final
class Put(NamedTuple):
    """Substitution of the symbols `old` by the expressions `new`, both SX (n, 1)."""

    old: ca.SX
    new: ca.SX

    def __call__(self, expression: Scalar) -> ca.SX:
        """Return the expression after the substitution."""
        return ca.substitute(ca.SX(expression), self.old, self.new)

    def explicit(self, model: System) -> dict[str, Any]:
        """Return equations, outputs, monitors and events of a model after the substitution."""
        names = list(model.outputs)
        parts = [ca.SX(0, 1) if model.ode is None else ca.SX(model.ode), ca.SX(model.alg)]
        parts += [ca.SX(model.outputs[name].expression) for name in names]
        ode, alg, *values = ca.substitute(parts, [self.old], [self.new])  # together: shared parts
        pairs = zip(names, values, strict=True)
        return {
            "ode": ode,
            "alg": alg,
            "outputs": {n: replace(model.outputs[n], expression=value) for n, value in pairs},
            "monitors": tuple(map(self.monitor, model.monitors)),
            "events": tuple(map(self.event, model.events)),
            "details": partial(self.outputs, model.details),
        }

    def outputs(self, write: Callable[[], Mapping[str, Output]]) -> dict[str, Output]:
        """Return the further results of `write` after the substitution."""
        return {n: replace(o, expression=self(o.expression)) for n, o in write().items()}

    def monitor(self, monitor: Monitor) -> Monitor:
        """Return a monitor after the substitution."""
        return replace(monitor, expression=self(monitor.expression))

    def event(self, event: Event) -> Event:
        """Return an event after the substitution."""
        reset = {name: self(value) for name, value in event.reset.items()}
        return replace(event, expression=self(event.expression), reset=reset)
