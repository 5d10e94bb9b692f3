"""Gradients backwards, and derivatives by several names in lanes."""

import casadi as ca
import numpy as np
import pytest
from backends import needs_compiler
from differentiable import oscillator, pendulum, root, switched
from numpy.typing import NDArray

import symfric as sf
from symfric.integrator.compiled.columns import Columns
from symfric.integrator.derivatives.functions import FEW, MANY, lanes_source

Array = NDArray[np.float64]
LAWS: dict[str, sf.Law] = {"brown_mcphee": sf.BrownMcPhee(), "lugre": sf.LuGre()}


def summed(run: sf.Trajectory, weights: dict[str, Array]) -> dict[str, float]:
    """What the gradient must be, by the forward derivatives."""
    return {
        name: sum(float(w @ slopes[signal]) for signal, w in weights.items())
        for name, slopes in run.sensitivities.items()
    }


@pytest.mark.parametrize("backend", ["vm", "compiled"])
@pytest.mark.parametrize("law", LAWS)
def test_backward_and_forward_give_one_gradient(law: str, backend: str) -> None:
    """Times between the steps, states and outputs, parameters and start values."""
    model, rng = sf.rabinowicz(LAWS[law], free=["mu_s", "mu_d", "k", "m"]), np.random.default_rng(5)
    times = np.sort(rng.uniform(0.0, 9.0, 60))
    names = [*(v.name for v in model.p), *(f"x0.{v.name}" for v in model.x)]
    run = sf.simulate(
        model, 9.0, x0={"v": 0.02}, t_eval=times, backend=backend, sensitivities=names
    )
    weights = {signal: rng.normal(size=60) for signal in ("x", "v", "friction", "power")}
    assert run.gradient(weights) == pytest.approx(summed(run, weights), rel=1e-9)


def models() -> dict[str, tuple[sf.Model, dict[str, sf.Hold | sf.Linear]]]:
    return {
        "algebraic": (root(), {}),
        "mechanism": (pendulum(), {}),
        "jumps of algebraic unknowns": (
            switched(), {"u": sf.Hold([0.0, 0.3, 0.7], [1.0, -2.0, 3.0])}
        ),
        "sampled input": (oscillator(), {"u": sf.Linear([0.0, 0.35, 0.8], [1.0, -2.0, 0.5])}),
    }  # fmt: skip


@pytest.mark.parametrize("case", models())
def test_gradient_of_every_kind_of_model(case: str) -> None:
    model, u = models()[case]
    names = [*(v.name for v in model.p), *(f"x0.{v.name}" for v in model.x)]
    # the ends of the run and of the input intervals among the times
    times = np.array([0.0, 0.1, 0.3, 0.35, 0.5, 0.7, 0.8, 1.0])
    run = sf.simulate(model, 1.0, u=u, t_eval=times, rtol=1e-9, sensitivities=names)
    weights = {
        signal: np.linspace(1.0, -2.0 * i, 8) for i, signal in enumerate(model.signals, start=1)
    }
    assert run.gradient(weights) == pytest.approx(summed(run, weights), rel=1e-10)


def test_signal_without_weight_needs_no_derivative() -> None:
    """A distance that is zero has none."""
    x, y = sf.Variable("x", "m", start=1.0), sf.Variable("y", "m", start=1.0)
    apart = sf.Output(ca.sqrt((x.symbol - y.symbol) ** 2 + (x.symbol**2 - y.symbol**2) ** 2), "m")
    model = sf.Model(
        "decay", x=(x, y), ode=-ca.vertcat(x.symbol, y.symbol), outputs={"apart": apart}
    )
    run = sf.simulate(model, 1.0, samples=2, rtol=1e-8, sensitivities=["x0.x"])
    assert np.isnan(run.gradient({"apart": 1.0})["x0.x"])
    assert run.gradient({"x": [0.0, 1.0]}) == pytest.approx({"x0.x": np.exp(-1.0)})


def test_gradient_of_a_cost_meets_its_difference_quotient() -> None:
    """J = sum_i (x(t_i) - 1/10)^2 of the oscillator, whose weights are dJ/dx(t_i)."""

    def cost(k: float) -> float:
        run = sf.simulate(oscillator(), 5.0, samples=21, rtol=1e-11, p={"k": k})
        return float(((run["x"] - 0.1) ** 2).sum())

    run = sf.simulate(oscillator(), 5.0, samples=21, rtol=1e-11, sensitivities=["k"])
    found = run.gradient({"x": 2 * (run["x"] - 0.1)})["k"]
    assert found == pytest.approx((cost(4.0 + 1e-4) - cost(4.0 - 1e-4)) / 2e-4, rel=1e-6)


def test_one_weight_counts_for_all_times() -> None:
    run = sf.simulate(oscillator(), 2.0, samples=5, sensitivities=["k"])
    assert run.gradient({"x": 3.0}) == run.gradient({"x": [3.0] * 5})


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        ({"y": 1.0}, "gradient: expected one of x, v, u, energy, got y"),
        ({"x": [1.0, 2.0]}, r"expected numbers or arrays of 5 weights, got x of shape \(2,\)"),
    ],
)
def test_bad_weights_are_refused(weights: dict[str, object], message: str) -> None:
    run = sf.simulate(oscillator(), 2.0, samples=5, sensitivities=["k"])
    with pytest.raises(ValueError, match=message):
        run.gradient(weights)  # pyright: ignore[reportArgumentType]


def test_gradient_that_was_not_asked_for_is_missed_by_name() -> None:
    with pytest.raises(ValueError, match="expected sensitivities, got none"):
        sf.simulate(oscillator(), 1.0).gradient({"x": 1.0})


pytestmark = needs_compiler


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
