"""Gradients backwards, and derivatives by several names in lanes."""

import casadi as ca
import numpy as np
import pytest
from backends import needs_compiler

from symfric import Model, Output, Variable, simulate
from symfric.integrator.compiled.columns import Columns
from symfric.integrator.derivatives.functions import FEW, MANY, lanes_source


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
