"""Models of arcs, transfer of motions to them by name and time, and their mode sequence."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.formulation.phase import Free, Span
from ocp.formulation.problem import Problem
from ocp.formulation.statement import further_states
from ocp.friction.mode_models import SIDES, excess, holding, mode_model, rubbing, with_outputs
from ocp.friction.sequence import Arc, Leg, Track, cut, read, with_rests
from ocp.solving.motion import Motion
from ocp.transcription.transcription import Transcription
from ocp.transcription.unknowns import Points, SpanPoints
from symfric.foundation.parameters import Variable
from symfric.model import Contact, Model, Output

CATCH = 5.0
"""Margins of the sliding force that catch a contact which has slipped back for an instant, or that
stop one: with none the stop is only grazed, and the smallest deviation lets the contact slip on."""

FIRST = "_first_"
PULLED = "_pull"
CAUGHT = "_catch"
STOPPED = "_stop"
LEFT = "rest_left"
"""State of an arc at whose end a contact breaks away: its remaining time [s]."""


def breaks_away(span: Span) -> bool:
    """Return True if some contact breaks away or is caught at the start of an arc."""
    return any(name.endswith((PULLED, CAUGHT)) for name in span.model.outputs)


def carrier(model: Model, contact: Contact) -> tuple[str, int] | None:
    """Return the state proportional to the slip of `contact`, and the sign of the factor.

    None if the slip is not a multiple of one state.
    """
    x = model.vector("x")
    slope = ca.SX(ca.jacobian(contact.slip, x))
    if slope.nnz() != 1 or not slope.is_constant():
        return None
    factor, index = float(ca.sum1(ca.sum2(ca.DM(slope)))), slope.sparsity().get_crs()[1][0]
    if not ca.is_equal(ca.simplify(contact.slip - factor * x[index]), ca.SX(0), 2):
        return None
    return model.x[index].name, 1 if factor > 0 else -1


def arc_model(
    model: Model,
    modes: Mapping[str, int],
    released: Sequence[str],
    leaving: Mapping[str, int],
    caught: Mapping[str, int],
    stopped: Mapping[str, int],
    sizes: Mapping[str, float],
    margin: tuple[float, float],
) -> Model:
    """Return the mode model of `modes` with the quantities of an arc's conditions as outputs.

    Args:
        model: the user's model.
        modes: of all contacts that can stick.
        released: contacts that break away at the start of the arc.
        leaving: contacts that break away at its end by a force that cannot jump -> direction.
        caught: contacts that stop at its start under a control that may jump -> direction of the
            previous slip.
        stopped: the same for all contacts that stop.
        sizes: contact -> typical static level [N].
        margin: friction margin in stick as a share of the level, and the time before the end of
            the arc in which it decreases to zero if the contact breaks away [s].

    Returns:
        A model with "<contact>_slip"; as shares of the level "<contact>_up" and "<contact>_down",
        the friction margins in both directions, minus margin times tanh (remaining time / that
        time)^2 before break-away; "<contact>_first_up" and "<contact>_first_down", the same for
        states and inputs at the start of an interval; "<contact>_pull", the excess of released
        contacts; "<contact>_catch", the margin to the force of sliding back of caught contacts,
        and "<contact>_stop" to that of sliding on of stopped contacts.
    """
    kept: dict[Any, Model] = model.memory.setdefault("ocp arcs", {})
    key = (
        *modes.items(),
        *released,
        *leaving.items(),
        *caught.items(),
        STOPPED,
        *stopped.items(),
        *sizes.items(),
        *margin,
    )
    if key not in kept:
        made = mode_model(model, modes)
        outputs: dict[str, ca.SX] = {}
        fading, catch = ca.SX(0), 1.0 - CATCH * margin[0]
        if leaving:
            made, left = _with_clock(made)
            fading = margin[0] * ca.tanh((left / margin[1]) ** 2)
        for c in rubbing(model):
            outputs[f"{c.name}_slip"] = c.slip
            size, mode = sizes[c.name], modes[c.name]
            if mode and c.name not in released:
                continue
            force, rooms = holding(model, modes, c.name)
            if mode:
                outputs[f"{c.name}{PULLED}"] = -rooms[mode] / size
                continue
            for side, name in SIDES.items():
                less = fading if leaving.get(c.name) == side else 0.0
                outputs[f"{c.name}_{name}"] = made.expression(f"{c.name}_grip_{name}") / size - less
                outputs[f"{c.name}{FIRST}{name}"] = rooms[side] / size
            if side := stopped.get(c.name, 0):
                ahead = side * c.sliding(side)
                outputs[f"{c.name}{STOPPED}"] = (catch * ahead - side * force) / size
            if side := caught.get(c.name, 0):
                back = -side * c.sliding(-side)
                outputs[f"{c.name}{CAUGHT}"] = (side * force + catch * back) / size
        new = {name: Output(expression, "1") for name, expression in outputs.items()}
        kept[key] = with_outputs(made, new)
    return kept[key]


def _with_clock(model: Model) -> tuple[Model, ca.SX]:
    """Return `model` with the remaining time as a state, and its symbol."""
    left = Variable(LEFT, "s", nominal=0.1)
    return replace(model, **further_states(model, (left,), ca.SX(-1.0))), left.symbol


Array = NDArray[np.float64]
SHORT_RUN = 5e-3
"""Share of the whole duration below which a run is merged with its neighbours."""
NEW_REST = 2.5e-3
"""Initial duration of an inserted stick interval, over the whole duration."""


@final
@dataclass(frozen=True, eq=False)
class Known:
    """A known motion over its whole time.

    Attributes:
        motion: signals at times, and inputs held from times on.
        p: values of parameters, by name.
        chosen: of those that were chosen.
    """

    motion: Motion
    p: Mapping[str, float]
    chosen: Mapping[str, float]

    def signal(self, name: str, t: Array) -> Array:
        """Return values at times by linear interpolation; zero if unknown."""
        values = self.motion.signals.get(name, np.zeros(0))
        known = np.isfinite(values)
        if not known.any():
            return np.zeros(t.size)
        return np.interp(t, self.motion.t[known], values[known])

    def held(self, name: str, t: Array) -> Array:
        """Return the values of an input at times."""
        values = self.motion.controls.get(name)
        if values is None:  # there a state: an input with bounded rate
            return self.signal(name, t)
        at = np.searchsorted(self.motion.t_control, t, side="right") - 1
        found = values[np.maximum(at, 0)]
        return np.where(np.isfinite(found), found, 0.0)

    def along(self, model: Model, expression: ca.SX, t: Array) -> Array:
        """Return values of an expression in the symbols of `model`, shape (n, times)."""
        groups = [np.zeros((0, t.size)), np.zeros((0, t.size)), np.zeros((0, t.size))]
        for k, (letter, take) in enumerate(
            zip("xzu", (self.signal, self.signal, self.held), strict=True)
        ):
            names = [v.name for v in getattr(model, letter)]
            groups[k] = np.array([take(name, t) for name in names]).reshape(-1, t.size)
        p = model.values("p", {v.name: self.p[v.name] for v in model.p if v.name in self.p})
        symbols = [model.t, *(model.vector(letter) for letter in "xzup")]
        function = ca.Function("along", symbols, [expression]).map(t.size)
        return function(t[None, :], *groups, np.tile(p[:, None], (1, t.size))).full()


def points_in(into: Transcription, arcs: Sequence[Arc], known: Known) -> Points:
    """Return the initial guess: phase k of `into` takes the known motion during arc k."""
    pairs = enumerate(zip(into.problem.spans, arcs, strict=True))
    return Points(
        tuple(_in_span(into, k, span, arc, known) for k, (span, arc) in pairs), dict(known.chosen)
    )


def _in_span(into: Transcription, number: int, span: Span, arc: Arc, known: Known) -> SpanPoints:
    mesh, model = into.meshes[number], span.model
    T = min(max(arc.duration, span.T.lower), span.T.upper) if isinstance(span.T, Free) else span.T
    boxes = np.array([span.box(v.name) for v in model.x]).reshape(-1, 2, 1)

    def states(fractions: Array) -> Array:
        t = arc.begin + fractions * arc.duration
        left = {LEFT: arc.end - t}
        rows = [left[v.name] if v.name in left else known.signal(v.name, t) for v in model.x]
        rows = np.array(rows).reshape(-1, t.size)
        return np.clip(rows, boxes[:, 0], boxes[:, 1])

    inner, middles = into.inner_fractions(number), (mesh[:-1] + mesh[1:]) / 2
    t = arc.begin + middles * arc.duration
    u = np.array([known.held(v.name, t) for v in model.u]).reshape(-1, t.size)
    x = states(inner)
    z = _consistent(span, arc.begin + inner * arc.duration, x, u, known)
    return SpanPoints(T, states(mesh), x, z, u)


def _consistent(span: Span, t: Array, x: Array, u: Array, known: Known) -> Array:
    """Return algebraic variables at the points, after one step of Newton's method."""
    model = span.model
    z = np.array([known.signal(v.name, t) for v in model.z]).reshape(-1, t.size)
    if not model.z:
        return z
    symbol = model.vector("z")
    newton = symbol - ca.solve(ca.densify(ca.jacobian(model.alg, symbol)), model.alg)
    step = ca.Function("newton", span.symbols, [newton]).map(t.size)
    held = np.repeat(u, t.size // u.shape[1], axis=1)
    found = step(t[None, :], x, z, held, np.tile(span.p[:, None], (1, t.size))).full()
    return np.where(np.isfinite(found), found, z)


@final
@dataclass(frozen=True, eq=False)
class Reading:
    """Settings for deducing modes from a motion.

    Attributes:
        creep: contact -> sliding velocity below which it sticks.
        rests: whether stick is inserted at reversals and at the ends.
    """

    creep: Mapping[str, float]
    rests: bool = True


def sequence_of(problem: Problem, known: Known, reading: Reading) -> tuple[Leg, ...]:
    """Return the legs of `problem` with the arcs of a motion.

    Args:
        problem: the user's problem, one scenario.
        known: its sharpened motion.
        reading: thresholds of stick.
    """
    tracks: list[Track] = []
    for stay in _stays(problem):
        tracks.append(_track(problem, known, reading, *stay))
    if reading.rests:
        tracks = [_rested(problem, known, reading, track, tracks) for track in tracks]
    legs: list[Leg] = []
    for number, (phase, when) in enumerate(zip(problem.chain, known.motion.phases, strict=True)):
        fractions = [0.0, *sorted(phase.via), 1.0]
        for part in range(len(fractions) - 1):
            a, b = (when.begin + when.T * s for s in fractions[part : part + 2])
            legs.append(cut(tracks, (number, part), a, b))
    return tuple(legs)


def sizes_of(problem: Problem, known: Known) -> dict[str, float]:
    """Return the typical static level of each contact [N]: its mean over the motion."""
    found: dict[str, float] = {}
    for phase in problem.chain:
        held = mode_model(phase.model, {c.name: 0 for c in rubbing(phase.model)})
        for contact in rubbing(phase.model):
            both = [held.expression(f"{contact.name}_grip_{side}") for side in ("up", "down")]
            levels = known.along(held, (both[0] + both[1]) / 2, known.motion.t)
            size = float(np.mean(np.abs(levels[np.isfinite(levels)]))) if levels.size else 1.0
            found.setdefault(contact.name, size if isfinite(size) and size > 0 else 1.0)
    return found


def starts_at_rest(problem: Problem, known: Known, creep: Mapping[str, float]) -> tuple[str, ...]:
    """Return contacts without slip at the start."""
    model, start = problem.chain[0].model, known.motion.t[:1]
    return tuple(
        c.name
        for c in rubbing(model)
        if abs(float(known.along(model, c.slip, start)[0, 0])) < 1e-3 * creep[c.name]
    )


def _stays(problem: Problem) -> list[tuple[int, int, str]]:
    """Return (first phase, last phase, contact) of each uninterrupted contact."""
    found: list[tuple[int, int, str]] = []
    for number, phase in enumerate(problem.chain):
        for contact in rubbing(phase.model):
            stay = (number, number, contact.name)
            for k, (first, last, name) in enumerate(found):
                if name == contact.name and last == number - 1 and not phase.link:
                    stay = (first, number, name)
                    del found[k]
                    break
            found.append(stay)
    return found


def _track(
    problem: Problem, known: Known, reading: Reading, first: int, last: int, name: str
) -> Track:
    t, phases = known.motion.t, known.motion.phases
    kept = (t >= phases[first].begin) & (t <= phases[last].end)
    slips = np.zeros(t.size)
    for number in range(first, last + 1):
        model = problem.chain[number].model
        own = next(c for c in model.contacts if c.name == name)
        here = (t >= phases[number].begin) & (t <= phases[number].end)
        slips[here] = known.along(model, own.slip, t[here])[0]
    whole = phases[-1].end - phases[0].begin
    return read(name, t[kept], slips[kept], reading.creep[name], SHORT_RUN * whole)


def _rested(
    problem: Problem, known: Known, reading: Reading, track: Track, tracks: Sequence[Track]
) -> Track:
    """Return `track` with stick where inputs can hold the contact."""
    phases = known.motion.phases
    whole = phases[-1].end - phases[0].begin
    ends = np.array([track.runs[0].begin, track.runs[-1].end])

    def model_at(t: float) -> int:
        return next(k for k, phase in enumerate(phases) if t <= phase.end or k == len(phases) - 1)

    def can_rest(t: float) -> bool:
        number = model_at(t)
        return _holdable(problem, number, known, track.contact, tracks, t)

    def resting(t: float) -> bool:
        model = problem.chain[model_at(t)].model
        own = next(c for c in model.contacts if c.name == track.contact)
        slip = float(known.along(model, own.slip, np.array([t]))[0, 0])
        return abs(slip) < reading.creep[track.contact]

    at_ends = tuple(resting(float(t)) for t in ends)
    return with_rests(track, can_rest, NEW_REST * whole, (at_ends[0], at_ends[1]))


def _holdable(
    problem: Problem, number: int, known: Known, name: str, tracks: Sequence[Track], t: float
) -> bool:
    """Return True if inputs within their bounds can hold a contact at a time.

    The force needed is affine in the inputs of most models; for others this is its tangent.
    """
    model, span = problem.chain[number].model, problem.spans[number]
    others = {track.contact: track.at(t) or 0 for track in tracks}
    boxes = [span.box(v.name) for v in model.u]
    for side in (1, -1):
        modes = {c.name: others.get(c.name, 0) for c in rubbing(model)} | {name: side}
        moving = mode_model(model, modes)
        beyond = excess(model, modes, name, side)
        slope = ca.jacobian(beyond, moving.vector("u")).T
        values = known.along(moving, ca.vertcat(beyond, slope), np.array([t]))[:, 0]
        least = values[0]
        for gradient, v, (low, high) in zip(values[1:], model.u, boxes, strict=True):
            now = float(known.held(v.name, np.array([t]))[0])
            if gradient:
                least += min(gradient * (low - now), gradient * (high - now))
        if not least < 0.0:
            return False
    return True
