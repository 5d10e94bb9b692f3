"""Mechanisms with constraints phi(q, t) = 0: they hold exactly at every node, so nothing drifts.

Collocation keeps phi'' = 0 at its points; what this leaves is taken away at the end of each
interval by the smallest correction, with multipliers mu, nu as further unknowns:

    q_(k+1) = q_end + phi_q' mu,   phi(q_(k+1), t) = 0
    v_(k+1) = v_end + phi_q' nu,   phi_q v_(k+1) + phi_t = 0

phi_q is taken at q_end, which makes a node an explicit function of the interval before. Coordinates
may be named wherever values are asked for, dependent ones too: those that follow from the others
are set free again, so that no condition stands twice.

Source: Gear, Leimkuhler and Gupta, J. Comput. Appl. Math. 12/13, 1985, 77-90 (constraints on two
levels); Ascher and Petzold, SIAM J. Numer. Anal. 28, 1991, 1097-1120 (projected collocation).
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import final

import casadi as ca
import numpy as np

from ocp.formulation.bounds import Box, Free, fixed, meet
from ocp.formulation.phase import Span
from ocp.transcription.blocks import Array, Block, Indices, Piece, block, order_of, select
from ocp.transcription.local import Data, Local
from ocp.transcription.loops import RANK, Loops, dependent
from ocp.transcription.points import Layout, SpanPoints
from ocp.transcription.schemes import Coefficients
from symfric.foundation.checks import listed

CLOSED = 1e-7
"""How far constraints may be off where named coordinates are said to satisfy them, over the change
by nominal coordinates; numbers that users write down have six digits or more."""
BRANCH = 0.1
"""How far named coordinates that follow from others may be off on the way to the solution, over
nominal ones: beyond that the loops might close in another way."""


@final
@dataclass(frozen=True, eq=False)
class Known:
    """What is known of the coordinates, or of the rates, at a node with conditions.

    Attributes:
        asked: whether the constraints are rows there; not where they follow from links.
        released: states that are named and follow from others, and the range they get instead of
            their value.
    """

    asked: bool = True
    released: Mapping[int, Box] = field(default_factory=dict[int, Box])


@final
@dataclass(frozen=True, eq=False)
class Closing:
    """Constraints of a span.

    Attributes:
        local: its unknowns.
        loops: numbers of the constraints.
        m: number of constraints.
        correction: rows of the gaps that hold the multipliers, for all states.
        levels: phi and its rate, scaled.
        scale: SI values of phi, of its rate divided by the rows.
        known: fraction of T -> what is known there of q, of v.
    """

    local: Local
    loops: Loops
    m: int
    correction: Block
    levels: tuple[Block, Block]
    scale: Array
    known: Mapping[float, tuple[Known, Known]]

    @property
    def released(self) -> dict[float, dict[int, Box]]:
        """Fraction of T -> states whose values are not asked for there -> range instead."""
        return {at: {**q.released, **v.released} for at, (q, v) in self.known.items()}

    def consistent(self, points: SpanPoints, nodes: Array, inner: Array) -> SpanPoints:
        """`points` moved onto the constraints, at fractions of T of the nodes and between them.

        Coordinates with values at ends and via points lead, the others follow without a leap.
        """
        span, n = self.local.span, self.loops.n
        held: dict[int, None] = {}
        for at, (q, _) in [*self.known.items()][::-1]:  # the start is the least of the user's
            boxes = [span.nodes[at][v.name] for v in span.model.x[:n]]
            held |= {i: None for i in range(n) if fixed(boxes[i]) and i not in q.released}
        times = np.concatenate([nodes, inner])
        order = np.argsort(times, kind="stable")
        x = np.hstack([points.nodes, points.inner])
        x[: 2 * n, order] = self.loops.follow(x[: 2 * n, order], times[order] * points.T, [*held])
        return replace(points, nodes=x[:, : nodes.size], inner=x[:, nodes.size :])

    def corrections(
        self, layout: Layout, x: tuple[Indices, Array], scheme: Coefficients, data: Data
    ) -> dict[str, object]:
        """Fields of the `Piece` of the gaps: its block at all intervals, whose states end at x."""
        own = layout.spans[self.local.number]
        interval, d = np.arange(own.intervals), scheme.degree
        z = own.z[:, d - 1 :: d]
        parts = self.local.columns(layout, x, z, own.u, own.intervals)
        one, zero = np.ones(own.intervals), np.zeros(own.intervals)
        return {
            "block": self.correction,
            "selection": select([*parts, own.extra], own.intervals),
            "theta": data.theta(interval, one, zero),
        }

    def pieces(
        self, layout: Layout, data: Data, nodes: Mapping[float, int], everywhere: bool
    ) -> list[Piece]:
        """Constraints at the nodes, on both levels; at the first one unless `everywhere`.

        The steps of an integrator end on the constraints.
        """
        number = self.local.number
        own = layout.spans[number]
        found: list[Piece] = []
        for level, what in enumerate(("loop", "rate of loop")):
            dropped = {nodes[at] for at, known in self.known.items() if not known[level].asked}
            every = range(own.intervals + 1 if everywhere else 1)
            at = np.array([k for k in every if k not in dropped], dtype=np.int64)
            if not at.size:
                continue
            interval, offset = np.maximum(at - 1, 0), np.minimum(at, 1).astype(float)
            z = np.tile(own.z[:, :1], (1, at.size))  # not in the constraints
            parts = self.local.columns(layout, own.nodes[:, at], z, own.u[:, interval], at.size)
            zeros = np.zeros(self.m)
            found.append(
                Piece(
                    names=tuple(f"the {what} {i + 1}" for i in range(self.m)),
                    scale=self.scale,
                    lower=zeros,
                    upper=zeros,
                    order=order_of(number, at, 1),
                    span=number,
                    interval=interval,
                    offset=offset,
                    block=self.levels[level],
                    selection=select(parts, at.size),
                    theta=data.theta(interval, offset, np.zeros(at.size)),
                )
            )
        return found


def closing(
    local: Local, before: Span | None, periodic: Sequence[str], named: Collection[str]
) -> Closing | None:
    """The constraints of a span; None where there are none.

    Args:
        before: the span before it in the same scenario.
        periodic: states that end the problem as they start it, where this is its first span.
        named: states whose start the user names; others give way where the constraints ask for it.

    Raises:
        ValueError: named coordinates that do not satisfy the constraints, or links that ask for
            more than they leave open.
    """
    span, mechanics = local.span, local.span.model.holonomic
    if mechanics is None or not mechanics.phi.numel():
        return None
    n, m = mechanics.n, mechanics.phi.numel()
    q, v = (span.model.vector("x")[part] for part in (slice(0, n), slice(n, 2 * n)))
    slope = ca.jacobian(mechanics.phi, q)
    rate = slope @ v + ca.jacobian(mechanics.phi, span.model.t)
    phi, phi_dot, phi_q = ca.Function(
        "constraints", span.symbols, [ca.densify(part) for part in (mechanics.phi, rate, slope)]
    ).call(local.values)
    begin = sum(T.start if isinstance(T := s.T, Free) else T for _, s in local.before)
    loops = Loops(span, mechanics, begin, local.free or bool(local.free_before))
    size = loops.sizes
    nominal = span.model.nominal("x")
    multipliers = ca.SX.sym("multipliers", 2 * m)
    W_q, W_v = (phi_q @ ca.diag(ca.DM(nominal[part])) for part in (slice(n), slice(n, 2 * n)))
    moved = ca.vertcat(
        -(W_q / ca.repmat(ca.DM(size), 1, n)).T @ multipliers[:m],
        -(W_v / ca.repmat(ca.DM(size), 1, n)).T @ multipliers[m:],
        ca.SX(len(span.model.x) - 2 * n, 1),
    )
    return Closing(
        local=local,
        loops=loops,
        m=m,
        correction=block("correction", ca.vertcat(local.v, multipliers), local.theta, moved),
        levels=(
            block("loops", local.v, local.theta, phi / ca.DM(size)),
            block("loop_rates", local.v, local.theta, phi_dot / ca.DM(size)),
        ),
        scale=size,
        known={at: _known(span, loops, at, before, (periodic, named)) for at in span.nodes},
    )


def _known(
    span: Span,
    loops: Loops,
    at: float,
    before: Span | None,
    start: tuple[Sequence[str], Collection[str]],
) -> tuple[Known, Known]:
    """What is known at a node, and which of it follows from the rest.

    `start` is periodic and named states of the start.
    """
    n, names = loops.n, [v.name for v in span.model.x]
    boxes = [span.nodes[at][name] for name in names]
    held = [i for i in range(2 * n) if fixed(boxes[i])]
    first = at == 0.0 and before is None
    linked = _linked(span, before, start[0], names) if at == 0.0 else {}
    default = [i for i in held if first and names[i] not in start[1]]
    T = span.T.start if isinstance(span.T, Free) else span.T
    target = np.array([low if fixed((low, high)) else 0.0 for low, high in boxes])
    own = [i for i in held if i < n]
    q, off = loops.closed(target[:n], own, at * T)
    if off > CLOSED and default:
        own = [i for i in own if i not in default]
        q, off = loops.closed(target[:n], own, at * T)
    if off > CLOSED and not loops.open:
        raise ValueError(_inconsistent(span, at, [names[i] for i in own], off))
    _, A, A_t = loops.at(q, at * T)
    found: list[Known] = []
    for level in range(2):
        inside = range(level * n, (level + 1) * n)
        if all(linked.get(i, False) for i in range((level + 1) * n)):
            found.append(Known(asked=False))  # rates are those of the same coordinates
            continue
        given = [i - level * n for i in held if i in inside]
        plain = [i - level * n for i in inside if linked.get(i) is True or i in default]
        given = [i for i in given if i not in plain]
        strict = [i - level * n for i in inside if linked.get(i) is False]
        released = dependent(A, given, plain, strict)
        if released is None:
            raise ValueError(
                f"{span.name}: link: expected at most {n - np.linalg.matrix_rank(A)} expressions "
                f"for {'rates' if level else 'coordinates'} of a mechanism with loops, got "
                f"{len(strict)}; name independent ones, the others follow from the constraints"
            )
        ranges: dict[int, Box] = {}
        for i in (i + level * n for i in released):
            ranges[i] = span.box(names[i])
            if i in own:  # loops close in more than one way: this is the one that was named
                around = BRANCH * loops.nominal[i]
                ranges[i] = meet(ranges[i], (target[i] - around, target[i] + around))
        found.append(Known(released=ranges))
    asked = [i for i in held if i not in default]
    _check_rates(span, at, names, (A, A_t), asked, target, loops)
    return found[0], found[1]


def _linked(
    span: Span, before: Span | None, periodic: Sequence[str], names: Sequence[str]
) -> dict[int, bool]:
    """Number of a state at the start -> whether it is a state at another node, or an expression."""
    if before is None:
        return {names.index(name): True for name in periodic}
    known = {v.name: v.symbol for v in before.model.x}
    return {
        names.index(link.state): link.state in known
        and bool(ca.is_equal(link.expression, known[link.state]))
        for link in span.links
    }


def _check_rates(
    span: Span,
    at: float,
    names: Sequence[str],
    rows: tuple[Array, Array],
    held: Sequence[int],
    target: Array,
    loops: Loops,
) -> None:
    """Refuse rates that no motion through known coordinates has."""
    (A, A_t), n = rows, loops.n
    known = [i for i in held if i >= n]
    free_q = [i for i in range(n) if i not in held]
    if loops.open or np.linalg.matrix_rank(A[:, free_q], RANK) < len(free_q):
        return  # the coordinates are not known
    scaled = A * span.model.nominal("x")[n : 2 * n] / loops.nominal
    fixed_part = scaled[:, [i - n for i in known]] @ (
        target[known] / span.model.nominal("x")[known]
    )
    free_v = [i for i in range(n) if i + n not in known]
    right = -A_t - fixed_part
    change = np.linalg.lstsq(scaled[:, free_v], right, rcond=RANK)[0] if free_v else np.zeros(0)
    off = float(np.abs(scaled[:, free_v] @ change - right).max())
    if off > CLOSED * max(1.0, float(np.abs(fixed_part).max(initial=0.0))):
        raise ValueError(_inconsistent(span, at, [names[i] for i in known], off))


def _inconsistent(span: Span, at: float, names: Sequence[str], off: float) -> str:
    place = {0.0: "start", 1.0: "end"}.get(at, f"via {at:g}")
    return (
        f"{span.name}: {place}: expected values that satisfy the constraints of the mechanism, got "
        f"{listed(names)}, with which they are off by {off:.2g}; name independent ones only, the "
        "others follow"
    )
