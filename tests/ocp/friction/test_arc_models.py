"""Conditions of arcs as outputs of mode models, by numbers."""

import casadi as ca
import pytest

from ocp.friction.transfer import STOPPED, arc_model
from ocp.problems import load_through_spring


@pytest.mark.parametrize(
    ("side", "stretch", "left"),
    [(1, 0.019, 0.0), (1, 0.02, -0.2), (-1, -0.019, 0.0), (-1, 0.01, 5.8)],
)
def test_a_stop_keeps_away_from_the_sliding_force(side: int, stretch: float, left: float) -> None:
    """200 N/m hold a load that slides against 4 N: 5 % less than that is allowed where it stops."""
    model = load_through_spring().chain[0].model
    made = arc_model(model, {"load": 0}, (), {}, {}, {"load": side}, {"load": 6.0}, (0.01, 0.002))
    symbols = [made.vector("x"), made.vector("z"), made.vector("u"), made.vector("p")]
    room = ca.Function("room", symbols, [made.expression(f"load{STOPPED}")])
    p = made.values("p", {})
    assert float(room([stretch, 0, 0, 0], 0, 0, p)) * 6.0 == pytest.approx(left, abs=1e-5)
