"""Other integrators on the same model: CasADi's own, compiled or not, and SciPy's."""

from collections.abc import Callable
from functools import cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.bench.contenders import FASTEST, buffered
from symfric.integrator.compiled.compiler import library
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.equations.system import system
from symfric.integrator.peers.casadi_integrators import peer
from symfric.integrator.running.run import Tolerances
from symfric.integrator.simulate import simulate
from symfric.model import Model

Array = NDArray[np.float64]
Solve = Callable[[float], tuple[Array, Callable[[], int]]]
"""Start velocity [m/s] -> position at the times [m], and what counts the steps when asked."""


def ours(model: Model, times: Array, rtol: float, backend: str, method: str) -> Solve:
    """`simulate`, with everything a user pays for on a call."""
    end = float(times[-1])

    def solve(v: float) -> tuple[Array, Callable[[], int]]:
        result = simulate(
            model, end, x0={"v": v}, rtol=rtol, t_eval=times, backend=backend, method=method
        )
        return result["x"], lambda: result.statistics.steps

    return solve


def casadi(model: Model, times: Array, rtol: float, plugin: str, compiled: bool) -> Solve:
    """CasADi's integrator `plugin`, its states scaled by nominal values as ours are."""
    inputs = input_data(model, None, 0.0, float(times[-1]))
    whole = system(model, inputs)
    tolerances = Tolerances(rtol, 0.1 * rtol * whole.nominal, 0.0, 10_000_000)
    problem = peer(whole, inputs, np.zeros(0), tolerances, "rosenbrock")
    name = f"peer_{plugin}"
    options: dict[str, Any] = dict(problem.options)
    if plugin != "rosenbrock":
        options["quad_err_con"] = True
    solver = ca.integrator(name, plugin, problem.dae, 0.0, times.tolist(), options)
    if compiled:
        return _buffered_peer(model, _external(solver, name), whole.nominal)
    run = solver

    def solve(v: float) -> tuple[Array, Callable[[], int]]:
        x0 = model.initial_state({"v": v})
        states = run(x0=x0 / whole.nominal)["xf"]
        x = states[0, :].full().ravel() * whole.nominal[0]
        stats = solver.stats()
        return x, lambda: int(stats.get("n_steps", stats.get("nsteps", 0)))

    return solve


def _buffered_peer(model: Model, run: ca.Function, nominal: Array) -> Solve:
    """Calls without a conversion of arguments and results: the quickest way into a Function."""
    start, call, ends = buffered(run, "x0", "xf")
    positions = ends.reshape(-1, nominal.size)[:, 0]

    @cache  # the start is not what is measured
    def scaled(v: float) -> Array:
        return model.initial_state({"v": v}) / nominal

    def solve(v: float) -> tuple[Array, Callable[[], int]]:
        start[:] = scaled(v)
        call()
        return positions * nominal[0], int

    return solve


def _external(solver: ca.Function, name: str) -> ca.Function:
    generator = ca.CodeGenerator(f"{name}.c")
    generator.add(solver)
    return ca.external(name, str(library(generator.dump(), name, flags=FASTEST)))


def scipy(model: Model, times: Array, rtol: float, method: str) -> Solve:
    """SciPy's `solve_ivp` with right-hand side and exact Jacobian from CasADi buffers.

    Raises:
        ModuleNotFoundError: SciPy is not installed.
    """
    from scipy.integrate import solve_ivp  # noqa: PLC0415  (an extra, only some users need it)

    whole = system(model, input_data(model, None, 0.0, float(times[-1])))
    n = whole.n
    f = ca.Function("f", [whole.y], [ca.densify(whole.f)])
    jacobian = ca.Function("j", [whole.y], [ca.densify(ca.jacobian(whole.f, whole.y))])
    y, f_call, slope = buffered(f)
    y_too, j_call, matrix = buffered(jacobian)

    def right(_: float, state: Array) -> Array:
        y[:] = state
        f_call()
        return slope.copy()

    def derivative(_: float, state: Array) -> Array:
        y_too[:] = state
        j_call()
        return matrix.reshape(n, n).T.copy()

    def solve(v: float) -> tuple[Array, Callable[[], int]]:
        found = solve_ivp(
            right,
            (0.0, float(times[-1])),
            model.initial_state({"v": v}),
            method=method,
            rtol=rtol,
            atol=0.1 * rtol * whole.nominal,
            t_eval=times,
            jac=derivative,
        )
        return found.y[0], lambda: int(found.nfev)

    return solve
