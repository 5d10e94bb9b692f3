"""Evaluate the callbacks of a problem at symbols: costs, conditions, links, joins."""

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from operator import itemgetter
from typing import Any, final

import casadi as ca

from ocp.formulation.expressions import (
    Comparison,
    MissingError,
    Signals,
    arguments,
    comparisons,
    fresh_symbols,
    value_of,
)
from ocp.formulation.phase import Join, Link, Row
from ocp.formulation.statement import Setting, Statement
from symfric.foundation.variable import strays
from symfric.model import Model


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
    problem: Statement, settings: Sequence[Setting], tell: list[str]
) -> tuple[Written, ...]:
    """Results of the functions of each phase; what is wrong with them goes to `tell`."""
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
    for number, condition in enumerate(problem.path):
        if text := _missing(condition, settings):
            tell.append(f"{_called_so('path condition', number, condition)}: {text}")
    return tuple(found)


@contextmanager
def gathered(tell: list[str], where: str) -> Generator[None]:
    """Collect an error of the block in `tell` and continue after it."""
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


def _known_only(expression: ca.SX, model: Model) -> None:
    if stray := strays(expression, ca.vertcat(*arguments(model))):
        raise ValueError(f"expected only signals of the model, got {', '.join(stray)}")


def _path(problem: Statement, setting: Setting, signals: Signals, tell: list[str]) -> Iterator[Row]:
    """Path conditions of the problem, where the names exist, and of the phase."""
    model, own = setting.model, tuple(setting.phase.path)
    changing = ca.vertcat(*arguments(model))
    for group, everywhere in ((tuple(problem.path), True), (own, False)):
        for number, condition in enumerate(group):
            label = _called_so("path condition", number, condition)
            with gathered(tell, f"{setting.where}{label}: "):
                try:
                    rows = comparisons(condition, signals)
                except MissingError:
                    if everywhere:
                        continue  # `_missing` finds out whether any phase has the names
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


def _called_so(what: str, number: int, condition: Callable[..., object]) -> str:
    """Its number, or its name where it has one."""
    name = getattr(condition, "__name__", "<lambda>")
    return f"{what} {number + 1}" if name == "<lambda>" else f"{what} {name}"


def _missing(condition: Callable[..., object], settings: Sequence[Setting]) -> str:
    """Message about names of a condition of the problem that no phase has."""
    errors: list[MissingError] = []
    for setting in settings:
        try:
            comparisons(condition, Signals(setting.model))
        except MissingError as error:
            errors.append(error)
        except ValueError:
            break  # reported by `_path`
    return str(errors[0]) if len(errors) == len(settings) else ""


def _links(setting: Setting, before: Model, tell: list[str]) -> Iterator[Link]:
    """Start values of the states that continue the phase before."""
    there = {v.name for v in before.x}
    signals = Signals(before)
    for v in setting.model.x:
        given: Any = setting.phase.link.get(v.name, v.name if v.name in there else None)
        if given is None:
            continue
        with gathered(tell, f"{setting.where}link of {v.name}: "):
            function: Callable[..., Any] = given if callable(given) else itemgetter(given)
            expression = value_of(function, signals)
            _known_only(expression, before)
            yield Link(v.name, expression)


def _joins(setting: Setting, before: Model, tell: list[str]) -> Iterator[Join]:
    """Conditions between the end of the phase before and the start of this one."""
    if not setting.phase.joins:
        return
    left, ending = fresh_symbols(before, "before")
    right, starting = fresh_symbols(setting.model, "after")
    for number, condition in enumerate(setting.phase.joins):
        name = _called_so("join", number, condition)
        with gathered(tell, f"{setting.where}{name}: "):
            for row in comparisons(condition, ending, starting):
                expression, low, high = row
                if stray := strays(expression, ca.vertcat(*left, *right)):
                    raise ValueError(f"expected only signals, got {', '.join(stray)}")
                _check_open(row, ca.vertcat(*left, *right))
                yield Join(name, ca.Function("join", [*left, *right], [expression]), low, high)
