"""One attempt of an adaptive Rosenbrock step as ONE CasADi Function.

State and run data are columns:

    S = (t, h, h_old, growth_old, rejected, y)      what an attempt changes
    R = (t_end, rtol, atol[nx], d)             what it does not

`step(S, R) -> (S_next, D)` tries h, and either accepts (t, y advance; D holds the dense output)
or rejects (h shrinks). `fixed(y, h, d) -> y_next` is the bare step, for derivatives and C code.
"""

from dataclasses import dataclass
from typing import Any, final

import casadi as ca
import numpy as np

from symfric.integrator.lu import factorise
from symfric.integrator.system import System
from symfric.integrator.tableaux import Rosenbrock

MEMORY = 5
"""Rows of S before y: t, h, h_old, growth_old, rejected."""

SAFETY, GROW, SHRINK = 0.85, 8.0, 0.2
E_FLOOR, GROWTH_MEMORY = 1e-6, 2.5
"""Smallest error the controller believes, and largest growth it remembers."""


@final
@dataclass(frozen=True, eq=False)
class Blocks:
    """The Functions a step is made of; called with SX they inline, with MX they stay calls.

    Attributes:
        f: (y, d) -> right-hand side.
        factor: (y, h, d) -> factors of W = M/(gamma h) - J.
        solve: (factors, right, memory) -> k with W k = right + M memory.
        orientation: (y, h, d) -> sign of det W relative to that of a tiny step. It is negative
            where a mode grows faster than exp(t / (gamma h)): all that an L-stable method makes
            of such a mode is to damp it away.
        monitor: (y, d) -> monitored outputs.
        monitor_error: (y, error, d) -> their error to first order.
    """

    f: ca.Function
    factor: ca.Function
    solve: ca.Function
    orientation: ca.Function
    monitor: ca.Function
    monitor_error: ca.Function


def blocks(system: System, tableau: Rosenbrock) -> Blocks:
    """Right-hand side, factors of W = M/(gamma h) - J, and the solve with them."""
    h = ca.SX.sym("h")
    right, memory = ca.SX.sym("right", system.n), ca.SX.sym("memory", system.n)
    J = ca.jacobian(system.f, system.y)
    diagonal = tuple(i for i in range(system.nx) if system.mass.sparsity().has_nz(i, i))
    lu = factorise(ca.sparsify(system.mass / (tableau.gamma * h) - J), safe=diagonal)
    tiny, rows = ca.densify(system.mass), system.algebraic[0]
    tiny[rows, :] = -J[rows, :]
    reference = factorise(ca.sparsify(tiny), safe=diagonal).sign
    return Blocks(
        ca.Function("f", [system.y, system.d], [system.f], {"cse": True}),
        ca.Function("factor", [system.y, h, system.d], [lu.packed], {"cse": True}),
        ca.Function(
            "solve", [lu.packed_symbol, right, memory], [lu.solve(right + system.mass @ memory)]
        ),
        ca.Function("orientation", [system.y, h, system.d], [lu.sign * reference], {"cse": True}),
        ca.Function("monitor", [system.y, system.d], [system.monitors]),
        ca.Function(
            "monitor_error",
            [system.y, right, system.d],
            [ca.jtimes(system.monitors, system.y, right)],
        ),
    )


def stages(
    block: Blocks, tableau: Rosenbrock, y: Any, h: Any, d: Any
) -> tuple[Any, Any, list[Any]]:
    """End value, error estimate and dense output of one step from y; SX or MX."""
    lu, per_h = block.factor(y, h, d), 1 / h
    k: list[Any] = []
    argument = y
    for i in range(tableau.stages):
        argument, memory = y, type(y).zeros(y.numel())
        for j in range(i):
            if tableau.A[i, j] != 0:
                argument = argument + tableau.A[i, j] * k[j]
            if tableau.C[i, j] != 0:
                memory = memory + tableau.C[i, j] * k[j]
        k.append(block.solve(lu, block.f(argument, d), memory * per_h))
    dense = [
        sum((float(c) * kj for c, kj in zip(row, k, strict=True) if c != 0.0), start=type(y)(0))
        for row in tableau.H
    ]
    return argument + k[-1], k[-1], dense


def build_fixed(system: System, tableau: Rosenbrock, kind: Any = ca.SX) -> ca.Function:
    """The bare step (y, h, d) -> y_next, without error control: what derivatives are taken of."""
    y, d = kind.sym("y", system.n), kind.sym("d", system.d.numel())
    h = kind.sym("h")
    end, _, _ = stages(blocks(system, tableau), tableau, y, h, d)
    return ca.Function("fixed", [y, h, d], [end], ["y", "h", "d"], ["y_next"], {"cse": True})


def build_dense_step(system: System, tableau: Rosenbrock) -> ca.Function:
    """The bare step with its dense output, (y, h, d) -> all = (y_next, D), for sensitivities."""
    y, d = ca.SX.sym("y", system.n), ca.SX.sym("d", system.d.numel())
    h = ca.SX.sym("h")
    end, _, dense = stages(blocks(system, tableau), tableau, y, h, d)
    return ca.Function(
        "dense", [y, h, d], [ca.vertcat(end, *dense)], ["y", "h", "d"], ["all"], {"cse": True}
    )


def error_square(
    block: Blocks, system: System, y: Any, y_new: Any, error: Any, atol: Any, rtol: Any, d: Any
) -> Any:
    """Mean square of the error of the states and of the monitored expressions, scaled.

    A state is scaled by atol + rtol max|x|, a monitored output m by rtol (nominal + min|m|): where
    a contact sticks, its sliding velocity is resolved relative to the velocity scale of the law
    instead of the velocity of the body, or breaking away comes too late or not at all.
    """
    nx, watched = system.nx, system.monitor_nominal.size
    largest = ca.fmax(ca.fabs(y[:nx]), ca.fabs(y_new[:nx]))
    total = ca.sumsqr(error[:nx] / (atol + rtol * largest))
    if watched:
        nominal = ca.DM(system.monitor_nominal)
        smallest = ca.fmin(ca.fabs(block.monitor(y, d)), ca.fabs(block.monitor(y_new, d)))
        slip = block.monitor_error(y_new, error, d) / (rtol * (nominal + smallest))
        total = total + ca.sumsqr(slip)
    return total / (nx + watched)


def build_step(system: System, tableau: Rosenbrock, kind: Any = ca.SX) -> ca.Function:
    """The adaptive attempt (S, R) -> (S_next, D).

    Args:
        system: what is integrated.
        tableau: the method.
        kind: SX inlines everything (virtual machine, small systems), MX keeps the blocks as
            calls, which compile faster where they are large.
    """
    n, nx = system.n, system.nx
    S = kind.sym("S", MEMORY + n)
    R = kind.sym("R", 2 + nx + system.d.numel())
    t, h_wish, h_old, growth_old, rejected = (S[i] for i in range(MEMORY))
    y, t_end, rtol = S[MEMORY:], R[0], R[1]
    atol, d = R[2 : 2 + nx], R[2 + nx :]

    left = t_end - t
    h = ca.fmax(ca.fmin(h_wish, left), 1e-300)
    block = blocks(system, tableau)
    y_new, error, dense = stages(block, tableau, y, h, d)
    e2 = error_square(block, system, y, y_new, error, atol, rtol, d)
    # breaking away would be missed without a sign of it: where a contact turns unstable, a long
    # step stays on the solution that sticks, and estimates no error
    missed = block.orientation(y_new, h, d) < 0
    sound = ca.logic_and(e2 <= 1e20, ca.logic_not(missed))
    if unwatched := system.algebraic[1]:
        sound = ca.logic_and(sound, ca.sumsqr(y_new[unwatched]) < np.inf)
    e2 = ca.if_else(sound, e2, 1e20)
    accept = ca.logic_and(e2 <= 1, left > 0)

    # Gustafsson's predictive controller (Hairer and Wanner, IV.8), with growth = e^(-1/order) as
    # its memory, so that one power an attempt is enough
    order = tableau.embedded + 1
    growth = ca.fmax(e2, E_FLOOR**2) ** (-0.5 / order)
    predicted = (h / h_old) * (growth * growth / growth_old)
    factor = ca.fmin(GROW, ca.fmax(SHRINK, SAFETY * ca.fmin(growth, predicted)))
    factor = ca.if_else(rejected > 0, ca.fmin(factor, 1), factor)
    # a step cut by t_end must not forget the step size it could have had
    h_next = ca.if_else(h < h_wish, ca.fmax(h_wish, h * factor), h * factor)
    h_less = h * ca.fmax(SHRINK, SAFETY * growth)

    memory = ca.vertcat(
        ca.if_else(accept, ca.if_else(h < h_wish, t_end, t + h), t),
        ca.if_else(accept, h_next, ca.if_else(left > 0, h_less, h_wish)),
        ca.if_else(accept, h, h_old),
        ca.if_else(accept, ca.fmin(growth, GROWTH_MEMORY), growth_old),
        ca.if_else(ca.logic_or(accept, left <= 0), 0, 1),
    )
    S_next = ca.vertcat(memory, ca.if_else(accept, y_new, y))
    D = ca.horzcat(*dense) if dense else kind(n, 0)
    outputs: Any = [S_next, ca.vec(D)]
    if kind is ca.SX:
        outputs = ca.cse(outputs)
    return ca.Function("symfric_step", [S, R], outputs, ["S", "R"], ["S_next", "D"])
