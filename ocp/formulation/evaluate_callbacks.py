"""What the functions of a problem make of the signals: costs, conditions, links, joins."""

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, final

import casadi as ca

from ocp.formulation.conditions import Comparison, comparisons
from ocp.formulation.expressions import value_of
from ocp.formulation.settings import Setting
from ocp.formulation.signals import MissingError, Signals, fresh_symbols
from ocp.formulation.span import Condition, Join, Link, Row
from symfric.foundation.symbols import strays
from symfric.model import Model

if TYPE_CHECKING:
    from ocp.formulation.problem import Problem


@final
@dataclass(frozen=True, eq=False)
class Written:
    """Everything of one phase that was written as a function; see `Span`.

    `details` are names of those results of a mechanism that costs and path conditions ask for.
    """

    running: ca.SX
    end: ca.SX
    squares: tuple[tuple[float, ca.SX], ...]
    path: tuple[Row, ...]
    links: tuple[Link, ...]
    joins: tuple[Join, ...]
    details: tuple[str, ...]


def written(
    problem: "Problem", settings: Sequence[Setting], tell: list[str]
) -> tuple[Written, ...]:
    """What each phase says in functions; what is wrong with them goes to `tell`."""
    found: list[Written] = []
    before: Model | None = None
    for setting in settings:
        links, joins = (), ()
        if before is not None:
            links = tuple(_links(setting, before, tell))
            joins = tuple(_joins(setting, before, tell))
        signals = Signals(setting.model)
        path = tuple(_path(problem, setting, signals, tell))
        costs = _costs(setting, signals, last=setting is settings[-1], tell=tell)
        found.append(Written(*costs, path, links, joins, signals()))
        before = setting.model
    _missing_paths(problem.path, settings, tell)
    return tuple(found)


@contextmanager
def gathered(tell: list[str], where: str) -> Generator[None]:
    """What is wrong in here goes to `tell`, and work goes on behind it."""
    try:
        yield
    except ValueError as error:
        tell.append(f"{where}{error}")


def _costs(
    setting: Setting, signals: Signals, *, last: bool, tell: list[str]
) -> tuple[ca.SX, ca.SX, tuple[tuple[float, ca.SX], ...]]:
    """Integrand, end value and squares of what the problem and the phase ask for."""
    running, end = ca.SX(0), ca.SX(0)
    squares: list[tuple[float, ca.SX]] = []
    for cost in setting.costs:
        own = cost is setting.phase.cost
        kept = cost if own or last else replace(cost, end=())
        with gathered(tell, setting.where + "cost: "):
            try:
                L, E = kept.expressions(setting.model, signals)
            except MissingError as error:
                alone = own or not setting.where
                hint = "" if alone else "; phases that differ have costs of their own: cost=..."
                raise ValueError(f"{error}{hint}") from None
            _known_only(ca.vertcat(L, E), setting.model)
            running, end = running + L, end + E
            squares += kept.residuals(setting.model, signals)
    return running, end, tuple(squares)


def _known_only(expression: ca.SX, *models: Model) -> None:
    known = ca.vertcat(*(_symbols(model) for model in models))
    if stray := strays(expression, known):
        raise ValueError(f"expected only signals of the model, got {', '.join(stray)}")


def _symbols(model: Model) -> ca.SX:
    return ca.vertcat(model.t, *(model.vector(letter) for letter in "xzup"))


def _path(problem: "Problem", setting: Setting, signals: Signals, tell: list[str]) -> Iterator[Row]:
    """Path conditions of the problem, where the names exist, and of the phase."""
    model, own = setting.model, tuple(setting.phase.path)
    changing = ca.vertcat(model.t, *(model.vector(letter) for letter in "xzup"))
    for group, everywhere in ((tuple(problem.path), True), (own, False)):
        for number, condition in enumerate(group):
            label = called_so("path condition", number, condition)
            with gathered(tell, f"{setting.where}{label}: "):
                try:
                    rows = comparisons(condition, signals)
                except MissingError:
                    if everywhere:
                        continue  # `_missing_paths` asks whether any phase has the names
                    raise
                for expression, low, high in rows:
                    _known_only(expression, model)
                    _check_open((expression, low, high), changing)
                    yield Row(label, expression, low, high)


def _check_open(row: Comparison, changing: ca.SX) -> None:
    """A comparison can be met, and not by parameters alone."""
    expression, low, high = row
    if low > high:
        raise ValueError(f"expected a condition that can be met, got {low:g} to {high:g}")
    if not ca.depends_on(expression, changing):
        raise ValueError("expected a condition on the motion, got a constant")


def called_so(what: str, number: int, condition: Condition) -> str:
    """Its number, or its name where it has one."""
    name = getattr(condition, "__name__", "<lambda>")
    return f"{what} {number + 1}" if name == "<lambda>" else f"{what} {name}"


def _missing_paths(path: Sequence[Condition], settings: Sequence[Setting], tell: list[str]) -> None:
    """Conditions of the problem whose names no phase has."""
    for number, condition in enumerate(path):
        errors: list[MissingError] = []
        for setting in settings:
            try:
                comparisons(condition, Signals(setting.model))
            except MissingError as error:
                errors.append(error)
            except ValueError:
                break  # told by `_path`
        if len(errors) == len(settings):
            tell.append(f"{called_so('path condition', number, condition)}: {errors[0]}")


def _links(setting: Setting, before: Model, tell: list[str]) -> Iterator[Link]:
    """Where the states start that continue the phase before."""
    there = {v.name for v in before.x}
    signals = Signals(before)
    for v in setting.model.x:
        given: Any = setting.phase.link.get(v.name, "") if v.name in setting.phase.link else v.name
        if given is None or (v.name not in setting.phase.link and v.name not in there):
            continue
        with gathered(tell, f"{setting.where}link of {v.name}: "):
            function: Callable[..., Any] = given if callable(given) else _signal(given)
            expression = value_of(function, signals)
            _known_only(expression, before)
            yield Link(v.name, expression)


def _signal(name: str) -> Callable[[Signals], ca.SX]:
    return lambda before: before[name]


def _joins(setting: Setting, before: Model, tell: list[str]) -> Iterator[Join]:
    """Conditions between the end of the phase before and the start of this one."""
    if not setting.phase.joins:
        return
    left, ending = fresh_symbols(before, "before")
    right, starting = fresh_symbols(setting.model, "after")
    for number, condition in enumerate(setting.phase.joins):
        name = called_so("join", number, condition)
        with gathered(tell, f"{setting.where}{name}: "):
            for row in comparisons(condition, ending, starting):
                expression, low, high = row
                if stray := strays(expression, ca.vertcat(*left, *right)):
                    raise ValueError(f"expected only signals, got {', '.join(stray)}")
                _check_open(row, ca.vertcat(*left, *right))
                yield Join(name, ca.Function("join", [*left, *right], [expression]), low, high)
