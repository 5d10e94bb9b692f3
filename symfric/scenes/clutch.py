"""A dry clutch: two inertias and a pressure that brings them together."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from typing import ClassVar, final

import casadi as ca

from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import Variable, param
from symfric.laws.base import smooth
from symfric.model import Model, Output, Variables
from symfric.scenes.base import GivenInput, Scene, contact


def closing(t: ca.SX) -> ca.SX:
    """From 0 to 4 bar within 0.1 s, then held."""
    return 4e5 * smooth.clip(t / 0.1, 0.0, 1.0)


@final
@dataclass(frozen=True, eq=False)
class Clutch(Scene):
    """Engine and load on both sides of plates that are pressed together.

        J_1 w_1' = T_1 - T,   J_2 w_2' = T - T_2,   T = n R F(v, N)
        v = R (w_1 - w_2),   N = N_0 + max(pressure A, 0),   heat' = T (w_1 - w_2)

    R is the radius at which the plates act, n the number of faces that rub, each under N. The
    input is the pressure of the piston [Pa]; below zero the plates are apart. The motion is
    computed in w_2 and the slip w_1 - w_2, whose rest is exact. Coulomb friction at full pressure
    from t = 0 locks after w / a, and takes T w^2 / (2 a), with w the slip at the start and
    a = T (1/J_1 + 1/J_2) - T_1/J_1 - T_2/J_2.

    Defaults: made up, of a car of 1.2 t in first gear (J_2 and T_2 at the gearbox) with laws of
    mu_d = 0.1: 200 N m at 4 bar.
    Limits: N_0, the drag of the open clutch, keeps the load of laws that divide by it above zero.
    """

    t_end: ClassVar[float] = 0.6
    inputs: ClassVar[Mapping[str, GivenInput]] = {
        "pressure": GivenInput("4e5 min(t / 0.1, 1)", closing),
    }

    J_1: Scalar = param(
        0.2, unit="kg m^2", role="inertia", doc="inertia of the engine", lower=1e-12
    )
    J_2: Scalar = param(0.64, unit="kg m^2", role="inertia", doc="inertia of the load", lower=1e-12)
    T_1: Scalar = param(100.0, unit="N m", role="offset", doc="torque of the engine")
    T_2: Scalar = param(20.0, unit="N m", role="offset", doc="torque that the load takes")
    n: Scalar = param(2.0, unit="1", role="geometry", doc="faces that rub", lower=1e-12)
    R: Scalar = param(0.1, unit="m", role="geometry", doc="radius of the plates", lower=1e-12)
    A: Scalar = param(
        0.008 * pi, unit="m^2", role="geometry", doc="area of the piston", lower=1e-12
    )
    N_0: Scalar = param(1.0, unit="N", role="load", doc="load of the open clutch", lower=0.0)
    omega_1: Scalar = param(150.0, unit="rad/s", role="motion", doc="w_1 at the start")
    omega_2: Scalar = param(0.0, unit="rad/s", role="motion", doc="w_2 at the start")

    def equations(self, p: Variables) -> Model:
        """States w_rel, w_2, heat and those of the law; input pressure; torque, friction."""
        w_rel = Variable(
            "w_rel", "rad/s", start=self.omega_1 - self.omega_2, nominal=10.0, doc="w_1 - w_2"
        )
        w_2 = Variable("w_2", "rad/s", start=self.omega_2, nominal=10.0, doc="speed of the load")
        heat = Variable("heat", "J", nominal=1e3, doc="energy lost in the plates")
        pressure = Variable("pressure", "Pa", nominal=1e5, doc="pressure of the piston")
        N = self.N_0 + smooth.positive(pressure.symbol * self.A, 0.0)
        both = 1 / self.J_1 + 1 / self.J_2
        pull = (self.T_1 / self.J_1 + self.T_2 / self.J_2) / (self.n * self.R * both)
        v = self.R * w_rel.symbol
        plates = contact(
            "plates", self.law, v, N, rest={"w_rel": 0.0}, least=self.N_0, F_e=ca.SX(pull)
        )
        T = self.n * self.R * plates.force
        return Model(
            name="clutch",
            x=(w_rel, w_2, heat),
            u=(pressure,),
            p=p,
            ode=ca.vertcat(
                self.T_1 / self.J_1 + self.T_2 / self.J_2 - T * both,
                (T - self.T_2) / self.J_2,
                T * w_rel.symbol,
            ),
            contacts=(plates,),
            outputs={
                "w_1": Output(w_2.symbol + w_rel.symbol, "rad/s", "speed of the engine"),
                "torque": Output(T, "N m", "torque of the clutch"),
                "v_rel": Output(v, "m/s", "sliding velocity at the radius R"),
                "N": Output(N, "N", "normal force of the plates"),
                "friction": Output(plates.force, "N", "friction force of a face, opposing v_rel"),
                "power": Output(T * w_rel.symbol, "W", "power taken by friction"),
            },
        )
