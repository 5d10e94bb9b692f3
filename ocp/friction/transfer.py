"""Models of arcs, motions taken over to them by name and time, and their sequence of modes."""

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
stop one: with none it would only graze rest, and the least deviation lets it slip on."""

FIRST = "_first_"
PULLED = "_pull"
CAUGHT = "_catch"
STOPPED = "_stop"
LEFT = "rest_left"
"""State of an arc at whose end a contact leaves rest: the time that is left of it [s]."""


def breaks_away(span: Span) -> bool:
    """Whether some contact breaks away or is caught at the start of an arc."""
    return any(name.endswith((PULLED, CAUGHT)) for name in span.model.outputs)


def carrier(model: Model, contact: Contact) -> tuple[str, int] | None:
    """The state that is zero when `contact` rests, and the side to which it grows with the slip.

    None where slip is not a multiple of one state.
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
    """The mode model of `modes` with what the conditions of an arc are about as outputs.

    Args:
        model: the user's.
        modes: of all contacts that can rest.
        released: contacts that break away at the start of the arc.
        leaving: contacts that leave rest at its end by a force that cannot jump, and to which side.
        caught: contacts that come to rest at its start under a control that may jump, and to which
            side they slipped until then.
        stopped: the same of all contacts that come to rest.
        sizes: contact -> typical static level [N].
        margin: share of the level that a rest keeps away from it, and how long before the end of
            the arc it begins to give that up where it leaves [s].

    Returns:
        One with "<contact>_slip"; as shares of the level "<contact>_up" and "<contact>_down", the
        room of a rest to both sides, less margin times tanh (time left / that time)^2 where it
        leaves; "<contact>_first_up" and "<contact>_first_down", the same for what states and inputs
        at the start of an interval ask for; "<contact>_pull", excess of what is released; and
        "<contact>_catch", room below the force of sliding back of what is caught, "<contact>_stop"
        below that of sliding on of what is stopped.
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
    """`model` with the time that is left as a state, and its symbol."""
    left = Variable(LEFT, "s", nominal=0.1)
    return replace(model, **further_states(model, (left,), ca.SX(-1.0))), left.symbol


Array = NDArray[np.float64]
SHORT_RUN = 5e-3
"""Share of the whole duration below which a run counts to its neighbours."""
NEW_REST = 2.5e-3
"""Share of the whole duration that a rest has where it is put into a sequence."""


@final
@dataclass(frozen=True, eq=False)
class Known:
    """What is known of a motion over its whole time.

    Attributes:
        motion: signals at times, and inputs held from times on.
        p: values of parameters, by name.
        chosen: of those that were chosen.
    """

    motion: Motion
    p: Mapping[str, float]
    chosen: Mapping[str, float]

    def signal(self, name: str, t: Array) -> Array:
        """Values at times, on straight lines between the known ones; zero where nobody knows."""
        values = self.motion.signals.get(name, np.zeros(0))
        known = np.isfinite(values)
        if not known.any():
            return np.zeros(t.size)
        return np.interp(t, self.motion.t[known], values[known])

    def held(self, name: str, t: Array) -> Array:
        """An input at times."""
        values = self.motion.controls.get(name)
        if values is None:  # a state there: an input with bounded rate
            return self.signal(name, t)
        at = np.searchsorted(self.motion.t_control, t, side="right") - 1
        found = values[np.maximum(at, 0)]
        return np.where(np.isfinite(found), found, 0.0)

    def along(self, model: Model, expression: ca.SX, t: Array) -> Array:
        """Values of an expression in the symbols of `model`, shape (n, times)."""
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
    """Where the solver starts: span k of `into` takes what was known while arc k lasts."""
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
    """Algebraic variables that solve their equations at the points, one step of Newton's method."""
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
    """How a motion is read.

    Attributes:
        creep: contact -> sliding velocity below which it rests.
        rests: whether rests are put in at reversals and at the ends.
    """

    creep: Mapping[str, float]
    rests: bool = True


def sequence_of(problem: Problem, known: Known, reading: Reading) -> tuple[Leg, ...]:
    """The legs of `problem` with the arcs of a motion.

    Args:
        problem: the user's, one scenario.
        known: its sharpened motion.
        reading: how fast creeping is.
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
    """Typical static level of each contact [N]: its mean over the motion."""
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
    """Contacts that do not slide at the very start."""
    model, start = problem.chain[0].model, known.motion.t[:1]
    return tuple(
        c.name
        for c in rubbing(model)
        if abs(float(known.along(model, c.slip, start)[0, 0])) < 1e-3 * creep[c.name]
    )


def _stays(problem: Problem) -> list[tuple[int, int, str]]:
    """(first phase, last phase, contact): where a contact is without a break."""
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
    """`track` with rests where something can hold the contact."""
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
    """Whether inputs within their bounds can hold a contact at a time.

    The force that this takes is affine in the inputs of most models; of others this is its tangent.
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
