"""Generalised Maxwell-slip friction: hysteresis with memory, Stribeck effect and lag."""

from dataclasses import dataclass
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, both, column, either, expm1
from symfric.foundation.parameters import Parametric, option, param
from symfric.laws.base import smooth
from symfric.laws.base.law import Facts, Law, State, Switch
from symfric.laws.dynamic.element import Held, ahead, check_elements


@final
@dataclass(frozen=True, eq=False)
class Element(Parametric):
    """One element: a spring of stiffness k that carries the share alpha of the friction."""

    k: Scalar = param(1e5, unit="N/m", role="stiffness", doc="stiffness", lower=1e-12)
    alpha: Scalar = param(1.0, unit="1", role="shape", doc="share of the friction", lower=1e-12)


ELEMENTS = (Element(5e4, 0.25), Element(2.5e4, 0.25), Element(1.5e4, 0.25), Element(1e4, 0.25))
"""Together 1e5 N/m, slipping one after the other."""


@final
@dataclass(frozen=True, eq=False)
class GMS(Law):
    """Generalised Maxwell-slip (GMS) friction of n elements (2n states).

        g = N [mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)]
        stick: dF_i/dt = k_i v                                until |F_i| = alpha_i g(v)
        slip:  dF_i/dt = C (alpha_i sign(v) - F_i/g(v))       until v passes through zero
        F = F_1 + F_2 + ... + sigma_2 v

    The shares alpha_i are divided by their sum. C [N/s] makes the lag: all elements follow g with
    the time constant g/C.
    form = "event" is this law with a mode p_i of 0 (stick) or 1 (slip) for each element.
    form = "smooth" lets p_i latch over a short path, with r_i = F_i sign(v) / (alpha_i g),
    on = step((r_i - 1)/rho + 1), off = step(-5 r_i) and w_i = p_i (1 - off):

        dp_i/dt = |v| k_i / (alpha_i g rho) [on (1 - p_i) - off p_i]
        dF_i/dt = (1 - w_i) stick + w_i slip

    It slips too early by up to the share rho of the limit; steady state, lag and memory are those
    of the original and no state moves at rest. sign and |v| are smooth over v_eps, to be kept a
    hundred times below the slowest motion of interest. Settled cycles dissipate; within one, slip
    that slows down stretches the springs in time, by a little more than the work done on them.
    Limits: steady state g sign(v) + sigma_2 v; C -> inf and mu_s = mu_d is `MaxwellSlip`; at rest
    and in pre-sliding its forces are those of `MaxwellSlip` with limits alpha_i g(0). Not valid
    for N = 0. Nothing damps a body that the springs hold: it rings with sqrt(sum k_i/m), and every
    turn is a switch. The block of `Rabinowicz` takes 40 000 steps over 20 s, 20 000 with
    sigma_2 = 0.5 N s/m and 3 700 with 2 N s/m, which ends its stick-slip.
    Source: Lampaert, Al-Bender, Swevers, Phys. Conf. 2003; Al-Bender, Lampaert, Swevers, IEEE TAC
    50(11), 2005. The smooth form is constructed here; it is not that of Boegli et al.
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St", "V", "P", "M", "L", "B", "N"),
        smoothness="C2 (switched as rho -> 0)",
        confidence="two sources",
        checked="jchristopherson/friction README; the paper of 2003; smooth form constructed",
        source="Al-Bender, Lampaert, Swevers, IEEE TAC 50(11), 2005",
        load="proportional in steady sliding",
    )
    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("mu_d", "mu_s"),)

    elements: tuple[Element, ...] = ELEMENTS
    mu_s: Scalar = param(0.15, unit="1", role="level", doc="static friction coefficient", lower=0.0)
    mu_d: Scalar = param(
        0.1, unit="1", role="level", doc="dynamic friction coefficient", lower=1e-12
    )
    v_s: Scalar = param(
        1e-3, unit="m/s", role="velocity scale", doc="Stribeck velocity", lower=1e-12
    )
    delta: Scalar = param(
        2.0, unit="1", role="shape", doc="Stribeck exponent", lower=0.1, upper=10.0
    )
    C: Scalar = param(
        24.0, unit="N/s", role="time", doc="attraction to the Stribeck curve", lower=1e-12
    )
    sigma_2: Scalar = param(0.0, unit="N s/m", role="viscous", doc="viscous coefficient", lower=0.0)
    v_eps: Scalar = param(
        1e-15, unit="m/s", role="width", doc="smoothing velocity of sign(v)", lower=1e-15
    )
    rho: Scalar = param(
        0.03, unit="1", role="shape", doc="share over which slip sets in", lower=1e-6, upper=0.5
    )
    form: str = option("smooth", choices=("smooth", "event"), doc="latched, or exact with modes")

    def __post_init__(self) -> None:
        check_elements(self, Element)
        super().__post_init__()

    @property
    def states(self) -> tuple[State, ...]:
        """The spring forces and the modes."""
        count = range(1, len(self.elements) + 1)
        forces = tuple(State(f"F_{i}", "N", 0.1, doc="spring force") for i in count)
        mode, whole = "0 in stick, 1 in slip", self.form == "event"
        return forces + tuple(State(f"p_{i}", "1", 1.0, True, mode, whole) for i in count)

    @property
    def velocity_scale(self) -> Scalar:
        """The Stribeck velocity [m/s]."""
        return self.v_s

    def level(self, v: Scalar, N: Scalar) -> Scalar:
        """The Stribeck curve g(v, N) > 0 [N] that the force tends to."""
        falling = smooth.stribeck(v, self.v_s, self.delta, self.v_eps)
        return N * (self.mu_d + (self.mu_s - self.mu_d) * falling)

    def shares(self) -> list[Scalar]:
        """The alpha_i, divided by their sum."""
        total = self._total()
        return [e.alpha / total for e in self.elements]

    def _total(self) -> Scalar:
        return sum((e.alpha for e in self.elements[1:]), start=self.elements[0].alpha)

    def _direction(self, v: Scalar) -> Scalar:
        return smooth.sign(v, 0.0 if self.form == "event" else self.v_eps)

    def _begins(self, r: Scalar) -> Scalar:
        return smooth.step5((r - 1) / self.rho + 1)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Steady sliding force [N] at a speed >= 0."""
        mu = self.mu_d + (self.mu_s - self.mu_d) * smooth.fall(speed, self.v_s, self.delta)
        return mu * N + self.sigma_2 * speed

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        return sum((z[i] for i in range(len(self.elements))), start=self.sigma_2 * v)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Rates of the spring forces [N/s] and of the modes [1/s]."""
        count, g, direction = len(self.elements), self.level(v, N), self._direction(v)
        forces: list[Scalar] = []
        modes: list[Scalar] = []
        for i, (e, alpha) in enumerate(zip(self.elements, self.shares(), strict=True)):
            F, p = z[i], z[count + i]
            slipping, latch = p, 0.0 * v
            if self.form == "smooth":
                r = F / (alpha * g)
                on = ahead(self._begins, direction, r)
                off = smooth.step5(-5 * (r * direction))
                pace = smooth.magnitude(v, self.v_eps) * e.k / (alpha * g * self.rho)
                slipping, latch = p * (1 - off), pace * (on * (1 - p) - off * p)
            slip = self.C * direction**2 * (alpha * direction - F / g)
            forces.append((1 - slipping) * e.k * v + slipping * slip)
            modes.append(latch)
        return column(*forces, *modes)

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """All elements slipping on the Stribeck curve."""
        direction = self._direction(v)
        forces = [alpha * self.level(v, N) * direction for alpha in self.shares()]
        return column(*forces, *(direction**2 for _ in forces))

    def held_step(self, v: Scalar, N: Scalar, z: Scalar, h: Scalar) -> tuple[Scalar, Scalar] | None:
        """Exact in the event form: stick up to the limit, or exponential slip towards it."""
        if self.form == "smooth":
            return None
        count, g, held = len(self.elements), self.level(v, N), Held.over(v, h)
        x = -self.C * h / g
        left, left_in_mean = 1 + expm1(x), smooth.phi1(x)
        share = g / self._total()
        parts: list[tuple[Scalar, Scalar, Scalar]] = []
        for i, e in enumerate(self.elements):
            F, p, limit = z[i], z[count + i], e.alpha * share
            load, goal = held.s * F, held.s * limit
            slips = either(load >= limit, both(p > 0.5, load > 0))
            slipped = goal + (F - goal) * left, goal + (F - goal) * left_in_mean
            parts.append(held.stretched(F, p, e.k, limit, slips, slipped))
        ends, means, modes = zip(*parts, strict=True)
        return column(*ends, *modes), column(*means, *modes)

    def switches(self, v: Scalar, N: Scalar, z: Scalar = ()) -> tuple[Switch, ...]:
        """Slip of each element at its limit, stick of all when v passes through zero."""
        if self.form == "smooth":
            return ()
        count, g, direction = len(self.elements), self.level(v, N), self._direction(v)
        slips = tuple(
            Switch(
                f"slip_{i + 1}",
                smooth.choose(z[count + i] > 0.5, -1.0, direction * z[i] / (alpha * g) - 1),
                direction=1,
                reset={f"p_{i + 1}": 1.0},
            )
            for i, alpha in enumerate(self.shares())
        )
        return (*slips, Switch("reversal", v, reset={f"p_{i + 1}": 0.0 for i in range(count)}))
