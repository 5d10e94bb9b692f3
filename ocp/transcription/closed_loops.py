"""Mechanisms with constraints phi(q, t) = 0, which hold exactly at every node, without drift.

Collocation imposes phi'' = 0 at its points. At the end of each interval the smallest correction
removes the remaining violation; its multipliers mu, nu are additional unknowns:

    q_(k+1) = q_end + phi_q' mu,   phi(q_(k+1), t) = 0
    v_(k+1) = v_end + phi_q' nu,   phi_q v_(k+1) + phi_t = 0

phi_q is evaluated at q_end, so each node is an explicit function of the preceding interval.
The user may also prescribe dependent coordinates. Those that follow from the others are released,
so that no condition is redundant.

Source: Gear, Leimkuhler and Gupta, J. Comput. Appl. Math. 12/13, 1985, 77-90 (constraints on two
levels); Ascher and Petzold, SIAM J. Numer. Anal. 28, 1991, 1097-1120 (projected collocation).
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple, final

import casadi as ca
import numpy as np

from ocp.formulation.phase import Box, Span, fixed, initial, meet
from ocp.transcription.blocks import Array, Piece, RowBlock, Rows, block
from ocp.transcription.unknowns import Grid, LocalUnknowns, SpanPoints
from symfric.foundation.checks import listed
from symfric.model.parts import Holonomic

RANK = 1e-8
"""Relative size below which a singular value counts as zero."""
STEPS, ITERATIONS = 20, 30
"""Continuation steps from the start of a model to named coordinates, and iterations of each."""
FINE, NEAR = 4, 5
"""Continuation steps and iterations from one point of a motion to the next."""


@final
class Loops:
    """Numerical constraints of a phase, scaled by nominal coordinates."""

    def __init__(self, span: Span, mechanics: Holonomic, begin: float, free: bool) -> None:
        """Create constraints from the time `begin` [s]; `free` if start or end time are free."""
        self.span, self.n, self.begin = span, mechanics.n, begin
        p = {v.name: float(x) for v, x in zip(span.model.p, span.p, strict=True)}
        self.start = span.model.initial_state(None, p)[: self.n]
        q, t, p = span.model.vector("x")[: self.n], span.model.t, span.model.vector("p")
        phi = mechanics.phi
        outputs = [phi, ca.jacobian(phi, q), ca.jacobian(phi, t)]
        self._function = ca.Function("loops", [q, t, p], [ca.densify(part) for part in outputs])
        self.nominal = span.model.nominal("x")[: self.n]
        self.sizes = np.ones(phi.numel())
        A = np.abs(self.at(self.start, 0.0)[1]).max(axis=1)
        self.sizes = np.where(A > 0, A, 1.0)
        chosen = [v.symbol for v in span.model.p if v.name in span.chosen]
        unknown = [*chosen, *([t] if free else [])]
        self.open = bool(unknown) and bool(ca.depends_on(phi, ca.vertcat(*unknown)))

    def at(self, q: Array, t: float) -> tuple[Array, Array, Array]:
        """Return phi (m,), phi_q (m, n) and phi_t (m,), scaled, `t` [s] after the start."""
        values = self._function(q, self.begin + t, self.span.p)
        phi, slope, rate = (np.array(part) for part in values)
        slope = slope * self.nominal / self.sizes[:, None]
        return phi.ravel() / self.sizes, slope, rate.ravel() / self.sizes

    def closed(self, q: Array, held: Sequence[int], t: float) -> tuple[Array, float]:
        """Return coordinates on the constraints with those `held` as in q, and the residual.

        Gauss-Newton steps of least norm are combined with continuation from the start of the model.
        The residual is the largest remaining one of the constraints.
        """
        now = self._towards(self.start, q, held, t, (STEPS, ITERATIONS))
        return now, float(np.abs(self.at(now, t)[0]).max())

    def follow(self, x: Array, times: Array, lead: Sequence[int]) -> Array:
        """Return coordinates and rates x (2 n, points) moved onto the constraints, point by point.

        As many of the coordinates `lead` as the constraints leave free keep their values; earlier
        ones have priority.
        """
        n, moved, now = self.n, x.copy(), self.start
        for k, t in enumerate(times.tolist()):
            spare = dependent(self.at(now, t)[1], lead, (), ()) or ()
            held = [i for i in lead if i not in spare]
            now = self._towards(now, x[:n, k], held, t, (FINE, NEAR))
            free = np.setdiff1d(np.arange(n), held)
            _, A, A_t = self.at(now, t)
            v = x[n:, k] / self.nominal
            v[free] += np.linalg.lstsq(A[:, free], -A @ v - A_t, rcond=RANK)[0]
            moved[:n, k], moved[n:, k] = now, v * self.nominal
        return moved

    def _towards(
        self, start: Array, q: Array, held: Sequence[int], t: float, pace: tuple[int, int]
    ) -> Array:
        """Return `start` with the `held` values of q, and other coordinates on the constraints."""
        free = np.setdiff1d(np.arange(self.n), held)
        now, begin = start.copy(), start[list(held)]
        for s in np.linspace(0.0, 1.0, pace[0] + 1)[1:]:
            now[list(held)] = (1 - s) * begin + s * q[list(held)]
            for _ in range(pace[1] if free.size else 0):
                phi, A, _ = self.at(now, t)
                if np.abs(phi).max() < 1e-13:
                    break
                change = np.linalg.lstsq(A[:, free], -phi, rcond=RANK)[0]
                largest = float(np.abs(change).max())
                now[free] += change * self.nominal[free] * min(1.0, 1.0 / max(largest, 1e-300))
                if largest < 1e-14:
                    break
        return now


def dependent(
    A: Array, given: Sequence[int], plain: Sequence[int], strict: Sequence[int]
) -> list[int] | None:
    """Return the fewest columns of A to release so that all rows can be satisfied.

    Columns `plain` are released before those `given`, and columns `strict` never. Return None if
    these columns are not sufficient.
    """
    u, s, _ = np.linalg.svd(A, full_matrices=False)
    rank, size = int((s > RANK * s[0]).sum()), float(s[0])
    rest = u[:, :rank].T @ A  # independent rows
    basis = np.zeros((rank, 0))
    free = [i for i in range(A.shape[1]) if i not in {*given, *plain, *strict}]
    if free and rank:
        u, s, _ = np.linalg.svd(rest[:, free], full_matrices=False)
        basis = u[:, s > RANK * size]
    released: list[int] = []
    for candidates in (plain, given):
        left = list(candidates)
        while basis.shape[1] < rank and left:
            beyond = rest[:, left] - basis @ (basis.T @ rest[:, left])
            norms = np.linalg.norm(beyond, axis=0)
            best = int(np.argmax(norms))
            if norms[best] <= RANK * size:
                break
            basis = np.column_stack([basis, beyond[:, best] / norms[best]])
            released.append(left.pop(best))
    return released if basis.shape[1] == rank else None


CLOSED = 1e-7
"""Largest residual of the constraints for consistent coordinates, scaled by nominal coordinates.
Numbers given by users have six digits or more."""
BRANCH = 0.1
"""Largest change of dependent named coordinates during the solve, relative to nominal ones. Beyond
it the loops might close in another configuration."""


class Known(NamedTuple):
    """Prescribed coordinates, or rates, at a node with conditions.

    Attributes:
        released: prescribed states that follow from others -> the range that replaces their
            value.
        imposed: True if the constraints are rows there, False if they follow from links.
    """

    released: Mapping[int, Box]
    imposed: bool = True


class Closing(NamedTuple):
    """Constraints of a phase.

    Attributes:
        local: unknowns of the phase.
        loops: numerical constraints.
        correction: terms of the multipliers in the rows of the gaps, for all states.
        levels: phi and its rate, scaled.
        known: fraction of T -> prescribed coordinates and rates there.
    """

    local: LocalUnknowns
    loops: Loops
    correction: RowBlock
    levels: tuple[RowBlock, RowBlock]
    known: Mapping[float, tuple[Known, Known]]

    @property
    def m(self) -> int:
        """Number of constraints."""
        return self.loops.sizes.size

    @property
    def released(self) -> dict[float, dict[int, Box]]:
        """Fraction of T -> released states there -> the range that replaces their value."""
        return {at: {**q.released, **v.released} for at, (q, v) in self.known.items()}

    def consistent(self, points: SpanPoints, nodes: Array, inner: Array) -> SpanPoints:
        """Return `points` moved onto the constraints, at fractions of T of nodes and inner points.

        Coordinates prescribed at ends and via points keep their values if the constraints permit.
        """
        span, n = self.local.span, self.loops.n
        held: dict[int, None] = {}
        for at, (q, _) in [*self.known.items()][::-1]:  # the start has the lowest priority
            boxes = [span.nodes[at][v.name] for v in span.model.x[:n]]
            held |= {i: None for i in range(n) if fixed(boxes[i]) and i not in q.released}
        times = np.concatenate([nodes, inner])
        order = np.argsort(times, kind="stable")
        x = np.hstack([points.nodes, points.inner])
        x[: 2 * n, order] = self.loops.follow(x[: 2 * n, order], times[order] * points.T, [*held])
        return replace(points, nodes=x[:, : nodes.size], inner=x[:, nodes.size :])

    def corrected(self, gap: Piece, grid: Grid) -> Piece:
        """Return the piece of the gaps with the corrections of all intervals."""
        own, d = grid.layout.spans[self.local.number], grid.scheme.degree
        columns = own.ends(grid.scheme), own.z[:, d - 1 :: d], own.u
        return self.local.piece(
            grid, gap.rows, self.correction, columns, (gap.interval, gap.offset), gap.order,
            extra=[own.extra[: 2 * self.m]], linear=gap.linear,
        )  # fmt: skip

    def pieces(self, grid: Grid) -> Iterator[Piece]:
        """Yield the constraints on both levels at all nodes; for shooting only at the first one.

        The steps of an integrator satisfy the constraints at the other nodes.
        """
        number = self.local.number
        own, nodes = grid.layout.spans[number], grid.nodes[number]
        for level, what in enumerate(("loop", "rate of loop")):
            implied = {nodes[at] for at, known in self.known.items() if not known[level].imposed}
            every = range(own.intervals + 1 if grid.scheme.degree else 1)
            at = np.array([k for k in every if k not in implied], dtype=np.int64)
            if not at.size:
                continue
            interval, offset = np.maximum(at - 1, 0), np.minimum(at, 1).astype(float)
            z = np.tile(own.z[:, :1], (1, at.size))  # not in the constraints
            rows = Rows.zero([f"the {what} {i + 1}" for i in range(self.m)], self.loops.sizes)
            columns, order = (
                (own.nodes[:, at], z, own.u[:, interval]),
                Piece.order_of(number, at, 1),
            )
            place = interval, offset
            yield self.local.piece(grid, rows, self.levels[level], columns, place, order)


def closing(
    local: LocalUnknowns,
    mechanics: Holonomic,
    before: Span | None,
    periodic: Sequence[str],
    named: Collection[str],
) -> Closing:
    """Return the constraints of a phase.

    Args:
        local: unknowns of the phase.
        mechanics: equations of its mechanism, with constraints.
        before: previous phase in the same scenario; None for the first one.
        periodic: periodic states of the problem if this is the first phase.
        named: states with a start given by the user; others are released if constraints require it.

    Raises:
        ValueError: named coordinates do not satisfy the constraints, or links prescribe more
            states than the constraints leave free.
    """
    span, n, x = local.span, mechanics.n, local.span.model.vector("x")
    slope = ca.jacobian(mechanics.phi, x[:n])
    rate = slope @ x[n : 2 * n] + ca.jacobian(mechanics.phi, span.model.t)
    phi, phi_dot, phi_q = ca.Function(
        "constraints", span.symbols, [ca.densify(part) for part in (mechanics.phi, rate, slope)]
    ).call(local.values)
    begin = sum(initial(s.T) for _, s in local.before)
    loops = Loops(span, mechanics, begin, local.free or bool(local.free_before))
    m, size, nominal = loops.sizes.size, ca.DM(loops.sizes), span.model.nominal("x")
    multipliers = ca.SX.sym("multipliers", 2 * m)
    moved = [
        -(phi_q @ ca.diag(ca.DM(nominal[k * n : (k + 1) * n])) / ca.repmat(size, 1, n)).T
        @ multipliers[k * m : (k + 1) * m]
        for k in (0, 1)
    ]
    rows = ca.vertcat(*moved, ca.SX(len(span.model.x) - 2 * n, 1))
    correction = block("correction", ca.vertcat(local.v, multipliers), local.theta, rows)
    positions = block("loops", local.v, local.theta, phi / size)
    rates = block("loop_rates", local.v, local.theta, phi_dot / size)
    known = {at: _known(span, loops, at, before, periodic, named) for at in span.nodes}
    return Closing(local, loops, correction, (positions, rates), known)


def _known(
    span: Span, loops: Loops, at: float, before: Span | None, periodic: Sequence[str],
    named: Collection[str],
) -> tuple[Known, Known]:  # fmt: skip
    """Return the prescribed coordinates and the prescribed rates at the fraction `at` of T."""
    n, names = loops.n, [v.name for v in span.model.x]
    boxes = [span.nodes[at][name] for name in names]
    held = [i for i in range(2 * n) if fixed(boxes[i])]
    linked = _linked(span, before, periodic, names) if at == 0.0 else {}
    default = [i for i in held if at == 0.0 and before is None and names[i] not in named]
    t = at * initial(span.T)
    target = np.array([box[0] if fixed(box) else 0.0 for box in boxes])
    own = [i for i in held if i < n]
    q, off = loops.closed(target[:n], own, t)
    if off > CLOSED and default:
        own = [i for i in own if i not in default]
        q, off = loops.closed(target[:n], own, t)
    if off > CLOSED and not loops.open:
        raise ValueError(_inconsistent(span, at, [names[i] for i in own], off))
    _, A, A_t = loops.at(q, t)
    levels: list[Known] = []
    for level, what in enumerate(("coordinates", "rates")):
        if all(linked.get(i, False) for i in range((level + 1) * n)):
            levels.append(Known({}, imposed=False))  # implied by links of all states
            continue
        inside, offset = range(level * n, (level + 1) * n), level * n
        plain = [i - offset for i in inside if linked.get(i) is True or i in default]
        given = [i - offset for i in held if i in inside and i - offset not in plain]
        strict = [i - offset for i in inside if linked.get(i) is False]
        released = dependent(A, given, plain, strict)
        if released is None:
            raise ValueError(
                f"{span.name}: link: expected at most {n - np.linalg.matrix_rank(A)} expressions "
                f"for {what} of a mechanism with loops, got {len(strict)}; name independent ones, "
                "the others follow from the constraints"
            )
        ranges: dict[int, Box] = {}
        for i in (i + offset for i in released):
            ranges[i] = span.boxes[names[i]]
            if i in own:  # loops may close in several configurations: keep the named one
                around = BRANCH * loops.nominal[i]
                ranges[i] = meet(ranges[i], (target[i] - around, target[i] + around))
        levels.append(Known(ranges))
    stated = [i for i in held if i not in default]
    if off := _rate_error(span, loops, (A, A_t), stated, target):
        raise ValueError(_inconsistent(span, at, [names[i] for i in stated if i >= n], off))
    return levels[0], levels[1]


def _linked(
    span: Span, before: Span | None, periodic: Sequence[str], names: Sequence[str]
) -> dict[int, bool]:
    """Return index of a linked state -> True for a link to the same state, False otherwise."""
    if before is None:
        return {names.index(name): True for name in periodic}
    return {
        names.index(link.state): before.same_state(link.expression) == link.state
        for link in span.links
    }


def _rate_error(
    span: Span, loops: Loops, rows: tuple[Array, Array], held: Sequence[int], target: Array
) -> float:
    """Return the residual of inconsistent rates at known coordinates; 0 if they are consistent."""
    (A, A_t), n = rows, loops.n
    known = [i for i in held if i >= n]
    free_q = [i for i in range(n) if i not in held]
    if loops.open or np.linalg.matrix_rank(A[:, free_q], RANK) < len(free_q):
        return 0.0  # the coordinates are not known
    nominal = span.model.nominal("x")
    scaled = A * nominal[n : 2 * n] / loops.nominal
    imposed = scaled[:, [i - n for i in known]] @ (target[known] / nominal[known])
    right = -A_t - imposed
    free_v = [i for i in range(n) if i + n not in known]
    change = np.linalg.lstsq(scaled[:, free_v], right, rcond=RANK)[0] if free_v else np.zeros(0)
    off = float(np.abs(scaled[:, free_v] @ change - right).max())
    return off if off > CLOSED * max(1.0, float(np.abs(imposed).max(initial=0.0))) else 0.0


def _inconsistent(span: Span, at: float, names: Sequence[str], off: float) -> str:
    place = {0.0: "start", 1.0: "end"}.get(at, f"via {at:g}")
    return (
        f"{span.name}: {place}: expected values that satisfy the constraints of the mechanism, got "
        f"{listed(names)}, with a residual of {off:.2g}; name only independent ones, the "
        "others follow"
    )
