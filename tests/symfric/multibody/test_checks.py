"""Every mistake of a mechanism is described with its path, all in one error."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import casadi as ca
import numpy as np
import pytest
from chains import X, rod

from symfric import BrownMcPhee
from symfric.multibody import (
    Distance,
    Fixed,
    Floating,
    Gear,
    JointFriction,
    JointSpringDamper,
    Mechanism,
    PrescribedMotion,
    Prismatic,
    Revolute,
    Rolling,
    Screw,
    Spherical,
    SpringDamper,
    Universal,
    UserConstraint,
    UserForce,
)

LAW = BrownMcPhee()
J = (1.0, 1.0, 1.0)
Change = Callable[[Mechanism], object]


def body(*numbers: Any, **more: Any) -> Change:
    return lambda m: m.body("bob", *numbers, **more)


def joint(kind: Any, *given: Any, **more: Any) -> Change:
    return lambda m: m.joint(kind(*given, **more))


def force(kind: Any, *given: Any, **more: Any) -> Change:
    return lambda m: m.force(kind(*given, **more))


def of_bob(kind: Any, name: str, parent: str = "rod", **more: Any) -> Change:
    return lambda m: (m.body("bob", 1.0, J), m.joint(kind(name, parent, "bob", **more)))


def drive(name: str, *given: Any) -> Change:
    return lambda m: m.constraint(PrescribedMotion(name, *given))


def coupled(kind: Any, *given: Any) -> Change:
    return lambda m: m.constraint(kind("c", *given))


def held(expression: Callable[[Any], Any]) -> Change:
    return lambda m: m.constraint(UserConstraint("held", expression))


pushed = partial(force, UserForce, "push", "rod")
PUSH, HELD = "'push' > expression: expected a force and", "'held' > expression: expected one or a"
PIN, BOB, POSITIONS = ("pin", "rod", "ground"), "> body 'bob'", "expected positions only, got velo"

MISTAKES: list[tuple[Change, str]] = [
    (body(0.0, J), f"{BOB} > mass: expected > 0 kg, got 0"),
    (body("1", J), f"{BOB} > mass: expected a number [kg], got '1'"),
    (body(10**400, J), f"{BOB} > mass"),
    (body(np.inf, J), f"{BOB} > mass"),
    (body(ca.SX.sym("load"), J), f"{BOB}: expected only declared parameters, got load; pass the"),
    (body(1.0, (0, 0, 0)), f"{BOB} > inertia: expected positive principal moments, got 0, 0, 0"),
    (body(1.0, (1, 1, 1, 2, 0, 0)), "> inertia: expected positive principal moments, got -1, 1, 3"),
    (body(1.0, (1, 1, 3)), "largest principal moment to be at most the sum of the others, got 1, "),
    (body(1.0, (1, 1)), "> inertia: expected 3 or 6 numbers [kg m^2], got 2; write (Jxx, Jyy, Jzz"),
    (body(1.0, np.eye(3)), f"{BOB} > inertia: expected 3 or 6 numbers"),
    (body(1.0, (np.inf,) * 3), f"{BOB} > inertia"),
    (body(1.0, J), f"{BOB}: expected joints with coordinates up to the ground, found none; "
                   "a Floating joint lets it move freely"),
    (lambda m: m.body("the bob", 1.0, J), "body 'the bob': expected a name that is a C identifier"),
    (lambda m: m.body("hinge", 1.0, J), "> joint 'hinge': expected every name once"),
    (lambda m: [m.body("bob", 1.0, J) for _ in "ab"], f"{BOB}: expected every name once"),
    (lambda m: m.input("hinge", "N"), "> input 'hinge': expected every name once"),
    (lambda m: m.frame("bob.tip"), "> frame 'bob.tip': expected 'body.frame' of a known body"),
    (lambda m: m.frame("rod.tip", z=(0, 0, 0)), "'rod.tip' > z: expected three numbers that are"),
    (lambda m: m.frame("rod.hinge", z=X), "> frame 'rod.hinge': expected every name once"),
    (lambda m: m.joint("hinge"), "> joint: expected a Joint of symfric.multibody, got 'hinge'"),
    (joint(Fixed, "weld", "rodd", "ground"), "'weld': expected a body or 'body.frame', got rodd; di"
                                             "d you mean rod?"),
    (joint(Fixed, "weld", "rod.tip", "ground"), "expected one of the frames hinge, got rod.tip"),
    (joint(Fixed, "weld", "rod", "rod.hinge"), "'weld': expected two bodies, got rod twice"),
    (joint(Fixed, "weld", "", "ground"), "> joint 'weld': expected a body or 'body.frame', got "),
    (joint(Revolute, *PIN, axis=X), "got axis; the axis of a joint is the z"),
    (joint(Revolute, *PIN, friction=LAW), "expected JointFriction(law, radius=...), got Brown"),
    (joint(Revolute, *PIN, friction=JointFriction(LAW, radius=ca.SX.sym("R"))),
     "> joint 'pin' > friction: expected only declared parameters and inputs, got R"),
    (joint(Distance, "stay", "ground", "rod", length=0.0), "'stay' > length: expected > 0 m, got"),
    (joint(Distance, "stay", "ground.hinge", "rod.hinge", length=2.0),
     "> start: expected positions that satisfy stay_lambda, got -2; no position near it satis"),
    (of_bob(Floating, "pose", friction=JointFriction(LAW)),
     "> joint 'pose' > friction: expected a joint with friction"),
    (of_bob(Spherical, "ball", start=(1.0, 0.0)), "'ball' > start: expected 4 numbers, got 2"),
    (of_bob(Revolute, "pin", rate=np.nan), "'pin' > rate: expected finite numbers, got nan"),
    (force(SpringDamper, "s", "ground", "bob"), "'s': expected a body or 'body.frame', got bob"),
    (force(SpringDamper, "s", "ground", "rod", np.nan), "> stiffness: expected a finite number"),
    (force(SpringDamper, "s", "ground.hinge", "rod.hinge", 1.0, 0.1),
     "> force 's': expected a finite force at the start, got nan; do its places coincide"),
    (force(JointSpringDamper, "motor", "hing"), "> force 'motor': expected a joint, got hing"),
    (force(JointSpringDamper, "motor", "hinge", actuator=ca.SX.sym("torque")),
     "> force 'motor': expected only declared positions, velocities, time, parameters and inputs, "
     "got torque"),
    (force(JointSpringDamper, "motor", "hinge", "slide"), "> direction: expected turn, got slide"),
    (lambda m: (of_bob(Universal, "cross", "ground")(m), m.force(JointSpringDamper("e", "cross"))),
     "> force 'e' > direction: expected x or y, got none"),
    (drive("d", "hinge", 0.3), "> drive 'd' > motion: expected a function of time, got 0.3"),
    (drive("d", "y", lambda t: t), "> drive 'd': expected a joint, got y"),
    (drive("d", "hinge", lambda t: t, "slide"), "'d' > direction: expected turn, got slide"),
    (drive("d", "hinge", lambda t: ca.vertcat(t, t)), "> motion: expected one expression, got 2"),
    (drive("d", "hinge", lambda t: ca.SX.sym("w") * t),
     "> drive 'd': expected an expression of positions, time and parameters, got w; the two deriv"),
    (drive("d", "hinge", ca.sqrt), "start: expected a finite velocity of d_moment"),
    (drive("hinge", "hinge", lambda t: t), "> drive 'hinge': expected every name once"),
    (lambda m: (u := m.input("wish", "m"), drive("d", "hinge", lambda t: u)(m)),
     "got wish; the two derivatives of an input are unknown"),
    (lambda m: m.constraint(Screw("j", "a", 0.1, friction=None)),  # type: ignore[call-arg]
     "expected name, joint, lead, offset, got fric"),
    (coupled(Gear, "hinge", "r9", 2.0), "'c': expected a joint, got r9"),
    (coupled(Gear, "hinge", "r1", 0.0), "'c' > ratio: expected a finite number other than 0"),
    (coupled(Rolling, "hinge", "hinge", 1.0), "'c' > direction: expected turn, got slide"),
    (coupled(Rolling, "hinge", "r1", np.nan), "'c' > radius: expected a finite number"),
    (coupled(Screw, "hinge", 1.0), "'c' > direction: expected turn, got slide"),
    (coupled(Gear, "hinge", "hinge", 1.0, np.inf), "'c' > offset: expected a finite"),
    (coupled(Gear, "hinge", "hinge", 2.0), "'c' > expected two displacements, got turn of hinge"),
    (pushed(lambda kin: None), PUSH),
    (pushed(lambda kin: (0, 0, 0)), PUSH),
    (pushed(lambda kin: ((0, 0), (0, 0, 0))), PUSH),
    (pushed(lambda kin: ("abc", "def")), PUSH),
    (pushed(lambda kin: ((np.nan, 0, 0), (0, 0, 0))), PUSH),
    (pushed(lambda kin: (kin.point("c.x")[0], (0, 0, 0))), "expected a place 'body.frame', got c"),
    (held(lambda kin: None), HELD),
    (held(lambda kin: "z"), HELD),
    (held(lambda kin: kin.motion["rod"].R), HELD),
    (held(lambda kin: ca.SX(0, 1)), HELD),
    (held(lambda kin: kin.point("rod")[1][0]), f"constraint 'held' > expression: {POSITIONS}"),
]  # fmt: skip


@pytest.mark.parametrize("formulation", ["joint", "absolute"])
def test_mistakes_are_described_with_their_path(formulation: str) -> None:
    for change, message in MISTAKES:
        m = rod()
        with pytest.raises(ValueError) as caught:
            change(m)
            m.build(formulation=formulation)
        assert message in str(caught.value)
        assert "mechanism 'rod' > " in str(caught.value) or not message.startswith(">")


def test_mistakes_of_a_mechanism_as_a_whole() -> None:
    for m, message in (
        *((Mechanism(name), "> name: expected a C identifier") for name in ("a crank", "", "4bar")),
        (Mechanism("m", gravity=(0.0, -9.81)), "> gravity: expected three numbers [m/s^2]"),
        (Mechanism("m", gravity=(0.0, 0.0, 0.0)), "expected bodies that can move, got none"),
    ):
        m.body("stone", 1.0, J)
        m.joint(Fixed("foot", "ground", "stone"))
        with pytest.raises(ValueError) as caught:
            m.build()
        assert message in str(caught.value)


def test_all_mistakes_come_at_once_and_each_once() -> None:
    m = Mechanism("crank")
    m.body("a", -1.0, J)
    m.body("b", 1.0, (0.0, 1.0, 1.0))
    m.joint(Revolute("slider", "ground", "a", friction=JointFriction(LAW)))
    m.joint(Prismatic("slide", "a", "c"))
    with pytest.raises(ValueError) as caught:
        m.build()
    lines = str(caught.value).splitlines()
    assert len(lines) == 4
    assert all(line.startswith("mechanism 'crank' > ") for line in lines)
    assert any("joint 'slider' > friction" in line for line in lines)


def test_a_list_of_expressions_is_a_column() -> None:
    m = Mechanism("one")
    m.body("b", 1.0, J)
    m.joint(Floating("j", "ground", "b"))
    held(lambda kin: [kin.point("b")[0][1], kin.point("b")[0][2]])(m)
    assert [v.name for v in m.build().z] == ["held_lambda_1", "held_lambda_2", "j_norm"]
    m.bodies[1] = replace(m.bodies[1], mass=0.0)
    with pytest.raises(ValueError, match="formulation: expected one of joint, absolute, got abs"):
        m.build(formulation="abs")
