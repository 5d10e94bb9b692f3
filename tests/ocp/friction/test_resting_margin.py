"""How close rests come to their static levels, and what that costs."""

import re

import casadi as ca
import pytest

from ocp.formulation.expressions import at_end
from ocp.formulation.phase import FREE, Phase
from ocp.formulation.problem import Problem
from ocp.friction.arcs import in_arcs
from ocp.friction.sequence import Run, Track, cut
from ocp.problems import out_and_back
from ocp.solve import solve
from symfric import BrownMcPhee, Contact, Model, Variable

PUSH, MOST = 2.0, 5.0
"""mu g of a part on a tray, and the largest acceleration of the tray [m/s^2]."""
BEST = (MOST - PUSH**2 / MOST) / 16.0
"""How far the part comes in a cycle of 1 s: it rests under PUSH, and slides under -MOST [m]."""


def conveyor() -> Problem:
    """A part on a shaken tray, as far as it goes in a period."""
    tray, part = (Variable(name, "m", nominal=0.1) for name in ("tray", "part"))
    v_tray, v_part = (Variable(name, "m/s") for name in ("v_tray", "v_part"))
    w = Variable("w", "m/s^2", lower=-MOST, upper=MOST, nominal=MOST)
    law = BrownMcPhee(mu_s=PUSH, mu_d=PUSH, v_t=1e-5)
    bed = Contact("bed", v_part.symbol - v_tray.symbol, 1.0, law)
    model = Model(
        "conveyor", x=(tray, v_tray, v_part, part), u=(w,), contacts=(bed,),
        ode=ca.vertcat(v_tray.symbol, w.symbol, -bed.force, v_part.symbol),
    )  # fmt: skip
    start = {"tray": 0.0, "part": 0.0, "v_tray": FREE, "v_part": FREE}
    names = ["tray", "v_tray", "v_part"]
    return Problem(Phase(model, 1.0, start=start), at_end(lambda s: -s.part), periodic=names)


def told(message: str) -> tuple[float, float]:
    """Margin and its cost, as a message has them."""
    found = re.search(r"Rests keep (\S+) of .*, which costs about (\S+) of", message)
    assert found is not None, message
    return float(found[1]), float(found[2])


@pytest.mark.slow
def test_a_conveyor_comes_as_far_as_its_closed_form() -> None:
    found = solve(conveyor())
    assert found.verified
    assert -found.cost == pytest.approx(BEST, rel=1e-3)
    margin, cost = told(found.message)
    assert margin == 1e-4
    assert -found.cost + cost == pytest.approx(BEST, rel=5e-4)


@pytest.mark.slow
def test_a_wide_margin_says_what_it_costs() -> None:
    found = solve(conveyor(), resting_margin=0.02)
    margin, cost = told(found.message)
    assert found.verified
    assert margin == 0.02
    assert cost > 0.01 * BEST
    assert -found.cost + cost == pytest.approx(BEST, rel=2e-3)


@pytest.mark.parametrize("margin", [1e-2, 1e-4])
def test_rests_keep_their_margin(margin: float) -> None:
    problem = out_and_back()
    track = Track("guide", (Run(0, 0.0, 0.1), Run(1, 0.1, 1.0), Run(-1, 1.0, 2.0)))
    legs = cut([track], (0, 0), 0.0, 1.0), cut([track], (1, 0), 1.0, 2.0)
    arcs = in_arcs(problem, legs, {"guide": 1.0}, ("guide",), 1e-4, margin)
    rest, slip, _ = arcs.chain
    assert rest.bounds["guide_up"] == (margin, None)
    assert rest.start["guide_first_down"] == (margin, None)
    assert slip.start["guide_pull"] == (margin, None)


@pytest.mark.parametrize("margin", [0.0, -1e-3, 0.2, float("nan"), "a", True, None, 10**400])
def test_margins_that_are_none_are_refused(margin: object) -> None:
    with pytest.raises(ValueError, match="solve: resting_margin: expected a number > 0"):
        solve(out_and_back(), resting_margin=margin)  # pyright: ignore[reportArgumentType]
