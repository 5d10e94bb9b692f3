"""Laws of parallel elements: Maxwell-slip, and with Stribeck effect and lag Leuven and GMS."""

from symfric.foundation.numeric import Scalar, both, column, either, expm1, is_number, total
from symfric.foundation.parameters import Parametric, option, parametric
from symfric.laws.base import fields, smooth
from symfric.laws.base.law import Facts, State, Switch
from symfric.laws.dynamic.element import (
    ConstantStep,
    Elements,
    StribeckLevel,
    ahead,
    held_columns,
    yielding,
)


@parametric
class Slider(Parametric):
    """Spring of stiffness k in series with a slider that slips at mu N."""

    k: Scalar = fields.STIFFNESS(1e5, doc="stiffness")
    mu: Scalar = fields.COEFFICIENT(0.1, doc="friction coefficient of the slider", lower=1e-12)


SLIDERS = (Slider(5e4, 0.025), Slider(2.5e4, 0.025), Slider(1.5e4, 0.025), Slider(1e4, 0.025))
"""Four sliders of 1e5 N/m and mu = 0.1 in total, which slip one after another."""


@parametric
class MaxwellSlip(Elements):
    """Maxwell-slip (Iwan) friction of n elements, with exact hysteresis and non-local memory.

        stick: dF_i/dt = k_i v     until |F_i| = mu_i N
        slip:  dF_i/dt = 0         until v changes sign
        F = F_1 + F_2 + ...

    form = "event" is this law for constant N, with a mode slip_i of 0 or 1 for each element.
    form = "smooth" has no modes and rounds the corner with the sharpness n:

        smooth: dF_i/dt = k_i v [1 - |F_i/(mu_i N)|^n (1 + sign(v F_i)) / 2]

    With n = 1, 2, 10, 50 an element reaches 63, 76, 94, 99 % of its limit at the stretch at which
    the exact element slips. `update` is the exact law for increments of position, for discrete time
    and optimisation.
    Limits: steady state (mu_1 + mu_2 + ...) N sign(v); rate-independent; virgin curve
    f(x) = sum min(k_i x, mu_i N). A reversal branch is twice the virgin curve (Masing), and closed
    inner loops are forgotten. One stiff element is Coulomb friction. |v| is smooth over v_eps.
    Keep v_eps a hundred times below the slowest motion of interest. Not valid for N = 0.
    Source: Iwan, ASME J. Appl. Mech. 33(4), 1966; Prandtl 1928 (play operators).
    Checked: jchristopherson/friction README; Lampaert, Al-Bender, Swevers 2003.
    """

    facts = Facts(
        ("D", "P", "M", "N"),
        "C∞ (C0 at the corners as n -> inf)",
        "two sources",
        load="proportional in steady sliding",
    )

    kind = Slider

    elements: tuple[Slider, ...] = SLIDERS
    n: Scalar = fields.SHARPNESS(20.0)
    v_eps: Scalar = fields.REST_EPS(1e-15)
    r_eps: Scalar = fields.R_EPS(1e-8)
    form: str = option("smooth", choices=("smooth", "event"), doc="rounded, or exact with modes")

    @property
    def states(self) -> tuple[State, ...]:
        """Spring forces [N], followed by the modes in the event form."""
        if self.form == "smooth":
            return super().states
        count, mode = range(1, len(self.elements) + 1), "1 while the element slips"
        modes = (State(f"slip_{i}", "1", 1.0, even=True, doc=mode, whole=True) for i in count)
        return (*super().states, *modes)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the steady sliding force [N] at a speed >= 0."""
        return N * total(e.mu for e in self.elements)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        return total(self.springs(z))

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the rates of the spring forces [N/s], and zero for the modes."""
        count = len(self.elements)
        if self.form == "event":
            forces = [(1 - z[count + i]) * e.k * v for i, e in enumerate(self.elements)]
            return column(*forces, *(0.0 * v for _ in self.elements))
        return column(*stretched(self, v, N, z))

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return the spring forces at their limits [N], and the modes of slip."""
        direction = smooth.sign(v, 0.0 if self.form == "event" else self.v_eps)
        forces = [e.mu * N * direction for e in self.elements]
        modes = [direction**2 for _ in self.elements] if self.form == "event" else []
        return column(*forces, *modes)

    def switches(self, v: Scalar, N: Scalar, z: Scalar = ()) -> tuple[Switch, ...]:
        """Return the switch of each element to slip at its limit, and of all to stick at v = 0."""
        if self.form == "smooth":
            return ()
        direction, limits = smooth.sign(v, 0.0), [e.mu * N for e in self.elements]
        resets = [
            {f"F_{i}": direction * e.mu * N, f"slip_{i}": 1.0}
            for i, e in enumerate(self.elements, start=1)
        ]
        return self.slip_switches(v, z, limits, resets)

    def held_step(self, v: Scalar, N: Scalar, z: Scalar, h: Scalar) -> tuple[Scalar, Scalar] | None:
        """Return the exact step in the event form, and None in the smooth form."""
        if self.form == "smooth":
            return None
        count, held = len(self.elements), ConstantStep.over(v, h)
        return held_columns(
            held.yielded(z[i], z[count + i], e.k, e.mu * N) for i, e in enumerate(self.elements)
        )

    def update(self, F: Scalar, dx: Scalar, N: Scalar) -> Scalar:
        """Return the exact spring forces [N] after the slip `dx` [m] in one direction."""
        pairs = zip(self.springs(F), self.elements, strict=True)
        return column(*(smooth.clip(F_i + e.k * dx, -e.mu * N, e.mu * N) for F_i, e in pairs))


def stretched(law: "MaxwellSlip | Leuven", v: Scalar, N: Scalar, z: Scalar) -> list[Scalar]:
    """Return the rates of the spring forces [N/s] in the smooth form at the slip velocity `v`."""
    return [
        e.k * yielding(v, F / (e.mu * N), law.n, law.v_eps, law.r_eps)
        for e, F in zip(law.elements, law.springs(z), strict=True)
    ]


LEUVEN_SLIDERS = (Slider(5e4, 0.05), Slider(2.5e4, 0.05), Slider(1.5e4, 0.05), Slider(1e4, 0.05))
"""Four sliders of 1e5 N/m and mu = 0.2 in total, which is above the static level."""


@parametric
class Leuven(StribeckLevel, Elements):
    """Modified Leuven friction (one state for each of n elements).

        g       = N [mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)]
        r       = F_h sign(v) / g,   F_h = F_1 + F_2 + ...
        dz/dt   = v [1 - sign(r) |r|^delta_l]
        dF_i/dt = k_i dz/dt [1 - |F_i/(mu_i N)|^n (1 + sign(dz/dt F_i)) / 2]
        F       = F_h + sigma_1 dz/dt + sigma_2 v

    The hysteresis force F_h is a `MaxwellSlip` force in z. It replaces the original stack of
    reversal points, which jumps where a loop closes. s(v) = g sign(v) is odd; with the unsigned s
    of the paper, z diverges for v < 0. |v| and signs are smooth over v_eps and r_eps.
    Limits: steady state g sign(v) + sigma_2 v, for any distribution of the F_i. delta_l -> inf is
    `MaxwellSlip` until F_h = g. Needs a sum of all mu_i of at least mu_s, otherwise z diverges. Not
    valid for N = 0.
    Source: Swevers, Al-Bender, Ganseman, Prajogo, IEEE TAC 45(4), 2000; Lampaert, Swevers,
    Al-Bender, IEEE TAC 47(4), 2002.
    Checked: Lampaert, Al-Bender, Swevers 2003, signs corrected.
    """

    facts = Facts(
        ("D", "S", "St", "V", "P", "M", "L", "B", "N"),
        "C∞ (C0 as v_eps -> 0 and n -> inf)",
        "one source",
        load="proportional in steady sliding",
    )
    kind = Slider

    elements: tuple[Slider, ...] = LEUVEN_SLIDERS
    delta_l: Scalar = fields.SHAPE(7.0, doc="sharpness of the transition", lower=1.0, upper=1e2)
    sigma_1: Scalar = fields.SIGMA_1(0.8)
    sigma_2: Scalar = fields.SIGMA_2(0.0)
    n: Scalar = fields.SHARPNESS(20.0)
    v_eps: Scalar = fields.REST_EPS(1e-15)
    r_eps: Scalar = fields.WIDTH(1e-8, doc="smoothing of the load shares")

    def __post_init__(self) -> None:
        super().__post_init__()
        shares = [e.mu for e in self.elements]
        if all(map(is_number, (*shares, self.mu_s))) and sum(shares) < self.mu_s:
            raise ValueError(
                f"Leuven: expected elements that carry mu_s = {self.mu_s:g} together, got "
                f"{sum(shares):g}; otherwise the bristle deflection diverges"
            )

    def stretching(self, v: Scalar, N: Scalar, z: Scalar) -> Scalar:
        """Return the rate dz/dt [m/s] of the hysteretic deflection."""
        share = total(self.springs(z)) / self.level(v, N)
        spent = smooth.signed_power(share, self.delta_l, self.r_eps)
        return v - smooth.magnitude(v, self.v_eps) * spent

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        damping = self.sigma_1 * self.stretching(v, N, z)
        return total(self.springs(z)) + damping + self.sigma_2 * v

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the rates of the element forces [N/s]."""
        return column(*stretched(self, self.stretching(v, N, z), N, z))

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return spring forces with the sum g sign(v), at the same load share of all elements.

        The steady state is not unique: other spring forces with this sum are steady as well.
        """
        whole = total(e.mu for e in self.elements)
        level = self.level(v, N) * smooth.sign(v, self.v_eps)
        return column(*(e.mu / whole * level for e in self.elements))


@parametric
class Element(Parametric):
    """Spring of stiffness k that carries the share alpha of the friction."""

    k: Scalar = fields.STIFFNESS(1e5, doc="stiffness")
    alpha: Scalar = fields.SHAPE(1.0, doc="share of the friction", lower=1e-12)


ELEMENTS = (Element(5e4, 0.25), Element(2.5e4, 0.25), Element(1.5e4, 0.25), Element(1e4, 0.25))
"""Four elements of 1e5 N/m in total, which slip one after another."""


@parametric
class GMS(StribeckLevel, Elements):
    """Generalised Maxwell-slip (GMS) friction of n elements (2n states).

        g = N [mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)]
        stick: dF_i/dt = k_i v                                until |F_i| = alpha_i g(v)
        slip:  dF_i/dt = C (alpha_i sign(v) - F_i/g(v))       until v passes through zero
        F = F_1 + F_2 + ... + sigma_2 v

    The shares alpha_i are divided by their sum. C [N/s] determines the lag: in slip all elements
    follow g with the time constant g/C.
    form = "event" is this law with a mode p_i of 0 (stick) or 1 (slip) for each element.
    form = "smooth" changes p_i over a short path, with r_i = F_i sign(v) / (alpha_i g),
    on = step((r_i - 1)/rho + 1), off = step(-5 r_i) and w_i = p_i (1 - off):

        dp_i/dt = |v| k_i / (alpha_i g rho) [on (1 - p_i) - off p_i]
        dF_i/dt = (1 - w_i) stick + w_i slip

    The smooth form slips too early by at most the share rho of the limit. Its steady state, lag and
    memory are those of the original, and no state changes at rest. sign and |v| are smooth over
    v_eps. Keep v_eps a hundred times below the slowest motion of interest. Periodic cycles are
    dissipative; within a cycle, decelerating slip may store slightly more energy in the springs
    than the work done on them.
    Limits: steady state g sign(v) + sigma_2 v; C -> inf and mu_s = mu_d is `MaxwellSlip`. At rest
    and in pre-sliding the forces are those of `MaxwellSlip` with the limits alpha_i g(0). Not valid
    for N = 0. A sticking body is undamped: it oscillates with the frequency sqrt(sum k_i/m), and
    every reversal is a switch. The block of `Rabinowicz` takes 40 000 steps over 20 s, 20 000 with
    sigma_2 = 0.5 N s/m and 3 700 with 2 N s/m, which ends its stick-slip.
    Source: Lampaert, Al-Bender, Swevers, Phys. Conf. 2003; Al-Bender, Lampaert, Swevers, IEEE TAC
    50(11), 2005. The smooth form is constructed and differs from that of Boegli et al.
    Checked: jchristopherson/friction README; the paper of 2003; smooth form constructed.
    """

    facts = Facts(
        ("D", "S", "St", "V", "P", "M", "L", "B", "N"),
        "C2 (switched as rho -> 0)",
        "two sources",
        load="proportional in steady sliding",
    )
    kind = Element

    elements: tuple[Element, ...] = ELEMENTS
    C: Scalar = fields.TIME(24.0, unit="N/s", doc="attraction to the Stribeck curve")
    sigma_2: Scalar = fields.SIGMA_2(0.0)
    v_eps: Scalar = fields.REST_EPS(1e-15, doc="smoothing velocity of sign(v)", lower=1e-15)
    rho: Scalar = fields.SHAPE(0.03, doc="share over which slip sets in", lower=1e-6, upper=0.5)
    form: str = option("smooth", choices=("smooth", "event"), doc="latched, or exact with modes")

    @property
    def states(self) -> tuple[State, ...]:
        """Spring forces and modes."""
        mode, whole = "0 in stick, 1 in slip", self.form == "event"
        count = range(1, len(self.elements) + 1)
        modes = (State(f"p_{i}", "1", 1.0, even=True, doc=mode, whole=whole) for i in count)
        return (*super().states, *modes)

    def shares(self) -> list[Scalar]:
        """Return the shares alpha_i, divided by their sum."""
        whole = total(e.alpha for e in self.elements)
        return [e.alpha / whole for e in self.elements]

    def _direction(self, v: Scalar) -> Scalar:
        return smooth.sign(v, 0.0 if self.form == "event" else self.v_eps)

    def _begins(self, r: Scalar) -> Scalar:
        return smooth.step5((r - 1) / self.rho + 1)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        return total((self.sigma_2 * v, *self.springs(z)))

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the rates of the spring forces [N/s] and of the modes [1/s]."""
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
        """Return the states in which all elements slip on the Stribeck curve."""
        direction = self._direction(v)
        forces = [alpha * self.level(v, N) * direction for alpha in self.shares()]
        return column(*forces, *(direction**2 for _ in forces))

    def held_step(self, v: Scalar, N: Scalar, z: Scalar, h: Scalar) -> tuple[Scalar, Scalar] | None:
        """Return the exact step in the event form: stick up to the limit, or exponential slip.

        Return None in the smooth form.
        """
        if self.form == "smooth":
            return None
        count, g, held = len(self.elements), self.level(v, N), ConstantStep.over(v, h)
        x = -self.C * h / g
        left, left_in_mean = 1 + expm1(x), smooth.phi1(x)
        share = g / total(e.alpha for e in self.elements)
        parts: list[tuple[Scalar, Scalar, Scalar]] = []
        for i, e in enumerate(self.elements):
            F, p, limit = z[i], z[count + i], e.alpha * share
            load, goal = held.s * F, held.s * limit
            slips = either(load >= limit, both(p > 0.5, load > 0))
            slipped = goal + (F - goal) * left, goal + (F - goal) * left_in_mean
            parts.append(held.stretched(F, p, e.k, limit, slips, slipped))
        return held_columns(parts)

    def switches(self, v: Scalar, N: Scalar, z: Scalar = ()) -> tuple[Switch, ...]:
        """Return the switch of each element to slip at its limit, and of all to stick at v = 0."""
        if self.form == "smooth":
            return ()
        g = self.level(v, N)
        limits = [alpha * g for alpha in self.shares()]
        resets = [{f"p_{i + 1}": 1.0} for i in range(len(limits))]
        return self.slip_switches(v, z, limits, resets)
