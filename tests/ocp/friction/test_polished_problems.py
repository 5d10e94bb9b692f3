"""Problems that reverse and rest on the way, by modes, judged by exact Coulomb friction."""

import casadi as ca
import pytest

from ocp.formulation.expressions import integral
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.friction.event_check import verify_exactly
from ocp.problems import cart_pendulum, load_through_spring
from ocp.solve import solve
from symfric.foundation.parameters import Variable
from symfric.laws import BrownMcPhee
from symfric.model import Contact, Model


def two_blocks() -> Problem:
    """1 kg under a force, and 0.5 kg behind it on a spring of 100 N/m: 0.4 m there and back."""
    x1, x2 = (Variable(name, "m", nominal=0.1) for name in ("x1", "x2"))
    v1, v2 = (Variable(name, "m/s", nominal=0.1) for name in ("v1", "v2"))
    force = Variable("force", "N", nominal=10.0)
    spring = 100.0 * (x1.symbol - x2.symbol) + (v1.symbol - v2.symbol)
    one = Contact("one", v1.symbol, 1.0, BrownMcPhee(mu_s=3.0, mu_d=2.0, mu_v=0.2, v_t=1e-5))
    two = Contact("two", v2.symbol, 1.0, BrownMcPhee(mu_s=1.5, mu_d=1.0, mu_v=0.1, v_t=1e-5))
    model = Model(
        "two_blocks",
        x=(x1, x2, v1, v2),
        u=(force,),
        ode=ca.vertcat(
            v1.symbol,
            v2.symbol,
            force.symbol - spring - one.force,
            (spring - two.force) / 0.5,
        ),
        contacts=(one, two),
    )
    rest = {"x1": 0.0, "x2": 0.0, "v1": 0.0, "v2": 0.0}
    there = Phase(model, T=1.0, start=rest, end={"x2": 0.4})
    back = Phase(model, T=1.0, end=rest)
    cost = integral(lambda s: s.force**2)
    return Problem(there >> back, cost, bounds={"force": (-30.0, 30.0)})


@pytest.mark.slow
def test_cart_rests_on_the_way_and_lands_with_exact_friction() -> None:
    solution = solve(cart_pendulum(1e-5), friction="modes")
    assert solution.cost == pytest.approx(71.534, rel=1e-3)
    assert [mode.kind for mode in solution.modes["x"]] == ["slip+", "slip-", "stick", "slip+"]
    assert verify_exactly(solution, tolerance=1e-4).ok


@pytest.mark.slow
def test_load_behind_a_spring_rests_until_the_spring_breaks_it_away() -> None:
    solution = solve(load_through_spring(1e-5), friction="modes")
    assert solution.modes["load"][0].kind == "stick"
    assert verify_exactly(solution, tolerance=1e-4).ok


@pytest.mark.slow
def test_two_contacts_change_their_modes_one_by_one() -> None:
    solution = solve(two_blocks(), friction="modes")
    assert solution.cost < 28.0
    assert {mode.kind for modes in solution.modes.values() for mode in modes} == {
        "slip+",
        "slip-",
        "stick",
    }
    assert verify_exactly(solution, tolerance=1e-4).ok
