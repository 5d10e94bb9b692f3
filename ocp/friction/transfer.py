"""Transfer of motions to arcs by name and time, and deduction of mode sequences from motions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite
from typing import NamedTuple, final

import casadi as ca
import numpy as np

from ocp.formulation.expressions import arguments
from ocp.formulation.phase import Array, clipped, limits
from ocp.formulation.problem import Problem
from ocp.formulation.statement import only
from ocp.friction.arcs import LEFT
from ocp.friction.mode_models import SIDES, excess, mode_model, newton
from ocp.friction.sequence import Arc, Leg, Legs, Track, cut, read, with_rests
from ocp.friction.smooth_models import sticking
from ocp.solving.motion import ScenarioMotion
from ocp.transcription.transcribe import Transcription
from ocp.transcription.unknowns import SpanPoints, Values
from symfric.model import Model

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

    motion: ScenarioMotion
    p: Mapping[str, float]
    chosen: Mapping[str, float]

    @staticmethod
    def of(problem: Problem, motion: ScenarioMotion, chosen: Mapping[str, float]) -> "Known":
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
        rows = ((model.x, self.signal), (model.z, self.signal), (model.u, self.held))
        groups = [
            np.array([take(v.name, t) for v in group]).reshape(-1, t.size) for group, take in rows
        ]
        p = model.values("p", {v.name: self.p[v.name] for v in model.p if v.name in self.p})
        function = ca.Function("along", arguments(model), [expression]).map(t.size)
        return function(t[None, :], *groups, np.tile(p[:, None], (1, t.size))).full()


def points_in(into: Transcription, arcs: Sequence[Arc], known: Known) -> Values:
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
    return Values(tuple(spans), dict(known.chosen))


@final
@dataclass(frozen=True, eq=False)
class Reader:
    """Deduction of modes from a sharpened motion.

    Attributes:
        problem: the user's problem without scenarios.
        known: motion of the problem.
    """

    problem: Problem
    known: Known

    def sequence(self, creep: Mapping[str, float], rests: bool = True) -> Legs:
        """Return the mode sequence of the motion.

        Args:
            creep: contact -> sliding velocity [m/s] below which it sticks.
            rests: True to insert stick at reversals and at the ends.
        """
        tracks = [self._track(creep, *stay) for stay in self._stays()]
        if rests:
            tracks = [self._with_rests(creep, track, tracks) for track in tracks]
        legs: list[Leg] = []
        phases = zip(self.problem.chain, self.known.motion.phases, strict=True)
        for number, (phase, when) in enumerate(phases):
            times = [when.begin + when.T * s for s in (0.0, *phase.stops, 1.0)]
            legs += [cut(tracks, (number, k), *ends) for k, ends in enumerate(pairwise(times))]
        return tuple(legs)

    def sizes(self) -> dict[str, float]:
        """Return the typical static level of each contact [N], the mean over the motion."""
        sizes: dict[str, float] = {}
        for phase in self.problem.chain:
            contacts = sticking(phase.model)
            held = mode_model(phase.model, {c.name: 0 for c in contacts})
            for contact in contacts:
                up, down = (held.expression(f"{contact.name}_grip_{s}") for s in SIDES.values())
                levels = self.known.along(held, (up + down) / 2, self.known.motion.t)
                size = float(np.mean(np.abs(levels[np.isfinite(levels)]))) if levels.size else 1.0
                sizes.setdefault(contact.name, size if isfinite(size) and size > 0 else 1.0)
        return sizes

    def starts_at_rest(self, creep: Mapping[str, float]) -> tuple[str, ...]:
        """Return the names of contacts without slip at the start."""
        t, contacts = self.known.motion.t[:1], sticking(self.problem.chain[0].model)
        return tuple(
            c.name for c in contacts if abs(self._slip(0, c.name, t)[0]) < 1e-3 * creep[c.name]
        )

    def _slip(self, number: int, name: str, t: Array) -> Array:
        """Return the sliding velocities of a contact at times in one phase."""
        model = self.problem.chain[number].model
        contact = next(c for c in model.contacts if c.name == name)
        return self.known.along(model, contact.slip, t)[0]

    def _stays(self) -> list[tuple[int, int, str]]:
        """Return (first phase, last phase, contact) for each contact over consecutive phases."""
        stays: list[tuple[int, int, str]] = []
        for number, phase in enumerate(self.problem.chain):
            for contact in sticking(phase.model):
                stay = (number, number, contact.name)
                for old in stays if not phase.link else ():
                    if old[1:] == (number - 1, contact.name):
                        stay = (old[0], number, contact.name)
                        stays.remove(old)
                        break
                stays.append(stay)
        return stays

    def _track(self, creep: Mapping[str, float], first: int, last: int, name: str) -> Track:
        t, phases = self.known.motion.t, self.known.motion.phases
        kept = (t >= phases[first].begin) & (t <= phases[last].end)
        slips = np.zeros(t.size)
        for number in range(first, last + 1):
            here = (t >= phases[number].begin) & (t <= phases[number].end)
            slips[here] = self._slip(number, name, t[here])
        return read(name, t[kept], slips[kept], creep[name], SHORT_RUN * self.known.motion.T)

    def _with_rests(
        self, creep: Mapping[str, float], track: Track, tracks: Sequence[Track]
    ) -> Track:
        """Return `track` with inserted stick where inputs can hold the contact."""
        name, phases = track.contact, self.known.motion.phases

        def phase_at(t: float) -> int:
            return next((k for k, phase in enumerate(phases) if t <= phase.end), len(phases) - 1)

        def can_rest(t: float) -> bool:
            return self._holdable(phase_at(t), name, tracks, t)

        times = track.runs[0].begin, track.runs[-1].end
        first, last = (self._slip(phase_at(t), name, np.array([t]))[0] for t in times)
        ends = abs(first) < creep[name], abs(last) < creep[name]
        return with_rests(track, can_rest, NEW_REST * self.known.motion.T, ends)

    def _holdable(self, number: int, name: str, tracks: Sequence[Track], t: float) -> bool:
        """Return True if inputs within their bounds can hold a contact at a time.

        The required force is affine in the inputs of most models, and is linearised for others.
        """
        model, span = self.problem.chain[number].model, self.problem.spans[number]
        at, modes = np.array([t]), {c.name: 0 for c in sticking(model)}
        modes |= only({track.contact: track.at(t) or 0 for track in tracks}, modes)
        for side in (1, -1):
            modes[name] = side
            moving, beyond = mode_model(model, modes), excess(model, modes, name, side)
            slope = ca.jacobian(beyond, moving.vector("u")).T
            least, *gradients = self.known.along(moving, ca.vertcat(beyond, slope), at)[:, 0]
            for gradient, v in zip(gradients, model.u, strict=True):
                if gradient:
                    now = float(self.known.held(v.name, at)[0])
                    least += min(gradient * (bound - now) for bound in span.boxes[v.name])
            if not least < 0.0:
                return False
        return True
