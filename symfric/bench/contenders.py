"""Compared integrators: those of symfric, CasADi and SciPy on the same model, and C by hand.

Each integrator is built for one tolerance and then called repeatedly. The measured time is that of
a call after everything is built. `simulate` starts from names, solves for a consistent start and
returns named signals; the others start from that solution and return states, as does `loop`, the
compiled loop of symfric alone. `loop` is for comparison if a run takes a few milliseconds or less.
"""

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, final

import casadi as ca
import numpy as np

from symfric import BrownMcPhee, Model, simulate
from symfric.bench.report import FASTEST, compile_time
from symfric.foundation.numeric import Array, bound
from symfric.integrator.by_peer import peer
from symfric.integrator.compiled.compiler import library
from symfric.integrator.equations.initial import consistent, first_guess, first_step, smallest_step
from symfric.integrator.equations.inputs import InputData, input_data
from symfric.integrator.equations.system import System, system
from symfric.integrator.methods.attempt import RRow, SRow
from symfric.integrator.prepared import chosen
from symfric.integrator.running.events import Stop
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.record import Outputs
from symfric.integrator.running.run import ATTEMPTS, Tolerances
from symfric.scenes import Rabinowicz

Watched = tuple[str, ...]
"""Names of states."""
Solve = Callable[..., tuple[Array, Callable[[], int]]]
"""Start values by keyword -> watched states at the times, shape (watched, times), and a function
that returns the number of steps, called outside the measured time."""


@final
@dataclass(frozen=True, eq=False)
class Contender:
    """Solver built for one tolerance; `compile_s` is the time [s] that the C compiler took."""

    solve: Solve
    compile_s: float = 0.0


def ours(
    model: Model,
    times: Array,
    watched: Watched,
    rtol: float,
    backend: str = "compiled",
    method: str = "auto",
) -> Contender:
    """Return `simulate` with all its overhead; its step is compiled once for all tolerances."""

    def solve(**start: float) -> tuple[Array, Callable[[], int]]:
        run = simulate(
            model, float(times[-1]), x0=start, rtol=rtol, t_eval=times, backend=backend,
            method=method,
        )  # fmt: skip
        return np.array([run[name] for name in watched]), lambda: run.statistics.steps

    return Contender(solve)


def loop(model: Model, times: Array, watched: Watched, rtol: float) -> Contender:
    """Return the compiled loop of `simulate` alone, which maps a consistent start to states."""
    whole, inputs = equations(model, float(times[-1]))
    made = Integrator(model, inputs, chosen("bench", "auto", rtol))
    engine, end = made.compiled, float(times[-1])
    rows, work = [whole.names.index(name) for name in watched], made.borrow()
    begin = _beginning(model, whole)

    def solve(**start: float) -> tuple[Array, Callable[[], int]]:
        work.S[:] = SRow.at(0.0, first_step(end), begin(**start))
        work.R[:] = RRow.of(end, rtol, end, 0.1 * rtol * whole.nominal, inputs.values[:, 0])
        outputs, steps, reason = Outputs.at(times, whole.n), 0, Stop.FULL
        work.loop.h_min = smallest_step(end)
        work.want(outputs)
        work.over(inputs.breaks, inputs.values)
        while reason in (Stop.FULL, Stop.ATTEMPTS):
            records, _, reason = engine.march(work, ATTEMPTS["compiled"])
            steps += records.shape[0]
        if reason is not Stop.END:
            raise RuntimeError(f"the step became too small at t = {work.S[SRow.T]:g} s")
        return outputs.values[rows], lambda: steps

    solve()
    return Contender(solve)


def casadi(
    model: Model,
    times: Array,
    watched: Watched,
    rtol: float,
    plugin: str = "rosenbrock",
    as_c: bool = True,
    explicit: bool = False,
) -> Contender:
    """Return CasADi's integrator `plugin`, with states scaled by nominal values as in symfric.

    Args:
        model, times, watched: equations, times [s] of the results, and names of states.
        rtol: relative tolerance.
        plugin: name of the integrator.
        as_c: compile the whole integrator.
        explicit: eliminate the accelerations, x' = ode(x, z), instead of solving for them together
            with the multipliers and normal forces.
    """
    whole, inputs = equations(model, float(times[-1]))
    problem = peer(whole, inputs, np.zeros(0), tolerances(whole, rtol), "rosenbrock")
    dae, scale, skip = problem.dae, whole.nominal, whole.nx
    if explicit and model.ode is not None and model.holonomic is not None:
        x, z = model.vector("x"), model.vector("z")
        dae = {"x": x, "z": z, "ode": model.ode, "alg": model.alg}
        scale, skip = np.ones(whole.nx), whole.nx + model.holonomic.n
    options: dict[str, Any] = dict(problem.options)
    if plugin != "rosenbrock":
        options["quad_err_con"] = True
    solver = ca.integrator("peer", plugin, dae, 0.0, times.tolist(), options)
    run, seconds = compiled(solver) if as_c else (solver, 0.0)
    n_x, n_z = run.numel_in("x0"), run.numel_in("z0")
    x0, z0 = ca.MX.sym("x0", n_x), ca.MX.sym("z0", n_z)
    whole_run = ca.Function("run", [ca.vertcat(x0, z0)], [run(x0=x0, z0=z0)["xf"]])
    given, evaluate, ends = buffered(whole_run)
    rows = [whole.names.index(name) for name in watched]
    begin = _beginning(model, whole)

    @cache
    def scaled(**start: float) -> Array:
        y0 = begin(**start)
        z0 = y0[skip : whole.nx + len(whole.algebraic[1])]
        return np.concatenate([y0[: whole.nx] / scale[: whole.nx], z0])

    def solve(**start: float) -> tuple[Array, Callable[[], int]]:
        given[:] = scaled(**start)

        def count() -> int:
            if as_c:
                solver(x0=given[:n_x], z0=given[n_x:])
            stats = solver.stats()
            return int(stats.get("n_steps", stats.get("nsteps", 0)))

        if as_c:
            evaluate()
            states = ends.reshape(times.size, -1).T
        else:
            states = solver(x0=given[:n_x], z0=given[n_x:])["xf"].full()
        return states[rows] * scale[rows, None], count

    return Contender(solve, seconds)


def idas(model: Model, times: Array, watched: Watched, rtol: float) -> Contender:
    """Return SUNDIALS' idas on the equations of index 2 (GGL), which cannot be compiled.

    Raises:
        RuntimeError: the integrator fails.
    """
    whole, inputs = equations(model, float(times[-1]))
    problem = peer(whole, inputs, np.zeros(0), tolerances(whole, rtol), "ggl")
    y0 = _beginning(model, whole)()
    y0 = np.concatenate([y0, np.zeros(problem.system.n - whole.n)])
    solver, data = problem.over(np.concatenate([[0.0], times]), y0)
    x0, z0 = y0[: whole.nx] / whole.nominal, y0[problem.system.algebraic[1]]
    rows = [whole.names.index(name) for name in watched]

    def solve() -> tuple[Array, Callable[[], int]]:
        found = solver(x0=x0, z0=z0, u=data)["xf"].full()
        return found[rows] * whole.nominal[rows, None], lambda: int(solver.stats()["nsteps"])

    solve()
    return Contender(solve)


def scipy(model: Model, times: Array, watched: Watched, rtol: float, method: str) -> Contender:
    """Return SciPy's `solve_ivp` with right-hand side and exact Jacobian from CasADi buffers.

    Raises:
        ModuleNotFoundError: SciPy is not installed.
    """
    from scipy.integrate import solve_ivp  # noqa: PLC0415  (slow to import)

    whole, _ = equations(model, float(times[-1]))
    rows = [whole.names.index(name) for name in watched]
    y, f_call, slope = buffered(ca.Function("f", [whole.y], [ca.densify(whole.f)]))
    jacobian = ca.Function("j", [whole.y], [ca.densify(ca.jacobian(whole.f, whole.y))])
    y_too, j_call, matrix = buffered(jacobian)

    def right(_: float, state: Array) -> Array:
        y[:] = state
        f_call()
        return slope.copy()

    def derivative(_: float, state: Array) -> Array:
        y_too[:] = state
        j_call()
        return matrix.reshape(whole.n, whole.n).T.copy()

    def solve(**start: float) -> tuple[Array, Callable[[], int]]:
        found = solve_ivp(
            right, (0.0, float(times[-1])), model.initial_state(start), method=method, rtol=rtol,
            atol=0.1 * rtol * whole.nominal, t_eval=times, jac=derivative,
        )  # fmt: skip
        return found.y[rows], lambda: int(found.nfev)

    return Contender(solve)


MECHANISMS: dict[str, tuple[str, Callable[..., Contender]]] = {
    "symfric": ("joint", ours),
    "symfric loop": ("joint", loop),
    "symfric absolute": ("absolute", ours),
    "rosenbrock absolute": ("absolute", casadi),
    "rosenbrock joint": ("joint", casadi),
    "rosenbrock joint ode": ("joint", partial(casadi, explicit=True)),
    "idas GGL absolute": ("absolute", idas),
    "idas GGL joint": ("joint", idas),
}
"""Name -> formulation, and function that returns a contender; "ode": eliminated accelerations."""


def equations(model: Model, end: float) -> tuple[System, InputData]:
    """Return the equations of a model without inputs, from 0 to `end` [s]."""
    inputs = input_data(model, None, 0.0, end)
    return system(model, inputs), inputs


def tolerances(whole: System, rtol: float) -> Tolerances:
    """Return tolerances for other integrators; absolute ones are 0.1 rtol times nominal values."""
    return Tolerances(rtol, 0.1 * rtol * whole.nominal, 0.0, 10_000_000)


def _beginning(model: Model, whole: System) -> Callable[..., Array]:
    """Return a function from start values by keyword to all consistent unknowns, with a cache."""

    @cache
    def begin(**start: float) -> Array:
        y = first_guess(whole, model, model.initial_state(start))
        return consistent(whole, "bench", y, np.zeros(whole.d.numel()))

    return begin


def buffered(function: ca.Function) -> tuple[Array, Callable[[], None], Array]:
    """Return the buffer of the argument, the call, and the buffer of the result of a Function."""
    given, found = np.zeros(function.numel_in(0)), np.zeros(function.numel_out(0))
    return given, bound(function, (given,), (found,)), found


def compiled(function: ca.Function) -> tuple[ca.Function, float]:
    """Return `function` compiled from generated C without a cache, and the compile time [s].

    Raises:
        CompileError: no compiler.
    """
    generator = ca.CodeGenerator(f"{function.name()}.c")
    generator.add(function)
    with TemporaryDirectory() as folder:
        shared = Path(folder) / "generated.so"
        seconds = compile_time(generator.dump(), shared)
        return ca.external(function.name(), str(shared)), seconds


def by_hand(model: Model, times: Array, watched: Watched, rtol: float) -> Contender:
    """Return Rabinowicz's stick-slip with Brown-McPhee friction in C: a bound for general codes.

    The code is RADAU5 (Hairer and Wanner, IV.8) for this equation of two states only: derivatives
    by hand, 2 by 2 systems in closed form, derivatives kept while Newton's method converges fast,
    the collocation polynomial as dense output and initial guess, and Gustafsson's controller. It
    has no checks. Scene and law have default parameters; only `watched` = ("x",) is returned.

    Raises:
        CompileError: no compiler, or an error of the compiler.
    """
    del model, watched
    scene, law = Rabinowicz(BrownMcPhee()), BrownMcPhee()
    numbers = {name: getattr(law, name) for name in ("mu_s", "mu_d", "v_t")}
    numbers |= {name: getattr(scene, name) for name in ("m", "k", "v_belt", "g")}
    defined = "".join(f"#define P_{n} {float(x)!r}\n" for n, x in numbers.items())
    source = defined + Path(__file__).with_name("by_hand.c").read_text("utf-8")
    run = ctypes.CDLL(str(library(source, "by_hand", flags=FASTEST))).by_hand
    run.restype = ctypes.c_longlong
    run.argtypes = [
        *[ctypes.c_double] * 3, ctypes.c_void_p, ctypes.c_longlong, *[ctypes.c_void_p] * 2,
    ]  # fmt: skip
    found, steps = np.empty((2, times.size)), np.zeros(1, dtype=np.int64)

    def solve(v: float) -> tuple[Array, Callable[[], int]]:
        steps[:] = 0
        where = (times.ctypes.data, times.size, found.ctypes.data, steps.ctypes.data)
        if run(v, rtol, 0.01 * rtol, *where):
            raise RuntimeError("by_hand: expected a solution, got steps that shrink to zero")
        return found[:1].copy(), lambda: int(steps[0])

    return Contender(solve)
