"""Parts that several laws with states share: Stribeck levels, parallel elements, yielding."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, final

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, column, is_number, sqrt
from symfric.foundation.parameters import Parametric, parametric
from symfric.foundation.vector import ROUND, Vector, Vectors
from symfric.laws.base import fields, smooth
from symfric.laws.base.families import Levels
from symfric.laws.base.law import Law, State, Switch


class _Smoothed(Law):
    """Law with viscous friction and a smoothing velocity, both declared by subclasses."""

    sigma_2: Scalar
    v_eps: Scalar


@parametric
class StribeckLevel(Levels, _Smoothed):
    """Law with states whose sliding force is a Stribeck curve.

    g = N [mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)]
    """

    mu_d: Scalar = fields.MU_D(0.1, lower=1e-12)
    v_s: Scalar = fields.V_S(1e-3)
    delta: Scalar = fields.DELTA(2.0)

    def level(self, v: Scalar, N: Scalar) -> Scalar:
        """Return the Stribeck curve g(v, N) > 0 [N], the limit of the force of the states."""
        falling = smooth.stribeck(v, self.v_s, self.delta, self.v_eps)
        return N * (self.mu_d + (self.mu_s - self.mu_d) * falling)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the steady sliding force [N] at a speed >= 0."""
        mu = self.mu_d + (self.mu_s - self.mu_d) * smooth.fall(speed, self.v_s, self.delta)
        return mu * N + self.sigma_2 * speed


@parametric
class Elements(Law):
    """Law of parallel elements, which are springs whose forces F_i are the states.

    In the event form each element also has a mode, which is 0 in stick and 1 in slip.
    """

    kind: ClassVar[type[Parametric]]
    """Class of the elements."""

    elements: tuple[Any, ...] = ()

    def __post_init__(self) -> None:
        where, one = f"{type(self).__name__}: elements", f"{self.kind.__name__}()"
        elements = checks.many(where, self.elements, f"elements, such as {one}")
        if not elements:
            raise checks.refused(where, f"at least one element, such as {one}", elements)
        for element in elements:
            checks.kind(where, element, self.kind, f"an element, such as {one}")
        object.__setattr__(self, "elements", elements)
        super().__post_init__()

    @property
    def states(self) -> tuple[State, ...]:
        """Spring forces."""
        count = range(1, len(self.elements) + 1)
        return tuple(State(f"F_{i}", "N", 0.1, doc="spring force") for i in count)

    def springs(self, z: Scalar) -> list[Scalar]:
        """Return the spring forces [N]."""
        return [z[i] for i in range(len(self.elements))]

    def slip_switches(
        self, v: Scalar, z: Scalar, limits: Sequence[Scalar], resets: Sequence[dict[str, Scalar]]
    ) -> tuple[Switch, ...]:
        """Return the switch of each element to slip at its limit [N], and of all to stick at v = 0.

        `resets` contains the new states of each element, with its mode last.
        """
        direction = smooth.sign(v, 0.0)
        slips = tuple(
            Switch(
                f"slip_{i + 1}",
                smooth.choose(z[len(limits) + i] > 0.5, -1.0, direction * z[i] / limit - 1),
                direction=1,
                reset=reset,
            )
            for i, (limit, reset) in enumerate(zip(limits, resets, strict=True))
        )
        return (*slips, Switch("reversal", v, reset={list(reset)[-1]: 0.0 for reset in resets}))


def held_columns(parts: Iterable[tuple[Scalar, Scalar, Scalar]]) -> tuple[Scalar, Scalar]:
    """Return the end and mean columns of a held step from (end, mean, mode) of each element."""
    ends, means, modes = zip(*parts, strict=True)
    return column(*ends, *modes), column(*means, *modes)


TYPICAL, FIRM = 1e-5, 1e5
"""Typical deflection [m] of bristles, and the force [N] that bounds it for stiff bristles."""


def deflection(sigma_0: Scalar) -> float:
    """Return the nominal deflection [m] of a bristle of stiffness `sigma_0` [N/m].

    Absolute tolerances are proportional to it. For a bristle of 1e15 N/m, which breaks away at
    1e-14 m, the typical value of 1e-5 m would be too large. The force `FIRM` is large because with
    10 N the solver would resolve the vibrations of a bristle of 1e12 N/m, in a thousand times as
    many steps for the same motion.
    """
    return min(TYPICAL, FIRM / float(sigma_0)) if is_number(sigma_0) else TYPICAL


def along(t: Vector, s: Vector) -> Scalar:
    """Return the share a of the slip along t that loads along s: 1 for t = s, 0 for t = -s.

        a = [1 + c + sqrt(c^2 + w^2) - sqrt(1 + w^2)] / 2,   c = t.s, w the `turn` of s

    For w -> 0 it is max(c, 0), so that only the component of the slip along s loads.
    """
    c, w2 = t.dot(s), s.turn * s.turn
    return (1 + c + sqrt(c * c + w2) - sqrt(1 + w2)) / 2


def onward(t: Vectors, s: Vectors) -> Vectors:
    """Return t + s, which is 2 s if slip along t loads and 0 if it unloads.

    For vectors the result is 2 a s, with a from `along`.
    """
    return 2 * along(t, s) * s if isinstance(s, Vector) else t + s


def ahead(f: Callable[[Scalar], Scalar], t: Vectors, r: Vectors) -> Scalar:
    """Return f(t r), where r is the load share of an element and t the direction of slip.

    For vectors the result is a f(|r|) + (1 - a) f(-|r|), with a from `along`, which interpolates
    between loading and unloading.
    """
    if not isinstance(r, Vector):
        return f(t * r)
    x = r.length(ROUND)
    unloaded = f(-x)
    return unloaded + (f(x) - unloaded) * along(t, r / x)


def spent(f: Callable[[Scalar], Scalar], v: Vectors, t: Vectors, r: Vectors) -> Vectors:
    """Return the part v f(t r) of the slip v along t that does not stretch an element.

    r is the load share of the element. For vectors the result is parallel to r:
    |v| r/|r| [a f(|r|) - (1 - a) f(-|r|)], with a from `along`. Then |r| grows at most as fast as
    in straight slip. Therefore the bounds of the scalar law hold for any slip, and this part is
    dissipative whenever it is in straight slip.
    """
    if not isinstance(r, Vector):
        return v * f(t * r)
    x = r.length(ROUND)
    back = -f(-x)
    e = r / x
    return (v * t) * (back + (f(x) - back) * along(t, e)) * e


@final
@dataclass(frozen=True, eq=False)
class ConstantStep:
    """Step of h [s] at constant velocity and load, which is common to all elements of a law.

        way = v h,   s = sign(v)

    Attributes:
        still: True if v = 0.
        some: `way`, or a nonzero divisor if v = 0.
    """

    way: Scalar
    s: Scalar
    still: Scalar
    some: Scalar

    @classmethod
    def over(cls, v: Scalar, h: Scalar) -> "ConstantStep":
        """Return a step of `h` [s] at the velocity `v`."""
        way, still = v * h, v == 0
        return cls(way, smooth.sign(v, 0.0), still, smooth.choose(still, h, way))

    def stretched(
        self,
        F: Scalar,
        p: Scalar,
        k: Scalar,
        limit: Scalar,
        slips: Scalar,
        slipped: tuple[Scalar, Scalar],
    ) -> tuple[Scalar, Scalar, Scalar]:
        """Return (F+, mean, p+) of an element with the load F, the mode p and the stiffness k.

        F+ and p+ are the load and the mode at the end of the step, and `mean` is the mean load. The
        element slips at +-limit. There are three cases:

            slips throughout:   F+ and mean as given in `slipped`,                     p+ = 1
            reaches the limit:  F+ = s limit,   mean = F+ - (F+ - F)^2 / (2 k way),    p+ = 1
            sticks:             F+ = F + k way, mean = F + k way / 2,                  p+ = 0

        The load rises linearly up to the limit. At v = 0 the mode p does not change.
        """
        goal, tried = self.s * limit, F + k * self.way
        reaches = self.s * tried >= limit
        gap = smooth.choose(reaches, goal - F, k * self.some)
        cut = goal - gap * (gap / (k * self.some)) / 2
        end = smooth.choose(reaches, goal, tried)
        mean = smooth.choose(reaches, cut, F + k * self.way / 2)
        mode = smooth.choose(reaches, 1.0, smooth.choose(self.still, p, 0.0))
        return (
            smooth.choose(slips, slipped[0], end),
            smooth.choose(slips, slipped[1], mean),
            smooth.choose(slips, 1.0, mode),
        )

    def yielded(
        self, F: Scalar, p: Scalar, k: Scalar, limit: Scalar
    ) -> tuple[Scalar, Scalar, Scalar]:
        """Return the result of `stretched` for an element that slips at its limit."""
        goal = self.s * limit
        return self.stretched(F, p, k, limit, self.s * F >= limit, (goal, goal))


def yielding(v: Scalar, r: Scalar, n: Scalar, v_eps: Scalar, r_eps: Scalar) -> Scalar:
    """Return the rate at which an element stretches at the slip velocity `v`.

        v - |v| |r|^n [1 + sign(v r)]/2 sign(r)

    r is the ratio of the load to the limit. The element is elastic while it unloads and, for
    n -> inf, up to |r| = 1, where it slips. A vector returns radially, by the slip along the load.
    The signs are smooth over v_eps and r_eps, and |r| over r_eps. At v = 0 the rate is exactly
    zero, so that an element at rest keeps its load. At r = 1 it vanishes to rounding for
    r_eps <= 1e-8. The yielding always dissipates: an element above its limit, because the normal
    force has dropped, returns to it for either direction of motion and at any speed.
    """
    t, s = smooth.sign(v, v_eps), smooth.sign(r, r_eps)
    return v - smooth.overload(r, n, r_eps) / 2 * (v * t) * onward(t, s)
