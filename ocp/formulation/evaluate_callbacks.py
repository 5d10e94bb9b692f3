"""Evaluation of the user's functions with symbols: costs, conditions, links and joins."""

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from math import inf
from operator import itemgetter
from typing import Any, NamedTuple

import casadi as ca

from ocp.formulation import expressions
from ocp.formulation.changed_models import typical
from ocp.formulation.expressions import EPS, MissingError, Signals, arguments
from ocp.formulation.phase import Join, Link, PathCondition, Row
from ocp.formulation.statement import Complementary, Setting, Soft, Statement
from symfric.foundation.variable import strays
from symfric.model import Model


class Peak(NamedTuple):
    """Cost weight max e.

    Attributes:
        name: name of the state that bounds e, equal in all phases that it covers.
        weight: weight in the cost at the end of the phase.
        continued: True if the maximum covers the previous phase too.
        rows: expressions e, or e and -e for |e|, between -inf and 0.
    """

    name: str
    weight: float
    continued: bool
    rows: tuple[Row, ...]


class Evaluated(NamedTuple):
    """Expressions returned by the functions of one phase; see `Span` for the fields.

    `at` are further conditions at fractions of T. `details` are names of results of a mechanism
    that costs and path conditions contain.
    """

    running: ca.SX
    end: ca.SX
    squares: tuple[tuple[float, ca.SX], ...]
    absolutes: tuple[Row, ...]
    peaks: tuple[Peak, ...]
    path: tuple[Row, ...]
    at: Mapping[float, tuple[Row, ...]]
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
        at = {s: tuple(_at(setting, s, signals, problems)) for s in setting.phase.at}
        costs = _costs(setting, signals, last=setting is settings[-1], problems=problems)
        results.append(Evaluated(*costs, path, at, links, joins, signals()))
        before = setting.model
    for number, condition in enumerate(problem.path):
        if text := _missing(condition, settings):
            problems.append(f"{_label('path condition', number, condition)}: {text}")
    for name, total in problem.totals.items():
        if text := _missing(total, settings, expressions.value_of):
            problems.append(f"totals: {name}: {text}")
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
) -> tuple[ca.SX, ca.SX, tuple[tuple[float, ca.SX], ...], tuple[Row, ...], tuple[Peak, ...]]:
    """Return integrand, end value, squares, absolute values and maxima of the costs of a phase."""
    running, end = ca.SX(0), ca.SX(0)
    squares: list[tuple[float, ca.SX]] = []
    absolutes: list[Row] = []
    peaks: list[Peak] = []
    for cost in setting.costs:
        own = cost is setting.phase.cost
        cost = cost if own or last else replace(cost, end=())
        with collected(problems, setting.where + "cost: "):
            try:
                L, E = cost.expressions(signals)
                values = [expressions.value_of(term, signals) for _, term in cost.absolutes]
                largest = [expressions.value_of(term, signals) for _, term in cost.peaks]
            except MissingError as error:
                alone = own or not setting.where
                hint = "" if alone else "; phases that differ have costs of their own: cost=..."
                raise ValueError(f"{error}{hint}") from None
            _check_known(ca.vertcat(L, E, *values, *largest), setting.model)
            running, end = running + L, end + E
            squares += cost.residuals(signals)
            for (weight, _), e in zip(cost.absolutes, values, strict=True):
                name = f"absolute value {len(absolutes) + 1}"
                row = Row(name, e, 0.0, 0.0, weight, size=typical(setting.model, e))
                absolutes += [row] if weight else []
            for (weight, _), e in zip(cost.peaks, largest, strict=True):
                name = f"largest_{len(peaks) + 1}" + f"_{setting.number + 1}" * own
                weight = weight if own or last else 0.0
                peaks.append(Peak(name, weight, not own, tuple(_bounded(setting.model, name, e))))
    return running, end, tuple(squares), tuple(absolutes), tuple(peaks)


def _bounded(model: Model, name: str, e: ca.SX) -> Iterator[Row]:
    """Yield the expressions of which the largest value is a cost."""
    sides = (e.dep(0), -e.dep(0)) if e.op() == ca.OP_FABS else (e,)
    for side in sides:
        yield Row(f"the bound {name}", side, -inf, 0.0, size=typical(model, side), parts=(side,))


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
                yield from _rows(label, rows, condition, changing)
                if isinstance(condition, Complementary):
                    yield _product(label, condition.parts(signals), setting.model, signals)


def _at(setting: Setting, fraction: float, signals: Signals, problems: list[str]) -> Iterator[Row]:
    """Yield the conditions at a fraction of T."""
    place = {0.0: "the start", 1.0: "the end"}.get(fraction, f"{fraction:g} T")
    changing = ca.vertcat(*arguments(setting.model))
    for number, condition in enumerate(setting.phase.at[fraction]):
        label = f"{_label('condition', number, condition)} at {place}"
        with collected(problems, f"{setting.where}{label}: "):
            if isinstance(condition, Complementary):
                raise ValueError("expected complementary(...) in path, got it at one time")
            rows = expressions.comparisons(condition, signals)
            yield from _rows(label, rows, condition, changing)


def _rows(
    label: str, rows: Sequence[expressions.Comparison], condition: PathCondition, known: ca.SX
) -> Iterator[Row]:
    """Yield the rows of a condition, with its penalty if it is soft."""
    soft = isinstance(condition, Soft)
    weights = (condition.linear, condition.quadratic) if soft else (0.0, 0.0)
    for expression, low, high in rows:
        if stray := strays(expression, known):
            raise ValueError(f"expected only signals of the model, got {', '.join(stray)}")
        _check_possible(expression, low, high, known)
        yield Row(label, expression, low, high, *weights)


def _product(label: str, parts: tuple[ca.SX, ca.SX], model: Model, signals: Signals) -> Row:
    """Return the bound on the product of complementary signals."""
    size = typical(model, parts[0]) * typical(model, parts[1])
    product = parts[0] * parts[1] - size * signals[EPS]
    return Row(f"{label} (product)", product, -inf, 0.0, size=size, parts=parts)


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


def _missing(
    condition: Callable[..., object],
    settings: Sequence[Setting],
    of: Callable[..., object] = expressions.comparisons,
) -> str:
    """Return a message if each phase lacks a name that a function of the problem contains."""
    errors: list[MissingError] = []
    for setting in settings:
        try:
            of(condition, Signals(setting.model))
        except MissingError as error:
            errors.append(error)
        except ValueError as error:
            return "" if of is expressions.comparisons else str(error)  # `_path` reports it
    return str(errors[0]) if len(errors) == len(settings) else ""


def _links(setting: Setting, before: Model, problems: list[str]) -> Iterator[Link]:
    """Yield start values of the states that continue the previous phase."""
    continued = {v.name for v in before.x}
    signals = Signals(before)
    for v in setting.model.x:
        same = v.name if v.name in continued and v.name not in setting.apart else None
        start: Any = setting.phase.link.get(v.name, same)
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
