"""Forms of inputs: linear, cubic, polynomials; also with exact friction."""

import casadi as ca
import numpy as np
import pytest
from motions import double_integrator
from numpy.polynomial import polynomial
from tables import sampled

from ocp import (
    TIME,
    Free,
    Phase,
    Polynomial,
    Problem,
    absolute,
    integral,
    largest,
    soft,
    solve,
    verify_exactly,
)
from ocp.formulation.changed_models import Form
from symfric import BrownMcPhee, Model, Variable, drive
from symfric.multibody import read_urdf

MODEL = double_integrator()
EFFORT = integral(lambda s: s.a**2)
REST = {"x": 0.0, "v": 0.0}
OUT = Phase(MODEL, 1.0, start=REST, end={"x": 1.0, "v": 0.0}, name="out")


@pytest.mark.parametrize(
    ("form", "loss"),
    [
        ("constant", 0.12),
        ("linear", 0.0),
        ("cubic", 0.0),
        (Polynomial(1), 0.0),
        (Polynomial(0), None),
    ],
)
def test_rest_to_rest_in_every_form(form: Form, loss: float | None) -> None:
    problem = Problem(OUT, EFFORT, inputs={"a": form})
    move = solve(problem, intervals=10, refine=False, throw=False)
    if loss is None:  # a constant force cannot stop the mass
        assert not move.ok
    else:
        assert move.cost == pytest.approx(12.0 + loss, abs=2e-3)  # a = 6 - 12 t
        assert move.verified


def test_limits_of_a_robot_bound_its_fastest_move() -> None:
    """2 kg over 4 m with at most 9 N and 3 m/s: d/v + v m/F = 2 s."""
    m = read_urdf(
        '<robot name="slider"><link name="rail"/><link name="cart"><inertial><mass value="2"/>'
        '<inertia ixx="1" iyy="1" izz="1"/></inertial></link><joint name="slide" type="prismatic">'
        '<parent link="rail"/><child link="cart"/>'
        '<limit lower="-1" upper="5" effort="9" velocity="3"/></joint></robot>'
    )
    end = {"slide": 4.0, "slide_rate": 0.0}
    move = solve(Problem(Phase(m.build(), Free(0.5, 9.0), end=end), TIME))
    assert abs(move.T - 2.0) < 1e-4
    m.limits.clear()
    force = {"tau_slide": (-9.0, 9.0)}
    move = solve(Problem(Phase(m.build(), Free(0.5, 9.0), end=end, bounds=force), TIME))
    assert abs(move.T - 2 * np.sqrt(2 * 4 / 9)) < 1e-4


def test_cubic_input_is_a_spline_and_a_polynomial_is_one_per_phase() -> None:
    two = OUT >> Phase(MODEL, 1.0, end=REST, name="back")
    cubic = solve(Problem(OUT, EFFORT + integral(lambda s: 1e3 * s.x**2), inputs={"a": "cubic"}),
                  intervals=8, refine=False)  # fmt: skip
    nodes = cubic.motions[0].nodes
    t, a, slope = cubic.t[nodes], cubic["a"][nodes], cubic["a_rate"][nodes]
    third = cubic.controls["a_rate_rate_rate"]
    h = np.diff(t)
    assert np.allclose(np.diff(slope) / h, cubic["a_rate_rate"][nodes][:-1] + third * h / 2)
    assert a.size == 9
    poly = solve(Problem(two, EFFORT, inputs={"a": Polynomial(2)}), intervals=6, refine=False)
    assert poly.cost == pytest.approx(24.0, rel=1e-8)
    for phase in poly.phases:
        inside = (poly.t > phase.begin) & (poly.t < phase.end)
        fit = polynomial.Polynomial.fit(poly.t[inside], poly["a"][inside], 2)
        assert np.abs(fit(poly.t[inside]) - poly["a"][inside]).max() < 1e-8
    linear = solve(Problem(two, EFFORT, inputs={"a": "linear"}), intervals=6, refine=False)
    assert linear.cost == pytest.approx(24.0, rel=1e-8)


def test_rates_bound_every_form() -> None:
    forms: list[Form] = ["linear", "cubic", Polynomial(3)]
    for form in forms:
        smooth = {"inputs": {"a": form}, "rates": {"a": (-14.0, 14.0)}}
        cost = EFFORT + integral(lambda s: 1e3 * s.x**2)
        move = solve(Problem(OUT, cost, **smooth), intervals=20, refine=False, tolerance=1e-2)
        rate = move.controls["a_rate"] if form == "linear" else move["a_rate"]
        assert 13.9 < np.abs(rate).max() < 14.0001
        assert move.verified
    both = {"a": {"inputs": {"a": "quintic"}}, "b": {"inputs": {"b": "linear"}},
            "c": {"inputs": {"a": "constant"}, "rates": {"a": (-1.0, 1.0)}}}  # fmt: skip
    messages = {"a": "expected a as 'constant', .* got 'quintic'", "b": "expected one of a, got b",
                "c": "rates: expected a to be 'linear', .* got 'constant'"}  # fmt: skip
    for key, fields in both.items():
        with pytest.raises(ValueError, match=messages[key]):
            Problem(OUT, EFFORT, **fields)


@pytest.mark.parametrize("form", sampled(["cubic", "linear", Polynomial(3)], of=3))
def test_scenarios_share_the_whole_input(form: Form) -> None:
    x, v, force = Variable("x", "m"), Variable("v", "m/s"), Variable("force", "N")
    m = Variable("m", "kg", start=1.0)
    cart = Model("cart", x=(x, v), u=(force,), p=(m,), ode=ca.vertcat(v, force / m))
    out = Phase(cart, 1.0, start=REST, end={"x": (0.3, 2.0), "v": (-1.0, 1.0)})
    back = Phase(cart, 1.0, end={"x": (None, 0.1)})
    masses = {"light": {"m": 1.0}, "heavy": {"m": 1.4}}
    cost = integral(lambda s: s.force**2) + largest(lambda s: s.v)
    problem = Problem(out >> back, cost, scenarios=masses, inputs={"force": form})
    found = solve(problem, intervals=8, refine=False)
    light, heavy = (motion["force"] for motion in found.motions)
    assert np.allclose(light, heavy, atol=1e-8)
    assert np.ptp(light) > 1.0


@pytest.mark.slow
@pytest.mark.parametrize("form", ["linear", "cubic", Polynomial(3)])
def test_modes_with_every_form(form: Form) -> None:
    move = solve(_out_and_back(integral(lambda s: s.force**2), inputs={"force": form}), throw=False)
    assert move.modes["guide"]
    assert 36.9 < move.cost < 37.4  # 36.956 with jumps
    assert verify_exactly(move).largest < 1e-3
    assert move.miss < 2e-3


@pytest.mark.slow
def test_modes_with_soft_ends_totals_and_least_fuel() -> None:
    fuel = solve(_out_and_back(absolute(lambda s: s.force)))
    assert fuel.cost == pytest.approx(80 * (0.5 / 180) ** 0.5, rel=1e-4)  # 40 N, then slide to rest
    squares = integral(lambda s: s.force**2)
    ends = soft(lambda s: s.x >= 0.55, linear=100.0)
    move = solve(_out_and_back(squares, at={1.0: [ends]}))
    assert move.soft["out: condition 1 at the end"].violation == pytest.approx(0.05, abs=1e-6)
    cost, sums = largest(lambda s: abs(s.v)) + 1e-3 * squares, {"e": lambda s: s.force**2}
    found = solve(_out_and_back(cost, at={0.5: [lambda s: s.x <= 0.24]}, totals=sums))
    assert found.verified
    assert verify_exactly(found).largest < 1e-3
    assert found["e"][-1] == pytest.approx(
        found.cost * 1e3 - 1e3 * np.abs(found["v"]).max(), rel=1e-2
    )


def _out_and_back(cost: object, at: object = None, **fields: object) -> Problem:
    law = BrownMcPhee(mu_s=6.0, mu_d=4.0, mu_v=0.0, v_t=1e-5)
    model = drive(law, m=1.0, N=1.0)
    end = {"x": 0.5, "v": 0.0}
    out = Phase(model, 1.0, start=REST, end=end, name="out", at=at or {})  # pyright: ignore
    back = Phase(model, 1.0, end=REST, name="back")
    return Problem(out >> back, cost, bounds={"force": (-40.0, 40.0)}, **fields)  # pyright: ignore
