"""Leuven friction in the modification by Lampaert: hysteresis with memory inside a bristle."""

from dataclasses import dataclass
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, column, is_number
from symfric.foundation.parameters import param
from symfric.laws.base import smooth
from symfric.laws.base.law import Facts, Law, State
from symfric.laws.dynamic.element import check_elements, yielding
from symfric.laws.dynamic.maxwell_slip import Slider

SLIDERS = (Slider(5e4, 0.05), Slider(2.5e4, 0.05), Slider(1.5e4, 0.05), Slider(1e4, 0.05))
"""Together 1e5 N/m and mu = 0.2, above the static level."""


@final
@dataclass(frozen=True, eq=False)
class Leuven(Law):
    """Leuven friction, modified (n states of the hysteresis).

        g       = N [mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)]
        r       = F_h sign(v) / g,   F_h = F_1 + F_2 + ...
        dz/dt   = v [1 - sign(r) |r|^delta_l]
        dF_i/dt = k_i dz/dt [1 - |F_i/(mu_i N)|^n (1 + sign(dz/dt F_i)) / 2]
        F       = F_h + sigma_1 dz/dt + sigma_2 v

    The hysteresis force F_h is a `MaxwellSlip` force in z instead of the original stack of
    reversal points, which jumps where a loop closes. s(v) = g sign(v) is odd; with the unsigned s
    that is printed, z runs away for v < 0. |v| and signs are smooth over v_eps and r_eps.
    Limits: steady state g sign(v) + sigma_2 v, whatever the F_i. delta_l -> inf is `MaxwellSlip`
    until F_h = g. Needs mu_1 + mu_2 + ... >= mu_s, else z runs away. Not valid for N = 0.
    Source: Swevers, Al-Bender, Ganseman, Prajogo, IEEE TAC 45(4), 2000; Lampaert, Swevers,
    Al-Bender, IEEE TAC 47(4), 2002.
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St", "V", "P", "M", "L", "B", "N"),
        smoothness="C∞ (C0 as v_eps -> 0 and n -> inf)",
        confidence="one source",
        checked="Lampaert, Al-Bender, Swevers 2003, signs corrected",
        source="Lampaert, Swevers, Al-Bender, IEEE TAC 47(4), 2002",
        load="proportional in steady sliding",
    )
    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("mu_d", "mu_s"),)

    elements: tuple[Slider, ...] = SLIDERS
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
    delta_l: Scalar = param(
        7.0, unit="1", role="shape", doc="sharpness of the transition", lower=1.0, upper=1e2
    )
    sigma_1: Scalar = param(0.8, unit="N s/m", role="damping", doc="bristle damping", lower=0.0)
    sigma_2: Scalar = param(0.0, unit="N s/m", role="viscous", doc="viscous coefficient", lower=0.0)
    n: Scalar = param(
        20.0, unit="1", role="shape", doc="sharpness of the yielding", lower=1.0, upper=1e3
    )
    v_eps: Scalar = param(
        1e-15, unit="m/s", role="width", doc="smoothing velocity of |v|", lower=0.0
    )
    r_eps: Scalar = param(
        1e-8, unit="1", role="width", doc="smoothing of the load shares", lower=1e-12
    )

    def __post_init__(self) -> None:
        check_elements(self, Slider)
        super().__post_init__()
        shares = [e.mu for e in self.elements]
        if all(map(is_number, (*shares, self.mu_s))) and sum(shares) < self.mu_s:
            raise ValueError(
                f"Leuven: expected elements that carry mu_s = {self.mu_s:g} together, got "
                f"{sum(shares):g}; the bristle would run away"
            )

    @property
    def states(self) -> tuple[State, ...]:
        """The forces of the hysteresis elements."""
        return tuple(
            State(f"F_{i}", "N", 0.1, doc="spring force") for i in range(1, len(self.elements) + 1)
        )

    @property
    def velocity_scale(self) -> Scalar:
        """The Stribeck velocity [m/s]."""
        return self.v_s

    def level(self, v: Scalar, N: Scalar) -> Scalar:
        """The Stribeck curve g(v, N) > 0 [N] that the hysteresis force tends to."""
        falling = smooth.stribeck(v, self.v_s, self.delta, self.v_eps)
        return N * (self.mu_d + (self.mu_s - self.mu_d) * falling)

    def _hysteresis(self, z: Scalar) -> Scalar:
        return sum((z[i] for i in range(1, len(self.elements))), start=z[0])

    def stretching(self, v: Scalar, N: Scalar, z: Scalar) -> Scalar:
        """dz/dt [m/s] of the hysteretic deflection."""
        share = self._hysteresis(z) / self.level(v, N)
        spent = smooth.signed_power(share, self.delta_l, self.r_eps)
        return v - smooth.magnitude(v, self.v_eps) * spent

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Steady sliding force [N] at a speed >= 0."""
        mu = self.mu_d + (self.mu_s - self.mu_d) * smooth.fall(speed, self.v_s, self.delta)
        return mu * N + self.sigma_2 * speed

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        damping = self.sigma_1 * self.stretching(v, N, z)
        return self._hysteresis(z) + damping + self.sigma_2 * v

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Rates of the element forces [N/s]."""
        stretch = self.stretching(v, N, z)
        return column(
            *(
                e.k * yielding(stretch, z[i] / (e.mu * N), self.n, self.v_eps, self.r_eps)
                for i, e in enumerate(self.elements)
            )
        )

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """One of the states whose sum is g sign(v): all elements at the same load share."""
        total = sum((e.mu for e in self.elements[1:]), start=self.elements[0].mu)
        level = self.level(v, N) * smooth.sign(v, self.v_eps)
        return column(*(e.mu / total * level for e in self.elements))
