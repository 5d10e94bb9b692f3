"""Curves of special points in two parameters against closed forms."""

from typing import Any

import casadi as ca
import numpy as np
import pytest

from symfric import ExactCoulomb, Model, Variable, contact
from symfric.dynamics import boundary, continuation, equilibrium


def damped_belt(scale: float) -> Model:
    """Block on a belt with a damper to the ground; lengths are multiples of `scale` [m]."""
    x, v = Variable("x", "m", nominal=scale), Variable("v", "m/s", nominal=scale)
    v_b = Variable("v_b", "m/s", start=0.5 * scale, nominal=scale)
    c = Variable("c", "N s/m", start=0.3 / scale, nominal=1 / scale)
    law = ExactCoulomb(mu_s=0.3, mu_d=0.2, v_s=0.2 * scale, form="stribeck")
    pull = -4 / scale * x.symbol - c * v
    slip = contact("belt", law, v - v_b, 10.0, {"v": v_b.symbol}, F_e=pull)
    ode = ca.vertcat(v.symbol, (pull - slip.force) * scale)
    return Model("belt", x=(x, v), p=(v_b, c), ode=ode, contacts=(slip,))


@pytest.mark.slow
def test_hopf_points_are_where_damping_equals_the_slope_of_friction() -> None:
    for scale in (1e-6, 1e3):
        model = damped_belt(scale)
        rest = continuation(equilibrium(model), "v_b", (1e-3 * scale, scale))
        for hopf in rest.located("Hopf"):
            found = boundary(rest, hopf, "c", (0.1 / scale, 6.0 / scale), step=0.15)
            v, c = found.values.T
            share = v / (0.2 * scale)
            assert c == pytest.approx(10 / scale * share * np.exp(-(share**2)), rel=1e-9)
            assert found.periods == pytest.approx(np.full(v.size, np.pi), rel=1e-9)
            assert c.max() * scale == pytest.approx(10 * np.sqrt(0.5) * np.exp(-0.5), rel=0.03)
            assert found.message == "ends at the given range"
            assert "Hopf points of 'belt'" in repr(found)
            (axis,) = found.plot().axes
            assert axis.get_xlabel() == "c [N s/m]" and axis.get_ylabel() == "v_b [m/s]"


def test_folds_meet_in_a_cusp() -> None:
    # x' = p + q x - x^3 has folds at 27 p^2 = 4 q^3
    x, p, q = Variable("x", "1", start=1.5), Variable("p", "1"), Variable("q", "1", start=1.0)
    model = Model("cusp", x=(x,), p=(p, q), ode=p + q * x - x**3)
    rest = continuation(equilibrium(model), "p", (-1.0, 1.0))
    assert len(rest.located("fold")) == 2
    found = boundary(rest, rest.located("fold")[0], "q", (-0.5, 2.0))
    p_, q_ = found.values.T
    assert 27 * p_**2 == pytest.approx(4 * q_**3, rel=1e-8, abs=1e-9)
    assert np.ptp(p_) > 2.0 and q_.min() < 1e-2 and not found.periods.any()


def test_what_has_no_boundary_is_refused() -> None:
    model = damped_belt(1.0)
    rest = continuation(equilibrium(model), "v_b", (0.1, 0.6))
    (hopf,) = rest.located("Hopf")
    good = dict[str, Any](branch=rest, special=hopf, parameter="c", between=(0.1, 1.0))
    bad: list[tuple[dict[str, Any], str]] = [
        ({"branch": None}, "branch: expected a branch of `continuation`, got None"),
        ({"special": 0}, "special: expected a Hopf point or a fold of .*, got 0"),
        ({"parameter": "v_b"}, "expected one of c, got v_b"),
        ({"between": (0.5, 1.0)}, "contains the start, c = 0.3"),
        ({"between": (0.5, -1.0)}, "contains the start"),
        ({"between": (0.1,)}, r"between: expected two numbers, got \(0.1,\)"),
        ({"between": (0.1, 0.5, 1.0)}, "between: expected two numbers"),
        ({"between": (0.1, 1e9)}, "boundary: no curve at the start: .*; take a range near"),
        ({"step": 0}, "step: expected a number > 0 and <= 1, got 0"),
    ]
    for changed, text in bad:
        with pytest.raises(ValueError, match=text):
            boundary(**good | changed)
    with pytest.raises(ValueError, match="a Hopf point or a fold"):
        boundary(continuation(equilibrium(model), "v_b", (0.4, 0.6)), hopf, "c", (0.1, 1.0))
