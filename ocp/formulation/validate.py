"""Checks of a problem: types, names, ranges and durations, and likely mistakes of units.

`type_problems` must be called first, because the other checks require the right types.
"""

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from math import inf, isfinite
from typing import Any, cast

from ocp.formulation import statement
from ocp.formulation.changed_models import FORM, is_form, order_of, rate_name
from ocp.formulation.expressions import Cost, offered
from ocp.formulation.phase import RANGE, Chain, Free, Phase, as_box, is_range, limits
from ocp.formulation.statement import Setting, Statement
from symfric.foundation import checks
from symfric.foundation.numeric import is_number
from symfric.foundation.variable import Variable
from symfric.model import Model

DURATION = "a duration T > 0 [s] or Free(lower, upper)"
FAR = 300.0
"""Factor between a number and the nominal value of its variable that indicates another unit."""
COST = "a cost made of integral(...), at_end(...) and TIME"
CONDITION = "functions of the signals such as lambda s: s.tip_z <= 0.9"
SUMS = "sums of durations, such as ((0, 1), 2.0): the first two phases take 2 s"


def message(check: Callable[..., Any], *arguments: Any, **named: Any) -> str:
    """Return the message of a check that fails, or "" if it passes."""
    try:
        check(*arguments, **named)
    except ValueError as error:
        return str(error)
    return ""


def _unknown(where: str, names: Iterable[str], known: Iterable[str], hint: str = "") -> str:
    names = list(names)
    return message(checks.check_names, where, names, offered(known, names), hint)


def type_problems(problem: Statement) -> Iterator[str]:
    """Yield messages about values of the wrong type."""
    phases = cast(object, problem.phases)
    if not isinstance(phases, Phase | Chain):
        hint = "join phases with >>: out >> back" if isinstance(phases, list | tuple) else ""
        if isinstance(phases, Model):
            hint = "give the model a duration: Phase(model, T=1.0)"
        yield str(checks.refused("phases", "a phase, such as Phase(model, T=1.0)", phases, hint))
        return
    mappings = "bounds", "rates", "inputs", "choose", "p", "scenarios", "totals"
    yield from _fields(problem, mappings, ("path",))
    if isinstance(problem.totals, Mapping):  # pyright: ignore[reportUnnecessaryIsInstance]
        for name, total in problem.totals.items():
            what = f"totals: {checks.shown(name)}"
            yield message(checks.function, what, total, "an integrand such as lambda s: s.force**2")
    if isinstance(problem.scenarios, Mapping):  # pyright: ignore[reportUnnecessaryIsInstance]
        for name, values in problem.scenarios.items():
            yield message(_named, f"scenario {checks.shown(name)}", values)
    yield message(checks.names, "periodic", problem.periodic)
    if problem.shared is not None:
        yield message(checks.names, "shared", problem.shared)
    yield message(_sums, problem.durations)
    for where, phase in statement.labelled_phases(problem):
        yield from (f"{where}{text}" for text in _phase_fields(phase) if text)


def _phase_fields(phase: Phase) -> Iterator[str]:
    mappings = "start", "end", "bounds", "rates", "inputs", "link", "p"
    yield from _fields(phase, mappings, ("path", "joins"))
    yield message(checks.kind, "name", phase.name, str, "a text")
    of_fractions = {
        "via": ("states by fractions of T, such as {0.5: {'x': 1.0}}", _named),
        "at": ("conditions by fractions of T, such as {0.5: [lambda s: s.x <= 1]}", _conditions),
    }
    for name, (what, check) in of_fractions.items():
        given = cast(object, getattr(phase, name))
        if not isinstance(given, Mapping):
            yield str(checks.refused(name, what, given))
            continue
        for fraction, values in cast(Mapping[Any, Any], given).items():
            if not is_number(fraction):
                yield f"{name}: expected fractions of T, got {checks.shown(fraction)}"
            yield message(check, f"{name} {checks.shown(fraction)}", values)


def _fields(
    of: Statement | Phase, mappings: Iterable[str], conditions: Iterable[str]
) -> Iterator[str]:
    """Yield messages about the fields that problems and phases share."""
    cost = cast(object, of.cost)
    if cost is not None and not isinstance(cost, Cost):
        hint = "wrap it in integral(...) or at_end(...)" if callable(cost) else ""
        yield str(checks.refused("cost", COST, cost, hint))
    for name in mappings:
        yield message(_named, name, getattr(of, name))
    for name in conditions:
        yield message(_conditions, name, getattr(of, name))


def _named(where: str, values: object) -> None:
    if values is None:
        raise checks.refused(where, "values by name, such as {'v': 0.1}", None, "leave it out")
    checks.named(where, values)


def _conditions(where: str, conditions: object) -> None:
    if callable(conditions):
        raise checks.refused(where, f"a sequence of {CONDITION}", conditions, "write [lambda ...]")
    for condition in checks.many(where, conditions, CONDITION):
        checks.function(where, condition, CONDITION)


def _sums(durations: object) -> None:
    for pair in checks.many("durations", durations, SUMS):
        if not (isinstance(pair, tuple) and len(pair) == 2 and isinstance(pair[0], list | tuple)):
            raise checks.refused("durations", SUMS, pair)


def input_problems(problem: Statement) -> Iterator[str]:
    """Yield messages about unknown names, invalid ranges and impossible durations."""
    settings = statement.settings_of(problem)
    for one in settings:
        yield from (f"{one.where}{text}" for text in _phase(problem, one) if text)
    for name, count in Counter(phase.name for phase in problem.chain if phase.name).items():
        if count > 1:
            yield f"phases: expected every name once, got '{name}' {count} times"
    yield from _for_all_phases(problem, settings)
    yield from _choices(problem)
    known = list(dict.fromkeys(v.name for one in settings for v in one.model.p))
    for name, values in problem.scenarios.items():
        yield from _parameter_problems(f"scenario '{name}'", values, known)
    yield from _durations(problem)
    yield from _cost_problems(problem)


def _phase(problem: Statement, one: Setting) -> Iterator[str]:
    phase, model, made, number = one.phase, one.phase.model, one.model, one.number
    inputs, held = [v.name for v in model.u], [v.name for v in made.u]
    if model.ode is None:
        yield "expected an explicit model (ode), got an implicit one (residual)"
    yield _event_problem(model)
    yield duration_problem(phase.T)
    yield _unknown("rates", phase.rates, inputs, _not_rated(model, phase.rates))
    yield _unknown("inputs", phase.inputs, inputs)
    yield from _form_problems(problem, one)
    groups: list[tuple[str, Mapping[str, Any], list[str]]] = [
        ("start", phase.start, []),
        *((f"via {fraction:g}", values, held) for fraction, values in phase.via.items()),
        ("end", phase.end, []),
        ("bounds", phase.bounds, []),
    ]
    for where, values, excluded in groups:
        known = [n for n in statement.names_of(made, values) if n not in excluded]
        yield _unknown(where, values, known, _no_signal(made, values, excluded))
        yield from range_problems(where, values)
    yield from _rate_problems(phase.rates)
    for fraction in phase.via:
        if not 0 < fraction < 1:
            yield f"via: expected fractions of T between 0 and 1, got {fraction:g}"
    for fraction in phase.at:
        if not 0 <= fraction <= 1:
            yield f"at: expected fractions of T from 0 to 1, got {fraction:g}"
    yield from _parameter_problems("p", phase.p, [v.name for v in made.p])
    if number == 0 and (phase.link or phase.joins):
        what = "link" if phase.link else "joins"
        yield f"{what}: expected none in the first phase, which has no previous one"
    states = [v.name for v in made.x]
    yield _unknown("link", phase.link, states, "only states are continued")
    for name, start in phase.link.items():
        if start is not None and not isinstance(start, str) and not callable(start):
            what = f"{name} as a function such as lambda before: -0.5 * before.v, a name, or None"
            yield str(checks.refused("link", what, start, "numbers belong in start"))


def _form_problems(problem: Statement, one: Setting) -> Iterator[str]:
    """Yield messages about forms of inputs, and about names of derivatives and totals."""
    model, forms = one.phase.model, dict(problem.inputs) | dict(one.phase.inputs)
    taken = {*model.signals, *(v.name for v in model.p)}
    rated = {*problem.rates, *one.phase.rates} & {v.name for v in model.u}
    for name, form in statement.only(forms, [v.name for v in model.u]).items():
        if not is_form(form):
            yield str(checks.refused("inputs", f"{name} as {FORM}", form))
        elif name in rated and not order_of(form):
            yield (
                f"rates: expected {name} to be 'linear', 'cubic' or Polynomial(degree >= 1), got "
                f"{checks.shown(form)}, whose rate is not bounded"
            )
        rated |= {name}
    derived = {rate_name(n, k) for n in rated - {*one.forms} for k in (1, 2, 3)}
    if both := taken & derived:
        yield f"rates: expected new names for the rates, got {', '.join(sorted(both))}"
    if both := taken & {*problem.totals}:
        yield f"totals: expected new names, got {', '.join(sorted(both))}"


def _event_problem(model: Model) -> str:
    """Return a message about events that are not of laws with known modes of slip and stick."""
    if not model.events:
        return ""
    for contact in model.contacts:
        if text := message(contact.sliding, 1) or message(contact.static_level):
            return f"expected contacts with known modes, got events of '{contact.name}': {text}"
    try:
        own = model.open.events if model.contacts else model.events
    except ValueError:  # variables changed after it was closed: the origin of events is unknown
        own = model.events
    if not own:
        return ""
    names = checks.listed([event.name for event in own])
    hint = "derivatives do not include them; write phases that join at the event"
    return f"expected a model without events, got {names}; {hint}"


def duration_problem(T: object) -> str:
    """Return a message if a duration is invalid, or "" if it is valid."""
    number = checks.as_number(T)
    if isinstance(T, Free) or (number is not None and 0 < number < inf):
        return ""
    hint = f"write Free({T[0]!r}, {T[1]!r})" if isinstance(T, tuple) and len(T) == 2 else ""
    return f"expected {DURATION}, got {checks.shown(T)}" + f"; {hint}" * bool(hint)


def range_problems(where: str, values: Mapping[str, Any]) -> Iterator[str]:
    """Yield messages about values that are neither numbers nor ranges."""
    for name, value in values.items():
        if not is_range(value):
            listed = isinstance(value, list) or getattr(value, "shape", None) == (2,)
            hint = "write a tuple: (lower, upper)" if listed else ""
            yield str(checks.refused(where, f"{name} as {RANGE}", value, hint))


def _rate_problems(rates: Mapping[str, Any]) -> Iterator[str]:
    """Yield messages about rates that are not ranges."""
    for name, value in rates.items():
        if not is_range(value) or not isinstance(value, tuple):
            size = checks.as_number(value)
            hint = "" if size is None else f"write ({-abs(size):g}, {abs(size):g})"
            yield str(checks.refused("rates", f"{name} as (lower, upper)", value, hint))


def _freed(names: Iterable[str]) -> str:
    """Return a hint on turning numbers of a law or a scene into parameters."""
    return f"free it where the model is made: drive(law, free={list(names)!r})"


def _no_signal(model: Model, names: Iterable[str], inputs: Collection[str]) -> str:
    """Return a hint for names that are not signals."""
    if {"t", "T"} & set(names):
        return "durations are T of the phases, and durations=... of the problem"
    if set(inputs) & set(names):
        return "an input holds on intervals; with rates=... it has a value at a time"
    parameters = {v.name for v in model.p} & set(names)
    return "parameters belong in p or choose" if parameters else ""


def _not_rated(model: Model, names: Iterable[str]) -> str:
    return "only inputs have rates that are chosen" if {*model.signals} & set(names) else ""


def _parameter_problems(where: str, values: Mapping[str, Any], known: list[str]) -> Iterator[str]:
    yield _unknown(where, values, known, _freed(values))
    for name, value in values.items():
        yield message(checks.number, f"{where}: {name}", value)


def _for_all_phases(problem: Statement, settings: Sequence[Setting]) -> Iterator[str]:
    """Yield messages about fields of the problem whose names must exist in some phase."""
    models, made = [phase.model for phase in problem.chain], [one.model for one in settings]
    inputs = list(dict.fromkeys(v.name for model in models for v in model.u))
    signals = list(dict.fromkeys(n for m in made for n in statement.names_of(m, problem.bounds)))
    hint = next((h for m in models if (h := _no_signal(m, problem.bounds, ()))), "")
    yield _unknown("bounds", problem.bounds, signals, hint)
    yield from range_problems("bounds", problem.bounds)
    hint = next((h for m in models if (h := _not_rated(m, problem.rates))), "")
    yield _unknown("rates", problem.rates, inputs, hint)
    yield from _rate_problems(problem.rates)
    yield _unknown("inputs", problem.inputs, inputs)
    yield from _parameter_problems(
        "p", problem.p, list(dict.fromkeys(v.name for m in made for v in m.p))
    )
    yield _unknown("shared", problem.shared or (), inputs, "only inputs are shared")
    last = {v.name for v in made[-1].x}
    both = [v.name for v in made[0].x if v.name in last]
    yield _unknown("periodic", problem.periodic, both, "only states are periodic")


def _choices(problem: Statement) -> Iterator[str]:
    parameters = {v.name: v for phase in problem.chain for v in phase.model.p}
    yield _unknown("choose", problem.choose, parameters, _freed(problem.choose))
    for name, given in problem.choose.items():
        where = f"choose: expected {name} as (lower, upper) or (lower, upper, guess)"
        pair: Any = given
        if not isinstance(pair, tuple) or len(pair) not in (2, 3) or not is_range(pair[:2]):
            yield f"{where} with lower < upper and None for no bound, got {checks.shown(given)}"
            continue
        low, high = as_box(pair[:2])
        if low == high:
            yield f"{where}, got the one number {low:g}; a fixed value belongs in p"
        if len(pair) == 3 and not (is_number(pair[2]) and low <= pair[2] <= high):
            yield f"{where} with a guess between, got {checks.shown(given)}"
        v = parameters.get(name)
        if v is not None and max(low, v.lower) >= min(high, v.upper):
            yield f"{where} within [{v.lower:g}, {v.upper:g}] {v.unit}, got {checks.shown(given)}"
        if fixed := [s for s, values in problem.scenarios.items() if name in values]:
            yield (
                f"choose: expected {name} to be chosen once for all, got a separate value in "
                f"scenario {', '.join(fixed)}"
            )


def _durations(problem: Statement) -> Iterator[str]:
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
        low, high = (sum(limits(T)[side] for T in parts) for side in (0, 1))
        wanted = limits(total)
        if max(low, wanted[0]) > min(high, wanted[1]) * (1 + 1e-12):
            yield (
                f"{where}: expected a sum that the phases can have, {low:g} to {high:g} s, got "
                f"{wanted[0]:g} to {wanted[1]:g} s"
            )


def _cost_problems(problem: Statement) -> Iterator[str]:
    if problem.cost is None and all(phase.cost is None for phase in problem.chain):
        yield f"expected {COST}, got None"
    values = {*problem.p, *(name for values in problem.scenarios.values() for name in values)}
    for where, phase in statement.labelled_phases(problem):
        if phase.cost is not None and phase.cost.largest:
            yield f"{where}cost: expected worst(...) in the cost of the problem, got it in a phase"
        for name in statement.references_of(problem, phase):
            if name not in values and name not in phase.p:
                known = [*phase.model.signals, *(v.name for v in phase.model.p)]
                text = _unknown(f"{where}track", [name], known)
                yield f"{text}; or give its value: p={{{name!r}: ...}}"


def doubts(problem: Statement) -> str:
    """Return sentences about values far from the nominal ones, which indicate mistakes of units.

    These are prescribed values of at least `FAR` times the `nominal` of their variable, and bounds
    of inputs of at most 1 / `FAR` times the `nominal`.
    """
    return " ".join(dict.fromkeys(_doubtful(problem)))


def _doubtful(problem: Statement) -> Iterator[str]:
    for one in statement.settings_of(problem):
        inputs = {v.name: v for v in one.model.u}
        known = {v.name: v for v in (*one.model.x, *one.model.z)} | inputs
        for place, ranges in (("start", one.phase.start), ("end", one.phase.end)):
            for name, wanted in ranges.items():
                least = min(map(abs, as_box(wanted)))
                if name in known and isfinite(least) and least >= FAR * known[name].nominal:
                    yield _doubt(f"{one.where}{place}", known[name], least)
        for name, wanted in one.bounds.items():
            most = max(map(abs, as_box(wanted)))
            if name in inputs and 0 < most <= inputs[name].nominal / FAR:
                yield _doubt(f"{one.where}bounds", inputs[name], most)


def _doubt(where: str, of: Variable, size: float) -> str:
    times = size / of.nominal
    factor = f"{times:.0f} times" if times > 1 else f"{1 / times:.0f} times less than"
    return (
        f"{where}: {of.name} = {size:g} {of.unit} is {factor} its nominal {of.nominal:g} "
        f"{of.unit}: check the unit."
    )
