"""From the text of a problem to its spans."""

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from ocp.text.choice import Choice, chosen_of
from ocp.text.conditions import comparisons
from ocp.text.expressions import value_of
from ocp.text.ranges import FREE, Box, as_box, meet
from ocp.text.settings import Setting, settings_of
from ocp.text.signals import MissingError, Signals, fresh_symbols
from ocp.text.span import Condition, Join, Link, Row, Span
from ocp.text.starts import start_of
from symfric.foundation.symbols import strays
from symfric.model import Model

if TYPE_CHECKING:
    from ocp.text.problem import Problem


def resolved(problem: "Problem") -> tuple[tuple[Span, ...], list[str]]:
    """The spans of `problem`, and what is wrong with them; with that they are not complete."""
    tell: list[str] = []
    settings = settings_of(problem)
    chosen = chosen_of(problem.choose, settings)
    spans: list[Span] = []
    for setting in settings:
        before = spans[-1] if spans else None
        spans.append(_span(problem, setting, chosen, before, tell))
    _missing_paths(problem.path, settings, tell)
    every: list[Span] = []
    for number, values in enumerate(problem.scenarios.values() or [{}]):
        for setting, span in zip(settings, spans, strict=True):
            every.append(_at_numbers(problem, setting, span, chosen, number, values, tell))
    if not tell:
        tell += _unreachable(every, settings)
        tell += _constant_cost(every, chosen)
    return tuple(every), tell


def value_problems(problem: "Problem") -> list[str]:
    """What is wrong with expressions and numbers of a problem whose names and ranges are right."""
    return resolved(problem)[1]


@contextmanager
def gathered(tell: list[str], where: str) -> Generator[None]:
    """What is wrong in here goes to `tell`, and work goes on behind it."""
    try:
        yield
    except ValueError as error:
        tell.append(f"{where}{error}")


def box_of(setting: Setting, name: str) -> Box:
    """Bounds of a signal in a phase: those given, else those of the model."""
    if name in setting.bounds:
        return as_box(setting.bounds[name])
    model = setting.model
    known = {v.name: v for group in (model.x, model.z, model.u) for v in group}
    return (known[name].lower, known[name].upper) if name in known else FREE


def _span(
    problem: "Problem",
    setting: Setting,
    chosen: Sequence[Choice],
    before: Span | None,
    tell: list[str],
) -> Span:
    """All of a span but what depends on numbers of parameters."""
    model, phase = setting.model, setting.phase
    boxes = {
        v.name: box_of(setting, v.name) for group in (model.x, model.z, model.u) for v in group
    }
    fractions = {0.0: phase.start, **{float(s): phase.via[s] for s in phase.via}, 1.0: phase.end}
    fractions = dict(sorted(fractions.items()))
    running, end, squares = _costs(setting, len(problem.chain), tell)
    chosen_here = tuple(c.name for c in chosen if c.name in {v.name for v in model.p})
    return Span(
        name=phase.name or f"phase {setting.number + 1}",
        scenario=0,
        phase=setting.number,
        model=model,
        T=phase.T,
        p=np.zeros(len(model.p)),
        chosen=chosen_here,
        boxes=boxes,
        nodes={
            s: {v.name: meet(boxes[v.name], as_box(at.get(v.name, FREE))) for v in model.x}
            for s, at in fractions.items()
        },
        inputs_at={
            s: {
                v.name: meet(boxes[v.name], as_box(fractions[s].get(v.name, FREE))) for v in model.u
            }
            for s in (0.0, 1.0)
        },
        rows_at={s: _rows_at(model, s, at) for s, at in fractions.items()},
        path=(*_bounded(setting), *_path(problem, setting, tell)),
        running=running,
        end=end,
        squares=squares,
        links=() if before is None else _links(setting, before, tell),
        joins=() if before is None else _joins(setting, before, tell),
    )


def _rows_at(model: Model, fraction: float, given: Mapping[str, Any]) -> tuple[Row, ...]:
    """What is given there for signals that are no states or inputs."""
    own = {v.name for group in (model.x, model.u) for v in group}
    place = {0.0: "at the start", 1.0: "at the end"}.get(fraction, f"at {fraction:g} T")
    return tuple(
        Row(f"{name} {place}", model.expression(name), *as_box(value))
        for name, value in given.items()
        if name not in own
    )


def _bounded(setting: Setting) -> Iterator[Row]:
    """Bounds on outputs and details: conditions on the path."""
    model = setting.model
    own = {v.name for group in (model.x, model.z, model.u) for v in group}
    for name in setting.bounds:
        if name not in own and box_of(setting, name) != FREE:
            yield Row(f"the bound on {name}", model.expression(name), *box_of(setting, name))


def _path(problem: "Problem", setting: Setting, tell: list[str]) -> list[Row]:
    """Path conditions of the problem, where the names exist, and of the phase."""
    signals = Signals(setting.model)
    found: list[Row] = []
    inherited = {id(condition) for condition in problem.path}
    for number, condition in enumerate((*problem.path, *setting.phase.path)):
        label = _called("path condition", number, condition)
        with gathered(tell, setting.where):
            try:
                rows = comparisons(label, condition, signals)
            except MissingError:
                if id(condition) in inherited:
                    continue  # `_missing_paths` asks whether any phase has the names
                raise
            for expression, low, high in rows:
                stray = strays(expression, _known(setting.model))
                if stray:
                    raise ValueError(f"{label}: expected only signals, got {', '.join(stray)}")
                found.append(Row(label, expression, low, high))
    return found


def _called(what: str, number: int, condition: Condition) -> str:
    """Its number, or its name where it has one."""
    name = getattr(condition, "__name__", "<lambda>")
    return f"{what} {number + 1}" if name == "<lambda>" else f"{what} {name}"


def _missing_paths(path: Sequence[Condition], settings: Sequence[Setting], tell: list[str]) -> None:
    """Conditions of the problem whose names no phase has."""
    for number, condition in enumerate(path):
        errors: list[MissingError] = []
        for setting in settings:
            try:
                comparisons("", condition, Signals(setting.model))
            except MissingError as error:
                errors.append(error)
            except ValueError:
                break  # told by `_path`
        if len(errors) == len(settings):
            tell.append(f"{_called('path condition', number, condition)}: {errors[0]}")


def _known(model: Model) -> ca.SX:
    return ca.vertcat(model.t, *(model.vector(letter) for letter in "xzup"))


def _costs(
    setting: Setting, phases: int, tell: list[str]
) -> tuple[ca.SX, ca.SX, tuple[tuple[float, ca.SX], ...]]:
    """Integrand, end value and squares of what the problem and the phase ask for."""
    running, end = ca.SX(0), ca.SX(0)
    squares: list[tuple[float, ca.SX]] = []
    last = setting.number == phases - 1
    for cost in setting.costs:
        own = cost is setting.phase.cost
        with gathered(tell, setting.where):
            kept = cost if own or last else replace(cost, end=())
            L, E = kept.expressions(setting.model)
            stray = strays(ca.vertcat(L, E), _known(setting.model))
            if stray:
                raise ValueError(
                    f"cost: expected only signals of the model, got {', '.join(stray)}"
                )
            running, end = running + L, end + E
            squares += kept.residuals(setting.model)
    return running, end, tuple(squares)


def _links(setting: Setting, before: Span, tell: list[str]) -> tuple[Link, ...]:
    """Where the states start that continue the span before."""
    there = {v.name: v.symbol for v in before.model.x}
    signals = Signals(before.model)
    found: list[Link] = []
    for v in setting.model.x:
        given: Any = setting.phase.link.get(v.name, v.name if v.name in there else None)
        if given is None:
            continue
        with gathered(tell, setting.where):
            where = f"link of {v.name}"
            function: Callable[..., Any] = given if callable(given) else _signal(given)
            expression = value_of(where, function, signals)
            stray = strays(expression, _known(before.model))
            if stray:
                raise ValueError(f"{where}: expected only signals, got {', '.join(stray)}")
            found.append(Link(v.name, expression))
    return tuple(found)


def _signal(name: str) -> Callable[[Signals], ca.SX]:
    return lambda before: before[name]


def _joins(setting: Setting, before: Span, tell: list[str]) -> tuple[Join, ...]:
    """Conditions between the end of the span before and the start of this one."""
    found: list[Join] = []
    left, ending = fresh_symbols(before.model, "before")
    right, starting = fresh_symbols(setting.model, "after")
    for number, condition in enumerate(setting.phase.joins):
        name = _called("join", number, condition)
        with gathered(tell, setting.where):
            for expression, low, high in comparisons(name, condition, ending, starting):
                stray = strays(expression, ca.vertcat(*left, *right))
                if stray:
                    raise ValueError(f"{name}: expected only signals, got {', '.join(stray)}")
                function = ca.Function("join", [*left, *right], [expression])
                found.append(Join(name, function, low, high))
    return tuple(found)


def _at_numbers(
    problem: "Problem",
    setting: Setting,
    span: Span,
    chosen: Sequence[Choice],
    scenario: int,
    values: Mapping[str, float],
    tell: list[str],
) -> Span:
    """`span` with the numbers of its parameters, and the start values that follow from them."""
    model = span.model
    names = [v.name for v in model.p]
    given = dict(setting.p) | {name: x for name, x in values.items() if name in names}
    given |= {c.name: c.guess for c in chosen if c.name in names}
    scenario_name = f"scenario '{list(problem.scenarios)[scenario]}': " if values else ""
    with gathered(tell, setting.where + scenario_name):
        numbers = model.values("p", given)
        span = replace(span, scenario=scenario, p=numbers)
        if setting.number == 0:
            start, rows = start_of(setting, span, given, problem.periodic)
            span = replace(
                span,
                nodes=dict(span.nodes) | {0.0: start},
                rows_at=dict(span.rows_at) | {0.0: (*span.rows_at[0.0], *rows)},
            )
    return span


def _unreachable(spans: Sequence[Span], settings: Sequence[Setting]) -> Iterator[str]:
    """Ranges that leave no room."""
    yield from ()


def _constant_cost(spans: Sequence[Span], chosen: Sequence[Choice]) -> Iterator[str]:
    """A cost that nothing changes."""
    yield from ()
