"""LuGre friction, its load-normalised form and its passive form."""

from dataclasses import dataclass
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, column, exp
from symfric.foundation.parameters import param
from symfric.laws.base import smooth
from symfric.laws.base.law import Facts
from symfric.laws.dynamic.bristle import Bristle


@final
@dataclass(frozen=True, eq=False)
class LuGre(Bristle):
    """LuGre bristle friction (one state).

        g     = N [mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)]
        dz/dt = v - sigma_0 |v| z / g
        F     = sigma_0 z + sigma_1 dz/dt + sigma_2 v

    `z` is the mean bristle deflection [m].
    Limits: steady state g sign(v) + sigma_2 v; drifts under vibration. |v| is smooth over v_eps
    and exactly zero at rest; v_eps = 0 is the original with a kink at v = 0, for which
    |z| <= mu_s N / sigma_0 is invariant. A bristle under a creep below v_eps does not relax: it
    stretches on instead of breaking away. Keep v_eps ten times below the creep of a contact that
    sticks, the loading rate over sigma_0, on a belt k v_belt / sigma_0; the default is below it on
    belts of 1e-9 m/s and more, and a run whose bristles stretch on ends with an `OverloadWarning`.
    Passive from v to F only if sigma_2 >= sigma_1 (mu_s - mu_d) / mu_d, which the default set does
    not meet: after a jump in v the force may point forward for an instant. Not valid for N = 0 or a
    fast-varying N, since the deflection does not shrink with the load.
    Source: Canudas de Wit, Olsson, Astrom, Lischinsky, IEEE TAC 40(3), 1995, 419-425.
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St", "V", "P", "L", "B"),
        smoothness="C∞ (C0 at v = 0 as v_eps -> 0)",
        confidence="two sources",
        checked="auralius/LuGre lugre.m; jchristopherson/FrictionModels.jl",
        source="Canudas de Wit, Olsson, Astrom, Lischinsky, IEEE TAC 40(3), 1995",
    )

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Rate of the bristle deflection [m/s], shape (1, 1)."""
        relaxation = self.sigma_0 * smooth.magnitude(v, self.v_eps) / self.level(v, N)
        return column(v - relaxation * z[0])


@final
@dataclass(frozen=True, eq=False)
class LuGreNormalised(Bristle):
    """LuGre friction normalised by the load (one state), for a normal force that varies.

        g     = mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)
        dz/dt = v - sigma_0 |v| z / g
        F     = N (sigma_0 z + sigma_1 dz/dt + sigma_2 v)

    The deflection does not depend on the load and the force follows it at once; there is no
    division by N, and N = 0 gives F = 0. Smoothing as in `LuGre`. Passive for constant load only,
    with the bound of `LuGre`: a load that grows over a bent bristle does work.
    Limits: at constant N it is `LuGre` with sigma_i N; steady state N (g sign(v) + sigma_2 v).
    Source: Canudas de Wit et al., IEEE TAC 40(3), 1995, in coefficients (the "amended" form that
    tyre models use; Canudas de Wit and Tsiotras, CDC 1999).
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St", "V", "P", "L", "B"),
        smoothness="C∞ (C0 at v = 0 as v_eps -> 0)",
        confidence="two sources",
        checked="documentation of Altair MotionSolve; LuGre at constant load",
        source="LuGre in coefficients of friction; Canudas de Wit and Tsiotras, CDC 1999",
    )

    sigma_0: Scalar = param(
        1.274e4, unit="1/m", role="stiffness", doc="bristle stiffness over load", lower=1e-12
    )
    sigma_1: Scalar = param(
        24.2, unit="s/m", role="damping", doc="bristle damping over load", lower=0.0
    )
    sigma_2: Scalar = param(
        0.0, unit="s/m", role="viscous", doc="viscous coefficient over load", lower=0.0
    )

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Rate of the bristle deflection [m/s], shape (1, 1)."""
        relaxation = self.sigma_0 * smooth.magnitude(v, self.v_eps) / self.level(v, 1.0)
        return column(v - relaxation * z[0])

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Steady sliding force [N] at a speed >= 0."""
        return N * super().outside(speed, 1.0)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        damping = self.sigma_1 * self.rate(v, N, z)[0]
        return N * (self.sigma_0 * z[0] + damping + self.sigma_2 * v)

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Bristle deflection in steady sliding [m], shape (1, 1)."""
        return column(self.level(v, 1.0) / self.sigma_0 * smooth.sign(v, self.v_eps))


@final
@dataclass(frozen=True, eq=False)
class LuGrePassive(Bristle):
    """LuGre friction whose bristle damping fades with the velocity (one state).

        g     = N [mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)]
        dz/dt = v - sigma_0 |v| z / g
        F     = sigma_0 z + sigma_1 exp(-(v/v_d)^2) dz/dt + sigma_2 v

    With v_d of the order of v_s the force does not point forward after a jump in v, without the
    viscous friction that `LuGre` needs; smoothing as there. The force is dissipative where
    |v| exp(-(v/v_d)^2) <= 4 g / sigma_1, so everywhere if sigma_1 v_d <= 9.3 mu_d N.
    Limits: v_d -> inf is `LuGre`; steady state g sign(v) + sigma_2 v. Not valid for N = 0.
    Source: Olsson, Control Systems with Friction, PhD thesis, Lund 1996 (velocity-dependent
    damping).
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St", "V", "P", "L", "B"),
        smoothness="C∞ (C0 at v = 0 as v_eps -> 0)",
        confidence="one source",
        checked="jchristopherson/FrictionModels.jl (v_d = v_s); passivity by computation",
        source="Olsson, PhD thesis, Lund 1996",
    )

    v_d: Scalar = param(
        1e-3,
        unit="m/s",
        role="velocity scale",
        doc="velocity over which damping fades",
        lower=1e-12,
    )

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Rate of the bristle deflection [m/s], shape (1, 1)."""
        relaxation = self.sigma_0 * smooth.magnitude(v, self.v_eps) / self.level(v, N)
        return column(v - relaxation * z[0])

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        damping = self.sigma_1 * exp(-((v / self.v_d) ** 2))
        return self.sigma_0 * z[0] + damping * self.rate(v, N, z)[0] + self.sigma_2 * v

    def warnings(self) -> tuple[str, ...]:
        """None: the fading damping replaces the bound of `LuGre`."""
        return ()
