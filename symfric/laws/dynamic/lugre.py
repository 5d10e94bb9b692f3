"""Bristle laws that slide at a Stribeck level: four forms of LuGre, and elasto-plastic."""

from math import pi

from symfric.foundation.numeric import Scalar, column, equals, exp, is_number, sin, sqrt
from symfric.foundation.parameters import parametric
from symfric.laws.base import fields, smooth
from symfric.laws.base.law import Facts, Input, State, Switch, one_sided
from symfric.laws.dynamic.element import StribeckLevel, ahead, deflection


@parametric
class Bristle(StribeckLevel):
    """Bristle of stiffness sigma_0 and damping sigma_1 that slides at a Stribeck level.

        g     = N [mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)]
        dz/dt = v - sigma_0 |v| z / g
        F     = sigma_0 z + sigma_1 dz/dt + sigma_2 v

    Subclasses differ in dz/dt, in the damping or in the dependence on the load.
    """

    sigma_0: Scalar = fields.SIGMA_0(1e5)
    sigma_1: Scalar = fields.SIGMA_1(190.0)
    sigma_2: Scalar = fields.SIGMA_2(0.0)
    v_eps: Scalar = fields.REST_EPS(1e-15)

    @property
    def states(self) -> tuple[State, ...]:
        """Mean deflection z of the bristles [m], positive for v > 0."""
        return (State("z", "m", deflection(self.sigma_0), doc="mean bristle deflection"),)

    def relaxation(self, v: Scalar, N: Scalar) -> Scalar:
        """Return the relaxation rate sigma_0 |v| / g [1/s]."""
        return self.sigma_0 * smooth.magnitude(v, self.v_eps) / self.level(v, N)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the rate of the bristle deflection [m/s], shape (1, 1)."""
        return column(v - self.relaxation(v, N) * z[0])

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        return self.sigma_0 * z[0] + self.sigma_1 * self.rate(v, N, z)[0] + self.sigma_2 * v

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return the bristle deflection in steady sliding [m], shape (1, 1)."""
        return column(self.level(v, N) / self.sigma_0 * smooth.sign(v, self.v_eps))

    def warnings(self) -> tuple[str, ...]:
        """Return a warning if viscous friction is too small for the law to be passive."""
        needed = (self.mu_s - self.mu_d) / self.mu_d * self.sigma_1
        if not is_number(needed) or not is_number(self.sigma_2) or self.sigma_2 >= needed:
            return ()
        return (
            f"not passive from v to F: sigma_2 = {self.sigma_2:g} is below "
            f"sigma_1 (mu_s - mu_d) / mu_d = {needed:g}; the force may point forward for an "
            "instant after a jump in v (lugre_passive does not)",
        )


@parametric
class LuGre(Bristle):
    """LuGre bristle friction (one state).

        g     = N [mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)]
        dz/dt = v - sigma_0 |v| z / g
        F     = sigma_0 z + sigma_1 dz/dt + sigma_2 v

    `z` is the mean bristle deflection [m].
    Limits: steady state g sign(v) + sigma_2 v; drifts under vibration. |v| is smooth over v_eps
    and exactly zero at rest; v_eps = 0 is the original with a kink at v = 0, for which
    |z| <= mu_s N / sigma_0 is invariant. A bristle that creeps below v_eps does not relax: it keeps
    stretching instead of breaking away. Keep v_eps ten times below the creep velocity of a sticking
    contact, which is the loading rate over sigma_0, or k v_belt / sigma_0 on a belt. The default
    suffices for belts of 1e-9 m/s and more; otherwise a run ends with an `OverloadWarning`.
    Passive from v to F only if sigma_2 >= sigma_1 (mu_s - mu_d) / mu_d, which the defaults do not
    satisfy: after a jump in v the force may point forward for an instant. Not valid for N = 0 or a
    fast-varying N, since the deflection does not decrease with the load.
    Source: Canudas de Wit, Olsson, Astrom, Lischinsky, IEEE TAC 40(3), 1995, 419-425.
    Checked: auralius/LuGre lugre.m; jchristopherson/FrictionModels.jl.
    """

    facts = Facts(
        ("D", "S", "St", "V", "P", "L", "B"), "C∞ (C0 at v = 0 as v_eps -> 0)", "two sources"
    )


@parametric
class LuGreNormalised(Bristle):
    """LuGre friction normalised by the load (one state), for a normal force that varies.

        g     = mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)
        dz/dt = v - sigma_0 |v| z / g
        F     = N (sigma_0 z + sigma_1 dz/dt + sigma_2 v)

    The deflection does not depend on the load, and the force follows the load immediately. The
    equations do not divide by N, and N = 0 gives F = 0. |v| is smooth as in `LuGre`. Passive for
    constant load only, under the condition of `LuGre`: a load that increases on a deflected bristle
    does work.
    Limits: at constant N it is `LuGre` with sigma_i N; steady state N (g sign(v) + sigma_2 v).
    Source: Canudas de Wit et al., IEEE TAC 40(3), 1995, in coefficients (the "amended" form that
    tyre models use; Canudas de Wit and Tsiotras, CDC 1999).
    Checked: documentation of Altair MotionSolve; LuGre at constant load.
    """

    facts = Facts(
        ("D", "S", "St", "V", "P", "L", "B"), "C∞ (C0 at v = 0 as v_eps -> 0)", "two sources"
    )

    sigma_0: Scalar = fields.SIGMA_0(1.274e4, unit="1/m", doc="bristle stiffness over load")
    sigma_1: Scalar = fields.SIGMA_1(24.2, unit="s/m", doc="bristle damping over load")
    sigma_2: Scalar = fields.SIGMA_2(0.0, unit="s/m", doc="viscous coefficient over load")

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the rate of the bristle deflection [m/s], shape (1, 1)."""
        return super().rate(v, 1.0, z)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the steady sliding force [N] at a speed >= 0."""
        return N * super().outside(speed, 1.0)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        return N * super().force(v, 1.0, z)

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return the bristle deflection in steady sliding [m], shape (1, 1)."""
        return super().steady_state(v, 1.0)


@parametric
class LuGrePassive(Bristle):
    """LuGre friction whose bristle damping decreases with the velocity (one state).

        g     = N [mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)]
        dz/dt = v - sigma_0 |v| z / g
        F     = sigma_0 z + sigma_1 exp(-(v/v_d)^2) dz/dt + sigma_2 v

    If v_d is of the order of v_s, the force does not point forward after a jump in v, even without
    the viscous friction that `LuGre` needs. |v| is smooth as in `LuGre`. The force is dissipative
    where |v| exp(-(v/v_d)^2) <= 4 g / sigma_1, so everywhere if sigma_1 v_d <= 9.3 mu_d N.
    Limits: v_d -> inf is `LuGre`; steady state g sign(v) + sigma_2 v. Not valid for N = 0.
    Source: Olsson, Control Systems with Friction, PhD thesis, Lund 1996 (velocity-dependent
    damping).
    Checked: jchristopherson/FrictionModels.jl (v_d = v_s); passivity by computation.
    """

    facts = Facts(
        ("D", "S", "St", "V", "P", "L", "B"), "C∞ (C0 at v = 0 as v_eps -> 0)", "one source"
    )

    v_d: Scalar = fields.VELOCITY(1e-3, doc="velocity over which damping fades")

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        damping = self.sigma_1 * exp(-((v / self.v_d) ** 2))
        return self.sigma_0 * z[0] + damping * self.rate(v, N, z)[0] + self.sigma_2 * v

    def warnings(self) -> tuple[str, ...]:
        """Return an empty tuple, since the damping makes the condition of `LuGre` unnecessary."""
        return ()


@parametric
class LuGreTyre(LuGreNormalised):
    """LuGre tyre with its mean bristle deflection as state (one state).

        g     = mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)
        dz/dt = v - sigma_0 |v| z / g - kappa |v_r| z
        F     = N (sigma_0 z + sigma_1 dz/dt + sigma_2 v)

    v is the slip velocity of the tyre at the contact, and the input v_r = r omega the rolling speed
    of the wheel, which carries deflected bristles out of the contact. kappa is between 1/L and 2/L
    for a contact of length L; 7/(6 L) is usual, and 2/L gives the stiffness at small slip of a
    contact with even pressure. |v| and |v_r| are smooth as in `LuGre`, as is the passivity.
    Limits: v_r = 0, a locked wheel, is `LuGreNormalised`, to which `steady_state` refers;
    `steady_state_at` depends on v_r. In steady rolling z = v / (sigma_0 |v|/g + kappa |v_r|), so
    that F = N (sigma_0/kappa) v/v_r for small slip; the relaxation length is about 1/kappa.
    Source: Canudas de Wit, Tsiotras, Velenis, Basset, Gissinger, Vehicle System Dynamics 39(3),
    2003 (from memory).
    Checked: integration of the bristles over the contact.
    """

    facts = Facts(
        ("D", "S", "St", "V", "P", "L", "B"), "C∞ (C0 at v = 0 as v_eps -> 0)", "unverified"
    )

    mu_s: Scalar = fields.MU_S(1.2)
    mu_d: Scalar = fields.MU_D(0.8, lower=1e-12)
    v_s: Scalar = fields.V_S(5.0)
    sigma_0: Scalar = fields.SIGMA_0(180.0, unit="1/m", doc="bristle stiffness over load")
    sigma_1: Scalar = fields.SIGMA_1(1.0, unit="s/m", doc="bristle damping over load")
    kappa: Scalar = fields.ANGLE(6.0, unit="1/m", doc="inverse length of the contact", lower=0.0)

    @property
    def inputs(self) -> tuple[Input, ...]:
        """Rolling speed v_r [m/s]."""
        return (Input("v_r", "m/s", "rolling speed of the wheel", nominal=10.0),)

    def outside(self, speed: Scalar, N: Scalar, *, v_r: Scalar = 0.0) -> Scalar:
        """Return the steady sliding force [N] of a locked wheel; raise an error for others."""
        if not equals(v_r, 0.0):
            raise one_sided(self, "the force of a rolling tyre does not jump at v = 0")
        return super().outside(speed, N)

    def most_held(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the break-away force of a locked wheel [N], a bound for a rolling one."""
        return self.mu_s * N

    def steady_state_at(
        self, v: Scalar, N: Scalar, *, v_r: Scalar = 0.0, **inputs: Scalar
    ) -> Scalar:
        """Return the bristle deflection in steady rolling [m], shape (1, 1)."""
        if equals(v_r, 0.0):
            return self.steady_state(v, N)
        carried = self.kappa * sqrt(v_r * v_r + self.v_eps * self.v_eps)
        return column(v / (self.relaxation(v, 1.0) + carried))

    def switches(
        self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar
    ) -> tuple[Switch, ...]:
        """Return an empty tuple, since the law has no modes."""
        return ()

    def rate(self, v: Scalar, N: Scalar, z: Scalar = (), *, v_r: Scalar = 0.0) -> Scalar:
        """Return the rate of the bristle deflection [m/s], shape (1, 1)."""
        carried = self.kappa * smooth.magnitude(v_r, self.v_eps)
        return column(v - (self.relaxation(v, 1.0) + carried) * z[0])

    def force(self, v: Scalar, N: Scalar, z: Scalar = (), *, v_r: Scalar = 0.0) -> Scalar:
        """Return the friction force [N]."""
        damping = self.sigma_1 * self.rate(v, N, z, v_r=v_r)[0]
        return N * (self.sigma_0 * z[0] + damping + self.sigma_2 * v)


@parametric
class ElastoPlastic(Bristle):
    """Elasto-plastic friction (one state).

        g     = N [mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)],   z_ss = g / sigma_0
        r     = (z sign(v) - z_ba) / (z_ss - z_ba)
        alpha = 0 for r <= 0,  1 for r >= 1,  a smooth step of r between them
        dz/dt = v - alpha sigma_0 |v| z / g
        F     = sigma_0 z + sigma_1 dz/dt + sigma_2 v

    Below the break-away deflection z_ba [m] the bristle is a spring: it returns exactly and does
    not drift under vibration. The step is 10r^3 - 15r^4 + 6r^5; v_eps = 0 is the original, with
    sign(v), |v| and the step (1 + sin(pi (r - 1/2))) / 2. The paper prints z in place of z sign(v),
    which is wrong for z < 0.
    Limits: steady state g sign(v) + sigma_2 v, approached more slowly than by `LuGre` (0.997 of
    it after 3.4 z_ss). z_ba -> 0 is not `LuGre`, since alpha still rises with z. For passivity and
    the choice of v_eps see `LuGre`. Needs z_ba < mu_d N / sigma_0, so it is not valid for small N.
    Source: Dupont, Hayward, Armstrong, Altpeter, IEEE TAC 47(5), 2002, 787-792.
    Checked: jchristopherson/FrictionModels.jl ElastoPlasticModels.jl; MBDyn.

    Raises:
        ValueError: in `rate` and `force`, if z_ba >= mu_d N / sigma_0 and all of these are numbers.
    """

    facts = Facts(
        ("D", "S", "St", "V", "P", "L", "B", "N"),
        "C2 (C0 at v = 0 and C1 in z as v_eps -> 0)",
        "two sources",
    )

    z_ba: Scalar = fields.LENGTH(1e-7, doc="break-away deflection", lower=0.0)

    def sliding_share(self, v: Scalar, N: Scalar, z: Scalar) -> Scalar:
        """Return alpha, which is 0 while the bristle is elastic and 1 while it slides."""
        z_ss = self.level(v, N) / self.sigma_0
        elastic = self.z_ba / z_ss

        def step(share: Scalar) -> Scalar:
            r = (share - elastic) / (1 - elastic)
            if equals(self.v_eps, 0.0):
                return (1 + sin(pi * (smooth.clip(r, 0.0, 1.0) - 0.5))) / 2
            return smooth.step5(r)

        return ahead(step, smooth.sign(v, self.v_eps), z[0] / z_ss)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the rate of the bristle deflection [m/s], shape (1, 1)."""
        numbers = (self.mu_d, N, self.sigma_0, self.z_ba)
        if all(map(is_number, numbers)) and self.z_ba >= self.mu_d * N / self.sigma_0:
            raise ValueError(
                "ElastoPlastic: expected z_ba < mu_d N / sigma_0 = "
                f"{self.mu_d * N / self.sigma_0:g} m, got z_ba = {self.z_ba:g} m; "
                "otherwise the bristle slides before it breaks away"
            )
        return column(v - self.sliding_share(v, N, z) * self.relaxation(v, N) * z[0])
