"""From the text of a problem to its spans."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from ocp.formulation.bounds import FREE, Box, Free, as_box, fixed, meet
from ocp.formulation.choice import Choice, chosen_of
from ocp.formulation.evaluate_callbacks import Written, gathered, written
from ocp.formulation.rates import with_outputs
from ocp.formulation.settings import Setting, settings_of
from ocp.formulation.span import Link, Row, Span
from ocp.formulation.starts import start_of
from symfric.model import Model

if TYPE_CHECKING:
    from ocp.formulation.problem import Problem


def function_problems(problem: "Problem") -> list[str]:
    """What is wrong with costs, conditions and links, whatever ranges and numbers are."""
    tell: list[str] = []
    written(problem, settings_of(problem), tell)
    return tell


def resolved(problem: "Problem") -> tuple[tuple[Span, ...], list[str]]:
    """The spans of `problem`, and what is wrong with them; with that they are not complete."""
    tell: list[str] = []
    settings = settings_of(problem)
    chosen = chosen_of(problem.choose, settings)
    pairs = zip(settings, written(problem, settings, tell), strict=True)
    spans = [_span(setting, text, chosen) for setting, text in pairs]
    every: list[Span] = []
    for number, (name, values) in enumerate((problem.scenarios or {"": {}}).items()):
        where = f"scenario '{name}': " if name else ""
        for setting, span in zip(settings, spans, strict=True):
            with gathered(tell, setting.where + where):
                given = {c.name: c.guess for c in chosen}
                given = dict(setting.p) | dict(values) | given
                every.append(_at_numbers(problem, setting, replace(span, scenario=number), given))
    if not tell:
        tell += _unreachable(every, settings)
        tell += _constant_cost(every)
        every = [_without_repeats(every, k) for k in range(len(every))]
    return tuple(every), tell


def _without_repeats(spans: Sequence[Span], k: int) -> Span:
    """Span k without links between values that are given on both sides: they say nothing new."""
    span, before = spans[k], spans[k - 1]

    def repeats(link: Link) -> bool:
        sides = (before.nodes[1.0].get(link.state, FREE), span.nodes[0.0][link.state])
        return _goes_on(before, link) and all(map(fixed, sides))

    return replace(span, links=tuple(link for link in span.links if not repeats(link)))


def _goes_on(before: Span, link: Link) -> bool:
    """Whether a state is continuous, as it is by default."""
    symbols = {v.name: v.symbol for v in before.model.x}
    return link.state in symbols and ca.is_equal(link.expression, symbols[link.state])


def box_of(setting: Setting, name: str) -> Box:
    """Bounds of a signal in a phase: those given, else those of the model."""
    if name in setting.bounds:
        return as_box(setting.bounds[name])
    model = setting.model
    known = {v.name: v for group in (model.x, model.z, model.u) for v in group}
    return (known[name].lower, known[name].upper) if name in known else FREE


def _span(setting: Setting, text: Written, chosen: Sequence[Choice]) -> Span:
    """All of a span but what depends on numbers of parameters."""
    phase = setting.phase
    given = {0.0: phase.start, **{float(s): phase.via[s] for s in phase.via}, 1.0: phase.end}
    given = dict(sorted(given.items()))
    named = (*setting.bounds, *(name for at in given.values() for name in at))
    model = with_outputs(setting.model, (*named, *text.details))
    boxes = {
        v.name: box_of(setting, v.name) for group in (model.x, model.z, model.u) for v in group
    }
    parameters = {v.name for v in model.p}
    return Span(
        name=phase.name or f"phase {setting.number + 1}",
        scenario=0,
        phase=setting.number,
        model=model,
        T=phase.T if isinstance(phase.T, Free) else float(phase.T),
        p=np.zeros(len(model.p)),
        chosen=tuple(c.name for c in chosen if c.name in parameters),
        boxes=boxes,
        nodes={s: _met(boxes, at, model.x) for s, at in given.items()},
        inputs_at={s: _met(boxes, given[s], model.u) for s in (0.0, 1.0)},
        rows_at={s: _rows_at(model, s, at) for s, at in given.items()},
        path=(*_bounded(setting), *text.path),
        running=text.running,
        end=text.end,
        squares=text.squares,
        links=text.links,
        joins=text.joins,
    )


def _met(boxes: Mapping[str, Box], given: Mapping[str, Any], group: Any) -> dict[str, Box]:
    """Range of every variable of a group: its bounds, and what is given here."""
    return {v.name: meet(boxes[v.name], as_box(given.get(v.name, FREE))) for v in group}


def _rows_at(model: Model, fraction: float, given: Mapping[str, Any]) -> tuple[Row, ...]:
    """What is given there for signals that are no states or inputs."""
    own = {v.name for group in (model.x, model.u) for v in group}
    place = {0.0: "at the start", 1.0: "at the end"}.get(fraction, f"at {fraction:g} T")
    return tuple(
        Row(f"{name} {place}", model.expression(name), *as_box(value))
        for name, value in given.items()
        if name not in own and as_box(value) != FREE
    )


def _bounded(setting: Setting) -> Iterator[Row]:
    """Bounds on outputs and details: conditions on the path."""
    model = setting.model
    own = {v.name for group in (model.x, model.z, model.u) for v in group}
    for name in setting.bounds:
        if name not in own and box_of(setting, name) != FREE:
            yield Row(f"the bound on {name}", model.expression(name), *box_of(setting, name))


def _at_numbers(
    problem: "Problem", setting: Setting, span: Span, given: Mapping[str, float]
) -> Span:
    """`span` with the numbers of its parameters, and the start values that follow from them."""
    known = {v.name for v in span.model.p}
    given = {name: value for name, value in given.items() if name in known}
    span = replace(span, p=span.model.values("p", given))
    if setting.number > 0:
        return span
    start, rows = start_of(setting, span, given, problem.periodic)
    return replace(
        span,
        nodes=dict(span.nodes) | {0.0: start},
        rows_at=dict(span.rows_at) | {0.0: (*span.rows_at[0.0], *rows)},
    )


def _unreachable(spans: Sequence[Span], settings: Sequence[Setting]) -> Iterator[str]:
    """Ranges that leave no room."""
    for span in spans:
        setting = settings[span.phase]
        for fraction, boxes in (*span.nodes.items(), *span.inputs_at.items()):
            where = {0.0: "start", 1.0: "end"}.get(fraction, f"via {fraction:g}")
            for name, (low, high) in boxes.items():
                if low > high:
                    bounds = span.box(name)
                    yield (
                        f"{setting.where}{where}: expected {name} inside its bounds "
                        f"[{bounds[0]:g}, {bounds[1]:g}], got {high if bounds[0] > high else low:g}"
                    )
    for before, span in pairwise(spans):
        for link in span.links if span.phase else ():
            yield from _apart(before, span, link, settings[span.phase].where)


def _apart(before: Span, span: Span, link: Link, where: str) -> Iterator[str]:
    """A state that is continuous by default, where it cannot be."""
    if not _goes_on(before, link):
        return
    ends = before.nodes[1.0]
    low, high = meet(ends[link.state], span.nodes[0.0][link.state])
    if low > high:
        yield (
            f"{where}start: expected {link.state} where the phase before may end, "
            f"{_words(ends[link.state])}, got {_words(span.nodes[0.0][link.state])}; "
            f"link={{'{link.state}': None}} lets it jump"
        )


def _words(box: Box) -> str:
    return f"{box[0]:g}" if fixed(box) else f"[{box[0]:g}, {box[1]:g}]"


def _constant_cost(spans: Sequence[Span]) -> Iterator[str]:
    """A cost that nothing changes."""
    costs, free = ca.SX(0, 1), False
    for span in spans:
        own = ca.vertcat(span.running, span.end)
        picked = [v.symbol for v in span.model.p if v.name in span.chosen]
        changed = ca.vertcat(*(span.model.vector(letter) for letter in "xzu"), *picked)
        if ca.depends_on(own, changed):
            return
        costs, free = ca.vertcat(costs, own), free or isinstance(span.T, Free)
    if not free or costs.is_zero():
        yield (
            "cost: expected one that depends on the motion, got a constant; TIME needs a free "
            "duration, T=Free(lower, upper)"
        )
