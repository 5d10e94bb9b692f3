"""Evaluation of the user's functions with symbols: costs, conditions, links and joins."""

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from operator import itemgetter
from typing import Any, NamedTuple

import casadi as ca

from ocp.formulation import expressions
from ocp.formulation.expressions import MissingError, Signals, arguments
from ocp.formulation.phase import Join, Link, Row
from ocp.formulation.statement import Setting, Statement
from symfric.foundation.variable import strays
from symfric.model import Model


class Evaluated(NamedTuple):
    """Expressions returned by the functions of one phase; see `Span` for the fields.

    `details` are names of results of a mechanism that costs and path conditions contain.
    """

    running: ca.SX
    end: ca.SX
    squares: tuple[tuple[float, ca.SX], ...]
    path: tuple[Row, ...]
    links: tuple[Link, ...]
    joins: tuple[Join, ...]
    details: tuple[str, ...]


def evaluated(
    problem: Statement, settings: Sequence[Setting], problems: list[str]
) -> tuple[Evaluated, ...]:
    """Return the expressions of each phase, and append messages about errors to `problems`."""
    results: list[Evaluated] = []
    before: Model | None = None
    for setting in settings:
        links, joins = (), ()
        if before is not None:
            links = tuple(_links(setting, before, problems))
            joins = tuple(_joins(setting, before, problems))
        signals = Signals(setting.model)
        path = tuple(_path(problem, setting, signals, problems))
        costs = _costs(setting, signals, last=setting is settings[-1], problems=problems)
        results.append(Evaluated(*costs, path, links, joins, signals()))
        before = setting.model
    for number, condition in enumerate(problem.path):
        if text := _missing(condition, settings):
            problems.append(f"{_label('path condition', number, condition)}: {text}")
    return tuple(results)


@contextmanager
def collected(problems: list[str], where: str) -> Generator[None]:
    """Append a `ValueError` of the block to `problems` and continue after the block."""
    try:
        yield
    except ValueError as error:
        problems.append(f"{where}{error}")


def _costs(
    setting: Setting, signals: Signals, *, last: bool, problems: list[str]
) -> tuple[ca.SX, ca.SX, tuple[tuple[float, ca.SX], ...]]:
    """Return integrand, end value and squares of the costs of the problem and the phase."""
    running, end = ca.SX(0), ca.SX(0)
    squares: list[tuple[float, ca.SX]] = []
    for cost in setting.costs:
        own = cost is setting.phase.cost
        cost = cost if own or last else replace(cost, end=())
        with collected(problems, setting.where + "cost: "):
            try:
                L, E = cost.expressions(signals)
            except MissingError as error:
                alone = own or not setting.where
                hint = "" if alone else "; phases that differ have costs of their own: cost=..."
                raise ValueError(f"{error}{hint}") from None
            _check_known(ca.vertcat(L, E), setting.model)
            running, end = running + L, end + E
            squares += cost.residuals(signals)
    return running, end, tuple(squares)


def _check_known(expression: ca.SX, model: Model) -> None:
    if stray := strays(expression, ca.vertcat(*arguments(model))):
        raise ValueError(f"expected only signals of the model, got {', '.join(stray)}")


def _path(
    problem: Statement, setting: Setting, signals: Signals, problems: list[str]
) -> Iterator[Row]:
    """Yield path conditions of the phase, and those of the problem whose names it has."""
    model = setting.model
    changing = ca.vertcat(*arguments(model))
    for group, everywhere in ((problem.path, True), (setting.phase.path, False)):
        for number, condition in enumerate(group):
            label = _label("path condition", number, condition)
            with collected(problems, f"{setting.where}{label}: "):
                try:
                    rows = expressions.comparisons(condition, signals)
                except MissingError:
                    if everywhere:
                        continue  # `_missing` checks whether any phase has the names
                    raise
                for expression, low, high in rows:
                    _check_known(expression, model)
                    _check_possible(expression, low, high, changing)
                    yield Row(label, expression, low, high)


def _check_possible(expression: ca.SX, low: float, high: float, changing: ca.SX) -> None:
    """Raise ValueError if a condition is impossible or constant."""
    if low > high:
        raise ValueError(f"expected a condition that can be met, got {low:g} to {high:g}")
    if not ca.depends_on(expression, changing):
        raise ValueError("expected a condition on the motion, got a constant")


def _label(what: str, number: int, condition: Callable[..., object]) -> str:
    """Return the name of a condition, or its number if it is a lambda."""
    name = getattr(condition, "__name__", "<lambda>")
    return f"{what} {number + 1}" if name == "<lambda>" else f"{what} {name}"


def _missing(condition: Callable[..., object], settings: Sequence[Setting]) -> str:
    """Return a message if each phase lacks a name that a condition of the problem contains."""
    errors: list[MissingError] = []
    for setting in settings:
        try:
            expressions.comparisons(condition, Signals(setting.model))
        except MissingError as error:
            errors.append(error)
        except ValueError:
            break  # reported by `_path`
    return str(errors[0]) if len(errors) == len(settings) else ""


def _links(setting: Setting, before: Model, problems: list[str]) -> Iterator[Link]:
    """Yield start values of the states that continue the previous phase."""
    continued = {v.name for v in before.x}
    signals = Signals(before)
    for v in setting.model.x:
        start: Any = setting.phase.link.get(v.name, v.name if v.name in continued else None)
        if start is None:
            continue
        with collected(problems, f"{setting.where}link of {v.name}: "):
            expression = expressions.value_of(
                start if callable(start) else itemgetter(start), signals
            )
            _check_known(expression, before)
            yield Link(v.name, expression)


def _joins(setting: Setting, before: Model, problems: list[str]) -> Iterator[Join]:
    """Yield conditions between the end of the previous phase and the start of this one."""
    if not setting.phase.joins:
        return
    left, ending = expressions.fresh_symbols(before, "before")
    right, starting = expressions.fresh_symbols(setting.model, "after")
    symbols = [*left, *right]
    for number, condition in enumerate(setting.phase.joins):
        name = _label("join", number, condition)
        with collected(problems, f"{setting.where}{name}: "):
            for expression, low, high in expressions.comparisons(condition, ending, starting):
                if stray := strays(expression, ca.vertcat(*symbols)):
                    raise ValueError(f"expected only signals, got {', '.join(stray)}")
                _check_possible(expression, low, high, ca.vertcat(*symbols))
                yield Join(name, ca.Function("join", symbols, [expression]), low, high)
