"""Derivatives of what was computed: the accepted steps, differentiated with their sizes held fixed.

The step-size controller takes no part (internal numerical differentiation), so the derivatives are
those of the discrete solution and exact to rounding.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import final
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.parameters import check_names
from symfric.integrator.compiled.columns import Columns
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.equations.system import System
from symfric.integrator.running.dense import Dense
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.step.attempt import build_dense_step
from symfric.model import Model

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Seeds:
    """What to differentiate with respect to.

    Attributes:
        names: as the user wrote them: a parameter, or "x0.v" for the start value of a state.
        parameters: row in p of each name, -1 for a start value.
        start: derivative of the start values of x by each name, shape (nx, names).
    """

    names: tuple[str, ...]
    parameters: tuple[int, ...]
    start: Array

    def of_data(self, n_d: int) -> Array:
        """Derivative of the run data d by each name, shape (n_d, names)."""
        selector = np.zeros((n_d, len(self.names)))
        for column, row in enumerate(self.parameters):
            if row >= 0:
                selector[row, column] = 1.0
        return selector


def seeds(
    model: Model,
    names: Sequence[str],
    x0: Mapping[str, float] | None,
    p: Mapping[str, float] | None,
) -> Seeds:
    """Look the names up; `x0` and `p` as in `simulate`.

    A start value that follows from others, as a bristle's in steady sliding does, is differentiated
    along with them.

    Raises:
        ValueError: a name that is neither a free parameter nor "x0." and a state; a model with
            events, whose jumps are not differentiated.
    """
    free, states = [v.name for v in model.p], [v.name for v in model.x]
    known = [*free, *(f"x0.{name}" for name in states)]
    check_names(f"sensitivities of '{model.name}' (parameters must be free)", names, known)
    if model.events:
        raise ValueError(
            f"sensitivities of '{model.name}': expected a model without events, got "
            f"{len(model.events)}; use a smooth or bristle law"
        )
    by_p = model.start_by_parameters(x0, p)
    columns = [
        by_p[:, free.index(n)] if n in free else model.start_by_state(n[3:], x0, p) for n in names
    ]
    rows = tuple(free.index(n) if n in free else -1 for n in names)
    return Seeds(tuple(names), rows, np.column_stack(columns))


@final
@dataclass(frozen=True, eq=False)
class Path:
    """The accepted steps of a run, and the numbers they were made with."""

    integrator: Integrator
    dense: Dense
    inputs: InputData
    p: Array
    backend: str

    def data(self, interval: NDArray[np.intp]) -> Array:
        """Run data d on input intervals, shape (intervals, n_d)."""
        p = np.tile(self.p, (interval.size, 1))
        return np.hstack([p, self.inputs.values[:, interval].T])

    def data_at(self, times: Array) -> Array:
        """Run data d at times, shape (times, n_d)."""
        return self.data(self.inputs.interval(times))

    @cached_property
    def interval(self) -> NDArray[np.intp]:
        """Input interval of every step."""
        return self.inputs.interval((self.dense.t0 + self.dense.t1) / 2)

    @cached_property
    def steps(self) -> list[Array]:
        """Start y, size h and run data d of every step."""
        return [self.dense.y0, self.dense.t1 - self.dense.t0, self.data(self.interval)]

    @cached_property
    def pieces(self) -> list[slice]:
        """Steps between two jumps of the inputs, which algebraic unknowns follow."""
        cuts = [0, self.dense.t0.size]
        if self.integrator.system.algebraic[0]:
            cuts[1:1] = [int(k) + 1 for k in np.flatnonzero(np.diff(self.interval))]
        return [slice(a, b) for a, b in pairwise(cuts)]


@final
@dataclass(eq=False)
class Derivatives:
    """Functions that differentiate the steps of one integrator, made when first needed."""

    system: System
    step: ca.Function
    signals: ca.Function

    def __post_init__(self) -> None:
        self._forward: dict[tuple[int, ...], Columns] = {}

    @property
    def symbols(self) -> list[ca.SX]:
        """Arguments y, h, d of the step."""
        return [ca.SX.sym(name, self.step.numel_in(i)) for i, name in enumerate("yhd")]

    def forward(self, which: Seeds) -> Columns:
        """(S, y, h, d) -> (S after the step, that of its dense output), S of shape (n, names)."""
        if which.parameters not in self._forward:
            n, names = self.system.n, len(which.names)
            y, h, d = self.symbols
            S, of_d = ca.SX.sym("S", n, names), ca.DM(which.of_data(d.numel()))
            pushed = self.step.forward(names)(
                y, h, d, self.step(y, h, d), S, ca.SX(1, names), ca.SX(ca.sparsify(of_d))
            )
            results = ca.cse([ca.densify(pushed[:n, :]), ca.densify(pushed[n:, :])])
            function = ca.Function("forward", [S, y, h, d], results)
            self._forward[which.parameters] = Columns(function, chained=True)
        return self._forward[which.parameters]

    @cached_property
    def reverse(self) -> Columns:
        """(adjoint of the end, y, h, d, weights) -> (adjoint of y, of d).

        `weights` are those of the start and of all results of the step, end first.
        """
        n, (y, h, d) = self.system.n, self.symbols
        every = self.step(y, h, d)
        after, weights = ca.SX.sym("after", n), ca.SX.sym("weights", n + every.numel())
        inner = weights[n:] + ca.vertcat(after, ca.SX(every.numel() - n, 1))
        by_y, _, by_d = self.step.reverse(1)(y, h, d, every, inner)
        results = ca.cse([ca.densify(by_y + weights[:n]), ca.densify(by_d)])
        return Columns(ca.Function("reverse", [after, y, h, d, weights], results), chained=True)

    @cached_property
    def algebraic(self) -> ca.Function:
        """Derivatives of the algebraic equations (y, d) -> (by y, by d)."""
        s = self.system
        alg = s.f[s.algebraic[0]]
        return ca.Function("algebraic", [s.y, s.d], [ca.jacobian(alg, s.y), ca.jacobian(alg, s.d)])

    @cached_property
    def assembly(self) -> ca.Function | None:
        """Derivatives of the start of a mechanism (y, d) -> (by y, by d); None for others."""
        if self.system.manifold is None:
            return None
        y, _, d = self.symbols
        on = self.system.manifold.project(y, d)
        return ca.Function("assembly", [y, d], [ca.jacobian(on, y), ca.jacobian(on, d)])

    @cached_property
    def of_signals(self) -> Columns:
        """Derivatives of the signals (t, y, d) -> (by y, by d)."""
        t, y, d = (ca.SX.sym(n, self.signals.numel_in(i)) for i, n in enumerate("tyd"))
        values = self.signals(t, y, d)
        return Columns(
            ca.Function("of_signals", [t, y, d], [ca.jacobian(values, y), ca.jacobian(values, d)])
        )


_MADE: WeakKeyDictionary[Integrator, Derivatives] = WeakKeyDictionary()


def derivatives(integrator: Integrator) -> Derivatives:
    """The Functions for `integrator`."""
    if integrator not in _MADE:
        step = build_dense_step(integrator.system, integrator.tableau)
        _MADE[integrator] = Derivatives(integrator.system, step, integrator.signals)
    return _MADE[integrator]


def made_consistent(path: Path, piece: slice) -> tuple[Array, Array]:
    """Derivatives of the unknowns at the start of a piece by those before it, and by d.

    Algebraic unknowns follow the others; at the very start those of a mechanism are put onto its
    constraints before.
    """
    made = derivatives(path.integrator)
    n, free = made.system.n, made.system.free
    y, d = path.steps[0][piece.start], path.steps[2][piece.start]
    by_before, by_d = np.eye(n), np.zeros((n, d.size))
    if piece.start == 0 and made.assembly is not None:
        by_before, by_d = (m.full() for m in made.assembly.call([y, d]))
    if free.size:
        slope, more = (m.full() for m in made.algebraic.call([y, d]))
        by_before -= free @ np.linalg.solve(slope @ free, slope @ by_before)
        by_d -= free @ np.linalg.solve(slope @ free, slope @ by_d + more)
    return by_before, by_d


def forward(path: Path, which: Seeds) -> Dense:
    """Derivatives of the solution as dense output of names * n columns, those of a name together.

    All directions go along in one sweep over the steps.
    """
    s, names = path.integrator.system, len(which.names)
    sweep = derivatives(path.integrator).forward(which)
    moved = np.zeros((s.n, names))
    moved[: s.nx] = which.start
    begin, end, bend = [], [], []
    for piece in path.pieces:
        by_before, by_d = made_consistent(path, piece)
        moved = by_before @ moved + by_d @ which.of_data(s.d.numel())
        after, inner = sweep([a[piece] for a in path.steps], moved.T, path.backend)
        begin.append(np.vstack([moved.T.reshape(1, -1), after[:-1]]))
        end.append(after)
        bend.append(inner)
        moved = after[-1].reshape(names, s.n).T
    count = path.dense.t0.size
    D = np.vstack(bend).reshape(count, names, -1, s.n).transpose(0, 2, 1, 3)
    return Dense(
        path.dense.t0,
        path.dense.t1,
        np.vstack(begin),
        np.vstack(end),
        D.reshape(count, -1, names * s.n),
    )


def signal_slopes(path: Path, times: Array) -> tuple[Array, Array]:
    """Derivatives of all signals at times by y and by d, shapes (times, signals, n or n_d)."""
    arguments = [times, path.dense(times).T, path.data_at(times)]
    by_y, by_d = derivatives(path.integrator).of_signals(arguments, backend=path.backend)
    signals, n_d = path.integrator.signals.numel_out(0), path.integrator.system.d.numel()
    # CasADi stores column by column
    by_y = by_y.reshape(times.size, path.integrator.system.n, signals).transpose(0, 2, 1)
    return by_y, by_d.reshape(times.size, n_d, signals).transpose(0, 2, 1)


def of_signals(path: Path, which: Seeds, solution: Dense, times: Array) -> Array:
    """Derivatives of all signals at times, shape (names, signals, times).

    Args:
        path: the run.
        which: what to differentiate with respect to.
        solution: derivatives of the solution, from `forward`.
        times: where [s].
    """
    by_y, by_d = signal_slopes(path, times)
    S = solution(times).reshape(len(which.names), -1, times.size)
    through_y = np.einsum("mrn,snm->srm", by_y, S)
    return through_y + np.einsum("mrd,ds->srm", by_d, which.of_data(by_d.shape[2]))
