"""Haessig-Friedland friction: the reset integrator."""

from dataclasses import dataclass
from math import inf
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, column
from symfric.foundation.parameters import option, param
from symfric.laws.base import smooth
from symfric.laws.base.law import Facts, Law, State, Switch
from symfric.laws.dynamic.element import Held, deflection, yielding


@final
@dataclass(frozen=True, eq=False)
class HaessigFriedland(Law):
    """Reset-integrator friction (one state, with a mode in the event form).

        r     = sigma_0 z / (mu_d N)
        stick: dz/dt = v until |r| = 1
        slip:  dz/dt = 0 until v changes sign
        F = sigma_0 z mu_s/mu_d + sigma_1 dz/dt  in stick,  sigma_0 z  in slip

    The stiction gradient of the paper is a = (mu_s - mu_d) / mu_d. form = "event" is this law, for
    constant N; the force drops from mu_s N to mu_d N at once. form = "smooth" yields with the
    sharpness n, and loses the excess in a step of |r| from 1 - knee to 1:

        smooth: dz/dt = v [1 - |r|^n (1 + sign(v r)) / 2]

    Limits: steady state mu_d N sign(v); rate-independent for sigma_1 = 0; drifts as little as
    `MaxwellSlip` with one element. While the bristle unloads F v < 0: it gives back what it stored,
    at most mu_s mu_d N^2 / (2 sigma_0). |v| is smooth over v_eps. Not valid for N = 0.
    Source: Haessig and Friedland, ASME J. Dyn. Syst. Meas. Control 113(3), 1991.
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "P", "N"),
        smoothness="C2 (jumps as knee -> 0)",
        confidence="unverified",
        checked="the smooth form is constructed",
        source="Haessig and Friedland, J. Dyn. Syst. Meas. Control 113(3), 1991",
        load="proportional in steady sliding",
    )
    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("mu_d", "mu_s"),)

    mu_s: Scalar = param(0.15, unit="1", role="level", doc="static friction coefficient", lower=0.0)
    mu_d: Scalar = param(
        0.1, unit="1", role="level", doc="dynamic friction coefficient", lower=1e-12
    )
    sigma_0: Scalar = param(
        1e5, unit="N/m", role="stiffness", doc="bristle stiffness in slip", lower=1e-12
    )
    sigma_1: Scalar = param(
        190.0, unit="N s/m", role="damping", doc="bristle damping in stick", lower=0.0
    )
    n: Scalar = param(
        50.0, unit="1", role="shape", doc="sharpness of the yielding", lower=1.0, upper=1e3
    )
    knee: Scalar = param(
        0.05, unit="1", role="shape", doc="share over which excess is lost", lower=1e-6, upper=1
    )
    v_eps: Scalar = param(
        1e-15, unit="m/s", role="width", doc="smoothing velocity of |v|", lower=0.0
    )
    r_eps: Scalar = param(
        1e-8, unit="1", role="width", doc="smoothing of the load share", lower=1e-12
    )
    form: str = option("smooth", choices=("smooth", "event"), doc="rounded, or exact with modes")

    @property
    def states(self) -> tuple[State, ...]:
        """The bristle deflection, and in the event form the mode."""
        slip = State("slip", "1", 1.0, even=True, doc="1 in slip", whole=True)
        bristle = State("z", "m", deflection(self.sigma_0), doc="bristle deflection")
        return (bristle, slip) if self.form == "event" else (bristle,)

    @property
    def velocity_scale(self) -> Scalar:
        """None: the force depends on the path."""
        return inf

    def _share(self, N: Scalar, z: Scalar) -> Scalar:
        return self.sigma_0 * z[0] / (self.mu_d * N)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Rate of the deflection [m/s] and, zero, of the mode."""
        if self.form == "event":
            return column((1 - z[1]) * v, 0.0 * v)
        return column(yielding(v, self._share(N, z), self.n, self.v_eps, self.r_eps))

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Steady sliding force [N] at a speed >= 0."""
        return self.mu_d * N

    def static_level(self, N: Scalar, side: int = 1) -> Scalar:
        """The force [N] of break-away, mu_s N."""
        return self.mu_s * N

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        if self.form == "event":
            excess = 1 - z[1]
        else:
            r = smooth.magnitude(self._share(N, z), self.r_eps)
            excess = 1 - smooth.step5((r - 1) / self.knee + 1)
        stiffness = self.sigma_0 * (1 + (self.mu_s / self.mu_d - 1) * excess)
        return stiffness * z[0] + self.sigma_1 * self.rate(v, N, z)[0]

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Deflection at its limit [m], mode slipping."""
        direction = smooth.sign(v, 0.0 if self.form == "event" else self.v_eps)
        z = self.mu_d * N / self.sigma_0 * direction
        return column(z, direction**2) if self.form == "event" else column(z)

    def held_step(self, v: Scalar, N: Scalar, z: Scalar, h: Scalar) -> tuple[Scalar, Scalar] | None:
        """Exact in the event form; the mode counts as that at the end of the step."""
        if self.form == "smooth":
            return None
        held = Held.over(v, h)
        end, mean, slip = held.yielded(z[0], z[1], 1.0, self.mu_d * N / self.sigma_0)
        return column(end, slip), column(mean, slip)

    def switches(self, v: Scalar, N: Scalar, z: Scalar = ()) -> tuple[Switch, ...]:
        """Slip at the limit, stick when v changes sign."""
        if self.form == "smooth":
            return ()
        direction = smooth.sign(v, 0.0)
        reached = smooth.choose(z[1] > 0.5, -1.0, direction * self._share(N, z) - 1)
        limit = direction * self.mu_d * N / self.sigma_0
        return (
            Switch("slip_begins", reached, 1, {"z": limit, "slip": 1.0}),
            Switch("reversal", v, 0, {"slip": 0.0}),
        )
