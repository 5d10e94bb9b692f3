"""Functions that differentiate the steps of an integrator, one name at a time or in lanes.

A step differentiated with respect to one name contains the step itself, which is the same for all
names, and a part that is linear in the derivatives. With vectors of one lane per name, the step
costs as much as for a single name, and the linear part is evaluated for all names at once. The
operations are the same as name by name, and so are the bits.
"""

from collections.abc import Sequence
from functools import cache, cached_property, partial
from pathlib import Path
from typing import final

import casadi as ca
import numpy as np

from symfric.foundation.numeric import Array
from symfric.integrator.compiled.columns import NAME, Columns, filled
from symfric.integrator.derivatives.path import Parameters, of_data
from symfric.integrator.equations.expressions import branchless, divided_once
from symfric.integrator.many.vectors import lanes_header, vector_source
from symfric.integrator.methods.attempt import build_dense_step
from symfric.integrator.running.integrator import Integrator

FEW, MANY = 4, 8
"""Numbers of lanes: for up to four names, and for more."""


def lanes_source(one: ca.Function, of_d: Array) -> str:
    """Return the C of a sweep over rows (`compiled.columns`) for the names of `of_d` (n_d, names).

    `one` is (X, y, h, d, d', ...) -> (X of the next step, column) for one name. If there are
    further arguments, the last of them also differs between names. The column of all names consists
    of parts as long as y; each part holds the columns of all names, one after another.
    """
    text, slots = vector_source("symfric_one", one)
    names, sizes = of_d.shape[1], [one.numel_in(i) for i in range(one.n_in())]
    lanes = FEW if names <= FEW else MANY
    seeds = np.zeros((-(-names // lanes) * lanes, max(1, sizes[4])))
    seeds[:names, : sizes[4]] = of_d.T
    common, own = list[str](), ["      symfric_lanes(a0, X, X_SIZE, b);"]
    for i, size in enumerate(sizes):
        place = f"in + {i if i < 4 else i - 1}"
        if i > 4 and i == len(sizes) - 1:
            own.append(f"      symfric_lanes(a{i}, symfric_at({place}, k), {size}, b);")
        elif i not in (0, 4):
            common.append(f"    symfric_same(a{i}, {place}, k, {size});")
    return lanes_header(lanes) + filled(
        Path(__file__).with_name("lanes.c"), functions=text, loop=NAME, names=names, x=sizes[0],
        n=sizes[1], column=one.numel_out(1), data=sizes[4], width=seeds.shape[1],
        seeds=", ".join(map(repr, seeds.ravel().tolist())), slots=max(1, slots),
        symbols=", ".join(f"a{i}[{max(1, size)}]" for i, size in enumerate(sizes)),
        arguments=", ".join(f"a{i}" for i in range(len(sizes))),
        common="\n".join(common), own="\n".join(own),
    )  # fmt: skip


LARGE = 5000
"""Number of instructions above which a Function stays unchanged, since rewriting takes time."""


@final
class Derivatives:
    """Functions that differentiate the steps of one integrator, created when first needed.

    Attributes:
        forward, reverse, of_signals, weighted, columns: cached forms of the private methods of the
            same names, and of `Columns`.
    """

    def __init__(self, integrator: Integrator) -> None:
        self.integrator, self.system = integrator, integrator.system
        self.step = build_dense_step(integrator.system, integrator.tableau)
        self.columns = cache(Columns)
        self.forward, self.reverse = cache(self._forward), cache(self._reverse)
        self.of_signals, self.weighted = cache(self._of_signals), cache(self._weighted)

    @property
    def symbols(self) -> list[ca.SX]:
        """Arguments y, h, d of the step."""
        return [ca.SX.sym(name, self.step.numel_in(i)) for i, name in enumerate("yhd")]

    @property
    def at_times(self) -> list[ca.SX]:
        """Arguments t, y, d of signals and events."""
        y, t, d = self.symbols
        return [t, y, d]

    def _forward(self, parameters: Parameters, linked: bool) -> Columns:
        """Return (X, y, h, d) -> (X of the next step, Z).

        X holds the derivatives of the start of the step, shape (n, names), and Z those of its end
        and of each row of its dense output. If steps are `linked` (`links`), X has one more row,
        for the time of the start, and there are additional arguments: share, fall, by_state
        transposed, by_data d'.
        """
        one, names = self._by_one(linked), len(parameters)
        single, *steps = one.sx_in()
        of_d = ca.DM(of_data(parameters, steps.pop(3).numel()))
        X = ca.SX.sym("X", single.numel(), names)
        if linked:
            steps[-1] = ca.SX.sym("by_data", single.numel(), names)
        behind, columns = list[ca.SX](), list[list[ca.SX]]()
        for i in range(names):
            own = [*steps[:-1], steps[-1][:, i]] if linked else steps
            found = one(X[:, i], *own[:3], ca.SX(ca.sparsify(of_d[:, i])), *own[3:])
            behind.append(found[0])
            columns.append(ca.vertsplit(found[1], self.system.n))
        column = ca.vertcat(*(part for parts in zip(*columns, strict=True) for part in parts))
        results = ca.cse([ca.densify(ca.horzcat(*behind)), ca.densify(column)])
        function = ca.Function("forward", [X, *steps], results)
        source = partial(lanes_source, one, of_d.full()) if names > 1 else None
        return Columns(function, chained=True, source=source)

    def _by_one(self, linked: bool) -> ca.Function:
        """Return (X, y, h, d, d', ...) -> the same for one name; d' is the derivative of d."""
        n, (y, h, d) = self.system.n, self.symbols
        X, of_d = ca.SX.sym("X", n + linked), ca.SX.sym("of_d", d.numel())
        of_h = -X[n:] if linked else ca.SX(1, 1)
        pushed = self.step.forward(1)(y, h, d, self.step(y, h, d), X[:n], of_h, of_d)
        behind, more = pushed[:n], list[ca.SX]()
        if linked:
            more = [*self._link(), ca.SX.sym("by_data", n + 1)]
            share, fall, by_state, by_data = more
            parts = enumerate(ca.vertsplit(pushed, n), start=1)
            F = sum((share[i] * part for i, part in parts), share[0] * X[:n])
            behind = by_state.T @ (F + fall * X[n]) + by_data
        results = [ca.densify(behind), ca.densify(pushed)]
        return fast("one", [X, y, h, d, of_d, *more], results)

    def _link(self) -> list[ca.SX]:
        """Return the arguments share, fall and by_state transposed of the link after a step."""
        n = self.system.n
        share = ca.SX.sym("share", self.step.numel_out(0) // n + 1)
        return [share, ca.SX.sym("fall", n), ca.SX.sym("by_state", n, n + 1)]

    def _reverse(self, linked: bool) -> Columns:
        """Return (adjoint of the next X, y, h, d, weights) -> (adjoint of X, of d).

        `weights` are those of the start and of all results of the step, end first. If steps are
        `linked`, there are additional arguments: weight of the time of the start, share, fall,
        by_state, and by_data transposed.
        """
        n, (y, h, d) = self.system.n, self.symbols
        every = self.step(y, h, d)
        after, weights = ca.SX.sym("after", n + linked), ca.SX.sym("w", n + every.numel())
        more = list[ca.SX]()
        if linked:
            of_t, by_data = ca.SX.sym("of_t"), ca.SX.sym("by_data", d.numel(), n + 1)
            share, fall, by_state = self._link()
            more, of_F = [of_t, share, fall, by_state, by_data], by_state @ after
            whole = weights + ca.vec(of_F @ share.T)
            by_y, by_h, by_d = self.step.reverse(1)(y, h, d, every, whole[n:])
            results = [ca.vertcat(by_y + whole[:n], of_t + ca.dot(fall, of_F) - by_h)]
            results.append(by_d + by_data @ after)
        else:
            inner = weights[n:] + ca.vertcat(after, ca.SX(every.numel() - n, 1))
            by_y, _, by_d = self.step.reverse(1)(y, h, d, every, inner)
            results = [by_y + weights[:n], by_d]
        arguments = [after, y, h, d, weights, *more]
        function = fast("reverse", arguments, [ca.densify(result) for result in results])
        return Columns(function, chained=True)

    def many(self, function: ca.Function, rows: Sequence[Array], backend: str) -> list[Array]:
        """Return the results of one of these Functions for the rows of arrays."""
        return self.columns(function)(rows, backend=backend)

    @cached_property
    def algebraic(self) -> ca.Function:
        """Function (y, d) -> derivatives of the algebraic equations with respect to y and to d."""
        s = self.system
        alg = s.f[s.algebraic[0]]
        return ca.Function("algebraic", [s.y, s.d], [ca.jacobian(alg, s.y), ca.jacobian(alg, s.d)])

    @cached_property
    def assembly(self) -> ca.Function | None:
        """Function (y, d) -> derivatives of a mechanism's start by y and by d; None for others."""
        if self.system.manifold is None:
            return None
        y, _, d = self.symbols
        on = self.system.manifold.project(y, d)
        return ca.Function("assembly", [y, d], [ca.jacobian(on, y), ca.jacobian(on, d)])

    @cached_property
    def rates(self) -> ca.Function:
        """Function (y, d) -> matrix and right-hand side for the rates y' of all unknowns.

        Equations without rates are differentiated with respect to time: M y' = f and g_y y' = 0.
        """
        s, (rows, _) = self.system, self.system.algebraic
        matrix, right = ca.SX(s.mass), ca.SX(s.f)
        if rows:
            matrix[rows, :] = ca.jacobian(s.f[rows], s.y)
            right[rows] = 0
        return ca.Function("rates", [s.y, s.d], [matrix, right])

    @cached_property
    def of_events(self) -> ca.Function:
        """Function (t, y, d) -> derivatives of the event expressions with respect to t, y and d."""
        return self._slopes("of_events", self.integrator.events)

    @cached_property
    def of_resets(self) -> ca.Function:
        """Function (t, y, d) -> derivatives of all reset values with respect to t, y and d."""
        return self._slopes("of_resets", self.integrator.resets)

    def _slopes(self, name: str, function: ca.Function) -> ca.Function:
        values = function(*(arguments := self.at_times))
        return ca.Function(name, arguments, [ca.jacobian(values, x) for x in arguments])

    def _of_signals(self, parameters: Parameters) -> Columns:
        """Return (t, y, d, S) -> derivatives of all signals, shape (signals, names)."""
        arguments = self.at_times
        of_d = ca.SX(ca.sparsify(ca.DM(of_data(parameters, arguments[2].numel()))))
        S = ca.SX.sym("S", self.system.n, len(parameters))
        values, direction = self.integrator.signals(*arguments), ca.vertcat(S, of_d)
        pushed = ca.jtimes(values, ca.vertcat(*arguments[1:]), direction)
        return Columns(fast("of_signals", [*arguments, S], [ca.densify(pushed)]))

    def _weighted(self, used: tuple[int, ...]) -> Columns:
        """Return (t, y, d, weights) -> derivatives of a weighted sum of signals by y and by d.

        Only signals in `used` are included: other signals may have no derivative, such as a norm at
        zero.
        """
        t, y, d = self.at_times
        values, w = self.integrator.signals(t, y, d)[list(used)], ca.SX.sym("w", len(used))
        results = [ca.densify(ca.jtimes(values, x, w, True)) for x in (y, d)]
        return Columns(fast("weighted", [t, y, d, w], results))


def fast(name: str, arguments: list[ca.SX], results: list[ca.SX]) -> ca.Function:
    """Return the Function with fewer divisions and tanh written out; unchanged if it is large.

    A step divides several times by one number and calls tanh; its derivatives do so more often.
    """
    function = ca.Function(name, arguments, ca.cse(results))
    if function.n_instructions() > LARGE:
        return function
    ends = np.cumsum([0, *(result.numel() for result in results)]).tolist()
    column = divided_once(ca.vertcat(*(ca.vec(result) for result in ca.cse(results))))
    parts = ca.vertsplit(column, ends)
    shaped = [ca.reshape(a, b.shape) for a, b in zip(parts, results, strict=True)]
    return branchless(ca.Function(name, arguments, ca.cse(shaped)), LARGE)


def derivatives(integrator: Integrator) -> Derivatives:
    """Return the Functions for `integrator`, which caches them."""
    if "derivatives" not in integrator.memory:
        integrator.memory["derivatives"] = Derivatives(integrator)
    return integrator.memory["derivatives"]
