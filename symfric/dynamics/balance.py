"""Solution of the equations of an equilibrium, with modes of stick and slip."""

from collections.abc import Iterator, Sequence
from itertools import product
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.dynamics.equations import DEPENDENT, ModelEquations
from symfric.foundation.numeric import Array

ITERATIONS, HALVINGS = 50, 10
"""Largest numbers of Gauss-Newton steps, and of halvings of one step."""
SETTLED, BALANCED = 1e-12, 1e-9
"""Relative step at which the iteration ends, and relative residual of an equilibrium."""
STILL = 1e-9
"""Sliding velocity that counts as zero, relative to the largest nominal value of its states."""
LEVEL = 1e-9
"""Excess of a force over the static level that counts as rounding, relative to the level."""
MANY = 3
"""Largest number of contacts with modes for which all combinations are tried."""
SLIP, FORCE, UP = range(3)
"""Columns of `ModelEquations.contacts`; the last one, after UP, is the level against -F."""


class LinearCondition(NamedTuple):
    """Linear condition W (y - y_0) = 0 in addition to the equations; W has the shape (k, n)."""

    W: Array
    y_0: Array


def settled(
    eq: ModelEquations, y: Array, d: Array, more: LinearCondition | None = None,
    unloaded: Sequence[int] = (), reach: Array | None = None,
) -> tuple[Array, int] | None:  # fmt: skip
    """Return a solution near `y` and the dimension of its set; None if there is none.

    The modes in `y` are constants. Gauss-Newton steps of minimal norm, relative to `reach`, lead to
    the solution; by default relative to the nominal values. Contacts in `unloaded` have no friction
    force.
    """
    with np.errstate(all="ignore"):
        return _settled(eq, y, d, more, unloaded, eq.scale if reach is None else reach)


def _settled(
    eq: ModelEquations, y: Array, d: Array, more: LinearCondition | None, unloaded: Sequence[int],
    reach: Array,
) -> tuple[Array, int] | None:  # fmt: skip
    own = np.setdiff1d(np.arange(y.size), eq.modes)
    scale = reach[own]
    r, slopes = _rows(eq, y, d, more, unloaded)
    for _ in range(ITERATIONS):
        size = np.maximum(np.abs(slopes[:, own] * scale).max(axis=1, initial=0.0), 1e-300)
        step = np.linalg.lstsq(slopes[:, own] * scale / size[:, None], -r / size, rcond=DEPENDENT)[
            0
        ]
        norm, share = np.linalg.norm(r / size), 1.0
        if np.abs(step).max(initial=0.0) <= SETTLED * max(1.0, np.abs(y[own] / scale).max()):
            break
        for _ in range(HALVINGS):
            trial = y.copy()
            trial[own] += share * scale * step
            r, slopes = _rows(eq, trial, d, more, unloaded)
            if np.isfinite(r).all() and np.linalg.norm(r / size) <= (1 - share / 4) * norm:
                break
            share /= 2
        else:
            r, slopes = _rows(eq, y, d, more, unloaded)
            break
        y = trial
    terms = np.abs(slopes[:, own]) @ np.maximum(np.abs(y[own]), eq.scale[own])
    if not (np.abs(r) <= BALANCED * np.maximum(terms, 1e-300)).all():
        return None
    scaled = slopes[:, own] * eq.scale[own]
    scaled /= np.maximum(np.abs(scaled).max(axis=1, keepdims=True), 1e-300)
    rank = int(np.linalg.matrix_rank(scaled, tol=DEPENDENT * max(1.0, np.linalg.norm(scaled, 2))))
    return y, own.size - rank - eq.cyclic.size


def rows_at_rest(eq: ModelEquations, y: Array, d: Array) -> tuple[Array, Array]:
    """Return the residuals of an equilibrium, and their derivatives by y and by d in columns."""
    f, C, slips = (value.full().ravel() for value in eq.values(y, d))
    every = [slope.full() for slope in eq.slopes(y, d)]
    of_f, of_C, of_slips = (np.hstack(pair) for pair in zip(every[:3], every[3:], strict=True))
    others = np.delete(eq.M, np.union1d(eq.cyclic, eq.modes), axis=1).any(axis=1)
    kept = others | ~eq.M.any(axis=1)
    stuck = eq.stuck(y)
    return np.concatenate([f[kept], C, slips[stuck]]), np.vstack(
        [of_f[kept], of_C, of_slips[stuck]]
    )


def _rows(
    eq: ModelEquations, y: Array, d: Array, more: LinearCondition | None, unloaded: Sequence[int]
) -> tuple[Array, Array]:
    """Return the residuals of an equilibrium and their derivatives by y."""
    r, of_both = rows_at_rest(eq, y, d)
    rows, slopes = [r], [of_both[:, : y.size]]
    if unloaded:
        forces, of_forces = (value.full() for value in eq.forces(y, d))
        rows.append(forces.ravel()[[*unloaded]])
        slopes.append(of_forces[[*unloaded]])
    if more is not None:
        rows.append(more.W @ (y - more.y_0))
        slopes.append(more.W)
    return np.concatenate(rows), np.vstack(slopes)


def with_modes(eq: ModelEquations, y: Array, d: Array) -> tuple[Array, int] | None:
    """Return a solution near `y` with consistent modes and its dimension; None without one.

    A sliding contact has a sliding velocity in the direction of its mode, and a contact at rest,
    with modes or with bristles, has a force within its levels. Modes that differ least from those
    of the guess are tried first. If the nearest equilibrium overloads a contact at rest, the one
    without forces in the contacts at rest is tried.
    """
    slips, still = eq.values(y, d)[2].full().ravel(), slowest(eq)
    modes = np.where(np.abs(slips) > still, np.sign(slips), 0.0)
    at = [mode for _, mode in eq.switching]
    for choice in _choices(modes):
        trial = y.copy()
        trial[at] = choice
        for found in _candidates(eq, trial, d):
            if _consistent(eq, found[0], d, still):
                return found
    return None


def _candidates(eq: ModelEquations, y: Array, d: Array) -> Iterator[tuple[Array, int]]:
    """Yield solutions with the modes of `y`: near it, then without forces in resting contacts."""
    for reach in (eq.reach, eq.scale):
        found = settled(eq, y, d, reach=reach)
        if found is None:
            continue
        yield found
        resting = np.flatnonzero(_rests(eq, eq.contacts(found[0], d).full())).tolist()
        if resting and (start := settled(eq, found[0], d, unloaded=resting)):
            found = settled(eq, start[0], d)
            yield from [found] if found else []


def _choices(modes: Array) -> Iterator[Sequence[float]]:
    """Yield the combinations of modes to try, the nearest to `modes` first."""
    if modes.size > MANY:
        yield from (modes.tolist(), np.zeros(modes.size).tolist())
        return
    every = product((0.0, 1.0, -1.0), repeat=modes.size)
    yield from sorted(every, key=lambda choice: float(np.abs(modes - choice).sum()))


def slowest(eq: ModelEquations) -> Array:
    """Return the sliding velocity of each contact with modes that counts as zero."""
    used = ca.DM(eq.slopes.sparsity_out(2), 1).full() != 0
    return STILL * np.array([max(eq.scale[row], default=1.0) for row in used])


def _rests(eq: ModelEquations, rows: Array) -> NDArray[np.bool_]:
    """Return True for each of the `rows` of contacts without sliding velocity."""
    return np.abs(rows[:, SLIP]) <= STILL * eq.scale[: len(eq.model.x)].max(initial=0.0)


def _consistent(eq: ModelEquations, y: Array, d: Array, still: Array) -> bool:
    """Return True if all modes of contacts agree with sliding velocities and forces."""
    rows = eq.contacts(y, d).full()
    force, level = rows[:, FORCE], np.where(rows[:, FORCE] > 0, rows[:, UP], rows[:, UP + 1])
    holds = np.array([bool(c.law.states) for c in eq.model.contacts], dtype=bool)
    if (holds & _rests(eq, rows) & (np.abs(force) > (1 + LEVEL) * level)).any():
        return False
    slips, modes = (
        eq.values(y, d)[2].full().ravel(),
        np.round(y[[mode for _, mode in eq.switching]]),
    )
    return bool(((modes == 0) | (modes * slips > still)).all())
