"""Maxwell-slip friction: springs with Coulomb sliders side by side, the exact hysteresis."""

from dataclasses import dataclass
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, column
from symfric.foundation.parameters import Parametric, option, param
from symfric.laws.base import smooth
from symfric.laws.base.law import Facts, Law, State, Switch
from symfric.laws.dynamic.element import Held, check_elements, yielding


@final
@dataclass(frozen=True, eq=False)
class Slider(Parametric):
    """A spring of stiffness k on a slider that carries mu N."""

    k: Scalar = param(1e5, unit="N/m", role="stiffness", doc="stiffness", lower=1e-12)
    mu: Scalar = param(
        0.1, unit="1", role="level", doc="friction coefficient of the slider", lower=1e-12
    )


SLIDERS = (Slider(5e4, 0.025), Slider(2.5e4, 0.025), Slider(1.5e4, 0.025), Slider(1e4, 0.025))
"""Together 1e5 N/m and mu = 0.1, slipping one after the other."""


@final
@dataclass(frozen=True, eq=False)
class MaxwellSlip(Law):
    """Maxwell-slip (Iwan) friction of n elements, the exact hysteresis with non-local memory.

        stick: dF_i/dt = k_i v     until |F_i| = mu_i N
        slip:  dF_i/dt = 0         until v changes sign
        F = F_1 + F_2 + ...

    form = "event" is this law, with a mode slip_i of 0 or 1 for each element, for constant N.
    form = "smooth" (n elements, n states) rounds the corner by the sharpness n:

        smooth: dF_i/dt = k_i v [1 - |F_i/(mu_i N)|^n (1 + sign(v F_i)) / 2]

    With n = 1, 2, 10, 50 an element reaches 63, 76, 94, 99 % of its limit over the stretch at which
    the exact one slips. `update` is the exact law for increments of position, for discrete time and
    optimisation.
    Limits: steady state (mu_1 + mu_2 + ...) N sign(v); rate-independent; virgin curve
    f(x) = sum min(k_i x, mu_i N); a reversal branch is twice the virgin curve (Masing), and closed
    inner loops are forgotten. One stiff element is Coulomb friction. |v| is smooth over v_eps, to
    be kept a hundred times below the slowest motion of interest. Not valid for N = 0.
    Source: Iwan, ASME J. Appl. Mech. 33(4), 1966; Prandtl 1928 (play operators).
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "P", "M", "N"),
        smoothness="C∞ (C0 at the corners as n -> inf)",
        confidence="two sources",
        checked="jchristopherson/friction README; Lampaert, Al-Bender, Swevers 2003",
        source="Iwan, J. Appl. Mech. 33(4), 1966",
        load="proportional in steady sliding",
    )

    elements: tuple[Slider, ...] = SLIDERS
    n: Scalar = param(
        20.0, unit="1", role="shape", doc="sharpness of the yielding", lower=1.0, upper=1e3
    )
    v_eps: Scalar = param(
        1e-15, unit="m/s", role="width", doc="smoothing velocity of |v|", lower=0.0
    )
    r_eps: Scalar = param(
        1e-8, unit="1", role="width", doc="smoothing of the load share", lower=1e-12
    )
    form: str = option("smooth", choices=("smooth", "event"), doc="rounded, or exact with modes")

    def __post_init__(self) -> None:
        check_elements(self, Slider)
        super().__post_init__()

    @property
    def states(self) -> tuple[State, ...]:
        """The spring forces, and in the event form the modes."""
        count = range(1, len(self.elements) + 1)
        forces = tuple(State(f"F_{i}", "N", 0.1, doc="spring force") for i in count)
        mode = "1 while the element slips"
        modes = tuple(State(f"slip_{i}", "1", 1.0, True, mode, whole=True) for i in count)
        return forces + (modes if self.form == "event" else ())

    @property
    def velocity_scale(self) -> Scalar:
        """None: the force depends on the path alone."""
        return float("inf")

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Steady sliding force [N] at a speed >= 0."""
        return N * sum((e.mu for e in self.elements[1:]), start=self.elements[0].mu)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        return sum((z[i] for i in range(1, len(self.elements))), start=z[0])

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Rates of the spring forces [N/s] and, zero, of the modes."""
        count = len(self.elements)
        if self.form == "event":
            forces = [(1 - z[count + i]) * e.k * v for i, e in enumerate(self.elements)]
            return column(*forces, *(0.0 * v for _ in self.elements))
        return column(
            *(
                e.k * yielding(v, z[i] / (e.mu * N), self.n, self.v_eps, self.r_eps)
                for i, e in enumerate(self.elements)
            )
        )

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Sliders at their limits, modes slipping."""
        direction = smooth.sign(v, 0.0 if self.form == "event" else self.v_eps)
        forces = [e.mu * N * direction for e in self.elements]
        modes = [direction**2 for _ in self.elements] if self.form == "event" else []
        return column(*forces, *modes)

    def switches(self, v: Scalar, N: Scalar, z: Scalar = ()) -> tuple[Switch, ...]:
        """Slip of each element at its limit, stick of all when v changes sign."""
        if self.form == "smooth":
            return ()
        count, direction = len(self.elements), smooth.sign(v, 0.0)
        slips = tuple(
            Switch(
                f"slip_{i + 1}",
                smooth.choose(z[count + i] > 0.5, -1.0, direction * z[i] / (e.mu * N) - 1),
                direction=1,
                reset={f"F_{i + 1}": direction * e.mu * N, f"slip_{i + 1}": 1.0},
            )
            for i, e in enumerate(self.elements)
        )
        sticking = {f"slip_{i + 1}": 0.0 for i in range(count)}
        return (*slips, Switch("reversal", v, reset=sticking))

    def held_step(self, v: Scalar, N: Scalar, z: Scalar, h: Scalar) -> tuple[Scalar, Scalar] | None:
        """Exact in the event form."""
        if self.form == "smooth":
            return None
        count, held = len(self.elements), Held.over(v, h)
        parts = [
            held.yielded(z[i], z[count + i], e.k, e.mu * N) for i, e in enumerate(self.elements)
        ]
        ends, means, modes = zip(*parts, strict=True)
        return column(*ends, *modes), column(*means, *modes)

    def update(self, F: Scalar, dx: Scalar, N: Scalar) -> Scalar:
        """The spring forces after the slip `dx` [m] in one direction, exactly; their sum is F."""
        held = [
            smooth.clip(F[i] + e.k * dx, -e.mu * N, e.mu * N) for i, e in enumerate(self.elements)
        ]
        return column(*held)
