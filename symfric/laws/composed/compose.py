"""Laws that combine or wrap other laws: sums, asymmetric and load-dependent laws."""

from dataclasses import fields as fields_of
from dataclasses import replace
from itertools import accumulate, pairwise
from typing import ClassVar

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, column, empty, is_casadi, smallest, total
from symfric.foundation.parameters import (
    Parametric,
    distinct,
    parameters,
    parametric,
    with_values,
)
from symfric.laws.base import fields, smooth
from symfric.laws.base.law import Facts, Input, Law, State, Switch, check_law, chosen
from symfric.laws.composed.wrap import Wrapper


@parametric
class Sum(Law):
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
            check_law("Sum", law)
        if len(laws) < 2:
            raise ValueError(f"Sum: expected at least two laws, got {len(laws)}")
        terms = (law.laws if isinstance(law, Sum) else (law,) for law in laws)
        object.__setattr__(self, "laws", tuple(law for group in terms for law in group))
        super().__post_init__()

    @property
    def states(self) -> tuple[State, ...]:
        """States of all terms."""
        names = distinct([[state.name for state in law.states] for law in self.laws])
        return tuple(
            replace(state, name=name)
            for law, group in zip(self.laws, names, strict=True)
            for state, name in zip(law.states, group, strict=True)
        )

    @property
    def inputs(self) -> tuple[Input, ...]:
        """Further inputs of all terms, without duplicates."""
        return tuple(dict.fromkeys(i for law in self.laws for i in law.inputs))

    def terms(self, z: Scalar) -> list[tuple[Law, Scalar]]:
        """Return each law with its rows of `z`."""
        ends = accumulate((len(law.states) for law in self.laws), initial=0)
        return [(law, z[a:b]) for law, (a, b) in zip(self.laws, pairwise(ends), strict=True)]

    @property
    def velocity_scale(self) -> Scalar:
        """Smallest velocity scale of the terms [m/s]."""
        return smallest(*(law.velocity_scale for law in self.laws))

    def force(self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar) -> Scalar:
        """Return the friction force [N]."""
        return total(law.force(v, N, part, **chosen(law, inputs)) for law, part in self.terms(z))

    def sliding(self, v: Scalar, N: Scalar, side: int, **inputs: Scalar) -> Scalar:
        """Return the sum of the sliding forces [N] on one side."""
        return total(law.sliding(v, N, side, **chosen(law, inputs)) for law in self.laws)

    def static_level(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the sum of the static levels [N]."""
        return total(law.static_level(N, side, **chosen(law, inputs)) for law in self.laws)

    def most_held(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the sum of the bounds [N] of the terms."""
        return total(law.most_held(N, side, **chosen(law, inputs)) for law in self.laws)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar) -> Scalar:
        """Return the rates of all states."""
        rates = [
            law.rate(v, N, part, **chosen(law, inputs)) for law, part in self.terms(z) if law.states
        ]
        return _join(v, rates)

    def switches(
        self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar
    ) -> tuple[Switch, ...]:
        """Return the changes of mode of all terms, with the state names of the sum."""
        names = iter(state.name for state in self.states)
        switches: list[Switch] = []
        for law, part in self.terms(z):
            new = {state.name: next(names) for state in law.states}
            for switch in law.switches(v, N, part, **chosen(law, inputs)):
                reset = {new[name]: value for name, value in switch.reset.items()}
                switches.append(replace(switch, reset=reset))
        return tuple(switches)

    def held_step(self, v: Scalar, N: Scalar, z: Scalar, h: Scalar) -> tuple[Scalar, Scalar] | None:
        """Return the held steps of the terms; None if a term with states has none."""
        known = [law.held_step(v, N, part, h) for law, part in self.terms(z) if law.states]
        steps = [step for step in known if step is not None]
        if not steps or len(steps) < len(known):
            return None
        return _join(v, [end for end, _ in steps]), _join(v, [mean for _, mean in steps])

    def held_rest(self, v: Scalar, N: Scalar, z: Scalar) -> Scalar | None:
        """Return the equilibria of the terms, or None if no term with states has any.

        For a term without equilibria these are its steady states.
        """
        known = [(law, law.held_rest(v, N, part)) for law, part in self.terms(z) if law.states]
        if all(rest is None for _, rest in known):
            return None
        return _join(v, [law.steady_state(v, N) if r is None else r for law, r in known])

    def warnings(self) -> tuple[str, ...]:
        """Return the warnings of the terms."""
        return tuple(warning for law in self.laws for warning in law.warnings())

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return the steady states of all terms."""
        return _join(v, [law.steady_state(v, N) for law in self.laws if law.states])


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

    def inner_of(self, side: int) -> Law:
        """Return the law of one side."""
        return self.positive if side > 0 else self.negative

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


def _join(v: Scalar, columns: list[Scalar]) -> Scalar:
    if not columns:
        return empty(v)
    return column(*(row for c in columns for row in (c[i] for i in range(c.shape[0]))))
