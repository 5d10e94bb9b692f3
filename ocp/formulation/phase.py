"""Phases of a problem, one after the other."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import final

from ocp.formulation.bounds import Free, Range
from ocp.formulation.cost import Cost
from ocp.formulation.signals import Signals
from symfric.foundation import checks
from symfric.foundation.numeric import Scalar
from symfric.model import Model, check_model

Ranges = Mapping[str, Range]
"""Name -> value to meet, or (lower, upper)."""

Start = Callable[[Signals], Scalar] | str | None
"""Where a state starts that continues another phase: an expression in the signals at its end, the
name of one of them, or None for anywhere."""


PathCondition = Callable[[Signals], object]
"""A function that returns a comparison, such as `lambda s: s.tip_z <= 0.9`."""

JoinCondition = Callable[[Signals, Signals], object]
"""Likewise of the signals before and after: `lambda before, after: after.x >= before.x`."""


def _nothing() -> dict[str, Range]:
    return {}


@final
@dataclass(frozen=True, eq=False)
class Phase:
    """A stretch of the motion with one model and one set of conditions.

        x' = ode(t, x, z, u, p),  0 = alg(t, x, z, u, p),  0 <= t - t_start <= T

    Every condition names what it is about. A number is a value to meet, a pair (lower, upper) a
    range in which None is no bound. What stands here wins over what stands in `Problem`.

    Attributes:
        model: an explicit model, `ode` with or without `alg`.
        T: duration [s], or `Free(lower, upper)` to let the optimiser choose.
        start: states, inputs and outputs at the start; those of an input hold on the first
            interval. States of the first phase that are not named start where the model says.
            `FREE` leaves one open.
        end: likewise at the end; those not named end where they like.
        via: {0.5: {"x": 1.0}}: states and outputs at a fraction of T between 0 and 1.
        bounds: states, algebraic variables, inputs and outputs over the whole phase, in place of
            the bounds of the model.
        rates: bounds of the rates of inputs [unit/s]. Such an input becomes a state that is
            continuous, with the constant rate `<input>_rate` on each interval; it starts where the
            optimiser likes unless `start` names it, and links and ends name it like any state.
        path: lambdas over the signals that return `a <= b`, `a >= b` or `a == b`.
        cost: of this phase alone, with `at_end` at its own end.
        link: state -> where it starts: `lambda before: -0.5 * before.v` from the signals at the end
            of the phase before, the name of one of them, or None for anywhere. States of the same
            name are continuous unless named here; others start anywhere in their bounds.
        joins: lambdas `(before, after)` over the signals at the end of the phase before and at the
            start of this one that return a comparison.
        p: values of parameters of the model.
        name: for messages and pictures.

    What is wrong with a phase is said by the `Problem` it is put into.

    Limits: bounds on states and outputs, and `path`, hold at the collocation points, not between
    them; `verify` says what they do there.
    """

    model: Model
    T: float | Free
    start: Ranges = field(default_factory=_nothing, kw_only=True)
    end: Ranges = field(default_factory=_nothing, kw_only=True)
    via: Mapping[float, Ranges] = field(default_factory=dict[float, Ranges], kw_only=True)
    bounds: Ranges = field(default_factory=_nothing, kw_only=True)
    rates: Ranges = field(default_factory=_nothing, kw_only=True)
    path: Sequence[PathCondition] = field(default=(), kw_only=True)
    cost: Cost | None = field(default=None, kw_only=True)
    link: Mapping[str, Start] = field(default_factory=dict[str, Start], kw_only=True)
    joins: Sequence[JoinCondition] = field(default=(), kw_only=True)
    p: Mapping[str, float] = field(default_factory=dict[str, float], kw_only=True)
    name: str = field(default="", kw_only=True)

    def __post_init__(self) -> None:
        check_model("Phase", self.model)

    def __rshift__(self, other: "Phase | Chain") -> "Chain":
        return Chain((self,)) >> other


@final
@dataclass(frozen=True, eq=False)
class Chain:
    """Phases one after the other: `out >> back`."""

    phases: tuple[Phase, ...]

    def __iter__(self) -> Iterator[Phase]:
        return iter(self.phases)

    def __len__(self) -> int:
        return len(self.phases)

    def __rshift__(self, other: "Phase | Chain") -> "Chain":
        if isinstance(other, Chain):
            return Chain(self.phases + other.phases)
        such = "a phase, such as Phase(model, T=1.0)"
        return Chain((*self.phases, checks.kind("phases", other, Phase, such)))
