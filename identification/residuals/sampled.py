"""Equations at the samples of a record, with exact derivatives by the parameters.

States of laws follow the imposed velocity and normal force from sample to sample (`imposed_step`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, NamedTuple, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.unknowns.spec import Unknown
from symfric.foundation.numeric import Scalar
from symfric.foundation.programs import CompileError, find_compiler
from symfric.integrator.compiled.columns import Columns
from symfric.laws import Law

Array = NDArray[np.float64]

NEAR_REST = 0.05
"""Initial velocity relative to the usual one below which a record starts at rest."""


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

    The sample consists of two steps, each with its mean velocity and load held. A step is an exact
    exponential for bristles, an exact event step for yielding elements, and of second order
    otherwise (`symfric.codegen.blocks.held_step`). The steps meet in the middle, or where the
    velocity passes through zero, so that no step includes two directions. The smooth form of GMS
    takes the step of its event form, which slips later by up to the share rho of the limit.

    Args:
        law: law with states; its parameters may be symbols.
        z: SX symbols of its states.
        before, after: velocity, normal force and further inputs at the two samples.
        h: sample interval [s].
        where: beginning of the error message.

    Raises:
        ValueError: modes or states of the law are coupled, so that only a simulation can follow it.
    """
    from symfric.codegen.blocks.held_step import advanced  # noqa: PLC0415 (slow to import)
    from symfric.laws import GMS  # noqa: PLC0415 (slow to import)

    v, N, size = (ca.SX.sym(name) for name in ("v", "N", "h"))
    names = list(before[2])
    given = {name: ca.SX.sym(name) for name in names}
    rate = ca.SX(law.rate(v, N, z, **given))
    stepped = law
    if isinstance(law, GMS) and law.form != "event":
        stepped = replace(law, form="event")
    try:
        end = advanced(stepped, v, N, z, rate, given, size, where).end
    except ValueError:
        raise ValueError(
            f"{where}: expected a law with a step for imposed velocity, got {type(law).__name__}, "
            "whose modes or states are coupled; use Shooting(), which simulates"
        ) from None
    first, last = (ca.vertcat(ca.SX(v), ca.SX(N), *(ca.SX(inputs[name]) for name in names))
                   for v, N, inputs in (before, after))  # fmt: skip
    crosses = first[0] * last[0] < 0
    share = ca.if_else(crosses, first[0] / (first[0] - last[0] + (1 - crosses)), 0.5)
    middle = first + share * (last - first)
    middle[0] = ca.if_else(crosses, 0, middle[0])
    old = ca.vertcat(v, N, *given.values(), size)
    half = ca.substitute(end, old, ca.vertcat((first + middle) / 2, share * h))
    new = ca.vertcat((middle + last) / 2, (1 - share) * h, half)
    return ca.substitute(end, ca.vertcat(old, z), new)


def moving_start(v: Array) -> float:
    """Return the initial velocity for the states: the first sample, or 0 if it is near rest.

    A bristle that has slid far is fully bent at the smallest speed; at rest it is assumed relaxed.
    """
    return float(v[0]) if abs(v[0]) > NEAR_REST * usual(v) else 0.0


PRELOAD = 4.0
"""Largest initial deflection of a bristle relative to that of steady sliding at the usual speed.

In slow sliding it is larger by the ratio of static and kinetic level."""


def begun(law: Law, start: tuple[Scalar, Scalar], usual: float, share: ca.SX) -> ca.SX:
    """Return the states of `law` at the start of a record, (nz, 1).

    Bristles, the states that change sign with the velocity, have a common share of their values in
    steady sliding. Other states, such as the age of a contact, have those of steady sliding.

    Args:
        law: law with states.
        start: initial velocity and normal force.
        usual: speed at which the share is one.
        share: symbol of the share; 1 after sliding forwards, -1 after sliding backwards, 0 relaxed.
    """
    steady, bent = (ca.SX(law.steady_state(v, start[1])) for v in (start[0], usual))
    even = [state.even for state in law.states]
    return ca.vertcat(*(steady[i] if e else share * bent[i] for i, e in enumerate(even)))


def preload(name: str, v: Array) -> Unknown:
    """Return the unknown share of `begun` for the velocity v over time of one record.

    It starts in steady sliding, or relaxed if the first sample is near rest.
    """
    first = float(np.sign(moving_start(v)))
    return Unknown(name, "1", first, -PRELOAD, PRELOAD, 1.0, nuisance=True)


def usual(v: Array) -> float:
    """Return the root mean square of a velocity, or 1 for one at rest."""
    return float(np.sqrt(np.mean(v**2))) or 1.0


LONG = 20_000
"""Number of samples above which a static law is compiled if that is expected to save time."""
NEWTON = 20
"""Largest number of Newton steps for the algebraic unknowns of all samples together."""
ROUNDS = 40
"""Largest number of alternations between algebraic unknowns and states along the record."""
SETTLED = 1e-9
"""Relative change of the algebraic unknowns below which they have converged."""


class RecordRows(NamedTuple):
    """Rows along a record of n samples, (n, m), and their derivatives by p, (n, m, n_p)."""

    rows: Array
    slopes: Array


@final
@dataclass(frozen=True, eq=False)
class Sampled:
    """Equations at each sample of a record, as numeric Functions.

        0 = g(w, z, y, p)                 algebraic unknowns y: reactions, normal forces
        z_{k+1} = step(z_k, w_k, y_k, w_{k+1}, y_{k+1}, h, p),   z_0 = start(w_0, y_0, p)
        r = rows(w, z, y, p)

    Laws with states run in compiled code if there is a compiler, other laws in CasADi's virtual
    machine; for a long record, until compiling is expected to save time. The results are
    bit-identical.

    Attributes:
        rows, g, start: Functions of (w, y), z, p with derivatives by (z, y, p).
        step, tangent: the step of z, and the same with derivatives by p.
        sizes: numbers of w, z, y and p.
        linear: True if the rows are linear in p.
        guess: start values of y, shape (ny,).
    """

    rows: ca.Function
    g: ca.Function
    start: ca.Function
    step: ca.Function
    tangent: ca.Function
    sizes: tuple[int, int, int, int]
    linear: bool
    guess: Array

    @classmethod
    def of(
        cls, w: ca.SX, p: ca.SX, rows: ca.SX, *,
        z: ca.SX | None = None, start: ca.SX | None = None, step: ca.SX | None = None,
        later: ca.SX | None = None, h: ca.SX | None = None,
        y: ca.SX | None = None, g: ca.SX | None = None, guess: Sequence[float] = (),
    ) -> "Sampled":  # fmt: skip
        """Return the Functions for SX expressions.

        Args:
            w, z, y, p: symbols of measured quantities, law states, unknowns and parameters.
            rows, g, start: expressions in these symbols.
            step: expression in z, w, y, p, `h` and `later`.
            later: symbols of w_{k+1} and y_{k+1}.
            h: symbol of the sample interval.
            guess: start values of y, shape (ny,).
        """
        none = ca.SX(0, 1)
        z, y, g, start, step = (none if x is None else x for x in (z, y, g, start, step))
        nw, nz, ny, count = sizes = (w.numel(), z.numel(), y.numel(), p.numel())
        h = ca.SX.sym("h") if h is None else h
        later = later if nz and later is not None else ca.SX.sym("later", nw + ny)
        here, along = ca.vertcat(w, y), ca.vertcat(z, y, p)

        def with_slopes(name: str, of: ca.SX) -> ca.Function:
            slopes = ca.vec(ca.densify(ca.jacobian(of, along)))
            return ca.Function(f"sampled_{name}", [here, z, p], [ca.densify(of), slopes])

        # derivatives by p: S of the states, Y of y at this sample, Y_later of y at the next sample
        S, Y, Y_later = (ca.SX.sym(n, k, count) for n, k in (("S", nz), ("Y", ny), ("Yl", ny)))
        slope = (
            ca.mtimes(ca.jacobian(step, z), S)
            + ca.jacobian(step, p)
            + ca.mtimes(ca.jacobian(step, y), Y)
            + ca.mtimes(ca.jacobian(step, later[nw:, 0]), Y_later)
        )
        given, moved = [here, later, h], [ca.vec(Y), ca.vec(Y_later)]
        both, new = ca.vertcat(z, ca.vec(S)), ca.vertcat(step, ca.vec(ca.densify(slope)))
        return cls(
            with_slopes("rows", rows),
            with_slopes("g", g),
            with_slopes("start", start),
            ca.Function("sampled_step", [z, *given, p], [ca.densify(step)]),
            ca.Function("sampled_tangent", [both, *given, *moved, p], [ca.densify(new)]),
            sizes,
            not (nz or ny) and not ca.depends_on(ca.jacobian(rows, p), p),
            np.array(guess, float),
        )

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields without compiled code; a copy compiles or loads its own code."""
        return {item.name: getattr(self, item.name) for item in fields(self)}

    @cached_property
    def _columns(self) -> dict[str, Columns]:
        names = ("rows", "g", "start", "step", "tangent")
        return {n: Columns(getattr(self, n), n in ("step", "tangent")) for n in names}

    def run(self, name: str, rows: list[Any], first: Array | None = None) -> list[Array]:
        """Return the results of a Function for all `rows`; see `Columns`."""
        if self.sizes[1] and name != "start" and find_compiler() is not None:
            try:
                return self._columns[name](rows, first, "compiled")
            except CompileError:  # a broken compiler does not prevent the evaluation
                pass
        return self._columns[name](rows, first, "auto" if rows[0].shape[0] > LONG else "vm")

    def along(
        self, w: Array, h: float | Array, p: Array, begin: Array | None = None
    ) -> RecordRows | str:
        """Return rows at all samples and their derivatives by p, or a message on failure.

        Args:
            w: measured quantities, shape (nw, n).
            h: sample interval [s], one or (n - 1,); not used without states.
            p: parameters, shape (n_p,).
            begin: values of w for the start of the states, shape (nw,); None: the first sample.
        """
        return _Along(self, w.T, h, p, w[:, 0] if begin is None else begin).path()


def scaled(
    of: Sampled | None, w: Array, h: float, p: Array, k: int, sizes: Array
) -> RecordRows | None:
    """Return the rows of block k at n samples, times `sizes` / sqrt(n), and their derivatives by p.

    Blocks have as many rows as `sizes`. None: no rows, or not finite.
    """
    found = "" if of is None else of.along(w, h, p)
    if isinstance(found, str):
        return None
    place, each = slice(k * sizes.size, (k + 1) * sizes.size), sizes / np.sqrt(w.shape[1])
    return RecordRows(found.rows[:, place] * each, found.slopes[:, place] * each[:, None])


class _Along:
    """Evaluation of a record of n samples at the parameters p."""

    def __init__(self, of: Sampled, w: Array, h: float | Array, p: Array, begin: Array) -> None:
        self.of, self.w, self.p, self.begin, self.n = of, w, p, begin, w.shape[0]
        _, self.nz, self.ny, self.count = of.sizes
        self.h = np.ascontiguousarray(np.broadcast_to(h, self.n - 1).reshape(-1, 1))
        self.z = np.zeros((self.n, self.nz))
        self.y = np.repeat(of.guess[None, :], self.n, axis=0)
        self.rounds = ROUNDS if self.nz and self.ny else 1

    def path(self) -> RecordRows | str:
        """Return the rows and their derivatives."""
        nz, ny = self.nz, self.ny
        for _ in range(self.rounds):
            old = self.y
            if ny and (why := self.solve()):
                return why
            if nz:
                self.z = self.chained("step", self.first()[0])
            if self.rounds == 1 or _settled(old, self.y):
                break
        else:
            return "friction and the reactions that load it did not converge"
        dz, dy = self.tangents()
        r, at = self.at("rows")
        slopes = at[:, :, nz + ny :].copy()
        if nz:
            slopes += at[:, :, :nz] @ dz
        if ny:
            slopes += at[:, :, nz : nz + ny] @ dy
        if not (np.isfinite(r).all() and np.isfinite(slopes).all()):
            return "the friction law is not finite at some samples"
        return RecordRows(r, slopes)

    def at(self, name: str) -> tuple[Array, Array]:
        """Return values (n, m) and derivatives (n, m, k) of a Function at all samples."""
        return self.evaluated(name, np.hstack([self.w, self.y]), self.z)

    def first(self) -> tuple[Array, Array]:
        """Return the states at the first sample and their derivatives."""
        here = np.hstack([self.begin[None], self.y[:1]])
        value, slopes = self.evaluated("start", here, self.z[:1])
        return value[0], slopes[0]

    def evaluated(self, name: str, here: Array, z: Array) -> tuple[Array, Array]:
        """Return values and derivatives of a Function at some samples."""
        n = here.shape[0]
        value, slopes = self.of.run(name, [here, z, same(self.p, n)])
        return value, slopes.reshape(n, -1, value.shape[1]).transpose(0, 2, 1)

    def solve(self) -> str:
        """Solve for the unknowns of all samples by Newton's method; return a message on failure."""
        y_columns = slice(self.nz, self.nz + self.ny)
        for _ in range(NEWTON):
            g, slopes = self.at("g")
            try:
                step = np.linalg.solve(slopes[:, :, y_columns], g[:, :, None])[:, :, 0]
            except np.linalg.LinAlgError:
                return "the motion does not determine the reactions at some samples"
            if not np.isfinite(step).all():
                return "the equations of the reactions are not finite at some samples"
            self.y = self.y - step
            if _settled(self.y + step, self.y):
                return ""
        return "the reactions were not found by Newton's method at some samples"

    def chained(self, name: str, first: Array, *given: Array) -> Array:
        """Return all results of a Function applied from sample to sample, starting at `first`."""
        here = np.hstack([self.w, self.y])
        rows = [here[:-1], here[1:], self.h, *given, same(self.p, self.n - 1)]
        return np.vstack([first[None, :], self.of.run(name, rows, first)[0]])

    def tangents(self) -> tuple[Array, Array]:
        """Return derivatives of states (n, nz, n_p) and unknowns (n, ny, n_p) by the parameters."""
        nz, ny = self.nz, self.ny
        dz, dy = np.zeros((self.n, nz, self.count)), np.zeros((self.n, ny, self.count))
        by_z, by_p = np.zeros((self.n, ny, nz)), dy
        if ny:
            slopes = self.at("g")[1]
            known = np.concatenate([slopes[:, :, :nz], slopes[:, :, nz + ny :]], axis=2)
            found = -np.linalg.solve(slopes[:, :, nz : nz + ny], known)
            by_z, by_p = found[:, :, :nz], found[:, :, nz:]
        for _ in range(self.rounds):
            old, dy = dy, by_z @ dz + by_p
            if nz:
                dz = self.tangent(dy)
            if self.rounds == 1 or _settled(old, dy):
                break
        return dz, dy

    def tangent(self, dy: Array) -> Array:
        """Return the derivatives of the states by the parameters, given those of y, `dy`."""
        nz, ny = self.nz, self.ny
        first = self.first()[1]
        S = first[:, nz + ny :] + first[:, nz : nz + ny] @ dy[0]
        flat = np.ascontiguousarray(dy.transpose(0, 2, 1)).reshape(self.n, self.count * ny)
        start = np.concatenate([self.z[0], S.T.ravel()])
        both = self.chained("tangent", start, flat[:-1], flat[1:])
        return both[:, nz:].reshape(self.n, self.count, nz).transpose(0, 2, 1)


def same(p: Array, n: int) -> tuple[Array, NDArray[np.intp]]:
    """Return the parameters as one row shared by n samples."""
    return p[None, :], np.zeros(n, np.intp)


def _settled(old: Array, new: Array) -> bool:
    """Return True if two values differ only by rounding."""
    size = max(float(np.abs(new).max(initial=0.0)), 1e-12)
    return bool(np.abs(new - old).max(initial=0.0) <= SETTLED * size)
