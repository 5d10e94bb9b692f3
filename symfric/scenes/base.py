"""A scene: a parametric machine that takes a friction law and gives a `Model`."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from math import isfinite

import casadi as ca

from symfric.laws import Law
from symfric.laws.base import check_law
from symfric.model import Model, Monitor, Variables
from symfric.numeric import Scalar
from symfric.parameters import Parametric, Variable, symbolise


@dataclass(frozen=True, eq=False)
class Scene(Parametric, ABC):
    """A machine with one friction law; `model()` writes its equations."""

    law: Law

    def __post_init__(self) -> None:
        check_law(type(self).__name__, self.law)
        super().__post_init__()

    @abstractmethod
    def equations(self, p: Variables) -> Model:
        """The model of this machine as it stands, with `p` as its parameters."""

    def model(self, free: Iterable[str] = ()) -> Model:
        """The model, with the parameters named in `free` as symbols in `Model.p`.

        All others are constants of the equations, so terms they switch off vanish.
        """
        scene, p = symbolise(self, *free)
        return scene.equations(p)


def slip_monitor(law: Law, v: Scalar, p: Variables) -> tuple[Monitor, ...]:
    """What error control must watch of a contact: its sliding velocity `v`, on the law's scale.

    The scale is taken at the start values of `p`; a law without one adds nothing.
    """
    symbols = ca.vertcat(ca.SX(0, 1), *(variable.symbol for variable in p))
    values = ca.vertcat(ca.SX(0, 1), *(variable.start for variable in p))
    scale = float(ca.DM(ca.substitute(ca.SX(law.velocity_scale), symbols, ca.SX(values))))
    return (Monitor(v, scale),) if isfinite(scale) else ()


def friction_states(law: Law, v: Scalar, N: Scalar) -> tuple[Variables, ca.SX]:
    """The internal states of `law` as model variables, starting in steady sliding at `v`."""
    start = ca.SX(law.steady_state(ca.SX(v), N))
    variables = tuple(
        Variable(s.name, s.unit, start=start[i], nominal=s.nominal, doc="internal friction state")
        for i, s in enumerate(law.states)
    )
    return variables, ca.vertcat(ca.SX(0, 1), *(v.symbol for v in variables))
