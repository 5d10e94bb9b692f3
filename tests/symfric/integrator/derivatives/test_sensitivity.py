"""Derivatives of a simulation: against closed forms, differences over a scan, and CasADi's own.

Gradients backwards, and derivatives by several names in lanes.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import casadi as ca
import numpy as np
import pytest
from backends import each_backend, needs_compiler
from differentiable import oscillator, pendulum, root, switched
from scipy.linalg import expm

import symfric as sf
from symfric import Hold, Linear, Model, Output, Variable, simulate
from symfric.foundation.numeric import Array
from symfric.integrator.compiled.columns import Columns
from symfric.integrator.derivatives.functions import FEW, MANY, lanes_source

LAWS: dict[str, sf.Law] = {"brown_mcphee": sf.BrownMcPhee(), "lugre": sf.LuGre()}
FREE = ("mu_s", "mu_d", "k")
each_law = pytest.mark.parametrize("law", LAWS)
x, p, t = Variable("x", "m", start=1.0), Variable("p", "1/s", start=0.5), ca.SX.sym("t")
X, P, r = x.symbol, p.symbol, ca.SX.sym("r")


def derivative(run: sf.Trajectory, name: str, signal: str) -> Array:
    return run.sensitivities[name][signal]


@cache
def freed(law: str) -> Model:
    return sf.rabinowicz(LAWS[law], free=[*FREE, "m"])


@each_law
@each_backend
def test_backward_and_forward_give_one_gradient(law: str, backend: str) -> None:
    """Times between the steps, states and outputs, parameters and start values."""
    model, rng = freed(law), np.random.default_rng(5)
    times = np.sort(rng.uniform(0.0, 9.0, 60))
    names = [*(v.name for v in model.p), *(f"x0.{v.name}" for v in model.x)]
    run = simulate(model, 9.0, x0={"v": 0.02}, t_eval=times, backend=backend, sensitivities=names)
    weights = {signal: rng.normal(size=60) for signal in ("x", "v", "friction", "power")}
    assert run.gradient(weights) == pytest.approx(summed(run, weights), rel=1e-9)


def summed(run: sf.Trajectory, weights: dict[str, Array]) -> dict[str, float]:
    """The gradient by the forward derivatives."""
    return {
        name: sum(float(w @ slopes[signal]) for signal, w in weights.items())
        for name, slopes in run.sensitivities.items()
    }


JUMPS = Hold([0.0, 0.3, 0.7], [1.0, -2.0, 3.0])
GROWN = Linear([0.0, 0.3, 0.7, 1.0], [0.0, 0.3, -0.5, 0.4])
"""The integral of `JUMPS`."""
Values = dict[str, complex]


def swinging(t: Array, v: Values) -> dict[str, Array]:
    A = np.array([[0.0, 1.0], [-v["k"], -v["c"]]])
    found = np.array([expm(one * A) @ [v["x0.x"], v["x0.v"]] for one in t]).T
    energy = v["k"] * found[0] ** 2 / 2 + found[1] ** 2 / 2
    return {"x": found[0], "v": found[1], "energy": energy}


def rooted(t: Array, v: Values) -> dict[str, Array]:
    x = (v["x0.x"] ** (2 / 3) - 2 / 3 * v["p"] ** (1 / 3) * t) ** 1.5
    return {"x": x, "z": (v["p"] * x) ** (1 / 3)}


def held(t: Array, v: Values) -> dict[str, Array]:
    x = v["x0.x"] * np.exp(-v["p"] * np.interp(t, GROWN.t, GROWN.values))
    level = np.asarray(JUMPS.values)[np.searchsorted(JUMPS.t, t, side="right") - 1]
    return {"x": x, "z": v["p"] * level * x}


def ramped(t: Array, v: Values) -> dict[str, Array]:
    """v' = u/m - c v/m with u = 3 - t from samples."""
    m, c = v["m"], 2.0
    steady = (3.0 - (t - m / c)) / c
    return {"v": steady + (v["x0.v"] - (3.0 + m / c) / c) * np.exp(-t * c / m)}


CLOSED: dict[str, tuple[Model, dict[str, Any], Callable[[Array, Values], dict[str, Array]]]] = {
    "oscillator": (oscillator(), {}, swinging),
    "algebraic": (root(), {}, rooted),
    "algebraic, with jumps": (switched(), {"u": {"u": JUMPS}}, held),
    "sampled input": (
        sf.drive(sf.Viscous(sigma_2=2.0), free=["m"]),
        {"u": {"force": Linear([0.0, 0.4, 1.1, 2.0], [3.0, 2.6, 1.9, 1.0])}}, ramped,
    ),
    "explicit time": (
        Model("swing", x=(x,), p=(p,), ode=P * ca.cos(t), t=t), {"t_start": -1.0},
        lambda t, v: {"x": v["x0.x"] + v["p"] * (np.sin(t) + np.sin(1.0))},
    ),
    "no parameters": (
        Model("decay", x=(x,), ode=-X), {}, lambda t, v: {"x": v["x0.x"] * np.exp(-t)}
    ),
    "mass matrix that is not constant": (
        Model("implicit", x=(x,), p=(p,), xdot=r, residual=(1 + r**2) * (r + P * X)), {},
        lambda t, v: {"x": v["x0.x"] * np.exp(-v["p"] * t)},
    ),
}  # fmt: skip
"""Model, arguments, and its solution; complex numbers carry a derivative in their imaginary part.

Solutions of the oscillator and the models without inputs are for inputs of zero.
"""


@each_backend
@pytest.mark.parametrize("case", CLOSED)
def test_derivatives_are_those_of_closed_forms(case: str, backend: str) -> None:
    """Between the steps, at jumps of inputs, forwards and backwards."""
    model, arguments, solution = CLOSED[case]
    at: Values = {v.name: float(v.start) for v in model.p}
    at |= {f"x0.{v.name}": float(v.start) for v in model.x}
    times = np.array([0.0, 0.1, 0.3, 0.30001, 0.377, 0.51, 0.7, 0.83, 1.0])
    run = simulate(
        model, 1.0, t_eval=times, rtol=1e-9, backend=backend, sensitivities=[*at], **arguments
    )
    for name in at:
        stepped = {k: complex(v, 1e-20 * (k == name)) for k, v in at.items()}
        for signal, values in solution(times, stepped).items():
            assert run[signal] == pytest.approx(values.real, rel=0, abs=1e-7)
            exact = values.imag / 1e-20
            assert derivative(run, name, signal) == pytest.approx(exact, rel=0, abs=3e-7), signal
    weights = {s: np.linspace(1.0, -2.0 * i, 9) for i, s in enumerate(model.signals, start=1)}
    assert run.gradient(weights) == pytest.approx(summed(run, weights), rel=1e-9)
    first = model.x[0].name
    assert run.gradient({first: 3.0}) == run.gradient({first: [3.0] * 9})


def test_bristle_in_steady_sliding_follows_parameters_and_start_velocity() -> None:
    """At t = 0 the bristle is z = g(v) sgn(v)/sigma_0 with g by mu_s: its derivatives by hand."""
    model, how = sf.rabinowicz(sf.LuGre(), free=["mu_s"]), {"t_eval": [0.0, 1.0]}
    names = ["mu_s", "x0.v", "x0.z"]
    run = simulate(model, 1.0, x0={"v": 0.099}, sensitivities=names, **how)
    v, v_s, mu_s, mu_d, load, sigma_0 = -1e-3, 1e-3, 0.15, 0.1, 0.8 * 9.81, 1e5
    stribeck = np.exp(-((v / v_s) ** 2))
    by_mu = -load * stribeck / sigma_0
    by_v = load * (mu_s - mu_d) * stribeck * 2 * v / v_s**2 / sigma_0
    assert derivative(run, "mu_s", "z")[0] == pytest.approx(by_mu, rel=1e-9)
    assert derivative(run, "x0.v", "z")[0] == pytest.approx(by_v, rel=1e-6)
    assert [derivative(run, "x0.z", s)[0] for s in ("z", "v")] == [1.0, 0.0]
    fixed = simulate(model, 1.0, x0={"z": 1e-5}, sensitivities=names[:2], **how)
    assert derivative(fixed, "mu_s", "z")[0] == derivative(fixed, "x0.v", "z")[0] == 0.0


def test_mechanism_starts_and_stays_on_its_constraints_with_its_derivatives() -> None:
    """The start (0.6, -0.8) l moves along the radius with l, and along the circle with x0."""
    names = ["l", "x0.x"]
    run = simulate(pendulum(), 1.0, samples=3, rtol=1e-10, sensitivities=names)
    start = [[derivative(run, name, signal)[0] for signal in ("x", "y")] for name in names]
    assert start == [pytest.approx([0.6, -0.8]), pytest.approx([0.64, 0.48])]
    for name, by_radius in (("l", 1.0), ("x0.x", 0.0)):
        along = run["x"] * derivative(run, name, "x") + run["y"] * derivative(run, name, "y")
        assert along == pytest.approx(np.full(3, by_radius), abs=1e-9)

        @cache
        def at(h: float, name: str = name) -> sf.Trajectory:
            changed = {"p": {"l": 1.0 + h}} if name == "l" else {"x0": {"x": 0.6 + h}}
            return simulate(pendulum(), 1.0, samples=3, rtol=1e-12, **changed)

        for signal in ("x", "vy", "lam"):
            quotient = (at(1e-5)[signal] - at(-1e-5)[signal]) / 2e-5
            assert derivative(run, name, signal) == pytest.approx(quotient, rel=1e-5, abs=1e-6)
    weights = {signal: np.array([1.0, -2.0, 0.5]) for signal in run.units}
    assert run.gradient(weights) == pytest.approx(summed(run, weights), rel=1e-9)


def test_derivatives_reach_as_far_as_an_interrupted_run() -> None:
    def interrupt(fraction: float) -> None:
        if fraction > 0:
            raise KeyboardInterrupt

    run = simulate(
        sf.rabinowicz(sf.LuGre(), free=["mu_s"]), 200.0, backend="vm", progress=interrupt,
        sensitivities=["mu_s"], rtol=1e-8,
    )  # fmt: skip
    assert run.status is sf.Status.INTERRUPTED
    slopes = derivative(run, "mu_s", "x")
    assert slopes.shape == run.t.shape
    assert 0 < run.t.size < 2001
    assert np.isfinite(slopes).all()


def test_run_that_failed_at_once_has_no_derivatives() -> None:
    below = Variable("p", "1", start=-1.0)
    model = Model("broken", x=(x,), p=(below,), ode=ca.sqrt(below.symbol) * X)
    run = simulate(model, 1.0, sensitivities=["p"], throw=False)
    assert not run.status.ok
    with pytest.raises(ValueError, match="expected sensitivities, got none"):
        _ = run.sensitivities
    with pytest.raises(sf.SolveError):
        simulate(model, 1.0, sensitivities=["p"])


def test_signal_without_weight_needs_no_derivative() -> None:
    """A distance that is zero has none."""
    x, y = Variable("x", "m", start=1.0), Variable("y", "m", start=1.0)
    apart = Output(ca.sqrt((x.symbol - y.symbol) ** 2 + (x.symbol**2 - y.symbol**2) ** 2), "m")
    model = Model("decay", x=(x, y), ode=-ca.vertcat(x.symbol, y.symbol), outputs={"apart": apart})
    run = simulate(model, 1.0, samples=2, rtol=1e-8, sensitivities=["x0.x"])
    assert np.isnan(run.gradient({"apart": 1.0})["x0.x"])
    assert run.gradient({"x": [0.0, 1.0]}) == pytest.approx({"x0.x": np.exp(-1.0)})


def pushed(linked: bool) -> ca.Function:
    """X' of x' = h sin(d x) cosh(x_1) + x, by one name, and a column of two parts of it."""
    X, y, h = ca.SX.sym("X", 2), ca.SX.sym("y", 2), ca.SX.sym("h")
    d, of_d = ca.SX.sym("d", 3), ca.SX.sym("of_d", 3)
    share, by_data = ca.SX.sym("share", 2), ca.SX.sym("by_data", 2)
    step = y + h * ca.sin(d[:2] * y) * ca.cosh(y[1]) / (1 + ca.exp(d[2])) + ca.fmax(y, d[0])
    along = ca.jtimes(step, y, X) + ca.jtimes(step, d, of_d)
    more, behind = [], along
    if linked:
        more, behind = [share, by_data], share[0] * along + share[1] * by_data
    column = ca.vertcat(along, behind * ca.cos(y))
    return ca.Function("one", [X, y, h, d, of_d, *more], [ca.densify(behind), ca.densify(column)])


@needs_compiler
@pytest.mark.parametrize(
    ("names", "linked"), [(2, True), (FEW, False), (FEW + 1, False), (MANY + 3, True)]
)
def test_sweep_in_lanes_has_the_bits_of_one_name_after_another(names: int, linked: bool) -> None:
    rng, one, steps = np.random.default_rng(names), pushed(linked), 7
    of_d = rng.normal(size=(3, names))
    rows = [rng.normal(size=(steps, k)) for k in (2, 1, 3)]
    link = rng.integers(0, 2, steps)
    share, by_data = rng.normal(size=(2, 2)), rng.normal(size=(2, names, 2))
    first = rng.normal(size=(names, 2))
    every = Columns(one, chained=True, source=lambda: lanes_source(one, of_d))
    every.function = ca.Function(  # of which the sizes count
        "every",
        [ca.SX.sym("X", 2, names), *(ca.SX.sym("a", k) for k in (2, 1, 3)),
         *([ca.SX.sym("s", 2), ca.SX.sym("b", 2, names)] if linked else [])],
        [ca.SX(ca.DM.ones(2, names)), ca.SX(ca.DM.ones(4 * names))],
    )  # fmt: skip
    more = [(share, link), (by_data.reshape(2, -1), link)] if linked else []
    behind, column = every([*rows, *more], first, "compiled")
    for i in range(names):
        own = [np.tile(of_d[:, i], (steps, 1))]
        own += [share[link], by_data[link, i]] if linked else []
        alone = Columns(one, chained=True)([*rows, *own], first[i], "vm")
        np.testing.assert_array_equal(behind.reshape(steps, names, 2)[:, i], alone[0])
        parts = column.reshape(steps, 2, names, 2)[:, :, i]
        np.testing.assert_array_equal(parts.reshape(steps, 4), alone[1])
