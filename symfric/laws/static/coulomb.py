"""Coulomb friction with a smooth sign, and viscous friction."""

from dataclasses import dataclass
from math import inf
from typing import ClassVar, final

from symfric.laws import smooth
from symfric.laws.base import Facts, StaticLaw
from symfric.numeric import Scalar
from symfric.parameters import param


@final
@dataclass(frozen=True, eq=False)
class Coulomb(StaticLaw):
    """Smooth Coulomb friction.

        F = mu_d N tanh(v / v_eps)

    Limits: tends to mu_d N sign(v) as v_eps -> 0. Never sticks: under a load F_e < mu_d N it
    creeps at v = v_eps atanh(F_e / (mu_d N)). Slope at rest mu_d N / v_eps.
    Source: Amontons 1699, Coulomb 1785; tanh regularisation as in Project Chrono and MORe.
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D",),
        smoothness="C∞",
        confidence="two sources",
        source="Amontons 1699, Coulomb 1785; regularised by tanh",
    )

    mu_d: Scalar = param(0.1, unit="1", doc="dynamic friction coefficient", lower=0.0)
    v_eps: Scalar = param(1e-3, unit="m/s", doc="smoothing velocity", lower=1e-12)

    @property
    def velocity_scale(self) -> Scalar:
        """The smoothing velocity [m/s]."""
        return self.v_eps

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        return self.mu_d * N * smooth.sign(v, self.v_eps)


@final
@dataclass(frozen=True, eq=False)
class Viscous(StaticLaw):
    """Linear viscous friction, independent of the load.

        F = sigma_2 v

    Limits: no friction at rest.
    Source: textbook; Olsson et al., Eur. J. Control 4, 1998.
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("V",), smoothness="C∞", confidence="two sources", source="textbook"
    )

    sigma_2: Scalar = param(0.4, unit="N s/m", doc="viscous coefficient", lower=0.0)

    @property
    def velocity_scale(self) -> Scalar:
        """None: the force is linear."""
        return inf

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        return self.sigma_2 * v
