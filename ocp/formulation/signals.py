"""What lambdas of a problem are given: the symbols of a model by name."""

from collections.abc import Callable, Mapping
from typing import final

import casadi as ca

from symfric.foundation.checks import check_names
from symfric.foundation.symbols import stacked
from symfric.model import Model


@final
class MissingError(ValueError):
    """A name that a model does not have."""


@final
class Signals:
    """The signals of a model by name: `s.force`, or `s["force"]`.

    Time `t` since the start of the problem [s], states, algebraic variables, inputs, parameters,
    outputs, and the details of a mechanism, which are written out when one is asked for.
    """

    def __init__(
        self,
        model: Model,
        symbols: Mapping[str, ca.SX] | None = None,
        put: Callable[[ca.SX], ca.SX] | None = None,
    ) -> None:
        """`symbols` are others than those of the model; `put` brings expressions into them."""
        self._model = model
        self._symbols = known_symbols(model) if symbols is None else symbols
        self._put = put
        self._details: dict[str, ca.SX] = {}

    def __getitem__(self, name: str) -> ca.SX:
        known = self._symbols
        if name not in known and name in self._model.further:
            expression = ca.SX(self._model.further[name].expression)
            self._details[name] = expression if self._put is None else self._put(expression)
            return self._details[name]
        try:
            check_names(f"signals of '{self._model.name}'", [name], known)
        except ValueError as error:
            raise MissingError(str(error)) from None
        return known[name]

    def __getattr__(self, name: str) -> ca.SX:
        if name.startswith("_"):
            raise AttributeError(name)
        return self[name]

    def __call__(self) -> tuple[str, ...]:
        """Names of the details that were asked for."""
        return tuple(self._details)


def known_symbols(model: Model) -> dict[str, ca.SX]:
    """Name -> expression of everything but the details."""
    groups = (model.x, model.z, model.u, model.p)
    known = {"t": model.t} | {v.name: v.symbol for group in groups for v in group}
    return known | {name: ca.SX(o.expression) for name, o in model.outputs.items()}


def fresh_symbols(model: Model, mark: str) -> tuple[list[ca.SX], Signals]:
    """Signals in symbols of their own, [t, x, z, u, p], so that two spans of one model differ."""
    own = [model.t, *(model.vector(letter) for letter in "xzup")]
    new = [ca.SX.sym(f"{mark}_{letter}", s.numel()) for letter, s in zip("txzup", own, strict=True)]
    known = known_symbols(model)
    values = ca.Function("signals", own, [stacked(known.values())])(*new)
    rows = ca.vertsplit(ca.SX(values))

    def put(expression: ca.SX) -> ca.SX:
        return ca.substitute(expression, ca.vertcat(*own), ca.vertcat(*new))

    return new, Signals(model, dict(zip(known, rows, strict=True)), put)
