"""An optimal control problem: phases, what to keep, what to choose, what to minimise."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from typing import Any, Literal, final

from ocp.formulation.bounds import Free, Range
from ocp.formulation.choice import Choice, chosen_of
from ocp.formulation.complaints import input_problems
from ocp.formulation.cost import Cost
from ocp.formulation.kinds import kind_problems
from ocp.formulation.phase import Chain, PathCondition, Phase
from ocp.formulation.rates import rate_name
from ocp.formulation.resolve import function_problems, resolved
from ocp.formulation.settings import settings_of
from ocp.formulation.span import Span

Duration = tuple[Sequence[int], float | Free]
"""Numbers of phases, and what their durations add up to [s]."""


@final
@dataclass(frozen=True, eq=False)
class Problem:
    """Minimise a cost over the motion of one or several phases.

        min J   subject to   x' = ode(t, x, z, u, p),  0 = alg(t, x, z, u, p)   in every phase,
                             ends, bounds, path conditions, links between phases

    `bounds`, `rates`, `path` and `p` hold in every phase that has the names; what a phase says
    itself wins. Everything is bound to names, so that one text serves several models.

    Attributes:
        phases: a `Phase`, or several: `out >> back`.
        cost: a sum of `integral(...)` over all phases, `at_end(...)` of the last one, `TIME`,
            `track(...)` and `effort(...)`; with scenarios their mean, or `worst(...)`.
        bounds, rates, path, p: as in `Phase`.
        choose: parameter -> (lower, upper) or (lower, upper, guess): chosen with the motion, the
            same in all phases and scenarios.
        periodic: states that end the last phase as they start the first; their start is free
            unless `start` names it.
        scenarios: name -> values of parameters; the motion is computed for each of them.
        shared: inputs that are the same in all scenarios; by default all. Free durations are, too.
        durations: ((0, 1), 2.0): the durations of these phases add up to 2 s; or to a `Free`.

    Raises:
        ValueError: all problems at once.
    """

    phases: Phase | Chain
    cost: Cost | None = None
    bounds: Mapping[str, Range] = field(default_factory=dict[str, Range], kw_only=True)
    rates: Mapping[str, Range] = field(default_factory=dict[str, Range], kw_only=True)
    path: Sequence[PathCondition] = field(default=(), kw_only=True)
    choose: Mapping[str, tuple[float | None, ...]] = field(
        default_factory=dict[str, tuple[float | None, ...]], kw_only=True
    )
    periodic: Sequence[str] = field(default=(), kw_only=True)
    scenarios: Mapping[str, Mapping[str, float]] = field(
        default_factory=dict[str, Mapping[str, float]], kw_only=True
    )
    shared: Sequence[str] | None = field(default=None, kw_only=True)
    p: Mapping[str, float] = field(default_factory=dict[str, float], kw_only=True)
    durations: Sequence[Duration] = field(default=(), kw_only=True)

    def __post_init__(self) -> None:
        # Each look asks only what the ones before have left in order.
        self._refuse(kind_problems(self))
        self._refuse((*input_problems(self), *function_problems(self)))
        self._refuse(self._resolved[1])

    def _refuse(self, texts: Iterable[str]) -> None:
        problems = [text for text in dict.fromkeys(texts) if text]
        if problems:
            raise ValueError(f"problem '{self.name}': " + "; ".join(problems))

    @property
    def name(self) -> str:
        """What it is called in messages: the names of its models."""
        if not isinstance(self.phases, Phase | Chain):  # pyright: ignore[reportUnnecessaryIsInstance]
            return "?"
        return " >> ".join(dict.fromkeys(phase.model.name for phase in self.chain))

    @property
    def chain(self) -> tuple[Phase, ...]:
        """The phases in order."""
        return (self.phases,) if isinstance(self.phases, Phase) else self.phases.phases

    @cached_property
    def spans(self) -> tuple[Span, ...]:
        """The resolved phases, for one scenario after the other."""
        return self._resolved[0]

    @cached_property
    def _resolved(self) -> tuple[tuple[Span, ...], list[str]]:
        return resolved(self)

    @property
    def scenario_names(self) -> tuple[str, ...]:
        """Names of the scenarios, none where there is one motion only."""
        return tuple(self.scenarios)

    @cached_property
    def chosen(self) -> tuple[Choice, ...]:
        """Parameters chosen with the motion: name, bounds, guess."""
        return chosen_of(self.choose, settings_of(self))

    @property
    def kind(self) -> Literal["sum", "mean", "worst"]:
        """How the costs of the spans make one; mean and worst are over the sums of scenarios."""
        if len(self.scenarios) < 2:
            return "sum"
        return "worst" if self.cost is not None and self.cost.largest else "mean"

    @cached_property
    def shared_inputs(self) -> tuple[str, ...]:
        """Inputs of the models of the spans that are equal in all scenarios.

        Of an input with bounded rate these are its rate, and its state; see `shared_starts`.
        """
        inputs = list(dict.fromkeys(v.name for span in self.spans for v in span.model.u))
        if self.shared is None:
            return tuple(inputs)
        wanted = {*self.shared, *map(rate_name, self.shared)}
        return tuple(name for name in inputs if name in wanted)

    @cached_property
    def shared_starts(self) -> tuple[tuple[int, str], ...]:
        """(phase, state): inputs with bounded rate whose free start is equal in all scenarios."""
        found: list[tuple[int, str]] = []
        for span in self.spans:
            linked = {link.state for link in span.links}
            for v in span.model.x:
                low, high = span.nodes[0.0][v.name]
                free = low < high and v.name not in linked
                if span.scenario == 0 and rate_name(v.name) in self.shared_inputs and free:
                    found.append((span.phase, v.name))
        return tuple(found)

    def to_mpc(self, step: float = 0.01, **options: Any) -> Any:
        """A model predictive controller that solves this every `step` seconds over the next T.

        See `controller_of` in `ocp.mpc` for the options, and `Controller` for what it does.
        """
        return import_module("ocp.mpc.controller").controller_of(self, step, **options)
