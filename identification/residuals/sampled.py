"""Equations evaluated at the samples of a record, with exact derivatives by the parameters."""

from dataclasses import dataclass, field
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NEWTON = 20
"""Newton steps for the algebraic unknowns of all samples together."""
ROUNDS = 40
"""Passes between algebraic unknowns and states along the record."""
SETTLED = 1e-9
"""Change of the algebraic unknowns, over their size, from which on they count as found."""


@final
@dataclass(frozen=True, eq=False)
class Equations:
    """What holds at each sample of a record, in symbols.

        0 = g(w, z, y, p)                 algebraic unknowns y: reactions, normal forces
        z_{k+1} = step(z_k, w_k, y_k, w_{k+1}, y_{k+1}, h, p),   z_0 = start(w_0, y_0, p)
        r = rows(w, z, y, p)

    Attributes:
        w, z, y, p: SX symbols of what is measured, of states of laws, of unknowns, of parameters.
        rows, g, start: SX expressions in them.
        step: SX expression in z, w, y, p and `later`: the symbols of w_{k+1}, y_{k+1} and h.
        guess: values of y to start from, shape (ny,).
    """

    w: ca.SX
    p: ca.SX
    rows: ca.SX
    z: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    y: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    g: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    start: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    step: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    later: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    guess: tuple[float, ...] = ()

    def compiled(self) -> "Sampled":
        """The same as Functions, which can be evaluated and pickled."""
        arguments = [self.w, self.z, self.y, self.p]
        names = ["w", "z", "y", "p"]
        along = ca.vertcat(self.z, self.y, self.p)

        def with_slopes(name: str, of: ca.SX) -> ca.Function:
            slopes = ca.vec(ca.densify(ca.jacobian(of, along)))
            return ca.Function(name, arguments, [ca.densify(of), slopes], names, [name, "slopes"])

        return Sampled(
            with_slopes("rows", self.rows),
            with_slopes("g", self.g),
            with_slopes("start", self.start),
            self._step(),
            self._tangent(),
            (self.w.numel(), self.z.numel(), self.y.numel(), self.p.numel()),
            np.array(self.guess, float),
        )

    def _step(self) -> ca.Function:
        return ca.Function("step", [self.z, self.w, self.y, self.later, self.p], [self.step])

    def _tangent(self) -> ca.Function:
        """The step with the derivatives S of the states by p, Y and Y_later those of y."""
        nz, ny, count = self.z.numel(), self.y.numel(), self.p.numel()
        S, Y, Y_later = (ca.SX.sym(n, k, count) for n, k in (("S", nz), ("Y", ny), ("Yl", ny)))
        nw = self.w.numel()
        later_y = self.later[nw : nw + ny, 0] if nz else self.y
        slope = (
            ca.mtimes(ca.jacobian(self.step, self.z), S)
            + ca.jacobian(self.step, self.p)
            + ca.mtimes(ca.jacobian(self.step, self.y), Y)
            + ca.mtimes(ca.jacobian(self.step, later_y), Y_later)
        )
        state, given = ca.vertcat(self.z, ca.vec(S)), [self.w, self.y, self.later]
        further = [ca.vec(Y), ca.vec(Y_later)]
        new = ca.vertcat(self.step, ca.vec(ca.densify(slope)))
        return ca.Function("tangent", [state, *given, *further, self.p], [new])


@final
@dataclass(frozen=True, eq=False)
class Path:
    """What was found along a record of n samples.

    Attributes:
        rows: (n, m), and their derivatives by p, (n, m, n_p).
        slopes: see rows.
    """

    rows: Array
    slopes: Array


@final
@dataclass(frozen=True, eq=False)
class Sampled:
    """`Equations` as Functions of numbers; sizes are those of w, z, y and p."""

    rows: ca.Function
    g: ca.Function
    start: ca.Function
    step: ca.Function
    tangent: ca.Function
    sizes: tuple[int, int, int, int]
    guess: Array

    def along(self, w: Array, h: float | Array, p: Array) -> Path | str:
        """Rows at all samples of a record and their derivatives by p; a sentence if there are none.

        Args:
            w: measured, shape (nw, n).
            h: sample interval [s], one or (n - 1,); not used without states.
            p: parameters, shape (n_p,).
        """
        n, (_, nz, ny, _) = w.shape[1], self.sizes
        z, y = np.zeros((nz, n)), np.repeat(self.guess[:, None], n, axis=1)
        for _ in range(ROUNDS if nz and ny else 1):
            old = y
            if ny:
                found = self._solve(w, z, y, p)
                if isinstance(found, str):
                    return found
                y = found
            if nz:
                z = self._states(w, y, h, p)
            if not (nz and ny) or _settled(old, y):
                break
        else:
            return "friction and the reactions that press it did not settle"
        Z, Y = self._tangents(w, z, y, h, p)
        r, at = self._at(self.rows, w, z, y, p)
        slopes = at[:, :, nz + ny :].copy()
        slopes += at[:, :, :nz] @ Z + at[:, :, nz : nz + ny] @ Y
        if not (np.isfinite(r).all() and np.isfinite(slopes).all()):
            return "the friction law is not finite at some samples"
        return Path(r, slopes)

    def _at(self, f: ca.Function, w: Array, z: Array, y: Array, p: Array) -> tuple[Array, Array]:
        """Values (n, m) and slopes (n, m, k) of a function at all samples."""
        n = w.shape[1]
        mapped = f.map(f"{f.name()}_{n}", "serial", n, [3], [])
        value, slopes = (part.full() for part in mapped(w, z, y, p))
        m = value.shape[0]
        return value.T, slopes.T.reshape(n, -1, m).transpose(0, 2, 1)

    def _solve(self, w: Array, z: Array, y: Array, p: Array) -> Array | str:
        """Algebraic unknowns of all samples by Newton's method."""
        nz, ny = self.sizes[1:3]
        for _ in range(NEWTON):
            g, slopes = self._at(self.g, w, z, y, p)
            try:
                way = np.linalg.solve(slopes[:, :, nz : nz + ny], g[:, :, None])[:, :, 0].T
            except np.linalg.LinAlgError:
                return "reactions cannot be told from the motion at some samples"
            if not np.isfinite(way).all():
                return "the equations of the reactions are not finite at some samples"
            y = y - way
            if _settled(y + way, y):
                return y
        return "the reactions were not found by Newton's method at some samples"

    def _states(self, w: Array, y: Array, h: float | Array, p: Array) -> Array:
        """States of the laws along the record, (nz, n)."""
        n = w.shape[1]
        z = np.empty((self.sizes[1], n))
        z[:, :1] = self.start(w[:, :1], 0, y[:, :1], p)[0].full()
        later = np.vstack([w[:, 1:], y[:, 1:], np.broadcast_to(h, n - 1)])
        walk = self.step.mapaccum(f"walk_{n}", n - 1)
        z[:, 1:] = walk(z[:, 0], w[:, :-1], y[:, :-1], later, p).full()
        return z

    def _tangents(
        self, w: Array, z: Array, y: Array, h: float | Array, p: Array
    ) -> tuple[Array, Array]:
        """Derivatives of states (n, nz, n_p) and of unknowns (n, ny, n_p) by the parameters."""
        n, (_, nz, ny, count) = w.shape[1], self.sizes
        dz, dy = np.zeros((n, nz, count)), np.zeros((n, ny, count))
        by_z, by_p = np.zeros((n, ny, nz)), np.zeros((n, ny, count))
        if ny:
            slopes = self._at(self.g, w, z, y, p)[1]
            known = np.concatenate([slopes[:, :, :nz], slopes[:, :, nz + ny :]], axis=2)
            found = -np.linalg.solve(slopes[:, :, nz : nz + ny], known)
            by_z, by_p = found[:, :, :nz], found[:, :, nz:]
        for _ in range(ROUNDS if nz and ny else 1):
            old, dy = dy, by_z @ dz + by_p
            if nz:
                dz = self._tangent(w, z, y, dy, h, p)
            if not (nz and ny) or _settled(old, dy):
                break
        return dz, dy

    def _tangent(self, w: Array, z: Array, y: Array, Y: Array, h: float | Array, p: Array) -> Array:
        """Derivatives of the states by the parameters, those of y being Y."""
        n, (_, nz, ny, count) = w.shape[1], self.sizes
        _, first = self._at(self.start, w[:, :1], z[:, :1], y[:, :1], p)
        S = first[0, :, nz + ny :] + first[0, :, nz : nz + ny] @ Y[0]
        flat = Y.transpose(2, 1, 0).reshape(count * ny, n)
        later = np.vstack([w[:, 1:], y[:, 1:], np.broadcast_to(h, n - 1)])
        walk = self.tangent.mapaccum(f"tangents_{n}", n - 1)
        start = np.concatenate([z[:, 0], S.T.ravel()])
        given = w[:, :-1], y[:, :-1], later, flat[:, :-1], flat[:, 1:]
        states = np.hstack([start[:, None], walk(start, *given, p).full()])
        return states[nz:].T.reshape(n, count, nz).transpose(0, 2, 1)


def _settled(old: Array, new: Array) -> bool:
    """Whether nothing has changed but rounding."""
    if not new.size:
        return True
    size = max(float(np.abs(new).max()), 1e-12)
    return bool(np.abs(new - old).max() <= SETTLED * size)
