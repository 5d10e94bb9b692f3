"""Inputs of a run in pieces between their jumps."""

from collections.abc import Callable
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric import Hold, Linear
from symfric.foundation import checks
from symfric.model import Model

Array = NDArray[np.float64]
Given = float | Hold | Linear | Callable[[ca.SX], Any]
LATER = 1e-13
"""Share of a time by which what is behind it is told from what is before."""


@final
class Inputs:
    """Inputs in pieces between their jumps, and their values at an instant."""

    def __init__(self, model: Model, given: dict[str, Given], end: float) -> None:
        self.model = model
        self.given: dict[str, Given] = model.named("u", given)
        self._functions: dict[str, ca.Function] = {}
        sampled = [v for v in self.given.values() if isinstance(v, Hold | Linear)]
        if any(s.rows is not None for s in sampled):
            raise checks.refused(
                "set_valued: u", "one signal for each input", "those of an ensemble"
            )
        knots = [np.asarray(s.t, dtype=float) for s in sampled]
        self.knots = np.unique(np.concatenate([*knots, [end]]))

    def within_piece(self, begin: float, t: float) -> Array:
        """Values at `t` in the piece that begins at `begin`: what is held there, is held."""
        found = {
            n: self._at(n, v, begin if isinstance(v, Hold) else t) for n, v in self.given.items()
        }
        return self.model.values("u", found)

    def next(self, t: float, end: float) -> float:
        """End of the piece that begins at `t`."""
        after = self.knots[self.knots > t + LATER * max(1.0, abs(t))]
        return min(float(after[0]) if after.size else end, end)

    def within(self, t: float) -> dict[str, Any]:
        """The inputs of the piece that begins at `t`."""
        return {
            n: float(self._at(n, v, t)) if isinstance(v, Hold) else v for n, v in self.given.items()
        }

    def at(self, t: float) -> Array:
        """Values behind the instant `t`, in the order of the model."""
        found = {n: self._at(n, v, t) for n, v in self.given.items()}
        return self.model.values("u", found)

    def _at(self, name: str, value: Given, t: float) -> float:
        if isinstance(value, Hold):
            times = np.asarray(value.t)
            k = int(np.searchsorted(times, t + LATER * max(1.0, abs(t)), side="right")) - 1
            return float(np.asarray(value.values)[max(k, 0)])
        if isinstance(value, Linear):
            return float(np.interp(t, np.asarray(value.t), np.asarray(value.values)))
        if callable(value):
            if name not in self._functions:
                symbol = ca.SX.sym("t")
                self._functions[name] = ca.Function("u", [symbol], [ca.SX(value(symbol))])
            return float(self._functions[name](t))
        return checks.number(f"set_valued: u: {name}", value)
