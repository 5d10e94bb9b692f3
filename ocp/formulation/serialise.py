"""What a file keeps of a problem: its resolved form, not the functions that it was written in."""

from dataclasses import dataclass
from typing import Literal, final

from ocp.formulation.bounds import Free
from ocp.formulation.phase import Span
from ocp.formulation.problem import Problem
from ocp.formulation.statement import Choice
from symfric.model import Model


@final
@dataclass(frozen=True, eq=False)
class PosedPhase:
    """A phase: name, model as it was given, and duration [s]."""

    name: str
    model: Model
    T: float | Free


@final
@dataclass(frozen=True, eq=False, repr=False)
class Posed:
    """A problem of a file: enough to verify and to draw a solution, and to start others from it.

    Costs, conditions and links are expressions in `spans`; the functions that users wrote are
    not kept, so that it is not solved again: write the problem, and give the solution as `guess`.

    Attributes:
        name, spans, chain, chosen, kind, scenario_names, shared_inputs: as those of a `Problem`.
        periodic, choose: names.
        durations: numbers of the phases whose durations add up to something.
    """

    name: str
    spans: tuple[Span, ...]
    chain: tuple[PosedPhase, ...]
    chosen: tuple[Choice, ...]
    kind: Literal["sum", "mean", "worst"]
    scenario_names: tuple[str, ...]
    shared_inputs: tuple[str, ...]
    periodic: tuple[str, ...]
    choose: tuple[str, ...]
    durations: tuple[tuple[int, ...], ...]

    def __repr__(self) -> str:
        return f"<problem '{self.name}' of a file: {len(self.chain)} phases>"

    def __getattr__(self, name: str) -> object:
        if name.startswith("_"):
            raise AttributeError(name)
        raise AttributeError(
            f"problem '{self.name}' of a file: expected what a file keeps, got {name}; write the "
            "problem again, and give the loaded solution as guess"
        )


def posed(problem: Problem | Posed) -> Posed:
    """What is kept of a problem."""
    if isinstance(problem, Posed):
        return problem
    return Posed(
        problem.name,
        problem.spans,
        tuple(PosedPhase(phase.name, phase.model, phase.T) for phase in problem.chain),
        problem.chosen,
        problem.kind,
        problem.scenario_names,
        problem.shared_inputs,
        tuple(problem.periodic),
        tuple(problem.choose),
        tuple(tuple(phases) for phases, _ in problem.durations),
    )
