"""Equations evaluated at the samples of a record, with exact derivatives by the parameters.

States of laws follow the imposed velocity and normal force from sample to sample (`imposed_step`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import Scalar
from symfric.foundation.programs import CompileError, find_compiler
from symfric.integrator.compiled.columns import Columns
from symfric.laws import Law

Array = NDArray[np.float64]

NEAR_REST = 0.05
"""First velocity, over the usual one, below which a record starts at rest."""


def imposed_step(
    law: Law,
    z: ca.SX,
    before: tuple[Scalar, Scalar, Mapping[str, Scalar]],
    after: tuple[Scalar, Scalar, Mapping[str, Scalar]],
    h: Scalar,
    where: str,
) -> ca.SX:
    """Return the states of `law` one sample later, (nz, 1).

        z' = rate(z, v(t), N(t)),   v, N and further inputs linear between the samples

    Two steps, each with its mean velocity and load held: exact exponentials for bristles, exact
    event steps for yielding elements, second order otherwise
    (`symfric.codegen.blocks.held_step`). They meet in the middle, or where the velocity passes
    through zero, so that no step includes two directions. The smooth form of GMS takes the step of
    its event form, which slips later by up to the share rho of the limit.

    Args:
        law: with states; its parameters may be symbols.
        z: SX symbols of its states.
        before, after: velocity, normal force and further inputs at the two samples.
        h: sample interval [s].
        where: start of the error message.

    Raises:
        ValueError: a law whose modes or states are coupled: only a simulation can follow it.
    """
    v, N, size = (ca.SX.sym(name) for name in ("v", "N", "h"))
    names = list(before[2])
    given = {name: ca.SX.sym(name) for name in names}
    rate = ca.SX(law.rate(v, N, z, **given))
    end = _held(law, v, N, z, rate, given, size, where)
    inner = ca.vertcat(v, N, *given.values())

    first, last = (_stacked(point, names) for point in (before, after))
    crosses = first[0] * last[0] < 0
    share = ca.if_else(crosses, first[0] / (first[0] - last[0] + (1 - crosses)), 0.5)
    middle = first + share * (last - first)
    middle[0] = ca.if_else(crosses, 0, middle[0])
    old = ca.vertcat(inner, size)
    half = ca.substitute(end, old, ca.vertcat((first + middle) / 2, share * h))
    new = ca.vertcat((middle + last) / 2, (1 - share) * h, half)
    return ca.substitute(end, ca.vertcat(old, z), new)


def _held(
    law: Law,
    v: ca.SX,
    N: ca.SX,
    z: ca.SX,
    rate: ca.SX,
    given: Mapping[str, ca.SX],
    h: ca.SX,
    where: str,
) -> ca.SX:
    """Return the states after a step with constant inputs."""
    from symfric.codegen.blocks.held_step import advanced  # noqa: PLC0415 (slow to import)
    from symfric.laws import GMS  # noqa: PLC0415 (slow to import)

    if isinstance(law, GMS) and law.form != "event":
        law = replace(law, form="event")
    try:
        return advanced(law, v, N, z, rate, given, h, where).end
    except ValueError:
        raise ValueError(
            f"{where}: expected a law with a step for imposed velocity, got {type(law).__name__}, "
            "whose modes or states are coupled; use Shooting(), which simulates"
        ) from None


def _stacked(point: tuple[Scalar, Scalar, Mapping[str, Scalar]], names: list[str]) -> ca.SX:
    v, N, given = point
    return ca.vertcat(ca.SX(v), ca.SX(N), *(ca.SX(given[name]) for name in names))


def moving_start(v: Array) -> float:
    """Return the initial velocity of the states: the first one, or 0 if it is near rest.

    A bristle that has slid far is fully bent at the smallest speed; at rest it is taken as relaxed.
    """
    return float(v[0]) if abs(v[0]) > NEAR_REST * float(np.sqrt(np.mean(v**2))) else 0.0


NEWTON = 20
"""Newton steps for the algebraic unknowns of all samples together."""
ROUNDS = 40
"""Largest number of passes between algebraic unknowns and states along the record."""
SETTLED = 1e-9
"""Change of the algebraic unknowns, over their size, below which they are converged."""


@final
@dataclass(frozen=True, eq=False)
class Equations:
    """Equations at each sample of a record, in symbols.

        0 = g(w, z, y, p)                 algebraic unknowns y: reactions, normal forces
        z_{k+1} = step(z_k, w_k, y_k, w_{k+1}, y_{k+1}, h, p),   z_0 = start(w_0, y_0, p)
        r = rows(w, z, y, p)

    Attributes:
        w, z, y, p: SX symbols of measured quantities, law states, unknowns, parameters.
        rows, g, start: SX expressions in them.
        step: SX expression in z, w, y, p, `h` and `later`, the symbols of w_{k+1} and y_{k+1}.
        guess: start values of y, shape (ny,).
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
    h: ca.SX = field(default_factory=lambda: ca.SX.sym("h"))
    guess: tuple[float, ...] = ()

    def compiled(self) -> "Sampled":
        """Return the equations as Functions, which can be evaluated and pickled."""
        here, along = ca.vertcat(self.w, self.y), ca.vertcat(self.z, self.y, self.p)

        def with_slopes(name: str, of: ca.SX) -> ca.Function:
            slopes = ca.vec(ca.densify(ca.jacobian(of, along)))
            return ca.Function(f"sampled_{name}", [here, self.z, self.p], [ca.densify(of), slopes])

        return Sampled(
            with_slopes("rows", self.rows),
            with_slopes("g", self.g),
            with_slopes("start", self.start),
            *self._steps(here),
            (self.w.numel(), self.z.numel(), self.y.numel(), self.p.numel()),
            np.array(self.guess, float),
        )

    def _steps(self, here: ca.SX) -> tuple[ca.Function, ca.Function]:
        """Return the step, and the step with the derivatives S of the states by p.

        The derivatives of y are Y at the sample and Y_later at the next one.
        """
        nw, nz, ny, count = (x.numel() for x in (self.w, self.z, self.y, self.p))
        later = self.later if nz else ca.SX.sym("later", nw + ny)
        S, Y, Y_later = (ca.SX.sym(n, k, count) for n, k in (("S", nz), ("Y", ny), ("Yl", ny)))
        slope = (
            ca.mtimes(ca.jacobian(self.step, self.z), S)
            + ca.jacobian(self.step, self.p)
            + ca.mtimes(ca.jacobian(self.step, self.y), Y)
            + ca.mtimes(ca.jacobian(self.step, later[nw:, 0]), Y_later)
        )
        both = ca.vertcat(self.z, ca.vec(S))
        new = ca.vertcat(self.step, ca.vec(ca.densify(slope)))
        given, further = [here, later, self.h], [ca.vec(Y), ca.vec(Y_later), self.p]
        return (
            ca.Function("sampled_step", [self.z, *given, self.p], [ca.densify(self.step)]),
            ca.Function("sampled_tangent", [both, *given, *further], [ca.densify(new)]),
        )


@final
@dataclass(frozen=True, eq=False)
class Path:
    """Rows along a record of n samples.

    Attributes:
        rows: (n, m).
        slopes: their derivatives by p, (n, m, n_p).
    """

    rows: Array
    slopes: Array


@final
@dataclass(frozen=True, eq=False)
class Sampled:
    """`Equations` as numeric Functions; `sizes` are those of w, z, y and p.

    Laws with states run in compiled code if there is a compiler, all others in CasADi's virtual
    machine; both give the same bits.
    """

    rows: ca.Function
    g: ca.Function
    start: ca.Function
    step: ca.Function
    tangent: ca.Function
    sizes: tuple[int, int, int, int]
    guess: Array

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields; a copy compiles or loads its own code."""
        return {item.name: getattr(self, item.name) for item in fields(self)}

    @cached_property
    def _columns(self) -> dict[str, Columns]:
        chained = {"step": True, "tangent": True}
        names = ("rows", "g", "start", "step", "tangent")
        return {n: Columns(getattr(self, n), chained.get(n, False)) for n in names}

    def _run(self, name: str, rows: list[Any], first: Array | None = None) -> list[Array]:
        columns = self._columns[name]
        if self.sizes[1] and name != "start" and find_compiler() is not None:
            try:
                return columns(rows, first, "compiled")
            except CompileError:  # a broken compiler is no reason not to evaluate
                pass
        return columns(rows, first, "vm")

    def along(self, w: Array, h: float | Array, p: Array, begin: Array | None = None) -> Path | str:
        """Return rows at all samples and their derivatives by p, or a message on a failure.

        Args:
            w: measured, shape (nw, n).
            begin: values of w for the start of the states, shape (nw,); None: the first sample.
            h: sample interval [s], one or (n - 1,); not used without states.
            p: parameters, shape (n_p,).
        """
        n, (_, nz, ny, _) = w.shape[1], self.sizes
        w, z, y = w.T, np.zeros((n, nz)), np.repeat(self.guess[None, :], n, axis=0)
        first = w[0] if begin is None else begin
        for _ in range(ROUNDS if nz and ny else 1):
            old = y
            if ny:
                found = self._solve(w, z, y, p)
                if isinstance(found, str):
                    return found
                y = found
            if nz:
                z = self._states(w, y, h, p, first)
            if not (nz and ny) or _settled(old, y):
                break
        else:
            return "friction and the reactions that load it did not converge"
        dz, dy = self._tangents(w, z, y, h, p, first)
        r, at = self._at("rows", w, z, y, p)
        slopes = at[:, :, nz + ny :].copy()
        if nz:
            slopes += at[:, :, :nz] @ dz
        if ny:
            slopes += at[:, :, nz : nz + ny] @ dy
        if not (np.isfinite(r).all() and np.isfinite(slopes).all()):
            return "the friction law is not finite at some samples"
        return Path(r, slopes)

    def _at(self, name: str, w: Array, z: Array, y: Array, p: Array) -> tuple[Array, Array]:
        """Return values (n, m) and derivatives (n, m, k) of a function at all samples."""
        n = w.shape[0]
        value, slopes = self._run(name, [np.hstack([w, y]), z, _same(p, n)])
        return value, slopes.reshape(n, -1, value.shape[1]).transpose(0, 2, 1)

    def _solve(self, w: Array, z: Array, y: Array, p: Array) -> Array | str:
        """Solve for the algebraic unknowns of all samples by Newton's method."""
        nz, ny = self.sizes[1:3]
        for _ in range(NEWTON):
            g, slopes = self._at("g", w, z, y, p)
            try:
                step = np.linalg.solve(slopes[:, :, nz : nz + ny], g[:, :, None])[:, :, 0]
            except np.linalg.LinAlgError:
                return "the motion does not determine the reactions at some samples"
            if not np.isfinite(step).all():
                return "the equations of the reactions are not finite at some samples"
            y = y - step
            if _settled(y + step, y):
                return y
        return "the reactions were not found by Newton's method at some samples"

    def _states(self, w: Array, y: Array, h: float | Array, p: Array, begin: Array) -> Array:
        """Return the states of the laws along the record, (n, nz)."""
        n = w.shape[0]
        here, steps = np.hstack([w, y]), np.broadcast_to(h, n - 1).reshape(-1, 1)
        first = self._at("start", begin[None], np.zeros((1, self.sizes[1])), y[:1], p)[0]
        given = [here[:-1], here[1:], np.ascontiguousarray(steps), _same(p, n - 1)]
        return np.vstack([first, self._run("step", given, first[0])[0]])

    def _tangents(
        self, w: Array, z: Array, y: Array, h: float | Array, p: Array, begin: Array
    ) -> tuple[Array, Array]:
        """Return derivatives of states (n, nz, n_p) and unknowns (n, ny, n_p) by the parameters."""
        n, (_, nz, ny, count) = w.shape[0], self.sizes
        dz, dy = np.zeros((n, nz, count)), np.zeros((n, ny, count))
        by_z, by_p = np.zeros((n, ny, nz)), np.zeros((n, ny, count))
        if ny:
            slopes = self._at("g", w, z, y, p)[1]
            known = np.concatenate([slopes[:, :, :nz], slopes[:, :, nz + ny :]], axis=2)
            found = -np.linalg.solve(slopes[:, :, nz : nz + ny], known)
            by_z, by_p = found[:, :, :nz], found[:, :, nz:]
        for _ in range(ROUNDS if nz and ny else 1):
            old, dy = dy, by_z @ dz + by_p
            if nz:
                dz = self._tangent(w, z, y, dy, h, p, begin)
            if not (nz and ny) or _settled(old, dy):
                break
        return dz, dy

    def _tangent(
        self,
        w: Array,
        z: Array,
        y: Array,
        dy: Array,
        h: float | Array,
        p: Array,
        begin: Array,
    ) -> Array:
        """Return the derivatives of the states by the parameters, given those of y, dy."""
        n, (_, nz, ny, count) = w.shape[0], self.sizes
        first = self._at("start", begin[None], z[:1], y[:1], p)[1][0]
        S = first[:, nz + ny :] + first[:, nz : nz + ny] @ dy[0]
        here, steps = np.hstack([w, y]), np.broadcast_to(h, n - 1).reshape(-1, 1)
        flat = np.ascontiguousarray(dy.transpose(0, 2, 1)).reshape(n, count * ny)
        given = [
            here[:-1], here[1:], np.ascontiguousarray(steps), flat[:-1], flat[1:], _same(p, n - 1),
        ]  # fmt: skip
        start = np.concatenate([z[0], S.T.ravel()])
        both = np.vstack([start[None, :], self._run("tangent", given, start)[0]])
        return both[:, nz:].reshape(n, count, nz).transpose(0, 2, 1)


def _same(p: Array, n: int) -> tuple[Array, NDArray[np.intp]]:
    """Return one parameter row shared by all samples."""
    return p[None, :], np.zeros(n, np.intp)


def _settled(old: Array, new: Array) -> bool:
    """Return True if only rounding has changed."""
    if not new.size:
        return True
    size = max(float(np.abs(new).max()), 1e-12)
    return bool(np.abs(new - old).max() <= SETTLED * size)
