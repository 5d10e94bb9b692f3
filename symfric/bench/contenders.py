"""Who solves a mechanism: ours, and CasADi's integrators on the same equations.

Each is made for one tolerance and then called as often as the clock wants. Time of a call is what a
user waits for once everything is built: `simulate` starts from names, solves for a consistent start
and ends in named signals, CasADi's integrators get that start and end in states. So does our
compiled loop alone, "symfric loop": to compare with where a run takes some milliseconds or less.
"""

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, cast, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.compiler import find_compiler, no_compiler
from symfric.foundation.numeric import flat_view
from symfric.integrator.arguments import chosen
from symfric.integrator.compiled.compiler import FLAGS
from symfric.integrator.equations.initial import (
    consistent,
    first_guess,
    first_step,
    smallest_step,
)
from symfric.integrator.equations.inputs import InputData, input_data
from symfric.integrator.equations.system import System, system
from symfric.integrator.peers.casadi_integrators import peer
from symfric.integrator.running.engine import Stop
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.outputs import Outputs
from symfric.integrator.running.run import ATTEMPTS, Tolerances
from symfric.integrator.simulate import simulate
from symfric.integrator.step.layout import Given, State
from symfric.model import Model

Array = NDArray[np.float64]
Solve = Callable[[], tuple[Array, int]]
"""() -> watched states at the times, shape (watched, times), and the number of steps."""

FASTEST = (*(f for f in FLAGS if f != "-ffp-contract=off"), "-freciprocal-math")
"""Others need not round as CasADi's virtual machine does: they get what is quickest."""


@final
@dataclass(frozen=True, eq=False)
class Contender:
    """A solver made for one tolerance; `compile_s` is what the C compiler took for it [s]."""

    solve: Solve
    compile_s: float = 0.0


def ours(model: Model, times: Array, watched: tuple[str, ...], rtol: float) -> Contender:
    """`simulate` in the compiled engine; the step is compiled once for all tolerances."""
    end = float(times[-1])
    # steps are the same every time, and counting them is not what is measured
    steps = simulate(model, end, rtol=rtol, t_eval=times, backend="compiled").statistics.steps

    def solve() -> tuple[Array, int]:
        run = simulate(model, end, rtol=rtol, t_eval=times, backend="compiled")
        return np.array([run[name] for name in watched]), steps

    return Contender(solve)


def loop(model: Model, times: Array, watched: tuple[str, ...], rtol: float) -> Contender:
    """The compiled loop of `simulate` alone, from a consistent start to states: as peers run."""
    whole, inputs, y0 = _start(model, times)
    made = Integrator(model, inputs, chosen("bench", "auto", rtol))
    engine, end = made.compiled(), float(times[-1])
    rows, work = [whole.names.index(name) for name in watched], made.borrow()

    def solve() -> tuple[Array, int]:
        State.begin(work.S, 0.0, first_step(end), y0)
        Given.begin(work.R, rtol, end, 0.1 * rtol * whole.nominal, np.zeros(0))
        outputs, steps, reason = Outputs.at(times, whole.n), 0, Stop.FULL
        work.loop.h_min = smallest_step(end)
        work.want(outputs, None)
        work.over(inputs.breaks, inputs.values)
        while reason in (Stop.FULL, Stop.ATTEMPTS):
            records, _, reason = engine.march(work, ATTEMPTS["compiled"])
            steps += records.shape[0]
        if reason is not Stop.END:
            raise RuntimeError(f"the step became too small at t = {work.S[State.T]:g} s")
        return outputs.values[rows], steps

    solve()
    return Contender(solve)


def rosenbrock(
    model: Model, times: Array, watched: tuple[str, ...], rtol: float, explicit: bool
) -> Contender:
    """CasADi's `rosenbrock`, compiled whole.

    Args:
        explicit: eliminate the accelerations, x' = ode(x, z), instead of solving for them along
            with multipliers and normal forces.
    """
    whole, inputs, y0 = _start(model, times)
    problem = peer(whole, inputs, np.zeros(0), _tolerances(whole, rtol), "rosenbrock")
    dae, scale, skip = problem.dae, whole.nominal, whole.nx
    if explicit and model.ode is not None and model.holonomic is not None:
        x, z = model.vector("x"), model.vector("z")
        dae = {"x": x, "z": z, "ode": model.ode, "alg": model.alg}
        scale, skip = np.ones(whole.nx), whole.nx + model.holonomic.n
    solver = ca.integrator("peer", "rosenbrock", dae, 0.0, times.tolist(), problem.options)
    generated, seconds = compiled(solver)
    x0, z0 = y0[: whole.nx] / scale, y0[skip : whole.nx + len(whole.algebraic[1])]
    rows = [whole.names.index(name) for name in watched]
    solver(x0=x0, z0=z0)
    steps = int(solver.stats()["n_steps"])

    whole_call = _of_one_argument(generated, x0.size, z0.size)
    given, call, ends = buffered(whole_call)
    given[:] = np.concatenate([x0, z0])
    found = ends.reshape(times.size, -1).T

    def solve() -> tuple[Array, int]:
        call()
        return found[rows] * scale[rows, None], steps

    return Contender(solve, seconds)


def _of_one_argument(solver: ca.Function, n_x: int, n_z: int) -> ca.Function:
    """The integrator as a Function from its start (x0, z0) to all states at the times."""
    x, z = ca.MX.sym("x0", n_x), ca.MX.sym("z0", n_z)
    return ca.Function("start_to_states", [ca.vertcat(x, z)], [solver(x0=x, z0=z)["xf"]])


def buffered(
    function: ca.Function, argument: str | int = 0, result: str | int = 0
) -> tuple[Array, Callable[[], None], Array]:
    """One argument, call and one result of a Function, without conversions; all others are zero."""
    a = function.index_in(argument) if isinstance(argument, str) else argument
    r = function.index_out(result) if isinstance(result, str) else result
    given, found = np.zeros(function.numel_in(a)), np.zeros(function.numel_out(r))
    buffer, call = cast(tuple[Any, Any], function.buffer())
    buffer.set_arg(a, flat_view(given))
    buffer.set_res(r, flat_view(found))

    def evaluate(_: object = buffer) -> None:
        # the raw call does not keep its buffer alive; the default argument does
        call()

    return given, evaluate, found


def idas(model: Model, times: Array, watched: tuple[str, ...], rtol: float, name: str) -> Contender:
    """SUNDIALS' idas, which cannot be compiled: "sundials" for index 1, "ggl" for index 2.

    Raises:
        RuntimeError: it fails.
    """
    whole, inputs, y0 = _start(model, times)
    problem = peer(whole, inputs, np.zeros(0), _tolerances(whole, rtol), name)
    y0 = np.concatenate([y0, np.zeros(problem.system.n - whole.n)])
    solver, data = problem.over(np.concatenate([[0.0], times]), y0)
    columns = problem.system.algebraic[1]
    x0, z0 = y0[: whole.nx] / whole.nominal, y0[columns]
    rows = [whole.names.index(name) for name in watched]

    def solve() -> tuple[Array, int]:
        found = solver(x0=x0, z0=z0, u=data)["xf"].full()
        return found[rows] * whole.nominal[rows, None], int(solver.stats()["nsteps"])

    solve()
    return Contender(solve)


def _tolerances(whole: System, rtol: float) -> Tolerances:
    return Tolerances(rtol, 0.1 * rtol * whole.nominal, 0.0, 10_000_000)


def _start(model: Model, times: Array) -> tuple[System, InputData, Array]:
    """System, inputs and consistent start of a model without parameters and inputs."""
    inputs = input_data(model, None, 0.0, float(times[-1]))
    whole = system(model, inputs)
    y = first_guess(whole, model, model.initial_state())
    return whole, inputs, consistent(whole, "bench", y, np.zeros(whole.d.numel()))


MAKERS: dict[str, tuple[str, Callable[..., Contender]]] = {
    "symfric": ("joint", ours),
    "symfric loop": ("joint", loop),
    "symfric absolute": ("absolute", ours),
    "rosenbrock absolute": ("absolute", partial(rosenbrock, explicit=False)),
    "rosenbrock absolute ode": ("absolute", partial(rosenbrock, explicit=True)),
    "rosenbrock joint": ("joint", partial(rosenbrock, explicit=False)),
    "rosenbrock joint ode": ("joint", partial(rosenbrock, explicit=True)),
    "idas GGL absolute": ("absolute", partial(idas, name="ggl")),
    "idas GGL joint": ("joint", partial(idas, name="ggl")),
    "idas absolute": ("absolute", partial(idas, name="sundials")),
    "idas joint": ("joint", partial(idas, name="sundials")),
}
"""Name -> formulation, and how a solver is made of its model; "ode": accelerations eliminated."""


def compiled(function: ca.Function) -> tuple[ca.Function, float]:
    """`function` from generated C, and what the compiler took [s]; never from a cache.

    Raises:
        CompileError: no compiler.
    """
    generator = ca.CodeGenerator(f"{function.name()}.c")
    generator.add(function)
    source = generator.dump()
    with TemporaryDirectory() as folder:
        library = Path(folder) / "generated.so"
        seconds = compile_time(source, library)
        return ca.external(function.name(), str(library)), seconds


def compile_time(source: str, target: str | Path = os.devnull) -> float:
    """Processor time [s] of the C compiler on `source`, with the flags that suit it best."""
    compiler = find_compiler()
    if compiler is None:
        raise no_compiler()
    before = os.times()
    compiler.run(*FASTEST, "-x", "c", "-", "-o", str(target), "-lm", code=source)
    after = os.times()
    user = after.children_user - before.children_user
    return user + after.children_system - before.children_system
