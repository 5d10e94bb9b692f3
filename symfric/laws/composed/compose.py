"""Laws that combine or wrap other laws: sums, asymmetric and load-dependent laws."""

from dataclasses import fields as fields_of
from typing import ClassVar

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, is_casadi, smallest
from symfric.foundation.parameters import (
    Parametric,
    parameters,
    parametric,
    with_values,
)
from symfric.laws.base import fields, smooth
from symfric.laws.base.law import Facts, Law, require_law
from symfric.laws.composed.wrap import Composed, Wrapper


@parametric
class Sum(Composed):
    """Sum of friction laws, with the states of all terms.

        F = F_1 + F_2 + ...

    A sum of sums is flattened. The states are in the order of the terms. If parameters or states of
    several terms have the same name, the number of the term is appended: mu_d_1, mu_d_2, ...
    Limits: the limits of the terms.
    Source: superposition, as in Coulomb + viscous friction.
    """

    facts = Facts((), "that of its terms", "constructed")

    laws: tuple[Law, ...]

    def __post_init__(self) -> None:
        laws = checks.many("Sum", self.laws, "laws")
        for law in laws:
            require_law("Sum", law)
        if len(laws) < 2:
            raise ValueError(f"Sum: expected at least two laws, got {len(laws)}")
        terms = (law.laws if isinstance(law, Sum) else (law,) for law in laws)
        object.__setattr__(self, "laws", tuple(law for group in terms for law in group))
        super().__post_init__()

    def at(self, v: Scalar) -> tuple[Law, ...]:
        """Return the terms."""
        return self.laws

    def on_side(self, side: int) -> tuple[Law, ...]:
        """Return the terms."""
        return self.laws


@parametric
class Asymmetric(Wrapper):
    """Law with different parameters for the two directions of sliding.

        p(v) = p_pos w + p_neg (1 - w),   w = [1 + tanh(v / v_blend)] / 2

    Only parameters that differ between `positive` and `negative` are blended, so equal parameters
    add no cost. The number of states is the one of a single law.
    Limits: one-sided curves beyond 3 v_blend; keep v_blend below the smoothing velocity of the law.
    Source: separate parameter sets per direction, usual for drives (Armstrong-Helouvry 1991).
    """

    facts = Facts((), "that of its law", "constructed")
    suffixes: ClassVar[tuple[str, ...]] = ("pos", "neg")

    positive: Law
    negative: Law
    v_blend: Scalar = fields.BAND(1e-4, doc="blending velocity of the sides")

    def __post_init__(self) -> None:
        super().__post_init__()
        if _structure(self.positive) != _structure(self.negative):
            raise ValueError(
                "Asymmetric: expected the same law on both sides, got "
                f"{type(self.positive).__name__} and {type(self.negative).__name__}; "
                "only parameters may differ, no options and no tables"
            )

    @property
    def inner(self) -> Law:
        """Law of positive velocities."""
        return self.positive

    def inner_at(self, v: Scalar) -> Law:
        """Return the law with its parameters blended at the velocity `v`."""
        w = (1 + smooth.sign(v, self.v_blend)) / 2
        rest = 1 - w
        sides = (parameters(law).values() for law in (self.positive, self.negative))
        blended = {
            pos.name: pos.value * w + neg.value * rest
            for pos, neg in zip(*sides, strict=True)
            if _differ(pos.value, neg.value)
        }
        return with_values(self.positive, blended)

    def on_side(self, side: int) -> tuple[Law, ...]:
        """Return the law of one side."""
        return (self.positive if side > 0 else self.negative,)

    @property
    def velocity_scale(self) -> Scalar:
        """Smaller velocity scale [m/s] of the two sides."""
        return smallest(self.positive.velocity_scale, self.negative.velocity_scale)

    def warnings(self) -> tuple[str, ...]:
        """Return the warnings of both sides, without duplicates."""
        return tuple(dict.fromkeys(self.positive.warnings() + self.negative.warnings()))


@parametric
class LoadDependent(Wrapper):
    """Law under the effective normal force of a preloaded, load-carrying contact.

        N_eff = N_0 + c max(N, 0)

    N_0 is the preload (of a seal or a bearing) and c the share of the external load. The maximum is
    smooth over N_eps. Therefore N_eff is positive at lift-off and laws may divide by it; with
    N_0 = 0 this holds down to N = -1e7 N_eps, where N_eff rounds to zero.
    Limits: N_0 = 0, c = 1, N_eps = 0 is the law itself for N >= 0.
    Source: Bittencourt and Gunnarsson, J. Dyn. Syst. Meas. Control 134(5), 2012 (linear load part).
    """

    facts = Facts((), "that of its law", "unverified")

    law: Law
    N_0: Scalar = fields.LOAD(0.0, doc="preload")
    c: Scalar = fields.LOAD(1.0, unit="1", doc="share of the external load")
    N_eps: Scalar = fields.WIDTH(1e-3, unit="N", doc="smoothing of the lift-off", lower=0.0)

    def load(self, N: Scalar) -> Scalar:
        """Return the effective normal force [N]."""
        return self.N_0 + self.c * smooth.positive(N, self.N_eps)


def _structure(value: object) -> object:
    """Return the class and the options of a law and of its parts, without its parameters."""
    if isinstance(value, Parametric):
        held = (
            getattr(value, item.name) for item in fields_of(value) if "unit" not in item.metadata
        )
        return type(value), *map(_structure, held)
    return tuple(map(_structure, value)) if isinstance(value, tuple) else value


def _differ(a: Scalar, b: Scalar) -> bool:
    return a is not b and (is_casadi(a, b) or bool(a != b))
