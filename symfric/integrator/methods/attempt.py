"""Attempt of a step: its error control, and its form as a CasADi Function.

Error control also monitors sliding velocities and algebraic unknowns. A sliding velocity s is the
difference of two velocities that may be a thousand times larger, so its error is measured relative
to the velocity scale w of the law instead. In addition, a step must not jump across that scale.
Friction that acts near zero velocity only (a peak without a Coulomb level) has no effect on a step
that passes over it: no stage falls on the peak, no error is estimated, and a block that should
stick moves on. Whatever the error estimate,

    travel <= REACH (w + nearest) / finer

holds for every step, where `travel` is the distance that s covers and `nearest` is its smallest
|s|, or 0 if s changes sign. Steps thus shrink geometrically towards zero and cross it in steps of a
few w. The parabola through both ends and the middle of the dense output approximates s. A method
whose steps are differentiated has a larger `finer`: the derivative of friction, a peak of width w,
needs several stages, while the state needs only its integral. A model without monitors has no such
limit.

For every method, an attempt is one CasADi Function of two columns:

    S = (t, h, h_old, growth_old, rejected, y)     changed by an attempt
    R = (t_end, rtol, h_max, atol[nx], d)          not changed

`step(S, R) -> (S_next, D)` tries the step h. It either accepts the step (t and y advance; D holds
the dense output) or rejects it (h shrinks). The columns of many members are the rows of a matrix.
`fixed(y, h, d) -> y_next` is the bare step, for derivatives and C code.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple, final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symfric.foundation.numeric import Array, reciprocal
from symfric.integrator.equations.blocks import blocks, signs
from symfric.integrator.equations.manifold import PULLING, SHOCK
from symfric.integrator.equations.system import System
from symfric.integrator.methods.method import Method, Trial, Trials
from symfric.integrator.methods.tangent import TangentChart

GROWTH_MEMORY = 2.5
"""Largest growth of the step size that the controller stores."""


@final
class SRow:
    """Rows of S: time, step to try, last accepted step, its growth, 1 after a rejected attempt."""

    T, H, H_OLD, GROWTH_OLD, REJECTED = range(5)
    MEMORY = 5
    Y = slice(MEMORY, None)

    @staticmethod
    def at(t: float, h: float, y: ArrayLike) -> Array:
        """Return S at time `t` without history, with the step `h` to try; y has shape (..., n)."""
        return _joined(SRow.fresh(t, h), np.asarray(y, dtype=float))

    @staticmethod
    def fresh(t: float, h: float) -> list[float]:
        """Return the rows of S before the unknowns, without history."""
        return [t, h, h, GROWTH_MEMORY, 0.0]


@final
class RRow:
    """Rows of R: end time, relative tolerance, longest step, absolute tolerances, run data."""

    T_END, RTOL, H_MAX = range(3)
    FIXED = 3

    @staticmethod
    def of(t_end: float, rtol: float, h_max: float, atol: ArrayLike, d: ArrayLike) -> Array:
        """Return R for run data d (..., n_d) and atol (nx,)."""
        return _joined([t_end, rtol, h_max, *np.asarray(atol, dtype=float)], np.asarray(d))

    @staticmethod
    def fill(R: Array, t_end: float, rtol: float, h_max: float, atol: Array, d: Array) -> None:
        """Fill R in place, as `of` does."""
        R[: RRow.FIXED] = t_end, rtol, h_max
        first = RRow.FIXED + atol.size
        R[RRow.FIXED : first], R[first:] = atol, d

    @staticmethod
    def atol(nx: int) -> slice:
        """Return the slice of the absolute tolerances of `nx` states."""
        return slice(RRow.FIXED, RRow.FIXED + nx)

    @staticmethod
    def d(nx: int) -> slice:
        """Return the slice of the run data after the tolerances of `nx` states."""
        return slice(RRow.FIXED + nx, None)


def _joined(common: list[float], own: Array) -> Array:
    """Prepend the same leading entries to every row of `own`."""
    first = np.broadcast_to(np.array(common), (*own.shape[:-1], len(common)))
    return np.concatenate([first, own], axis=-1)


REACH = 4.0
"""Largest travel of a sliding velocity in one step, in units of w.

The stages of such a step resolve friction that rises over w and then falls.
"""

FINEST = 1e-14
"""Step, relative to the end time, below which limits on the step are ignored.

The run is then about to end.
"""


class Watch(NamedTuple):
    """Monitored expressions of a system over one trial step.

    Attributes:
        before, half, after: values at the start, in the middle and at the end of the step.
        nominal: typical magnitudes.
        change: (y, direction, d) -> change of the expressions with y, to first order.
        slips: number of sliding velocities, which are the first expressions.
        finer: factor by which their travel near zero is limited more than usual.
    """

    before: Any
    half: Any
    after: Any
    nominal: Any
    change: ca.Function
    slips: int
    finer: float = 1.0

    def error(self, y: Any, error: Any, d: Any, rtol: Any) -> Any:
        """Return the sum of squares of the monitored errors due to an error of y, in units of rtol.

        A value is scaled by rtol (nominal + min|value|). The sliding velocity of a sticking contact
        is therefore resolved relative to the velocity scale of the law instead of the velocity of
        the body; otherwise breakaway would come too late or not at all.
        """
        smallest = ca.fmin(ca.fabs(self.before), ca.fabs(self.after))
        return ca.sumsqr(self.change(y, error, d) / (rtol * (self.nominal + smallest)))

    def leap(self) -> Any:
        """Return the largest travel of a sliding velocity, in units of its limit."""
        before, half, after, scale = (x[range(self.slips)] for x in self[:4])
        bow = ca.fabs(half - (before + after) / 2)
        nearest = ca.fmax(0, ca.fmax(ca.fmin(before, after), -ca.fmax(before, after)) - bow)
        return ca.mmax((ca.fabs(after - before) + bow) / (REACH / self.finer * (scale + nearest)))


def watching(system: System, finer: float = 1.0) -> Callable[[Any, Trial, Any], Watch] | None:
    """Return (y, trial, d) -> `Watch` with the factor `finer`; None if nothing is monitored."""
    if not system.monitors.numel():
        return None
    direction = ca.SX.sym("direction", system.n)
    along = ca.jtimes(system.monitors, system.y, direction)
    value = ca.Function("monitor", [system.y, system.d], [system.monitors])
    change = ca.Function("monitor_error", [system.y, direction, system.d], [along])
    nominal = ca.Function("monitor_nominal", [system.d], [ca.densify(system.monitor_nominal)])

    def watch(y: Any, trial: Trial, d: Any) -> Watch:
        bend = sum((0.5**k * row for k, row in enumerate(trial.dense)), start=type(y)(0))
        half = value((y + trial.end) / 2 + bend / 4, d) if system.slips else type(y)(0)
        ends = value(y, d), half, value(trial.end, d)
        return Watch(*ends, nominal(d), change, system.slips, finer)

    return watch


SAFETY, GROW, SHRINK = 0.85, 8.0, 0.2
E_FLOOR = 1e-6
"""Smallest error estimate that the controller uses."""

FAR = 100.0
"""Shift onto the constraints, in tolerances, above which a step is rejected.

Near a singular position such a shift is not an error of the method but a jump to another branch.
"""

KAPPA = 0.1
"""Allowed residual of Newton's method, in units of the tolerance."""


@lru_cache(maxsize=2)
def tangent(system: System) -> TangentChart | None:
    """Return the tangent-space form of a mechanism that requests it; None for other systems."""
    manifold = system.manifold
    return TangentChart(system, manifold) if manifold is not None and manifold.charted else None


def steps(system: System, method: Method) -> Trials:
    """Return the steps of a method; the steps of a mechanism end on its constraints."""
    chart, manifold = tangent(system), system.manifold
    if chart is not None:
        inside = method.trials(chart.reduced)

        def in_chart(y: Any, h: Any, d: Any) -> Trial:
            data = chart.open(y, d)
            return chart.trial(inside(chart.enter(y, data), h, data), y, h, d, data)

        return in_chart
    free = method.trials(system)
    if manifold is None or not manifold.m:
        return free

    def projected(y: Any, h: Any, d: Any) -> Trial:
        found = free(y, h, d)
        end = manifold.project(found.end, d)
        return found._replace(end=end, shift=end - found.end)

    return projected


def obstacles(system: System, method: Method) -> Callable[[Any, Any, Any], Any] | None:
    """Return a test that rejects a step despite a small error estimate; None if it cannot fail.

    Returns:
        (y, h, d) -> a number, negative if the step over h must not end at y.

    Without the test, breakaway would be missed: where a contact becomes unstable, a long step stays
    on the sticking solution with a small error estimate; `signs` detects that. Where det(I - dN/dN)
    of the loop from normal forces over friction to reactions and back is negative, friction has
    jammed: that solution is not physical, nor is one in which a bearing pulls. A pivot of I - dN/dN
    below `SHOCK` is close to that. Mechanisms without friction need no test.
    """
    gamma, manifold, chart = method.diagonal, system.manifold, tangent(system)
    if gamma is None or (manifold is not None and not system.rubs):
        return None
    inside = system if chart is None else chart.reduced
    loop = [] if manifold is None else inside.algebraic[0][manifold.loop :]
    every = signs(inside, gamma, loop)

    def sign(y: Any, h: Any, d: Any) -> Any:
        data = d if chart is None else chart.open(y, d)
        own, tiny, pivots = every(y if chart is None else chart.enter(y, data), h, data)
        if manifold is None:
            return own * tiny
        # with a definite mass matrix and no friction, the sign for n accelerations is (-1)^n
        signs_of = [own * tiny, (-1) ** manifold.n * tiny]
        return ca.mmin(ca.vertcat(*signs_of, pivots - SHOCK, manifold.pressing(y, d) + PULLING))

    return sign


def build_fixed(system: System, method: Method) -> ca.Function:
    """Return the bare step (y, h, d) -> y_next, without error control, for derivatives."""
    arguments, trial = _bare(system, method)
    return ca.Function("fixed", arguments, [trial.end], list("yhd"), ["y_next"], {"cse": True})


def build_dense_step(system: System, method: Method) -> ca.Function:
    """Return the step with its dense output, (y, h, d) -> all = (y_next, D), for sensitivities."""
    arguments, trial = _bare(system, method)
    every = ca.vertcat(trial.end, *trial.dense)
    return ca.Function("dense", arguments, [every], list("yhd"), ["all"], {"cse": True})


def _bare(system: System, method: Method) -> tuple[list[ca.SX], Trial]:
    y, h, d = ca.SX.sym("y", system.n), ca.SX.sym("h"), ca.SX.sym("d", system.d.numel())
    return [y, h, d], steps(system.plain, method)(y, h, d)


def error_norm(
    system: System, y: Any, y_new: Any, atol: Any, rtol: Any, d: Any, watch: Watch | None
) -> Callable[[Any], Any]:
    """Return the scaled mean square norm of an error of y_new, in states and monitored expressions.

    A state is scaled by atol + rtol max|x|, a monitored expression as in `Watch.error`.
    """
    nx, count = system.nx, system.nx + system.monitors.numel()
    per_scale = reciprocal(atol + rtol * ca.fmax(ca.fabs(y[:nx]), ca.fabs(y_new[:nx])))

    def norm(error: Any) -> Any:
        total = ca.sumsqr(error[:nx] * per_scale)
        return (total if watch is None else total + watch.error(y_new, error, d, rtol)) / count

    return norm


def converged(before: Any, last: Any) -> Any:
    """Return True if Newton's method has converged, from the norms of its last two corrections.

    It has converged if the last correction is small, or the sum of the remaining corrections, a
    geometric series with the ratio of the last two.
    """
    last, rate = ca.sqrt(last), ca.sqrt(last / (before + 1e-300))
    return ca.logic_or(last <= KAPPA, last * rate <= KAPPA * (1 - rate))


def build_step(system: System, method: Method, kind: Any = ca.SX) -> ca.Function:
    """Return the adaptive attempt (S, R) -> (S_next, D).

    Args:
        system: system to integrate.
        method: method that estimates its error.
        kind: SX inlines everything (for the virtual machine and small systems). MX keeps the blocks
            as calls, which compile faster if the blocks are large.
    """
    n, nx = system.n, system.nx
    S = kind.sym("S", SRow.MEMORY + n)
    R = kind.sym("R", RRow.FIXED + nx + system.d.numel())
    t, h_wish, h_old, growth_old, rejected = (S[i] for i in range(SRow.MEMORY))
    t_end, rtol, h_max = (R[i] for i in range(RRow.FIXED))
    y, atol, d = S[SRow.Y], R[RRow.atol(nx)], R[RRow.d(nx)]

    left = t_end - t
    h = ca.fmax(ca.fmin(h_wish, left), 1e-300)
    order = method.embedded + 1
    trial = steps(system, method)(y, h, d)
    y_new = trial.end
    look = watching(system, method.finer)
    watch = None if look is None else look(y, trial, d)
    norm = error_norm(system, y, y_new, atol, rtol, d, watch)
    e2 = norm(trial.error)
    sound = e2 <= 1e20
    if system.manifold is not None and system.manifold.m:
        sound = ca.logic_and(sound, system.manifold.branch(y, y_new, d) > 0)
        sound = ca.logic_and(sound, norm(trial.shift) < FAR**2)
    obstacle = obstacles(system, method)
    if obstacle is not None:
        sound = ca.logic_and(sound, ca.logic_not(obstacle(y_new, h, d) < 0))
    if unwatched := system.algebraic[1]:
        sound = ca.logic_and(sound, ca.sumsqr(y_new[unwatched]) < np.inf)
    if trial.corrections:
        halving = (2 * SAFETY) ** (2 * order)
        done = converged(*(norm(correction) for correction in trial.corrections))
        e2 = ca.if_else(done, e2, ca.fmax(e2, halving))
    e2 = ca.if_else(sound, e2, 1e20)
    accept = ca.logic_and(e2 <= 1, left > 0)

    # Gustafsson's predictive controller (Hairer and Wanner, IV.8), with growth = e^(-1/order) as
    # its memory, so that one power per attempt is enough
    growth = ca.fmax(e2, E_FLOOR**2) ** (-0.5 / order)
    if watch is not None and watch.slips:
        far = ca.if_else(h > FINEST * ca.fabs(t_end), watch.leap(), 0)
        accept = ca.logic_and(accept, far <= 1)
        growth = ca.fmin(growth, 1 / ca.fmax(far, SAFETY / GROW))
    predicted = (h / h_old) * (growth * growth / growth_old)
    factor = ca.fmin(GROW, ca.fmax(SHRINK, SAFETY * ca.fmin(growth, predicted)))
    factor = ca.if_else(rejected > 0, ca.fmin(factor, 1), factor)
    # a step cut by t_end keeps the step size that it could have had
    h_next = ca.fmin(h_max, ca.if_else(h < h_wish, ca.fmax(h_wish, h * factor), h * factor))
    h_less = h * ca.fmax(SHRINK, SAFETY * growth)

    memory = ca.vertcat(
        ca.if_else(accept, ca.if_else(h < h_wish, t_end, t + h), t),
        ca.if_else(accept, h_next, ca.if_else(left > 0, h_less, h_wish)),
        ca.if_else(accept, h, h_old),
        ca.if_else(accept, ca.fmin(growth, GROWTH_MEMORY), growth_old),
        ca.if_else(ca.logic_or(accept, left <= 0), 0, 1),
    )
    S_next = ca.vertcat(memory, ca.if_else(accept, y_new, y))
    outputs: Any = [ca.densify(S_next), ca.densify(ca.vertcat(*trial.dense))]
    if kind is ca.SX:
        outputs = ca.cse(outputs)
    return ca.Function("symfric_step", [S, R], outputs, ["S", "R"], ["S_next", "D"])


def written(system: System, method: Method, inline: int) -> tuple[ca.Function, int]:
    """Return the attempt, inlined up to `inline` instructions, and its number of instructions.

    A step that is certainly too large is not inlined just to count its instructions: for a long
    chain, that took half of the build time.
    """
    if least(system, method) <= inline:
        step = build_step(system, method)
        if step.n_instructions() <= inline:
            return step, step.n_instructions()
    step = build_step(system, method, ca.MX)
    return step, instructions(step)


def least(system: System, method: Method) -> int:
    """Return the number of instructions in the blocks of an attempt; 0 without blocks.

    The code between the blocks is not counted.
    """
    gamma, chart = method.diagonal, tangent(system)
    if gamma is None:
        return 0
    block = blocks(system if chart is None else chart.reduced, gamma)
    stages, jacobians, factorisations = method.work(system)
    every = stages * (block.f.n_instructions() + block.solve.n_instructions())
    once = jacobians * block.slopes.n_instructions()
    return every + once + factorisations * block.pack.n_instructions()


def instructions(step: ca.Function) -> int:
    """Return the number of scalar operations in a step that calls blocks."""
    found = 0
    for k in range(step.n_instructions()):
        operation = step.instruction_id(k)
        if operation == ca.OP_CALL:
            found += step.instruction_MX(k).which_function().n_instructions()
        elif operation not in (ca.OP_INPUT, ca.OP_OUTPUT):
            found += step.instruction_MX(k).nnz()
    return found
