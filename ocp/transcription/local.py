"""What a block sees of its span: scaled local unknowns, and SI values made of them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import final

import casadi as ca
import numpy as np

from ocp.formulation.bounds import Free
from ocp.formulation.phase import Span
from ocp.transcription.blocks import Array, Indices
from ocp.transcription.points import Layout
from symfric.foundation.symbols import stacked

Columns = Indices | tuple[Indices, Array]
"""(k, places) columns, or columns and weights (k, terms, places); see `blocks.select`."""


def time_scale(span: Span) -> float:
    """Magnitude of a duration that is chosen [s]."""
    return span.T.start if isinstance(span.T, Free) else 1.0


@final
@dataclass(frozen=True, eq=False)
class Local:
    """Local unknowns v and parameters theta of a span at one time, as SX symbols.

        v = (x, z, u, T if free, free time before, chosen p),  scaled but for the time before
        theta = (p, T, fixed time before, length h of the interval and the place as fractions of T,
                 quadrature weight)

    Attributes:
        number: of the span.
        span: what it is about.
        before: numbers and spans of the same scenario before it.
        choices: names of all parameters that are chosen in the problem, and their magnitudes.
        inner: whether there are collocation points, and algebraic variables with them.
    """

    number: int
    span: Span
    before: tuple[tuple[int, Span], ...]
    choices: Mapping[str, float]
    inner: bool = True
    x: ca.SX = field(init=False)
    z: ca.SX = field(init=False)
    u: ca.SX = field(init=False)
    rest: ca.SX = field(init=False)
    theta: ca.SX = field(init=False)

    def __post_init__(self) -> None:
        model = self.span.model
        for letter in "xzu":
            count = len(getattr(model, letter)) if self.inner or letter != "z" else 0
            symbol = ca.SX.sym(letter, count)
            object.__setattr__(self, letter, symbol)
        rest = self.free + bool(self.free_before) + len(self.span.chosen)
        object.__setattr__(self, "rest", ca.SX.sym("rest", rest))
        object.__setattr__(self, "theta", ca.SX.sym("theta", len(model.p) + 5))

    @property
    def free(self) -> bool:
        """Whether the duration is chosen."""
        return isinstance(self.span.T, Free)

    @property
    def free_before(self) -> list[tuple[int, Span]]:
        """Spans before it with a duration that is chosen."""
        return [(i, span) for i, span in self.before if isinstance(span.T, Free)]

    @property
    def v(self) -> ca.SX:
        """All local unknowns, SX (n, 1)."""
        return ca.vertcat(self.x, self.z, self.u, self.rest)

    @property
    def T(self) -> ca.SX:
        """Duration [s]."""
        return self.rest[0] * time_scale(self.span) if self.free else self.theta[-5]

    @property
    def h(self) -> ca.SX:
        """Length of the interval [s]."""
        return self.theta[-3] * self.T

    @property
    def weight(self) -> ca.SX:
        """Quadrature weight of the point [s]."""
        return self.theta[-1] * self.T

    @property
    def t(self) -> ca.SX:
        """Time since the start of the problem [s]."""
        t = self.theta[-4] + self.theta[-2] * self.T
        return t + self.rest[int(self.free)] if self.free_before else t

    @property
    def p(self) -> ca.SX:
        """Parameters of the model, (n_p, 1)."""
        chosen = self.span.chosen
        first = self.rest.numel() - len(chosen)
        return stacked(
            self.rest[first + chosen.index(v.name)] * self.choices[v.name]
            if v.name in chosen
            else self.theta[i]
            for i, v in enumerate(self.span.model.p)
        )

    @cached_property
    def values(self) -> list[ca.SX]:
        """[t, x, z, u, p] in SI units: arguments of Functions of the model."""
        model = self.span.model
        x, z, u = (getattr(self, letter) for letter in "xzu")
        x, u = x * ca.DM(model.nominal("x")), u * ca.DM(model.nominal("u"))
        z = z * ca.DM(model.nominal("z")) if self.inner else ca.SX.zeros(len(model.z))
        return [self.t, x, z, u, self.p]

    def columns(
        self, layout: Layout, x: Columns, z: Columns, u: Columns, places: int
    ) -> list[Columns]:
        """Parts of `blocks.select` for v, with the columns of x, z and u at `places` given."""
        parts: list[Columns] = [x, z, u] if self.inner else [x, u]
        if self.free:
            parts.append(np.full((1, places), layout.spans[self.number].T))
        if self.free_before:
            shape = (1, len(self.free_before), places)
            earlier = np.array([layout.spans[i].T for i, _ in self.free_before])
            scales = np.array([time_scale(span) for _, span in self.free_before])
            parts.append((_spread(earlier, shape), np.broadcast_to(scales[None, :, None], shape)))
        if self.span.chosen:
            names = list(self.choices)
            rows = layout.chosen[[names.index(name) for name in self.span.chosen]]
            parts.append(np.tile(rows[:, None], (1, places)))
        return parts


def _spread(values: Indices, shape: tuple[int, int, int]) -> Indices:
    return np.broadcast_to(values[None, :, None], shape)


@final
@dataclass(frozen=True, eq=False)
class Data:
    """Parameters of the program that belong to one span, MX.

    Attributes:
        p: of the model, (n_p, 1).
        T: duration, where it is fixed [s].
        before: fixed time before it [s].
        mesh: fractions of T that bound the intervals, (N + 1, 1).
    """

    p: ca.MX
    T: ca.MX
    before: ca.MX
    mesh: ca.MX

    def theta(self, interval: Indices, offset: Array, weight: Array) -> ca.MX:
        """Theta of `Local` at places `offset` of the way through an `interval`, (k, places).

        `weight` is the quadrature weight on an interval of length 1.
        """
        places = interval.size
        start = self.mesh[interval.tolist()].T
        h = self.mesh[(interval + 1).tolist()].T - start
        common = ca.repmat(ca.vertcat(self.p, self.T, self.before), 1, places)
        return ca.vertcat(common, h, start + ca.DM(offset).T * h, ca.DM(weight).T * h)
