"""What in the text of a problem is not of the kind it should be."""

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from ocp.formulation.cost import Cost
from ocp.formulation.phase import Chain, Phase
from symfric.foundation import checks
from symfric.foundation.numeric import is_number
from symfric.model import Model

if TYPE_CHECKING:
    from ocp.formulation.problem import Problem

COST = "a cost made of integral(...), at_end(...) and TIME"
CONDITION = "functions of the signals such as lambda s: s.tip_z <= 0.9"


def said(check: Callable[..., Any], *arguments: Any, **named: Any) -> str:
    """What a check has to say, or nothing."""
    try:
        check(*arguments, **named)
    except ValueError as error:
        return str(error)
    return ""


def kind_problems(problem: "Problem") -> Iterator[str]:
    """Things of the wrong kind; without these nothing else can be asked."""
    if not isinstance(problem.phases, Phase | Chain):  # pyright: ignore[reportUnnecessaryIsInstance]
        yield _no_phases(problem.phases)
        return
    yield said(_cost, "cost", problem.cost)
    for name in ("bounds", "rates", "choose", "p"):
        yield said(_named, name, getattr(problem, name))
    yield said(_conditions, "path", problem.path)
    yield from _scenarios(problem.scenarios)
    yield said(checks.names, "periodic", problem.periodic)
    if problem.shared is not None:
        yield said(checks.names, "shared", problem.shared)
    yield said(_durations, problem.durations)
    for where, phase in labelled_phases(problem):
        for text in _phase(phase):
            yield f"{where}{text}" if text else ""


def labelled_phases(problem: "Problem") -> Iterator[tuple[str, Phase]]:
    """Phases with what is said before a message about them; nothing for a lone one."""
    phases = problem.chain
    for number, phase in enumerate(phases):
        name = f" '{phase.name}'" if isinstance(phase.name, str) and phase.name else ""  # pyright: ignore[reportUnnecessaryIsInstance]
        yield (f"phase {number + 1}{name}: " if len(phases) > 1 or name else "", phase)


def _no_phases(given: object) -> str:
    hint = ""
    if isinstance(given, Model):
        hint = "give the model a duration: Phase(model, T=1.0)"
    elif isinstance(given, list | tuple):
        hint = "join phases with >>: out >> back"
    return str(checks.refused("phases", "a phase, such as Phase(model, T=1.0)", given, hint))


def _phase(phase: Phase) -> Iterator[str]:
    for name in ("start", "end", "bounds", "rates", "link", "p"):
        yield said(_named, name, getattr(phase, name))
    if not isinstance(phase.name, str):  # pyright: ignore[reportUnnecessaryIsInstance]
        yield str(checks.refused("name", "a text", phase.name))
    yield said(_cost, "cost", phase.cost)
    for name in ("path", "joins"):
        yield said(_conditions, name, getattr(phase, name))
    if not isinstance(phase.via, Mapping):  # pyright: ignore[reportUnnecessaryIsInstance]
        what = "states by fractions of T, such as {0.5: {'x': 1.0}}"
        yield str(checks.refused("via", what, phase.via))
        return
    for fraction, values in phase.via.items():
        if not is_number(fraction):
            yield f"via: expected fractions of T, got {checks.shown(fraction)}"
        yield said(_named, f"via {checks.shown(fraction)}", values)


def _named(where: str, given: object) -> None:
    if given is None:
        raise checks.refused(where, "values by name, such as {'v': 0.1}", None, "leave it out")
    checks.named(where, given)


def _cost(where: str, cost: object) -> None:
    if cost is None or isinstance(cost, Cost):
        return
    hint = "wrap it in integral(...) or at_end(...)" if callable(cost) else ""
    raise checks.refused(where, COST, cost, hint)


def _conditions(where: str, conditions: object) -> None:
    if callable(conditions):
        raise checks.refused(where, f"a sequence of {CONDITION}", conditions, "write [lambda ...]")
    for condition in checks.many(where, conditions, CONDITION):
        checks.function(where, condition, CONDITION)


def _scenarios(scenarios: object) -> Iterator[str]:
    text = said(_named, "scenarios", scenarios)
    yield text
    if not text and isinstance(scenarios, Mapping):
        for name, values in scenarios.items():
            yield said(_named, f"scenario {checks.shown(name)}", values)


def _durations(durations: object) -> None:
    what = "sums of durations, such as ((0, 1), 2.0): the first two phases take 2 s"
    for pair in checks.many("durations", durations, what):
        if not (isinstance(pair, tuple) and len(pair) == 2 and isinstance(pair[0], list | tuple)):
            raise checks.refused("durations", what, pair)
