"""Functions that differentiate the steps of an integrator, one name at a time or in lanes.

A step differentiated by one name contains the step itself, the same for all names, and a part
linear in the derivatives. On vectors with one lane per name the former costs as much as alone, and
the latter
is done for all names at once, in the same operations as one after another: with the same bits.
"""

from dataclasses import dataclass
from functools import cached_property, partial
from string import Template
from typing import final
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.integrator.compiled.columns import NAME, Columns
from symfric.integrator.derivatives.path import Seeds
from symfric.integrator.equations.expressions import branchless, divided_once
from symfric.integrator.equations.system import System
from symfric.integrator.many.vectors import lanes_header, vector_source
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.step.attempt import build_dense_step

Array = NDArray[np.float64]
FEW, MANY = 4, 8
"""Lanes for up to as many names, and for more."""
ONE = (
    "exp", "expm1", "log", "log1p", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh",
    "acosh", "atanh", "erf",
)  # fmt: skip
TWO = ("pow", "atan2", "hypot", "fmod", "remainder")
"""Functions whose arguments are the same in all lanes: libm is called once."""


def lanes_source(one: ca.Function, of_d: Array) -> str:
    """Return the C of a sweep over rows (`compiled.columns`) by the names of `of_d` (n_d, names).

    `one` is (X, y, h, d, d', ...) -> (X of the next step, column) of one name. The last of any
    further arguments also differs from name to name. In the column of all names, the columns of
    each name follow each other in parts as long as y.
    """
    text, slots = vector_source("symfric_one", one)
    names, sizes = of_d.shape[1], [one.numel_in(i) for i in range(one.n_in())]
    own = {0, len(sizes) - 1} if len(sizes) > 5 else {0}
    lanes = FEW if names <= FEW else MANY
    seeds = np.zeros((-(-names // lanes) * lanes, max(1, sizes[4])))
    seeds[:names, : sizes[4]] = of_d.T
    places = [i if i < 4 else i - 1 for i in range(len(sizes))]
    common = [i for i in range(len(sizes)) if i not in own and i != 4]
    return (
        lanes_header(lanes)
        + "".join(f"#define v_{f}(x) ALL({f}((x)[0]))\n" for f in ONE)
        + "".join(f"#define v_{f}(x, y) ALL({f}((x)[0], (y)[0]))\n" for f in TWO)
        + _ANGLES
        + text
        + Template(_LOOP).substitute(
            loop=NAME,
            names=names,
            x=sizes[0],
            n=sizes[1],
            column=one.numel_out(1),
            data=sizes[4],
            width=seeds.shape[1],
            seeds=", ".join(repr(x) for x in seeds.ravel().tolist()),
            symbols=", ".join(f"a{i}[{max(1, size)}]" for i, size in enumerate(sizes)),
            arguments=", ".join(f"a{i}" for i in range(len(sizes))),
            slots=max(1, slots),
            common="\n".join(
                f"    symfric_same(a{i}, in + {places[i]}, k, {sizes[i]});" for i in common
            ),
            own="\n".join(
                f"      symfric_lanes(a{i}, {_begin(i, places[i])}, {sizes[i]}, b);"
                for i in sorted(own)
            ),
        )
    )


def _begin(argument: int, place: int) -> str:
    """Return the address of the row of an argument that has one column per name."""
    return "X" if argument == 0 else f"symfric_at(in + {place}, k)"


_ANGLES = """
#define v_sincos symfric_sincos
static inline V symfric_sincos(V x, V *other)
{
  *other = ALL(cos(x[0]));
  return ALL(sin(x[0]));
}
"""
_LOOP = """
enum { NAMES = $names, N = $n, X_SIZE = $x, COLUMN = $column };
typedef struct { char *at; long long apart; const long long *of; } symfric_place;
static const double symfric_seeds[] = { $seeds };

static const double *symfric_at(const symfric_place *p, long long k)
{
  return (const double *)(p->at + (p->of ? p->of[k] : k) * p->apart);
}

static void symfric_same(V *a, const symfric_place *p, long long k, int size)
{
  const double *x = symfric_at(p, k);
  int i;
  for (i = 0; i < size; ++i) a[i] = ALL(x[i]);
}

/* Loads the columns of the names from b on, one per lane. */
static void symfric_lanes(V *a, const double *x, int size, int b)
{
  int i, j;
  for (i = 0; i < size; ++i)
    for (j = 0; j < LANES; ++j) a[i][j] = b + j < NAMES ? x[(b + j) * size + i] : 0;
}

void $loop(long long count, int chained, const symfric_place *in, const symfric_place *out)
{
  V $symbols, next[X_SIZE], column[COLUMN], w[$slots];
  const V *arg[] = { $arguments };
  V *res[] = { next, column };
  const double *X = (const double *)in[0].at;
  long long k;
  int i, j, b;
  for (k = 0; k < count; ++k) {
    double *to = (double *)(out[0].at + k * out[0].apart);
    double *parts = (double *)(out[1].at + k * out[1].apart);
$common
    for (b = 0; b < NAMES; b += LANES) {
$own
      for (i = 0; i < $data; ++i)
        for (j = 0; j < LANES; ++j) a4[i][j] = symfric_seeds[(b + j) * $width + i];
      symfric_one(arg, res, w);
      for (j = 0; j < LANES && b + j < NAMES; ++j) {
        for (i = 0; i < X_SIZE; ++i) to[(b + j) * X_SIZE + i] = next[i][j];
        for (i = 0; i < COLUMN; ++i)
          parts[(i / N * NAMES + b + j) * N + i % N] = column[i][j];
      }
    }
    X = to;
  }
}
"""


LARGE = 5000
"""Functions with more instructions stay unchanged: rewriting takes time."""


@final
@dataclass(eq=False)
class Derivatives:
    """Functions that differentiate the steps of one integrator, made when first needed."""

    system: System
    step: ca.Function
    signals: ca.Function
    events: ca.Function
    resets: ca.Function

    def __post_init__(self) -> None:
        self._forward: dict[tuple[int, ...], Columns] = {}
        self._reverse: dict[bool, Columns] = {}
        self._many: dict[str, Columns] = {}
        self._weighted: dict[tuple[int, ...], Columns] = {}
        self._signals: dict[tuple[int, ...], Columns] = {}

    @property
    def symbols(self) -> list[ca.SX]:
        """Arguments y, h, d of the step."""
        return [ca.SX.sym(name, self.step.numel_in(i)) for i, name in enumerate("yhd")]

    def forward(self, which: Seeds, linked: bool) -> Columns:
        """Return (X, y, h, d) -> (X of the next step, Z of its end and of each row of its dense
        output).

        X holds the derivatives of the start, shape (n, names). If steps are `linked` (`links`), it
        has one more row, of the time of the start, and there are arguments share, fall, by_state
        transposed, by_data d'.
        """
        key = (linked, *which.parameters)
        if key not in self._forward:
            one, names = self._by_one(linked), len(which.names)
            single, *steps = one.sx_in()
            of_d = ca.DM(which.of_data(steps.pop(3).numel()))
            X = ca.SX.sym("X", single.numel(), names)
            if linked:
                steps[-1] = ca.SX.sym("by_data", single.numel(), names)
            behind, columns = list[ca.SX](), list[ca.SX]()
            for i in range(names):
                own = [*steps[:-1], steps[-1][:, i]] if linked else steps
                found = one(X[:, i], *own[:3], ca.SX(ca.sparsify(of_d[:, i])), *own[3:])
                behind.append(found[0])
                columns.append(ca.reshape(found[1], self.system.n, -1))
            parts = zip(*map(ca.horzsplit, columns), strict=True)
            column = ca.vertcat(*(part for every in parts for part in every))
            results = ca.cse([ca.densify(ca.horzcat(*behind)), ca.densify(column)])
            function = ca.Function("forward", [X, *steps], results)
            source = partial(lanes_source, one, of_d.full()) if names > 1 else None
            self._forward[key] = Columns(function, chained=True, source=source)
        return self._forward[key]

    def _by_one(self, linked: bool) -> ca.Function:
        """Return (X, y, h, d, d', ...) -> the same by one name, with the derivatives d' of d by
        it.
        """
        n, (y, h, d) = self.system.n, self.symbols
        X, of_d = ca.SX.sym("X", n + linked), ca.SX.sym("of_d", d.numel())
        of_h = -X[n:] if linked else ca.SX(1, 1)
        pushed = self.step.forward(1)(y, h, d, self.step(y, h, d), X[:n], of_h, of_d)
        parts, behind, more = ca.vertsplit(pushed, n), pushed[:n], list[ca.SX]()
        if linked:
            more = [*self._link(len(parts)), ca.SX.sym("by_data", n + 1)]
            share, fall, by_state, by_data = more
            F = sum((share[i + 1] * part for i, part in enumerate(parts)), share[0] * X[:n])
            behind = by_state.T @ (F + fall * X[n]) + by_data
        results = [ca.densify(behind), ca.densify(pushed)]
        return fast("one", [X, y, h, d, of_d, *more], results)

    def _link(self, parts: int) -> list[ca.SX]:
        """Return the arguments share, fall, by_state transposed of a link after a step."""
        n = self.system.n
        share, fall = ca.SX.sym("share", parts + 1), ca.SX.sym("fall", n)
        return [share, fall, ca.SX.sym("by_state", n, n + 1)]

    def reverse(self, linked: bool) -> Columns:
        """Return (adjoint of the next X, y, h, d, weights) -> (adjoint of X, of d).

        `weights` are those of the start and of all results of the step, end first. If steps are
        `linked`, there are arguments weight of the time of the start, share, fall, by_state and
        by_data transposed.
        """
        if linked not in self._reverse:
            n, (y, h, d) = self.system.n, self.symbols
            every = self.step(y, h, d)
            after, weights = ca.SX.sym("after", n + linked), ca.SX.sym("w", n + every.numel())
            more, of_F = list[ca.SX](), after
            if linked:
                of_t, by_data = ca.SX.sym("of_t"), ca.SX.sym("by_data", d.numel(), n + 1)
                share, fall, by_state = self._link(every.numel() // n)
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
            self._reverse[linked] = Columns(function, chained=True)
        return self._reverse[linked]

    def many(self, function: ca.Function, rows: list[Array], backend: str) -> list[Array]:
        """Return results of one of the Functions here for the rows of arrays."""
        if function.name() not in self._many:
            self._many[function.name()] = Columns(function)
        return self._many[function.name()](rows, backend=backend)

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
    def rates(self) -> ca.Function:
        """(y, d) -> matrix and right-hand side of all rates y', also of algebraic unknowns.

        Equations without rates are differentiated by time: M y' = f and g_y y' = 0.
        """
        s, (rows, _) = self.system, self.system.algebraic
        matrix, right = ca.SX(s.mass), ca.SX(s.f)
        if rows:
            matrix[rows, :] = ca.jacobian(s.f[rows], s.y)
            right[rows] = 0
        return ca.Function("rates", [s.y, s.d], [matrix, right])

    @cached_property
    def of_events(self) -> ca.Function:
        """Derivatives of the event expressions (t, y, d) -> (by t, by y, by d)."""
        return _slopes("of_events", self.events)

    @cached_property
    def of_resets(self) -> ca.Function:
        """Derivatives of the values of all resets, likewise."""
        return _slopes("of_resets", self.resets)

    def of_signals(self, which: Seeds) -> Columns:
        """Return derivatives of all signals (t, y, d, S) -> (signals, names)."""
        if which.parameters not in self._signals:
            names, arguments = len(which.names), self.at_times
            of_d = ca.SX(ca.sparsify(ca.DM(which.of_data(arguments[2].numel()))))
            S = ca.SX.sym("S", self.system.n, names)
            values, direction = self.signals(*arguments), ca.vertcat(S, of_d)
            pushed = ca.jtimes(values, ca.vertcat(*arguments[1:]), direction)
            self._signals[which.parameters] = Columns(
                fast("of_signals", [*arguments, S], [ca.densify(pushed)])
            )
        return self._signals[which.parameters]

    @property
    def at_times(self) -> list[ca.SX]:
        """Arguments t, y, d of the signals."""
        return [ca.SX.sym(n, self.signals.numel_in(i)) for i, n in enumerate("tyd")]

    def weighted(self, used: tuple[int, ...]) -> Columns:
        """Return derivatives of a weighted sum of signals (t, y, d, weights) -> (by y, by d).

        Only signals in `used` are included: others may have no derivative, such as a norm at zero.
        """
        if used not in self._weighted:
            t, y, d = self.at_times
            values, w = self.signals(t, y, d)[list(used)], ca.SX.sym("w", len(used))
            results = [ca.densify(ca.jtimes(values, x, w, True)) for x in (y, d)]
            self._weighted[used] = Columns(fast("weighted", [t, y, d, w], results))
        return self._weighted[used]


def fast(name: str, arguments: list[ca.SX], results: list[ca.SX]) -> ca.Function:
    """Return the Function with fewer divisions and tanh written out; unchanged if it is large.

    A step divides several times by one number and calls tanh, and its derivatives more often.
    """
    function = ca.Function(name, arguments, ca.cse(results))
    if function.n_instructions() > LARGE:
        return function
    ends = np.cumsum([0, *(result.numel() for result in results)]).tolist()
    column = divided_once(ca.vertcat(*(ca.vec(result) for result in ca.cse(results))))
    parts = ca.vertsplit(column, ends)
    shaped = [ca.reshape(a, b.shape) for a, b in zip(parts, results, strict=True)]
    return branchless(ca.Function(name, arguments, ca.cse(shaped)), LARGE)


def _slopes(name: str, function: ca.Function) -> ca.Function:
    """Return derivatives of a Function (t, y, d) by each of its arguments."""
    arguments = [ca.SX.sym(n, function.numel_in(i)) for i, n in enumerate("tyd")]
    values = function(*arguments)
    return ca.Function(name, arguments, [ca.jacobian(values, x) for x in arguments])


_MADE: WeakKeyDictionary[Integrator, Derivatives] = WeakKeyDictionary()


def derivatives(integrator: Integrator) -> Derivatives:
    """Return the Functions for `integrator`."""
    if integrator not in _MADE:
        _MADE[integrator] = Derivatives(
            integrator.system,
            build_dense_step(integrator.system, integrator.tableau),
            integrator.signals,
            integrator.events,
            integrator.resets,
        )
    return _MADE[integrator]
