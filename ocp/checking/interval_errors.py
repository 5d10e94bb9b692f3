"""Errors of each interval: local error, and loss of cost by inputs that are constant on it."""

from collections.abc import Iterator, Sequence
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.checking.resimulate import Arc
from ocp.transcription.blocks import Array, Entries, Indices, Piece, RowBlock
from ocp.transcription.program import Iterate, cost_weight
from ocp.transcription.schemes import Coefficients, Radau
from ocp.transcription.transcribe import Transcription
from symfric.foundation.parameters import Variable
from symfric.integrator import simulate_many
from symfric.model import Model

RTOL = 1e-6
"""Relative tolerance of the flow over one interval."""
FINER = Radau(5)
"""Scheme whose solution over one interval replaces a simulation."""
NEWTON_STEPS, CONVERGED = 8, 1e-8
"""Largest number of steps of Newton's method, and the scaled step at which it has converged."""


def estimated_errors(
    transcription: Transcription, w: Array, values: Array, arcs: Sequence[Arc]
) -> tuple[Array, ...]:
    """Return `local_errors` of the motion `w`, with collocation of order 9 as the flow.

    Newton's method solves the equations of `FINER` over all intervals at once, from the polynomials
    of the motion, with the functions of the program. Intervals in which it does not converge, as in
    friction layers much narrower than an interval, are simulated.

    Args:
        transcription: the transcription.
        w: unknowns of its program.
        values: parameters of its program.
        arcs: the motion of `w`.
    """
    found: list[Array] = []
    for number, arc in enumerate(arcs):
        ends = _collocated(transcription, w, values, number)
        unknown = np.flatnonzero(~np.isfinite(ends).all(axis=0))
        if unknown.size:
            ends[:, unknown] = _ends(arc, RTOL, unknown)
        off = np.abs(ends - arc.nodes[:, 1:]) / arc.sizes[:, None]
        found.append(np.max(off, axis=0, initial=0.0))
    return tuple(found)


def _collocated(transcription: Transcription, w: Array, values: Array, number: int) -> Array:
    """Return the states at the ends of the intervals of a phase by `FINER`, (nx, N).

    They are NaN where Newton's method does not converge, and without collocation points.
    """
    own, span = transcription.layout.spans[number], transcription.problem.spans[number]
    nx, nz, N, d = own.nodes.shape[0], own.z.shape[0], own.intervals, own.degree
    ends, equations = np.full((nx, N), np.nan), _equations(transcription, number)
    if equations is None:
        return ends
    piece, block = equations
    n = 0 if span.model.holonomic is None else span.model.holonomic.n
    first = block.n - len(span.sides) - n
    old, new = transcription.scheme.coefficients(), FINER.coefficients()
    D = new.degree
    v, theta = (a[:, ::d] for a in _at_places(piece, w, transcription.program.p, values))
    v, theta = np.repeat(v, D, axis=1), np.repeat(theta, D, axis=1)
    theta[-2] += ((new.nodes[None, 1:] - old.nodes[1]) * theta[-3].reshape(N, D)).ravel()
    to = _interpolation(old.nodes, new.nodes[1:])
    x = np.einsum("irk,rj->ikj", w[own.carrying], to)  # (nx, N, D)
    z = w[own.z].reshape(nz, N, d) @ _interpolation(old.nodes[1:], new.nodes[1:])
    motion, start = np.concatenate([x, z]), w[own.nodes[:, :-1]]
    moving = np.ones(N, dtype=bool)
    with np.errstate(all="ignore"):
        for _ in range(NEWTON_STEPS):
            at = np.flatnonzero(moving)
            step = _newton_step(
                block, (n, first), new, start[:, at], motion[:, at],
                *(a.reshape(-1, N, D)[:, at].reshape(a.shape[0], -1) for a in (v, theta)),
            )  # fmt: skip
            motion[:, at] += step
            size = np.abs(step).max(axis=(0, 2), initial=0.0)
            done = size < CONVERGED
            ends[:, at[done]] = span.model.nominal("x")[:, None] * motion[:nx, at[done], -1]
            moving[at[done | ~np.isfinite(size)]] = False
            if not moving.any():
                break
    return ends


def _newton_step(
    block: RowBlock, implicit: tuple[int, int], scheme: Coefficients, start: Array, motion: Array,
    v: Array, theta: Array,
) -> Array:  # fmt: skip
    """Return the change of states and algebraic variables at all points, (nx + nz, N, D).

    Args:
        block: equations of a collocation point.
        implicit: number of coordinates of a mechanism, whose accelerations are slopes of the
            polynomials, and index of the first of these slopes among the local unknowns.
        scheme: collocation with D points.
        start: states at the starts of the intervals, (nx, N).
        motion: states and algebraic variables at the points, (nx + nz, N, D).
        v: local unknowns, (n, N D), of which only those after the motion are used.
        theta: parameters, (k, N D).
    """
    nx, (n, N, D), (q, first) = start.shape[0], motion.shape, implicit
    velocities = np.arange(q, 2 * q)
    known = np.setdiff1d(np.arange(nx), velocities)
    slopes = np.concatenate([start[:, :, None], motion[:nx]], axis=2) @ scheme.slopes
    v[:n] = motion.reshape(n, -1)
    v[first : first + q] = slopes[velocities].reshape(q, v.shape[1])
    rows, entries = (np.array(a) for a in block.jacobian.map(N * D)(v, theta))
    rows, slope = rows[:n].reshape(n, N, D), np.zeros((n, block.n, N, D))
    for row, column, numbers in _entries(block.of_jacobian, entries, np.arange(block.n)):
        if row < n:
            slope[row, column] = numbers.reshape(N, D)
    rows[known] -= slopes[known]
    A = np.zeros((N, D, n, D, n))
    for j in range(D):
        A[:, j, :, j] = slope[:, :n, :, j].transpose(2, 0, 1)
        for k in range(D):
            factor = scheme.slopes[1 + k, j]
            A[:, j, :, k, velocities] += factor * slope[:, first : first + q, :, j].transpose(
                1, 2, 0
            )
            A[:, j, known, k, known] -= factor
    b = rows.transpose(1, 2, 0).reshape(N, D * n)
    try:
        step = np.linalg.solve(A.reshape(N, D * n, D * n), -b[:, :, None])
    except np.linalg.LinAlgError:
        step = np.full((N, D * n), np.nan)
    return np.asarray(step, dtype=float).reshape(N, D, n).transpose(2, 0, 1)


def _interpolation(nodes: Array, at: Array) -> Array:
    """Return l_r(at_j) of the polynomials through `nodes`, shape (nodes, points)."""
    found = np.linalg.solve(np.vander(nodes).T, np.vander(at, nodes.size).T)
    return np.asarray(found, dtype=float)


def local_errors(arcs: Sequence[Arc], rtol: float = RTOL) -> tuple[Array, ...]:
    """Return the local error of each interval, shape (N,), for each arc.

        e_k = max_i |flow(x_k, u_k)_i - x_(k+1),i| / size_i

    The model is simulated over each interval from its first node. All intervals are one ensemble,
    which takes 25 ms for 100 intervals. If the simulation of an interval fails, its error is inf.

    Args:
        arcs: optimised arcs.
        rtol: relative tolerance of the simulation.
    """
    return tuple(
        np.max(np.abs(_ends(arc, rtol) - arc.nodes[:, 1:]) / arc.sizes[:, None], axis=0, initial=0)
        for arc in arcs
    )


def cut_meshes(
    meshes: Sequence[Array], errors: Sequence[Array], phases: int, allowed: float, *, order: int,
    most: int,
) -> list[Array] | None:  # fmt: skip
    """Return `meshes` with inaccurate intervals divided, or None if no error exceeds `allowed`.

    An interval is divided into (error / allowed)^(1/order) parts, at least 2 and at most `most`.
    All scenarios have the same meshes.
    """
    if max((float(e.max()) for e in errors), default=0.0) <= allowed:
        return None
    made: list[Array] = []
    for number, mesh in enumerate(meshes):
        error = np.max([errors[k] for k in range(number % phases, len(meshes), phases)], axis=0)
        shares = np.where(np.isfinite(error), error / allowed, float(most) ** order)
        parts = np.clip(np.ceil(shares ** (1 / order)), 2, most)
        counts = np.where(shares > 1.0, parts, 1).astype(int)
        pieces = [
            np.linspace(low, high, n, endpoint=False)
            for low, high, n in zip(mesh[:-1], mesh[1:], counts, strict=True)
        ]
        made.append(np.concatenate([*pieces, mesh[-1:]]))
    return made


def _ends(arc: Arc, rtol: float, which: Indices | slice = slice(None)) -> Array:
    """Return the states at the ends of intervals, simulated from their starts, (nx, n)."""
    model, t_end, t_start = arc.span.model, np.diff(arc.times)[which], arc.times[:-1][which]
    local, N = _local(model), t_end.size
    p: dict[str, Any] = {name: np.full(N, x) for name, x in arc.parameters().items()}
    if local is not model:
        p |= {local.p[-1].name: t_start}
    x0 = {v.name: row[:-1][which] for v, row in zip(model.x, arc.nodes, strict=True)}
    u = {v.name: row[which] for v, row in zip(model.u, arc.u, strict=True)}
    # compilation takes longer than all passes together
    run = simulate_many(local, t_end, x0=x0, p=p, u=u, rtol=rtol, backend="vm", executor="serial")
    ends = np.array([run[v.name][:, 0] for v in model.x]).reshape(len(model.x), N)
    return np.where(np.isfinite(ends), ends, np.inf)


def _local(model: Model) -> Model:
    """Return `model` with time since the node of each member, if its equations contain time.

    For a mechanism only the explicit equations are used. Its constraints are not enforced, because
    their drift over one interval is negligible.
    """
    kept = model.memory.get("ocp local")
    if kept is None:
        kept, ode = model, ca.SX(0, 1) if model.ode is None else model.ode
        if ca.depends_on(ca.vertcat(ode, model.alg), model.t):
            taken = {v.name for group in (model.x, model.z, model.u, model.p) for v in group}
            names = (f"t_node{'_' * k}" for k in range(len(taken) + 1))
            begin = Variable(next(name for name in names if name not in taken), "s")
            ode, alg = ca.substitute([ode, model.alg], [model.t], [model.t + begin.symbol])
            x, z, u, p = model.x, model.z, model.u, (*model.p, begin)
            name = f"{model.name}_from_each_node"
            kept = Model(name, x=x, z=z, u=u, p=p, ode=ode, alg=alg, t=model.t)
        model.memory["ocp local"] = kept
    return kept


def zoh_losses(transcription: Transcription, iterate: Iterate) -> tuple[Array, ...]:
    """Estimate the reduction of J by inputs that vary within each interval, (N,) for each phase.

    The minimum principle with costates lam holds at every time for a free input, but only on
    average for an input that is constant on intervals. To second order in the length h the loss is

        E_k = sum_j w_j (H(u_k) - min_u H(u)),   H(u) = H + H_u (u - u_k) + H_uu (u - u_k)^2 / 2

    over the collocation points, with H_u and H_uu from the multipliers of the equations at each
    point. The input is limited to its bounds and to the range of its values in the neighbouring
    intervals, which matters on a singular arc (H_u = H_uu = 0) and at a switch (H_uu = 0). For a
    smooth input E_k = H_uu (u' h)^2 h / 24; at a switch, E_k of one interval falls as h^2.

    Args:
        transcription: the solved transcription.
        iterate: unknowns and multipliers of the rows at a solution.

    Returns:
        Losses of each phase in units of J; zeros without collocation points (shooting) or without
        inputs. Losses of inputs that scenarios share are assigned to the first scenario.

    Limits: the estimate requires the multipliers of a solution. For inputs in active path
    conditions it is too large by a factor of up to 4.
    """
    losses: list[Array] = []
    spans = transcription.layout.spans
    slopes = [_slopes(transcription, iterate, number) for number in range(len(spans))]
    for number, own in enumerate(spans):
        loss = np.zeros(own.intervals)
        for columns in own.u:
            sharing = [  # (span, input) pairs with the same unknowns
                (k, i)
                for k, other in enumerate(spans)
                for i, row in enumerate(other.u)
                if np.array_equal(row, columns)
            ]
            if own.degree and sharing[0][0] == number:
                H_u, H_uu = (np.sum([slopes[k][n][i] for k, i in sharing], axis=0) for n in (0, 1))
                loss += _drop(H_u, H_uu, *_reach(transcription, iterate.w, columns))
        losses.append(loss)
    return tuple(losses)


def _drop(H_u: Array, H_uu: Array, low: Array, high: Array) -> Array:
    """Return the largest decrease of H by a change in [low, high], summed over points, (N,)."""
    low, high = low[:, None], high[:, None]
    downhill = np.where(H_u > 0, low, high)
    curved = H_uu > 0
    newton = np.clip(-H_u / np.where(curved, H_uu, 1.0), low, high)
    step = np.where(curved, newton, downhill)
    change = H_u * step + H_uu * step**2 / 2
    return np.maximum(-change, 0.0).sum(axis=1)


def _reach(
    transcription: Transcription, w: Array, columns: NDArray[np.int64]
) -> tuple[Array, Array]:
    """Return the scaled permitted range of changes of an input in each interval."""
    u, program = w[columns], transcription.program
    lower, upper = program.lower_w[columns], program.upper_w[columns]
    if u.size < 2:
        return lower - u, upper - u
    beyond = np.concatenate([[2 * u[0] - u[1]], u, [2 * u[-1] - u[-2]]])
    around = np.stack([beyond[:-2], u, beyond[2:]])
    low, high = np.maximum(around.min(axis=0), lower), np.minimum(around.max(axis=0), upper)
    return np.minimum(low - u, 0.0), np.maximum(high - u, 0.0)


def _slopes(transcription: Transcription, iterate: Iterate, number: int) -> tuple[Array, Array]:
    """Return H_u and H_uu of each input at the collocation points of a phase, (nu, N, d) each."""
    own, program = transcription.layout.spans[number], transcription.program
    shape = (*own.u.shape, own.degree)
    equations = _equations(transcription, number)
    if equations is None:
        return np.zeros(shape), np.zeros(shape)
    piece, block = equations
    places = piece.places
    problem, largest = transcription.problem, transcription.skeleton.largest
    lam, sigma = iterate.lam_g[piece.at], cost_weight(problem, largest, iterate.lam_g, number)
    v, theta = _at_places(piece, iterate.w, program.p, program.values)
    inputs = own.nodes.shape[0] + own.z.shape[0] + np.arange(shape[0])
    H_u, H_uu = np.zeros((shape[0], places)), np.zeros((shape[0], places))

    def mapped(function: ca.Function, *more: ca.DM) -> Array:
        """Return the last output of a function of the block at all places."""
        return np.array(function.map(places).call([ca.DM(v), ca.DM(theta), *more])[-1])

    if block.share is not None:
        for _, j, values in _entries(block.of_slopes, mapped(block.slopes), inputs):
            H_u[j] += sigma * values
    for row, j, values in _entries(block.of_jacobian, mapped(block.jacobian), inputs):
        H_u[j] += lam[row] * values
    second = mapped(block.hessian, ca.DM(np.full((1, places), sigma)), ca.DM(lam))
    for row, j, values in _entries(block.of_hessian, second, inputs):
        if row == inputs[j]:
            H_uu[j] += values
    return H_u.reshape(shape), H_uu.reshape(shape)


def _equations(transcription: Transcription, number: int) -> tuple[Piece, RowBlock] | None:
    """Return the equations of a phase at collocation points, and their block."""
    for piece in transcription.skeleton.pieces:
        if piece.span == number and any(n.startswith("the equation of") for n in piece.names):
            return (piece, piece.block) if piece.block is not None else None
    return None


def _at_places(piece: Piece, w: Array, p: ca.MX, values: Array) -> tuple[Array, Array]:
    """Return the local unknowns and parameters of a block at all its places."""
    theta = ca.Function("theta", [p], [piece.theta])(values).full()
    if piece.block is None or piece.selection is None:
        return np.zeros((0, piece.places)), theta
    v, selection = np.zeros((piece.block.n, piece.places)), piece.selection
    np.add.at(v, selection.local, (selection.weights * w[selection.columns]).T)
    return v, theta


def _entries(
    entries: Entries, varying: Array, columns: NDArray[np.int64]
) -> Iterator[tuple[int, int, Array]]:
    """Yield (row, index into `columns`, values at all places) of each entry in `columns`."""
    values = np.empty((entries.rows.size, varying.shape[1]))
    values[entries.varying] = varying
    values[entries.still] = entries.constant[:, None]
    for e in np.flatnonzero(np.isin(entries.columns, columns)):
        yield int(entries.rows[e]), int(entries.columns[e] - columns[0]), values[e]
