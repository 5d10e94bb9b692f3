"""Coulomb friction without regularisation: stick and slip as modes."""

from dataclasses import dataclass
from math import inf
from typing import final

from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import option
from symfric.laws.base import fields, smooth
from symfric.laws.base.law import Facts, Switch
from symfric.laws.base.sticking import Sticking, carried, stick_and_slip


@final
@dataclass(frozen=True, eq=False)
class ExactCoulomb(Sticking):
    """Set-valued Coulomb friction with a static level, by modes (one state).

        F = mu N mode + sigma_2 v    slip, mode = sign(v), until v passes through zero
        F = F_e                      stick, mode = 0, until |F_e| = mu_s N
        mu = mu_d                                           form = "jump": it falls at once
        mu = mu_d + (mu_s - mu_d) exp(-(v / v_s)^2)         form = "stribeck"

    F_e is the applied force: what the contact must carry for no acceleration. Sliding ends where
    v passes through zero; the contact sticks there if it can, or slides on to the other side. This
    is the truth that regularised laws are measured against; needs a scene with events. A load
    beyond mu_s N from the very start breaks away there. In joints of a mechanism F_e follows from
    the constraints, see `JointFriction`.
    Limits: `Coulomb`, `Stribeck` and others tend to it as their smoothing width tends to zero.
    Between the switches the mode is constant. A run has a relative tolerance of 1e-7 or less,
    whatever is asked: then the block of `Rabinowicz` is exact to 1e-7 m over 20 s.
    Source: Coulomb 1785; as a hybrid system Olsson et al., Eur. J. Control 4, 1998.
    """

    facts = Facts(
        phenomena=("D", "S", "St", "V"),
        smoothness="set-valued at v = 0, exact by modes",
        confidence="two sources",
        checked="Modelica Standard Library; rleine/Keynote_Nonsmooth_Dynamics_ENOC2024",
        source="Coulomb 1785; Olsson et al., Eur. J. Control 4, 1998",
    )
    ordered = (("mu_d", "mu_s"),)

    mu_d: Scalar = fields.MU_D(0.1)

    v_s: Scalar = fields.V_S(1e-2)
    sigma_2: Scalar = fields.SIGMA_2(0.0)
    form: str = option("jump", choices=("jump", "stribeck"), doc="fall at once, or over v_s")

    @property
    def has_mode(self) -> bool:
        """Always: stick and slip are modes."""
        return True

    @property
    def velocity_scale(self) -> Scalar:
        """That of the fall [m/s]; what happens at v = 0 is an event."""
        return self.v_s if self.form == "stribeck" else inf

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Sliding force [N] at a speed >= 0."""
        mu = self.mu_d
        if self.form == "stribeck":
            mu = mu + (self.mu_s - self.mu_d) * smooth.fall(speed, self.v_s, 2.0)
        return mu * N + self.sigma_2 * speed

    def force(self, v: Scalar, N: Scalar, z: Scalar = (), *, F_e: Scalar = 0.0) -> Scalar:
        """Friction force [N]."""
        mu = self.mu_d
        if self.form == "stribeck":
            mu = mu + (self.mu_s - self.mu_d) * smooth.stribeck(v, self.v_s, 2.0, 0.0)
        return carried(z[0], F_e, mu * N * z[0] + self.sigma_2 * v)

    def switches(
        self, v: Scalar, N: Scalar, z: Scalar = (), *, F_e: Scalar = 0.0
    ) -> tuple[Switch, ...]:
        """The end of sliding, and break-away."""
        return stick_and_slip(v, z[0], F_e, self.mu_s * N)
