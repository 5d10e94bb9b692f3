"""What may be wrong with names, ranges and durations of a problem whose parts are of their kind."""

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping
from math import inf
from typing import TYPE_CHECKING, Any

from ocp.formulation.bounds import RANGE, Free, as_box, is_range
from ocp.formulation.kinds import COST, labelled_phases, said
from ocp.formulation.phase import Phase
from ocp.formulation.rates import rate_name
from ocp.formulation.settings import goals, names_of
from symfric.foundation import checks
from symfric.foundation.numeric import is_number
from symfric.model import Model

if TYPE_CHECKING:
    from ocp.formulation.problem import Problem

DURATION = "a duration T > 0 [s] or Free(lower, upper)"


def input_problems(problem: "Problem") -> Iterator[str]:
    """Names that nothing has, ranges that are none, durations that cannot be."""
    for number, (where, phase) in enumerate(labelled_phases(problem)):
        for text in _phase(problem, number, phase):
            yield f"{where}{text}" if text else ""
    names = Counter(phase.name for phase in problem.chain if phase.name)
    for name, count in names.items():
        if count > 1:
            yield f"phases: expected every name once, got '{name}' {count} times"
    yield from _shared_text(problem)
    yield from _choices(problem)
    yield from _scenarios(problem)
    yield from _durations(problem)
    yield from _costs(problem)


def _phase(problem: "Problem", number: int, phase: Phase) -> Iterator[str]:
    model, first = phase.model, number == 0
    if model.ode is None:
        yield "expected an explicit model (ode), got an implicit one (residual)"
    yield _event_problem(model)
    yield duration_problem(phase.T)
    inputs = [v.name for v in model.u]
    rated = [n for n in inputs if n in phase.rates or n in problem.rates]
    yield said(checks.check_names, "rates", phase.rates, inputs, _not_rated(model, phase.rates))
    taken = {*model.signals, *(v.name for v in model.p)} & set(map(rate_name, rated))
    if taken:
        yield f"rates: expected new names for the rates, got {', '.join(sorted(taken))}"
    places: list[tuple[str, Mapping[str, Any], list[str]]] = [
        ("start", phase.start, []),
        *((f"via {fraction:g}", values, inputs) for fraction, values in phase.via.items()),
        ("end", phase.end, []),
        ("bounds", phase.bounds, []),
    ]
    for where, given, fleeting in places:
        known = [n for n in names_of(model, given) if n not in fleeting or n in rated]
        yield said(checks.check_names, where, given, known, _no_signal(model, given, fleeting))
        yield from range_problems(where, given)
    yield from _rate_problems(phase.rates)
    for fraction in phase.via:
        if not 0 < fraction < 1:
            yield f"via: expected fractions of T between 0 and 1, got {fraction:g}"
    known = [*(v.name for v in model.p), *goals(model, _costs_of(problem, phase))]
    yield said(checks.check_names, "p", phase.p, known, freed(phase.p))
    yield from _numbers("p", phase.p)
    if first and (phase.link or phase.joins):
        what = "link" if phase.link else "joins"
        yield f"{what}: expected none in the first phase, which has none before it"
    yield from _links(phase, [*(v.name for v in model.x), *rated])


def _event_problem(model: Model) -> str:
    """Events that no optimiser sees, but for those of laws that know slip and stick apart."""
    if not model.events:
        return ""
    for contact in model.contacts:
        if text := said(contact.sliding, 1) or said(contact.static_level):
            return f"expected contacts with known modes, got events of '{contact.name}': {text}"
    try:
        own = model.open.events if model.contacts else model.events
    except ValueError:  # changed since it was closed: nobody knows whose they are
        own = model.events
    names = [event.name for event in own]
    if not names:
        return ""
    hint = "derivatives do not see them; write phases that join at the event"
    return f"expected a model without events, got {checks.listed(names)}; {hint}"


def _links(phase: Phase, states: Collection[str]) -> Iterator[str]:
    yield said(checks.check_names, "link", phase.link, states, "only states are continued")
    for name, given in phase.link.items():
        if given is not None and not isinstance(given, str) and not callable(given):
            what = f"{name} as a function such as lambda before: -0.5 * before.v, a name, or None"
            yield str(checks.refused("link", what, given, "numbers stand in start"))


def duration_problem(T: object) -> str:
    """What is wrong with a duration, or nothing."""
    number = checks.as_number(T)
    if isinstance(T, Free) or (number is not None and 0 < number < inf):
        return ""
    hint = f"write Free({T[0]!r}, {T[1]!r})" if isinstance(T, tuple) and len(T) == 2 else ""
    return f"expected {DURATION}, got {checks.shown(T)}" + f"; {hint}" * bool(hint)


def range_problems(where: str, given: Mapping[str, Any]) -> Iterator[str]:
    """Values that are neither numbers nor ranges."""
    for name, value in given.items():
        if not is_range(value):
            listed = isinstance(value, list) or getattr(value, "shape", None) == (2,)
            hint = "write a tuple: (lower, upper)" if listed else ""
            yield str(checks.refused(where, f"{name} as {RANGE}", value, hint))


def _rate_problems(rates: Mapping[str, Any]) -> Iterator[str]:
    """Rates are ranges: a number would be a rate to keep."""
    for name, value in rates.items():
        if not is_range(value) or not isinstance(value, tuple):
            size = checks.as_number(value)
            hint = "" if size is None else f"write ({-abs(size):g}, {abs(size):g})"
            yield str(checks.refused("rates", f"{name} as (lower, upper)", value, hint))


def freed(names: Iterable[str]) -> str:
    """How a number of a law or a scene becomes a parameter."""
    return f"free it where the model is made: drive(law, free={list(names)!r})"


def _no_signal(model: Model, given: Iterable[str], fleeting: Collection[str]) -> str:
    """What to do about names that are no signals."""
    if {"t", "T"} & set(given):
        return "durations are T of the phases, and durations=... of the problem"
    if set(fleeting) & set(given):
        return "an input holds on intervals; with rates=... it has a value at a time"
    parameters = {v.name for v in model.p} & set(given)
    return "parameters stand in p or choose" if parameters else ""


def _not_rated(model: Model, given: Iterable[str]) -> str:
    signals = {*model.signals} & set(given)
    return "only inputs have rates that are chosen" if signals else ""


def _numbers(where: str, given: Mapping[str, Any]) -> Iterator[str]:
    for name, value in given.items():
        yield said(checks.number, f"{where}: {name}", value)


def _costs_of(problem: "Problem", phase: Phase) -> list[Any]:
    return [cost for cost in (problem.cost, phase.cost) if cost is not None]


def _parameters(problem: "Problem") -> list[str]:
    """Parameters of all models, and references of costs."""
    found: list[str] = []
    for phase in problem.chain:
        found += [v.name for v in phase.model.p]
        found += goals(phase.model, _costs_of(problem, phase))
    return list(dict.fromkeys(found))


def _shared_text(problem: "Problem") -> Iterator[str]:
    """What the problem says about all phases: some phase must have the names."""
    models = [phase.model for phase in problem.chain]
    inputs = list(dict.fromkeys(v.name for model in models for v in model.u))
    signals = list(dict.fromkeys(n for m in models for n in names_of(m, problem.bounds)))
    hint = next((h for m in models if (h := _no_signal(m, problem.bounds, ()))), "")
    yield said(checks.check_names, "bounds", problem.bounds, signals, hint)
    yield from range_problems("bounds", problem.bounds)
    hint = next((h for m in models if (h := _not_rated(m, problem.rates))), "")
    yield said(checks.check_names, "rates", problem.rates, inputs, hint)
    yield from _rate_problems(problem.rates)
    yield said(checks.check_names, "p", problem.p, _parameters(problem), freed(problem.p))
    yield from _numbers("p", problem.p)
    yield said(checks.check_names, "shared", problem.shared or (), inputs, "only inputs are shared")
    first, last = (problem.chain[k] for k in (0, -1))
    ends = [
        {*(v.name for v in phase.model.x), *phase.rates, *(set(problem.rates) & set(inputs))}
        for phase in (first, last)
    ]
    both = [
        name for name in (*(v.name for v in first.model.x), *inputs) if name in ends[0] & ends[1]
    ]
    yield said(checks.check_names, "periodic", problem.periodic, both, "only states are periodic")


def _choices(problem: "Problem") -> Iterator[str]:
    parameters = {v.name: v for phase in problem.chain for v in phase.model.p}
    yield said(checks.check_names, "choose", problem.choose, parameters, freed(problem.choose))
    for name, given in problem.choose.items():
        where = f"choose: expected {name} as (lower, upper) or (lower, upper, guess)"
        pair: Any = given
        if not isinstance(pair, tuple) or len(pair) not in (2, 3) or not is_range(pair[:2]):
            yield f"{where} with lower < upper and None for no bound, got {checks.shown(given)}"
            continue
        low, high = as_box(pair[:2])
        if low == high:
            yield f"{where}, got the one number {low:g}; a value that is given stands in p"
        if len(pair) == 3 and not (is_number(pair[2]) and low <= pair[2] <= high):
            yield f"{where} with a guess between, got {checks.shown(given)}"
        if name in parameters and not _overlap((low, high), parameters[name]):
            v = parameters[name]
            yield f"{where} within [{v.lower:g}, {v.upper:g}] {v.unit}, got {checks.shown(given)}"
        fixed = [s for s, values in problem.scenarios.items() if name in values]
        if fixed:
            yield (
                f"choose: expected {name} to be chosen once for all, got a value of its own in "
                f"scenario {', '.join(fixed)}"
            )


def _overlap(box: tuple[float, float], variable: Any) -> bool:
    return max(box[0], variable.lower) < min(box[1], variable.upper)


def _scenarios(problem: "Problem") -> Iterator[str]:
    known = _parameters(problem)
    for name, values in problem.scenarios.items():
        where = f"scenario '{name}'"
        yield said(checks.check_names, where, values, known, freed(values))
        yield from _numbers(where, values)


def _durations(problem: "Problem") -> Iterator[str]:
    phases = problem.chain
    for numbers, total in problem.durations:
        where = f"durations of {checks.shown(numbers)}"
        text = duration_problem(total)
        yield f"{where}: {text}" if text else ""
        try:
            which = [checks.count(where, n, least=0, most=len(phases) - 1) for n in numbers]
        except ValueError as error:
            yield f"{error}; phases are counted from 0"
            continue
        if len(set(which)) < len(which) or not which:
            yield f"{where}: expected numbers of phases, each once"
            continue
        parts = [phases[n].T for n in which]
        if text or any(map(duration_problem, parts)):
            continue
        low, high = (sum(_side(T, side) for T in parts) for side in ("lower", "upper"))
        if max(low, _side(total, "lower")) > min(high, _side(total, "upper")) * (1 + 1e-12):
            yield (
                f"{where}: expected a sum that the phases can have, {low:g} to {high:g} s, got "
                f"{_side(total, 'lower'):g} to {_side(total, 'upper'):g} s"
            )


def _side(T: float | Free, side: str) -> float:
    return getattr(T, side) if isinstance(T, Free) else float(T)


def _costs(problem: "Problem") -> Iterator[str]:
    if problem.cost is None and all(phase.cost is None for phase in problem.chain):
        yield f"expected {COST}, got None"
    for where, phase in labelled_phases(problem):
        if phase.cost is not None and phase.cost.largest:
            yield f"{where}cost: expected worst(...) in the cost of the problem, got it in a phase"
    given = {*problem.p, *(name for values in problem.scenarios.values() for name in values)}
    for where, phase in labelled_phases(problem):
        for name in goals(phase.model, _costs_of(problem, phase)):
            if name not in given and name not in phase.p:
                known = [*phase.model.signals, *(v.name for v in phase.model.p)]
                text = said(checks.check_names, f"{where}track", [name], known)
                yield f"{text}; or give its value: p={{{name!r}: ...}}"
