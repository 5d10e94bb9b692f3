"""Strange mechanisms end in a sentence, never in an error of CasADi."""

from collections.abc import Callable
from functools import partial
from typing import Any

import casadi as ca
import numpy as np
import pytest

from symfric.multibody import (
    Floating,
    Mechanism,
    PrescribedMotion,
    Revolute,
    Screw,
    UserConstraint,
    UserForce,
)


def body(mass: Any = 1.0, inertia: Any = (0.1, 0.1, 0.1)) -> Mechanism:
    m = Mechanism("one")
    m.body("b", mass, inertia)
    m.joint(Floating("j", "ground", "b"))
    return m


def pushed(expression: Callable[[Any], Any]) -> Mechanism:
    m = body()
    m.force(UserForce("push", "b", expression))
    return m


def held(expression: Callable[[Any], Any]) -> Mechanism:
    m = body()
    m.constraint(UserConstraint("held", expression))
    return m


WRONG: list[tuple[Callable[[], Any], str]] = [
    (lambda: body(mass=10**400), "body 'b' > mass"),
    (partial(Revolute, "j", "a", "b", axis=(0, 0, 1)), "got axis; the axis of a joint is the z"),
    (partial(Screw, "j", "a", 0.1, friction=None), "expected name, joint, lead, offset, got fric"),
    (lambda: body(mass=np.inf), "body 'b' > mass"),
    (lambda: body(inertia=(np.inf,) * 3), "body 'b' > .*inertia"),
    (lambda: pushed(lambda kin: None), "'push' > expression: expected a force and a moment"),
    (lambda: pushed(lambda kin: (0, 0, 0)), "'push' > expression: expected a force and a moment"),
    (lambda: pushed(lambda kin: ((0, 0), (0, 0, 0))), "'push' > expression: expected a force"),
    (lambda: pushed(lambda kin: ("abc", "def")), "'push' > expression: expected a force"),
    (lambda: pushed(lambda kin: ((np.nan, 0, 0), (0, 0, 0))), "'push' > expression: expected a"),
    (lambda: pushed(lambda kin: (kin.point("c.x")[0], (0, 0, 0))), "expected a place .*, got c.x"),
    (lambda: held(lambda kin: None), "'held' > expression: expected one or a column"),
    (lambda: held(lambda kin: "z"), "'held' > expression: expected one or a column"),
    (lambda: held(lambda kin: kin.motion["b"].R), "'held' > expression: expected one or a column"),
    (lambda: held(lambda kin: ca.SX(0, 1)), "'held' > expression: expected one or a column"),
]


def test_what_cannot_be_is_refused_in_a_sentence() -> None:
    for make, message in WRONG:
        for formulation in ("joint", "absolute"):
            with pytest.raises(ValueError, match=message):
                make().build(formulation=formulation)


def test_velocities_that_are_not_finite_are_named() -> None:
    m = Mechanism("one")
    m.body("b", 1.0, (0.1, 0.1, 0.1))
    m.joint(Revolute("j", "ground", "b"))
    m.constraint(PrescribedMotion("drive", "j", ca.sqrt))
    with pytest.raises(ValueError, match="start: expected a finite velocity of drive_moment"):
        m.build()


def test_a_list_of_expressions_is_a_column() -> None:
    m = held(lambda kin: [kin.point("b")[0][1], kin.point("b")[0][2]])
    assert [v.name for v in m.build().z] == ["held_lambda_1", "held_lambda_2", "j_norm"]
