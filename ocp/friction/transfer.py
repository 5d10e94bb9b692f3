"""Transfer of motions to arcs by name and time, and deduction of mode sequences from motions."""

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.formulation.expressions import arguments
from ocp.formulation.phase import clipped, limits
from ocp.formulation.problem import Problem
from ocp.formulation.statement import only
from ocp.friction.arcs import LEFT
from ocp.friction.mode_models import SIDES, excess, mode_model, newton
from ocp.friction.sequence import Arc, Leg, Legs, Track, cut, read, with_rests
from ocp.friction.smooth_models import sticking
from ocp.solving.motion import Motion
from ocp.transcription.transcribe import Transcription
from ocp.transcription.unknowns import Points, SpanPoints
from symfric.model import Model

Array = NDArray[np.float64]
SHORT_RUN = 5e-3
"""Duration, relative to the total one, below which a run is merged with its neighbours."""
NEW_REST = 2.5e-3
"""Initial duration of an inserted stick interval, relative to the total duration."""


class Known(NamedTuple):
    """Known motion with its parameters.

    Attributes:
        motion: signals over time, and inputs that are constant on intervals.
        p: values of all parameters by name.
        chosen: values of the chosen parameters by name.
    """

    motion: Motion
    p: Mapping[str, float]
    chosen: Mapping[str, float]

    @staticmethod
    def of(problem: Problem, motion: Motion, chosen: Mapping[str, float]) -> "Known":
        """Return the motion with the parameters of all models of `problem`."""
        p: dict[str, float] = {}
        for span in problem.spans:
            p |= {v.name: float(x) for v, x in zip(span.model.p, span.p, strict=True)}
        return Known(motion, p | dict(chosen), chosen)

    def signal(self, name: str, t: Array) -> Array:
        """Return the values of a signal at times by linear interpolation; zeros if unknown."""
        values = self.motion.signals.get(name, np.zeros(0))
        known = np.isfinite(values)
        if not known.any():
            return np.zeros(t.size)
        return np.interp(t, self.motion.t[known], values[known])

    def held(self, name: str, t: Array) -> Array:
        """Return the values of an input at times."""
        values = self.motion.controls.get(name)
        if values is None:  # an input with bounded rate is a state
            return self.signal(name, t)
        at = np.searchsorted(self.motion.t_control, t, side="right") - 1
        found = values[np.maximum(at, 0)]
        return np.where(np.isfinite(found), found, 0.0)

    def along(self, model: Model, expression: ca.SX, t: Array) -> Array:
        """Return the values of an expression in the symbols of `model`, shape (n, times)."""
        groups = [
            np.array([take(v.name, t) for v in group]).reshape(-1, t.size)
            for group, take in (
                (model.x, self.signal),
                (model.z, self.signal),
                (model.u, self.held),
            )
        ]
        p = model.values("p", {v.name: self.p[v.name] for v in model.p if v.name in self.p})
        function = ca.Function("along", arguments(model), [expression]).map(t.size)
        return function(t[None, :], *groups, np.tile(p[:, None], (1, t.size))).full()


def points_in(into: Transcription, arcs: Sequence[Arc], known: Known) -> Points:
    """Return initial points in which phase k of `into` follows the known motion during arc k.

    Algebraic variables are improved by one step of Newton's method.
    """
    spans: list[SpanPoints] = []
    for number, (span, arc) in enumerate(zip(into.problem.spans, arcs, strict=True)):
        mesh, model, inner = into.meshes[number], span.model, into.inner_fractions(number)
        boxes = np.array([span.boxes[v.name] for v in model.x]).reshape(-1, 2, 1)

        def states(s: Array, arc: Arc = arc, model: Model = model, boxes: Array = boxes) -> Array:
            t = arc.begin + s * arc.duration
            rows = [arc.end - t if v.name == LEFT else known.signal(v.name, t) for v in model.x]
            return np.clip(np.array(rows).reshape(-1, t.size), boxes[:, 0], boxes[:, 1])

        t = arc.begin + (mesh[:-1] + mesh[1:]) / 2 * arc.duration
        u = np.array([known.held(v.name, t) for v in model.u]).reshape(-1, t.size)
        x, t = states(inner), arc.begin + inner * arc.duration
        z = np.array([known.signal(v.name, t) for v in model.z]).reshape(-1, t.size)
        if model.z:
            step = ca.Function("newton", span.symbols, [newton(model)]).map(t.size)
            held, p = np.repeat(u, t.size // u.shape[1], axis=1), np.tile(span.p[:, None], t.size)
            solved = step(t[None, :], x, z, held, p).full()
            z = np.where(np.isfinite(solved), solved, z)
        spans.append(SpanPoints(clipped(arc.duration, limits(span.T)), states(mesh), x, z, u))
    return Points(tuple(spans), dict(known.chosen))


class Reading(NamedTuple):
    """Settings for deducing modes from a motion.

    Attributes:
        creep: contact -> sliding velocity [m/s] below which it sticks.
        rests: True to insert stick at reversals and at the ends.
    """

    creep: Mapping[str, float]
    rests: bool = True


def sequence_of(problem: Problem, known: Known, reading: Reading) -> Legs:
    """Return the mode sequence of a motion of `problem`.

    Args:
        problem: the user's problem without scenarios.
        known: sharpened motion of the problem.
        reading: settings for deducing modes.
    """
    tracks = [_track(problem, known, reading, *stay) for stay in _stays(problem)]
    if reading.rests:
        tracks = [_with_rests(problem, known, reading, track, tracks) for track in tracks]
    legs: list[Leg] = []
    for number, (phase, when) in enumerate(zip(problem.chain, known.motion.phases, strict=True)):
        fractions = [0.0, *sorted(phase.via), 1.0]
        for part in range(len(fractions) - 1):
            a, b = (when.begin + when.T * s for s in fractions[part : part + 2])
            legs.append(cut(tracks, (number, part), a, b))
    return tuple(legs)


def sizes_of(problem: Problem, known: Known) -> dict[str, float]:
    """Return the typical static level of each contact [N], the mean over the motion."""
    sizes: dict[str, float] = {}
    for phase in problem.chain:
        contacts = sticking(phase.model)
        held = mode_model(phase.model, {c.name: 0 for c in contacts})
        for contact in contacts:
            up, down = (held.expression(f"{contact.name}_grip_{s}") for s in SIDES.values())
            levels = known.along(held, (up + down) / 2, known.motion.t)
            size = float(np.mean(np.abs(levels[np.isfinite(levels)]))) if levels.size else 1.0
            sizes.setdefault(contact.name, size if isfinite(size) and size > 0 else 1.0)
    return sizes


def starts_at_rest(problem: Problem, known: Known, creep: Mapping[str, float]) -> tuple[str, ...]:
    """Return the names of contacts without slip at the start."""
    t = known.motion.t[:1]
    names = (c.name for c in sticking(problem.chain[0].model))
    return tuple(n for n in names if abs(_slip(problem, known, 0, n, t)[0]) < 1e-3 * creep[n])


def _slip(problem: Problem, known: Known, number: int, name: str, t: Array) -> Array:
    """Return the sliding velocities of a contact at times in one phase."""
    model = problem.chain[number].model
    contact = next(c for c in model.contacts if c.name == name)
    return known.along(model, contact.slip, t)[0]


def _stays(problem: Problem) -> list[tuple[int, int, str]]:
    """Return (first phase, last phase, contact) for each contact over consecutive phases."""
    stays: list[tuple[int, int, str]] = []
    for number, phase in enumerate(problem.chain):
        for contact in sticking(phase.model):
            stay = (number, number, contact.name)
            for old in stays if not phase.link else ():
                if old[1:] == (number - 1, contact.name):
                    stay = (old[0], number, contact.name)
                    stays.remove(old)
                    break
            stays.append(stay)
    return stays


def _track(
    problem: Problem, known: Known, reading: Reading, first: int, last: int, name: str
) -> Track:
    t, phases = known.motion.t, known.motion.phases
    kept = (t >= phases[first].begin) & (t <= phases[last].end)
    slips = np.zeros(t.size)
    for number in range(first, last + 1):
        here = (t >= phases[number].begin) & (t <= phases[number].end)
        slips[here] = _slip(problem, known, number, name, t[here])
    return read(name, t[kept], slips[kept], reading.creep[name], SHORT_RUN * known.motion.T)


def _with_rests(
    problem: Problem, known: Known, reading: Reading, track: Track, tracks: Sequence[Track]
) -> Track:
    """Return `track` with inserted stick where inputs can hold the contact."""
    name, phases = track.contact, known.motion.phases

    def phase_at(t: float) -> int:
        return next((k for k, phase in enumerate(phases) if t <= phase.end), len(phases) - 1)

    def can_rest(t: float) -> bool:
        return _holdable(problem, phase_at(t), known, name, tracks, t)

    def resting(t: float) -> bool:
        slip = _slip(problem, known, phase_at(t), name, np.array([t]))
        return abs(float(slip[0])) < reading.creep[name]

    ends = resting(track.runs[0].begin), resting(track.runs[-1].end)
    return with_rests(track, can_rest, NEW_REST * known.motion.T, ends)


def _holdable(
    problem: Problem, number: int, known: Known, name: str, tracks: Sequence[Track], t: float
) -> bool:
    """Return True if inputs within their bounds can hold a contact at a time.

    The required force is affine in the inputs of most models, and is linearised for others.
    """
    model, span, at = problem.chain[number].model, problem.spans[number], np.array([t])
    modes = {c.name: 0 for c in sticking(model)}
    modes |= only({track.contact: track.at(t) or 0 for track in tracks}, modes)
    for side in (1, -1):
        modes[name] = side
        moving, beyond = mode_model(model, modes), excess(model, modes, name, side)
        slope = ca.jacobian(beyond, moving.vector("u")).T
        least, *gradients = known.along(moving, ca.vertcat(beyond, slope), at)[:, 0]
        for gradient, v in zip(gradients, model.u, strict=True):
            low, high = span.boxes[v.name]
            now = float(known.held(v.name, at)[0])
            if gradient:
                least += min(gradient * (low - now), gradient * (high - now))
        if not least < 0.0:
            return False
    return True
