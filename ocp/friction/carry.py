"""A motion taken over from one problem to another of the same length, by name and time."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.formulation.bounds import Free
from ocp.formulation.phase import Span
from ocp.friction.arc_models import LEFT
from ocp.friction.sequence import Arc
from ocp.result.motion import Motion
from ocp.transcription.transcription import Transcription
from ocp.transcription.unknowns import Points, SpanPoints
from symfric.model import Model

Array = NDArray[np.float64]


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
