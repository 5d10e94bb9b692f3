"""Equations of a model at constant inputs, M y' = f(y, d), with the conditions on its states.

The unknowns y are the states, accelerations and algebraic variables, and d are the inputs and
parameters. Modes of friction are constants. The states satisfy

    C(y, d) = 0:   constraints of a mechanism and their rates, and zero slip of sticking contacts

A state on which no equation depends is cyclic: its rate need not vanish in an equilibrium. An
example is the position of a drive that turns at constant speed.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from symfric.foundation.numeric import Array
from symfric.foundation.variable import stacked
from symfric.integrator.equations.manifold import holonomic_columns
from symfric.integrator.equations.matrices import null_space
from symfric.integrator.equations.system import implicit_columns
from symfric.model import Contact, Model
from symfric.model.contact import APPLIED
from symfric.model.forces import STICKS
from symfric.model.kinds import MODE

Indices = NDArray[np.intp]
LOOSE = 1e4
"""Factor by which states of friction laws may change more than those of the machine."""
DEPENDENT = 1e-9
"""Relative singular value below which equations count as dependent."""


@final
@dataclass(frozen=True, eq=False)
class ModelEquations:
    """Equations of a model at constant inputs.

    Attributes:
        model: the model.
        y: SX symbols (n, 1); the first rows are the states.
        f: SX (n, 1), right-hand sides.
        M: constant mass matrix, shape (n, n).
        names: names of the unknowns.
    """

    model: Model
    y: ca.SX
    f: ca.SX
    M: Array
    names: tuple[str, ...]

    @cached_property
    def d(self) -> ca.SX:
        """Symbols of inputs and parameters."""
        return ca.vertcat(self.model.vector("u"), self.model.vector("p"))

    @cached_property
    def scale(self) -> Array:
        """Typical magnitudes of the unknowns, shape (n,)."""
        known = {v.name: v.nominal for v in (*self.model.x, *self.model.z)}
        return np.array([known.get(name, 1.0) for name in self.names])

    @cached_property
    def reach(self) -> Array:
        """Magnitudes of changes of the unknowns, shape (n,).

        States of friction laws and algebraic unknowns follow the states of the machine.
        """
        loose = {v.name for c in self.model.contacts for v in c.states}
        bound = {v.name for v in self.model.x} - loose
        return self.scale * np.array([1.0 if name in bound else LOOSE for name in self.names])

    @cached_property
    def modes(self) -> Indices:
        """Indices of the states that change only by jumps."""
        whole = [i for i, v in enumerate(self.model.x) if v.kind == MODE]
        return np.array(whole, dtype=np.intp)

    @cached_property
    def switching(self) -> tuple[tuple[Contact, int], ...]:
        """Contacts that stick or slide by modes, and the index of the mode, which is 0 in stick."""
        names = [v.name for v in self.model.x]
        return tuple(
            (c, names.index(v.name))
            for c in self.model.contacts
            for s, v in zip(c.law.states, c.states, strict=True)
            if s.whole and APPLIED in c.given
        )

    def stuck(self, y: Array) -> list[int]:
        """Return the indices of the switching contacts that stick, by their modes."""
        return [i for i, (_, mode) in enumerate(self.switching) if abs(y[mode]) < STICKS]

    @cached_property
    def constraints(self) -> ca.SX:
        """Constraints of a mechanism and their rates."""
        mechanics = self.model.holonomic
        if mechanics is None:
            return ca.SX(0, 1)
        q, rates = self.y[: mechanics.n], self.y[mechanics.n : 2 * mechanics.n]
        return ca.vertcat(mechanics.phi, ca.jtimes(mechanics.phi, q, rates))

    @cached_property
    def slips(self) -> ca.SX:
        """Sliding velocities of the contacts that stick or slide by modes."""
        return stacked(ca.SX(c.slip) for c, _ in self.switching)

    @cached_property
    def cyclic(self) -> Indices:
        """Indices of the states on which nothing depends."""
        names, cyclic = [v.name for v in self.model.x], self.model.cyclic
        return np.array([names.index(name) for name in cyclic], dtype=np.intp)

    @cached_property
    def algebraic(self) -> Indices:
        """Rows of f without rates."""
        return np.flatnonzero(~self.M.any(axis=1))

    @cached_property
    def differential(self) -> Indices:
        """Rows of f with rates, without those of modes."""
        own = self.M[:, np.setdiff1d(np.arange(self.M.shape[1]), self.modes)]
        return np.flatnonzero(own.any(axis=1))

    @cached_property
    def values(self) -> ca.Function:
        """Function (y, d) -> f, constraints, slips."""
        return ca.Function("values", [self.y, self.d], [self.f, self.constraints, self.slips])

    @cached_property
    def slopes(self) -> ca.Function:
        """Function (y, d) -> derivatives of f, constraints and slips by y, then by d."""
        parts = [self.f, self.constraints, self.slips]
        found = [ca.jacobian(part, of) for of in (self.y, self.d) for part in parts]
        return ca.Function("slopes", [self.y, self.d], found)

    @cached_property
    def forces(self) -> ca.Function:
        """Function (y, d) -> forces of all contacts, and their derivatives by y."""
        forces = ca.densify(stacked(c.friction for c in self.model.contacts))
        return ca.Function("forces", [self.y, self.d], [forces, ca.jacobian(forces, self.y)])

    def expressed(self, expression: ca.SX) -> ca.Function:
        """Return an expression of the model as a Function (y, d)."""
        return ca.Function("expressed", [self.y, self.d], [ca.densify(expression)], {"cse": True})

    @cached_property
    def contacts(self) -> ca.Function:
        """Function (y, d) -> rows (slip, force, level against +F, level against -F), one each."""
        every = self.model.contacts
        rows = [ca.horzcat(ca.SX(c.slip), c.friction, _level(c, 1), _level(c, -1)) for c in every]
        table = ca.vertcat(*rows) if rows else ca.SX(0, 4)
        return ca.Function("contacts", [self.y, self.d], [ca.densify(table)], {"cse": True})

    def data(self, u: Mapping[str, float] | None, p: Mapping[str, float] | None) -> Array:
        """Return the values of d for inputs and parameters by name."""
        return np.concatenate([self.model.values("u", u), self.model.values("p", p)])


def _level(c: Contact, side: int) -> ca.SX:
    """Return the static level [N] of a contact against a pull to one side; NaN if undefined."""
    try:
        return c.static_level(side)
    except ValueError:
        return ca.SX(float("nan"))


def equations(where: str, model: Model, *, timed: bool = False) -> ModelEquations:
    """Return the equations of a model, which caches them.

    Raises:
        ValueError: the equations depend on time, unless they may be `timed`.
    """
    made = model.memory.get("at_rest") or model.memory.setdefault("at_rest", _made(model))
    if not timed and ca.depends_on(ca.vertcat(made.f, made.constraints), model.t):
        raise ValueError(
            f"{where}: expected equations without explicit time, got '{model.name}', whose "
            "equations depend on it; make the time-dependent part an input or a parameter"
        )
    return made


def _made(model: Model) -> ModelEquations:
    mechanics = model.holonomic
    if mechanics is not None:
        y, f, mass, names = holonomic_columns(model, replace(mechanics, index=1))
    elif model.ode is None:
        y, f, mass, names = implicit_columns(model)
    else:
        y, f = ca.vertcat(model.vector("x"), model.vector("z")), ca.vertcat(model.ode, model.alg)
        mass = ca.diagcat(ca.SX.eye(len(model.x)), ca.SX(len(model.z), len(model.z)))
        names = [v.name for v in (*model.x, *model.z)]
    return ModelEquations(model, y, f, ca.DM(mass).full(), tuple(names))


class TangentEquations(NamedTuple):
    """Linear equations e' = A e + B dd with dy = T e + Y dd.

    Attributes:
        states: indices of the independent states e in y, shape (k,).
        A, B: shapes (k, k) and (k, n_d).
        T, Y: shapes (n, k) and (n, n_d); T is the identity in the rows `states`.
    """

    states: Indices
    A: Array
    B: Array
    T: Array
    Y: Array


def independent(C: Array, scale: Array, states: Indices) -> tuple[Indices, Array]:
    """Return indices of independent states e, and T with C T = 0 and the identity in their rows.

    Args:
        C: derivatives of the conditions, shape (m, n).
        scale: typical magnitudes of the unknowns, shape (n,).
        states: indices of the unknowns among which e is selected.
    """
    rows = C * scale
    size = np.maximum(np.abs(rows).max(axis=1, keepdims=True, initial=0.0), 1e-300)
    _, s, V = np.linalg.svd(rows / size)
    rank = int((s > DEPENDENT * s.max(initial=0.0)).sum())
    N = scale[:, None] * V[rank:].T
    share = N[states] / scale[states][:, None]
    found: Any = qr(share.T, mode="economic", pivoting=True)
    _, R, order = found
    k = int((np.abs(np.diag(R)) > DEPENDENT).sum())
    chosen = np.sort(np.asarray(states)[order[:k]]).astype(np.intp)
    T = N @ np.linalg.pinv(N[chosen])
    T[chosen] = np.eye(k)
    return chosen, T


def conditions(eq: ModelEquations, y: Array, d: Array) -> tuple[Array, Array, Array]:
    """Return C, and derivatives of f by y and by d, at y."""
    J, of_C, of_slips, K, *_ = (slope.full() for slope in eq.slopes(y, d))
    stuck = eq.stuck(y)
    modes = np.eye(y.size)[eq.modes]
    return np.vstack([J[eq.algebraic], of_C, of_slips[stuck], modes]), J, K


def tangent(eq: ModelEquations, y: Array, d: Array) -> TangentEquations:
    """Return the linear equations at the equilibrium `y`."""
    C, J, K = conditions(eq, y, d)
    states = np.setdiff1d(np.arange(len(eq.model.x)), eq.modes)
    chosen, T = independent(C, eq.scale, states)
    rows, free, moving = eq.algebraic, null_space(eq.M), eq.differential
    Y = -free @ np.linalg.solve(J[rows] @ free, K[rows])
    E = eq.M[moving] @ T
    right = np.hstack([J[moving] @ T, K[moving] + J[moving] @ Y])
    size = (np.abs(eq.M[moving]) @ eq.scale)[:, None]
    both: Array = np.linalg.lstsq(E / size, right / size, rcond=None)[0].astype(float)
    return TangentEquations(chosen, both[:, : chosen.size], both[:, chosen.size :], T, Y)
