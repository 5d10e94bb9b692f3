"""From a problem to a nonlinear program, by Radau collocation on a mesh.

The equations of one interval are one SX Function, mapped over all intervals: its graph, and those
of its derivatives, do not grow with the mesh. The unknowns stand in the order of time, which makes
the Jacobian block-banded. Unknowns and defects are scaled by the nominal values of the model.
"""

from dataclasses import dataclass
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ocp.collocation import Radau
from ocp.layout import Layout, Points
from ocp.problem import Free, Problem
from symfric.foundation import checks

Array = NDArray[np.float64]
SAME_NODE = 1e-9
MOST_INTERVALS = 10**6
"""Beyond these a program has no room in any memory."""


@final
@dataclass(frozen=True, eq=False)
class Transcription:
    """A nonlinear program and the way back to names.

        min f(w, p)   subject to   lower_w <= w <= upper_w,   lower_g <= g(w, p) <= upper_g

    Attributes:
        problem: what was transcribed.
        mesh: fractions of T that bound the intervals, 0 = mesh[0] < ... < mesh[N] = 1.
        scheme: the collocation coefficients.
        layout: where each unknown stands in w.
        scale: magnitude of each unknown; w is the unknown divided by it.
        w, p, f, g: MX unknowns, parameters of the model, cost and constraints.
    """

    problem: Problem
    mesh: Array
    scheme: Radau
    layout: Layout
    scale: Array
    w: ca.MX
    p: ca.MX
    f: ca.MX
    g: ca.MX

    @property
    def nlp(self) -> dict[str, ca.MX]:
        """The program as `casadi.nlpsol` takes it."""
        return {"x": self.w, "p": self.p, "f": self.f, "g": self.g}

    @property
    def fractions(self) -> Array:
        """Where the states are unknowns, 0 and all collocation points, as fractions of T."""
        inner = self.mesh[:-1, None] + np.diff(self.mesh)[:, None] * self.scheme.nodes[1:]
        inner[:, -1] = self.mesh[1:]
        return np.concatenate([[0.0], inner.ravel()])

    def pack(self, points: Points) -> Array:
        """The vector w of `points` in SI units."""
        return self.layout.stack(points) / self.scale

    def unpack(self, w: ArrayLike) -> Points:
        """The points in SI units that the vector `w` stands for."""
        return self.layout.unstack(np.asarray(w, dtype=float).ravel() * self.scale)

    def duration(self, points: Points) -> float:
        """T [s], chosen or fixed."""
        return float(points.T[0]) if isinstance(self.problem.T, Free) else float(self.problem.T)

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of w."""
        return self.pack(self._bound(0)), self.pack(self._bound(1))

    def constraint_bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of g: zero for the defects."""
        return self._constraint_bound(0), self._constraint_bound(1)

    def constraint_names(self) -> list[tuple[str, float]]:
        """What each row of g is about, and at which fraction of T."""
        model = self.problem.model
        equations = [f"the equation of {v.name}" for v in model.x]
        equations += [f"the algebraic equation {i + 1}" for i in range(len(model.z))]
        paths = [f"the bound on {name}" for name in self.problem.bounded_outputs]
        return [
            (name, float(fraction))
            for interval in self.fractions[1:].reshape(self.layout.intervals, -1)
            for names in (equations, paths)
            for fraction in interval
            for name in names
        ]

    def _constraint_bound(self, side: int) -> Array:
        problem, d = self.problem, self.scheme.degree
        defects = np.zeros(d * (self.layout.nx + self.layout.nz))
        paths = np.tile([problem.box(name)[side] for name in problem.bounded_outputs], d)
        return np.tile(np.concatenate([defects, paths]), self.layout.intervals)

    def _bound(self, side: int) -> Points:
        problem, model = self.problem, self.problem.model
        boxes = (
            [problem.box(v.name)[side] for v in group] for group in (model.x, model.z, model.u)
        )
        T = (problem.T.lower, problem.T.upper)[side] if isinstance(problem.T, Free) else 0.0
        points = self.layout.spread(T, *boxes)
        for fraction in (0.0, *problem.via, 1.0):
            node = int(np.argmin(np.abs(self.mesh - fraction))) * self.scheme.degree
            points.x[:, node] = [box[side] for box in problem.at(fraction).values()]
        return points


def make_mesh(problem: Problem, intervals: int | ArrayLike) -> Array:
    """Fractions of T that bound the intervals.

    Args:
        problem: its `via` fractions become nodes, where they are not already.
        intervals: number of equal intervals, or the fractions 0 = s_0 < s_1 < ... < s_N = 1.

    Raises:
        ValueError: neither.
    """
    if checks.as_number(intervals) is not None:
        count = checks.count("intervals", intervals, most=MOST_INTERVALS)
        mesh = np.linspace(0.0, 1.0, count + 1)
    else:
        what = "their number or increasing fractions of T from 0 to 1"
        mesh = checks.array("intervals", intervals, what=what)
        if mesh.size < 2 or mesh[0] != 0.0 or mesh[-1] != 1.0 or not (np.diff(mesh) > 0).all():
            raise ValueError(
                "intervals: expected their number or increasing fractions of T from 0 to 1, "
                f"got {intervals!r}"
            )
    missing = [s for s in problem.via if np.abs(mesh - s).min() > SAME_NODE]
    return np.sort(np.concatenate([mesh, missing]))


def transcribe(problem: Problem, mesh: Array, scheme: Radau) -> Transcription:
    """Write `problem` as a nonlinear program on `mesh` (see `make_mesh`)."""
    model, N = problem.model, mesh.size - 1
    T_scale = problem.T.start if isinstance(problem.T, Free) else 1.0
    layout = Layout(
        len(model.x), len(model.z), len(model.u), scheme.degree, N, isinstance(problem.T, Free)
    )
    p = ca.MX.sym("p", len(model.p))
    x_0 = ca.MX.sym("x_0", layout.nx)
    blocks = ca.MX.sym("interval", layout.block, N)
    free = ca.MX.sym("T", int(layout.free_time))
    T = free * T_scale if isinstance(problem.T, Free) else ca.MX(problem.T)

    end = layout.block - layout.nz  # the last point of an interval starts the next one
    starts = ca.horzcat(x_0, blocks[end - layout.nx : end, :-1])
    h, t = T * ca.DM(np.diff(mesh)).T, T * ca.DM(mesh[:-1]).T
    equations, shares = stage(problem, scheme).map(N)(starts, blocks, h, t, ca.repmat(p, 1, N))
    f = ca.sum2(shares)
    if problem.cost is not None and problem.cost.end:
        f += end_cost(problem, scheme)(T, blocks[:, -1], p)
    scale = layout.stack(layout.spread(T_scale, *(model.nominal(letter) for letter in "xzu")))
    w = ca.veccat(x_0, blocks, free)
    return Transcription(problem, mesh, scheme, layout, scale, w, p, f, ca.vec(equations))


def stage(problem: Problem, scheme: Radau) -> ca.Function:
    """The equations of one interval, scaled.

    (x, block, h, t, p) -> (defects and path constraints, share of the integral cost), where x is
    the state at the start of the interval, at time t, and h its length.
    """
    model, d = problem.model, scheme.degree
    x_0, p = ca.SX.sym("x", len(model.x)), ca.SX.sym("p", len(model.p))
    h, t = ca.SX.sym("h"), ca.SX.sym("t")
    block, x, z, u = _interval(problem, d)
    at_point = _point(problem)
    states = ca.horzcat(x_0, x)
    x_nominal = ca.DM(model.nominal("x"))
    defects: list[ca.SX] = []
    paths: list[ca.SX] = []
    cost = ca.SX(0)
    for j in range(d):
        time = t + scheme.nodes[j + 1] * h
        rate, algebraic, running, path = at_point(time, x[:, j] * x_nominal, z[:, j], u, p)
        slope = states @ ca.DM(scheme.slopes[:, j])
        defects += [h * rate / x_nominal - slope, algebraic]
        paths.append(path)
        cost += h * scheme.weights[j] * running
    return ca.Function(
        "stage", [x_0, block, h, t, p], [ca.vertcat(*defects, *paths), cost], {"cse": True}
    )


def end_cost(problem: Problem, scheme: Radau) -> ca.Function:
    """The end cost as a function of (T, block of the last interval, p)."""
    model, d = problem.model, scheme.degree
    T, p = ca.SX.sym("T"), ca.SX.sym("p", len(model.p))
    block, x, z, u = _interval(problem, d)
    values = [T, x[:, -1] * ca.DM(model.nominal("x")), z[:, -1], u, p]
    symbols = [model.t, *(model.vector(letter) for letter in "xzup")]
    expression = ca.Function("end", symbols, [problem.costs[1]])(*values)
    return ca.Function("end_cost", [T, block, p], [expression])


def _interval(problem: Problem, d: int) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    """The unknowns of an interval, scaled, and its x (nx, d), z (nz, d) and u (nu, 1) in them."""
    model = problem.model
    nx, nz, nu = len(model.x), len(model.z), len(model.u)
    block = ca.SX.sym("block", nu + d * (nx + nz))
    xz = ca.reshape(block[nu:, :], nx + nz, d)
    z = xz[nx:, :] * ca.repmat(ca.DM(model.nominal("z")), 1, d)
    return block, xz[:nx, :], z, block[:nu, :] * ca.DM(model.nominal("u"))


def _point(problem: Problem) -> ca.Function:
    """(t, x, z, u, p) -> (x', algebraic residual, integrand of the cost, path constraints)."""
    model = problem.model
    symbols = [model.t, *(model.vector(letter) for letter in "xzup")]
    paths = [ca.SX(model.outputs[name].expression) for name in problem.bounded_outputs]
    return ca.Function(
        "point",
        symbols,
        [
            model.function("ode")(*symbols),
            model.alg,
            problem.costs[0],
            ca.vertcat(ca.SX(0, 1), *paths),
        ],
    )
