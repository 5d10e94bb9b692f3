"""Models with smooth friction, and their smoothing widths relative to sliding velocities."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isfinite
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from ocp.formulation.phase import Array, Chain
from ocp.formulation.problem import Problem
from ocp.solving.one_solve import along_points
from ocp.transcription.unknowns import Values
from symfric.foundation import checks
from symfric.foundation.numeric import tanh
from symfric.foundation.parameters import Variable, parameters, with_values
from symfric.foundation.variable import at_start, stacked, strays
from symfric.laws import Exact, ExactCoulomb, Law
from symfric.laws.base import smooth
from symfric.model import Contact, Model, Monitor
from symfric.model.kinds import MODE

WIDTH = 1e-3
"""Default smoothing width [m/s] of a substitute for a law without a velocity scale."""
LEAST = 0.1
"""Smallest ratio of the scale of a contact to its previous scale, for contacts that barely move."""

LAYER = np.geomspace(0.1, 10.0, 101)
"""Sliding velocities, in multiples of the velocity scale of a law, among which its peak lies."""


class Width(NamedTuple):
    """Parameter of a smooth model that determines the smoothing width around v = 0.

    Attributes:
        contact: name of the contact.
        parameter: name of the parameter in `Model.p`, "<contact>_<width>".
        number: value of the parameter in the user's model.
        exponent: exponent of the width in the parameter: 1 for a width, -1 for a steepness.
        layer: smoothing width [m/s] at `number`; None for a width of loads, as `JointFriction.eps`.
        least: smoothing width [m/s] of the user's law; 0 for a substitute.
    """

    contact: str
    parameter: str
    number: float
    exponent: int
    layer: float | None
    least: float = 0.0

    def at(self, layer: float) -> float:
        """Return the parameter for a smoothing width `layer` [m/s]; widths of loads are kept."""
        if self.layer is None:
            return self.number
        return self.number * (layer / self.layer) ** self.exponent


def smooth_model(model: Model) -> Model:
    """Return `model` with smooth laws and with the widths of all contacts as parameters.

    Laws with modes or states, and laws with a jump that is not smoothed, are replaced by a law with
    the same sliding force and static level. With s = tanh 4x, x = v / width,

        F = (1 + s)/2 sliding(|v|, +1) + (1 - s)/2 sliding(-|v|, -1) + excess x / (x^2/4 + 3/4)^2

    where the excess is the static level minus the sliding force at v = 0.

    Raises:
        ValueError: a law has no force on each side of v = 0.
    """
    return _smoothed(model)[0]


def widths(model: Model) -> tuple[Width, ...]:
    """Return the widths of `smooth_model(model)`."""
    return _smoothed(model)[1]


def _smoothed(model: Model) -> tuple[Model, tuple[Width, ...]]:
    kept: dict[str, Any] = model.memory
    if "smooth model" not in kept:
        kept["smooth model"] = _made_smooth(model) if model.contacts else (model, ())
    return kept["smooth model"]


def _made_smooth(model: Model) -> tuple[Model, tuple[Width, ...]]:
    forces, p, found = dict[str, ca.SX](), list[Variable](), list[Width]()
    watched: list[Monitor] = []
    for c in model.contacts:
        try:
            forces[c.name], own, scale = _smooth_force(model, c)
        except ValueError as error:
            raise ValueError(f"model '{model.name}': contact '{c.name}': {error}") from None
        p += own
        layer = float(at_start(scale, (*model.p, *own)))
        if isfinite(layer):
            watched.append(Monitor(c.slip, scale))
        least = layer if c.law.widths else 0.0
        for v in own:
            exponent = c.law.widths.get(v.name.removeprefix(f"{c.name}_"), 1)
            found.append(Width(c.name, v.name, float(v.start), exponent, layer, least))
    loads = {v.name: (c.name, v) for c in model.contacts for v in c.widths.values()}
    found += [Width(name, v.name, float(v.start), 1, None) for name, v in loads.values()]
    p += [v for _, v in loads.values()]
    return model.with_forces(forces, p=tuple(p), monitors=tuple(watched)), tuple(found)


def _smooth_force(model: Model, contact: Contact) -> tuple[ca.SX, list[Variable], Any]:
    """Return the force [N], its widths as parameters, and the velocity scale [m/s]."""

    def parameter(name: str, unit: str, start: float, **more: Any) -> Variable:
        name, unit = f"{contact.name}_{name}", contact.unit(unit)
        return Variable(name, unit, start=start, nominal=start, **more)

    law = law_of(contact)
    by_itself = not law.states and not any(i.name not in contact.further for i in law.inputs)
    if by_itself and (law.widths or not _jumps(model, contact)):
        known = parameters(law)
        own = {
            w.name: parameter(w.name, w.unit, float(at_start(w.value, model.p)),
                              lower=w.lower, upper=w.upper, doc=w.doc)
            for w in (known[name] for name in law.widths)
        }  # fmt: skip
        law = with_values(law, {name: v.symbol for name, v in own.items()})
        force = ca.SX(law.force(contact.slip, contact.N, (), **contact.further))
        used = [v for v in own.values() if ca.depends_on(force, v.symbol)]
        return force, used, law.velocity_scale
    scale = float(at_start(law.velocity_scale, model.p))
    scale, doc = scale if isfinite(scale) else WIDTH, "width of the smoothed jump"
    width = parameter("width", "m/s", scale, lower=0.0, doc=doc)
    return _substitute(contact, width.symbol), [width], width.symbol


def _substitute(contact: Contact, width: ca.SX) -> ca.SX:
    """Return the smooth force [N] that replaces the law of `contact`; see `smooth_model`."""
    v, N, law, given = contact.slip, contact.N, law_of(contact), contact.further
    x, speed = v / width, smooth.magnitude(v, width)
    s, bump = tanh(4 * x), x / (0.25 * (x * x) + 0.75) ** 2
    force = ca.SX(0)
    for side in (1, -1):
        share = (1 + side * s) / 2
        sliding = law.sliding(side * speed, N, side, **given)
        top = law.static_level(N, side, **given) - side * law.sliding(0.0, N, side, **given)
        force += share * (sliding + top * bump)
    return force


def law_of(contact: Contact) -> Law:
    """Return the law of a contact; raise ValueError if it is not a `Law`."""
    law = contact.law
    if not isinstance(law, Law):
        raise checks.refused(f"contact '{contact.name}': law", "a law such as LuGre()", law)
    return law


def _jumps(model: Model, contact: Contact) -> bool:
    """Return True if friction at rest is nonzero for the start values of the parameters.

    It is zero for viscous friction and for an unloaded contact.
    """
    law = law_of(contact)
    if ca.SX(contact.N).is_zero():
        return False
    one = law.static_level(1.0, 1, **dict.fromkeys(contact.further, 0.0))
    return float(at_start(one, model.p)) != 0.0


def sticking(model: Model) -> tuple[Contact, ...]:
    """Return the contacts that can stick, whose friction is nonzero at v = 0."""
    if "ocp sticking" not in model.memory:
        model.memory["ocp sticking"] = tuple(c for c in model.contacts if _jumps(model, c))
    return model.memory["ocp sticking"]


def shortfall(model: Model) -> float:
    """Return the largest share of a static level that the law of a contact does not reach.

    The peak of a smooth law may be below its static level, for Brown-McPhee by 5e-4. A contact
    cannot rest under a force between both. Laws with states and jumps reach their levels.
    """
    shares = [0.0]
    for contact in sticking(model):
        law = law_of(contact)
        scale = float(at_start(law.velocity_scale, model.p))
        if law.states or not law.widths or not isfinite(scale):
            continue
        given = dict.fromkeys(contact.further, 0.0)
        level = at_start(law.static_level(1.0, 1, **given), model.p)
        forces = stacked(law.force(scale * x, 1.0, (), **given) for x in LAYER)
        shares.append(1.0 - float(ca.mmax(at_start(forces, model.p))) / float(level))
    return max(shares)


class Scale(NamedTuple):
    """Scales of the smoothing widths of one contact.

    Attributes:
        speed: largest sliding velocity of the motion [m/s or rad/s].
        load: largest normal force [N]; 1 if unknown.
    """

    speed: float
    load: float = 1.0


Scales = Mapping[str, Scale]
"""Contact -> its scales."""


def smoothed(problem: Problem) -> Problem:
    """Return `problem` with smooth models, whose widths are parameters."""
    made = {id(phase.model): smooth_model(phase.model) for phase in problem.chain}
    phases = tuple(replace(phase, model=made[id(phase.model)]) for phase in problem.chain)
    return replace(problem, phases=Chain(phases))


def scales_of(problem: Problem, smooth: Problem, points: Values, before: Scales) -> Scales:
    """Return the scales of the motion `points`, at least `LEAST` times the previous ones.

    Normal forces that depend on the friction force of another contact are omitted.

    Args:
        problem: the user's problem.
        smooth: the problem with smooth models to which `points` belong.
        points: the motion.
        before: previous scales; empty if there are none.
    """
    largest: dict[str, Array] = {}
    for span, own in zip(smooth.spans, points.spans, strict=True):
        for contact in problem.chain[span.phase].model.contacts:
            column = ca.vertcat(contact.slip, ca.SX(contact.N))
            if strays(column, ca.vertcat(*span.symbols)):
                column = ca.vertcat(contact.slip, 0.0)
            sizes = np.abs(along_points(span, own, column)).max(axis=1)
            largest[contact.name] = np.maximum(largest.get(contact.name, np.zeros(2)), sizes)
    scales: dict[str, Scale] = {}
    for name, (speed, load) in ((name, sizes.tolist()) for name, sizes in largest.items()):
        least = LEAST * before[name].speed if name in before else 0.0
        scales[name] = Scale(max(speed, least), load if load > 0.0 else 1.0)
    return scales


def same_size(a: Scales, b: Scales, factor: float) -> bool:
    """Return True if the speeds of each contact differ by at most a factor `factor`."""
    speeds = [(a[name].speed, b[name].speed) for name in a]
    return all(max(pair) <= factor * min(pair) for pair in speeds)


def guessed(problem: Problem, scales: Sequence[Scales]) -> Scales:
    """Return the expected scales of a motion from the scales of several starts.

    The speed is the largest median speed of all sliding contacts, or of all turning ones. A body at
    rest in the initial guess may move in the solution, and too wide layers are harmless.
    """
    turning = {c.name: c.turning for phase in problem.chain for c in phase.model.contacts}
    speeds = {name: float(np.median([s[name].speed for s in scales])) for name in turning}
    return {
        name: Scale(
            max(speeds[other] for other in turning if turning[other] == turning[name]),
            float(np.median([s[name].load for s in scales])),
        )
        for name in turning
    }


def widths_at(problem: Problem, scales: Scales, level: float) -> dict[str, float]:
    """Return parameter -> value for widths of `level` times the scales.

    The widths of the user's laws are lower bounds.
    """
    return {
        w.parameter: max(w.number, level * scales[w.contact].load)
        if w.layer is None
        else w.at(max(w.least, level * scales[w.contact].speed))
        for phase in problem.chain
        for w in widths(phase.model)
    }


def speeds_at(problem: Problem, scales: Scales, level: float) -> dict[str, float]:
    """Return contact -> smoothing width [m/s or rad/s] at `level`."""
    return {
        w.contact: max(w.least, level * scales[w.contact].speed)
        for phase in problem.chain
        for w in widths(phase.model)
        if w.layer is not None
    }


def narrowed(problem: Problem, factor: float) -> tuple[Problem, dict[str, str]]:
    """Return `problem` with layers narrower by about `factor`, and contact -> its layer as text."""
    made, p, layers = smoothed(problem), dict[str, float](), dict[str, str]()
    contacts = {c.name: c for phase in problem.chain for c in phase.model.contacts}
    for phase in problem.chain:
        for w in widths(phase.model):
            if w.layer is not None and w.least > 0.0:
                layer = f"{factor * w.least:.1g}"
                layers[w.contact] = f"{layer} {contacts[w.contact].unit('m/s')} ({w.contact})"
                p[w.parameter] = w.at(float(layer))
    return replace(made, p=dict(made.p) | p), layers


def is_exact(problem: Problem) -> bool:
    """Return True if all contacts that can stick have a set-valued law."""
    laws = [c.law for phase in problem.chain for c in sticking(phase.model)]
    return bool(laws) and all(isinstance(law, ExactCoulomb | Exact) for law in laws)


def law_states(problem: Problem) -> set[str]:
    """Return the names of states of laws and loops, which a motion by modes does not contain."""
    models = [phase.model for phase in problem.chain]
    of_laws = {v.name for model in models for c in model.contacts for v in c.states}
    return of_laws | {v.name for model in models for v in model.x if v.kind == MODE}


def bristles(problem: Problem) -> bool:
    """Return True if a law has states other than the mode of a set-valued law."""
    return bool(law_states(problem)) and not is_exact(problem)


def own_level(problem: Problem, scales: Scales) -> float:
    """Return the smallest smoothing width of the user's laws, in multiples of the speeds.

    It is 0 if no law is smoothed.
    """
    found = [
        w.least / scales[w.contact].speed
        for phase in problem.chain
        for w in widths(phase.model)
        if w.least > 0.0 and scales[w.contact].speed > 0.0
    ]
    return min(found, default=0.0)
