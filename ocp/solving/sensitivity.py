"""Derivatives of an optimum by a number, and its condition, as results for the user."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

from ocp.formulation.phase import Array


@final
@dataclass(frozen=True)
class Condition:
    """Condition of an optimum.

    Attributes:
        unknowns, active: numbers of unknowns, and of active conditions including equations.
        degrees_of_freedom: number of unknowns minus number of active conditions; some more if the
            conditions depend on each other.
        residual: relative residual of stationarity.
        number: estimated condition number of the equilibrated optimality conditions; inf if they
            are singular.
        sufficient: True if the Hessian is positive definite on the active conditions, so the
            optimum is a strict local minimum.
        weak: names of conditions that may or may not be active.
    """

    unknowns: int
    active: int
    degrees_of_freedom: int
    residual: float
    number: float
    sufficient: bool
    weak: tuple[str, ...] = ()

    def __str__(self) -> str:
        order = "strict local minimum" if self.sufficient else "second-order conditions not met"
        weak = f"; weakly active: {', '.join(self.weak)}" if self.weak else ""
        return (
            f"{self.unknowns} unknowns, {self.active} active conditions, "
            f"{self.degrees_of_freedom} degrees of freedom; {order}; condition number "
            f"{self.number:.1e}{weak}"
        )


@final
@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Derivatives of an optimum by one number p.

    Attributes:
        name: name of p.
        unit: unit of p.
        cost: dJ*/dp.
        T: derivative of the total duration [s/unit].
        chosen: derivatives of the chosen parameters.
        t: derivatives of the times of the signals [s/unit], which include switching times.
        signals: derivatives of states, algebraic variables and inputs at the points of the mesh,
            which move with `t`; at fixed times the derivative of a state x is signals["x"] - x' t.
        doubts: reasons why the derivatives may be wrong: conditions that may or may not be active,
            so derivatives in both directions differ; a motion or multipliers that are not unique.
            If the derivatives of the motion are not unique they are NaN; `cost` remains valid.
    """

    name: str
    unit: str
    cost: float
    T: float
    chosen: Mapping[str, float]
    t: Array
    signals: Mapping[str, Array]
    doubts: tuple[str, ...] = ()

    def __repr__(self) -> str:
        rates = f"dJ = {self.cost:.6g}, dT = {self.T:.6g} s"
        return f"<Sensitivity by {self.name}: {'; '.join([rates, *self.doubts])}>"
