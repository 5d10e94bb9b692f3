"""What the stages of a block bring: states, what they become, parameters, inputs."""

from dataclasses import dataclass, replace
from math import inf
from typing import final

import casadi as ca

from symfric.foundation.parameters import Variable
from symfric.model import Variables


@final
@dataclass(frozen=True, eq=False)
class Parts:
    """What stages have brought so far; a stage returns more of it.

    Attributes:
        states, inputs, parameters: as in `Block`.
        next: the states after the step.
    """

    states: Variables = ()
    inputs: Variables = ()
    parameters: Variables = ()
    next: tuple[ca.SX, ...] = ()

    def state(self, name: str, unit: str, doc: str, nominal: float = 1.0) -> "tuple[Parts, ca.SX]":
        """With a further state, whose value after the step `following` tells."""
        variable = Variable(self._free(name), unit, nominal=nominal, doc=doc)
        return replace(self, states=(*self.states, variable)), variable.symbol

    def following(self, value: ca.SX) -> "Parts":
        """With the next value of the first state that has none."""
        return replace(self, next=(*self.next, value))

    def given(
        self,
        name: str,
        unit: str,
        doc: str,
        nominal: float = 1.0,
        lower: float = -inf,
        upper: float = inf,
    ) -> "tuple[Parts, ca.SX]":
        """With a further input, or the one of that name."""
        for known in self.inputs:
            if known.name == name:
                return self, known.symbol
        variable = Variable(name, unit, nominal=nominal, doc=doc, lower=lower, upper=upper)
        return replace(self, inputs=(*self.inputs, variable)), variable.symbol

    def parameter(
        self, name: str, start: float, unit: str, doc: str, lower: float = 0.0
    ) -> "tuple[Parts, ca.SX]":
        """With a further parameter; one whose name a law has gets a number."""
        variable = Variable(
            self._free(name), unit, start=start, nominal=abs(start) or 1.0, lower=lower, doc=doc,
        )  # fmt: skip
        return replace(self, parameters=(*self.parameters, variable)), variable.symbol

    def _free(self, name: str) -> str:
        taken = {v.name for v in (*self.states, *self.inputs, *self.parameters)}
        return next(n for n in (name, *(f"{name}_{k}" for k in range(2, 100))) if n not in taken)
