"""Errors of each interval: its local error, and the cost of holding the inputs over it."""

from collections.abc import Iterator, Sequence
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.checking.resimulate import Arc
from ocp.transcription.blocks import Entries, Piece, Selection
from ocp.transcription.schemes import split
from ocp.transcription.transcription import LARGEST, Transcription
from ocp.transcription.unknowns import SpanLayout
from symfric.foundation.parameters import Variable
from symfric.integrator import simulate_many
from symfric.model import Model

Array = NDArray[np.float64]
RTOL = 1e-6
"""Relative tolerance of the flow over one interval."""


def local_errors(arcs: Sequence[Arc], rtol: float = RTOL) -> tuple[Array, ...]:
    """Return the local error of each interval, for each arc of shape (N,).

        e_k = max_i |flow(x_k, u_k)_i - x_(k+1),i| / size_i

    The model starts at each node; all intervals are simulated as one ensemble: 25 ms for 100 of
    them. An interval over which the model cannot be simulated has the error inf.

    Args:
        arcs: optimised arcs.
        rtol: relative tolerance of the simulation.
    """
    return tuple(
        np.max(np.abs(_ends(arc, rtol) - arc.nodes[:, 1:]) / arc.sizes[:, None], axis=0, initial=0)
        for arc in arcs
    )


def cut_meshes(
    meshes: Sequence[Array],
    errors: Sequence[Array],
    phases: int,
    allowed: float,
    *,
    order: int,
    most: int,
) -> list[Array] | None:
    """Return `meshes` with inaccurate intervals divided; None if no error exceeds `allowed`.

    Such intervals get (error / allowed)^(1/order) parts, 2 to `most`. Scenarios share their meshes.
    """
    if max((float(e.max()) for e in errors), default=0.0) <= allowed:
        return None
    made: list[Array] = []
    for number, mesh in enumerate(meshes):
        error = np.max([errors[k] for k in range(number % phases, len(meshes), phases)], axis=0)
        shares = np.where(np.isfinite(error), error / allowed, float(most) ** order)
        parts = np.clip(np.ceil(shares ** (1 / order)), 2, most)
        made.append(split(mesh, np.where(shares > 1.0, parts, 1).astype(int).tolist()))
    return made


def _ends(arc: Arc, rtol: float) -> Array:
    """Return the states at the end of each interval, simulated from its first node, (nx, N)."""
    model, N = arc.span.model, arc.intervals
    local = _local(model)
    p: dict[str, Any] = {name: np.full(N, x) for name, x in arc.parameters().items()}
    t_end: Any = np.diff(arc.times)
    if local is not model:
        p |= {local.p[-1].name: arc.times[:-1]}
    run = simulate_many(
        local,
        t_end,
        x0={v.name: row[:-1] for v, row in zip(model.x, arc.nodes, strict=True)},
        p=p,
        u={v.name: row for v, row in zip(model.u, arc.u, strict=True)},
        rtol=rtol,
        backend="vm",  # compilation takes longer than all passes together
        executor="serial",
    )
    ends = np.array([run[v.name][:, 0] for v in model.x]).reshape(len(model.x), N)
    return np.where(np.isfinite(ends), ends, np.inf)


def _local(model: Model) -> Model:
    """Return `model` with time relative to the start of each member, if its equations need time.

    For a mechanism only the explicit equations are used: its constraints are not enforced over an
    interval, whose drift is below all relevant errors.
    """
    kept = model.memory.get("ocp local")
    if kept is None:
        kept = model
        if ca.depends_on(ca.vertcat(_explicit(model), model.alg), model.t):
            kept = _from_zero(model)
        model.memory["ocp local"] = kept
    return kept


def _explicit(model: Model) -> ca.SX:
    return ca.SX(0, 1) if model.ode is None else model.ode


def _from_zero(model: Model) -> Model:
    taken = {v.name for group in (model.x, model.z, model.u, model.p) for v in group}
    names = (f"t_node{'_' * k}" for k in range(len(taken) + 1))
    begin = Variable(next(name for name in names if name not in taken), "s")
    old, new = [model.t], [model.t + begin.symbol]
    ode, alg = ca.substitute([_explicit(model), model.alg], old, new)
    return Model(
        f"{model.name}_from_each_node",
        x=model.x,
        z=model.z,
        u=model.u,
        p=(*model.p, begin),
        ode=ode,
        alg=alg,
        t=model.t,
    )


def zoh_losses(transcription: Transcription, w: Array, lam_g: Array) -> tuple[Array, ...]:
    """Estimate the reduction of J with inputs free to vary in each interval, (N,) for each phase.

    With costates lam the minimum principle requires of the input at every time what a held input
    satisfies only on average. The loss is, to second order in the length h,
    held can give on the average only. What is lost is, to second order in the length h,

        E_k = sum_j w_j (H(u_k) - min_u H(u)),   H(u) = H + H_u (u - u_k) + H_uu (u - u_k)^2 / 2

    over the collocation points, with H_u and H_uu from the multipliers of the equations at each of
    them. The input stays in its bounds and between its values in the neighbouring intervals; on a
    singular arc (H_u = H_uu = 0) and at a switch (H_uu = 0) this limits it. For a smooth input
    E_k = H_uu (u' h)^2 h / 24; at a switch it also falls as h^2, in one interval.

    Args:
        transcription: the solved transcription.
        w, lam_g: unknowns and multipliers of the rows at a solution.

    Returns:
        For each phase, in units of J; zeros without collocation points (shooting) or without
        inputs. Inputs shared by scenarios are counted with the first scenario.

    Limits: the estimate assumes multipliers of a solution; for inputs in active path conditions it
    is too large by a factor of up to 4.
    """
    losses: list[Array] = []
    layout = transcription.layout
    slopes = [_slopes(transcription, w, lam_g, i) for i in range(len(layout.spans))]
    for number, own in enumerate(layout.spans):
        loss = np.zeros(own.intervals)
        for columns in own.u:
            owners = list(_sharing(layout.spans, columns))
            if not own.degree or owners[0][0] != number:
                continue
            H_u = sum(slopes[other][0][row] for other, row in owners)
            H_uu = sum(slopes[other][1][row] for other, row in owners)
            low, high = _reach(transcription, w, columns)
            loss += _drop(np.asarray(H_u), np.asarray(H_uu), low, high)
        losses.append(loss)
    return tuple(losses)


def _sharing(
    spans: tuple[SpanLayout, ...], columns: NDArray[np.int64]
) -> Iterator[tuple[int, int]]:
    """Yield (span, input) of all inputs with the same unknowns."""
    for number, own in enumerate(spans):
        for i, other in enumerate(own.u):
            if np.array_equal(other, columns):
                yield number, i


def _drop(H_u: Array, H_uu: Array, low: Array, high: Array) -> Array:
    """Return the decrease of H from its value at 0 in [low, high], summed over the points, (N,)."""
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
    """Return the permitted range of an input around its value in each interval, scaled."""
    u, program = w[columns], transcription.program
    lower, upper = program.lower_w[columns], program.upper_w[columns]
    if u.size < 2:
        return lower - u, upper - u
    beyond = np.concatenate([[2 * u[0] - u[1]], u, [2 * u[-1] - u[-2]]])
    around = np.stack([beyond[:-2], u, beyond[2:]])
    low, high = np.maximum(around.min(axis=0), lower), np.minimum(around.max(axis=0), upper)
    return np.minimum(low - u, 0.0), np.maximum(high - u, 0.0)


def _slopes(
    transcription: Transcription, w: Array, lam_g: Array, number: int
) -> tuple[Array, Array]:
    """Return H_u and H_uu of each input at the collocation points of a phase, (nu, N, d) each."""
    own = transcription.layout.spans[number]
    nu, N, d = *own.u.shape, own.degree
    skeleton = transcription.skeleton
    mine = (i for i, piece in enumerate(skeleton.pieces) if piece.span == number)
    at = next((i for i in mine if _of_points(skeleton.pieces[i], N * d)), -1)
    piece = skeleton.pieces[at]
    if at < 0 or piece.block is None or piece.selection is None:
        return np.zeros((nu, N, 0)), np.zeros((nu, N, 0))
    block, lam = piece.block, lam_g[skeleton.assembled.at[at]]
    inputs = own.nodes.shape[0] + own.z.shape[0] + np.arange(nu)
    v = _local_unknowns(piece.selection, block.n, w)
    theta = ca.Function("theta", [skeleton.p], [piece.theta])(transcription.program.values)
    sigma, places = _weight(transcription, lam_g, number), v.shape[1]
    arguments = [ca.DM(v), ca.DM(theta)]
    H_u = np.zeros((nu, places))
    if block.share is not None:
        (dq,) = _mapped(block.slopes, places, arguments)
        for _, j, values in _entries(block.of_slopes, dq, inputs):
            H_u[j] += sigma * values
    _, dr = _mapped(block.jacobian, places, arguments)
    for row, j, values in _entries(block.of_jacobian, dr, inputs):
        H_u[j] += lam[row] * values
    arguments += [ca.DM(np.full((1, places), sigma)), ca.DM(lam)]
    (second,) = _mapped(block.hessian, places, arguments)
    H_uu = np.zeros((nu, places))
    for row, j, values in _entries(block.of_hessian, second, inputs):
        if row == inputs[j]:
            H_uu[j] += values
    return H_u.reshape(nu, N, d), H_uu.reshape(nu, N, d)


def _of_points(piece: Piece, count: int) -> bool:
    """Return True for equations at the collocation points, False for loop constraints."""
    equations = any(name.startswith("the equation of") for name in piece.names)
    return piece.block is not None and piece.places == count and equations


def _mapped(function: ca.Function, places: int, arguments: list[ca.DM]) -> list[Array]:
    """Return the outputs of a function of the block at all places."""
    return [np.array(part) for part in function.map(places).call(arguments)]


def _entries(
    entries: Entries, varying: Array, columns: NDArray[np.int64]
) -> Iterator[tuple[int, int, Array]]:
    """Yield (row, index into the columns, values at all places) of the entries in some columns."""
    values = np.empty((entries.rows.size, varying.shape[1]))
    values[entries.varying] = varying
    values[entries.still] = entries.constant[:, None]
    for e in np.flatnonzero(np.isin(entries.columns, columns)):
        yield int(entries.rows[e]), int(entries.columns[e] - columns[0]), values[e]


def _local_unknowns(selection: Selection, n: int, w: Array) -> Array:
    """Return the local unknowns at all places, (n, places)."""
    v = np.zeros((n, selection.columns.shape[0]))
    np.add.at(v, selection.local, (selection.weights * w[selection.columns]).T)
    return v


def _weight(transcription: Transcription, lam_g: Array, number: int) -> float:
    """Return the weight of a phase's cost in J: of the mean, or the multiplier of the largest."""
    problem = transcription.problem
    phases = len(problem.chain)
    if problem.kind == "mean":
        return phases / len(problem.spans)
    if problem.kind == "sum":
        return 1.0
    rows = [i for i, place in enumerate(transcription.program.rows) if place.name == LARGEST]
    return float(lam_g[rows[number // phases]])
