"""phi1 and phi2 against their integral definitions; the method against closed forms."""

import casadi as ca
import numpy as np
import pytest
from closed_forms import assemble

from symfric import LuGre, Model, Variable, rabinowicz
from symfric.integrator.methods.families import SMALL, exp_phi1_phi2
from symfric.integrator.methods.tableaux import EXPONENTIAL
from symfric.integrator.step.attempt import build_fixed

x = ca.SX.sym("x")
VALUES = ca.Function("values", [x], exp_phi1_phi2(x)[1:])
SLOPES = ca.Function("slopes", [x], [ca.jacobian(phi, x) for phi in exp_phi1_phi2(x)[1:]])
NODES, WEIGHTS = (0.5 * part for part in np.polynomial.legendre.leggauss(40))
S = NODES + 0.5


@pytest.mark.parametrize(
    "at", [0.0, 1e-9, -1e-4, -0.999 * SMALL, -1.001 * SMALL, 0.5, -1.0, 2.0, -5.0, -20.0]
)
def test_values_are_the_integrals(at: float) -> None:
    phi1, phi2 = VALUES(at)
    assert float(phi1) == pytest.approx(WEIGHTS @ np.exp(at * S), rel=1e-13)
    assert float(phi2) == pytest.approx(WEIGHTS @ ((1 - S) * np.exp(at * S)), rel=3e-14 / SMALL)


@pytest.mark.parametrize("at", [-1e4, -1e12, -1e300])
def test_far_below_zero_they_tend_to_the_reciprocal(at: float) -> None:
    phi1, phi2 = VALUES(at)
    assert float(phi1) == -1 / at
    assert float(phi2) == pytest.approx(-1 / at, rel=2e-4)


def test_slopes_at_zero_are_those_of_the_series() -> None:
    assert [float(slope) for slope in SLOPES(0.0)] == pytest.approx([1 / 2, 1 / 6], rel=1e-14)


@pytest.mark.parametrize("rate", [1e-6, 1.0, 1e3, 1e9])
def test_equation_linear_in_its_unknown_is_solved_exactly(rate: float) -> None:
    """x' = 1 - rate x from 2."""
    v = Variable("x", "1", start=2.0)
    step = build_fixed(assemble(Model("affine", x=(v,), ode=1 - rate * v.symbol)), EXPONENTIAL)
    exact = 2 * np.exp(-rate) - np.expm1(-rate) / rate
    assert float(step(2.0, 1.0, [])) == pytest.approx(exact, rel=1e-13)


def test_bristles_stay_within_their_travel_at_any_step() -> None:
    """|z| <= g/sigma_0 at the friction's peak, though sigma_0 |v| h / g is a thousand."""
    model = rabinowicz(LuGre())
    step = build_fixed(assemble(model), EXPONENTIAL)
    limit = 0.8 * 9.81 * LuGre().mu_s / LuGre().sigma_0
    for v in (-3.0, -0.1, 0.3, 3.0):
        z = float(step([0.0, v, 0.0], 0.1, [])[2])
        assert abs(z) <= limit * (1 + 1e-12)
        assert np.sign(z) == np.sign(v - 0.1)


def test_only_unknowns_with_their_own_slope_cost_an_exponential() -> None:
    x, v = Variable("x", "m"), Variable("v", "m/s")
    model = Model("fall", x=(x, v), ode=ca.vertcat(v.symbol, 9.81 - 0.1 * v.symbol))
    step = build_fixed(assemble(model), EXPONENTIAL)
    codes = [step.instruction_id(k) for k in range(step.n_instructions())]
    assert codes.count(ca.OP_EXPM1) == 1
