"""Variables of a unit, as listed in both versions of the standard.

Value references count time, all signals of the model in its order (x, z, u, outputs), parameters,
the relative tolerance and the attempts of the integrator.
"""

from collections.abc import Iterator, Mapping
from math import inf
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.parameters import Variable
from symfric.foundation.units import per_second
from symfric.foundation.variable import strays
from symfric.model import Model

LEAST_RTOL, LARGEST_RTOL = 1e-13, 0.1


class Entry(NamedTuple):
    """Variable of the unit.

    Attributes:
        reference: value reference.
        causality, variability, initial: words of the standard; `initial` may be empty.
        start: start value; None if the unit calculates it.
        needs: names of the inputs and states on which an output depends directly.
        of: name of the state whose rate the variable is.
        kind: "state"; in model exchange also "rate" or "indicator"; "" for other variables.
    """

    name: str
    reference: int
    causality: str
    variability: str
    initial: str = ""
    start: float | None = None
    unit: str = ""
    nominal: float | None = None
    lower: float = -inf
    upper: float = inf
    doc: str = ""
    needs: tuple[str, ...] = ()
    of: str = ""
    kind: str = ""


def entries(
    model: Model,
    start: Mapping[str, float],
    rtol: float,
    given: bool = True,
    exchange: bool = False,
) -> tuple[Entry, ...]:
    """Return all variables of the unit of a `model`.

    Args:
        model: source of signals and parameters.
        start: values of states and algebraic variables at the start.
        rtol: default of the relative tolerance; 0 for fixed steps, which have none.
        given: True if the start values of all states are kept as set; False if the loops of a
            mechanism must be closed.
        exchange: True to add rates and event indicators.
    """
    found = [*_signals(model, start, given, exchange)]
    fixed = fixed_parameters(model)
    found += [
        _bounded(
            v, k, "parameter", "fixed" if v.name in fixed else "tunable", "exact", float(v.start)
        )
        for k, v in enumerate(model.p, start=len(found))
    ]
    number = len(found)
    if exchange:
        return (*found, *_rates(model, number + 2))
    taken = {entry.name for entry in found}
    tuned, idle = ("tunable", "") if rtol else ("fixed", "; without effect: steps are fixed")
    return (
        *found,
        Entry(
            _free("rtol", taken), number, "parameter", tuned, "exact", rtol or 1e-6, "1",
            lower=LEAST_RTOL, upper=LARGEST_RTOL, doc=f"relative tolerance of a step{idle}",
        ),
        Entry(
            _free("attempts", taken), number + 1, "local", "discrete", "calculated", unit="1",
            doc="steps of the integrator so far, rejected ones included",
        ),
    )  # fmt: skip


def fixed_parameters(model: Model) -> set[str]:
    """Return the parameters that must not change after the initialisation.

    These are the dimensions of a mechanism with loops, whose change would violate the constraints,
    and parameters of start values only.
    """
    h, events = model.holonomic, model.events
    running = [model.ode, model.alg] if h is None else [h.implicit, h.rates, h.pressing]
    running += [o.expression for o in model.outputs.values()]
    running += [e for event in events for e in (event.expression, *event.reset.values())]
    used = _symbols(*(ca.SX(e) for e in running if e is not None))
    lengths = set[int]() if h is None else _symbols(h.phi)
    symbols = {v.name: v.symbol.element_hash() for v in model.p}
    return {name for name, own in symbols.items() if own in lengths or own not in used}


def _symbols(*expressions: ca.SX) -> set[int]:
    return {symbol.element_hash() for symbol in ca.symvar(ca.veccat(*expressions))}


def _signals(
    model: Model, start: Mapping[str, float], given: bool, exchange: bool
) -> Iterator[Entry]:
    """Yield time and all signals."""
    names, needed = model.signals, direct(model)
    groups = {v.name: v for v in (*model.x, *model.z, *model.u)}
    states = {v.name for v in model.x}
    taken = {*names, *(v.name for v in model.p)}
    yield Entry(_free("time", taken), 0, "independent", "continuous", unit="s", doc="time")
    for number, (name, unit) in enumerate(names.items(), start=1):
        if name not in groups:
            yield Entry(
                name, number, "output", "continuous", "calculated", unit=unit,
                doc=model.outputs[name].doc, needs=needed[name],
            )  # fmt: skip
            continue
        v, role, initial, needs, kind = groups[name], "output", "approx", needed.get(name), ""
        if name in states:
            needs, kind = (name,) if exchange else (), "state"
            initial = "exact" if given and ca.SX(v.start).is_constant() else "approx"
        elif needs is None:
            role, initial = "input", ""
        first = float(v.start) if role == "input" else start[name]
        yield _bounded(v, number, role, "continuous", initial, first, needs or (), kind)


def _rates(model: Model, first: int) -> Iterator[Entry]:
    """Yield the rates of the states and the event indicators for model exchange."""
    for number, v in enumerate(model.x, start=first):
        yield Entry(
            f"der({v.name})", number, "local", "continuous", "calculated",
            unit=per_second(v.unit), doc=f"rate of {v.doc or v.name}", of=v.name, kind="rate",
        )  # fmt: skip
    for number, event in enumerate(model.events, start=first + len(model.x)):
        yield Entry(
            f"event({event.name})", number, "local", "continuous", "calculated",
            doc=f"passes through zero at the event {event.name}", kind="indicator",
        )  # fmt: skip


def _bounded(
    v: Variable, number: int, causality: str, variability: str, initial: str, start: float,
    needs: tuple[str, ...] = (), kind: str = "",
) -> Entry:  # fmt: skip
    nominal = v.nominal if v.nominal != 1.0 else None
    return Entry(
        v.name, number, causality, variability, initial, start, v.unit, nominal, v.lower, v.upper,
        v.doc, needs, kind=kind,
    )  # fmt: skip


def _free(name: str, taken: set[str]) -> str:
    """Return `name`, with a prefix if the model already uses it."""
    while name in taken:
        name = f"symfric_{name}"
    return name


def direct(model: Model) -> dict[str, tuple[str, ...]]:
    """Return the inputs and states on which each signal structurally depends at the same instant.

    Algebraic variables depend on all symbols of their equations and of all equations coupled with
    them.
    """
    x, z, u = (model.vector(letter) for letter in "xzu")
    known = ca.vertcat(u, x)
    names = [v.name for v in (*model.u, *model.x)]
    equations = model.alg if model.ode is not None else model.residual
    unknown = z if model.ode is not None else ca.vertcat(z, model.xdot)
    behind = _reach(_pattern(equations, unknown), _pattern(equations, known))
    found: dict[str, tuple[str, ...]] = {}

    def named(row: NDArray[np.bool_]) -> tuple[str, ...]:
        return tuple(name for name, needs in zip(names, row, strict=True) if needs)

    for i, v in enumerate(model.z):
        found[v.name] = named(behind[i])
    for name, output in model.outputs.items():
        expression, found[name] = ca.SX(output.expression), ()
        if strays(expression, ca.SX(0, 1)):
            through = _pattern(expression, unknown)[0][:, None] & behind
            found[name] = named(_pattern(expression, known)[0] | through.any(axis=0))
    return found


def _pattern(expression: ca.SX, symbols: ca.SX) -> NDArray[np.bool_]:
    """Return the sparsity of `expression` with respect to `symbols`, shape (rows, symbols)."""
    shape = (expression.numel(), symbols.numel())
    if not all(shape):
        return np.zeros(shape, dtype=bool)
    return ca.DM(ca.jacobian_sparsity(expression, symbols), 1).full() != 0


def _reach(of_unknown: NDArray[np.bool_], of_known: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return a mask of the known symbols in the equations coupled with each unknown."""
    group = of_unknown.T.astype(int) @ of_unknown.astype(int) > 0
    group |= np.eye(group.shape[0], dtype=bool)
    while ((wider := group.astype(int) @ group.astype(int) > 0) != group).any():
        group = wider
    in_groups = group.astype(int) @ of_unknown.T.astype(int)
    return in_groups @ of_known.astype(int) > 0
