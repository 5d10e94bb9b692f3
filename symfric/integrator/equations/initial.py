"""Start of a run: consistent algebraic variables and the size of the first step."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.checks import listed, number
from symfric.foundation.numeric import Array, evaluate, evaluate_all
from symfric.integrator.compiled.columns import Columns
from symfric.integrator.equations.manifold import Manifold, jammed
from symfric.integrator.equations.system import System
from symfric.model import Model

ITERATIONS = 50
ASSEMBLED = 1e-12
"""Largest constraint error, relative to the largest state."""
NEAR, CONVERGED = 1e-4, 1e-10
"""Relative Newton steps below which damping is not needed, and below which Newton has converged."""

HALVINGS, MARQUARDT = 12, 200
"""Largest numbers of step lengths of damped Newton, and of Levenberg-Marquardt iterations."""
LAST_DIGITS = 1e-15
"""Relative difference of two numbers that are equal up to rounding."""
FLOOR = 10 * float(np.finfo(float).eps)
"""Smallest step relative to t: a few units in the last place of t."""
SURE = 10 * FLOOR
"""First step relative to t: large enough to be reduced once or twice."""


Follow = Callable[[Array, Array], Array | None]
"""(y, d) -> y with consistent algebraic unknowns; None if a full search is needed."""


class JammedError(ValueError):
    """Error for algebraic equations that have no valid solution because of friction."""


@final
@dataclass(frozen=True, eq=False)
class AlgebraicEquations:
    """Algebraic equations of a system, for a worker process that does not have the system.

    Attributes:
        names: names of all unknowns.
        nx: number of differential states.
        free: see `System.free`.
        constraints: see `System.constraints`.
        manifold: see `System.manifold`.
    """

    names: tuple[str, ...]
    nx: int
    free: Array
    constraints: ca.Function
    manifold: Manifold | None = None


def first_guess(system: System, model: Model, x: Array, t: float = 0.0) -> Array:
    """Return the initial guess of the unknowns, shape (..., n).

    Args:
        system: equations of `model`.
        model: model with the start values of the algebraic variables; all other unknowns start at
            zero.
        x: states, shape (..., nx).
        t: time [s].
    """
    if x.shape[-1] == system.n:
        return x.copy()
    y = np.zeros((*x.shape[:-1], system.n))
    y[..., : system.nx] = x
    starts = {v.name: number(f"model '{model.name}' {v.name}", v.start) for v in model.z}
    for i, name in enumerate(system.names[system.nx :], start=system.nx):
        y[..., i] = starts.get(name, 0.0)
    if system.timed:
        y[..., -1] = t
    return y


def consistent(
    system: System | AlgebraicEquations,
    where: str,
    y: Array,
    d: Array,
    follow: Follow | None = None,
) -> Array:
    """Return `y` with consistent algebraic unknowns, by damped Newton from the given guess.

    Args:
        system: system with the algebraic equations.
        where: start of messages.
        y, d: guess and run data.
        follow: fast update for mechanisms, tried first (`symfric.integrator.equations.blocks`).

    Raises:
        ValueError: no solution was found near the guess.
    """
    manifold = system.manifold
    if manifold is not None:
        y = _assembled(system, manifold, where, y, d)
    quick = None if follow is None else follow(y, d)
    y = _searched(system, where, y, d) if quick is None else quick
    if manifold is not None and manifold.charted:
        y = _charted(manifold, y, d)
    if manifold is not None and (cause := jammed(manifold, system.names, y, d)):
        raise JammedError(f"{where}: {cause}")
    return y


def _searched(system: System | AlgebraicEquations, where: str, y: Array, d: Array) -> Array:
    """Return `y` with consistent algebraic unknowns, by Newton, then by Levenberg-Marquardt."""
    manifold = system.manifold
    try:
        return _solved(system, where, y, d)
    except ValueError:
        if manifold is None or not manifold.applied:
            raise
    y = _descended(system, y, d)
    settled = _residual(system, y, d) <= _rounding(system, y, d)
    return y if settled else _solved(system, where, y, d)


def _solved(system: System | AlgebraicEquations, where: str, y: Array, d: Array) -> Array:
    """Return `y` with consistent algebraic unknowns, by damped Newton."""
    rows, along = _moved(system)
    if not rows.size:
        return y
    y, last = y.copy(), np.inf
    for _ in range(ITERATIONS):
        g, J = evaluate_all(system.constraints, y, d)
        residual, step = float(np.linalg.norm(g)), along @ _newton_steps(g.T, J[None])[0]
        size = float(np.max(np.abs(step) / (np.abs(y[rows]) + 1e-14)))
        if not np.isfinite(size):
            break
        if size < NEAR:
            y[rows] -= step
            if size < CONVERGED or size > last / 2:  # rounding ends quadratic convergence
                return y
        elif np.isfinite(last) and residual <= _rounding(system, y, d):
            return y  # the unknown is zero up to rounding
        else:
            start = y[rows].copy()
            for part in 0.5 ** np.arange(HALVINGS):
                y[rows] = start - part * step
                if _residual(system, y, d) < residual:
                    break
            else:
                break
        last = size
    names = listed(system.names[i] for i in rows)
    raise ValueError(
        f"{where}: expected consistent start values, found no solution of the algebraic "
        f"equations for {names} near their start values; give better ones"
    )


def _newton_steps(g: Array, J: Array) -> Array:
    """Return full Newton steps, (members, n); all NaN if the matrix of any member is singular."""
    try:
        return np.linalg.solve(J, g[:, :, None])[:, :, 0].astype(float)
    except np.linalg.LinAlgError:
        return np.full(g.shape, np.nan)


def _descended(system: System | AlgebraicEquations, y: Array, d: Array) -> Array:
    """Return `y` with a smaller residual of the algebraic equations, by Levenberg-Marquardt.

    When contacts start to stick, their loads change abruptly and by much. Damped Newton stalls at
    the kinks of the equations in between.
    """
    (rows, along), damping = _moved(system), 1e-3
    g, slope = evaluate_all(system.constraints, y, d)
    for _ in range(MARQUARDT):
        scale = np.linalg.norm(slope, axis=0)
        bent = np.vstack([slope, np.sqrt(damping) * np.diag(scale + np.spacing(scale.max()))])
        if not np.isfinite(np.column_stack([bent[: len(g)], g])).all():
            break  # a parameter is out of range
        new = y.copy()
        new[rows] -= along @ np.linalg.lstsq(bent, np.vstack([g, np.zeros_like(g)]))[0][:, 0]
        g_new, slope_new = evaluate_all(system.constraints, new, d)
        if np.linalg.norm(g_new) < np.linalg.norm(g):
            y, g, slope, damping = new, g_new, slope_new, damping / 10
        elif damping > 1 / LAST_DIGITS:
            break
        else:
            damping *= 4
    return y


def _moved(system: System | AlgebraicEquations) -> tuple[NDArray[np.intp], Array]:
    """Return the unknowns that the algebraic equations determine, and their rows of `free`."""
    rows = np.flatnonzero(system.free.any(axis=1))
    return rows, system.free[rows]


def _residual(system: System | AlgebraicEquations, y: Array, d: Array) -> float:
    return float(np.linalg.norm(evaluate(system.constraints, y, d)))


def _rounding(system: System | AlgebraicEquations, y: Array, d: Array) -> float:
    """Return the change of the residual when the last digits of `y` and `d` change."""
    here, rng = evaluate(system.constraints, y, d), np.random.default_rng(0)
    found: list[float] = []
    for _ in range(4):
        moved = [a * (1.0 + LAST_DIGITS * rng.choice([-1.0, 1.0], a.shape)) for a in (y, d)]
        with np.errstate(invalid="ignore"):  # of infinite values
            found.append(float(np.linalg.norm(evaluate(system.constraints, *moved) - here)))
    return max(found)


def consistent_many(
    system: System | AlgebraicEquations, together: Columns, where: str, y: Array, d: Array
) -> tuple[Array, dict[int, str]]:
    """Return rows of `y` (members, n) with consistent algebraic unknowns, and member -> failure.

    All members make full Newton steps at once while these reduce the residual; the remaining
    members are solved one by one.

    Args:
        system: system with the algebraic equations.
        together: its `constraints`, evaluated for many columns at once.
        where: start of messages.
        y, d: guesses and run data, one row per member.
    """
    (rows, along), failed = _moved(system), dict[int, str]()
    if not rows.size:
        return y, failed
    guess, y, alone = y, y.copy(), list[int]()
    if system.manifold is not None:
        # ensembles of mechanisms are small and have large equations: solve one by one
        alone = list(range(y.shape[0]))
    todo = np.arange(0 if alone else y.shape[0])
    before, last = np.full((2, y.shape[0]), np.inf)
    while todo.size:
        g, J = together([y[todo], d[todo]])
        norm, n = np.linalg.norm(g, axis=1), g.shape[1]
        # CasADi stores column by column
        step = _newton_steps(g, J.reshape(-1, n, n).transpose(0, 2, 1)) @ along.T
        size = np.max(np.abs(step) / (np.abs(y[np.ix_(todo, rows)]) + 1e-14), axis=1)
        near = size < NEAR
        good = np.isfinite(size) & (near | (norm < before[todo]))
        alone += todo[~good].tolist()
        y[np.ix_(todo[good], rows)] -= step[good]
        done = near & ((size < CONVERGED) | (size > last[todo] / 2))
        before[todo], last[todo] = norm, size
        todo = todo[good & ~done]
    for m in alone:
        try:
            y[m] = consistent(system, where, guess[m], d[m])
        except ValueError as error:
            failed[m] = str(error)
    return y, failed


def _charted(manifold: Manifold, y: Array, d: Array) -> Array:
    """Return `y` with an orthonormal basis of the tangent space."""
    n, m, y = manifold.n, manifold.m, y.copy()
    phi_q = manifold.slope(y, d)[n : n + m, :n].full()
    # the trailing right singular vectors span the null space
    y[manifold.basis] = np.linalg.svd(phi_q)[2][m:].ravel()
    return y


def _assembled(
    system: System | AlgebraicEquations, manifold: Manifold, where: str, y: Array, d: Array
) -> Array:
    """Return `y` with positions and velocities projected onto the constraints of a mechanism.

    Raises:
        ValueError: no such positions were found nearby.
    """
    defect = np.inf
    for _ in range(ITERATIONS):
        defect = float(np.abs(evaluate(manifold.defect, y, d)).max(initial=0.0))
        if defect < ASSEMBLED * max(1.0, float(np.abs(y[: system.nx]).max(initial=0.0))):
            return y
        y = evaluate(manifold.project, y, d)
    raise ValueError(
        f"{where}: expected start positions and velocities from which all loops can be closed, "
        f"got constraints that stay at {defect:.3g}; give others"
    )


LONGEST_FIRST = 1e-5
"""Limit of the first step [s], for runs of any length; no machine moves much within it."""


def first_step(span: float | Array, t_start: float = 0.0) -> Any:
    """Return the first step [s] for each span, so small that error control decides.

    The controller can enlarge the step eightfold per step.
    """
    if isinstance(span, float) and isinstance(t_start, float):  # ten times faster
        return max(min(1e-8 * span, LONGEST_FIRST), SURE * abs(t_start))
    return np.maximum(np.minimum(1e-8 * span, LONGEST_FIRST), SURE * abs(t_start))


def smallest_step(span: float | Array) -> Any:
    """Return the step [s] for each span below which a run stops while t is near 0.

    Elsewhere the rounding of t limits the step.
    """
    return 1e-15 * first_step(span)
