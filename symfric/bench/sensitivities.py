"""What derivatives cost: forward and backward over the plain run, beside CasADi's integrators."""

from collections.abc import Callable
from contextlib import redirect_stderr
from dataclasses import dataclass
from functools import partial
from io import StringIO
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.bench.timing import best_time
from symfric.foundation.compiler import find_compiler
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.equations.system import system
from symfric.integrator.peers.casadi_integrators import peer
from symfric.integrator.running.run import Tolerances
from symfric.integrator.simulate import simulate
from symfric.laws import Law
from symfric.model import Model
from symfric.results.trajectory import Trajectory
from symfric.scenes import rabinowicz

Array = NDArray[np.float64]
T_END, RTOL, V = 20.0, 1e-6, 0.02
FREE = ("mu_s", "mu_d", "k", "m", "v_belt", "g")


@final
@dataclass(frozen=True)
class SensitivityRow:
    """Derivatives of the end of a run by some parameters.

    Attributes:
        case: scene and law.
        integrator: who computed them.
        parameters: how many.
        rtol: tolerance.
        plain_s: time [s] of the run alone.
        forward, adjoint: time of the run with derivatives over that of the run alone; forward
            those of all states, adjoint the gradient of the position; None where it failed.
        error: largest relative error of a derivative of the position.
    """

    case: str
    integrator: str
    parameters: int
    rtol: float
    plain_s: float
    forward: float
    adjoint: float | None
    error: float


def measure_sensitivities(case: str, law: Law, quick: bool) -> list[SensitivityRow]:
    """Rows for one parameter and for all, ours in both engines and CasADi's integrators."""
    rows: list[SensitivityRow] = []
    engines = ["compiled", "vm"] if find_compiler() else ["vm"]
    for count in (1, len(FREE)):
        names = FREE[:count]
        model = rabinowicz(law, free=names)
        run = partial(_ours, model, "vm", names, rtol=1e-11)
        exact = np.array([run().sensitivities[name]["x"][0] for name in names])
        for backend in engines:
            rows.append(
                _measured(case, f"symfric {backend}", exact, *_of_ours(model, backend, names))
            )
        for plugin in () if quick else ("rosenbrock", "cvodes"):
            rows.append(_measured(case, f"casadi {plugin}", exact, *_of_peer(model, plugin)))
    return rows


Call = Callable[[], Array]


def _measured(
    case: str, integrator: str, exact: Array, plain: Call, forward: Call, adjoint: Call
) -> SensitivityRow:
    alone, _ = _time(plain)
    forward_s, found = _time(forward)
    try:
        with redirect_stderr(StringIO()):  # SUNDIALS says more than that it failed
            adjoint_s, _ = _time(adjoint)
    except RuntimeError:
        adjoint_s = None
    return SensitivityRow(
        case=case,
        integrator=integrator,
        parameters=exact.size,
        rtol=RTOL,
        plain_s=alone,
        forward=forward_s / alone,
        adjoint=None if adjoint_s is None else adjoint_s / alone,
        error=float(np.max(np.abs(found / exact - 1))),
    )


def _time(call: Call) -> tuple[float, Array]:
    """Shortest time of a call that is not the first: that one builds and compiles."""
    call()
    return best_time(call)


def _ours(model: Model, backend: str, names: tuple[str, ...], rtol: float = RTOL) -> Trajectory:
    return simulate(
        model, T_END, x0={"v": V}, rtol=rtol, t_eval=[T_END], backend=backend, sensitivities=names,
        method="radau5",
    )  # fmt: skip


def _of_ours(model: Model, backend: str, names: tuple[str, ...]) -> tuple[Call, Call, Call]:
    def plain() -> Array:
        return _ours(model, backend, ())["x"]

    def forward() -> Array:
        slopes = _ours(model, backend, names).sensitivities
        return np.array([slopes[name]["x"][0] for name in names])

    def adjoint() -> Array:
        return np.array(list(_ours(model, backend, names).gradient({"x": 1.0}).values()))

    return plain, forward, adjoint


def _of_peer(model: Model, plugin: str) -> tuple[Call, Call, Call]:
    """CasADi's integrator; start values that follow parameters are differentiated along."""
    inputs = input_data(model, None, 0.0, T_END)
    whole = system(model, inputs)
    tolerances = Tolerances(RTOL, 0.1 * RTOL * whole.nominal, 0.0, 10_000_000)
    name = "rosenbrock" if plugin == "rosenbrock" else "sundials"
    problem = peer(whole, inputs, model.values("p"), tolerances, name)
    solver = ca.integrator("solver", plugin, problem.dae, 0.0, T_END, problem.options)
    p, seed = ca.MX.sym("p", len(model.p)), ca.DM.eye(len(model.p))
    x0 = model.initial_state({"v": V}) / whole.nominal
    by_p = model.start_by_parameters({"v": V}) / whole.nominal[:, None]
    start = x0 + ca.mtimes(ca.DM(by_p), p - ca.DM(model.values("p")))
    x = solver(x0=start, p=p)["xf"]
    ahead = ca.Function("ahead", [p], [ca.jtimes(x, p, seed)])
    back = ca.Function("back", [p], [ca.gradient(x[0], p)])
    values = model.values("p")

    def forward() -> Array:
        return ahead(values).full()[0] * whole.nominal[0]

    return (
        lambda: solver(x0=x0, p=values)["xf"].full(),
        forward,
        lambda: back(values).full(),
    )
