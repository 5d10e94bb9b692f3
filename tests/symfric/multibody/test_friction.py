"""Normal forces of bearings from reactions, and what friction asks of a joint."""

import casadi as ca
import pytest

from symfric import BrownMcPhee
from symfric.laws import Karnopp
from symfric.multibody import JointFriction

LAW = BrownMcPhee()
F, T = ca.SX([3.0, -4.0, 5.0]), ca.SX([0.6, -0.8, 0.2])


def load(friction: JointFriction, slides: bool, turns: bool) -> float:
    return float(ca.DM(friction.normal_force(slides, turns, F, T)))


BEARING = JointFriction(LAW, radius=0.1, length=0.2, width=0.1, eps=1e-9)
"""Stations: f_2 = (0.8, 0.6) / 0.2 = (4, 3) N, f_1 = -(3, -4) - f_2 = (-7, 1) N."""


@pytest.mark.parametrize(
    ("slides", "turns", "expected"),
    [
        (True, True, 50.0**0.5 + 5.0),
        (False, True, 50.0**0.5 + 5.0 + 5.0),
        (True, False, 5.0 + 1.0 + 4.0 + 3.0 + 2.0),
    ],
    ids=["cylindrical", "revolute", "prismatic"],
)
def test_bearings_press_at_two_stations(slides: bool, turns: bool, expected: float) -> None:
    assert load(BEARING, slides, turns) == pytest.approx(expected, rel=1e-7)


def test_without_a_length_only_forces_press() -> None:
    assert load(JointFriction(LAW, radius=0.1, eps=1e-9), True, True) == pytest.approx(5.0)


def test_preload_adds_and_a_constant_force_replaces() -> None:
    preloaded = JointFriction(LAW, radius=0.1, preload=7.0, eps=1e-9)
    assert load(preloaded, True, True) == pytest.approx(12.0)
    assert load(JointFriction(LAW, normal=2.5), True, False) == 2.5


def test_an_unloaded_bearing_does_not_press_and_has_a_slope() -> None:
    f = ca.SX.sym("f", 3)
    N = JointFriction(LAW, radius=0.1).normal_force(False, True, f, ca.SX(3, 1))
    value, slope = ca.Function("N", [f], [N, ca.gradient(N, f)]).call([[0.0, 0.0, 0.0]])
    assert float(value) == 0.0
    assert slope.full() == pytest.approx(0.0)


def test_absent_reactions_leave_no_trace() -> None:
    N = BEARING.normal_force(True, False, ca.SX(3, 1), ca.SX(3, 1))
    assert N.is_constant()


@pytest.mark.parametrize(
    ("friction", "slides", "turns", "message"),
    [
        (JointFriction(LAW), False, True, "radius: expected the bearing's radius"),
        (JointFriction(Karnopp()), True, False, "got Karnopp, which needs F_e"),
        (JointFriction(LAW), False, False, "expected a revolute, prismatic or cylindrical joint"),
        (JointFriction(LAW, radius=-1.0), False, True, "radius: expected a number > 0, got -1"),
        (JointFriction(LAW, length=0.0), True, False, "length: expected a number > 0"),
        (JointFriction(LAW, preload=-1.0), True, False, "preload: expected a number >= 0"),
        (JointFriction(LAW, normal=float("nan")), True, False, "normal: expected a number >= 0"),
    ],
)
def test_bad_bearings_are_described(
    friction: JointFriction, slides: bool, turns: bool, message: str
) -> None:
    assert any(message in problem for problem in friction.problems(slides, turns))


def test_what_is_not_a_law_is_refused() -> None:
    with pytest.raises(ValueError, match="friction: expected a law such as"):
        JointFriction("lugre")  # type: ignore[arg-type]
